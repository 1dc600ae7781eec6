//! Raw samples of one stream -> attitude, all stages in one. Pure.
//!
//! A stage of its own because what must be known first (which clock, which bias, which attitude to begin with) is
//! found in the samples themselves, and because replay, serve and a library user are to get the same bits.
//!
//! ```text
//! what a person gives -> settings -> Plan
//! Plan, Declared -> Meaning
//! first samples, or all of them -> Preparation -> Prepared
//! samples, Meaning, Prepared -> Estimator -> AttitudeSample
//! ```

mod aiding;
mod anew;
mod calibrated;
mod class_pass;
mod clock_choice;
mod clock_pass;
mod estimator;
mod first_pass;
mod gyro_watch;
mod integrator;
mod intervals;
mod kept;
mod lag;
mod magnetometer_watch;
mod meaning;
mod memory;
mod noise_figures;
mod noise_presets;
mod open_kind;
mod orientation_lag;
mod output_frame;
mod plan;
mod pooled;
mod preparation;
mod retaking;
mod sample_kind;
mod sensor_calibration;
pub mod settings;
mod settings_fingerprint;
mod smoothing;
mod smoothing_priors;
mod stamps;
mod temperatures;

pub use aiding::{Aiding, Forces};
pub use anew::RestartRequest;
pub use calibrated::learned;
pub use clock_pass::{ClockPass, ClockVerdict, batches_message, speed_message};
pub use estimator::Estimator;
pub use first_pass::{Conditioned, FEW};
pub use intervals::{LEAST_INTERVALS, Mismatch};
pub use kept::{Spool, SpoolError};
pub use lag::OrientationLag;
pub use meaning::{Meaning, orientation_convention};
pub use memory::Memory;
pub use noise_figures::{NOISE_FIGURES, NoiseFigure};
pub use noise_presets::{NOISE_PRESETS, NoisePreset};
pub use orientation_lag::LagPass;
pub use plan::{Aid, Bias, CLASS_BY_DATA, EstimationSettings, Initial, Mended, Noise, Truncation};
pub use pooled::Pooled;
pub use preparation::{Patience, Preparation, Prepared, at_once};
pub use sample_kind::{KindChoice, KindReason};
pub use sensor_calibration::{CalibrationTerm, SensorCalibration};
pub use smoothing::Recording;
pub use stamps::{StampPass, Stamps};
