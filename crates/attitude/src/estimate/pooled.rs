//! Calibrations by several recordings of one sensor -> its calibration. Pure.
//!
//! Each recording is looked at by itself, and none begins with what another has told: that two of them differ by more
//! than they claim to know would not be seen otherwise.

use super::sensor_calibration::{
    CalibrationTerm, FIELD, FORCE_BIAS, LEAD, SHARE, SensorCalibration,
};

/// Numbers that another recording has told too, before their scatter says something.
const ENOUGH: u32 = 3;

/// One sensor, by several recordings.
#[derive(Clone, PartialEq, Debug)]
pub struct Pooled {
    /// The sensor by all of them. Numbers are means, weighted by what each recording knows; where recordings differ by
    /// more than their sigmas, those of the sensor are as much larger. The bias is another each time a sensor is
    /// switched on: its sigma has in it by how much.
    pub calibration: SensorCalibration,
    /// Disagreement of the recordings in their sigmas, root mean square: of the gyro, of the accelerometer, of the
    /// magnetometer. `None`: too few numbers were told by more than one.
    pub disagreement: [Option<f64>; 3],
}

impl Pooled {
    /// Pools `recordings` of one sensor. What they call it, when and where from is that of the last.
    #[must_use]
    pub fn of(recordings: &[SensorCalibration]) -> Pooled {
        let Some(last) = recordings.last() else {
            return Pooled {
                calibration: SensorCalibration::default(),
                disagreement: [None; 3],
            };
        };
        let mut scatter = [Scatter::default(); 3];
        let [gyro, accelerometer, magnetometer] = &mut scatter;
        let mut calibration = SensorCalibration {
            bias: bias(recordings),
            gyro: gyro.pool(recordings, |r| r.gyro.as_ref()),
            force_bias: accelerometer.pool(recordings, |r| r.force_bias.as_ref()),
            force: accelerometer.pool(recordings, |r| r.force.as_ref()),
            lead: accelerometer.pool(recordings, |r| r.lead.as_ref()),
            hard_iron: magnetometer.pool(recordings, |r| r.hard_iron.as_ref()),
            soft_iron: magnetometer.pool(recordings, |r| r.soft_iron.as_ref()),
            field_lead: magnetometer.pool(recordings, |r| r.field_lead.as_ref()),
            truncation_step: recordings.iter().rev().find_map(|r| r.truncation_step),
            ..last.clone()
        };
        let disagreement = scatter.map(Scatter::in_sigmas);
        let [gyro, accelerometer, magnetometer] =
            disagreement.map(|by| by.map_or(1.0, |by| by.max(1.0)));
        widen(&mut calibration.gyro, gyro, SHARE);
        widen(&mut calibration.force_bias, accelerometer, FORCE_BIAS);
        widen(&mut calibration.force, accelerometer, SHARE);
        widen(&mut calibration.lead, accelerometer, LEAD);
        widen(&mut calibration.hard_iron, magnetometer, FIELD);
        widen(&mut calibration.soft_iron, magnetometer, SHARE);
        widen(&mut calibration.field_lead, magnetometer, LEAD);
        Pooled {
            calibration,
            disagreement,
        }
    }
}

/// Scatter of numbers about their means.
#[derive(Clone, Copy, Default, Debug)]
struct Scatter {
    /// Squares of what they are off, in sigmas.
    squares: f64,
    /// Degrees of freedom.
    numbers: u32,
}

impl Scatter {
    fn in_sigmas(self) -> Option<f64> {
        (self.numbers >= ENOUGH).then(|| (self.squares / f64::from(self.numbers)).sqrt())
    }

    fn pool<const N: usize>(
        &mut self,
        recordings: &[SensorCalibration],
        of: impl Fn(&SensorCalibration) -> Option<&CalibrationTerm<N>>,
    ) -> Option<CalibrationTerm<N>> {
        let mut pooled = *recordings.iter().rev().find_map(&of)?;
        let mut sigmas = pooled.sigma.unwrap_or([f64::INFINITY; N]);
        for (i, pooled_sigma) in sigmas.iter_mut().enumerate() {
            let told = || {
                let all = recordings.iter().filter_map(&of);
                all.filter_map(|known| Some((known.value[i], known.sigma_of(i)?.powi(-2))))
            };
            let weight: f64 = told().map(|(_, weight)| weight).sum();
            if weight > 0.0 {
                let mean = told().map(|(value, weight)| value * weight).sum::<f64>() / weight;
                let off = told().map(|(value, weight)| (value - mean).powi(2) * weight);
                self.squares += off.sum::<f64>();
                self.numbers += told().skip(1).count() as u32;
                pooled.value[i] = mean;
                pooled.observed[i] = true;
                *pooled_sigma = weight.powf(-0.5);
            }
        }
        // Where nobody says how well a number is known, it stays a number alone.
        pooled.sigma = pooled.sigma.map(|_| sigmas);
        Some(pooled)
    }
}

