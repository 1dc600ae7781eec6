//! Sensors that are carried: attitude, rate, acceleration and mean force belong together, shown by
//! differences and quadratures that share nothing with the library.
// Prints what it measured, for `--nocapture`.

use nalgebra::{Matrix3, Vector3};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;
use strapd_bodies::motion::*;
use strapd_bodies::rigid_body::Spin;
use strapd_bodies::top::{Case, SymmetricTop};

const G: f64 = 9.80665;
const SEC: u64 = 1_000_000_000;

const CARRIERS: [Carrier; 13] = [
    Carrier::Walking(Worn::Waist),
    Carrier::Walking(Worn::Hand),
    Carrier::Walking(Worn::Foot),
    Carrier::Running(Worn::Waist),
    Carrier::Running(Worn::Hand),
    Carrier::Running(Worn::Foot),
    Carrier::Circling,
    Carrier::Arm,
    Carrier::Car,
    Carrier::Vibration,
    Carrier::Drone,
    Carrier::Hand,
    Carrier::Boat,
];

fn motion(carrier: Carrier, seed: u64) -> Motion {
    Motion::Carried(Box::new(carrier.motion(seed, G)))
}

fn rotation(spin: &Spin) -> Matrix3<f64> {
    quat::matrix(&spin.q_nb.wxyz())
}

fn accelerometer(lever: [f64; 3]) -> Accelerometer {
    Accelerometer {
        lever_b: Vector3::from(lever),
        gravity: G,
    }
}

/// First and second derivative at `t` by central differences of sixth order.
fn differences<T>(t: u64, h: u64, mut at: impl FnMut(u64) -> T) -> [T; 2]
where
    T: Copy
        + std::ops::Add<Output = T>
        + std::ops::Sub<Output = T>
        + std::ops::Mul<f64, Output = T>,
{
    let secs = h as f64 * 1e-9;
    let centre = at(t);
    let pairs = [1, 2, 3].map(|k| (at(t + k * h), at(t - k * h)));
    let [a, b, c] = pairs.map(|(p, m)| p - m);
    let first = (a * 45.0 - b * 9.0 + c) * (1.0 / (60.0 * secs));
    let [a, b, c] = pairs.map(|(p, m)| (p - centre) + (m - centre));
    let second = (a * 270.0 - b * 27.0 + c * 2.0) * (1.0 / (180.0 * secs * secs));
    [first, second]
}

#[test]
fn the_rate_is_that_of_the_attitude_and_its_change_that_of_the_rate() {
    for carrier in CARRIERS {
        let mut worst = (0.0_f64, 0.0_f64);
        for seed in [1, 2] {
            let mut m = motion(carrier, seed);
            let mut off = |t: u64| {
                let felt = m.kinematics(t);
                let [change, _] = differences(t, 100_000, |t| rotation(&m.at_nanos(t)));
                let cross = rotation(&felt.spin).transpose() * change;
                let w = Vector3::new(cross[(2, 1)], cross[(0, 2)], cross[(1, 0)]);
                let [change, _] = differences(t, 100_000, |t| m.at_nanos(t).w_nb_b);
                let of_rate = (change - felt.rate_change).amax();
                ((w - felt.spin.w_nb_b).amax(), of_rate)
            };
            for k in 1..400_u64 {
                // Differences fail across the end of a step, where a derivative jumps: never at both.
                let (a, b) = (off(k * 311_311_117), off(k * 311_311_117 + 5_000_000));
                worst.0 = worst.0.max(a.0.min(b.0));
                worst.1 = worst.1.max(a.1.min(b.1));
            }
        }
        println!("{carrier:?}: {:e} rad/s, {:e} rad/s^2", worst.0, worst.1);
        // Roundings of 1 over 0.1 ms, some together; (0.06 rad)^6 / 140 of a few rad/s at 94 Hz is less.
        assert!(worst.0 < 1e-10, "{carrier:?} {worst:?}");
        // The same of 10 rad/s and of 6000 rad/s^2.
        assert!(worst.1 < 1e-6, "{carrier:?} {worst:?}");
    }
}

