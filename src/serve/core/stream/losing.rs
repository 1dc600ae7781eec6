//! Outcomes of a stream's samples -> which verdict loses them all, if one does. Pure.

use super::{Joining, SensorStream, explained};
use crate::serve::guard::fault::Fault;
use strapd_attitude::record::{Counts, Verdict};

/// Counts at the last look.
#[derive(Debug, Default)]
pub(super) struct Losing {
    used: u64,
    counts: Counts,
}

/// Fate of the last samples.
#[derive(Debug)]
pub enum Fate {
    /// Nothing that is known yet.
    Open,
    /// Some of them were used.
    Used,
    /// All were lost, so many, for this reason.
    Lost(Fault, u64),
}

impl SensorStream {
    /// Fate of the samples since the last call.
    pub fn fate(&mut self) -> Fate {
        let counts = self.conditioning().counts;
        let used = counts.used();
        let before = std::mem::replace(&mut self.losing, Losing { used, counts });
        if used > before.used {
            return Fate::Used;
        }
        // What is sent again is no loss, and a line that could not be read is its sender's.
        if matches!(self.joining, Joining::Again(_)) {
            return Fate::Open;
        }
        let lost = Verdict::ALL
            .into_iter()
            .filter(|verdict| verdict.is_loss() && *verdict != Verdict::Undecodable)
            .map(|verdict| {
                (
                    counts
                        .get(verdict)
                        .saturating_sub(before.counts.get(verdict)),
                    verdict,
                )
            })
            .max_by_key(|(lost, _)| *lost);
        match lost {
            Some((count, verdict)) if count > 0 => {
                let why = self.why_no_stamp.clone();
                let why = why.filter(|_| verdict == Verdict::NoStamp);
                let message = why.unwrap_or_else(|| explained(verdict).to_owned());
                Fate::Lost(Fault::new(verdict.name(), message), count)
            }
            _ => Fate::Open,
        }
    }

    /// Whether there was an attitude since the start.
    #[must_use]
    pub fn has_attitudes(&self) -> bool {
        self.next_seq > self.first_seq
    }
}
