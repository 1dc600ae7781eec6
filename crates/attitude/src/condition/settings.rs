//! What the user says about the gyro. Pure.
//!
//! A stage of its own so that everything outside can be wrong about a sensor is checked once,
//! before the first sample, and the hot path needs no checks.

use super::clock::Clock;
use crate::record::{GyroUnit, SampleKind};
use crate::setting::{
    BIAS, BODY, CALIBRATION, GYRO_RANGE, MAX_GAP, MOUNT, RATE_HZ, START, UNDO_TRUNCATION, UNTIL,
};
use nalgebra::{Matrix3, Vector3};

/// What happens at a gap longer than [`Settings::max_gap_secs`], and at a clock that jumped back.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum OnGap {
    /// Keep the attitude, add no rotation.
    #[default]
    Hold,
    /// Integrate across whatever the length. A clock that jumped back leaves no length to
    /// integrate over, so there it is held all the same.
    Bridge,
    /// Return to the initial attitude.
    Reset,
}

impl OnGap {
    /// The name used by `--on-gap`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            OnGap::Hold => "hold",
            OnGap::Bridge => "bridge",
            OnGap::Reset => "reset",
        }
    }
}

/// How a stream is conditioned.
///
/// # Convention
/// A raw vector v_s in the sensor's own axes and unit becomes `w_b = mount * axes * gyro_matrix * unit * v_s - bias`, an
/// acceleration `mount * axes * (accel_matrix * accel_scale * a_s - accel_bias)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What a sample means in time.
    pub kind: SampleKind,
    /// Unit of the recorded rates.
    pub unit: GyroUnit,
    /// Multiply the recorded acceleration by this to get m/s^2.
    pub accel_scale: f64,
    /// Corrects scale and axes of the gyro, sensor axes.
    pub gyro_matrix: Matrix3<f64>,
    /// The same for the accelerometer.
    pub accel_matrix: Matrix3<f64>,
    /// What is left of its bias after that, m/s^2, sensor axes.
    pub accel_bias: Vector3<f64>,
    /// Body axes from source axes: a signed permutation. Determinant -1 is allowed: recordings
    /// with columns in z,y,x order exist, and naming the columns right is not a reflection.
    pub axes: Matrix3<f64>,
    /// Sensor-to-body rotation C_bs, applied after `axes`.
    pub mount: Matrix3<f64>,
    /// Which stamp counts. See [`super::choose_clock`].
    pub clock: Clock,
    /// Longest gap integrated across, seconds.
    pub max_gap_secs: f64,
    /// What to do beyond it.
    pub on_gap: OnGap,
    /// Step in rad/s (or rad of a delta angle), sensor axes, to which a driver has cut the rates towards
    /// zero: half of it is put back. See [`truncation`](super::truncation).
    pub truncation_step: Option<f64>,
    /// Gyro bias in rad/s, body axes, subtracted.
    pub bias: Vector3<f64>,
    /// Full scale of the gyro in rad/s, sensor axes: components at or beyond it are flagged.
    pub gyro_range: Option<f64>,
    /// Leave out samples earlier than this, seconds after the first stamp.
    pub start: Option<f64>,
    /// Leave out samples later than this, seconds after the first stamp.
    pub until: Option<f64>,
    /// How many samples are held back so that a late one can be put in its place (and so that the
    /// first samples, colliding stamps and stamps that catch up are judged with their successors
    /// in view). 0 = live: every sample with a new stamp leaves at once, late ones are dropped.
    pub reorder_window: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            kind: SampleKind::Rate,
            unit: GyroUnit::Rad,
            accel_scale: 1.0,
            gyro_matrix: Matrix3::identity(),
            accel_matrix: Matrix3::identity(),
            accel_bias: Vector3::zeros(),
            axes: Matrix3::identity(),
            mount: Matrix3::identity(),
            clock: Clock::Header,
            max_gap_secs: 0.5,
            on_gap: OnGap::Hold,
            truncation_step: None,
            bias: Vector3::zeros(),
            gyro_range: None,
            start: None,
            until: None,
            reorder_window: Settings::REPLAY_WINDOW,
        }
    }
}

