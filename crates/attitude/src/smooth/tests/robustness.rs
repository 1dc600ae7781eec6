//! Threads, chunks, breaks, no standstill, large biases: what the result must not depend on or break at.

use super::logs::{Log, Motion, conjugate, errors, log, product};
use super::planar::inside;
use crate::frames::In;
use crate::smooth::{Estimate, Outcome, Sample, SampleModel, Samples, Settings, Smoothed, smooth};
use nalgebra::Vector3;
use std::convert::Infallible;
use std::num::NonZero;

fn bits(smoothed: &Smoothed, estimates: &[Estimate]) -> Vec<u64> {
    let of = |e: &Estimate| {
        e.q_nb
            .wxyz()
            .into_iter()
            .chain(e.covariance.iter().copied())
            .collect::<Vec<f64>>()
    };
    let calibration = smoothed.calibration();
    let numbers = estimates
        .iter()
        .flat_map(of)
        .chain(calibration.gyro.value)
        .chain(calibration.gyro.sigma);
    numbers.map(f64::to_bits).collect()
}

#[test]
fn bits_do_not_depend_on_threads() {
    let hand = log(Motion::Hand);
    let run = |threads: usize| {
        let settings = Settings {
            threads: NonZero::new(threads).unwrap(),
            ..Settings::default()
        };
        let (smoothed, estimates) = hand.smoothed(&settings);
        bits(&smoothed, &estimates)
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(4));
}

/// Samples that come in chunks of a given size.
struct Chunked<'a>(&'a [Sample], usize);

impl Samples for Chunked<'_> {
    type Error = Infallible;

    fn pass(&mut self, take: &mut dyn FnMut(&[Sample])) -> Result<(), Infallible> {
        self.0.chunks(self.1).for_each(take);
        Ok(())
    }
}

#[test]
fn bits_do_not_depend_on_chunks() {
    let mut hand = log(Motion::Hand);
    hand.samples.drain(3000..3003);
    hand.samples.drain(3500..3600);
    for sample_model in [SampleModel::Interval, SampleModel::Instant] {
        let settings = Settings {
            sample_model,
            ..Settings::default()
        };
        let run = |chunk: usize| {
            let mut samples = Chunked(&hand.samples, chunk);
            let smoothed = smooth(&mut samples, &settings).unwrap();
            let mut out = Vec::new();
            smoothed
                .attitudes(&mut samples, |chunk| out.extend_from_slice(chunk))
                .unwrap();
            bits(&smoothed, &out)
        };
        let whole = run(1 << 20);
        assert_eq!(whole, run(1));
        assert_eq!(whole, run(777));
    }
}

/// The moving middle of the hand, with this much more bias (rad/s).
fn restless(bias: Vector3<f64>) -> Log {
    let mut hand = log(Motion::Hand);
    hand.samples = hand.samples[1800..4200].to_vec();
    hand.truth = hand.truth[1800..4200].to_vec();
    hand.samples
        .iter_mut()
        .for_each(|sample| sample.rate.0 += bias);
    hand
}

#[test]
fn without_a_standstill_a_bias_of_5_deg_per_s_is_found() {
    for corner in 0..8 {
        let sign = |axis: i32| if corner >> axis & 1 == 0 { 5.0 } else { -5.0 };
        let bias = Vector3::new(sign(0), sign(1), sign(2)).map(f64::to_radians);
        for is_plain in [true, false] {
            let hand = restless(bias);
            let hand = if is_plain { hand.plain() } else { hand };
            let (smoothed, estimates) = hand.smoothed(&Settings::default());
            assert_eq!(smoothed.counts().standstills, 0);
            let [tilt, heading, tilt_most, _] = errors(&estimates, &hand.truth, is_plain);
            // Half a minute of motion, in which the bias alone would turn by 200 degrees.
            assert!(
                tilt < 1.0 && tilt_most < 3.0,
                "tilt {tilt} {tilt_most} {:?}",
                smoothed.outcome()
            );
            assert!(heading < 8.0, "heading {heading} {:?}", smoothed.outcome());
        }
    }
}

