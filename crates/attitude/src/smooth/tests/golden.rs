//! The figures of an independent computation, to their digits.

use super::logs::{BIAS, FORCE_BIAS, Log, Motion, errors, log, smoothed};
use crate::frames::In;
use crate::quaternion::BodyRate;
use crate::record::Nanos;
use crate::smooth::border::{self, ALL};
use crate::smooth::prepare::Preparer;
use crate::smooth::prepared::Prepared;
use crate::smooth::segments::{Cutter, find_standstill};
use crate::smooth::survey::Survey;
use crate::smooth::sweep::{Sensor, sweep};
use crate::smooth::{MotionModel, Outcome, PriorScale, Sample, Settings, Smoothed};
use nalgebra::Vector3;

/// Half of the last digit of six.
const DIGITS: f64 = 5.1e-7;

/// Settings with which the figures were made.
fn settings() -> Settings {
    Settings {
        motion: MotionModel::Independent,
        has_unresolved: false,
        iterations: 12,
        field_iterations: 16,
        // The figures have no such constant.
        looseness: PriorScale {
            sensitivity: 1e-3,
            ..PriorScale::default()
        },
        ..Settings::default()
    }
}

#[track_caller]
fn agree(ours: &[f64], theirs: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), theirs.len());
    for (a, b) in ours.iter().zip(theirs) {
        assert!((a - b).abs() <= tolerance, "{ours:?}\n{theirs:?}");
    }
}

pub(super) fn prepared(samples: &[Sample], settings: &Settings) -> (Survey, Vec<Prepared>) {
    let survey = Survey::of(&mut { samples }, settings).unwrap();
    let mut preparer = Preparer::new(&survey, settings);
    let mut out = Vec::new();
    preparer.push(samples, &mut out);
    preparer.finish(&mut out);
    (survey, out)
}

#[test]
fn the_input_is_that_of_the_figures() {
    let hand = log(Motion::Hand);
    let sample = &hand.samples[3000];
    agree(
        sample.rate.0.as_slice(),
        &[1.507064, -0.019627, 0.362298],
        DIGITS,
    );
    agree(
        sample.force.unwrap().as_vector().as_slice(),
        &[-8.533420, 3.905005, -4.989968],
        DIGITS,
    );
    agree(
        sample.field.unwrap().as_vector().as_slice(),
        &[46.211861, -19.580033, 7.506694],
        DIGITS,
    );
    agree(
        &hand.truth[6000],
        &[0.499626, 0.697964, 0.486997, 0.161412],
        DIGITS,
    );
}

#[test]
fn nodes_and_standstills_are_those_of_the_figures() {
    let (_, prepared) = prepared(&log(Motion::Hand).samples, &settings());
    let mut cutter = Cutter::new(0.5);
    prepared.iter().for_each(|sample| cutter.take(sample));
    let (mut segments, _) = cutter.finish();
    let bias = find_standstill(&mut segments).unwrap();
    assert_eq!(segments.len() + 1, 121);
    assert_eq!(
        segments.iter().filter(|segment| segment.is_still).count(),
        38
    );
    assert!(segments[0].is_still && segments[119].is_still);
    agree(bias.as_slice(), &BIAS, DIGITS);
}

#[test]
fn a_segment_is_swept_as_in_the_figures() {
    let hand = log(Motion::Hand);
    let (_, prepared) = prepared(&hand.samples, &settings());
    let mut constants = [0.0; ALL];
    constants[border::FORCE_BIAS..border::FORCE].copy_from_slice(&FORCE_BIAS);
    let sensor = Sensor::of(&constants, Vector3::zeros());
    let swept = sweep::<true>(
        &prepared[3001..=3050],
        &hand.truth[3000],
        &Vector3::from(BIAS),
        &sensor,
    );
    agree(&swept.q, &[0.196393, 0.789901, 0.392953, -0.427872], DIGITS);
    agree(&swept.velocity, &[0.425868, 0.351780, 0.447799], DIGITS);
    agree(&swept.position, &[0.065528, 0.048780, 0.117758], DIGITS);
    let turn = [
        -0.190510, -0.440226, 0.099669, 0.269949, -0.041745, -0.002951, 0.624089, -0.095572,
        -0.005201, -0.134316, 0.033633, 0.023156,
    ];
    agree(&swept.by_turn[0][..12], &turn, DIGITS);
    let velocity = [-0.771776, 0.421774, 1.024747, 1.121921, -0.119577, 0.078771];
    agree(&swept.by_velocity[0][..6], &velocity, DIGITS);
    agree(&swept.by_velocity[0][33..], &[4.572860], DIGITS);
    let position = [
        0.003122, -0.019132, -0.013812, -0.004578, 0.000402, -0.000468,
    ];
    agree(&swept.by_position[2][..6], &position, DIGITS);
    agree(&swept.field.r[0], &[0.380632, 0.879139, -0.205996], DIGITS);
    agree(
        &swept.field.rm[0][3..6],
        &[40.562006, -14.872413, 10.683593],
        DIGITS,
    );
    agree(
        &swept.field.by_time,
        &[-15.784133, 18.814924, 7.640488],
        DIGITS,
    );
    agree(
        &swept.field.by_turn[1][..3],
        &[-4.687464, -10.808099, 1.036291],
        DIGITS,
    );
}