/// The mean, with how the recordings know it and how it differs between them.
fn bias(recordings: &[SensorCalibration]) -> Option<CalibrationTerm<3>> {
    let biases: Vec<CalibrationTerm<3>> = recordings.iter().filter_map(|r| r.bias).collect();
    let mut pooled = *biases.last()?;
    let mut sigmas = pooled.sigma?;
    for (i, pooled_sigma) in sigmas.iter_mut().enumerate() {
        let told = || {
            let all = biases.iter();
            all.filter_map(move |bias| Some((bias.value[i], bias.sigma_of(i)?)))
        };
        let n = told().count() as f64;
        if n > 0.0 {
            let mean = told().map(|(value, _)| value).sum::<f64>() / n;
            let own = told().map(|(_, sigma)| sigma * sigma).sum::<f64>() / n;
            let apart: f64 = told().map(|(value, _)| (value - mean).powi(2)).sum();
            pooled.value[i] = mean;
            pooled.observed[i] = true;
            *pooled_sigma = (own + apart / (n - 1.0).max(1.0)).sqrt();
        }
    }
    pooled.sigma = Some(sigmas);
    Some(pooled)
}

/// Widens sigmas by a factor, up to the largest that a calibration can have.
fn widen<const N: usize>(known: &mut Option<CalibrationTerm<N>>, by: f64, largest: f64) {
    if let Some(sigma) = known.as_mut().and_then(|known| known.sigma.as_mut()) {
        *sigma = sigma.map(|sigma| (sigma * by).min(largest));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn known<const N: usize>(value: f64, sigma: f64) -> Option<CalibrationTerm<N>> {
        Some(CalibrationTerm {
            value: [value; N],
            sigma: Some([sigma; N]),
            observed: [true; N],
        })
    }

    fn sensor(scale: f64, sigma: f64, bias: f64) -> SensorCalibration {
        SensorCalibration {
            gyro: known(scale, sigma),
            bias: known(bias, 3e-3),
            ..SensorCalibration::default()
        }
    }

    #[test]
    fn recordings_that_agree_make_sigmas_smaller_and_those_that_do_not_larger() {
        // The difference of two numbers of sigma 5e-4 has 7.07e-4: so far apart they are off by one sigma.
        let apart = 5e-4 * 2.0_f64.sqrt();
        for (by, expected) in [(1.0, 1.0), (0.2, 1.0), (3.0, 3.0)] {
            let second = sensor(1e-3 + by * apart, 5e-4, 0.0);
            let pooled = Pooled::of(&[sensor(1e-3, 5e-4, 0.0), second]);
            let [gyro, accelerometer, _] = pooled.disagreement;
            assert!((gyro.unwrap() - by).abs() < 1e-9, "{gyro:?}");
            assert_eq!(accelerometer, None);
            let found = pooled.calibration.gyro.unwrap();
            assert!((found.value[4] - (1e-3 + 0.5 * by * apart)).abs() < 1e-15);
            let sigma = found.sigma_of(4).unwrap();
            assert!(
                (sigma - expected * 5e-4 / 2.0_f64.sqrt()).abs() < 1e-12,
                "{sigma}"
            );
        }
    }

    #[test]
    fn a_number_that_one_recording_alone_has_told_is_that_ones() {
        let mut first = sensor(1e-3, 5e-4, 0.0);
        let mut second = sensor(9e-3, 5e-4, 0.0);
        first.gyro.as_mut().unwrap().observed = std::array::from_fn(|i| i < 4);
        second.gyro.as_mut().unwrap().observed = std::array::from_fn(|i| i == 8);
        let pooled = Pooled::of(&[first, second]);
        let gyro = pooled.calibration.gyro.unwrap();
        assert_eq!((gyro.value[0], gyro.value[8]), (1e-3, 9e-3));
        assert_eq!(gyro.observed, std::array::from_fn(|i| i < 4 || i == 8));
        assert_eq!(pooled.disagreement, [None; 3]);
    }

    #[test]
    fn the_bias_is_the_mean_and_its_sigma_knows_how_it_differs() {
        let (first, second) = (sensor(0.0, 1e-3, 0.01), sensor(0.0, 1e-3, 0.03));
        let alone = Pooled::of(std::slice::from_ref(&first));
        assert_eq!(alone.calibration.bias, known(0.01, 3e-3));
        let bias = Pooled::of(&[first, second]).calibration.bias.unwrap();
        assert!((bias.value[0] - 0.02).abs() < 1e-15);
        let expected = (3e-3_f64.powi(2) + 2.0 * 0.01_f64.powi(2)).sqrt();
        assert!((bias.sigma_of(0).unwrap() - expected).abs() < 1e-12);
        assert_eq!(Pooled::of(&[]).calibration, SensorCalibration::default());
    }
}
