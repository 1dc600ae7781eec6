//! Attitude from gyro samples. Pure: no I/O, no clock, no logging, no randomness but a passed seed.
//!
//! The modules are the flow, each on those before it:
//!
//! ```text
//! frames -> quaternion -> worlds -> record -> condition -> propagate -> aid -> smooth
//!                                   consistency, noise, compare: beside it
//! ```
//!
//! | module | arrow |
//! |---|---|
//! | [`frames`] | what a rotation joins: `Dcm<To, From>` |
//! | [`quaternion`] | how an attitude is held, and how motion moves it |
//! | [`worlds`] | ENU, NED, NWU with their bodies, and the only conversions between them |
//! | [`record`] | what crosses the borders between stages |
//! | [`condition`] | raw samples -> SI, body axes, in order, finite |
//! | [`propagate`] | rates -> attitude: the hot loop |
//! | [`aid`] | specific force, field -> corrections of attitude and sensor |
//! | [`smooth`] | a whole recording -> the best attitudes it can give, and its sensor |
//! | [`estimate`] | all of these in one: what is asked for and the first samples -> an estimator -> attitude |
//! | [`consistency`] | rates and forces -> whether gyro and accelerometer speak of the same body |
//! | [`noise`] | what a sensor adds: measured, and put in on purpose |
//! | [`compare`] | two attitudes -> how far apart |
//! | [`joint`] | attitudes of two bodies -> the angle of the joint between them |
//! | [`setting`] | what can be set for a run -> what a person reads of it |
//!
//! # From raw samples to attitude
//! A quarter turn about z in a second, in degrees a second and with one reading that is none:
//! ```
//! use strapd_attitude::condition::{Conditioner, GyroUnit, Settings};
//! use strapd_attitude::propagate::{self, Propagator, Sequential};
//! use strapd_attitude::record::{Nanos, RawSample};
//!
//! let raw: Vec<RawSample> = (0..=100)
//!     .map(|i| RawSample {
//!         header: Some(Nanos(i * 10_000_000)),
//!         gyro: Some([0.0, 0.0, if i == 50 { f64::NAN } else { 90.0 }]),
//!         ..RawSample::default()
//!     })
//!     .collect();
//! let mut conditioner = Conditioner::new(&Settings { unit: GyroUnit::Deg, ..Settings::default() })?;
//! let mut rates = Vec::new();
//! conditioner.push(&raw, &mut rates);
//! conditioner.finish(&mut rates);
//!
//! let mut propagator = Propagator::new(propagate::Settings::default())?;
//! let mut attitudes = Vec::new();
//! propagator.push(&rates, &Sequential, &mut attitudes);
//! propagator.finish(&Sequential, &mut attitudes);
//!
//! let last = attitudes.last().expect("a hundred came");
//! let heading = last.q_nb.yaw_pitch_roll().yaw.to_degrees();
//! assert!((heading - 90.0).abs() < 1e-9, "the hole is bridged: {heading}");
//! assert_eq!(conditioner.report().counts.lost(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod aid;
mod clipped_run;
pub mod compare;
pub mod condition;
pub mod consistency;
pub mod diagnostic;
pub mod digits;
pub mod estimate;
pub mod frames;
pub mod joint;
mod lanes;
mod median;
pub mod noise;
mod open_class;
pub mod plausible;
pub mod propagate;
pub mod quaternion;
pub mod record;
pub mod resample;
pub mod setting;
pub mod smooth;
pub mod worlds;
