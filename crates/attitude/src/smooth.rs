//! A whole recording -> its attitudes, better than any stream can give, and what it tells of the sensor. Pure.
//!
//! A stage of its own because it knows the future: attitude, velocity, position and gyro bias at nodes half a second
//! apart, and the constants of gyro, accelerometer and magnetometer, are solved for at once from all samples. Nodes
//! are held in memory; samples are read again in each pass.
//!
//! ```text
//! samples -> interval, step of the rates                              survey
//! samples -> those that can be used, without holes                    prepare, bridge
//! -> segments between nodes, standstill                               segments, rests
//! -> attitudes to begin with                                          start, realtime
//! -> the axis that stays vertical, about which the bias is held       planar
//! segment -> turn, push, way, and their derivatives                   sweep
//! -> normal equations                                                 factors, border, motion, heading
//! -> corrections, covariance                                          solver
//! again, without the field and with it                                pass, phase, work
//! -> attitude at every sample                                         smoothed, output
//! ```
//!
//! # Frames
//! Earth axes: x east, y north (magnetic, with a field; the heading of the start without), z up. Errors of attitudes
//! are rotation vectors in earth axes, from the left.
//!
//! # Source
//! `docs/theory/smoother.md`: the model, where it comes from, what it was judged on.
//!
//! # Example
//! ```
//! use strapd_attitude::frames::In;
//! use strapd_attitude::quaternion::BodyRate;
//! use strapd_attitude::record::Nanos;
//! use strapd_attitude::smooth::{Outcome, Sample, Settings, smooth};
//!
//! // At rest for a minute, tilted by 0.1 rad; a gyro with a bias of 0.6 deg/s.
//! let samples: Vec<Sample> = (0..6000)
//!     .map(|i| Sample {
//!         stamp: Nanos(i * 10_000_000),
//!         rate: BodyRate([0.01, 0.0, 0.0].into()),
//!         force: Some(In::assume([0.0, 9.81 * 0.1_f64.sin(), 9.81 * 0.1_f64.cos()].into())),
//!         field: None,
//!         is_saturated: false,
//!     })
//!     .collect();
//! let smoothed = smooth(&mut samples.as_slice(), &Settings::default())?;
//! assert_eq!(smoothed.outcome(), Outcome::Converged);
//! let mut attitudes = Vec::new();
//! smoothed.attitudes(&mut samples.as_slice(), |chunk| attitudes.extend_from_slice(chunk))?;
//! assert_eq!(attitudes.len(), samples.len());
//! let roll = attitudes[3000].q_nb.yaw_pitch_roll().roll;
//! assert!((roll - 0.1).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(
    clippy::needless_range_loop,
    reason = "an index here is a state, and often runs through several arrays"
)]

mod border;
mod bridge;
mod error;
mod factors;
mod gate;
mod heading;
mod motion;
mod output;
mod pass;
mod phase;
mod planar;
mod prepare;
mod prepared;
mod realtime;
mod rests;
mod result;
mod sample;
mod segments;
mod settings;
mod smoothed;
mod solver;
mod start;
mod survey;
mod sweep;
#[cfg(test)]
mod tests;
mod work;

pub(crate) use border::{FORCE_BIAS_SIGMA, FORCE_SCALE};
pub use error::SmoothError;
pub use output::Estimate;
pub use phase::Failure;
pub use planar::HeldBias;
pub(crate) use result::OBSERVED;
pub use result::{Bias, Calibration, Counts, Estimated, Magnetometer, Outcome, Section, Sizes};
pub use sample::{Sample, Samples};
pub(crate) use settings::BIAS_SIGMA;
pub use settings::{
    FieldUnit, HeadingReference, MotionModel, OtherClass, PriorScale, PriorSigmas, SampleModel,
    Settings,
};
pub use smoothed::Smoothed;
pub use survey::Quantisation;
pub use work::smooth;
