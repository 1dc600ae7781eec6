//! Bodies of which one axis stays vertical, and what is no rest: where gravity does not tell the gyro's bias.

use super::logs::{Log, Q, conjugate, errors, exp, product};
use crate::frames::In;
use crate::quaternion::BodyRate;
use crate::record::Nanos;
use crate::smooth::{Estimate, Failure, Outcome, Sample, Settings, Smoothed};
use nalgebra::Vector3;

const HZ: f64 = 50.0;

/// White noise of unit variance, the same each time.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum - 6.0
    }

    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.next() * sigma)
    }
}

/// Pose and travel of a body.
struct Body {
    secs: f64,
    /// Rate about the vertical, rad/s, and speed ahead, m/s.
    turn: fn(f64) -> f64,
    speed: fn(f64) -> f64,
    /// Angle by which it leans, rad.
    lean: f64,
    /// Noise of its motion, m/s^2 and rad/s, by how far it is under way.
    shaking: f64,
    /// deg/s.
    bias: [f64; 3],
    /// Size of the forces that are measured.
    scale: f64,
    seed: u64,
}

impl Body {
    fn new(turn: fn(f64) -> f64, speed: fn(f64) -> f64) -> Body {
        Body {
            secs: 120.0,
            turn,
            speed,
            lean: 0.0,
            shaking: 0.0,
            bias: [0.0; 3],
            scale: 1.0,
            seed: 1,
        }
    }

    fn log(&self) -> Log {
        const FINE: usize = 4;
        let (step, mut noise) = (1.0 / HZ, Noise(self.seed));
        let fine = step / FINE as f64;
        let (mut yaw, mut at) = (0.0, None);
        let (mut samples, mut truth) = (Vec::new(), Vec::new());
        for i in 0..(self.secs * HZ) as i64 {
            let t = i as f64 * step;
            let mut force = Vector3::zeros();
            let (mut q, mut before) = ([1.0, 0.0, 0.0, 0.0], at.unwrap_or([0.0; 4]));
            for part in 0..FINE {
                let t = t + part as f64 * fine;
                let turn = (self.turn)(t);
                yaw += turn * fine;
                let lean = self.lean * Vector3::new((1.3 * t).sin(), (0.9 * t + 1.0).sin(), 0.0);
                q = product(&exp(Vector3::z() * yaw), &exp(lean));
                let push = ((self.speed)(t + fine) - (self.speed)(t)) / fine;
                let ahead = Vector3::new(yaw.cos(), yaw.sin(), 0.0);
                let across = Vector3::new(-yaw.sin(), yaw.cos(), 0.0);
                let acceleration = ahead * push + across * ((self.speed)(t) * turn);
                let to_body = Q::assume_unit(q).to_dcm().as_matrix().transpose();
                force += to_body * (acceleration + Vector3::z() * 9.81) / FINE as f64;
            }
            if at.is_none() {
                before = q;
            }
            let moved: Q = Q::assume_unit(product(&conjugate(&before), &q));
            at = Some(q);
            let shaking = self.shaking * (self.speed)(t).abs().min(1.0);
            let rate = moved.rotation_vector().0 / step
                + Vector3::from(self.bias).map(f64::to_radians)
                + noise.vector((0.014_f64.to_radians() * HZ.sqrt()).hypot(0.03 * shaking));
            let force = force * self.scale + noise.vector(0.02_f64.hypot(shaking));
            samples.push(Sample {
                stamp: Nanos((t * 1e9).round() as i64),
                rate: BodyRate(rate),
                force: Some(In::assume(force)),
                field: None,
                is_saturated: false,
            });
            truth.push(q);
        }
        Log { samples, truth }
    }

    fn smoothed(&self) -> Seen {
        self.smoothed_by(&Settings::default())
    }

    fn smoothed_by(&self, settings: &Settings) -> Seen {
        let log = self.log();
        let (smoothed, estimates) = log.smoothed(settings);
        let middle = smoothed
            .biases()
            .nth(smoothed.counts().segments as usize / 2);
        let middle = middle.unwrap();
        let inside = inside(&estimates, &log.truth);
        Seen {
            off: middle.value.z.to_degrees() - self.bias[2],
            stated: middle.sigma.z.to_degrees(),
            errors: errors(&estimates, &log.truth, true),
            inside,
            smoothed,
        }
    }
}

