//! What a run says about itself, for people and for machines. Pure.

pub mod plot;
pub mod stamps;
pub mod summary;
