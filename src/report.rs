//! Facts of a run about itself, drawn. Pure.

pub mod page;
pub mod plot;

pub use strapd_replay::findings;
pub use strapd_replay::summary::{
    self, against, aid, calendar, calibrating, calibration, series, smoothing, trace, warming,
};