#[test]
fn a_delta_angle_is_the_integral_of_the_rate_and_a_mean_that_of_the_force() {
    // Trapezes of 1/400 of the interval, without their first error term.
    let trapezes = |from: u64, to: u64, f: &mut dyn FnMut(u64) -> Vector3<f64>| {
        let n = 400;
        let h = (to - from) / n;
        let mut sum = |step: u64| {
            let inner: Vector3<f64> = (1..n / step).map(|k| f(from + k * step * h)).sum();
            (inner + 0.5 * (f(from) + f(to))) * (step * h) as f64 * 1e-9
        };
        let (fine, coarse) = (sum(1), sum(2));
        fine + (fine - coarse) / 3.0
    };
    for carrier in CARRIERS {
        let mut m = motion(carrier, 3);
        let mut worst = (0.0_f64, 0.0_f64);
        let held = accelerometer([0.1, -0.05, 0.2]);
        // From 1 s on, over the joints of steps too.
        for k in 0..100_u64 {
            let from = SEC + k * 291_000_011;
            let to = from + 10_000_000;
            let by_trapezes = trapezes(from, to, &mut |t| m.at_nanos(t).w_nb_b);
            worst.0 = worst.0.max((m.delta_angle(from, to) - by_trapezes).amax());
            let by_trapezes = trapezes(from, to, &mut |t| held.read(&m.kinematics(t))) / 0.01;
            worst.1 = worst
                .1
                .max((held.mean(&mut m, from, to) - by_trapezes).amax());
        }
        println!("{carrier:?}: {:e} rad, {:e} m/s^2", worst.0, worst.1);
        // 94 Hz: 0.015 rad a step, to the fourth power over 720, of 0.001 rad; a kink costs h^3 of its
        // jump of 1e4 rad/s^3 at most.
        assert!(worst.0 < 1e-13, "{carrier:?} {worst:?}");
        // The force's derivative jumps by up to 300 m/s^3 where a step ends; 25 us between trapezes. That it
        // is cut there is shown below.
        assert!(worst.1 < 1e-6, "{carrier:?} {worst:?}");
    }
}

#[test]
fn delta_angles_of_any_cutting_add_up() {
    for carrier in CARRIERS {
        let mut m = motion(carrier, 4);
        let whole = m.delta_angle(2 * SEC, 12 * SEC);
        let parts: Vector3<f64> = (0..1000)
            .map(|k| m.delta_angle(2 * SEC + k * 10_000_000, 2 * SEC + (k + 1) * 10_000_000))
            .sum();
        // A thousand roundings of a few rad.
        assert!(
            (whole - parts).amax() < 1e-13,
            "{carrier:?} {whole} {parts}"
        );
    }
}

#[test]
fn what_stands_at_both_ends_of_a_cycle_has_not_changed_its_velocity_in_between() {
    for carrier in [
        Carrier::Walking(Worn::Waist),
        Carrier::Walking(Worn::Foot),
        Carrier::Running(Worn::Hand),
        Carrier::Arm,
        Carrier::Vibration,
        Carrier::Hand,
    ] {
        let m = carrier.motion(5, G);
        // Steps of 1 ms; the trapezoidal rule is exact for sines, and steps are smooth.
        let sum: Vector3<f64> = (0..120_000)
            .map(|k| m.at(k * 1_000_000, 0.0).acceleration_n * 1e-3)
            .sum();
        let most = (0..120_000)
            .map(|k| m.at(k * 1_000_000, 0.0).acceleration_n.norm())
            .fold(0.0, f64::max);
        println!("{carrier:?}: {:e} m/s, up to {most:.1} m/s^2", sum.norm());
        assert!(most > 1.0, "{carrier:?} does not move");
        // Where a step ends the derivative jumps by up to 1e3 m/s^3: 1e-6 s^2 / 12 of that each.
        assert!(sum.norm() < 1e-4, "{carrier:?} {sum}");
    }
}

