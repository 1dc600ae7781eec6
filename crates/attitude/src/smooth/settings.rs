//! Settings of the smoother about a recording and how to treat it. Pure.

use nalgebra::Vector3;
use std::num::NonZero;

/// Standard deviation of the gyro's bias in the default class, rad/s.
pub(crate) const BIAS_SIGMA: f64 = 1.0_f64.to_radians();

/// Model of a gyro value: the rate that it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SampleModel {
    /// The mean over the interval that ends at its stamp: also a delta angle, divided by that interval.
    #[default]
    Interval,
    /// The rate at its stamp.
    Instant,
}

/// Reference of the heading in the field.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum HeadingReference {
    /// The field where the body rests; while it moves the field may be another, and only supports.
    #[default]
    Standstill,
    /// The mean of the whole log, for a resting place that is disturbed.
    All,
}

/// Model of the motion of a body that strays no farther and no faster than it is found to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum MotionModel {
    /// A stationary process: where it is and how fast bear on where it is next.
    #[default]
    Process,
    /// Velocity and position of each node say nothing of the next one's. It is what the independent computation has
    /// whose figures the tests hold.
    Independent,
}

/// Unit in which the field is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum FieldUnit {
    /// uT.
    #[default]
    Microtesla,
    /// Not known: its median is taken for 50 uT.
    Unknown,
}

/// Prior knowledge of a sensor of which a calibration was taken out of the samples already: one standard deviation of
/// what is left, body axes, matrices row by row. `None`: as of any sensor.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct PriorSigmas {
    /// Sigma of the gyro's bias, rad/s.
    pub gyro_bias: [Option<f64>; 3],
    /// Sigmas of the gyro's scale and axes.
    pub gyro: [Option<f64>; 9],
    /// Sigma of the accelerometer's bias, m/s^2.
    pub force_bias: [Option<f64>; 3],
    /// Sigmas of its scale and axes.
    pub force: [Option<f64>; 9],
    /// Time after its stamp at which a force was measured, s, which is not taken out; and one standard deviation.
    pub force_time: Option<(f64, f64)>,
    /// Sigmas of the magnetometer's scale and axes.
    pub field: [Option<f64>; 9],
    /// Time of the field, as `force_time`.
    pub field_time: Option<(f64, f64)>,
}

impl PriorSigmas {
    /// The same, known so many times worse.
    #[must_use]
    pub fn widened(mut self, by: f64) -> PriorSigmas {
        let gyro = self.gyro_bias.iter_mut().chain(&mut self.gyro);
        let force = self.force_bias.iter_mut().chain(&mut self.force);
        for sigma in gyro.chain(force).chain(&mut self.field) {
            *sigma = sigma.map(|sigma| sigma * by);
        }
        for time in [&mut self.force_time, &mut self.field_time] {
            *time = time.map(|(mean, sigma)| (mean, sigma * by));
        }
        self
    }
}

/// Ratio of the priors to those after a calibration in the factory.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PriorScale {
    /// Ratio for scales, and for when forces and fields are measured.
    pub scale: f64,
    /// Ratio for axes, to each other and in the case.
    pub axes: f64,
    /// Ratio for the accelerometer's bias.
    pub force: f64,
    /// Ratio for the gyro's sensitivity to acceleration.
    pub sensitivity: f64,
}

impl Default for PriorScale {
    fn default() -> PriorScale {
        PriorScale {
            scale: 1.0,
            axes: 1.0,
            force: 1.0,
            sensitivity: 1.0,
        }
    }
}

impl PriorScale {
    pub(crate) fn times(self, by: PriorScale) -> PriorScale {
        PriorScale {
            scale: self.scale * by.scale,
            axes: self.axes * by.axes,
            force: self.force * by.force,
            sensitivity: self.sensitivity * by.sensitivity,
        }
    }
}

/// Class that a sensor may be of instead, where neither anybody nor the data said which: sigma covers both.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OtherClass {
    /// Priors of it, in the unit of [`Settings::looseness`].
    pub looseness: PriorScale,
    /// Probability that the sensor is of it.
    pub probability: f64,
}

