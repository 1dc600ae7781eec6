//! A motion with exact truth, and a sensor with known errors -> RawSample, and the truth beside it. Pure.
//!
//! A source like any other: what comes out takes the same way through conditioning and integration as
//! a recording, and is the only source whose answer is known beforehand.
//!
//! # Convention
//! The sensor sits at the origin of the body axes (its accelerometer at the end of a lever arm from
//! there), its axes are theirs (FLU). Navigation z points up, whatever x points at is called east, so the
//! world of the truth is ENU. The specific force is `f_b = C_nb^T (a_n - g_n)` and what the lever arm adds
//! ([`Accelerometer`]): 9.8 m/s^2 upwards at rest. It is that of the instant, or a mean over the interval
//! as the gyro's is ([`ForceSampling`]).
//!
//! Sample k is taken at `round(k 1e9 / rate)` ns after the start (or beside it, with sampling jitter),
//! and the motion is evaluated at that very nanosecond. Rates begin at k = 0; averages and delta
//! angles are over the interval that ends at their stamp, and so begin at k = 1. Truth is given for
//! every k from 0 on, at the instant itself: whatever the stamps say, and whether or not the sample
//! arrives.

use crate::field::Field;
use crate::motion::{Accelerometer, Motion};
use crate::rigid_body::Spin;
use nalgebra::Vector3;
use std::fmt;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::frames::{Body, In, Nav};
use strapd_attitude::noise::sensor_error::{
    self, GyroModel, ImuError, ImuErrorFault, MagnetometerModel, MeasureError, StampError,
    StampModel,
};
use strapd_attitude::quaternion::{Quaternion, RotationVector};
use strapd_attitude::record::{Nanos, RawSample, SampleKind};
use strapd_attitude::setting::{RATE_HZ, START_STAMP};

/// Meaning of a reading of the accelerometer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum ForceSampling {
    /// The specific force at the instant, whatever the gyro's sample is.
    #[default]
    Instant,
    /// Same as the gyro: of the instant for a rate; else the mean over the interval, m/s^2.
    AsGyro,
}

/// A magnetometer beside the gyro.
#[derive(Clone, PartialEq, Debug)]
pub struct Magnetometer {
    /// Readings a second: each goes with the first sample that is due by then.
    pub rate_hz: f64,
    /// Field around the sensor.
    pub field: Field,
}

/// Settings by which a motion is sampled.
#[derive(Clone, Debug)]
pub struct Sampling {
    /// Samples a second.
    pub rate_hz: f64,
    /// Seconds from the first instant to the last.
    pub duration_secs: f64,
    /// Meaning of a sample.
    pub kind: SampleKind,
    /// Stamp of the first instant.
    pub start: Nanos,
    /// Gravity, m/s^2, downwards.
    pub gravity: f64,
    /// Position of the accelerometer: from the origin of the body axes, m, body axes.
    pub lever_b: Vector3<f64>,
    /// Meaning of its readings.
    pub force: ForceSampling,
    /// A magnetometer, where there is one; its axes are the body's.
    pub magnetometer: Option<Magnetometer>,
    /// The sensor's errors. Without any, samples are the motion's own numbers.
    pub error: ImuError,
    /// Errors of sampling instants and stamps, and losses.
    pub stamps: StampError,
    /// Seed of everything random.
    pub seed: u64,
}

/// Fastest sampling: a nanosecond is then a thousandth of the interval.
const FASTEST_HZ: f64 = 1e6;
/// Longest run, s: 31 years.
const LONGEST_SECS: f64 = 1e9;

/// A sampling that cannot be.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum SamplingError {
    /// A number out of its range.
    OutOfRange {
        /// Name of the parameter, with its unit.
        what: &'static str,
        /// Value as given.
        value: f64,
        /// Range that is allowed.
        allowed: &'static str,
    },
    /// The motion turns half a turn or more from sample to sample at its start.
    UnderSampled {
        /// Rate as given, Hz.
        rate_hz: f64,
        /// The rate that must be exceeded, Hz.
        needed_hz: f64,
    },
    /// Errors no sensor can have.
    Errors(ImuErrorFault),
    /// Stamps would run over the end of 64-bit nanoseconds.
    StampOverflow {
        /// The first one.
        start: Nanos,
    },
}

