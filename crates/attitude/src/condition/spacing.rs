//! Steps between stamps -> the ordinary step. Pure.
//!
//! A stage of its own because "a sample is missing" means nothing without knowing what the
//! ordinary step is, and that must be found while streaming, in bounded memory, unmoved by
//! gaps, bursts and repeats.

/// Number of steps looked at together.
const BLOCK: usize = 64;

/// The ordinary step of a stream, in nanoseconds: the mean of the steps within an eighth of their
/// median at first, then block by block of those within an eighth of the step so far; a block in
/// which fewer than three quarters agree starts from its own median, so that a changed rate is
/// followed within 128 samples.
#[derive(Clone, Debug)]
pub(super) struct Spacing {
    steps: [i64; BLOCK],
    len: usize,
    agreeing: u32,
    /// Sum over the agreeing steps of (step - nominal); at most 64 * nominal / 8, no overflow.
    excess: i64,
    early: bool,
    nominal: Option<i64>,
    /// Half-width of "agrees".
    tolerance: i64,
    /// Steps above this are not ordinary: 1.5 x nominal.
    limit: i64,
}

/// All that a [`Spacing`] knows.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub(super) struct Steps {
    steps: Vec<i64>,
    agreeing: u32,
    excess: i64,
    early: bool,
    nominal: Option<i64>,
}

impl Spacing {
    pub(super) fn steps(&self) -> Steps {
        Steps {
            steps: self.steps.get(..self.len).unwrap_or_default().to_vec(),
            agreeing: self.agreeing,
            excess: self.excess,
            early: self.early,
            nominal: self.nominal,
        }
    }

    /// Knows this from now on; `false`, and nothing has changed, when none can know it.
    pub(super) fn set_steps(&mut self, known: &Steps) -> bool {
        let len = known.steps.len();
        let agreeing = usize::try_from(known.agreeing).unwrap_or(usize::MAX);
        // A judgement divides by those that agree.
        if len >= BLOCK || agreeing > len || known.nominal.is_some_and(|n| n < 1) {
            return false;
        }
        if let Some(nominal) = known.nominal {
            self.set(nominal);
        }
        for (slot, step) in self.steps.iter_mut().zip(&known.steps) {
            *slot = *step;
        }
        self.len = len;
        self.agreeing = known.agreeing;
        self.excess = known.excess.clamp(-self.most_excess(), self.most_excess());
        self.early = known.early;
        true
    }

    /// Largest possible sum of excesses.
    fn most_excess(&self) -> i64 {
        self.tolerance.saturating_mul(BLOCK as i64)
    }

    /// Makes one that takes `limit` nanoseconds as ordinary until the ordinary step is known.
    pub(super) fn new(limit: i64) -> Self {
        Spacing {
            steps: [0; BLOCK],
            len: 0,
            agreeing: 0,
            excess: 0,
            early: true,
            nominal: None,
            tolerance: 0,
            limit,
        }
    }

    pub(super) fn nominal(&self) -> Option<i64> {
        self.nominal
    }

    /// Steps above this have samples missing in them (or time that catches up later).
    #[inline]
    pub(super) fn limit(&self) -> i64 {
        self.limit
    }

    /// A first guess from the steps in `steps` (sorted here).
    pub(super) fn prime(&mut self, steps: &mut [i64]) {
        if let Some(nominal) = typical(steps) {
            self.set(nominal);
            // As many steps as the early judgements would see have been seen.
            self.early = steps.len() < 16;
        }
    }

    #[inline]
    pub(super) fn push(&mut self, step: i64) {
        // The mask keeps the index in bounds without a branch that can panic.
        self.steps[self.len & (BLOCK - 1)] = step;
        self.len += 1;
        let excess = step.saturating_sub(self.nominal.unwrap_or(0));
        if excess.abs() <= self.tolerance {
            self.agreeing += 1;
            self.excess += excess;
        }
        if self.len == BLOCK || (self.early && matches!(self.len, 8 | 16 | 32)) {
            self.judge();
        }
    }

    #[cold]
    fn judge(&mut self) {
        match self.nominal {
            Some(nominal) if self.agreeing as usize * 4 >= self.len * 3 => {
                let mean_excess = self.excess / i64::from(self.agreeing);
                self.set(nominal.saturating_add(mean_excess));
            }
            _ => {
                let mut steps = self.steps;
                if let Some(nominal) = steps.get_mut(..self.len).and_then(typical) {
                    self.set(nominal);
                }
            }
        }
        if self.len == BLOCK {
            self.len = 0;
            self.early = false;
            self.agreeing = 0;
            self.excess = 0;
        } else {
            // The nominal step has moved: what agreed with the old one is counted afresh.
            self.agreeing = 0;
            self.excess = 0;
            let seen = self.len;
            for i in 0..seen {
                let excess = self.steps[i].saturating_sub(self.nominal.unwrap_or(0));
                if excess.abs() <= self.tolerance {
                    self.agreeing += 1;
                    self.excess += excess;
                }
            }
        }
    }

    fn set(&mut self, nominal: i64) {
        // Clamped so that 64 excesses of an eighth each cannot overflow.
        let nominal = nominal.clamp(1, i64::MAX / 16);
        self.nominal = Some(nominal);
        self.tolerance = nominal / 8;
        self.limit = nominal.saturating_add(nominal / 2);
    }
}

/// The mean of the steps within an eighth of the lower median; `None` of nothing.
///
/// The median alone is off by a few percent where stamps jitter, and whoever counts on over a
/// dozen steps multiplies that.
fn typical(steps: &mut [i64]) -> Option<i64> {
    let middle = steps.len().checked_sub(1)? / 2;
    let (_, median, _) = steps.select_nth_unstable(middle);
    let median = (*median).clamp(1, i64::MAX / 16);
    let mut sum = 0_i128;
    let mut n = 0_i128;
    for step in steps.iter() {
        let excess = step.saturating_sub(median);
        if excess.saturating_abs() <= median / 8 {
            sum += i128::from(excess);
            n += 1;
        }
    }
    Some(median.saturating_add(i64::try_from(sum / n.max(1)).unwrap_or(0)))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn gaps_repeats_and_jitter_do_not_move_the_ordinary_step() {
        let mut spacing = Spacing::new(500_000_000);
        for i in 0..1000_i64 {
            let step = match i % 10 {
                3 => 10_000_000,
                7 => 500_000_000,
                _ => 5_000_000 + (i % 7 - 3) * 20_000,
            };
            spacing.push(step);
        }
        // Jitter is +-60 us around 5 ms and averages out to below a fifth of that.
        let nominal = spacing.nominal().unwrap();
        assert!((nominal - 5_000_000).abs() < 12_000, "{nominal}");
    }

    #[test]
    fn a_changed_rate_is_followed_within_two_blocks() {
        for (before, after) in [(10_000_000, 5_000_000), (5_000_000, 10_000_000)] {
            let mut spacing = Spacing::new(500_000_000);
            (0..100).for_each(|_| spacing.push(before));
            assert_eq!(spacing.nominal(), Some(before));
            (0..128).for_each(|_| spacing.push(after));
            assert_eq!(spacing.nominal(), Some(after));
        }
    }

    #[test]
    fn absurd_steps_do_not_overflow() {
        let mut spacing = Spacing::new(500_000_000);
        for i in 0..300 {
            spacing.push([i64::MAX, 1, 0, i64::MAX / 2][i % 4]);
        }
        assert!(spacing.limit() >= 1);
    }
}
