//! Random band-limited motion, 200 Hz, 2 rad/s rms per axis, 60 s, of `attitude.md` 6.3: with jittered
//! sampling and lost samples. Truth by Runge-Kutta on sixteenths of each interval.

use crate::run::{ARCSEC, product, propagate, sample, worst_inside};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use strapd::propagate::{Method, Order, Placement};
use strapd::record::{Join, RateSample, SampleKind};

const RATE_HZ: f64 = 200.0;
const SECONDS: f64 = 60.0;
/// Truth's Runge-Kutta leaves this much in 60 s, found by halving its step, arc seconds.
pub const TRUTH: f64 = 2e-4;
const TONES: usize = 40;

struct Motion {
    /// Per axis: amplitude rad/s, angular frequency, phase.
    tones: [[(f64, f64, f64); TONES]; 3],
}

impl Motion {
    fn new(rng: &mut ChaCha8Rng, part_of_rate: f64) -> Self {
        let amplitude = 2.0 * (2.0 / TONES as f64).sqrt();
        let mut tone = || {
            let f = rng.random_range(0.02..1.0) * part_of_rate * RATE_HZ;
            (amplitude, TAU * f, rng.random_range(0.0..TAU))
        };
        Motion {
            tones: std::array::from_fn(|_| std::array::from_fn(|_| tone())),
        }
    }

    fn rate(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let tones = &self.tones[axis];
            tones.iter().map(|(a, w, p)| a * (w * t + p).sin()).sum()
        })
    }

    /// Integral of the rate from `a` to `b`; as a product, so that nothing cancels.
    fn increment(&self, a: f64, b: f64) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let tones = &self.tones[axis];
            tones
                .iter()
                .map(|(size, w, p)| {
                    let (middle, half) = (0.5 * w * (a + b) + p, 0.5 * w * (b - a));
                    size / w * 2.0 * middle.sin() * half.sin()
                })
                .sum()
        })
    }

    /// The attitude at `b`, given that at `a`.
    fn turn(&self, mut q: [f64; 4], a: f64, b: f64) -> [f64; 4] {
        const PIECES: usize = 16;
        let h = (b - a) / PIECES as f64;
        let slope = |q: [f64; 4], [x, y, z]: [f64; 3]| product(q, [0.0, 0.5 * x, 0.5 * y, 0.5 * z]);
        let plus = |q: [f64; 4], k: [f64; 4], h: f64| -> [f64; 4] {
            std::array::from_fn(|i| q[i] + h * k[i])
        };
        let mut start = self.rate(a);
        for piece in 0..PIECES {
            let t = a + piece as f64 * h;
            let (middle, end) = (self.rate(t + 0.5 * h), self.rate(t + h));
            let k1 = slope(q, start);
            let k2 = slope(plus(q, k1, 0.5 * h), middle);
            let k3 = slope(plus(q, k2, 0.5 * h), middle);
            let k4 = slope(plus(q, k3, h), end);
            for i in 0..4 {
                q[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
            }
            start = end;
        }
        let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
        q.map(|c| c / norm)
    }
}

pub struct Log {
    pub rates: Vec<RateSample>,
    pub increments: Vec<RateSample>,
    pub truth: Vec<[f64; 4]>,
}

/// Sampled with true jitter of up to a fifth of the interval to either side, a part of the samples lost.
pub fn log(seed: u64, part_of_rate: f64, lost: f64, join: Join) -> Log {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let motion = Motion::new(&mut rng, part_of_rate);
    let step = 1e9 / RATE_HZ;
    let mut log = Log {
        rates: vec![],
        increments: vec![],
        truth: vec![],
    };
    let mut q = [1.0, 0.0, 0.0, 0.0];
    let (mut before, mut after_loss) = (0, false);
    for k in 0..(SECONDS * RATE_HZ) as i64 {
        let stamp = (step * (k as f64 + rng.random_range(-0.2..0.2))) as i64;
        let (a, b) = (before as f64 * 1e-9, stamp as f64 * 1e-9);
        q = if k == 0 { q } else { motion.turn(q, a, b) };
        let is_lost = k > 40 && rng.random_range(0.0..1.0) < lost;
        if !is_lost {
            let mut rate = sample(stamp, stamp, motion.rate(b));
            let mut increment = sample(before, stamp, motion.increment(a, b));
            if k == 0 {
                increment.start = increment.stamp;
            }
            if after_loss {
                (rate.join, increment.join) = (join, join);
            }
            log.rates.push(rate);
            log.increments.push(increment);
            log.truth.push(q);
        }
        (before, after_loss) = (stamp, is_lost);
    }
    log
}

