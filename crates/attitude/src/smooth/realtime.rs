//! Samples -> what the real-time filter makes of them at the nodes. Pure.
//!
//! Apart from the forward pass because it learns the gyro's bias as it goes: the start where nothing ever rests, and
//! what the result falls back to.

use super::pass::by_segment;
use super::sample::Samples;
use super::segments::{Segment, median_of};
use super::settings::{BIAS_SIGMA, Settings};
use super::survey::Survey;
use crate::aid::{self, AidedPropagator};
use crate::frames::In;
use crate::propagate;
use crate::quaternion::BodyRate;
use crate::record::{AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status};
use nalgebra::{Matrix3, Vector3};

/// The real-time filter's view.
pub(super) struct Realtime {
    pub(super) nodes: Vec<[f64; 4]>,
    /// Covariances of the attitude's error, rad^2, earth axes.
    pub(super) covariances: Vec<Matrix3<f64>>,
    /// Median of its bias over the second half of the log, rad/s, and its sigma at the end.
    pub(super) bias: Vector3<f64>,
    pub(super) bias_sigma: Vector3<f64>,
}

/// Prior sigma of the gyro's bias, rad/s: of any gyro, since the recording has time to tell.
const BIAS_PRIOR: f64 = 0.1;

/// Runs it over all samples: twice, so that what it learned of the bias is known from the start the second time, where
/// nothing is known of it beforehand. Heading is that of the first sample.
pub(super) fn run<S: Samples>(
    samples: &mut S,
    with: (&Survey, &Settings),
    segments: &[Segment],
) -> Result<Option<Realtime>, S::Error> {
    let settings = class_settings(with.1);
    let (class, share) = (settings.bias_prior, class_share(with.1));
    if with.1.known.gyro_bias.iter().any(Option::is_some) {
        let known = with.1.bias_sigmas();
        let bias = Matrix3::from_diagonal(&known.component_mul(&known));
        let prior = aid::Prior {
            bias: Some(bias),
            ..settings.prior
        };
        let settings = aid::Settings { prior, ..settings };
        return pass(samples, with, segments, (settings, Vector3::zeros()));
    }
    // The corrections by which a large bias is found are of one sign, too: no drift.
    let wide = aid::Settings {
        bias_prior: BIAS_PRIOR * share.min(1.0),
        bias_drift: 0.0,
        ..settings
    };
    match pass(samples, with, segments, (wide, Vector3::zeros()))? {
        Some(found) => {
            // What the motion does not show (about the vertical, often) stays near nothing, where biases are.
            let sure = found.bias.zip_map(&found.bias_sigma, |bias, sigma| {
                bias * class * class / (class * class + sigma * sigma)
            });
            pass(samples, with, segments, (settings, sure))
        }
        None => Ok(None),
    }
}

/// Runs it over all samples once, from a bias of which no more is known than what is beforehand.
pub(super) fn run_by_class<S: Samples>(
    samples: &mut S,
    with: (&Survey, &Settings),
    segments: &[Segment],
) -> Result<Option<Realtime>, S::Error> {
    pass(
        samples,
        with,
        segments,
        (class_settings(with.1), Vector3::zeros()),
    )
}

/// Ratio of the bias of this sensor's class to the usual one: a better class has less of it.
fn class_share(settings: &Settings) -> f64 {
    settings.bias_sigma / BIAS_SIGMA
}

/// The filter's settings for a bias of the sensor's class.
fn class_settings(settings: &Settings) -> aid::Settings {
    let usual = aid::Settings::default();
    let class = usual.bias_prior * class_share(settings);
    aid::Settings {
        bias_prior: class,
        bias_class: class,
        rest_by_direction: true,
        ..usual
    }
}

/// One pass, over rates without the bias that is known.
fn pass<S: Samples>(
    samples: &mut S,
    with: (&Survey, &Settings),
    segments: &[Segment],
    (settings, known): (aid::Settings, Vector3<f64>),
) -> Result<Option<Realtime>, S::Error> {
    let propagation = propagate::Settings {
        kind: SampleKind::DeltaAngle,
        ..propagate::Settings::default()
    };
    let Ok(mut aided) = AidedPropagator::new(propagation, settings, aid::Start::Level) else {
        return Ok(None);
    };
    let mut out: Vec<AttitudeSample> = Vec::new();
    let (mut nodes, mut covariances, mut biases) = (Vec::new(), Vec::new(), Vec::new());
    let mut stamps: Vec<i64> = Vec::new();
    let mut sort = |out: &mut Vec<AttitudeSample>, stamps: &[i64]| {
        for sample in out.drain(..) {
            if stamps
                .get(nodes.len())
                .is_some_and(|stamp| *stamp <= sample.stamp.0)
            {
                nodes.push(sample.q_nb.wxyz());
                covariances.push(sample.covariance.in_navigation_axes(&sample.q_nb));
            }
        }
    };
    let mut last = None;
    by_segment(samples, with, segments, |k, held| {
        for sample in held.iter() {
            let stamp = Nanos(sample.stamp);
            let (join, start) = match last.replace(sample.stamp) {
                None => (Join::Start, sample.stamp),
                Some(_) if sample.is_after_break => (Join::Hold, sample.stamp),
                Some(before) => (Join::Continuous, before),
            };
            let secs = stamp.secs_since(Nanos(start));
            let rate = RateSample {
                stamp,
                start: Nanos(start),
                gyro: Measured::Increment(BodyRate(sample.rate - known).held_for(secs)),
                accel: Some(In::assume(sample.force)),
                join,
                status: match sample.is_saturated {
                    true => Status::SATURATED,
                    false => Status::OK,
                },
                log: stamp,
            };
            aided.push(&[rate], &mut out);
        }
        stamps.extend(held.last().map(|sample| sample.stamp));
        if k.is_none_or(|k| 2 * k >= segments.len()) {
            biases.push(aided.filter().calibration().bias);
        }
        sort(&mut out, &stamps);
    })?;
    aided.finish(&mut out);
    sort(&mut out, &stamps);
    let wanted = segments.len() + 1;
    let is_whole = nodes.len() == wanted && nodes.iter().flatten().all(|c| c.is_finite());
    let bias = median_of(&biases).filter(|bias| bias.iter().all(|b| b.is_finite()));
    Ok(bias.filter(|_| is_whole).map(|bias| Realtime {
        nodes,
        covariances,
        bias: bias + known,
        bias_sigma: aided.filter().calibration_sigma().bias,
    }))
}