#[test]
fn a_break_begins_a_section_whose_heading_is_unknown_without_a_field() {
    let mut hand = log(Motion::Hand);
    hand.samples.drain(3000..3300);
    hand.truth.drain(3000..3300);
    let (with_field, estimates) = hand.smoothed(&Settings::default());
    assert_eq!(with_field.counts().breaks, 1);
    assert_eq!(with_field.sections().len(), 2);
    assert!(
        with_field
            .sections()
            .iter()
            .all(|section| section.has_north)
    );
    let [tilt, _, _, heading_most] = errors(&estimates, &hand.truth, false);
    assert!(tilt < 0.2 && heading_most < 4.0, "{tilt} {heading_most}");
    assert_eq!((estimates[2999].section, estimates[3000].section), (0, 1));

    let hand = hand.plain();
    let (_, estimates) = hand.smoothed(&Settings::default());
    let sigma = |i: usize| estimates[i].covariance[(2, 2)].sqrt().to_degrees();
    assert!(
        sigma(2999) < 3.0 && sigma(3000) > 100.0,
        "{} {}",
        sigma(2999),
        sigma(3000)
    );
    let (first, second) = hand.truth.split_at(3000);
    for (estimates, truth) in [(&estimates[..3000], first), (&estimates[3000..], second)] {
        let [tilt, heading, ..] = errors(estimates, truth, true);
        assert!(tilt < 0.2 && heading < 0.5, "{tilt} {heading}");
    }
}

#[test]
fn short_holes_cost_little() {
    let whole = log(Motion::Hand).plain();
    let mut holed = whole.clone();
    let mut i = 0;
    let is_kept = |i: usize| i % 200 >= 3;
    holed.samples.retain(|_| {
        i += 1;
        is_kept(i - 1)
    });
    holed.truth = whole
        .truth
        .iter()
        .enumerate()
        .filter(|(i, _)| is_kept(*i))
        .map(|(_, q)| *q)
        .collect();
    let (smoothed, estimates) = holed.smoothed(&Settings::default());
    assert_eq!(smoothed.counts().bridged, 29);
    let [tilt, heading, ..] = errors(&estimates, &holed.truth, true);
    let (_, estimates) = whole.smoothed(&Settings::default());
    let [tilt_whole, heading_whole, ..] = errors(&estimates, &whole.truth, true);
    // 40 ms at 2 rad/s: the cubic is off by hundredths of a degree each.
    assert!(
        tilt < tilt_whole + 0.05 && heading < heading_whole + 0.2,
        "{tilt} {heading} {heading_whole}"
    );
}

/// One in `every` samples of a 100 Hz log whose rates are instantaneous.
#[test]
fn instantaneous_rates_far_apart_want_their_model() {
    let hand = log(Motion::Hand).plain();
    let every = |log: &Log| Log {
        samples: log.samples.iter().step_by(5).copied().collect(),
        truth: log.truth.iter().step_by(5).copied().collect(),
    };
    let slow = every(&hand);
    let error = |sample_model: SampleModel| {
        let settings = Settings {
            sample_model,
            ..Settings::default()
        };
        let (smoothed, estimates) = slow.smoothed(&settings);
        assert_eq!(estimates.len(), slow.samples.len());
        let [tilt, heading, ..] = errors(&estimates, &slow.truth, true);
        (tilt.hypot(heading), smoothed.outcome())
    };
    let (interval, _) = error(SampleModel::Interval);
    let (instant, outcome) = error(SampleModel::Instant);
    assert_eq!(outcome, Outcome::Converged);
    // The truth takes each rate for the mean of the 10 ms before it: 5 ms are left of 25.
    assert!(instant < 0.5 * interval, "{instant} {interval}");
}

#[test]
fn a_delay_turns_attitudes_on() {
    let hand = log(Motion::Hand).plain();
    let (_, now) = hand.smoothed(&Settings::default());
    let (_, later) = hand.smoothed(&Settings {
        sensor_delay: 0.01,
        ..Settings::default()
    });
    let turn = product(&conjugate(&now[3000].q_nb.wxyz()), &later[3000].q_nb.wxyz());
    for (i, rate) in now[3000].rate.iter().enumerate() {
        assert!((2.0 * turn[i + 1] - 0.01 * rate).abs() < 1e-6);
    }
}

