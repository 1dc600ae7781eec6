//! Each term of the chain, alone.

use super::{read, rest, sensor};
use nalgebra::{Matrix3, Vector3};
use strapd_attitude::noise::sensor_error::{
    ConstantErrors, GyroModel, ImuError, MeasureError, Truth,
};
use strapd_attitude::record::Nanos;
use strapd_attitude::record::SampleKind::{Average, DeltaAngle, Rate};

/// 100 Hz.
const STEP: i64 = 10_000_000;
const SECS: f64 = 0.01;

fn with(
    text: &str,
    change: impl Fn(&mut ConstantErrors),
    kind: strapd_attitude::record::SampleKind,
) -> GyroModel {
    let mut constants = ConstantErrors::none();
    change(&mut constants);
    GyroModel::with_constants(&ImuError::parse(text).unwrap(), constants, kind, 0).unwrap()
}

#[test]
fn without_errors_the_truth_is_read() {
    let rate = |t: f64| Vector3::new(t.cos(), 2.0, -t);
    let angle = |t: f64| Vector3::new(t.sin(), 2.0 * t, -0.5 * t * t);
    for (i, m) in read(&mut sensor("none", Rate, 0), STEP, 50, rate, angle)
        .iter()
        .enumerate()
    {
        assert!((m.gyro - rate((i + 1) as f64 * SECS)).amax() < 1e-15);
    }
    for (i, m) in read(&mut sensor("none", DeltaAngle, 0), STEP, 50, rate, angle)
        .iter()
        .enumerate()
    {
        let t = i as f64 * SECS;
        assert!((m.gyro - (angle(t + SECS) - angle(t))).amax() < 1e-15);
    }
}

#[test]
fn an_average_is_a_delta_angle_over_its_interval() {
    let text =
        "arw=0.3,bias-instability=20,rrw=60,rate-ramp=100,bandwidth-hz=30,range=100,quantization=1";
    let change = |c: &mut ConstantErrors| {
        c.sensitivity = Matrix3::new(1.01, 2e-3, 0.0, 0.0, 0.99, 1e-3, -1e-3, 0.0, 1.0);
        c.nonlinear2 = Vector3::new(1e-3, 0.0, 2e-3);
        c.bias = Vector3::new(0.01, 0.02, 0.03);
    };
    let rate = |t: f64| Vector3::new((3.0 * t).cos(), 2.0, -t);
    let angle = |t: f64| Vector3::new((3.0 * t).sin() / 3.0, 2.0 * t, -0.5 * t * t);
    let averages = read(&mut with(text, change, Average), STEP, 200, rate, angle);
    let angles = read(&mut with(text, change, DeltaAngle), STEP, 200, rate, angle);
    for (average, angle) in averages.iter().zip(&angles) {
        assert!((average.gyro * SECS - angle.gyro).amax() < 1e-17);
    }
}

#[test]
fn the_row_of_the_sensitivity_reads_and_its_column_turns() {
    let mut gyro = with("none", |c| c.sensitivity[(0, 1)] = 1e-3, Rate);
    let about_y = read(
        &mut gyro,
        STEP,
        1,
        |_| Vector3::y() * 2.0,
        |t| Vector3::y() * 2.0 * t,
    );
    assert_eq!(about_y[0].gyro, Vector3::new(2e-3, 2.0, 0.0));
    let mut gyro = with("none", |c| c.sensitivity[(2, 2)] = 1.01, Rate);
    let about_z = read(&mut gyro, STEP, 1, |_| -Vector3::z(), |t| -Vector3::z() * t);
    assert_eq!(about_z[0].gyro, Vector3::new(0.0, 0.0, -1.01));
}

