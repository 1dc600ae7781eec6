//! Settings of the gyro that the user states. Pure.
//!
//! A stage of its own so that everything outside can be wrong about a sensor is checked once,
//! before the first sample, and the hot path needs no checks.

use super::clock::{BatchRate, Clock, CoarseClock};
use super::repairs::{SpikePolicy, StampRepair};
use crate::frames::{AxisMap, Body, Dcm, Sensor};
use crate::quaternion::BodyRate;
use crate::record::{GyroUnit, SampleKind};
use crate::setting::{
    BIAS, CALIBRATION, GYRO_RANGE, GYRO_SCALE, MAX_GAP, MOUNT, RATE_HZ, START, UNDO_TRUNCATION,
    UNTIL,
};
use nalgebra::{Matrix3, Vector3};
use std::fmt;

/// Treatment of a gap longer than [`Settings::max_gap_secs`], and of a clock that jumped back.
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
    pub const fn name(self) -> &'static str {
        match self {
            OnGap::Hold => "hold",
            OnGap::Bridge => "bridge",
            OnGap::Reset => "reset",
        }
    }
}

/// Settings by which a stream is conditioned.
///
/// # Convention
/// A raw vector v_s in the sensor's own axes and unit becomes `w_b = mount * axes * gyro_matrix * gyro_scale * unit * v_s - bias`,
/// an acceleration `mount * axes * (accel_matrix * accel_scale * a_s - accel_bias)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Meaning of a sample in time.
    pub kind: SampleKind,
    /// Unit of the recorded rates.
    pub unit: GyroUnit,
    /// Multiply the recorded acceleration by this to get m/s^2.
    pub accel_scale: f64,
    /// Factors of the recorded rates, by axis as recorded.
    pub gyro_scale: [f64; 3],
    /// Corrects scale and axes of the gyro, sensor axes. No rotation, and so a bare matrix: its columns are what the
    /// sensor reads of a rate of 1 about each axis, undone.
    pub gyro_matrix: Matrix3<f64>,
    /// The same for the accelerometer; no rotation either.
    pub accel_matrix: Matrix3<f64>,
    /// Bias left after that, m/s^2, sensor axes before `axes`.
    pub accel_bias: Vector3<f64>,
    /// Sensor axes from the columns of the source. A map that mirrors is allowed: recordings
    /// with columns in z,y,x order exist, and naming the columns right is not a reflection.
    pub axes: AxisMap,
    /// Sensor-to-body rotation C_bs, applied after `axes`.
    pub mount: Dcm<Body, Sensor>,
    /// Clock whose stamps count. See [`super::choose_clock`].
    pub clock: Clock,
    /// Longest gap integrated across, seconds.
    pub max_gap_secs: f64,
    /// Treatment of a gap beyond it.
    pub on_gap: OnGap,
    /// Step in rad/s (or rad of a delta angle), sensor axes, to which a driver has cut the rates towards
    /// zero: half of it is put back. See [`truncation`](super::truncation).
    pub truncation_step: Option<f64>,
    /// Gyro bias, subtracted.
    pub bias: BodyRate,
    /// Full scale of the gyro in rad/s, sensor axes: components at or beyond it are flagged.
    pub gyro_range: Option<f64>,
    /// Treatment of spikes: repaired where samples wait for their successors, else found when these have come.
    pub spikes: SpikePolicy,
    /// Leave out samples earlier than this, seconds after the first stamp.
    pub start: Option<f64>,
    /// Leave out samples later than this, seconds after the first stamp.
    pub until: Option<f64>,
    /// Number of samples held back so that a late one can be put in its place (and so that the
    /// first samples, colliding stamps and stamps that catch up are judged with their successors
    /// in view). 0 = live: every sample with a new stamp leaves at once, late ones are dropped.
    pub reorder_window: usize,
    /// Whether stamps are followed through what counters and clocks do to them.
    pub repair: StampRepair,
    /// Whether the log times tell when samples arrived, the same in every run: those of a recording do.
    pub has_arrival: bool,
    /// The rate of samples that were stamped when their batch came, where a pass over the recording found one.
    pub batches: Option<BatchRate>,
    /// The clock, where a pass over the first samples found it coarser than the sensor.
    pub coarse: Option<CoarseClock>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            kind: SampleKind::Rate,
            unit: GyroUnit::Rad,
            accel_scale: 1.0,
            gyro_scale: [1.0; 3],
            gyro_matrix: Matrix3::identity(),
            accel_matrix: Matrix3::identity(),
            accel_bias: Vector3::zeros(),
            axes: AxisMap::IDENTITY,
            mount: Dcm::identity(),
            clock: Clock::Header,
            max_gap_secs: 0.5,
            on_gap: OnGap::Hold,
            truncation_step: None,
            bias: BodyRate::ZERO,
            gyro_range: None,
            spikes: SpikePolicy::Repair,
            start: None,
            until: None,
            reorder_window: Settings::REPLAY_WINDOW,
            repair: StampRepair::Auto,
            has_arrival: true,
            batches: None,
            coarse: None,
        }
    }
}

