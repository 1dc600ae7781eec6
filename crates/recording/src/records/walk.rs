//! Position in bytes of which some are no record -> what was lost on the way, and where. Pure.
//!
//! Apart from the walks themselves because a run of bytes that are none is one problem, told at its end, whatever the
//! marks are that are looked for.

use super::problem::{ProblemKind, Problems};

/// Position of a walk, and its problems.
#[derive(Debug, Default)]
pub(crate) struct Walk {
    at: u64,
    /// Offset at which bytes begin that are no record.
    lost: Option<u64>,
    problems: Problems,
}

impl Walk {
    /// Adds a problem here.
    pub(crate) fn fault(&mut self, kind: ProblemKind, messages: Option<u64>) {
        self.problems.add(self.at, kind, messages);
    }

    /// Adds bytes that the last problem made unusable, where its own fields do not say.
    pub(crate) fn skip(&mut self, bytes: u64) {
        self.problems.skip(bytes);
    }

    /// Ends a run of bytes that are no record.
    pub(crate) fn found(&mut self) {
        if let Some(offset) = self.lost.take() {
            let skipped = self.at.saturating_sub(offset);
            self.problems
                .add(offset, ProblemKind::Garbage { skipped }, None);
        }
    }

    /// Ends the walk within a record of `need` bytes, of which `have` are there.
    pub(crate) fn truncated(&mut self, need: usize, have: usize) {
        self.found();
        let (need, have) = (need as u64, have as u64);
        self.fault(ProblemKind::Truncated { need, have }, None);
    }

    /// Number of bytes to leave out here: up to where a record may begin, but no more than `most`, behind which one may
    /// begin that is not seen whole.
    pub(crate) fn lose(
        &mut self,
        ahead: &[u8],
        most: usize,
        begins: impl Fn(&[u8]) -> bool,
    ) -> usize {
        self.lost.get_or_insert(self.at);
        let next = (1..ahead.len()).find(|at| ahead.get(*at..).is_some_and(&begins));
        next.unwrap_or(most).min(most).max(1)
    }

    /// Goes on by so many bytes; `is_last`: nothing is behind them.
    pub(crate) fn go_on(&mut self, bytes: usize, is_last: bool) {
        self.at = self.at.saturating_add(bytes as u64);
        if is_last {
            self.found();
        }
    }

    /// Problems of the whole walk.
    pub(crate) fn into_problems(self) -> Problems {
        self.problems
    }
}
