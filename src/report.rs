//! What a run says about itself, for people and for machines. Pure.

pub mod against;
pub mod aid;
pub mod calendar;
pub mod calibrating;
pub mod calibration;
pub mod findings;
pub mod page;
pub mod plot;
pub mod series;
pub mod sigma;
pub mod simulation;
pub mod smoothing;
pub mod stamps;
pub mod summary;
pub mod trace;
