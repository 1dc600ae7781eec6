//! Attitude from gyro samples. Pure: no I/O, no clock, no logging, no randomness but a passed seed.
//!
//! The modules are the flow, each on those before it:
//!
//! ```text
//! frames -> quaternion -> worlds -> record -> condition -> propagate -> aid
//!                                   noise, compare: beside it
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
//! | [`noise`] | what a sensor adds: measured, and put in on purpose |
//! | [`compare`] | two attitudes -> how far apart |

pub mod aid;
pub mod compare;
pub mod condition;
pub mod frames;
pub mod noise;
pub mod propagate;
pub mod quaternion;
pub mod record;
pub mod worlds;
