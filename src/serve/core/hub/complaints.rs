//! Faults of a client -> its outbox, or whoever reads for it here. Locks.
//!
//! Apart from the outbox because of standard input, datagrams and sources nobody there reads the answers: what is
//! wrong is handed on as it is, instead of being written and read back.

use super::{Client, lock};
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::wire;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Most complaints that are kept: who reads them takes them after every step.
const MOST: usize = 256;

/// Complaint about something a client sent.
#[derive(Clone, Debug)]
pub struct Complaint {
    /// Fault.
    pub fault: Fault,
    /// Number of the line, 0 where it has none.
    pub line: u64,
    /// Answer that somebody who reads would be sent: a broker's subject of errors is.
    #[cfg(feature = "nats")]
    pub answer: bytes::Bytes,
}

/// Complaints about a client that are read here.
#[derive(Debug, Default)]
pub(super) struct Complaints {
    are_kept: AtomicBool,
    kept: Mutex<Vec<Complaint>>,
}

impl Client {
    /// Marks it as one whose complaints are read here.
    pub fn keep_complaints(&self) {
        self.complaints.are_kept.store(true, Ordering::Relaxed);
    }

    /// Tells it what is wrong with the line of this number that begins so. `suppressed`: faults before that it was
    /// not told.
    pub fn complain(&self, fault: &Fault, (line, near): (u64, &[u8]), suppressed: u64) {
        let answer = || wire::error(fault, line, near, suppressed);
        if !self.complaints.are_kept.load(Ordering::Relaxed) {
            return self.outbox.reply(answer());
        }
        let mut kept = lock(&self.complaints.kept);
        if kept.len() < MOST {
            kept.push(Complaint {
                fault: fault.clone(),
                line,
                #[cfg(feature = "nats")]
                answer: answer(),
            });
        }
    }

    /// Complaints since this was called last.
    pub fn complaints(&self) -> Vec<Complaint> {
        std::mem::take(&mut lock(&self.complaints.kept))
    }
}
