//! A motion with exact truth -> RawSample, and the truth beside it. Pure.
//!
//! A source like any other: what comes out takes the same way through conditioning and integration as
//! a recording, and is the only source whose answer is known beforehand.
//!
//! # Convention
//! The sensor sits at the origin of the body axes, its axes are theirs (FLU). Navigation z points up,
//! whatever x points at is called east, so the world of the truth is ENU. The specific force is
//! `f_b = C_nb^T (a_n - g_n)`: 9.8 m/s^2 upwards at rest.
//!
//! Sample k is taken at `round(k 1e9 / rate)` ns after the start, and the motion is evaluated at that
//! very nanosecond. Rates begin at k = 0; averages and delta angles are over the interval that ends at
//! their stamp, and so begin at k = 1. Truth is given for every k from 0 on.

use crate::model::attitude::Quaternion;
use crate::model::frames::{Body, In, Nav};
use crate::model::motion::Motion;
use crate::model::rigid_body::Spin;
use crate::record::{Nanos, RawSample, SampleKind};
use nalgebra::Vector3;
use std::fmt;

/// How a motion is sampled.
#[derive(Clone, Debug)]
pub struct Sampling {
    /// Samples a second.
    pub rate_hz: f64,
    /// Seconds from the first instant to the last.
    pub duration_secs: f64,
    /// What a sample is.
    pub kind: SampleKind,
    /// Stamp of the first instant.
    pub start: Nanos,
    /// Gravity, m/s^2, downwards.
    pub gravity: f64,
}

/// Fastest sampling: a nanosecond is then a thousandth of the interval.
const FASTEST_HZ: f64 = 1e6;
/// Longest run, s: 31 years.
const LONGEST_SECS: f64 = 1e9;

/// A sampling that can not be.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum SamplingError {
    /// A number out of its range.
    OutOfRange {
        /// Which, with its unit.
        what: &'static str,
        /// As given.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// The motion turns half a turn or more from sample to sample at its start.
    UnderSampled {
        /// As given, Hz.
        rate_hz: f64,
        /// The rate that must be exceeded, Hz.
        needed_hz: f64,
    },
    /// Stamps would run over the end of 64-bit nanoseconds.
    StampOverflow {
        /// The first one.
        start: Nanos,
    },
}

impl fmt::Display for SamplingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SamplingError::OutOfRange {
                what,
                value,
                allowed,
            } => write!(f, "{what} can not be {value}: {allowed}"),
            SamplingError::UnderSampled { rate_hz, needed_hz } => write!(
                f,
                "at {rate_hz} Hz the motion turns half a turn or more from sample to sample\n  help: --rate-hz above {needed_hz:.1}, several times that for a good attitude"
            ),
            SamplingError::StampOverflow { start } => write!(
                f,
                "the stamps, from {} ns on, run over the end of 64-bit nanoseconds\n  help: an earlier --start-stamp",
                start.0
            ),
        }
    }
}

impl std::error::Error for SamplingError {}

/// What truly was at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// When.
    pub stamp: Nanos,
    /// Attitude and body rate; the quaternion's sign is continuous with the one before.
    pub spin: Spin,
}

/// A stretch of samples and truth.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    /// Every instant.
    pub truth: Vec<Truth>,
    /// What the sensor put out. `orientation` holds the true one at the sample's instant, `log` that
    /// instant.
    pub samples: Vec<RawSample>,
}

/// What was noticed on the way.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Noticed {
    /// Instants so far.
    pub instants: u64,
    /// Samples put out.
    pub samples: u64,
    /// Steps of half a turn or more.
    pub undersampled: u64,
    /// Largest body rate, rad/s.
    pub fastest: f64,
}

/// A motion being sampled.
#[derive(Clone, Debug)]
pub struct Synthetic {
    motion: Motion,
    sampling: Sampling,
    /// Instants in all.
    count: u64,
    /// The next one.
    next: u64,
    /// Nanoseconds since the start of the one before.
    before: u64,
    last_q_nb: Quaternion<Nav, Body>,
    noticed: Noticed,
}

