//! The first forces of a stream -> whether they are specific forces at all. Pure.
//!
//! A stage of its own because nothing else can tell: an acceleration without gravity, as phones export it, levels
//! to anything, and the filter would believe it.
//!
//! In a frame that does not turn, the mean specific force over `T` is gravity and the change of velocity over
//! `T`: a body that walks, runs or is shaken passes after a second or a few, and no length of a single sample
//! has to be gravity's.

use crate::plausible::{are_numbers, is_amount};
use nalgebra::Vector3;

/// First time at which it is judged, s.
const FIRST: f64 = 1.0;
/// Time from which a mean that is nowhere near gravity is denied, s.
const FAR: f64 = 4.0;
/// Time from which any other is, s: a swell has passed.
const LAST: f64 = 20.0;
/// Lengths of a mean force, as shares of gravity, beyond which no gravity is near.
const NEAR: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// Largest deviation of the mean from gravity, as a share: errors of sensors.
const SHARE: f64 = 0.15;
/// Change of velocity that bodies are capable of meanwhile, m/s.
const VELOCITY: f64 = 0.7;

/// Whether a mean specific force of this length over `secs` can be gravity (m/s^2).
pub(crate) fn is_gravity(length: f64, secs: f64, gravity: f64) -> bool {
    (length - gravity).abs() <= SHARE * gravity + VELOCITY / secs
}

/// Verdict on the forces seen so far.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum Plausibility {
    /// Not enough: integral of the force in earth axes (m/s), and of time.
    #[default]
    Open,
    /// The same, begun.
    Seen(Vector3<f64>, f64),
    /// Specific forces.
    Given,
    /// Other quantities.
    Denied,
}

impl Plausibility {
    /// Whether it can have been seen: what a file says may be anything.
    pub(super) fn is_plausible(&self) -> bool {
        match self {
            Plausibility::Seen(sum, secs) => are_numbers(sum) && is_amount(*secs),
            Plausibility::Open | Plausibility::Given | Plausibility::Denied => true,
        }
    }

    /// Takes a force in earth axes that stands for `secs`. Says whether it has just been found to be none.
    pub(super) fn denies(&mut self, secs: f64, force: &Vector3<f64>, gravity: f64) -> bool {
        let (sum, before) = match *self {
            Plausibility::Given | Plausibility::Denied => return false,
            Plausibility::Open => (Vector3::zeros(), 0.0),
            Plausibility::Seen(sum, secs) => (sum, secs),
        };
        let (sum, seen) = (sum + force * secs, before + secs);
        *self = Plausibility::Seen(sum, seen);
        let is_time = (before < FIRST && seen >= FIRST) || seen >= FAR;
        let length = sum.norm() / seen;
        let is_near = NEAR.contains(&(length / gravity));
        if is_time && is_gravity(length, seen, gravity) {
            *self = Plausibility::Given;
        } else if seen >= LAST || (seen >= FAR && !is_near) {
            *self = Plausibility::Denied;
        }
        *self == Plausibility::Denied
    }

    pub(super) fn is_denied(self) -> bool {
        self == Plausibility::Denied
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f64 = 9.81;

    fn judged(force: impl Fn(f64) -> f64) -> Plausibility {
        let mut plausibility = Plausibility::default();
        for i in 0..2500 {
            let up = Vector3::z() * force(f64::from(i) * 0.01);
            let _ = plausibility.denies(0.01, &up, G);
        }
        plausibility
    }

    #[test]
    fn a_running_person_has_gravity_in_the_mean_and_linear_acceleration_has_none() {
        let stride = |secs: f64| 15.0 * (17.0 * secs + 0.4).sin();
        assert_eq!(judged(|secs| G + stride(secs)), Plausibility::Given);
        assert_eq!(judged(stride), Plausibility::Denied);
        assert_eq!(judged(|_| 0.0), Plausibility::Denied);
        // A start at half a g for two seconds is taken in the end.
        assert_eq!(
            judged(|secs| if secs < 1.5 { 1.2 * G } else { G }),
            Plausibility::Given
        );
    }

    #[test]
    fn a_boat_that_begins_on_a_long_wave_has_gravity_once_it_has_passed() {
        let wave = |secs: f64| 3.5 * (std::f64::consts::TAU * secs / 9.0).sin();
        assert_eq!(judged(|secs| G + wave(secs)), Plausibility::Given);
        assert_eq!(judged(|secs| G - wave(secs)), Plausibility::Given);
        assert_eq!(judged(|secs| 1.4 * G + wave(secs)), Plausibility::Denied);
    }

    #[test]
    fn what_was_decided_stays() {
        let mut plausibility = Plausibility::Given;
        for _ in 0..1000 {
            assert!(!plausibility.denies(0.01, &Vector3::zeros(), G));
        }
        assert_eq!(plausibility, Plausibility::Given);
    }
}
