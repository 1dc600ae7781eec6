//! RateSample -> AttitudeSample. Pure; the hot loop.
//!
//! A stage of its own because it is the only place where rotation is integrated: replay, serving,
//! simulation and tests all push samples through [`Propagator`] and take attitudes out.
//!
//! ```text
//! samples of a run -> window of samples around an interval       window
//!                  -> Legendre moments of the rate over it       uniform, lagrange, collocation
//!                  -> turn, cos(a/2) - 1 and sin(a/2) axis       magnus, series
//!                  -> attitude                                   accumulate
//! turn, time, noise -> how well it is known                     covariance
//! ```
//!
//! Every turn is a function of the samples in its window alone, and turns are accumulated in order:
//! the bits that come out depend neither on how the stream is cut into pushes nor on the [`Executor`].
//!
//! # Accuracy
//! Heavy top spinning at 20 Hz, sampled at 2000 Hz for 1.2 s: 2e-12 degrees. Coning 10 degrees, 3 Hz, at
//! 100 Hz, 60 s: 1e-7 arcsec. `crates/bodies/tests/bodies/accuracy.rs` holds these and the orders of convergence.
#![allow(
    clippy::needless_range_loop,
    reason = "an index here is the subscript of a formula, and often runs through several arrays"
)]

mod accumulate;
mod bridge;
mod classical;
mod collocation;
mod columns;
pub mod covariance;
mod difference;
mod executor;
mod lagrange;
mod magnus;
mod method;
mod propagator;
mod report;
mod series;
mod settings;
#[cfg(test)]
#[path = "../../../tests/shared_data/mod.rs"]
#[allow(unreachable_pub, reason = "shared with the integration tests")]
pub(crate) mod shared_data;
mod turn;
mod uniform;
mod window;

pub use covariance::Noise;
pub use executor::{Executor, Sequential};
pub use method::{LARGEST_WINDOW, Method, Order, Placement};
pub use propagator::{Memory, Propagator};
pub use report::Report;
pub use settings::{Settings, SettingsError};