#[test]
fn each_carrier_does_what_its_name_says() {
    let read = |m: &mut Motion, secs: f64| {
        let t = (secs * 1e9) as u64;
        let k = m.kinematics(t);
        (k, accelerometer([0.0; 3]).read(&k))
    };
    let rms = |carrier, f: &dyn Fn(&Kinematics, &Vector3<f64>) -> f64| {
        let mut m = motion(carrier, 6);
        let n = 20_000;
        let sum: f64 = (0..n)
            .map(|k| {
                let (felt, force) = read(&mut m, 10.0 + f64::from(k) * 0.00123);
                f(&felt, &force).powi(2)
            })
            .sum();
        (sum / f64::from(n)).sqrt()
    };
    // At rest at the start: gravity's reaction, to the last bit, and no rate.
    for carrier in CARRIERS {
        if matches!(carrier, Carrier::Car | Carrier::Boat | Carrier::Drone) {
            continue;
        }
        let (felt, force) = read(&mut motion(carrier, 6), 1.0);
        assert_eq!(felt.spin.w_nb_b.norm(), 0.0, "{carrier:?}");
        assert!((force.norm() - G).abs() < 4e-15 * G, "{carrier:?} {force}");
    }
    // v^2 / r to the left, always, beside the road.
    let mut m = motion(Carrier::Circling, 6);
    let mean = accelerometer([0.0; 3]).mean(&mut m, 20 * SEC, 50 * SEC);
    assert!((mean.y - 1.6).abs() < 0.02, "{mean}");
    // 6 m/s^2 on each axis; 37 s of 12 sines beat by some per cent.
    let shaken = rms(Carrier::Vibration, &|k, _| k.acceleration_n.x);
    assert!((shaken - 6.0).abs() < 0.6, "{shaken}");
    // A drone's force stays along z but for what its rotors add: it tilts by 5 degrees and would
    // otherwise show 0.85 m/s^2.
    let mut m = motion(Carrier::Drone, 6);
    let (mut across, mut tilted) = (0.0_f64, 0.0_f64);
    for k in 0..300_u64 {
        let from = 10 * SEC + k * 100_000_000;
        // Over 47 turns of the rotor.
        let mean = accelerometer([0.0; 3]).mean(&mut m, from, from + SEC / 2);
        across = across.max(mean.xy().norm());
        tilted = tilted.max(rotation(&m.at_nanos(from))[(2, 2)].acos());
    }
    assert!(across < 0.2 && tilted > 0.12, "{across} {tilted}");
    // The vertical acceleration of a walking waist: 2 to 4 m/s^2; of a running one, 8 to 20.
    let walks = rms(Carrier::Walking(Worn::Waist), &|k, _| k.acceleration_n.z);
    let runs = rms(Carrier::Running(Worn::Waist), &|k, _| k.acceleration_n.z);
    println!("waist: walking {walks:.2}, running {runs:.2} m/s^2 rms upwards");
    assert!(
        (1.5..4.0).contains(&walks) && (8.0..20.0).contains(&runs),
        "{walks} {runs}"
    );
}

#[test]
fn a_lever_arm_adds_the_acceleration_of_its_end() {
    let top = SymmetricTop::published();
    let start = Case::Cusped
        .start(&top, Case::SEED_TILT, Case::SEED_W3)
        .unwrap();
    let spin = Spin {
        q_nb: Quaternion::identity(),
        w_nb_b: Vector3::new(0.3, -4.0, 0.8),
    };
    let lever = [0.2, -0.1, 0.3];
    let mut motions = vec![
        Motion::ConstantRate(
            ConstantRate::new(Quaternion::identity(), Vector3::new(1.0, -7.0, 3.0)).unwrap(),
        ),
        Motion::Coning(Coning::new(0.2, 3.0).unwrap()),
        Motion::BandLimited(Box::new(BandLimited::random(7, 2.0, 10.0, 10).unwrap())),
        Motion::FreeBody(Box::new(FreeBody::new([1.0, 2.0, 3.0], spin).unwrap())),
        Motion::HeavyBody(Box::new(top.exact(&start).unwrap())),
    ];
    motions.extend(CARRIERS.map(|c| motion(c, 8)));
    for mut m in motions {
        let (plain, held) = (accelerometer([0.0; 3]), accelerometer(lever));
        let (mut worst, mut most) = (0.0_f64, 0.0_f64);
        for k in 1..100_u64 {
            let t = k * 97_111_117;
            let felt = m.kinematics(t);
            let [_, bend] = differences(t, 200_000, |t| {
                rotation(&m.at_nanos(t)) * Vector3::from(lever)
            });
            let expected = rotation(&felt.spin).transpose() * bend;
            let found = held.read(&felt) - plain.read(&felt);
            worst = worst.max((found - expected).amax());
            most = most.max(found.norm());
        }
        println!("{worst:e} of {most:.1} m/s^2");
        // Roundings of 0.4 m over (0.2 ms)^2, and at 94 Hz (0.12 rad)^6 / 560 of 50 m/s^2.
        assert!(most > 0.05 && worst < 5e-7, "{worst:e} {most}");
    }
}

#[test]
fn a_motion_holds_for_a_day() {
    // The phase is reduced in 32 digits: a cycle later everything with a cycle is as it was.
    let m = Carrier::Arm.motion(9, G);
    let (early, late) = (m.at(10 * SEC, 0.0), m.at(10 * SEC + 720 * 120 * SEC, 0.0));
    assert_eq!(early.acceleration_n, late.acceleration_n);
    let m = Carrier::Vibration.motion(9, G);
    let day = 720 * 120 * SEC;
    let [change, _] = differences(day + 10 * SEC + 77, 100_000, |t| rotation(&m.at_nanos(t)));
    let spin = m.at_nanos(day + 10 * SEC + 77);
    let cross = rotation(&spin).transpose() * change;
    let w = Vector3::new(cross[(2, 1)], cross[(0, 2)], cross[(1, 0)]);
    // As within the first minutes.
    assert!((w - spin.w_nb_b).amax() < 1e-10, "{w} {}", spin.w_nb_b);
}
