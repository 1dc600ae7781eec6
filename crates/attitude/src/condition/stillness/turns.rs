//! Rests -> those of them that can be no steady turn. Pure.
//!
//! A stage of its own because a body that turns slowly and steadily about the vertical is as quiet as one that rests,
//! and gravity does not tell them apart. A bias points anywhere, is about as large as its class says, and is the same
//! in every rest.

use super::{Rest, Rests};
use crate::diagnostic::Diagnostic;
use crate::digits::significant;
use crate::frames::In;
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
/// A short one is believed up to this rate along its vertical, rad/s, whatever is across: who starts in a slow turn
/// rests as quietly, and a bias so large is seldom.
pub(crate) const SHORT_MOST: f64 = 1.5_f64.to_radians();
/// Rates of one bias differ by no more than this and three of their sigmas, rad/s.
pub(crate) const SAME: f64 = 0.002;

/// A rate along the vertical that is above so many times what it is across, and above three times [`ACROSS`], is that
/// of a turn if the body has done nothing else: of gyros whose bias points anywhere one in 200 has it so.
const SOLELY_ALONG: f64 = 10.0;

/// Whether a body of which nothing has been seen but the rate `rate` (rad/s) turns about the vertical `up` (any
/// length), by its direction alone: a bias of the class may be as large.
pub(crate) fn is_solely_vertical(rate: &Vector3<f64>, up: &Vector3<f64>) -> bool {
    let Some(along) = about_vertical(rate, up) else {
        return false;
    };
    let square = rate.norm_squared() - along * along;
    along * along > SOLELY_ALONG * SOLELY_ALONG * square
}

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

    fn is_solely_vertical(&self) -> bool {
        let up = self.mean_accel.as_ref().map(In::as_vector);
        up.is_some_and(|up| is_solely_vertical(&self.mean_rate.0, up))
    }

    fn up(&self) -> Option<Vector3<f64>> {
        self.mean_accel.as_ref()?.as_vector().try_normalize(0.0)
    }

    fn along(&self, rate: &Vector3<f64>) -> Option<f64> {
        Some(rate.dot(&self.up()?))
    }

    /// Rate beside that of another rest, rad/s, if that is a turn about the vertical: one bias is the same in both.
    fn turns_beside(&self, other: &Rest) -> Option<f64> {
        let off = self.mean_rate.0 - other.mean_rate.0;
        let turn = about_vertical(&off, self.mean_accel.as_ref()?.as_vector());
        turn.filter(|_| !self.reads_as(other))
    }

    /// Whether both read the same across the vertical, and not along it.
    fn differs_along_alone(&self, other: &Rest) -> bool {
        let off = self.mean_rate.0 - other.mean_rate.0;
        let Some(up) = self.up() else {
            return false;
        };
        let along = off.dot(&up);
        let across = (off - up * along).norm();
        let sigma = self.sigma.norm().hypot(other.sigma.norm());
        let same = SAME + 3.0 * sigma;
        along.abs() > same && across < same
    }

    fn reads_as(&self, other: &Rest) -> bool {
        let off = self.mean_rate.0 - other.mean_rate.0;
        (0..3).all(|i| off[i].abs() <= SAME + 3.0 * self.sigma[i].hypot(other.sigma[i]))
    }
}

fn longest_of(rests: &[Rest]) -> Option<&Rest> {
    rests.iter().max_by(|a, b| a.secs().total_cmp(&b.secs()))
}

/// The rest whose rate along its vertical is the least.
fn slowest_of(rests: &[Rest]) -> Option<Rest> {
    let along = |rest: &Rest| rest.along(&rest.mean_rate.0).unwrap_or_default().abs();
    rests
        .iter()
        .min_by(|a, b| along(a).total_cmp(&along(b)))
        .copied()
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
        let is_fast = |rest: &Rest| {
            let along = rest.along(&rest.mean_rate.0);
            is_short(rest) && along.is_some_and(|along| along.abs() > SHORT_MOST)
        };
        let is_sole = |rest: &Rest| !self.has_moved && rest.is_solely_vertical();
        let is_turn = |rest: &Rest| {
            let turn = rest.turn().map(f64::abs);
            is_fast(rest)
                || turn.is_some_and(|turn| {
                    turn > BEYOND_CLASS * class || is_short(rest) || is_sole(rest)
                })
        };
        let (mut turns, mut kept): (Vec<Rest>, Vec<Rest>) =
            self.kept.iter().partition(|r| is_turn(r));
        // A turn does not come back at the very rate it had before the body moved.
        if let Some(longest) = longest_of(&turns) {
            let is_bias = |rest: &Rest| !is_short(rest) && rest.reads_as(longest);
            let come_back = self.has_moved && turns.len() > 1 && turns.iter().all(is_bias);
            if kept.is_empty() && come_back {
                return (self.clone(), None);
            }
        }
        if let Some(slowest) = slowest_of(&kept) {
            // Short rests that differ along the vertical alone: neither is one.
            if is_few && kept.iter().any(|rest| rest.differs_along_alone(&slowest)) {
                turns.append(&mut kept);
            }
            turns.extend(kept.extract_if(.., |rest| rest.turns_beside(&slowest).is_some()));
        }
        let Some(longest) = longest_of(&turns) else {
            return (self.clone(), None);
        };
        let beside = || longest.turns_beside(&slowest_of(&kept)?);
        let (rate, than) = match longest.turn() {
            Some(turn) => (turn, ""),
            None => (beside().unwrap_or_default(), " more than in another rest"),
        };
        let said = Diagnostic::new(format!(
            "for {:.1} s the gyro reads {} deg/s{than} about the vertical, hardly anything across, and all else rests: taken for a steady turn, not for its bias",
            longest.secs(),
            significant(rate.to_degrees(), 3),
        ))
        .help(format!("{BIAS} auto takes it for the bias, {BIAS} x,y,z (rad/s) says one"));
        let is_said = !is_short(longest);
        let rests = Rests {
            count: kept.len() as u64,
            secs: kept.iter().map(Rest::secs).sum(),
            kept,
            ..self.clone()
        };
        (rests, is_said.then_some(said))
    }
}
