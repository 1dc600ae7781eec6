//! The body of one answer -> a stream that is read from its beginning to its end. I/O.
//!
//! Apart from what is kept because there is no second try: a server that knows no ranges would begin again.

use super::answer::Body;
use super::download::too_slow;
use super::fault::Fault;
use super::patience::{Pace, Patience};
use bytes::{Buf, Bytes};
use futures_util::StreamExt;
use std::io::{self, Read};
use tokio::runtime::Handle;
use tokio::sync::mpsc::{Receiver, Sender, channel};

/// Pieces on their way, of some 16 kB each.
const ON_THE_WAY: usize = 64;

/// A body, as it comes.
#[derive(Debug)]
pub(super) struct Once {
    from: Receiver<io::Result<Bytes>>,
    here: Bytes,
}

impl Once {
    pub(super) fn new(runtime: &Handle, body: Body, size: Option<u64>, patience: Patience) -> Once {
        let (to, from) = channel(ON_THE_WAY);
        runtime.spawn(carry(body, size, patience, to));
        Once {
            from,
            here: Bytes::new(),
        }
    }
}

/// Brings a body to whoever reads it, until one of the two has enough.
async fn carry(
    mut body: Body,
    size: Option<u64>,
    patience: Patience,
    to: Sender<io::Result<Bytes>>,
) {
    let (mut pace, mut have) = (Pace::new(), 0);
    while let Some(next) = body.next().await {
        let next = next.and_then(|bytes| match pace.holds(bytes.len(), &patience) {
            true => Ok(bytes),
            false => Err(too_slow(&patience)),
        });
        have += next.as_ref().map_or(0, |bytes| bytes.len() as u64);
        let is_over = next.is_err();
        let next = next.map_err(|fault| cut(&fault, have, size));
        // Nobody reads on.
        if to.send(next).await.is_err() || is_over {
            return;
        }
    }
}

fn cut(fault: &Fault, have: u64, size: Option<u64>) -> io::Error {
    let why = match fault {
        Fault::Passing { what, .. } => what.as_str(),
        _ => "the answer ended",
    };
    let of = size.map_or_else(String::new, |size| format!(" of {size}"));
    io::Error::other(format!("{why}, after {have}{of} bytes"))
}

impl Read for Once {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while self.here.is_empty() {
            match self.from.blocking_recv() {
                Some(next) => self.here = next?,
                None => return Ok(0),
            }
        }
        let most = into.len().min(self.here.len());
        if let Some(room) = into.get_mut(..most) {
            self.here.copy_to_slice(room);
        }
        Ok(most)
    }
}