/// Result for a body.
#[derive(Debug)]
struct Seen {
    /// Error of the bias about the vertical in the middle, and one sigma of it, deg/s.
    off: f64,
    stated: f64,
    /// Tilt and heading, rms, then the largest, deg.
    errors: [f64; 4],
    /// Share of the headings within three sigma.
    inside: f64,
    smoothed: Smoothed,
}

pub(super) fn inside(estimates: &[Estimate], truth: &[[f64; 4]]) -> f64 {
    let heading = |i: usize| {
        let [w, _, _, z] = product(&estimates[i].q_nb.wxyz(), &conjugate(&truth[i]));
        2.0 * z.atan2(w)
    };
    let (mut last, mut turned, mut count) = (heading(0), 0.0, 0);
    for (i, estimate) in estimates.iter().enumerate() {
        let now = heading(i);
        let step = now - last;
        turned += step - std::f64::consts::TAU * (step / std::f64::consts::TAU).round();
        last = now;
        count += i32::from(turned.abs() < 3.0 * estimate.covariance[(2, 2)].sqrt());
    }
    f64::from(count) / estimates.len() as f64
}

fn wanders(t: f64) -> f64 {
    0.5 * (0.83 * t).sin() + 0.4 * (0.31 * t + 1.0).sin() + 0.3 * (1.37 * t + 2.0).sin()
}

/// Path in rings.
fn circles(t: f64) -> f64 {
    0.25 + wanders(t)
}

/// Ramp from 0 to 1 between two times.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    let x = ((t - from) / (to - from)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[test]
fn nothing_is_learned_of_a_bias_about_an_axis_that_stays_upright() {
    for seed in 1..=3 {
        let body = Body {
            secs: 200.0,
            seed,
            ..Body::new(circles, |_| 1.0)
        };
        let seen = body.smoothed();
        assert!(seen.off.abs() <= 0.1 && seen.stated >= 0.9, "{seen:?}");
        assert_eq!(
            seen.smoothed.held().map(|held| held.is_by_rest),
            Some(false)
        );
        // One that is there stays unknown, and that is said.
        let biased = Body {
            bias: [0.3, -0.3, 0.8],
            ..body
        };
        let seen = biased.smoothed();
        assert!(seen.off.abs() < 1.2 && seen.inside > 0.97, "{seen:?}");
    }
}

#[test]
fn what_leans_shows_its_bias() {
    let body = Body {
        secs: 200.0,
        lean: 0.2,
        bias: [0.1, 0.1, 0.3],
        ..Body::new(circles, |_| 1.0)
    };
    let seen = body.smoothed();
    assert!(seen.stated < 0.5 && seen.off.abs() < 0.2, "{seen:?}");
}

#[test]
fn a_steady_turn_at_the_start_and_at_the_end_is_no_rest() {
    let turn = |t: f64| {
        let [before, after] = [1.0 - ramp(t, 1.2, 2.2), ramp(t, 58.8, 59.8)];
        let between = ramp(t, 1.2, 2.7) * (1.0 - ramp(t, 57.3, 58.8));
        (2.5 * before + 2.2 * after).to_radians() + 0.5 * wanders(t) * between
    };
    let body = Body {
        secs: 61.0,
        shaking: 0.3,
        ..Body::new(turn, |t| {
            0.4 * ramp(t, 1.5, 2.5) * (1.0 - ramp(t, 58.5, 59.5))
        })
    };
    let seen = body.smoothed();
    let [_, _, _, most] = seen.errors;
    assert!(most <= 2.0 && seen.inside > 0.97, "{seen:?}");
    assert_eq!(seen.smoothed.counts().standstills, 0);
}

