//! Analytic motions: attitude, rate and delta angle belong together, shown by integrators that
//! share nothing with the library (extrapolated midpoint rule, Romberg's quadrature).
// Prints what it measured, for `--nocapture`.

use nalgebra::{Matrix3, Vector3};
use strapd_attitude::quaternion::Quaternion;
use strapd_bodies::motion::*;
use strapd_bodies::rigid_body::{HeavyBody, Rotor, Spin};
use strapd_bodies::top::{Case, SymmetricTop};

type Q = [f64; 4];

fn derivative(q: &Q, w: &Vector3<f64>) -> Q {
    let [a, b, c, d] = *q;
    [
        -0.5 * (b * w.x + c * w.y + d * w.z),
        0.5 * (a * w.x + c * w.z - d * w.y),
        0.5 * (a * w.y + d * w.x - b * w.z),
        0.5 * (a * w.z + b * w.y - c * w.x),
    ]
}

fn distance(a: &Q, b: &Q) -> f64 {
    let d = |s: f64| {
        a.iter()
            .zip(b)
            .map(|(x, y)| (x - s * y).powi(2))
            .sum::<f64>()
    };
    // Chord of the sphere of quaternions, doubled into an angle of rotation.
    2.0 * d(1.0).min(d(-1.0)).sqrt()
}

/// One step of Gragg, Bulirsch and Stoer over 9.6 ms: the modified midpoint rule with 2 to 16
/// substeps, all whole nanoseconds, extrapolated to none. Order 14.
const STEP: u64 = 9_600_000;
fn gragg_bulirsch_stoer(q: &Q, from: u64, rate: &mut dyn FnMut(u64) -> Vector3<f64>) -> Q {
    let counts = [2_u64, 4, 6, 8, 10, 12, 16];
    let plus = |a: &Q, b: &Q, s: f64| std::array::from_fn::<f64, 4, _>(|i| a[i] + s * b[i]);
    let mut table: Vec<Q> = Vec::new();
    for (row, n) in counts.into_iter().enumerate() {
        let h = STEP / n;
        assert_eq!(h * n, STEP);
        let secs = h as f64 * 1e-9;
        // Only the change is integrated, so that roundings are of its size and not of 1.
        let mut slope = |x: &Q, k: u64| derivative(&plus(q, x, 1.0), &rate(from + k * h));
        let mut before = [0.0; 4];
        let mut now = plus(&before, &slope(&before, 0), secs);
        for k in 1..n {
            let next = plus(&before, &slope(&now, k), 2.0 * secs);
            (before, now) = (now, next);
        }
        let last = slope(&now, n);
        let mut column: Q = std::array::from_fn(|i| 0.5 * (now[i] + before[i] + secs * last[i]));
        // Aitken-Neville in h^2; table holds the previous row.
        let mut new_row = vec![column];
        for k in 1..=row {
            let ratio = (n as f64 / counts[row - k] as f64).powi(2);
            column =
                std::array::from_fn(|i| column[i] + (column[i] - table[k - 1][i]) / (ratio - 1.0));
            new_row.push(column);
        }
        table = new_row;
    }
    let q = plus(q, table.last().unwrap(), 1.0);
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / norm)
}

/// Romberg's quadrature of the rate over one step.
fn romberg(from: u64, rate: &mut dyn FnMut(u64) -> Vector3<f64>) -> Vector3<f64> {
    let span = STEP as f64 * 1e-9;
    let mut row = vec![0.5 * span * (rate(from) + rate(from + STEP))];
    for level in 1..7_u32 {
        let n = 1_u64 << level;
        let h = STEP / n;
        let odd: Vector3<f64> = (1..n).step_by(2).map(|k| rate(from + k * h)).sum();
        let mut new = vec![0.5 * row[0] + odd * (h as f64 * 1e-9)];
        for k in 1..=level as usize {
            let r = 4_f64.powi(k as i32);
            let better = new[k - 1] + (new[k - 1] - row[k - 1]) / (r - 1.0);
            new.push(better);
        }
        row = new;
    }
    *row.last().unwrap()
}

/// Attitude by integration of the rates, delta angles by quadrature, over `steps` of 9.6 ms;
/// returns the worst attitude error in rad (with one rounding a step in it) and the worst delta
/// angle error.
fn consistency(motion: &mut Motion, steps: u64) -> (f64, f64) {
    let mut q = motion.at_nanos(0).q_nb.wxyz();
    let (mut worst_q, mut worst_d) = (0.0_f64, 0.0_f64);
    for n in 0..steps {
        let from = n * STEP;
        let mut rate = |t: u64| motion.at_nanos(t).w_nb_b;
        q = gragg_bulirsch_stoer(&q, from, &mut rate);
        let by_quadrature = romberg(from, &mut rate);
        let exact = motion.delta_angle(from, from + STEP);
        worst_d = worst_d.max((exact - by_quadrature).amax());
        worst_q = worst_q.max(distance(&q, &motion.at_nanos(from + STEP).q_nb.wxyz()));
    }
    println!("{worst_q:e} rad, {worst_d:e} rad");
    (worst_q, worst_d)
}

