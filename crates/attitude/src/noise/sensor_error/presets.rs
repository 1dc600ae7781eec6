//! Classes of gyros by name. Pure.

use super::{ImuError, ImuErrorFault};
/// A class of gyro.
#[derive(Debug)]
pub struct Preset {
    /// Name as given to `--noise`.
    pub name: &'static str,
    /// Terms, as [`ImuError::parse`] takes them.
    pub terms: &'static str,
    /// Origin of the numbers, and which of them are filled in.
    pub source: &'static str,
}

impl Preset {
    /// Sizes of the terms.
    ///
    /// # Errors
    /// Never for those in [`PRESETS`]; a test reads each.
    pub fn error(&self) -> Result<ImuError, ImuErrorFault> {
        ImuError::parse(self.terms)
    }
}

/// The presets. All values 1 sigma.
pub static PRESETS: [Preset; 15] = [
    Preset {
        name: "consumer_mems",
        terms: "arw=0.84,bias_instability=5,scale_ppm=10000,misalignment=1,g_sensitivity=360,range=2000",
        source: "BMI088 class: 0.014 deg/s/sqrt(Hz) and range, Bosch; the rest filled in as usual for the class",
    },
    Preset {
        name: "consumer_mems_b",
        terms: "arw=0.42,bias_instability=10,nonlinearity_ppm=1000,range=2000",
        source: "Xsens MTi-1: 0.007 deg/s/sqrt(Hz), 10 deg/h, 0.1 % of full scale, +-2000 deg/s",
    },
    Preset {
        name: "industrial_mems",
        terms: "arw=0.15,bias_instability=2,scale_ppm=1000,misalignment=0.05,g_sensitivity=36,range=125",
        source: "ADIS16465-1: Analog Devices data sheet; scale and g-sensitivity filled in",
    },
    Preset {
        name: "industrial_mems_b",
        terms: "arw=0.3,gm_sigma=6.5,gm_tau=100,turn_on_bias=720",
        source: "ADIS16488 as in NaveGo's synthetic example: 6.5 deg/h with 100 s, 0.2 deg/s turn-on",
    },
    Preset {
        name: "low",
        terms: "arw=0.75,gm_sigma=10,gm_tau=100",
        source: "AHRS380 class, the `low-accuracy` of gnss-ins-sim",
    },
    Preset {
        name: "mid",
        terms: "arw=0.25,gm_sigma=3.5,gm_tau=100",
        source: "IMU381 class, the `mid-accuracy` of gnss-ins-sim",
    },
    Preset {
        name: "tactical",
        terms: "arw=0.15,bias_instability=0.5,turn_on_bias=4,scale_ppm=500,nonlinearity_ppm=50,misalignment=0.0572958,g_sensitivity=1,range=400",
        source: "STIM300: Safran data sheet and ION NAVI table; misalignment 1 mrad, 25 to 50 ppm non-linear",
    },
    Preset {
        name: "navigation",
        terms: "arw=0.002,bias_instability=0.01,scale_ppm=5,misalignment=0.00277778",
        source: "HG9900 class: below 0.002 deg/sqrt(h) and 0.01 deg/h, Satellite Navigation 2020 table 1; scale and 10 arcsec filled in",
    },
    Preset {
        name: "navigation_sim",
        terms: "arw=0.002,bias_instability=0.1,scale_ppm=5,misalignment=0.00277778",
        source: "HG9900 class as the `high-accuracy` of gnss-ins-sim states it: 0.1 deg/h",
    },
    Preset {
        name: "navigation_psins",
        terms: "arw=0.001,turn_on_bias=0.01,gm_sigma=0.001,gm_tau=300,scale_ppm=10,misalignment=0.00277778",
        source: "PSINS `imuerrset`, case 2: 0.01 deg/h constant, 0.001 deg/h with 300 to 1000 s",
    },
    // Whole units: accelerometer and magnetometer, turn-on bias and resolution with them.
    Preset {
        name: "consumer_imu",
        terms: "arw=0.84,bias_instability=5,turn_on_bias=1800,scale_ppm=10000,misalignment=1,g_sensitivity=360,range=2000,lsb=0.061,accel_noise=190,accel_bias=20,accel_scale_ppm=5000,accel_misalignment=0.5,accel_range=24,accel_lsb=0.73,mag_noise=0.5,mag_hard_iron=1,mag_soft_iron=1,mag_lsb=0.15",
        source: "consumer_mems and its accelerometer (BMI088: 190 ug/sqrt(Hz), 20 mg, 24 g), a magnetometer calibrated to 1 uT; scale and axes filled in",
    },
    Preset {
        name: "industrial_imu",
        terms: "arw=0.15,bias_instability=2,turn_on_bias=500,scale_ppm=1000,misalignment=0.05,g_sensitivity=36,range=125,accel_noise=23,accel_bias=2,accel_scale_ppm=1000,accel_misalignment=0.05,accel_range=8,mag_noise=0.2,mag_hard_iron=0.3,mag_soft_iron=0.3",
        source: "industrial_mems and its accelerometer (ADIS16465: 23 ug/sqrt(Hz), 8 g, 0.14 deg/s turn-on); the rest filled in",
    },
    Preset {
        name: "rough_imu",
        terms: "arw=0.84,bias_instability=20,turn_on_bias=18000,scale_ppm=20000,misalignment=1,g_sensitivity=360,range=250,truncation=0.061,accel_noise=300,accel_bias=40,accel_scale_ppm=20000,accel_misalignment=1,accel_range=4,accel_lsb=1,mag_noise=1,mag_hard_iron=5,mag_soft_iron=5,mag_lsb=0.3",
        source: "a cheap unit as it comes, uncalibrated: 5 deg/s of bias, 2 % of scale, clipping at 250 deg/s and 4 g, cut towards zero",
    },
    // The names and numbers `replay --noise` has for its covariance: noise alone.
    Preset {
        name: "consumer",
        terms: "arw=0.84,bias_instability=5",
        source: "the noise of consumer_mems alone, as an estimator expects it of that class",
    },
    Preset {
        name: "industrial",
        terms: "arw=0.15,bias_instability=2",
        source: "the noise of industrial_mems alone, as an estimator expects it of that class",
    },
];