/// Longest `max_gap_secs`: a day. Nothing was measured across a longer one.
pub(crate) const MAX_GAP_SECS: f64 = 86_400.0;
/// Sample rates there are, Hz.
pub(crate) const SAMPLE_RATES: (f64, f64) = (1e-3, 1e9);
/// Longest time after the start of the data, s.
pub(crate) const LONGEST_SECS: f64 = 1e9;
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

    /// All of it as text, which tells settings of a saved estimator apart: by numbers alone, so that one of an earlier
    /// version goes on, whatever types hold them now.
    pub(crate) fn tell(&self, out: &mut impl fmt::Write) -> fmt::Result {
        let Settings {
            kind,
            unit,
            accel_scale,
            gyro_scale,
            gyro_matrix,
            accel_matrix,
            accel_bias,
            axes,
            mount,
            clock,
            max_gap_secs,
            on_gap,
            truncation_step,
            bias: BodyRate(bias),
            gyro_range,
            // What is saved means the same either way.
            spikes: _,
            start,
            until,
            reorder_window,
            repair,
            // What was saved is of one daemon, which has none.
            has_arrival: _,
            batches: _,
            coarse: _,
        } = self;
        let (axes, mount) = (axes.matrix(), mount.as_matrix());
        write!(
            out,
            "Settings {{ kind: {kind:?}, unit: {unit:?}, accel_scale: {accel_scale:?}, gyro_matrix: {gyro_matrix:?}, \
             accel_matrix: {accel_matrix:?}, accel_bias: {accel_bias:?}, axes: {axes:?}, mount: {mount:?}, \
             clock: {clock:?}, max_gap_secs: {max_gap_secs:?}, on_gap: {on_gap:?}, truncation_step: {truncation_step:?}, \
             bias: {bias:?}, gyro_range: {gyro_range:?}, start: {start:?}, until: {until:?}, \
             reorder_window: {reorder_window:?} }}"
        )?;
        // Nothing for what is not set: what was saved before there was one goes on.
        if *gyro_scale != [1.0; 3] {
            write!(out, " gyro_scale: {gyro_scale:?}")?;
        }
        match repair {
            StampRepair::Auto => Ok(()),
            StampRepair::AsRecorded => write!(out, " stamps: {repair:?}"),
        }
    }

    /// Checks everything a person can get wrong.
    ///
    /// # Errors
    /// [`SettingsError`] names the setting, the value, and the flag that sets it.
    pub(crate) fn validate(&self) -> Result<(), SettingsError> {
        let fail = |text: String| Err(SettingsError(text));
        let excess = self.mount.orthonormality_defect();
        let determinant = self.mount.as_matrix().determinant();
        // `!(a <= b)` and not `a > b`, so that NaN fails too.
        if !(excess <= ROTATION_TOLERANCE && determinant > 0.0) {
            return fail(format!(
                "{MOUNT}: {:?} is not a rotation (C C^T is off the identity by {excess:.1e}, determinant {determinant:.3})",
                self.mount
            ));
        }
        if let Clock::Index { rate_hz } = self.clock
            && !(rate_hz.is_finite() && (SAMPLE_RATES.0..=SAMPLE_RATES.1).contains(&rate_hz))
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
        let BodyRate(bias) = self.bias;
        if !(bias.iter().all(|b| b.is_finite()) && bias.amax() <= super::gate::HUGE_RATE) {
            return fail(format!(
                "{BIAS}: {:?} rad/s cannot be a gyro bias",
                bias.as_slice()
            ));
        }
        if !(self.accel_scale.is_finite() && self.accel_scale != 0.0) {
            return fail(format!(
                "acceleration scale {} is not usable",
                self.accel_scale
            ));
        }
        if !self.gyro_scale.iter().all(|f| f.is_finite() && *f > 0.0) {
            return fail(format!(
                "{GYRO_SCALE}: {:?} are no factors",
                self.gyro_scale
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
                && !(secs.is_finite() && secs.abs() <= LONGEST_SECS)
            {
                return fail(format!("{flag}: {secs} s is not a time after the start"));
            }
        }
        if let Some(until) = self.until.filter(|until| *until < 0.0) {
            return fail(format!("{UNTIL} {until}: no sample is before the first"));
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

/// A setting that cannot be; the text names the flag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingsError(pub(super) String);

impl std::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SettingsError {}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// Printed form of settings from when they held bare numbers, by which saved estimators are distinguished.
    mod bare {
        use super::*;

        #[derive(Debug)]
        #[allow(dead_code)]
        pub(super) struct Settings {
            pub(super) kind: SampleKind,
            pub(super) unit: GyroUnit,
            pub(super) accel_scale: f64,
            pub(super) gyro_matrix: Matrix3<f64>,
            pub(super) accel_matrix: Matrix3<f64>,
            pub(super) accel_bias: Vector3<f64>,
            pub(super) axes: Matrix3<f64>,
            pub(super) mount: Matrix3<f64>,
            pub(super) clock: Clock,
            pub(super) max_gap_secs: f64,
            pub(super) on_gap: OnGap,
            pub(super) truncation_step: Option<f64>,
            pub(super) bias: Vector3<f64>,
            pub(super) gyro_range: Option<f64>,
            pub(super) start: Option<f64>,
            pub(super) until: Option<f64>,
            pub(super) reorder_window: usize,
        }
    }

    #[test]
    fn an_estimator_saved_before_settings_had_types_is_known_again() {
        let turn = *Rotation3::from_euler_angles(0.1, -0.2, 0.3).matrix();
        let settings = Settings {
            kind: SampleKind::DeltaAngle,
            axes: "YxZ".parse().unwrap_or_default(),
            mount: Dcm::assume(turn),
            bias: BodyRate(Vector3::new(0.1, -0.0, 1e-300)),
            gyro_range: Some(4.0),
            ..Settings::default()
        };
        let before = bare::Settings {
            kind: SampleKind::DeltaAngle,
            unit: settings.unit,
            accel_scale: settings.accel_scale,
            gyro_matrix: settings.gyro_matrix,
            accel_matrix: settings.accel_matrix,
            accel_bias: settings.accel_bias,
            axes: Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
            mount: turn,
            clock: settings.clock,
            max_gap_secs: settings.max_gap_secs,
            on_gap: settings.on_gap,
            truncation_step: settings.truncation_step,
            bias: Vector3::new(0.1, -0.0, 1e-300),
            gyro_range: settings.gyro_range,
            start: settings.start,
            until: settings.until,
            reorder_window: settings.reorder_window,
        };
        let mut told = String::new();
        assert!(settings.tell(&mut told).is_ok());
        assert_eq!(told, format!("{before:?}"));
    }
}
