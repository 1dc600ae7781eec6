//! Bytes in any cut -> whole frames to a device, and what was skipped. Pure.
//!
//! Apart from the link because recognition and the tests walk the same way: a frame is used when its last byte has come,
//! and what is none costs a byte, behind which the search goes on.

use super::frame::Cut;
use super::sample::Taken;
use super::{Device, Protocol};

/// Reader of one protocol's bytes.
#[derive(Debug)]
pub(super) struct Reader {
    protocol: &'static Protocol,
    device: Box<dyn Device>,
    /// Beginning of a frame whose end has not come.
    partial: Vec<u8>,
    /// Frames so far.
    pub(super) frames: u64,
    /// Bytes behind the first frame that are none.
    pub(super) skipped: u64,
    pub(super) taken: Taken,
}

impl Reader {
    /// Reader of a protocol's bytes for a device of it.
    pub(super) fn of(protocol: &'static Protocol, device: Box<dyn Device>) -> Reader {
        Reader {
            protocol,
            device,
            partial: Vec::new(),
            frames: 0,
            skipped: 0,
            taken: Taken::default(),
        }
    }

    /// Takes the next bytes; their samples are in [`Reader::taken`].
    pub(super) fn push(&mut self, bytes: &[u8]) {
        let mut partial = std::mem::take(&mut self.partial);
        partial.extend_from_slice(bytes);
        let mut rest = partial.as_slice();
        while !rest.is_empty() {
            let used = match (self.protocol.cut)(rest) {
                Cut::Need(_) => break,
                Cut::No => {
                    self.skipped += u64::from(self.frames > 0);
                    1
                }
                Cut::Frame { total, .. } => {
                    self.frames += 1;
                    let frame = rest.get(..total).unwrap_or(rest);
                    self.device.take(frame, &mut self.taken);
                    total.max(1)
                }
            };
            rest = rest.get(used..).unwrap_or(&[]);
        }
        let left = partial.len() - rest.len();
        partial.drain(..left);
        self.partial = partial;
    }
}