impl Synthetic {
    /// Ready for the first sample.
    ///
    /// # Errors
    /// [`SamplingError`].
    pub fn new(mut motion: Motion, sampling: Sampling) -> Result<Self, SamplingError> {
        let Sampling {
            rate_hz,
            duration_secs,
            gravity,
            start,
            ..
        } = sampling;
        let within = |what, value: f64, ok: bool, allowed| {
            if ok {
                Ok(())
            } else {
                Err(SamplingError::OutOfRange {
                    what,
                    value,
                    allowed,
                })
            }
        };
        within(
            "the sample rate (Hz)",
            rate_hz,
            rate_hz > 0.0 && rate_hz <= FASTEST_HZ,
            "above 0, at most 1e6",
        )?;
        within(
            "the duration (s)",
            duration_secs,
            (0.0..=LONGEST_SECS).contains(&duration_secs),
            "0 to 1e9",
        )?;
        within(
            "gravity (m/s^2)",
            gravity,
            gravity.abs() <= 1e6,
            "at most 1e6",
        )?;
        let spin = motion.at_nanos(0);
        let needed_hz = spin.w_nb_b.norm() / std::f64::consts::PI;
        if needed_hz >= rate_hz {
            return Err(SamplingError::UnderSampled { rate_hz, needed_hz });
        }
        // A product that falls short of a whole number by rounding alone still reaches it.
        let intervals = (duration_secs * rate_hz * (1.0 + 4.0 * f64::EPSILON)).floor() as u64;
        let synthetic = Synthetic {
            motion,
            count: intervals + 1,
            next: 0,
            before: 0,
            last_q_nb: spin.q_nb,
            noticed: Noticed::default(),
            sampling,
        };
        let end = i64::try_from(synthetic.nanos(intervals)).ok();
        if end.and_then(|end| start.0.checked_add(end)).is_none() {
            return Err(SamplingError::StampOverflow { start });
        }
        Ok(synthetic)
    }

    /// How many instants there are, past ones included.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// What was noticed so far.
    #[must_use]
    pub fn noticed(&self) -> Noticed {
        self.noticed
    }

    /// Nanoseconds from the start to instant `k`.
    fn nanos(&self, k: u64) -> u64 {
        (k as f64 * 1e9 / self.sampling.rate_hz).round() as u64
    }

    /// Replaces what is in `out` by the next `most` instants at most; says how many there were.
    pub fn next_stretch(&mut self, most: usize, out: &mut Stretch) -> usize {
        out.truth.clear();
        out.samples.clear();
        let n = usize::try_from(self.count - self.next).map_or(most, |left| left.min(most));
        for _ in 0..n {
            self.one(out);
        }
        n
    }

    fn one(&mut self, out: &mut Stretch) {
        let now = self.nanos(self.next);
        let mut spin = self.motion.at_nanos(now);
        spin.q_nb = spin.q_nb.same_sign_as(&self.last_q_nb);
        self.last_q_nb = spin.q_nb;
        let at = Nanos(self.sampling.start.0 + now as i64);
        out.truth.push(Truth { stamp: at, spin });
        let rate = spin.w_nb_b.norm();
        self.noticed.fastest = self.noticed.fastest.max(rate);
        self.noticed.undersampled +=
            u64::from(rate >= std::f64::consts::PI * self.sampling.rate_hz);
        self.noticed.instants += 1;

        let interval = now - self.before;
        let value = match self.sampling.kind {
            SampleKind::Rate => Some(spin.w_nb_b),
            SampleKind::Average | SampleKind::DeltaAngle if self.next == 0 => None,
            SampleKind::Average => {
                let secs = interval as f64 / 1e9;
                Some(self.motion.delta_angle(self.before, now) / secs)
            }
            SampleKind::DeltaAngle => Some(self.motion.delta_angle(self.before, now)),
        };
        if let Some(value) = value {
            let held_n = In::<Nav>::assume(
                self.motion.acceleration_n(now) + Vector3::new(0.0, 0.0, self.sampling.gravity),
            );
            let force_b = spin.q_nb.inverse() * held_n;
            out.samples.push(RawSample {
                header: Some(at),
                log: at,
                publish: at,
                gyro: Some(value.into()),
                accel: Some((*force_b.as_vector()).into()),
                orientation: Some(spin.q_nb.wxyz()),
                interval_nanos: (self.sampling.kind != SampleKind::Rate).then_some(interval as i64),
            });
            self.noticed.samples += 1;
        }
        self.before = now;
        self.next += 1;
    }
}