#[test]
fn a_steady_turn_of_two_seconds_at_both_ends_is_no_rest() {
    let turn = |t: f64| {
        let [before, after] = [1.0 - ramp(t, 2.0, 3.0), ramp(t, 58.0, 59.0)];
        let between = ramp(t, 2.0, 3.5) * (1.0 - ramp(t, 56.5, 58.0));
        (2.5 * before + 2.2 * after).to_radians() + 0.5 * wanders(t) * between
    };
    let body = Body {
        secs: 61.0,
        shaking: 0.3,
        bias: [0.05, -0.03, 0.04],
        ..Body::new(turn, |t| {
            0.4 * ramp(t, 2.3, 3.3) * (1.0 - ramp(t, 57.7, 58.7))
        })
    };
    let seen = body.smoothed();
    let [_, _, _, most] = seen.errors;
    assert!(most <= 5.0 && seen.inside > 0.97, "{seen:?}");
    assert!(seen.smoothed.held().is_some_and(|held| !held.is_by_rest));
}

#[test]
fn a_turntable_at_a_constant_rate_never_rests() {
    let body = Body {
        bias: [0.3, -0.2, 0.1],
        ..Body::new(|_| 6_f64.to_radians(), |_| 0.0)
    };
    let seen = body.smoothed();
    assert_eq!(seen.smoothed.counts().standstills, 0);
    assert!(seen.inside > 0.97 && seen.errors[3] < 30.0, "{seen:?}");
    // One that stands still before is at rest then, though it turns for longer.
    let body = Body {
        turn: |t| 6_f64.to_radians() * ramp(t, 20.0, 21.0),
        ..body
    };
    let seen = body.smoothed();
    assert!(
        (30..=40).contains(&seen.smoothed.counts().standstills),
        "{seen:?}"
    );
    // Of 600 degrees, which no scale is known for: 0.3 % of them, and the bias.
    assert!(seen.errors[3] < 3.0 && seen.inside > 0.97, "{seen:?}");
}

#[test]
fn a_turntable_as_slow_as_a_bias_never_rests() {
    for rate in [1.0, 2.0] {
        let turn: fn(f64) -> f64 = if rate < 2.0 {
            |_| 1_f64.to_radians()
        } else {
            |_| 2_f64.to_radians()
        };
        let body = Body {
            bias: [0.05, -0.03, 0.04],
            ..Body::new(turn, |_| 0.0)
        };
        let seen = body.smoothed();
        assert_eq!(seen.smoothed.counts().standstills, 0, "{rate}");
        assert!(seen.inside > 0.97 && seen.errors[3] < 15.0, "{seen:?}");
    }
}

#[test]
fn a_rest_is_seen_under_the_noise_and_the_lines_of_a_gyro() {
    // White noise of 0.6 deg/s a sample, and a line of 1.1 deg/s at 6 Hz: what the gyro reads as it moves, too.
    for line in [0.0, 1.6_f64.to_radians()] {
        let body = Body {
            secs: 60.0,
            shaking: 0.5,
            bias: [0.2, -0.1, 0.3],
            ..Body::new(
                |t| 0.5 * wanders(t) * (1.0 - ramp(t, 40.0, 42.0)),
                |t| 0.5 * (1.0 - ramp(t, 40.0, 42.0)),
            )
        };
        let mut log = body.log();
        let mut noise = Noise(5);
        let white = if line > 0.0 { 0.1 } else { 0.6_f64 };
        for (i, sample) in log.samples.iter_mut().enumerate() {
            let t = i as f64 / HZ;
            sample.rate.0 += noise.vector(white.to_radians())
                + Vector3::x() * (line * (std::f64::consts::TAU * 6.05 * t).sin());
        }
        let (smoothed, estimates) = log.smoothed(&Settings::default());
        let counts = smoothed.counts();
        assert!((30..=37).contains(&counts.standstills), "{counts:?}");
        let held = smoothed.held().unwrap();
        assert!(held.is_by_rest, "{held:?}");
        assert!((held.rate.to_degrees() - 0.3).abs() < 0.1, "{held:?}");
        // Known at rest to hundredths, and not so in motion.
        assert!(held.sigma.to_degrees() > 0.14, "{held:?}");
        assert!(inside(&estimates, &log.truth) > 0.97);
    }
}

#[test]
fn a_slow_wave_under_the_noise_is_no_rest() {
    // As quiet as the noise, and a motion of the body: 1 deg/s to and fro at 1 Hz.
    let body = Body {
        secs: 60.0,
        bias: [0.2, -0.1, 0.3],
        ..Body::new(
            |t| 1.4_f64.to_radians() * (std::f64::consts::TAU * t).sin(),
            |_| 0.0,
        )
    };
    let seen = body.smoothed();
    assert_eq!(seen.smoothed.counts().standstills, 0, "{seen:?}");
}

