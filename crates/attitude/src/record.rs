//! Records that cross the borders between stages. Pure.
//!
//! ```text
//! source -> bytes -> decode -> RawSample -> condition -> RateSample -> propagate -> AttitudeSample -> sink
//! ```
//!
//! Bad data never becomes an `Err`: it becomes a [`Verdict`], is counted in
//! [`Counts`], and the run goes on.

mod covariance;
mod declared;
mod linear_acceleration;

pub use covariance::AttitudeCovariance;
pub use declared::{AccelUnit, Declared, GyroUnit, TimeUnit};
pub use linear_acceleration::LinearAcceleration;

use crate::frames::{Body, In, Nav};
use crate::quaternion::{BodyRate, DeltaAngle, Quaternion};
use nalgebra::Vector3;

/// An instant: integer nanoseconds since the epoch of the clock it was read from.
///
/// One `f64` step at today's Unix epoch in seconds is 2.4e-7 s, so stamps stay
/// integers until two of them have been subtracted.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Nanos(pub i64);

impl Nanos {
    /// Nanoseconds from `earlier` to `self`, saturating at the ends of `i64`.
    #[must_use]
    pub fn since(self, earlier: Nanos) -> i64 {
        self.0.saturating_sub(earlier.0)
    }

    /// Seconds from `earlier` to `self`; the difference is taken in integers first.
    #[must_use]
    pub fn secs_since(self, earlier: Nanos) -> f64 {
        self.since(earlier) as f64 * 1e-9
    }

    /// Makes it from the seconds and nanoseconds of a ROS stamp; `nanosec >= 1e9` carries over.
    #[must_use]
    pub fn from_sec_nanosec(sec: i64, nanosec: u32) -> Nanos {
        Nanos(
            sec.saturating_mul(1_000_000_000)
                .saturating_add(i64::from(nanosec)),
        )
    }

    /// Whole seconds (towards minus infinity) and the nanoseconds above them.
    #[must_use]
    pub fn to_sec_nanosec(self) -> (i64, u32) {
        (
            self.0.div_euclid(1_000_000_000),
            self.0.rem_euclid(1_000_000_000) as u32,
        )
    }
}

/// Meaning of a gyro sample in time. It matters more than the order of the integrator
/// (`docs/accuracy.md`), so it is explicit everywhere.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum SampleKind {
    /// Instantaneous rate at the stamp, rad/s.
    #[default]
    Rate,
    /// Mean rate over the interval that ends at the stamp, rad/s.
    Average,
    /// Integral of the rate over the interval that ends at the stamp, rad.
    DeltaAngle,
    /// Rotation vector of the whole turn in the interval that ends at the stamp, rad: what the axis did meanwhile
    /// (coning) is in it, so that turns are multiplied and nothing is added to them.
    Rotation,
}

impl SampleKind {
    /// The name used by `--sample-kind` and in every summary.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            SampleKind::Rate => "rate",
            SampleKind::Average => "average",
            SampleKind::DeltaAngle => "delta-angle",
            SampleKind::Rotation => "rotation",
        }
    }

    /// All of them.
    pub const ALL: [SampleKind; 4] = [
        SampleKind::Rate,
        SampleKind::Average,
        SampleKind::DeltaAngle,
        SampleKind::Rotation,
    ];

    /// The kind of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<SampleKind> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// One sample as it was recorded: source units, source axes, every clock it carried.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct RawSample {
    /// The stamp inside the message. `None` when the message has no such field;
    /// a field that holds zero is `Some(Nanos(0))`.
    pub header: Option<Nanos>,
    /// Time at which the recorder received it.
    pub log: Nanos,
    /// Time at which the publisher sent it.
    pub publish: Nanos,
    /// Rate (or delta angle, see [`SampleKind`]) about the sensor's axes, in the source's unit.
    /// `None` when the message marks it as absent or has none.
    pub gyro: Option<[f64; 3]>,
    /// Specific force along the sensor's axes, m/s^2 (or the source's unit).
    pub accel: Option<[f64; 3]>,
    /// Magnetic field along the magnetometer's axes, any linear unit.
    pub mag: Option<[f64; 3]>,
    /// Recorded orientation `[w, x, y, z]`, sensor to world, as found: not checked, not normalised.
    pub orientation: Option<[f64; 4]>,
    /// Count of the resets of the orientation by its source so far, modulo 256 (PX4 `quat_reset_counter`).
    pub orientation_resets: Option<u8>,
    /// The message's own integration interval in nanoseconds (PX4 `gyro_integral_dt`, `delta_angle_dt`).
    pub interval_nanos: Option<i64>,
    /// Temperature of the sensor, degrees Celsius, as its source states it: nothing is estimated by it.
    pub temperature: Option<f32>,
    /// Whether it is of another sensor of the body than the gyro, with a stamp and a rate of its own: it corrects
    /// attitudes, and is no sample that lacks its rate.
    pub is_beside: bool,
}