const fn centred(window: usize) -> Method {
    Method::Magnus {
        window,
        order: Order::Exact,
        placement: Placement::Centred,
    }
}

fn error(log: &Log, kind: SampleKind, method: Method) -> f64 {
    let samples = match kind {
        SampleKind::Rate => &log.rates,
        _ => &log.increments,
    };
    let out = propagate(method, kind, log.truth[0], samples);
    worst_inside(&out, |i| log.truth[i], 24) * ARCSEC
}

/// The table's greatest error, arc seconds: part of the rate, method, jittered, and with losses.
const TABLE: [(f64, SampleKind, Method, f64, f64); 12] = [
    (0.05, SampleKind::Rate, centred(8), 0.0032, 0.019),
    (0.05, SampleKind::Rate, Method::Auto, 1.2e-7, 7.3e-7),
    (0.05, SampleKind::DeltaAngle, centred(5), 0.14, 8.7),
    (0.05, SampleKind::DeltaAngle, centred(7), 0.0024, 0.2),
    (0.05, SampleKind::DeltaAngle, centred(9), 7.5e-5, f64::NAN),
    (0.05, SampleKind::Rate, commit(6), 0.21, 1.0),
    (0.1, SampleKind::Rate, centred(8), 0.73, 3.7),
    (0.1, SampleKind::Rate, Method::Auto, 3.2e-5, 4.1e-4),
    (0.1, SampleKind::DeltaAngle, centred(5), 1.5, 210.0),
    (0.1, SampleKind::DeltaAngle, centred(7), 0.11, 17.0),
    (0.1, SampleKind::DeltaAngle, centred(9), 0.0088, f64::NAN),
    (0.1, SampleKind::Rate, commit(6), 8.9, 56.0),
];

const fn commit(window: usize) -> Method {
    Method::CommitProvisional {
        window,
        order: Order::M8,
        finals: false,
    }
}

#[test]
fn jittered_sampling_and_lost_samples_cost_what_the_table_says() {
    // The greatest error of 60 s hangs on where fast motion and losses meet, above all two losses in a
    // row: one seed gives three times another's. The theory had one draw; the median of three of ours is
    // within 2.3 of it throughout. A lower order would be off by fifty.
    const CHANCE: f64 = 2.5;
    for part in [0.05, 0.1] {
        let logs = |lost| [1, 2, 3].map(|seed| log(seed, part, lost, Join::Continuous));
        let (jittered, lossy) = (logs(0.0), logs(0.01));
        for (_, kind, method, expected, expected_lossy) in
            TABLE.into_iter().filter(|row| row.0 == part)
        {
            for (logs, expected) in [(&jittered, expected), (&lossy, expected_lossy)] {
                let mut found = logs.each_ref().map(|log| error(log, kind, method));
                found.sort_by(f64::total_cmp);
                // NaN: nine increments of which one is missing are fewer than the table's.
                assert!(
                    expected.is_nan() || found[1] < CHANCE * expected + TRUTH,
                    "{part}, {method}, {kind:?}: {found:?}, table {expected}"
                );
            }
        }
    }
}

#[test]
fn marking_lost_samples_costs_the_order_of_the_policy_and_no_more() {
    let log = log(1, 0.05, 0.01, Join::Bridge);
    // One or two missing: eight samples (attitude.md 6.4), so the row of eight centred ones, 0.019.
    for kind in [SampleKind::Rate, SampleKind::DeltaAngle] {
        let found = error(&log, kind, Method::Auto);
        assert!(
            (1e-3..0.05).contains(&found),
            "{kind:?}: {found:.2e} arcsec"
        );
    }
}
