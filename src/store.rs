//! An address -> what is there, read as a file is. I/O.
//!
//! A room of its own because servers fail in ways of their own: they are slow, cut a body, say "later", or have another
//! object by now. Behind it is what the reader of recordings knows, an
//! [`Object`](strapd_recording::elsewhere::Object); what was
//! fetched is in a file without a name, so that it is fetched once, however often it is read.
//!
//! ```text
//! address -> place (web: http, https; cloud: s3, gs, az) -> download -> kept (ranges: which bytes are there) ->
//! read_at
//!                                                        -> once, where a server knows no ranges
//! ```
//!
//! | file | |
//! |---|---|
//! | `place`, `web`, `cloud`, `answer` | one request: a range of an object, or why not |
//! | `client` | who asks: TLS, redirects, timeouts |
//! | `fault`, `patience` | what passes and what does not; how long it is waited for |
//! | `download` | one range, over as many requests as it takes |
//! | `kept`, `ranges` | the bytes that are there, and those that are fetched ahead |
//! | `once` | what comes from its beginning to its end |
//! | `upload`, `interrupt` | a file to an object, whole or not at all |
//! | `listed`, `pattern` | what a key with `*` means |

mod answer;
mod client;
mod cloud;
mod download;
mod fault;
mod interrupt;
mod kept;
pub mod listed;
mod once;
pub mod patience;
mod pattern;
mod place;
mod ranges;
pub mod upload;
mod web;

use answer::Reply;
use kept::CachedObject;
use patience::Patience;
use place::Place;
use std::future::Future;
use std::io;
use std::sync::{Arc, OnceLock};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::address::Address;
use strapd_recording::remote_object::RemoteSource;
use tokio::runtime::{Builder, Runtime};

/// Bytes that are asked for first: enough to tell a format.
const FIRST: u64 = 64 << 10;

/// Reaches what is at an address.
///
/// # Errors
/// It is none, nobody answers, or the answer is no.
pub fn reach(address: &Address) -> Result<RemoteSource, Diagnostic> {
    reach_with(address, Patience::default())
}

/// The same with another patience.
///
/// # Errors
/// As [`reach`].
pub fn reach_with(address: &Address, patience: Patience) -> Result<RemoteSource, Diagnostic> {
    let runtime = runtime().map_err(|e| Diagnostic::new(format!("cannot start threads: {e}")))?;
    let place = Arc::new(Place::of(address, &patience)?);
    let asked = Arc::clone(&place);
    let reply = wait(runtime, async move {
        download::asked(&asked, 0..FIRST, &patience).await
    });
    let reply = reply
        .unwrap_or_else(|| Err(Diagnostic::new("the request was given up").into()))
        .map_err(|fault| fault.told(|status| place.help(status)))?;
    Ok(match reply {
        Reply::All { size, body } => RemoteSource::Stream(Box::new(once::Once::new(
            runtime.handle(),
            body,
            size,
            patience,
        ))),
        Reply::Part(part) => {
            let handle = runtime.handle().clone();
            let kept = CachedObject::new(handle, place, part, patience).map_err(no_room)?;
            RemoteSource::Object(Arc::new(kept))
        }
    })
}

/// Runtime of requests, for as long as the process runs.
fn runtime() -> io::Result<&'static Runtime> {
    static RUNTIME: OnceLock<Runtime> = OnceLock::new();
    if let Some(runtime) = RUNTIME.get() {
        return Ok(runtime);
    }
    let made = Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("store")
        .enable_all()
        .build()?;
    Ok(RUNTIME.get_or_init(|| made))
}

/// Waits for what runs there; `None` if it was given up.
fn wait<T: Send + 'static>(
    runtime: &Runtime,
    work: impl Future<Output = T> + Send + 'static,
) -> Option<T> {
    let (to, from) = std::sync::mpsc::channel();
    runtime.spawn(async move {
        // Who waited may have gone.
        let _ = to.send(work.await);
    });
    from.recv().ok()
}

fn no_room(why: io::Error) -> Diagnostic {
    Diagnostic::new(format!(
        "what is fetched is kept in {}: {why}",
        std::env::temp_dir().display()
    ))
    .help("TMPDIR=FOLDER with room, or save it to a file first")
}