/// Connection of a sample to the one before it in the same stream.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Join {
    /// First sample of the stream.
    Start,
    /// The ordinary next sample.
    #[default]
    Continuous,
    /// Samples are missing, but few enough: integrate across, flagged.
    Bridge,
    /// Gap or clock jump beyond the limit: no rotation is added, integration restarts here
    /// from the attitude held.
    Hold,
    /// Gap or clock jump beyond the limit: attitude returns to the initial one.
    Reset,
}

/// Measurement of the gyro in one sample, in body axes: a rate, or the angle turned in an interval.
///
/// # Convention
/// [`SampleKind::Rate`] gives the first, all others the second: conditioning has multiplied means by their intervals. A
/// [`SampleKind::Rotation`] is one that is integrated by itself alone, since nothing is to be added to it.
///
/// To take an angle for a rate, or a rate for an angle, does not compile:
/// ```compile_fail,E0308
/// use strapd_attitude::quaternion::DeltaAngle;
/// use strapd_attitude::record::Measured;
/// let measured = Measured::Rate(DeltaAngle(nalgebra::Vector3::x()));
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Measured {
    /// The rate at the sample's instant.
    Rate(BodyRate),
    /// Integral over the sample's interval, from [`RateSample::start`] to [`RateSample::stamp`].
    Increment(DeltaAngle),
}

impl Measured {
    /// Numbers in rad/s for [`SampleKind::Rate`], in rad for the others; somebody says that they are that.
    #[must_use]
    #[inline]
    pub fn assume(kind: SampleKind, vector: Vector3<f64>) -> Measured {
        match kind {
            SampleKind::Rate => Measured::Rate(BodyRate(vector)),
            SampleKind::Average | SampleKind::DeltaAngle | SampleKind::Rotation => {
                Measured::Increment(DeltaAngle(vector))
            }
        }
    }

    /// The bare numbers, rad/s or rad, for kernels.
    #[must_use]
    #[inline]
    pub fn as_vector(&self) -> &Vector3<f64> {
        match self {
            Measured::Rate(BodyRate(vector)) | Measured::Increment(DeltaAngle(vector)) => vector,
        }
    }

    /// Other numbers of the same kind.
    #[must_use]
    #[inline]
    pub fn with(self, vector: Vector3<f64>) -> Measured {
        match self {
            Measured::Rate(_) => Measured::Rate(BodyRate(vector)),
            Measured::Increment(_) => Measured::Increment(DeltaAngle(vector)),
        }
    }
}

/// One conditioned sample: SI, body axes, bias removed, finite, stamps strictly increasing
/// within a stream except across [`Join::Hold`] and [`Join::Reset`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RateSample {
    /// Instant of the rate, or end of the interval.
    pub stamp: Nanos,
    /// Start of the interval; equals `stamp` for [`SampleKind::Rate`]. When it is later than the previous sample's
    /// stamp, something between was not recorded.
    pub start: Nanos,
    /// The rate at `stamp`, or what was turned from `start` to `stamp`.
    pub gyro: Measured,
    /// Specific force, m/s^2.
    pub accel: Option<In<Body>>,
    /// Connection to its predecessor.
    pub join: Join,
    /// Observations about it.
    pub status: Status,
    /// Time at which the recorder received it; outputs are logged at the same instant.
    pub log: Nanos,
}

impl RateSample {
    /// Time that [`RateSample::gyro`] is divided by to be a rate: the sample's own interval, s; 1 of a rate.
    pub(crate) fn own_secs(&self) -> f64 {
        match self.gyro {
            Measured::Rate(_) => 1.0,
            Measured::Increment(_) => self.stamp.secs_since(self.start),
        }
    }

    /// The rate at its instant, or its mean over the sample's interval; nothing of an interval without length.
    pub(crate) fn mean_rate(&self) -> BodyRate {
        BodyRate(match (self.gyro, self.own_secs()) {
            (Measured::Rate(BodyRate(rate)), _) => rate,
            (Measured::Increment(DeltaAngle(angle)), own) if own > 0.0 => angle / own,
            (Measured::Increment(_), _) => Vector3::zeros(),
        })
    }
}