fn attitude() -> Quaternion<strapd_attitude::frames::Nav, strapd_attitude::frames::Body> {
    Quaternion::assume_unit([0.5, -0.5, 0.1, 0.7])
}

fn free(moments: [f64; 3], w: [f64; 3]) -> FreeBody {
    FreeBody::new(
        moments,
        Spin {
            q_nb: attitude(),
            w_nb_b: Vector3::from(w),
        },
    )
    .unwrap()
}

fn the_same_by_power_series(moments: [f64; 3], w: [f64; 3]) -> HeavyBody {
    HeavyBody::new(
        Rotor::new(Matrix3::from_diagonal(&Vector3::from(moments))).unwrap(),
        Vector3::zeros(),
        Vector3::zeros(),
        Spin {
            q_nb: attitude(),
            w_nb_b: Vector3::from(w),
        },
    )
    .unwrap()
}

/// Bodies that run round their largest and smallest axes, both ways, with every order of axes.
fn free_bodies() -> Vec<([f64; 3], [f64; 3])> {
    let mut all = Vec::new();
    for moments in [
        [1.0, 2.0, 3.0],
        [3.0, 1.0, 2.0],
        [2.0, 3.0, 1.0],
        [1.0, 3.0, 2.0],
        [3.0, 2.0, 1.0],
        [2.0, 1.0, 3.0],
        [1.0, 1.0, 2.0],
        [1.0, 2.0, 2.0],
    ] {
        for w in [
            [0.3, -0.5, 4.0],
            [5.0, 0.7, -0.3],
            [-0.4, 3.0, 0.2],
            [-2.0, 0.0, -2.5],
            [0.0, 1.0, -3.0],
        ] {
            all.push((moments, w));
        }
    }
    all
}

#[test]
fn a_constant_rate_is_consistent() {
    let motion = ConstantRate::new(attitude(), Vector3::new(1.0, -7.0, 3.0)).unwrap();
    let (q, d) = consistency(&mut Motion::ConstantRate(motion), 625);
    // 625 roundings of a unit quaternion and of its norm, 1e-16 each, some of them always the same way.
    assert!(q < 3e-14, "{q:e}");
    // A few roundings of 0.07 rad.
    assert!(d < 1e-16, "{d:e}");
}

#[test]
fn coning_is_consistent() {
    for (angle, hz) in [(10.0_f64, 3.0), (1.0, 10.0), (90.0, 2.0)] {
        let motion = Coning::new(angle.to_radians(), hz).unwrap();
        let (q, d) = consistency(&mut Motion::Coning(motion), 625);
        // As above; order 14 of 0.6 rad a step leaves less than that.
        assert!(q < 3e-14, "{angle} {hz} {q:e}");
        assert!(d < 3e-16, "{angle} {hz} {d:e}");
    }
}

#[test]
fn coning_is_the_formula_of_the_golden_file() {
    // q = [cos(a/2), 0, sin(a/2) cos Wt, sin(a/2) sin Wt] at a quarter period.
    let motion = Coning::new(10_f64.to_radians(), 2.5).unwrap();
    let spin = motion.at_nanos(100_000_000);
    let (s, c) = 5_f64.to_radians().sin_cos();
    for (ours, expected) in spin.q_nb.wxyz().iter().zip([c, 0.0, 0.0, s]) {
        assert!((ours - expected).abs() < 2e-16);
    }
    let w = 2.5 * std::f64::consts::TAU;
    let expected = Vector3::new(-2.0 * w * s * s, -w * 10_f64.to_radians().sin(), 0.0);
    // Roundings of 2.7 rad/s.
    assert!((spin.w_nb_b - expected).amax() < 2e-15);
}

#[test]
fn random_sines_are_consistent() {
    let motion = BandLimited::random(7, 2.0, 10.0, 40).unwrap();
    let (q, d) = consistency(&mut Motion::BandLimited(Box::new(motion)), 625);
    // As for the constant rate, with rates up to 10 rad/s.
    assert!(q < 3e-14, "{q:e}");
    // Forty sines of 0.45 rad/s.
    assert!(d < 3e-16, "{d:e}");
}