/// Errors of tilt and heading (root mean square, largest), and one sigma of the node in the middle, deg.
#[track_caller]
fn run(log: &Log, is_plain: bool, figures: [f64; 4], sigma: [f64; 3]) -> Smoothed {
    let log = if is_plain {
        log.clone().plain()
    } else {
        log.clone()
    };
    let (smoothed, estimates) = log.smoothed(&settings());
    assert_eq!(smoothed.outcome(), Outcome::Converged);
    // What the document grants: the figures come from another order of the same sums.
    agree(&errors(&estimates, &log.truth, is_plain), &figures, 2e-4);
    let middle = smoothed.marginals[smoothed.marginals.len() / 2].turn;
    let ours = [0, 1, 2].map(|i| middle[(i, i)].sqrt().to_degrees());
    // The computation leaves out what a bias that is held is not known to.
    let secs = 0.5 * smoothed.counts().segments as f64 / 2.0;
    let held = smoothed
        .held()
        .map_or(0.0, |held| (held.sigma * secs).to_degrees());
    agree(&ours, &[sigma[0], sigma[1], sigma[2].hypot(held)], 2e-4);
    smoothed
}

#[test]
fn a_hand_without_a_field() {
    let hand = log(Motion::Hand);
    let figures = [0.035087, 0.117582, 0.080223, 0.227843];
    let smoothed = run(&hand, true, figures, [0.103723, 0.109304, 0.300335]);
    let gyro = smoothed.calibration().gyro.value.map(|g| 100.0 * g);
    let theirs = [
        0.230282, 0.084216, -0.018331, 0.025764, 0.239749, 0.055072, -0.044005, 0.006068, 0.223125,
    ];
    agree(&gyro, &theirs, 2e-6);
    agree(
        &smoothed.calibration().force_bias.value,
        &[0.026773, -0.020342, 0.036440],
        2e-6,
    );
    let bias = smoothed
        .biases()
        .nth(60)
        .unwrap()
        .value
        .map(f64::to_degrees);
    agree(bias.as_slice(), &[0.572598, -0.458704, 0.287044], 2e-6);
    agree(&smoothed.bound(), &[0.7553, 0.3084], 1e-4);
}

#[test]
fn a_hand_with_a_field() {
    let hand = log(Motion::Hand);
    let figures = [0.035079, 1.464483, 0.081966, 1.579803];
    let smoothed = run(&hand, false, figures, [0.103716, 0.109198, 3.677329]);
    let magnetometer = smoothed.calibration().magnetometer.unwrap();
    agree(
        &magnetometer.hard_iron.value,
        &[1.526289, -1.239031, 0.395091],
        2e-6,
    );
    agree(&magnetometer.north_up.value, &[18.269879, -44.966570], 2e-6);
    let (_, estimates) = hand.smoothed(&settings());
    agree(
        &estimates[3000].q_nb.wxyz(),
        &[0.448996, 0.688387, 0.524520, -0.222272],
        2e-6,
    );
}

#[test]
fn at_rest() {
    let still = log(Motion::Still);
    run(
        &still,
        true,
        [0.209728, 0.000387, 0.209728, 0.000518],
        [0.241083, 0.241083, 0.093341],
    );
    run(
        &still,
        false,
        [0.209728, 7.197980, 0.209728, 7.197980],
        [0.241044, 0.241049, 3.656758],
    );
}

