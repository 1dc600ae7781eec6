//! A thread's room for one read, and when that was. Reads the clock.
//!
//! Apart from the transports because all of them, and the brokers, share it.

use super::session::Scratch;
use std::cell::RefCell;
use std::time::{SystemTime, UNIX_EPOCH};
use strapd_attitude::record::Nanos;

/// Most bytes taken from a socket at once.
const READ: usize = 16 << 10;

/// Now, as the log time of what was just received.
pub(in crate::serve) fn now() -> Nanos {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    Nanos(since.map_or(0, |d| i64::try_from(d.as_nanos()).unwrap_or(i64::MAX)))
}

/// Room for one read and the work on it. It belongs to the thread: between reading and the next
/// `await` nobody else uses it, and a client that sends nothing holds none.
#[derive(Debug)]
struct ReadBuffer {
    bytes: Vec<u8>,
    scratch: Scratch,
}

thread_local! {
    static BUFFER: RefCell<ReadBuffer> = RefCell::new(ReadBuffer {
        bytes: vec![0; READ],
        scratch: Scratch::default(),
    });
}

/// Works in this thread's buffer.
pub(in crate::serve) fn with_read_buffer<T>(work: impl FnOnce(&mut [u8], &mut Scratch) -> T) -> T {
    BUFFER.with_borrow_mut(|buffer| work(&mut buffer.bytes, &mut buffer.scratch))
}
