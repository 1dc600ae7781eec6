//! What a run says about itself, for people and for machines. Pure.

pub mod findings;
pub mod plot;
pub mod simulation;
pub mod stamps;
pub mod summary;
