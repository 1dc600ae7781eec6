//! Samples -> turns the way others do it: the document's rules and textbook coning algorithms. Pure.
//!
//! Kept for comparison and to reproduce published figures; none is a good default
//! (`docs/theory/attitude.md` 1, 6).

use super::columns::Track;
use super::method::Method;
use super::turn::Turn;
use super::window::{Note, Step};
use crate::lanes::Triple;

/// Coning-optimal weights by lag, for blocks of 2, 3 and 4 increments (Miller 1983; docs/theory/attitude.md 4.4).
const KAPPA: [&[f64]; 5] = [
    &[],
    &[],
    &[2.0 / 3.0],
    &[27.0 / 20.0, 9.0 / 20.0],
    &[214.0 / 105.0, 92.0 / 105.0, 18.0 / 35.0],
];

/// Elements before an interval these methods look at.
pub(crate) const LOOK_BACK: usize = 4;

/// Interval k by a method that needs no later sample. [`Method::RotvecSum`] delivers the rotation
/// vector itself instead of a turn, to be summed.
pub(crate) fn step(method: Method, track: &Track, k: usize) -> Step {
    let h = track.step(k);
    let right = track.rate(k);
    let left = if track.increments && k - 1 < track.first() {
        right
    } else {
        track.rate(k - 1)
    };
    let note = if track.bridged[k] || (track.increments && track.has_hole(k)) {
        Note::Bridged
    } else {
        Note::Ordinary
    };
    let turn = match method {
        Method::DcmLeft => Turn::exp(left * h),
        Method::DcmMean => Turn::exp((left + right) * (0.5 * h)),
        Method::Rk4 => rk4(track, k, left, right),
        Method::Coning2 => coning(track, k, 2),
        Method::Coning3 => coning(track, k, 3),
        Method::Coning4 => coning(track, k, 4),
        Method::RotvecSum => {
            // The document's sum runs over w(t_0) .. w(t_i) for the attitude at t_i+1.
            let phi = if track.increments {
                right * h
            } else {
                left * h
            };
            return Step::of_vector(phi, note);
        }
        // The others are no classical methods; the end rate is what `dcm-right` means.
        _ => Turn::exp(right * h),
    };
    Step::new(turn, right.norm() * h, note)
}

/// The increment of interval k: recorded, or by the trapezoid rule.
fn increment(track: &Track, k: usize) -> Triple<1> {
    if track.increments {
        track.rate(k) * track.step(k)
    } else {
        (track.rate(k - 1) + track.rate(k)) * (0.5 * track.step(k))
    }
}

/// Blocks are counted from the start of the run. Within one, sample i has the attitude the algorithm
/// for i increments gives from the start of the block, so that there is an output for every sample.
fn coning(track: &Track, k: usize, block: usize) -> Turn<1> {
    let place = (track.base + k - 1) % block;
    let since = |count: usize| {
        let first = k - place;
        let mut sum = Triple::ZERO;
        for i in first..first + count {
            sum = sum + increment(track, i);
        }
        if let Some(last) = (first + count).checked_sub(1) {
            for (lag, kappa) in KAPPA[count].iter().enumerate() {
                let earlier = increment(track, last - 1 - lag);
                sum = sum + earlier.cross(increment(track, last)) * *kappa;
            }
        }
        Turn::exp(sum)
    };
    since(place).inverse().then(since(place + 1))
}

fn rk4(track: &Track, k: usize, left: Triple<1>, right: Triple<1>) -> Turn<1> {
    let h = track.step(k);
    let (start, end) = if track.increments {
        // The line whose means over this and the previous interval are the recorded ones.
        let before = if k >= 2 { track.step(k - 1) } else { h };
        let slope = (right - left) * (h / (h + before));
        (right - slope, right + slope)
    } else {
        (left, right)
    };
    let middle = (start + end) * 0.5;
    let slope = |(w, v): (f64, Triple<1>), rate: Triple<1>| {
        let dot = v.x.0[0] * rate.x.0[0] + v.y.0[0] * rate.y.0[0] + v.z.0[0] * rate.z.0[0];
        (-0.5 * dot, (rate * w + v.cross(rate)) * 0.5)
    };
    let at = |(w, v): (f64, Triple<1>), h: f64| (1.0 + w * h, v * h);
    let k1 = slope((1.0, Triple::ZERO), start);
    let k2 = slope(at(k1, 0.5 * h), middle);
    let k3 = slope(at(k2, 0.5 * h), middle);
    let k4 = slope(at(k3, h), end);
    let w = 1.0 + (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0) * (h / 6.0);
    let v = (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0);
    Turn::from_parts(w, v)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::KAPPA;
    use crate::propagate::shared_data;

    #[test]
    #[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
    fn block_weights_equal_the_golden_fractions() {
        let Some(path) = shared_data::shared("golden/attitude.json") else {
            return;
        };
        let golden: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        for (n, weights) in KAPPA.iter().enumerate().skip(2) {
            let fractions = golden["kappa_block"][n.to_string()].as_array().unwrap();
            assert_eq!(fractions.len(), weights.len());
            for (fraction, weight) in fractions.iter().zip(*weights) {
                let (top, bottom) = fraction.as_str().unwrap().split_once('/').unwrap();
                let (top, bottom): (f64, f64) = (top.parse().unwrap(), bottom.parse().unwrap());
                assert_eq!(top / bottom, *weight, "{n} samples");
            }
        }
    }
}