/// Longest `max_gap_secs`: a day. Nothing was measured across a longer one.
const MAX_GAP_SECS: f64 = 86_400.0;
/// Largest window: its only cost is latency and memory, but both must stay bounded.
const MAX_WINDOW: usize = 4096;
/// A rotation matrix given by a person to six digits passes; a scaled or sheared one does not.
const ROTATION_TOLERANCE: f64 = 1e-5;

impl Settings {
    /// The reorder window for recordings: latency is free there, and sixteen samples see past a
    /// burst of a dozen stamps.
    pub const REPLAY_WINDOW: usize = 16;
    /// The reorder window for live streams: nothing is held back.
    pub const LIVE_WINDOW: usize = 0;

    /// Checks everything a person can get wrong.
    ///
    /// # Errors
    /// [`SettingsError`] names the setting, the value, and the flag that sets it.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let fail = |text: String| Err(SettingsError(text));
        if !is_signed_permutation(&self.axes) {
            return fail(format!(
                "{BODY}: {:?} is not a signed permutation of the axes",
                rows(&self.axes)
            ));
        }
        let excess = (self.mount * self.mount.transpose() - Matrix3::identity()).amax();
        // `!(a <= b)` and not `a > b`, so that NaN fails too.
        if !(excess <= ROTATION_TOLERANCE && self.mount.determinant() > 0.0) {
            return fail(format!(
                "{MOUNT}: {:?} is not a rotation (C C^T is off the identity by {excess:.1e}, determinant {:.3})",
                rows(&self.mount),
                self.mount.determinant()
            ));
        }
        if let Clock::Index { rate_hz } = self.clock
            && !(rate_hz.is_finite() && (1e-3..=1e9).contains(&rate_hz))
        {
            return fail(format!(
                "{RATE_HZ}: {rate_hz} is not a sample rate (0.001 to 1e9 Hz)"
            ));
        }
        if !(self.max_gap_secs >= 0.0 && self.max_gap_secs <= MAX_GAP_SECS) {
            return fail(format!(
                "{MAX_GAP}: {} s is not between 0 and {MAX_GAP_SECS} s",
                self.max_gap_secs
            ));
        }
        let bias = self.bias.amax();
        if !(self.bias.iter().all(|b| b.is_finite()) && bias <= super::gate::HUGE_RATE) {
            return fail(format!(
                "{BIAS}: {:?} rad/s can not be a gyro bias",
                self.bias.as_slice()
            ));
        }
        if !(self.accel_scale.is_finite() && self.accel_scale != 0.0) {
            return fail(format!(
                "acceleration scale {} is not usable",
                self.accel_scale
            ));
        }
        let numbers = self.gyro_matrix.iter().chain(self.accel_matrix.iter());
        if !numbers.chain(self.accel_bias.iter()).all(|n| n.is_finite()) {
            return fail(format!("{CALIBRATION}: numbers that are none"));
        }
        if let Some(range) = self.gyro_range
            && !(range.is_finite() && range > 0.0)
        {
            return fail(format!("{GYRO_RANGE}: {range} rad/s is not a range"));
        }
        if let Some(step) = self.truncation_step
            && !(step.is_finite() && (0.0..1.0).contains(&step))
        {
            return fail(format!(
                "{UNDO_TRUNCATION}: {step} rad/s is not the step of a gyro"
            ));
        }
        for (flag, value) in [(START, self.start), (UNTIL, self.until)] {
            if let Some(secs) = value
                && !(secs.is_finite() && secs.abs() <= 1e9)
            {
                return fail(format!("{flag}: {secs} s is not a time after the start"));
            }
        }
        if let (Some(start), Some(until)) = (self.start, self.until)
            && start > until
        {
            return fail(format!("{START} {start} is later than {UNTIL} {until}"));
        }
        if self.reorder_window > MAX_WINDOW {
            return fail(format!(
                "reorder window {} is above {MAX_WINDOW} samples",
                self.reorder_window
            ));
        }
        Ok(())
    }
}

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    m.transpose().into()
}

fn is_signed_permutation(m: &Matrix3<f64>) -> bool {
    m.iter().all(|v| [0.0, 1.0, -1.0].contains(v))
        && (0..3).all(|i| m.row(i).abs().sum() == 1.0 && m.column(i).abs().sum() == 1.0)
}

/// A setting that can not be; the text names the flag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingsError(pub(super) String);

impl std::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SettingsError {}