#[test]
fn random_sines_are_the_same_everywhere_and_as_strong_as_asked() {
    let rms = |seed| {
        let mut m = BandLimited::random(seed, 2.0, 20.0, 40).unwrap();
        let mut sum = Vector3::zeros();
        let n = 5000;
        for k in 0..n {
            let w = m.at_nanos(k * 20_000_000).w_nb_b;
            sum += w.component_mul(&w);
        }
        (sum / n as f64).map(f64::sqrt)
    };
    // 100 s of 40 sines: beats below 0.01 Hz leave a few per cent.
    for seed in [1, 2] {
        assert!(
            (rms(seed) - Vector3::repeat(2.0)).amax() < 0.2,
            "{:?}",
            rms(seed)
        );
    }
    // The published first outputs of SplitMix64 from seed 1234567, to which nothing platform-dependent
    // is added but a sine.
    let unit = |n: u64| (n >> 11) as f64 / 2_f64.powi(53);
    let frequency = unit(6_457_827_717_110_365_317);
    let phase = std::f64::consts::TAU * unit(3_203_168_211_198_807_973);
    let mut m = BandLimited::random(1_234_567, 1.0, 1.0, 1).unwrap();
    let w = m.at_nanos(1_000_000_000).w_nb_b;
    let expected = 2_f64.sqrt() * (std::f64::consts::TAU * frequency + phase).sin();
    // Roundings of a phase of a few rad.
    assert!((w.x - expected).abs() < 5e-15, "{} {expected}", w.x);
}

#[test]
fn the_free_body_is_consistent() {
    for (moments, w) in free_bodies() {
        let (q, d) = consistency(&mut Motion::FreeBody(Box::new(free(moments, w))), 200);
        // As for the constant rate, fewer steps.
        assert!(q < 2e-14, "{moments:?} {w:?} {q:e}");
        // Antiderivatives up to a few rad at 1e-16.
        assert!(d < 1e-14, "{moments:?} {w:?} {d:e}");
    }
}

#[test]
fn the_free_body_in_closed_form_is_the_free_body_by_power_series_over_a_minute() {
    let mut worst = (0.0_f64, 0.0_f64, 0.0_f64);
    for (moments, w) in free_bodies() {
        let closed = free(moments, w);
        let mut series = the_same_by_power_series(moments, w);
        for k in 0..=600_u64 {
            let t = k * 100_000_000;
            let (a, b) = (closed.at_nanos(t), series.at_nanos(t));
            let next = t + 5_000_000;
            let delta = closed.delta_angle(t, next) - series.delta_angle(t, next);
            worst.0 = worst.0.max(distance(&a.q_nb.wxyz(), &b.q_nb.wxyz()));
            worst.1 = worst.1.max((a.w_nb_b - b.w_nb_b).amax());
            worst.2 = worst.2.max(delta.amax());
        }
    }
    println!("free body, closed form against series, 60 s: {worst:?}");
    // What grows with time is kept in 32 digits; the argument's rounding at a few rad/s remains.
    assert!(worst.0 < 1e-13, "{worst:?}");
    assert!(worst.1 < 3e-14, "{worst:?}");
    // Differences of antiderivatives of up to 5 rad, whose arguments carry a rounding of their own.
    assert!(worst.2 < 3e-14, "{worst:?}");
}

#[test]
fn a_free_body_keeps_its_momentum_and_its_energy() {
    let moments = [1.0, 2.0, 3.0];
    let closed = free(moments, [0.3, -4.0, 0.8]);
    let rotor = Rotor::new(Matrix3::from_diagonal(&Vector3::from(moments))).unwrap();
    let start = closed.at_nanos(0);
    let l = rotor.angular_momentum_n(&start);
    for k in 0..1000_u64 {
        let spin = closed.at_nanos(k * 59_999_999);
        let dl = (rotor.angular_momentum_n(&spin) - l).norm() / l.norm();
        let de = rotor.kinetic_energy(&spin.w_nb_b) / rotor.kinetic_energy(&start.w_nb_b) - 1.0;
        // A few roundings: momentum is built in, energy is cn, sn, dn.
        assert!(dl < 3e-15 && de.abs() < 3e-15, "{k} {dl:e} {de:e}");
    }
}

#[test]
fn a_rotation_about_a_principal_axis_stays_there() {
    for w in [[2.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 2.0], [0.0; 3]] {
        let closed = free([1.0, 2.0, 3.0], w);
        let q = closed.at_nanos(1_000_000_000);
        assert_eq!(q.w_nb_b, Vector3::from(w));
        let mut constant = Motion::ConstantRate(ConstantRate::new(attitude(), q.w_nb_b).unwrap());
        let other = constant.at_nanos(1_000_000_000);
        assert!(distance(&q.q_nb.wxyz(), &other.q_nb.wxyz()) < 1e-15);
    }
    let sphere = free([2.0; 3], [1.0, 2.0, 3.0]);
    assert_eq!(
        sphere.at_nanos(5_000_000_000).w_nb_b,
        Vector3::new(1.0, 2.0, 3.0)
    );
}