/// Bits that travel with a sample to the output's `status`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Status(pub u16);

impl Status {
    /// Nothing to say.
    pub const OK: Status = Status(0);
    /// The interval before this sample was bridged over missing samples.
    pub const BRIDGED: Status = Status(1);
    /// The attitude was held over a gap or jump before this sample.
    pub const HELD: Status = Status(1 << 1);
    /// The attitude was reset at this sample.
    pub const RESET: Status = Status(1 << 2);
    /// One or more bad samples were rejected just before this one.
    pub const REJECTED_BEFORE: Status = Status(1 << 3);
    /// The sample came out of order and was put back in place.
    pub const REORDERED: Status = Status(1 << 4);
    /// A component is at or beyond the stated gyro range.
    pub const SATURATED: Status = Status(1 << 5);
    /// More than half a turn in one step: under-sampled.
    pub const UNDERSAMPLED: Status = Status(1 << 6);
    /// Provisional output of streaming, to be followed by a final one.
    pub const PROVISIONAL: Status = Status(1 << 7);

    /// The sample shared its recorded stamp with another and was given one of its own.
    pub const RESTAMPED: Status = Status(1 << 8);
    /// The first after a restart: the attitude is the one that was saved, held since.
    pub const RESTARTED: Status = Status(1 << 9);
    /// Sent to a watcher that came after it: no news, but the last there was.
    pub const LAST: Status = Status(1 << 10);
    /// Gravity (and a field) corrects the attitude.
    pub const AIDED: Status = Status(1 << 11);
    /// The body has been at rest for long enough to say so.
    pub const REST: Status = Status(1 << 12);
    /// The tilt was too wrong to be corrected, and was set anew at this sample.
    pub const LEVELLED: Status = Status(1 << 13);
    /// A spike of the gyro stood here: the rate is the line between its neighbours. Live, it stood in the attitudes just
    /// before this one, which is the first without it.
    pub const REPAIRED: Status = Status(1 << 14);

    /// Both sets of bits.
    #[must_use]
    pub fn with(self, other: Status) -> Status {
        Status(self.0 | other.0)
    }

    /// Whether any bit of `other` is set.
    #[must_use]
    pub fn has(self, other: Status) -> bool {
        self.0 & other.0 != 0
    }

    /// The names of the bits that are set, in a fixed order; empty means `ok`.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        const NAMES: [(Status, &str); 15] = [
            (Status::BRIDGED, "bridged"),
            (Status::HELD, "held"),
            (Status::RESET, "reset"),
            (Status::REJECTED_BEFORE, "rejected-before"),
            (Status::REORDERED, "reordered"),
            (Status::SATURATED, "saturated"),
            (Status::UNDERSAMPLED, "undersampled"),
            (Status::PROVISIONAL, "provisional"),
            (Status::RESTAMPED, "restamped"),
            (Status::RESTARTED, "restarted"),
            (Status::LAST, "last"),
            (Status::AIDED, "aided"),
            (Status::REST, "rest"),
            (Status::LEVELLED, "levelled"),
            (Status::REPAIRED, "repaired"),
        ];
        NAMES
            .into_iter()
            .filter(move |(bit, _)| self.has(*bit))
            .map(|(_, name)| name)
    }
}

/// One output: attitude at an instant, with what is known about it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AttitudeSample {
    /// The instant the attitude holds for.
    pub stamp: Nanos,
    /// Body to navigation ("world"), Hamilton, unit norm to 1e-15, sign continuous with the
    /// sample before.
    pub q_nb: Quaternion<Nav, Body>,
    /// Bias-corrected body rate: the sample itself, or the increment divided by its interval.
    /// What a gyro measures: relative to inertial space (w_ib), Earth's rotation included, also where
    /// `q_nb` is relative to a world that turns with it.
    pub rate: BodyRate,
    /// Specific force, m/s^2, copied through.
    pub accel: Option<In<Body>>,
    /// Acceleration without gravity, where it is asked for and a specific force goes with the sample.
    pub linear_acceleration: Option<LinearAcceleration>,
    /// Covariance of its error, rad^2, body axes: see [`AttitudeCovariance::sigma`] for three numbers.
    pub covariance: AttitudeCovariance,
    /// Observations about it.
    pub status: Status,
    /// Number of times the attitude has been reset or held so far; a reader that sees it change must not
    /// difference across.
    pub reset_count: u32,
    /// Time at which the recorder received the sample this belongs to.
    pub log: Nanos,
    /// Temperature of the sensor, degrees Celsius: the one received last by then.
    pub temperature: Option<f32>,
}

