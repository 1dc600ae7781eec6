//! Time -> attitude, body rate and specific force of two motions, in closed form. Pure.
//!
//! A stage of its own because these are the fixtures' truth: nothing here is integrated, every
//! value is the formula's to a few units in the last place. Attitude is `q_sb = [w, x, y, z]`,
//! body to the world that coincides with the body at time zero; rates are in rad/s, body axes.

use super::turns::sin_cos;
use std::f64::consts::TAU;

/// Standard gravity, m/s^2 (CGPM 1901).
pub(crate) const STANDARD_GRAVITY: f64 = 9.806_65;

/// Nanoseconds in a second.
pub(crate) const SECOND: i64 = 1_000_000_000;

/// A motion of a body that is level at time zero and whose origin rests.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Motion {
    /// The body's z axis swings on a cone of half angle a = 10 deg, three times a second, while the
    /// body does not turn about it: x and y rates are 90 deg out of phase and z drifts one way, the
    /// motion on which rate summing fails (Goodman and Robinson 1958; Bortz 1971).
    Coning,
    /// A quarter turn per second about the body axis (2, -1, 2) / 3.
    ConstantRate,
}

const CONING_HZ: i64 = 3;
/// Ten degrees as a fraction of a turn.
const CONE_TURNS: (i64, i64) = (1, 36);

const AXIS: [f64; 3] = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
const SECONDS_PER_TURN: i64 = 4;

impl Motion {
    /// `q_sb` at `nanos` after the start.
    pub(crate) fn attitude(self, nanos: i64) -> [f64; 4] {
        match self {
            // With phase p, c = cos a/2, s = sin a/2 and r = (c, s cos p, s sin p, 0):
            // r(0)* r(p), with cos p - 1 written as -2 sin^2 p/2.
            Motion::Coning => {
                let (s, c) = sin_cos(CONE_TURNS.0, 2 * CONE_TURNS.1);
                let (sin_phase, _) = sin_cos(CONING_HZ * nanos, SECOND);
                let (sin_half_phase, _) = sin_cos(CONING_HZ * nanos, 2 * SECOND);
                let versed = 2.0 * sin_half_phase * sin_half_phase;
                [
                    1.0 - s * s * versed,
                    -s * c * versed,
                    s * c * sin_phase,
                    -s * s * sin_phase,
                ]
            }
            Motion::ConstantRate => {
                let (sin, cos) = sin_cos(nanos, 2 * SECONDS_PER_TURN * SECOND);
                [cos, AXIS[0] * sin, AXIS[1] * sin, AXIS[2] * sin]
            }
        }
    }

    /// Body rate at `nanos` after the start: `2 q* dq/dt`.
    pub(crate) fn rate(self, nanos: i64) -> [f64; 3] {
        match self {
            Motion::Coning => {
                let omega = TAU * CONING_HZ as f64;
                let (sin_cone, _) = sin_cos(CONE_TURNS.0, CONE_TURNS.1);
                let (sin, cos) = sin_cos(CONING_HZ * nanos, SECOND);
                [
                    -omega * sin_cone * sin,
                    omega * sin_cone * cos,
                    coning_drift(),
                ]
            }
            Motion::ConstantRate => AXIS.map(|axis| TAU / SECONDS_PER_TURN as f64 * axis),
        }
    }

    /// Mean of the body rate from `start` to `end`, both nanoseconds after the motion's start.
    pub(crate) fn mean_rate(self, start: i64, end: i64) -> [f64; 3] {
        match self {
            // The integral of the rate, as products: differences of cosines would cancel.
            Motion::Coning => {
                let (sin_cone, _) = sin_cos(CONE_TURNS.0, CONE_TURNS.1);
                let (sin_middle, cos_middle) = sin_cos(CONING_HZ * (start + end), 2 * SECOND);
                let (sin_half_width, _) = sin_cos(CONING_HZ * (end - start), 2 * SECOND);
                let seconds = (end - start) as f64 * 1e-9;
                let chord = 2.0 * sin_cone * sin_half_width / seconds;
                [-chord * sin_middle, chord * cos_middle, coning_drift()]
            }
            Motion::ConstantRate => self.rate(end),
        }
    }

    /// Specific force in body axes, m/s^2: gravity's reaction alone, +g along z when level.
    pub(crate) fn specific_force(self, nanos: i64) -> [f64; 3] {
        let [w, x, y, z] = self.attitude(nanos);
        [
            STANDARD_GRAVITY * 2.0 * (x * z - w * y),
            STANDARD_GRAVITY * 2.0 * (y * z + w * x),
            STANDARD_GRAVITY * (1.0 - 2.0 * (x * x + y * y)),
        ]
    }
}

/// The coning motion's constant z rate, `-omega (1 - cos a)`, without the cancellation.
fn coning_drift() -> f64 {
    let (s, _) = sin_cos(CONE_TURNS.0, 2 * CONE_TURNS.1);
    -TAU * CONING_HZ as f64 * 2.0 * s * s
}