#[test]
fn on_a_turntable() {
    let turn = log(Motion::Turn);
    run(
        &turn,
        true,
        [0.087003, 2.252091, 0.088165, 3.429665],
        [0.115751, 0.115751, 3.528963],
    );
    run(
        &turn,
        false,
        [0.079497, 1.288169, 0.080357, 1.541744],
        [0.115652, 0.113125, 0.646267],
    );
}

#[test]
fn in_a_car() {
    let car = log(Motion::Car);
    let plain = run(
        &car,
        true,
        [0.213270, 0.035940, 0.257985, 0.092506],
        [0.231248, 0.230568, 0.372786],
    );
    agree(&plain.bound(), &[24.9067, 771.4248], 1e-2);
    run(
        &car,
        false,
        [0.208243, 5.352534, 0.253090, 5.435657],
        [0.230497, 0.230093, 3.068505],
    );
}

/// Rates on a grid, and what they were before.
fn gridded(on_grid: fn(f64) -> f64) -> (Vec<Sample>, Vec<Vector3<f64>>) {
    let step = (2000.0_f64 / 32768.0).to_radians();
    let rates: Vec<Vector3<f64>> = (0..20000)
        .map(|i| {
            let t = f64::from(i) / 200.0;
            let rate = Vector3::new(
                2.0 * (0.9 * t).sin(),
                1.5 * (1.3 * t + 1.0).sin(),
                (0.5 * t + 2.0).sin(),
            );
            rate.add_scalar(0.002)
        })
        .collect();
    let sample = |(i, rate): (i64, &Vector3<f64>)| Sample {
        stamp: Nanos(i * 5_000_000),
        rate: BodyRate(rate.map(|w| on_grid(w / step) * step)),
        force: Some(In::assume(Vector3::z() * 9.81)),
        field: None,
        is_saturated: false,
    };
    ((0..).zip(&rates).map(sample).collect(), rates)
}

#[test]
fn truncation_is_found_and_undone() {
    let cuts: [fn(f64) -> f64; 3] = [f64::trunc, f64::round, f64::floor];
    let figures = [(1.820225, 116), (0.866667, 103), (0.681818, 98)];
    for (i, (on_grid, (ratio, counted))) in cuts.into_iter().zip(figures).enumerate() {
        let (samples, rates) = gridded(on_grid);
        let (survey, prepared) = prepared(&samples, &Settings::default());
        let found = survey.quantisation.unwrap();
        agree(&[found.step.to_degrees()], &[0.06103516], 5e-9);
        agree(&[found.zero_bin], &[ratio], DIGITS);
        assert_eq!(found.counted, counted);
        assert_eq!(found.is_undone, i == 0);
        let mean = |of: &dyn Fn(usize) -> Vector3<f64>| {
            let sum: Vector3<f64> = (0..rates.len()).map(|k| of(k) - rates[k]).sum();
            (sum / rates.len() as f64).map(f64::to_degrees)
        };
        let (before, after) = (mean(&|k| samples[k].rate.0), mean(&|k| prepared[k].rate));
        if i == 0 {
            agree(before.as_slice(), &[-0.000581, -0.000170, 0.000087], DIGITS);
            agree(after.as_slice(), &[0.000127, -0.000153, -0.000035], DIGITS);
        } else {
            assert_eq!(before, after);
        }
    }
}

#[test]
fn a_hole_is_filled_by_a_cubic() {
    let stamps = (0..8).chain(12..20);
    let samples: Vec<Sample> = stamps
        .map(|i| {
            let t = f64::from(i) * 0.01;
            Sample {
                stamp: Nanos(i64::from(i) * 10_000_000),
                rate: BodyRate(Vector3::new((9.0 * t).sin(), (7.0 * t).cos(), t * t)),
                force: Some(In::assume(Vector3::z() * 9.81)),
                field: None,
                is_saturated: false,
            }
        })
        .collect();
    let (_, prepared) = prepared(&samples, &Settings::default());
    assert_eq!(prepared.len(), 20);
    agree(
        prepared[8].rate.as_slice(),
        &[0.666842, 0.853943, 0.006080],
        DIGITS,
    );
    agree(
        prepared[11].rate.as_slice(),
        &[0.846878, 0.723083, 0.011780],
        DIGITS,
    );
    assert_eq!(prepared[8].stamp, 80_000_000);
    assert!(!prepared[8].is_input && prepared[12].is_input && prepared[12].doubt[0] > 0.0);
    let _ = smoothed(&samples, &Settings::default());
}
