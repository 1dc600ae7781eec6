//! A motion with exact truth -> samples a perfect gyro would give, and the error of a contender. Pure.

use crate::contenders::Contender;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::{BodyRate, DeltaAngle, Quaternion};
use strapd_attitude::record::{Join, Measured, Nanos, RateSample, SampleKind, Status};
use strapd_bodies::motion::{BandLimited, Coning, Motion};
use strapd_bodies::top::{Case, SymmetricTop};

pub type Failure = Box<dyn std::error::Error>;

/// Samples at either end of a run that do not count where it is long: windows are one-sided there.
pub const MARGIN: usize = 24;

/// A motion as sampled.
pub struct Run {
    pub rates: Vec<RateSample>,
    pub increments: Vec<RateSample>,
    pub truth: Vec<Quaternion<Nav, Body>>,
}

impl Run {
    /// Makes one at these instants, nanoseconds, rising.
    fn new(motion: &mut Motion, stamps: impl Iterator<Item = u64>) -> Self {
        let mut run = Run {
            rates: Vec::new(),
            increments: Vec::new(),
            truth: Vec::new(),
        };
        let mut before = None;
        for now in stamps {
            let spin = motion.at_nanos(now);
            let from = before.unwrap_or(now);
            let sample = |start: u64, gyro| RateSample {
                stamp: Nanos(now as i64),
                start: Nanos(start as i64),
                gyro,
                accel: None,
                join: if before.is_none() {
                    Join::Start
                } else {
                    Join::Continuous
                },
                status: Status::OK,
                log: Nanos(now as i64),
            };
            let rate = Measured::Rate(BodyRate(spin.w_nb_b));
            run.rates.push(sample(now, rate));
            let delta = Measured::Increment(DeltaAngle(motion.delta_angle(from, now)));
            run.increments.push(sample(from, delta));
            run.truth.push(spin.q_nb);
            before = Some(now);
        }
        run
    }

    /// Coning of half angle `degrees`; sampled at 100 Hz.
    pub fn coning(degrees: f64, frequency_hz: f64, seconds: u64) -> Result<Self, Failure> {
        let mut motion = Motion::Coning(Coning::new(degrees.to_radians(), frequency_hz)?);
        Ok(Self::new(
            &mut motion,
            (0..=100 * seconds).map(|k| k * 10_000_000),
        ))
    }

    /// The seed's top for 1.2 s; rates that divide 1e9.
    pub fn top(rate_hz: u64) -> Result<Self, Failure> {
        let top = SymmetricTop::published();
        let start = Case::Cusped.start(&top, Case::SEED_TILT, Case::SEED_W3)?;
        let mut motion = Motion::HeavyBody(Box::new(top.exact(&start)?));
        let step = 1_000_000_000 / rate_hz;
        Ok(Self::new(
            &mut motion,
            (0..=1_200_000_000 / step).map(|k| k * step),
        ))
    }

    /// Random motion of 2 rad/s rms an axis up to 10 Hz, sampled at 200 Hz (`docs/theory/attitude.md` 6.3), at
    /// instants off by up to `jitter` of the interval.
    pub fn random(seed: u64, jitter: f64, seconds: u64) -> Result<Self, Failure> {
        let mut motion = Motion::BandLimited(Box::new(BandLimited::random(seed, 2.0, 10.0, 40)?));
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let stamps = (1..=200 * seconds).map(|k| {
            let place = k as f64 + jitter * rng.random_range(-1.0..1.0);
            (place * 5e6) as u64
        });
        Ok(Self::new(&mut motion, stamps))
    }

    /// The same with a part of the samples lost, and said to be.
    pub fn with_losses(&self, seed: u64, part: f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x10_55);
        let kept: Vec<usize> = (0..self.truth.len())
            .filter(|k| rng.random_range(0.0..1.0) >= part || *k <= MARGIN)
            .collect();
        let of = |samples: &[RateSample]| {
            let mut before = 0;
            kept.iter()
                .map(|&k| {
                    let mut sample = samples[k];
                    if k > before + 1 {
                        sample.join = Join::Bridge;
                    }
                    before = k;
                    sample
                })
                .collect()
        };
        Run {
            rates: of(&self.rates),
            increments: of(&self.increments),
            truth: kept.iter().map(|&k| self.truth[k]).collect(),
        }
    }

    /// Greatest angle between a contender and truth, rad, of what was turned since sample `margin`, the last `margin`
    /// samples left out. Where a contender is right at every so many samples only, at those.
    pub fn error(&self, who: &Contender, kind: SampleKind, margin: usize) -> Result<f64, Failure> {
        let samples = match kind {
            SampleKind::Rate => &self.rates,
            SampleKind::Average | SampleKind::DeltaAngle | SampleKind::Rotation => &self.increments,
        };
        let first = self.truth.first().ok_or("no samples")?;
        let found = who.run(kind, *first, samples)?;
        let (base, base_truth) = (found[margin], self.truth[margin]);
        let worst = (margin..found.len() - margin)
            .step_by(who.every)
            .map(|i| {
                let expected = base * base_truth.inverse() * self.truth[i];
                expected.angle_to(&found[i])
            })
            .fold(0.0, f64::max);
        Ok(worst)
    }
}

/// Arc seconds of an angle in rad.
pub fn arcsec(angle: f64) -> f64 {
    angle.to_degrees() * 3600.0
}
