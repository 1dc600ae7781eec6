//! Wires the stages: source -> decode -> condition -> propagate -> sink. I/O.

pub mod estimator;
pub mod log;
pub mod pace;
pub mod pool;
pub mod preparation;
pub mod replay;
pub mod topics;
pub mod track;
