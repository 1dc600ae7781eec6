//! Strangers, crowds and signals -> who may come in, how much of everything there may be, and the orderly end.
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`limits`] | every bound | pure |
//! | [`admission`], [`peer`], `strangers` | who may come in, and from where; who shows wrong tokens | pure |
//! | [`places`] | which connection has a place, and who gives it up | locks |
//! | `redial` | a lost peer -> the wait before it is called again | pure |
//! | `fault`, `losses`, `log_throttle` | what is wrong with what a client sent -> its answer, the log, `STATUS` | locks |
//! | [`shutdown`] | signals -> an orderly end | I/O |

pub mod admission;
pub(super) mod failed_logins;
pub(super) mod fault;
pub mod limits;
pub(super) mod log_throttle;
pub(super) mod losses;
pub mod peer;
pub mod places;
pub(super) mod redial;
pub mod shutdown;