#[test]
fn non_linearity_is_odd_and_its_mean_is_that_of_the_curve() {
    let change = |c: &mut ConstantErrors| {
        c.nonlinear2.x = 0.01;
        c.nonlinear3.y = 0.001;
    };
    let both = |t: f64| Vector3::new(-2.0 * t, 2.0 * t, 0.0);
    let one = read(
        &mut with("none", change, Rate),
        1_000_000_000,
        1,
        both,
        |t| both(t) * t * 0.5,
    );
    assert!((one[0].gyro - Vector3::new(-2.0 - 0.04, 2.0 + 0.008, 0.0)).amax() < 1e-15);
    // Over 0..1 s: means of (2t)^2 and (2t)^3 are 4/3 and 2.
    let mean = read(
        &mut with("none", change, Average),
        1_000_000_000,
        1,
        both,
        |t| both(t) * t * 0.5,
    );
    let expected = Vector3::new(-1.0 - 0.04 / 3.0, 1.0 + 0.002, 0.0);
    assert!((mean[0].gyro - expected).amax() < 1e-15, "{}", mean[0].gyro);
}

#[test]
fn acceleration_and_temperature_are_read_as_rate() {
    let mut gyro = with(
        "none",
        |c| {
            c.g_sensitivity[(0, 2)] = 1e-4;
            c.temperature_coefficient.y = 1e-5;
            c.accel_bias.x = 0.5;
        },
        Rate,
    );
    let truth = Truth {
        specific_force: Vector3::new(0.0, 0.0, 9.81),
        sampled_force: Vector3::new(0.0, 0.0, 9.81),
        temperature: -20.0,
        ..Truth::default()
    };
    let m = gyro.measure(Nanos(0), Nanos(STEP), &truth).unwrap();
    assert!((m.gyro - Vector3::new(9.81e-4, -2e-4, 0.0)).amax() < 1e-18);
    assert_eq!(m.specific_force, Vector3::new(0.5, 0.0, 9.81));
}

#[test]
fn the_low_pass_delays_a_ramp_by_the_group_delay_it_reports() {
    for damping in [0.3, 1.0, 1.7] {
        let text = format!("bandwidth-hz=7,damping={damping}");
        let delay = ImuError::parse(&text).unwrap().group_delay();
        // 2 zeta / omega.
        assert!((delay - damping / (std::f64::consts::PI * 7.0)).abs() < 1e-15);
        let rate = |t: f64| Vector3::new(t, 1.0 - 2.0 * t, 5.0);
        let angle = |t: f64| Vector3::new(0.5 * t * t, t - t * t, 5.0 * t);
        for kind in [Rate, Average] {
            let read = read(&mut sensor(&text, kind, 0), STEP, 300, rate, angle);
            for (i, m) in read.iter().enumerate() {
                let back = if kind == Rate { 0.0 } else { 0.5 * SECS };
                let t = (i + 1) as f64 * SECS - back;
                assert!((m.gyro - rate(t - delay)).amax() < 1e-12, "{damping} {i}");
            }
        }
    }
}

#[test]
fn the_low_pass_has_the_gain_and_phase_of_its_transfer_function() {
    let (natural, zeta, w) = (
        2.0 * std::f64::consts::PI * 20.0,
        0.6,
        2.0 * std::f64::consts::PI * 15.0,
    );
    let text = "bandwidth-hz=20,damping=0.6";
    let rate = |t: f64| Vector3::x() * (w * t).sin();
    let angle = |t: f64| Vector3::x() * (1.0 - (w * t).cos()) / w;
    // 1 kHz: a parabola an interval leaves 1e-6 of a sine of 15 Hz.
    let out = read(&mut sensor(text, Rate, 0), 1_000_000, 2000, rate, angle);
    let x = w / natural;
    let (re, im) = (1.0 - x * x, 2.0 * zeta * x);
    let (gain, phase) = (1.0 / re.hypot(im), -im.atan2(re));
    for (i, m) in out.iter().enumerate().skip(1000) {
        let t = (i + 1) as f64 * 1e-3;
        let expected = gain * (w * t + phase).sin();
        assert!(
            (m.gyro.x - expected).abs() < 2e-6,
            "{i}: {} {expected}",
            m.gyro.x
        );
    }
}

