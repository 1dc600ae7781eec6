//! strapd: gyro samples in, attitude you can trust out.
//!
//! The folders are the data flow:
//!
//! ```text
//! source -> decode -> condition -> propagate -> sink      wired by pipeline
//!                          model: the mathematics beside it, pure
//! ```
//!
//! Reading order: [`record`], [`propagate`], [`condition`], then the rims.
//! Without the default feature `service` the crate is `model`, `record`, `condition` and
//! `propagate` on nalgebra alone.

#[cfg(feature = "service")]
pub mod cli;
pub mod compare;
pub mod condition;
#[cfg(feature = "service")]
pub mod config;
pub mod model;
pub mod propagate;
pub mod record;

#[cfg(feature = "service")]
pub mod decode;
#[cfg(feature = "service")]
pub mod error;
#[cfg(feature = "service")]
pub mod pipeline;
#[cfg(feature = "service")]
pub mod report;
#[cfg(feature = "service")]
pub mod sink;
#[cfg(feature = "service")]
pub mod source;