impl From<&SamplingError> for Diagnostic {
    fn from(error: &SamplingError) -> Diagnostic {
        match error {
            SamplingError::OutOfRange {
                what,
                value,
                allowed,
            } => Diagnostic::new(format!("{what} cannot be {value}: {allowed}")),
            SamplingError::UnderSampled { rate_hz, needed_hz } => Diagnostic::new(format!(
                "at {rate_hz} Hz the motion turns half a turn or more from sample to sample"
            ))
            .help(format!(
                "{RATE_HZ} above {needed_hz:.1}, several times that for a good attitude"
            )),
            SamplingError::Errors(fault) => fault.into(),
            SamplingError::StampOverflow { start } => Diagnostic::new(format!(
                "the stamps, from {} ns on, run over the end of 64-bit nanoseconds",
                start.0
            ))
            .help(format!("an earlier {START_STAMP}")),
        }
    }
}

impl fmt::Display for SamplingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for SamplingError {}

impl From<ImuErrorFault> for SamplingError {
    fn from(fault: ImuErrorFault) -> Self {
        SamplingError::Errors(fault)
    }
}

/// Truth at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// Stamp.
    pub stamp: Nanos,
    /// Attitude and body rate; the quaternion's sign is continuous with the one before.
    pub spin: Spin,
}

/// A stretch of samples and truth.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    /// Every instant.
    pub truth: Vec<Truth>,
    /// Samples that the sensor put out and that were not lost. `orientation` holds the true one at the sample's
    /// instant, `log` that instant.
    pub samples: Vec<RawSample>,
}

/// Observations made on the way.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct GenerationCounts {
    /// Instants so far.
    pub instants: u64,
    /// Samples put out.
    pub samples: u64,
    /// Samples lost on purpose.
    pub dropped: u64,
    /// Samples with an axis at the end of the sensor's range.
    pub saturated: u64,
    /// Samples with a specific force at the end of the accelerometer's range.
    pub force_saturated: u64,
    /// Readings of the magnetometer put out.
    pub fields: u64,
    /// Steps of half a turn or more.
    pub undersampled: u64,
    /// Largest body rate, rad/s.
    pub fastest: f64,
}

/// Reading of the sensor at an instant: rate or delta angle, and specific force.
struct Reading {
    gyro: Vector3<f64>,
    force_b: Vector3<f64>,
}

/// A magnetometer being read.
#[derive(Clone, Debug)]
struct Compass {
    stated: Magnetometer,
    sensor: MagnetometerModel,
}

/// The specific force at the end of an interval, and as the accelerometer takes it, m/s^2.
struct Forces {
    at_end: Vector3<f64>,
    sampled: Vector3<f64>,
}

