//! Joints, rates and accelerations at equal intervals -> at any instant. Pure.

use crate::youbot::joints::{JOINTS, TableMotion};

/// The polynomials of fifth degree that meet both ends of an interval in value and two derivatives.
/// Before the first knot and after the last it rests there.
pub(super) fn at(step: f64, knots: &[TableMotion], secs: f64) -> TableMotion {
    let place = secs / step;
    // A negative place, and NaN, is knot zero.
    let index = place.floor() as usize;
    let (Some(from), true) = (knots.get(index), secs >= 0.0) else {
        let end = if secs >= 0.0 {
            knots.last()
        } else {
            knots.first()
        };
        let q = end.map_or([0.0; JOINTS], |k| k.q().angles());
        return TableMotion::computed(q, [0.0; JOINTS], [0.0; JOINTS]);
    };
    let Some(to) = knots.get(index + 1) else {
        return *from;
    };
    let x = place - index as f64;
    let (mut q, mut qd, mut qdd) = ([0.0; JOINTS], [0.0; JOINTS], [0.0; JOINTS]);
    for i in 0..JOINTS {
        let (a, b) = (from.q().angles()[i], to.q().angles()[i]);
        let (ad, bd) = (from.qd()[i] * step, to.qd()[i] * step);
        let (add, bdd) = (from.qdd()[i] * step * step, to.qdd()[i] * step * step);
        // What the far end adds to the first end's parabola: c3 x^3 + c4 x^4 + c5 x^5.
        let d = (b - a) - ad - 0.5 * add;
        let dd = (bd - ad) - add;
        let ddd = bdd - add;
        let c3 = 10.0 * d - 4.0 * dd + 0.5 * ddd;
        let c4 = -15.0 * d + 7.0 * dd - ddd;
        let c5 = 6.0 * d - 3.0 * dd + 0.5 * ddd;
        q[i] = a + x * (ad + x * (0.5 * add + x * (c3 + x * (c4 + x * c5))));
        let rate = ad + x * (add + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)));
        qd[i] = rate / step;
        qdd[i] = (add + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))) / (step * step);
    }
    TableMotion::computed(q, qd, qdd)
}