#[test]
fn a_wobble_too_small_to_square_is_still_a_number() {
    for w in [
        [1e-155, 0.0, 1.0],
        [1e-200, 1e-300, 2.0],
        [2.0, 1e-160, 1e-160],
        [1e-9, 1e-310, -3.0],
    ] {
        let closed = free([1.0, 2.0, 3.0], w);
        let mut series = the_same_by_power_series([1.0, 2.0, 3.0], w);
        let t = 7_000_000_000;
        let (a, b) = (closed.at_nanos(t), series.at_nanos(t));
        // Roundings of 20 rad reduced in 32 digits.
        assert!(distance(&a.q_nb.wxyz(), &b.q_nb.wxyz()) < 1e-14, "{w:?}");
        let delta = closed.delta_angle(0, t) - series.delta_angle(0, t);
        assert!(delta.amax() < 1e-14, "{w:?} {delta:?}");
    }
}

#[test]
fn the_separatrix_is_refused_not_guessed() {
    // I1 (I1 - I2) w1^2 + I3 (I3 - I2) w3^2 = -0.5625 + 0.5625, exactly.
    let start = Spin {
        q_nb: attitude(),
        w_nb_b: Vector3::new(0.75, 0.4, 1.0),
    };
    assert!(FreeBody::new([1.0, 2.0, 2.25], start).is_err());
    // The intermediate axis alone is a rotation for good.
    let alone = Spin {
        w_nb_b: Vector3::new(0.0, 0.4, 0.0),
        ..start
    };
    assert!(FreeBody::new([1.0, 2.0, 2.25], alone).is_ok());
}

#[test]
fn the_top_is_consistent() {
    let top = SymmetricTop::published();
    let start = Case::Cusped
        .start(&top, Case::SEED_TILT, Case::SEED_W3)
        .unwrap();
    let exact = top.exact(&start).unwrap();
    let (q, d) = consistency(&mut Motion::HeavyBody(Box::new(exact)), 125);
    // 1.2 rad a step: the truncation of order 14 is about 1e-15 of that, 125 times.
    assert!(q < 3e-13, "{q:e}");
    // Romberg's seven rows on 1.2 rad.
    assert!(d < 1e-14, "{d:e}");
}

#[test]
fn the_answer_does_not_depend_on_what_was_asked_before() {
    let bodies: [fn() -> Motion; 2] = [
        || {
            let top = SymmetricTop::published();
            let start = Case::Looping
                .start(&top, Case::SEED_TILT, Case::SEED_W3)
                .unwrap();
            Motion::HeavyBody(Box::new(top.exact(&start).unwrap()))
        },
        || Motion::BandLimited(Box::new(BandLimited::random(3, 2.0, 20.0, 10).unwrap())),
    ];
    for make in bodies {
        let (mut a, mut b) = (make(), make());
        let times: Vec<u64> = (0..200).map(|k| k * 7_654_321).collect();
        let forward: Vec<Spin> = times.iter().map(|t| a.at_nanos(*t)).collect();
        for (t, expected) in times.iter().zip(&forward).rev() {
            assert_eq!(b.at_nanos(*t), *expected);
        }
    }
}

#[test]
fn impossible_motions_are_refused() {
    let bad = [f64::NAN, f64::INFINITY, 1e300];
    for x in bad {
        assert!(ConstantRate::new(attitude(), Vector3::new(0.0, x, 0.0)).is_err());
        assert!(Coning::new(x, 1.0).is_err());
        assert!(Coning::new(0.1, x).is_err());
        assert!(BandLimited::random(1, x, 1.0, 3).is_err());
        assert!(BandLimited::random(1, 1.0, x, 3).is_err());
        let spin = Spin {
            q_nb: attitude(),
            w_nb_b: Vector3::new(x, 0.0, 0.0),
        };
        assert!(FreeBody::new([1.0, 2.0, 3.0], spin).is_err());
        assert!(
            FreeBody::new(
                [x, 2.0, 3.0],
                Spin {
                    w_nb_b: Vector3::x(),
                    ..spin
                }
            )
            .is_err()
        );
    }
    assert!(BandLimited::random(1, 1.0, 1.0, 1_000_000).is_err());
    assert!(
        FreeBody::new(
            [0.0, 2.0, 3.0],
            Spin {
                q_nb: attitude(),
                w_nb_b: Vector3::x()
            }
        )
        .is_err()
    );
}