#[test]
fn a_rest_at_the_end_alone_tells_the_bias_of_a_log_that_starts_in_a_curve() {
    let body = Body {
        shaking: 0.3,
        bias: [0.4, -0.3, 0.6],
        ..Body::new(
            |t| (0.2 + 0.5 * wanders(t)) * (1.0 - ramp(t, 100.0, 103.0)),
            |t| 4.0 * (1.0 - ramp(t, 100.0, 103.0)),
        )
    };
    let seen = body.smoothed();
    assert!(
        seen.smoothed.held().is_some_and(|held| held.is_by_rest),
        "{seen:?}"
    );
    assert!(seen.errors[3] < 2.0 && seen.inside > 0.97, "{seen:?}");
}

#[test]
fn a_stated_bias_is_believed_to_its_sigma() {
    let known = |sigma: f64| {
        let mut settings = Settings::default();
        settings.known.gyro_bias = [Some(sigma.to_radians()); 3];
        settings
    };
    let body = Body {
        bias: [0.02, -0.03, 0.05],
        ..Body::new(wanders, |_| 1.0)
    };
    let seen = body.smoothed_by(&known(0.06));
    assert!(seen.stated < 0.1 && seen.off.abs() < 0.1, "{seen:?}");
    // And a class to its own.
    let class = Settings {
        bias_sigma: 0.14_f64.to_radians(),
        ..Settings::default()
    };
    let seen = body.smoothed_by(&class);
    assert!(
        (0.1..0.2).contains(&seen.stated) && seen.off.abs() < 0.2,
        "{seen:?}"
    );
}

#[test]
fn an_accelerometer_that_reads_096_g_costs_no_tilt() {
    let body = Body {
        scale: 0.96,
        lean: 0.6,
        ..Body::new(wanders, |t| ramp(t, 5.0, 7.0))
    };
    let seen = body.smoothed();
    let [tilt, ..] = seen.errors;
    assert!(tilt < 0.3, "{seen:?}");
    let matrix = seen.smoothed.calibration().force.value;
    for i in [0, 4, 8] {
        assert!((matrix[i] - 1.0 / 0.96 + 1.0).abs() < 0.005, "{matrix:?}");
    }
}

#[test]
fn an_accelerometers_bias_beyond_what_there_is_is_refused() {
    let mut log = super::logs::log(super::logs::Motion::Hand).plain();
    for sample in &mut log.samples {
        let force = sample.force.unwrap();
        sample.force = Some(In::assume(force.as_vector() + Vector3::new(0.9, 0.0, 0.0)));
    }
    let mut settings = Settings::default();
    settings.looseness.force = 10.0;
    let (smoothed, _) = log.smoothed(&settings);
    let outcome = smoothed.outcome();
    assert!(
        matches!(outcome, Outcome::Filter(Failure::ForceBias(_))),
        "{outcome:?}"
    );
}

#[test]
fn half_a_second_is_enough_for_an_attitude() {
    for body in [Body::new(wanders, |_| 0.0), Body::new(|_| 0.0, |_| 0.0)] {
        let seen = Body { secs: 0.5, ..body }.smoothed();
        assert!(seen.errors[2] < 2.0 && seen.inside > 0.97, "{seen:?}");
    }
}

#[test]
fn a_field_that_leads_nowhere_leaves_the_filter() {
    let mut log = super::logs::log(super::logs::Motion::Hand);
    let mut noise = Noise(7);
    let mut field = Vector3::zeros();
    for (i, (sample, truth)) in log.samples.iter_mut().zip(&log.truth).enumerate() {
        // Another direction every three seconds.
        if i % 300 == 0 {
            field = noise.vector(1.0).normalize() * 50.0;
        }
        let to_body = Q::assume_unit(*truth).to_dcm().as_matrix().transpose();
        sample.field = Some(In::assume(to_body * field));
    }
    let (smoothed, _) = log.smoothed(&Settings::default());
    let outcome = smoothed.outcome();
    assert!(matches!(outcome, Outcome::Filter(_)), "{outcome:?}");
}