/// Settings of the smoother, SI, beside the noise that `docs/theory/smoother.md` fixes. The defaults are one set for
/// all sensors and motions it was judged on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Settings {
    /// Time between nodes, s. `None`: 0.5, 1 above an hour, 2 above four hours, more beyond a day (as many nodes).
    pub node_spacing: Option<f64>,
    /// Standard deviation of the gyro's bias in the sensor's class, rad/s.
    pub bias_sigma: f64,
    /// Ratio of the sigmas of calibration constants to those after a calibration in the factory.
    pub looseness: PriorScale,
    /// Class that the sensor may be of instead.
    pub other: Option<OtherClass>,
    /// Prior knowledge of this sensor.
    pub known: PriorSigmas,
    /// Delay of the samples, s: attitudes are turned on by the rate over this.
    pub sensor_delay: f64,
    /// Reference of the heading in the field.
    pub heading_reference: HeadingReference,
    /// The unit of the field.
    pub field_unit: FieldUnit,
    /// Model of a gyro value.
    pub sample_model: SampleModel,
    /// Whether rates that a driver cut towards zero are put back in the middle of their step.
    pub undo_truncation: bool,
    /// Model of the motion.
    pub motion: MotionModel,
    /// Whether what is faster than the samples counts as noise of them.
    pub has_unresolved: bool,
    /// Most iterations without the field; twice as many while nodes turn by more than 0.1 deg.
    pub iterations: usize,
    /// Most iterations with it.
    pub field_iterations: usize,
    /// Threads that sweep: the bits that come out do not depend on it.
    pub threads: NonZero<usize>,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            node_spacing: None,
            bias_sigma: BIAS_SIGMA,
            looseness: PriorScale::default(),
            other: None,
            known: PriorSigmas::default(),
            sensor_delay: 0.0,
            heading_reference: HeadingReference::Standstill,
            field_unit: FieldUnit::Microtesla,
            sample_model: SampleModel::Interval,
            undo_truncation: true,
            motion: MotionModel::default(),
            has_unresolved: true,
            iterations: 6,
            field_iterations: 9,
            threads: NonZero::<usize>::MIN,
        }
    }
}

impl Settings {
    /// Setting that cannot be: its name and value.
    pub(super) fn fault(&self) -> Option<(&'static str, f64)> {
        let spacing = self.node_spacing.unwrap_or(0.5);
        let in_range =
            |value: f64, smallest: f64, largest: f64| (smallest..=largest).contains(&value);
        if !in_range(spacing, 0.05, 60.0) {
            return Some(("node_spacing", spacing));
        }
        let PriorScale {
            scale,
            axes,
            force,
            sensitivity,
        } = self.looseness;
        for looseness in [scale, axes, force, sensitivity] {
            if !in_range(looseness, 1e-3, 1e3) {
                return Some(("looseness", looseness));
            }
        }
        if !in_range(self.bias_sigma, 1e-9, 1.0) {
            return Some(("bias_sigma", self.bias_sigma));
        }
        if !in_range(self.sensor_delay, -1.0, 1.0) {
            return Some(("sensor_delay", self.sensor_delay));
        }
        if self.iterations == 0 {
            return Some(("iterations", 0.0));
        }
        None
    }

    /// One standard deviation of the gyro's bias beforehand, rad/s.
    pub(super) fn bias_sigmas(&self) -> Vector3<f64> {
        Vector3::from(
            self.known
                .gyro_bias
                .map(|sigma| sigma.unwrap_or(self.bias_sigma)),
        )
    }

    /// About what it scatters, where `found` is the first guess: nothing, about axes of which it is known.
    pub(super) fn bias_beforehand(&self, found: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| match self.known.gyro_bias[i] {
            Some(_) => 0.0,
            None => found[i],
        })
    }

    /// Time between nodes of a log so long, s.
    pub(super) fn spacing(&self, secs: f64) -> f64 {
        const HOUR: f64 = 3600.0;
        match self.node_spacing {
            Some(given) => given,
            None if secs <= HOUR => 0.5,
            None if secs <= 4.0 * HOUR => 1.0,
            None => 2.0 * (secs / (24.0 * HOUR)).max(1.0),
        }
    }
}