/// A motion being sampled.
#[derive(Clone, Debug)]
pub struct Synthetic {
    motion: Motion,
    sampling: Sampling,
    ticks: StampModel,
    /// `None` without errors.
    sensor: Option<GyroModel>,
    compass: Option<Compass>,
    /// Instants in all.
    count: u64,
    /// The next one.
    next: u64,
    /// Nanoseconds since the start of the one before.
    before: u64,
    last_q_nb: Quaternion<Nav, Body>,
    noticed: GenerationCounts,
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
            error,
            stamps,
            seed,
            kind,
            lever_b,
            force: _,
            ref magnetometer,
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
        within(
            "the lever arm (m)",
            lever_b.norm(),
            lever_b.norm() <= 1e3,
            "at most 1000",
        )?;
        let compass = match magnetometer {
            None => None,
            Some(stated) => {
                within(
                    "the rate of the magnetometer (Hz)",
                    stated.rate_hz,
                    stated.rate_hz > 0.0 && stated.rate_hz <= rate_hz,
                    "above 0, at most that of the samples",
                )?;
                Some(Compass {
                    stated: stated.clone(),
                    sensor: MagnetometerModel::new(&error, seed)?,
                })
            }
        };
        let spin = motion.at_nanos(0);
        let needed_hz = spin.w_nb_b.norm() / std::f64::consts::PI;
        if needed_hz >= rate_hz {
            return Err(SamplingError::UnderSampled { rate_hz, needed_hz });
        }
        let sensor = (error != ImuError::default())
            .then(|| GyroModel::new(&error, kind, seed))
            .transpose()?;
        // A product that falls short of a whole number by rounding alone still reaches it.
        let intervals = (duration_secs * rate_hz * (1.0 + 4.0 * f64::EPSILON)).floor() as u64;
        let end = (intervals as f64 * 1e9 / rate_hz).ceil() as i64;
        if start.0.checked_add(end).is_none() {
            return Err(SamplingError::StampOverflow { start });
        }
        Ok(Synthetic {
            motion,
            ticks: StampModel::new(&stamps, start, rate_hz, seed)?,
            sensor,
            compass,
            count: intervals + 1,
            next: 0,
            before: 0,
            last_q_nb: spin.q_nb,
            noticed: GenerationCounts::default(),
            sampling,
        })
    }

    /// Constant errors drawn for this unit of the sensor, when it has errors.
    #[must_use]
    pub fn sensor(&self) -> Option<&GyroModel> {
        self.sensor.as_ref()
    }

    /// The magnetometer, where there is one.
    #[must_use]
    pub fn magnetometer(&self) -> Option<&MagnetometerModel> {
        self.compass.as_ref().map(|c| &c.sensor)
    }

    /// Number of instants, past ones included.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Observations so far.
    #[must_use]
    pub fn noticed(&self) -> GenerationCounts {
        self.noticed
    }

    /// Replaces what is in `out` by the next `most` instants at most; says how many there were.
    ///
    /// # Errors
    /// The motion is not finite at some instant.
    pub fn next_stretch(&mut self, most: usize, out: &mut Stretch) -> Result<usize, MeasureError> {
        out.truth.clear();
        out.samples.clear();
        let n = usize::try_from(self.count - self.next).map_or(most, |left| left.min(most));
        for _ in 0..n {
            self.one(out)?;
        }
        Ok(n)
    }

    fn one(&mut self, out: &mut Stretch) -> Result<(), MeasureError> {
        let tick = self.ticks.tick();
        // Jitter may not take the first sample to before the motion began.
        let late = self.sampling.start.since(tick.instant).max(0);
        let now = (tick.instant.since(self.sampling.start) + late) as u64;
        let accelerometer = Accelerometer {
            lever_b: self.sampling.lever_b,
            gravity: self.sampling.gravity,
        };
        let mut felt = accelerometer.felt(&mut self.motion, now);
        felt.spin.q_nb = felt.spin.q_nb.same_sign_as(&self.last_q_nb);
        let spin = felt.spin;
        let turned = self.last_q_nb.inverse() * spin.q_nb;
        self.last_q_nb = spin.q_nb;
        let at = Nanos(self.sampling.start.0 + now as i64);
        out.truth.push(Truth { stamp: at, spin });
        let rate = spin.w_nb_b.norm();
        self.noticed.fastest = self.noticed.fastest.max(rate);
        self.noticed.undersampled +=
            u64::from(rate >= std::f64::consts::PI * self.sampling.rate_hz);
        self.noticed.instants += 1;

        let force_b = accelerometer.read(&felt);
        let rates = self.sampling.kind == SampleKind::Rate;
        let averaged = self.sampling.force == ForceSampling::AsGyro && !rates && self.next > 0;
        let mean_b = averaged.then(|| accelerometer.mean(&mut self.motion, self.before, now));
        let forces = Forces {
            at_end: force_b,
            sampled: mean_b.unwrap_or(force_b),
        };
        let mag = self.field(now, &spin);
        if let Some(read) = self.measured(at, now, &spin, &turned.rotation_vector(), &forces)? {
            if tick.dropped {
                self.noticed.dropped += 1;
            } else {
                out.samples.push(RawSample {
                    header: Some(Nanos(tick.stamp.0.saturating_add(late))),
                    log: at,
                    publish: at,
                    gyro: Some(read.gyro.into()),
                    accel: Some(read.force_b.into()),
                    mag: mag.map(Into::into),
                    orientation: Some(spin.q_nb.wxyz()),
                    orientation_resets: None,
                    interval_nanos: (!rates).then_some((now - self.before) as i64),
                    temperature: None,
                    is_beside: false,
                });
                self.noticed.samples += 1;
                self.noticed.fields += u64::from(mag.is_some());
            }
        }
        self.before = now;
        self.next += 1;
        Ok(())
    }

    /// Reading of the magnetometer at `now`, when it is due.
    fn field(&mut self, now: u64, spin: &Spin) -> Option<Vector3<f64>> {
        let compass = self.compass.as_mut()?;
        let ratio = compass.stated.rate_hz / self.sampling.rate_hz;
        let readings = |instants: u64| (instants as f64 * ratio).floor();
        if self.next > 0 && readings(self.next) == readings(self.next - 1) {
            return None;
        }
        let field_n = In::<Nav>::assume(compass.stated.field.at(now as f64 * 1e-9));
        let field_b = *(spin.q_nb.inverse() * field_n).as_vector();
        Some(compass.sensor.measure(&field_b))
    }

    /// Reading of the sensor at `now`, `turned` since the instant before. `None` for the
    /// interval before the start.
    fn measured(
        &mut self,
        at: Nanos,
        now: u64,
        spin: &Spin,
        turned: &RotationVector,
        forces: &Forces,
    ) -> Result<Option<Reading>, MeasureError> {
        let rates = self.sampling.kind == SampleKind::Rate;
        let first = self.next == 0;
        if first && !rates {
            return Ok(None);
        }
        if self.sensor.is_none() && rates {
            return Ok(Some(Reading {
                gyro: spin.w_nb_b,
                force_b: forces.sampled,
            }));
        }
        // A rate at the start has no interval before it: as if the body had come at this rate.
        let nanos = if first {
            (1e9 / self.sampling.rate_hz).round().max(1.0) as u64
        } else {
            now - self.before
        };
        let secs = nanos as f64 / 1e9;
        let delta_angle = if first {
            spin.w_nb_b * secs
        } else {
            self.motion.delta_angle(self.before, now)
        };
        // What the axis did meanwhile comes after the sensor: its arithmetic adds it to what was read.
        let coning = match self.sampling.kind {
            SampleKind::Rotation => turned.0 - delta_angle,
            _ => Vector3::zeros(),
        };
        let Some(sensor) = &mut self.sensor else {
            let gyro = match self.sampling.kind {
                SampleKind::DeltaAngle => delta_angle,
                SampleKind::Rotation => turned.0,
                SampleKind::Average | SampleKind::Rate => delta_angle / secs,
            };
            return Ok(Some(Reading {
                gyro,
                force_b: forces.sampled,
            }));
        };
        let truth = sensor_error::Truth {
            rate: spin.w_nb_b,
            delta_angle,
            specific_force: forces.at_end,
            sampled_force: forces.sampled,
            temperature: 0.0,
        };
        let from = Nanos(at.0.saturating_sub(nanos as i64));
        let read = sensor.measure(from, at, &truth)?;
        self.noticed.saturated += u64::from(read.saturated);
        self.noticed.force_saturated += u64::from(read.force_saturated);
        Ok(Some(Reading {
            gyro: read.gyro + coning,
            force_b: read.specific_force,
        }))
    }
}
