//! Logs of every kind -> samples, with no byte believed before it is checked.
//!
//! ```text
//! file, stream -> mcap -> decode -> RawSample
//!                                   text, error: beside it
//! ```
//!
//! | module | arrow | |
//! |---|---|---|
//! | [`mcap`] | MCAP logs, whole or damaged -> messages in a stable order | I/O |
//! | [`decode`] | bytes of one message, one line, one packed object -> raw samples | pure |
//! | [`text`] | outside text -> what a terminal may show | pure |
//! | [`pool`] | workers shared by reading, integrating and writing; how many changes no bit | |
//! | [`error`] | why a log can not be read | |

pub mod decode;
pub mod error;
pub mod mcap;
pub mod pool;
pub mod text;

pub use error::{Error, Result};