#[test]
fn saturation_clips_and_says_so() {
    let range = 100f64.to_radians();
    for (rate, clipped) in [(1.7, false), (1.8, true), (-9.0, true)] {
        let m = read(
            &mut sensor("range=100", Rate, 0),
            STEP,
            1,
            |_| Vector3::z() * rate,
            |t| Vector3::z() * rate * t,
        );
        assert_eq!(m[0].saturated, clipped, "{rate}");
        assert!((m[0].gyro.z - rate.clamp(-range, range)).abs() < 1e-15);
    }
}

#[test]
fn what_quantisation_holds_back_comes_later() {
    let rate = |t: f64| Vector3::new(0.01, -0.3 * t, 1e-5);
    let angle = |t: f64| Vector3::new(0.01 * t, -0.15 * t * t, 1e-5 * t);
    // Q = 10 arcsec.
    let step = 12f64.sqrt() * (10.0 / 3600f64).to_radians();
    for (text, step) in [
        ("quantization=10", step),
        ("lsb=0.01", 0.01f64.to_radians()),
    ] {
        let out = read(&mut sensor(text, DeltaAngle, 0), STEP, 1000, rate, angle);
        let mut sum = Vector3::zeros();
        for (i, m) in out.iter().enumerate() {
            sum += m.gyro;
            let off = sum - angle((i + 1) as f64 * SECS);
            assert!(off.amax() <= 0.500_001 * step, "{text} {i}: {off}");
            let steps = m.gyro / step;
            assert!((steps - steps.map(f64::round)).amax() < 1e-9);
        }
        assert!(
            sum.amin() > 0.0 || step > 1e-4,
            "{text}: the slow axis never moved"
        );
    }
    // A rate's step carries nothing.
    for m in read(&mut sensor("lsb=0.1", Rate, 0), STEP, 100, rate, angle) {
        let steps = m.gyro / 0.1f64.to_radians();
        assert!((steps - steps.map(f64::round)).amax() < 1e-9);
        assert_eq!(m.gyro.z, 0.0);
    }
}

#[test]
fn time_between_two_intervals_passes_for_the_drift() {
    // 3600 deg/h/h = 1 deg/h/s.
    let mut gyro = sensor("rate-ramp=3600", Rate, 0);
    let per_second = (1.0 / 3600f64).to_radians();
    let mut at = |from: f64, to: f64| {
        let nanos = |t: f64| Nanos((t * 1e9) as i64);
        gyro.measure(nanos(from), nanos(to), &Truth::default())
            .unwrap()
            .gyro
            .x
    };
    assert!((at(0.0, 0.5) - 0.5 * per_second).abs() < 1e-18);
    assert!((at(10.0, 10.5) - 10.5 * per_second).abs() < 1e-17);
}

#[test]
fn a_year_without_a_sample_is_one_step() {
    let mut gyro = sensor("consumer_mems,rrw=1", Rate, 0);
    rest(&mut gyro, STEP, 100);
    let year = 31_536_000_000_000_000;
    let m = gyro
        .measure(Nanos(year), Nanos(year + STEP), &Truth::default())
        .unwrap();
    assert!(m.gyro.iter().all(|v| v.is_finite()));
    let long = gyro
        .measure(Nanos(i64::MAX - 1), Nanos(i64::MAX), &Truth::default())
        .unwrap();
    assert!(long.gyro.iter().all(|v| v.is_finite()));
}