#[test]
fn variances_are_those_of_the_equations_of_the_case_and_of_the_clock() {
    for (is_plain, heading) in [(true, 4.0), (false, 1.0)] {
        let hand = log(Motion::Hand);
        let hand = if is_plain { hand.plain() } else { hand };
        let (smoothed, estimates) = hand.smoothed(&Settings::default());
        for node in [10, 60, 110] {
            let (estimate, known) = (&estimates[50 * node], smoothed.marginals[node].turn);
            let rest = 0.2_f64.to_radians().powi(2) + (0.0025 * estimate.rate.norm()).powi(2);
            for (axis, times) in [(0, 1.0), (1, 1.0), (2, heading)] {
                let expected = times * known[(axis, axis)] + rest;
                assert!((estimate.covariance[(axis, axis)] / expected - 1.0).abs() < 1e-9);
            }
        }
        for (estimate, truth) in estimates.iter().zip(&hand.truth) {
            let error = product(&estimate.q_nb.wxyz(), &conjugate(truth));
            for axis in 0..2 {
                let sigma = estimate.covariance[(axis, axis)].sqrt();
                assert!((2.0 * error[axis + 1]).abs() < 3.0 * sigma);
            }
        }
    }
}

/// A tap rings in the case for a few milliseconds, of which samples 10 ms apart see one or none, and it is no motion.
#[test]
fn taps_are_taken_for_what_they_are() {
    let mut log = log(Motion::Hand).plain();
    for i in (1500..4500).step_by(75) {
        if let Some(force) = &mut log.samples[i].force {
            let ringing = Vector3::new(60.0, -40.0, 30.0);
            *force = In::assume(force.as_vector() + ringing);
        }
    }
    let error = |has_unresolved: bool| {
        let settings = Settings {
            has_unresolved,
            ..Settings::default()
        };
        let (_, estimates) = log.smoothed(&settings);
        let [tilt, ..] = errors(&estimates, &log.truth, true);
        let inside = estimates
            .iter()
            .zip(&log.truth)
            .filter(|(estimate, truth)| {
                let error = product(&estimate.q_nb.wxyz(), &conjugate(truth));
                let is_in = |axis: usize| {
                    let sigma = estimate.covariance[(axis, axis)].sqrt();
                    (2.0 * error[axis + 1]).abs() < 3.0 * sigma
                };
                is_in(0) && is_in(1)
            });
        (tilt, inside.count() as f64 / estimates.len() as f64)
    };
    let (without, _) = error(false);
    let (tilt, inside) = error(true);
    assert!(
        tilt < 0.5 * without && inside > 0.98,
        "{tilt} {inside} {without}"
    );
}

#[test]
fn a_clipped_gyro_is_doubted_about_its_own_axis() {
    let mut hand = log(Motion::Hand).plain();
    let rates = || hand.samples.iter().map(|sample| sample.rate.0.z.abs());
    let range = 0.6 * rates().fold(0.0, f64::max);
    let mut clipped = 0;
    for sample in &mut hand.samples {
        sample.is_saturated = sample.rate.0.z.abs() >= range;
        clipped += usize::from(sample.is_saturated);
        sample.rate.0.z = sample.rate.0.z.clamp(-range, range);
    }
    assert!(clipped > 100, "{clipped}");
    let (_, flagged) = hand.smoothed(&Settings::default());
    let of_flagged = errors(&flagged, &hand.truth, true);
    let within = inside(&flagged, &hand.truth);
    for sample in &mut hand.samples {
        sample.is_saturated = false;
    }
    let (_, quiet) = hand.smoothed(&Settings::default());
    let of_quiet = errors(&quiet, &hand.truth, true);
    assert!(within > 0.97, "{within}");
    assert!(inside(&quiet, &hand.truth) < 0.7, "{of_quiet:?}");
    assert!(
        of_flagged[0] < 0.5 * of_quiet[0],
        "{of_flagged:?} {of_quiet:?}"
    );
}
