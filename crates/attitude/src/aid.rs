//! Specific force and field -> corrections of the attitude and of the sensor. Pure.
//!
//! A stage of its own because it decides what is believed: the propagator integrates what it is given, and
//! this says what to give it and how far off the result is. A Kalman filter of 21 error states rides on the
//! propagator and corrects tilt, gyro bias, scale and axes by gravity, and heading by a magnetometer.
//!
//! ```text
//! rate - what is known of the sensor -> propagate -> attitude   calibration
//! attitude, rate, force, field -> sums over 0.1 s               interval
//! sums -> covariance a step on                                  covariance
//! force less gravity -> tilt, calibration                       gravity
//! corrections of the bias -> how far it drifts                  drift
//! the vertical in the body -> what gravity can say of a bias    vertical
//! rate at rest -> bias                                          rest
//! heading of the field -> heading                               heading
//! correction -> left of the attitude                            update
//! first force, field -> level, north                            start
//! headings of other devices -> heading                         outside_heading
//! vectors at stamps of their own -> those of a gyro sample      beside
//! first forces -> whether they are specific forces              plausibility
//! ```
//!
//! Rotations by a left factor commute with integration, so the propagator never sees the attitude jump.
//!
//! # Frames
//! Earth axes E: z up, heading that of the start (of magnetic north with a magnetometer, x east). Body axes as
//! the propagator's. The error is `R_true = Rz(heading) exp(tilt) R`: no gravity can touch heading but through
//! what it learns of the sensor.
//!
//! # Source
//! `docs/theory/filter.md`: the model, where it comes from, what it was judged on.
#![allow(
    clippy::needless_range_loop,
    reason = "an index here is a state, and often runs through several arrays"
)]

mod aided;
mod beside;
mod calibration;
mod covariance;
mod drift;
mod evidence;
mod filter;
mod gravity;
mod heading;
mod interval;
mod linear_acceleration;
mod memory;
mod other_class;
mod outside_heading;
mod plausibility;
mod prior;
mod residuals;
mod rest;
mod settings;
mod start;
mod state;
mod surroundings;
#[cfg(test)]
mod tests;
mod update;
mod vertical;
mod world;

pub use aided::{AidedPropagator, Start};
pub(crate) use beside::VectorPairing;
pub use calibration::Calibration;
pub use filter::{Filter, Innovation, Report};
pub use heading::FieldQuality;
pub use memory::Memory;
pub use other_class::OtherClass;
pub use outside_heading::{OutsideHeading, OutsideHeadingCounts};
pub(crate) use plausibility::is_gravity;
pub use prior::Prior;
pub use settings::Settings;