#[test]
fn impossible_intervals_and_motions_are_refused() {
    let mut gyro = sensor("tactical", Rate, 0);
    let truth = Truth::default();
    let refused = |r: Result<_, MeasureError>| {
        r.map(|_: strapd_attitude::noise::sensor_error::Measured| ())
            .unwrap_err()
    };
    assert!(matches!(
        refused(gyro.measure(Nanos(5), Nanos(5), &truth)),
        MeasureError::Interval { .. }
    ));
    assert!(gyro.measure(Nanos(0), Nanos(10), &truth).is_ok());
    assert!(matches!(
        refused(gyro.measure(Nanos(9), Nanos(20), &truth)),
        MeasureError::Overlap { .. }
    ));
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mut truth = Truth::default();
        truth.delta_angle.y = bad;
        assert!(matches!(
            refused(gyro.measure(Nanos(10), Nanos(20), &truth)),
            MeasureError::Truth { .. }
        ));
    }
    // A refused reading changes nothing.
    assert!(gyro.measure(Nanos(10), Nanos(20), &truth).is_ok());
    let mut constants = ConstantErrors::none();
    constants.bias.x = f64::NAN;
    assert!(GyroModel::with_constants(&ImuError::default(), constants, Rate, 0).is_err());
}

#[test]
fn the_accelerometer_has_its_own_noise() {
    // 1 ug/sqrt(Hz) over 0.01 s.
    let mut gyro = sensor("accel-noise=1", Rate, 0);
    let n = 20_000;
    let squares: f64 = read(
        &mut gyro,
        STEP,
        n,
        |_| Vector3::zeros(),
        |_| Vector3::zeros(),
    )
    .iter()
    .map(|m| m.specific_force.norm_squared() / 3.0)
    .sum();
    let sigma = (squares / n as f64).sqrt();
    assert!((sigma / (9.80665e-6 / 0.1) - 1.0).abs() < 0.02, "{sigma}");
}

#[test]
fn the_accelerometer_is_scaled_turned_clipped_and_cut_into_steps() {
    let text = "accel-range=2,accel-lsb=10";
    let mut constants = ConstantErrors::none();
    constants.accel_sensitivity[(0, 0)] = 1.01;
    constants.accel_sensitivity[(1, 0)] = 0.1;
    constants.accel_bias.y = 0.05;
    let error = ImuError::parse(text).unwrap();
    let mut gyro = GyroModel::with_constants(&error, constants, Rate, 0).unwrap();
    let mut measure = |n: i64, force: [f64; 3]| {
        let truth = Truth {
            sampled_force: Vector3::from(force),
            ..Truth::default()
        };
        gyro.measure(Nanos(n * STEP), Nanos((n + 1) * STEP), &truth)
            .unwrap()
    };
    let lsb = 0.01 * 9.80665;
    let m = measure(0, [5.0, 0.0, -9.0]);
    let steps = m.specific_force / lsb;
    assert!((steps - steps.map(f64::round)).amax() < 1e-12, "{steps}");
    // Half a step.
    let expected = Vector3::new(5.05, 0.55, -9.0);
    assert!(
        (m.specific_force - expected).amax() <= 0.5 * lsb,
        "{}",
        m.specific_force
    );
    assert!(!m.force_saturated);
    let m = measure(1, [30.0, 0.0, -100.0]);
    assert!(m.force_saturated && !m.saturated);
    assert!((m.specific_force.x - 2.0 * 9.80665).abs() < 1e-12);
    assert!((m.specific_force.z + 2.0 * 9.80665).abs() < 1e-12);
}

#[test]
fn truncation_cuts_towards_zero_and_carries_nothing() {
    let rate = |_: f64| Vector3::new(0.019, -0.019, 0.0004);
    let angle = |t: f64| Vector3::new(0.019, -0.019, 0.0004) * t;
    let step = 0.06_f64.to_radians();
    for kind in [Rate, Average] {
        for m in read(
            &mut sensor("truncation=0.06", kind, 0),
            STEP,
            100,
            rate,
            angle,
        ) {
            let expected = Vector3::new(18.0, -18.0, 0.0) * step;
            assert!((m.gyro - expected).amax() < 1e-15, "{}", m.gyro);
        }
    }
}
