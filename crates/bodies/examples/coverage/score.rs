//! Attitudes against truth -> errors and the share that sigma covers. Pure.

use super::log::Log;
use std::fmt;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::AttitudeSample;

type Q = Quaternion<(), ()>;

/// First second that is scored.
const FIRST: f64 = 5.0;

/// Sums over runs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Score {
    runs: f64,
    /// Root mean squares of tilt and heading, degrees, and the mean of the total.
    rms: [f64; 3],
    most: f64,
    inside: [f64; 2],
    sigma: f64,
    /// Root mean square of a component of the acceleration, m/s^2, and the share inside three sigma.
    acceleration: [f64; 2],
}

impl Score {
    pub(crate) fn add(&mut self, other: &Score) {
        self.runs += other.runs;
        for (sum, one) in self.rms.iter_mut().zip(other.rms) {
            *sum += one;
        }
        self.most = self.most.max(other.most);
        for (sum, one) in self.inside.iter_mut().zip(other.inside) {
            *sum += one;
        }
        self.sigma += other.sigma;
        for (sum, one) in self.acceleration.iter_mut().zip(other.acceleration) {
            *sum += one;
        }
    }
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [tilt, heading, total] = self.rms.map(|sum| sum / self.runs);
        let [t, h] = self.inside.map(|sum| sum / self.runs);
        let (most, sigma) = (self.most, self.sigma / self.runs);
        let [a, within] = self.acceleration.map(|sum| sum / self.runs);
        write!(
            f,
            "{tilt:.2} | {heading:.2} | {total:.2} | {most:.1} | {t:.3} | {h:.3} | {sigma:.1} | {a:.3} | {within:.3}"
        )
    }
}

/// Scores what has a truth; the heading is followed through whole turns.
pub(crate) fn score(attitudes: &[AttitudeSample], log: &Log, is_absolute: bool) -> Option<Score> {
    let first = log.samples.first()?.header?;
    let truth = |stamp| {
        let at = log
            .samples
            .binary_search_by_key(&stamp, |s| s.header.unwrap_or(s.log))
            .ok()?;
        Some((log.truth[at]?, log.acceleration.get(at)))
    };
    let (mut align, mut last, mut turned): (Option<Q>, f64, f64) = (None, 0.0, 0.0);
    let (mut squares, mut inside, mut count) = ([0.0; 3], [0.0; 2], 0.0);
    let (mut most, mut sigma_at_end) = (0.0_f64, 0.0);
    let mut accelerations = [0.0; 3];
    for attitude in attitudes {
        if log.begins_at.is_none() && attitude.stamp.secs_since(first) < FIRST {
            continue;
        }
        let Some((reference, acceleration)) = truth(attitude.stamp) else {
            continue;
        };
        let error = Q::assume_unit(attitude.q_nb.wxyz()) * Q::assume_unit(reference).inverse();
        let [w, _, _, z] = error.wxyz();
        let by = *align.get_or_insert_with(|| match is_absolute {
            false => Q::assume_unit([w, 0.0, 0.0, -z]).normalised(),
            true => Q::identity(),
        });
        let error = by * error;
        let [w, _, _, z] = error.wxyz();
        let heading = 2.0 * z.atan2(w);
        let step = heading - last;
        last = heading;
        turned += step - std::f64::consts::TAU * (step / std::f64::consts::TAU).round();
        let total = 2.0 * w.abs().min(1.0).acos();
        let parts = [2.0 * w.hypot(z).min(1.0).acos(), turned, total];
        for (sum, part) in squares.iter_mut().zip(parts) {
            *sum += part.to_degrees().powi(2);
        }
        most = most.max(turned.abs().to_degrees());
        let phi = error.rotation_vector().0;
        let covariance = attitude.covariance.in_navigation_axes(&attitude.q_nb);
        let sigma = [0, 1, 2].map(|i| covariance[(i, i)].sqrt());
        for i in 0..2 {
            inside[0] += 0.5 * f64::from(u8::from(phi[i].abs() <= 3.0 * sigma[i]));
        }
        inside[1] += f64::from(u8::from(turned.abs() <= 3.0 * sigma[2]));
        sigma_at_end = sigma[2].to_degrees();
        if let Some((of, truth)) = attitude.linear_acceleration.zip(acceleration) {
            for (error, sigma) in (of.body.as_vector() - truth).iter().zip(&of.sigma()) {
                accelerations[0] += error * error;
                accelerations[1] += f64::from(u8::from(error.abs() <= 3.0 * sigma));
                accelerations[2] += 1.0;
            }
        }
        count += 1.0;
    }
    (count > 0.0).then(|| Score {
        runs: 1.0,
        rms: squares.map(|sum: f64| (sum / count).sqrt()),
        most,
        inside: inside.map(|sum| sum / count),
        sigma: sigma_at_end,
        acceleration: [
            (accelerations[0] / accelerations[2]).sqrt(),
            accelerations[1] / accelerations[2],
        ],
    })
}
