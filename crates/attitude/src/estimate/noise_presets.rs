//! Classes of gyros by name, with the figures of their data sheets. Pure.

/// The class of a sensor that nobody calibrated.
pub(super) const UNCALIBRATED: &NoisePreset = &NOISE_PRESETS[1];

/// A named class of gyros, by data sheets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NoisePreset {
    /// Name.
    pub name: &'static str,
    /// Angle random walk, deg/sqrt(h).
    pub arw: f64,
    /// Bias instability, deg/h.
    pub bias_instability: f64,
    /// Bias after switching on, one standard deviation, deg/s.
    pub turn_on_bias: f64,
    /// Error of the scale factors, as a share.
    pub scale: f64,
    /// Angle between the axes, rad.
    pub misalignment: f64,
    /// Bias of the accelerometer beside it, as a share of gravity: what levelling by it is off by.
    pub tilt: f64,
    /// Delay of its filters that nobody has taken out, s.
    pub delay: f64,
    /// Sensitivity of the gyro to acceleration, deg/s per g.
    pub sensitivity: f64,
}

/// The named classes. One standard deviation is a third of a data sheet's limit, or its typical value.
///
/// Sources: `docs/theory/attitude.md` 9 (Bosch BMI088: offset 1 deg/s, sensitivity 1 %, cross-axis 1 %, accelerometer
/// offset 20 mg; `uncalibrated`, a cheap chip on a board that nobody has measured: InvenSense MPU-6050, scale 3 %,
/// cross-axis 2 %, offset 50 mg, and 1 degree to its case, which is most of the misalignment; ADIS16465: repeatability
/// 0.14 deg/s, sensitivity 0.25 %, misalignment 0.25 deg, 1.4 mg; STIM300: 10 deg/h, 500 ppm, 1 mrad, 0.75 mg; HG9900
/// class: 0.003 deg/h, 5 ppm, 10 arc seconds, 25 ug). Sensitivities to acceleration: BMI088 and MPU-6050 0.1 deg/s per
/// g, an Xsens MTi 0.006, ADIS16465 0.009, STIM300 1 deg/h per g. Delays: of a chip's default filters; the better the
/// class, the better it is stated and taken out.
pub const NOISE_PRESETS: [NoisePreset; 5] = [
    NoisePreset {
        name: "consumer",
        arw: 0.84,
        bias_instability: 5.0,
        turn_on_bias: 1.0,
        scale: 5e-3,
        misalignment: 5e-3,
        tilt: 0.02,
        delay: 2e-3,
        sensitivity: 0.006,
    },
    NoisePreset {
        name: "uncalibrated",
        arw: 0.84,
        bias_instability: 10.0,
        turn_on_bias: 2.0,
        scale: 0.01,
        misalignment: 0.0175,
        tilt: 0.02,
        delay: 2e-3,
        sensitivity: 0.1,
    },
    NoisePreset {
        name: "industrial",
        arw: 0.15,
        bias_instability: 2.0,
        turn_on_bias: 0.14,
        scale: 1e-3,
        misalignment: 1.5e-3,
        tilt: 1.4e-3,
        delay: 1e-3,
        sensitivity: 0.006,
    },
    NoisePreset {
        name: "tactical",
        arw: 0.15,
        bias_instability: 0.5,
        turn_on_bias: 2.8e-3,
        scale: 5e-4,
        misalignment: 1e-3,
        tilt: 7.5e-4,
        delay: 5e-4,
        sensitivity: 3e-4,
    },
    NoisePreset {
        name: "navigation",
        arw: 0.002,
        bias_instability: 0.01,
        turn_on_bias: 8e-7,
        scale: 5e-6,
        misalignment: 5e-5,
        tilt: 2.5e-5,
        delay: 1e-4,
        sensitivity: 1e-5,
    },
];