/// Outcome of one sample. Exactly one verdict per sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Verdict {
    /// Integrated.
    Accepted,
    /// Integrated, after being put back in time order.
    Reordered,
    /// The payload could not be decoded.
    Undecodable,
    /// The message marks its gyro as absent (covariance -1), or has none.
    NoGyro,
    /// NaN or infinity in the gyro.
    NotFinite,
    /// A finite rate no gyro can have (above 1e4 rad/s, or a delta angle above 1e3 rad).
    Huge,
    /// Same stamp and same data as its predecessor.
    Repeated,
    /// Same stamp as another, other data, and no longer step beside it to put it into.
    DuplicateStamp,
    /// Older than what was already integrated, beyond the reorder window.
    Late,
    /// Absent stamp, or one of zero while others' are not.
    NoStamp,
    /// Outside `--start`, `--until`.
    Trimmed,
    /// Integrated at a stamp of its own inside a longer step beside it, because it shared its
    /// recorded stamp with another sample.
    Restamped,
    /// Stamp that leaps far ahead, while its successors carry on from its predecessors.
    StrayStamp,
    /// Stamp more than 146 years from the epoch.
    FarStamp,
}

impl Verdict {
    /// Every verdict, in the order of [`Counts`].
    pub const ALL: [Verdict; 14] = [
        Verdict::Accepted,
        Verdict::Reordered,
        Verdict::Undecodable,
        Verdict::NoGyro,
        Verdict::NotFinite,
        Verdict::Huge,
        Verdict::Repeated,
        Verdict::DuplicateStamp,
        Verdict::Late,
        Verdict::NoStamp,
        Verdict::Trimmed,
        Verdict::Restamped,
        Verdict::StrayStamp,
        Verdict::FarStamp,
    ];

    /// The name in summaries and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Accepted => "accepted",
            Verdict::Reordered => "reordered",
            Verdict::Undecodable => "undecodable",
            Verdict::NoGyro => "no_gyro",
            Verdict::NotFinite => "not_finite",
            Verdict::Huge => "huge",
            Verdict::Repeated => "repeated",
            Verdict::DuplicateStamp => "duplicate_stamp",
            Verdict::Late => "late",
            Verdict::NoStamp => "no_stamp",
            Verdict::Trimmed => "trimmed",
            Verdict::Restamped => "restamped",
            Verdict::StrayStamp => "stray_stamp",
            Verdict::FarStamp => "far_stamp",
        }
    }

    /// Whether a sample with this verdict was integrated.
    #[must_use]
    pub fn is_used(self) -> bool {
        matches!(
            self,
            Verdict::Accepted | Verdict::Reordered | Verdict::Restamped
        )
    }

    /// Whether a sample with this verdict is data that was lost (exit code 3): everything that was
    /// not used, but for exact repeats and what the user asked to leave out.
    #[must_use]
    pub fn is_loss(self) -> bool {
        !self.is_used() && !matches!(self, Verdict::Repeated | Verdict::Trimmed)
    }
}

/// Number of samples by verdict.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts([u64; Verdict::ALL.len()]);

impl Counts {
    /// One more.
    pub fn add(&mut self, verdict: Verdict) {
        self.add_many(verdict, 1);
    }

    /// `n` more.
    pub fn add_many(&mut self, verdict: Verdict, n: u64) {
        if let Some(count) = self.0.get_mut(verdict as usize) {
            *count += n;
        }
    }

    /// Number of samples with a verdict so far.
    #[must_use]
    pub fn get(&self, verdict: Verdict) -> u64 {
        self.0.get(verdict as usize).copied().unwrap_or(0)
    }

    /// All samples seen.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Samples integrated.
    #[must_use]
    pub fn used(&self) -> u64 {
        self.sum(Verdict::is_used)
    }

    /// Samples lost.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.sum(Verdict::is_loss)
    }

    fn sum(&self, keep: fn(Verdict) -> bool) -> u64 {
        Verdict::ALL
            .iter()
            .filter(|v| keep(**v))
            .map(|v| self.get(*v))
            .sum()
    }
}
