//! Rests -> those of them that can be no steady turn. Pure.
//!
//! A stage of its own because a body that turns slowly and steadily about the vertical is as quiet as one that rests,
//! and gravity does not tell them apart. A bias points anywhere, is about as large as its class says, and is the same
//! in every rest.

use super::{Rest, Rests};
use crate::diagnostic::Diagnostic;
use crate::digits::significant;
use crate::setting::BIAS;
use nalgebra::Vector3;

/// A rate along the vertical that is above so many times what it is across can be one of turning.
pub(crate) const ALONG: f64 = 3.0;
/// Least of the rate across, rad/s.
const ACROSS: f64 = 0.1_f64.to_radians();
/// And it is one above so many sigmas of a bias of the sensor's class.
pub(crate) const BEYOND_CLASS: f64 = 1.5;
/// Total length of all rests, s, below which the short ones are judged more strictly.
pub(crate) const FEW_SECS: f64 = 10.0;
/// And these are the short ones, s.
pub(crate) const SHORT_SECS: f64 = 1.4;
/// Rates of one bias differ by no more than this and three of their sigmas, rad/s.
pub(crate) const SAME: f64 = 0.002;

/// Rate along the vertical `up` (any length), rad/s, of one that has hardly any across: that of a turn which leaves
/// gravity where it is.
pub(crate) fn about_vertical(rate: &Vector3<f64>, up: &Vector3<f64>) -> Option<f64> {
    let up = up.try_normalize(0.0)?;
    let along = rate.dot(&up);
    let across = (rate - up * along).norm();
    (along.abs() > ALONG * across.max(ACROSS)).then_some(along)
}

impl Rest {
    /// Rate of a turn about the vertical that it can be, rad/s; of one whose vertical is not known, of any turn.
    fn turn(&self) -> Option<f64> {
        match &self.mean_accel {
            Some(up) => about_vertical(&self.mean_rate.0, up.as_vector()),
            None => Some(self.mean_rate.0.norm()).filter(|rate| *rate > ALONG * ACROSS),
        }
    }

    fn reads_as(&self, other: &Rest) -> bool {
        let off = self.mean_rate.0 - other.mean_rate.0;
        (0..3).all(|i| off[i].abs() <= SAME + 3.0 * self.sigma[i].hypot(other.sigma[i]))
    }
}

impl Rests {
    /// Whether there is one alone, and it can be a steady turn: an accelerometer cannot tell.
    #[must_use]
    pub fn can_be_a_turn(&self) -> bool {
        matches!(self.kept.as_slice(), [only] if only.turn().is_some())
    }

    /// The rests that can be no steady turn of a body whose gyro's bias is `class` (one sigma, rad/s), and what to say
    /// of the others.
    #[must_use]
    pub fn less_turns(&self, class: f64) -> (Rests, Option<Diagnostic>) {
        let is_few = self.secs < FEW_SECS;
        let is_short = |rest: &Rest| is_few && rest.secs() < SHORT_SECS;
        let is_turn = |rest: &Rest| {
            let turn = rest.turn().map(f64::abs);
            turn.is_some_and(|turn| turn > BEYOND_CLASS * class || is_short(rest))
        };
        let (turns, kept): (Vec<Rest>, Vec<Rest>) = self.kept.iter().partition(|r| is_turn(r));
        let Some(longest) = turns.iter().max_by(|a, b| a.secs().total_cmp(&b.secs())) else {
            return (self.clone(), None);
        };
        // A turn does not come back at the very rate it had before the body moved.
        let is_bias = |rest: &Rest| !is_short(rest) && rest.reads_as(longest);
        if kept.is_empty() && turns.len() > 1 && turns.iter().all(is_bias) {
            return (self.clone(), None);
        }
        let said = Diagnostic::new(format!(
            "for {:.1} s the gyro reads {} deg/s about the vertical, hardly anything across, and all else rests: taken for a steady turn, not for its bias",
            longest.secs(),
            significant(longest.turn().unwrap_or_default().to_degrees(), 3),
        ))
        .help(format!("{BIAS} auto takes it for the bias, {BIAS} x,y,z (rad/s) says one"));
        let rests = Rests {
            count: kept.len() as u64,
            secs: kept.iter().map(Rest::secs).sum(),
            kept,
            ..self.clone()
        };
        (rests, (!is_short(longest)).then_some(said))
    }
}
