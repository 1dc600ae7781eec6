//! Flags of the sampling -> how the sensor samples a motion, and what the simulation states of that. Pure.
//!
//! Apart from the flags because what a text stands for is checked here; where its samples go is no matter of the sensor.

use super::{Common, GRAVITY, Made, parameter};
use crate::config::numbers;
use crate::error::{Error, Result};
use nalgebra::Vector3;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::noise::sensor_error::{ImuError, StampError};
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_bodies::field::{Disturbance, Field};
use strapd_bodies::synthetic::{ForceSampling, Magnetometer, Sampling};

impl Common {
    /// Sampling of a motion.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag.
    pub(super) fn sampling(&self, made: &Made) -> Result<Sampling> {
        let kind = SampleKind::named(&self.sample_kind).unwrap_or_default();
        let start = stamp("--start-stamp", &self.start_stamp)?;
        let error = ImuError::parse(&self.noise).map_err(|e| {
            Error::usage(Diagnostic::from(&e).at(format_args!("--noise {}", self.noise)))
        })?;
        let stamps = self.stamps()?;
        let gravity = made.gravity.unwrap_or(GRAVITY);
        let lever = numbers::<3>("--lever-arm", &self.lever_arm)?;
        let force = self.force_sampling.map_or(made.force, ForceSampling::from);
        Ok(Sampling {
            rate_hz: self.rate_hz,
            duration_secs: self.duration,
            kind,
            start,
            gravity,
            lever_b: lever.into(),
            force,
            magnetometer: self.magnetometer()?,
            error,
            stamps,
            seed: self.seed,
        })
    }

    /// Names and values of the sampling, as the simulation states them.
    pub(super) fn parameters(&self, sampling: &Sampling) -> Vec<(String, String)> {
        let mut parameters = vec![
            parameter("gravity_m_s2", sampling.gravity),
            parameter("rate_hz", self.rate_hz),
            parameter("duration_s", self.duration),
            parameter("seed", self.seed),
            parameter("start_stamp_ns", sampling.start.0),
            parameter("noise", sampling.error.text()),
        ];
        let [x, y, z] = sampling.lever_b.into();
        if [x, y, z] != [0.0; 3] {
            parameters.push(parameter("lever_arm_m", format!("{x},{y},{z}")));
        }
        if sampling.force == ForceSampling::AsGyro {
            parameters.push(parameter("force_sampling", "as-gyro"));
        }
        if let Some(rate) = self.mag {
            parameters.push(parameter("mag_rate_hz", rate.unwrap_or(self.rate_hz)));
            parameters.push(parameter("field_ut_deg_deg", &self.field));
            for disturbance in &self.field_disturbance {
                parameters.push(parameter("field_disturbance", disturbance));
            }
        }
        let stamps = &sampling.stamps;
        for (name, value, plain) in [
            ("jitter", stamps.sampling_jitter, 0.0),
            ("stamp_jitter", stamps.stamp_jitter, 0.0),
            ("stamp_offset_ns", stamps.offset_nanos as f64, 0.0),
            ("stamp_drift_ppm", stamps.drift_ppm, 0.0),
            ("drop", stamps.drop_probability, 0.0),
            ("burst", stamps.burst_length, 1.0),
        ] {
            if value != plain {
                parameters.push(parameter(name, value));
            }
        }
        parameters
    }

    fn magnetometer(&self) -> Result<Option<Magnetometer>> {
        let Some(rate) = self.mag else {
            return Ok(None);
        };
        let refused = |flag: &str, why: String| Error::usage(format!("{flag} {why}"));
        let [strength, dip, declination] = numbers::<3>("--field", &self.field)?;
        if !((0.0..=1e6).contains(&strength) && dip.abs() <= 90.0 && declination.abs() <= 360.0) {
            return Err(refused(
                "--field",
                format!(
                    "{}: 0 to 1e6 uT, a dip of at most 90 and a declination of at most 360 degrees are needed",
                    self.field
                ),
            ));
        }
        let disturbance = |text: &String| {
            let flag = "--field-disturbance";
            let [from, to, x, y, z] = numbers::<5>(flag, text)?;
            let added = Vector3::new(x, y, z);
            if !(0.0 <= from && from < to && added.amax() <= 1e6) {
                return Err(refused(
                    flag,
                    format!("{text}: 0 <= FROM < TO and at most 1e6 uT are needed"),
                ));
            }
            Ok(Disturbance {
                from,
                to,
                added_n: added * 1e-6,
            })
        };
        let disturbances = self.field_disturbance.iter().map(disturbance);
        let disturbances = disturbances.collect::<Result<Vec<_>>>()?;
        Ok(Some(Magnetometer {
            rate_hz: rate.unwrap_or(self.rate_hz),
            field: Field::new(
                strength * 1e-6,
                dip.to_radians(),
                declination.to_radians(),
                disturbances,
            ),
        }))
    }

    fn stamps(&self) -> Result<StampError> {
        let stamps = StampError {
            offset_nanos: stamp("--stamp-offset", &self.stamp_offset)?.0,
            drift_ppm: self.stamp_drift,
            sampling_jitter: self.jitter,
            stamp_jitter: self.stamp_jitter,
            drop_probability: self.drop,
            burst_length: self.burst,
        };
        stamps.check().map_err(|e| {
            Error::usage(
                Diagnostic::from(&e)
                    .help("--stamp-drift, --jitter, --stamp-jitter, --drop, --burst"),
            )
        })?;
        Ok(stamps)
    }
}

/// Decimal seconds as whole nanoseconds: through a float today's epoch would lose 2e-7 s.
fn stamp(flag: &str, text: &str) -> Result<Nanos> {
    let parsed = || {
        let (sign, digits) = match text.strip_prefix('-') {
            Some(rest) => (-1, rest),
            None => (1, text),
        };
        let (secs, rest) = digits.split_once('.').unwrap_or((digits, ""));
        let all_digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
        if secs.is_empty() || rest.len() > 9 || !all_digits(secs) || !all_digits(rest) {
            return None;
        }
        let nanos: i64 = format!("{rest:0<9}").parse().ok()?;
        let whole = secs.parse::<i64>().ok()?.checked_mul(1_000_000_000)?;
        Some(Nanos(sign * whole.checked_add(nanos)?))
    };
    parsed().ok_or_else(|| {
        Error::usage(format!(
            "{flag} {text}: seconds with up to nine decimals are needed, at most 292 years"
        ))
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_start_stamp_is_exact_to_the_nanosecond() {
        for (text, nanos) in [
            ("0", 0),
            ("1700000000.000000001", 1_700_000_000_000_000_001),
            ("1.5", 1_500_000_000),
            ("-0.000000001", -1),
            ("9223372036.854775807", i64::MAX),
        ] {
            assert_eq!(
                stamp("--start-stamp", text).unwrap(),
                Nanos(nanos),
                "{text}"
            );
        }
        for bad in [
            "",
            "-",
            "1e9",
            "1.0000000001",
            "9223372037",
            "now",
            "nan",
            "1.-5",
            "--1",
        ] {
            assert!(stamp("--start-stamp", bad).is_err(), "{bad}");
        }
    }
}
