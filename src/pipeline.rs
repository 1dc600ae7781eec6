//! Wires the stages: source -> decode -> condition -> propagate -> sink. I/O.

pub mod against;
pub mod check;
mod chosen;
pub mod estimator;
pub mod lines;
pub mod log;
pub mod look;
pub(crate) mod opening;
pub mod outlet;
pub mod pace;
mod passes;
pub mod pool;
pub mod position;
pub mod preparation;
pub mod provenance;
pub mod recover;
pub mod replay;
pub mod route;
pub mod run;
pub mod session;
pub mod simulate;
pub mod stamps;
mod streamed;
pub mod summarise;
pub mod topics;
pub mod track;
mod waiting;
