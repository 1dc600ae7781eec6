//! The other end of a socket: connecting to a daemon, or to whatever sends samples. I/O.
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`remote`] | the word on the command line -> where to connect | pure |
//! | [`link`] | bytes and messages both ways, over any transport | I/O |
//! | `numbers` | packed attitudes -> what their lines would say | pure |
//! | [`secret`] | a file -> the token in it | reads it |
//! | [`sender`] | lines -> a daemon, and what it complains of | I/O |
//! | [`watcher`] | what a daemon says -> attitudes, state, complaints | I/O |
//!
//! `serve` connects out to its sources through [`link`] too; `cat`, `send` and `watch` do.

pub mod link;
mod numbers;
pub mod remote;
pub mod secret;
pub mod sender;
pub mod serial;
pub mod watcher;

use crate::error::{Error, Result};

/// Runs the work of a command that talks to a daemon, `name` in what is said when it cannot even begin.
/// What it leaves behind is not waited for.
///
/// # Errors
/// Those of `work`; [`Error::Usage`] when the system gives no thread.
pub fn run<T>(name: &str, work: impl Future<Output = Result<T>>) -> Result<T> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .map_err(|e| Error::usage(format!("{name}: {e}")))?;
    let outcome = runtime.block_on(work);
    runtime.shutdown_background();
    outcome
}
