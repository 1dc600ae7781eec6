//! Samples whose properties are known -> the findings about them, and no others.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use super::{Seen, found_by, of_samples};
use crate::finding::{Finding, Severity};
use crate::inspection::{Aids, Inspection};
use strapd_attitude::condition::quality::{GravityAxis, Quality};
use strapd_attitude::condition::{Clock, GyroUnit};
use strapd_attitude::estimate::{EstimationSettings, Meaning};
use strapd_attitude::record::{Counts, Declared, Nanos, RawSample, Verdict};
use strapd_recording::recording::payload_type::PayloadType;

/// Sample number `n` of a 200 Hz stream whose values tell which one it is.
fn sample(n: i64) -> RawSample {
    let stamp = 1_700_000_000_000_000_000 + n * 5_000_000;
    RawSample {
        header: Some(Nanos(stamp)),
        log: Nanos(stamp + 1_000_000),
        gyro: Some([n as f64 * 1e-3, 0.5, -0.25]),
        accel: Some([0.0, 0.0, 9.81]),
        ..RawSample::default()
    }
}

/// A topic of these samples, looked at.
fn looked(raw: &[RawSample]) -> Inspection {
    let mut quality = Quality::new(Clock::Header);
    raw.iter().for_each(|r| quality.push(r));
    let mut counts = Counts::default();
    counts.add_many(Verdict::Accepted, raw.len() as u64);
    Inspection {
        topic: "/imu".to_owned(),
        of: "/imu".to_owned(),
        described: PayloadType::of_memory("imu [cdr]"),
        frame: String::new(),
        resolved: Meaning::new(&EstimationSettings::default(), &Declared::default()),
        quality: quality.summary(),
        quality_unit: GyroUnit::Rad,
        rests: Default::default(),
        bias: None,
        counts,
        clock_set: None,
        clocks: Default::default(),
        undecodable: 0,
        clock: Clock::Header,
        clock_warning: None,
        aid: Aids {
            force_scale: 1.0,
            ..Aids::default()
        },
        is_likely: true,
        has_reference: false,
    }
}

fn codes(found: &[Finding]) -> Vec<&'static str> {
    found.iter().map(|finding| finding.code).collect()
}

fn one<'a>(found: &'a [Finding], code: &str) -> Option<&'a Finding> {
    found.iter().find(|finding| finding.code == code)
}

/// Still, with a little noise that never repeats, for `secs` at 200 Hz.
fn still(secs: i64, accel: [f64; 3]) -> Vec<RawSample> {
    (0..secs * 200)
        .map(|n| {
            let noise = |k: i64| ((n * k) % 1009 - 504) as f64 * 1e-6;
            RawSample {
                gyro: Some([noise(7919), noise(104_729), noise(1_299_709)]),
                accel: Some(accel),
                ..sample(n)
            }
        })
        .collect()
}

#[test]
fn gravity_tells_axis_sign_and_unit() {
    for (accel, axis, positive, advice) in [
        ([0.1, 0.2, 9.8], 2, true, None),
        (
            [0.1, 0.2, -9.8],
            2,
            false,
            // The data cannot tell which.
            Some(("looks-frd", "body frd, or accel_sign kinematic")),
        ),
        (
            [9.8, 0.0, 0.3],
            0,
            true,
            // From x to z: a quarter turn about -y.
            Some((
                "mounted-on-side",
                "mount q=0.707107,0.000000,-0.707107,0, or body MAP",
            )),
        ),
        ([0.0, 0.0, 1.0], 2, true, Some(("accel-unit", ""))),
        ([0.0, 0.0, 1000.0], 2, true, Some(("accel-unit", ""))),
    ] {
        let looked = looked(&still(10, accel));
        assert_eq!(looked.quality.gravity, Some(GravityAxis { axis, positive }));
        let found = of_samples(&looked);
        assert!(found.len() <= 1, "{found:?}");
        let found = found.first().map(|one| (one.code, one.flags()));
        assert_eq!(
            found.as_ref().map(|(code, flags)| (*code, flags.as_str())),
            advice,
            "{accel:?}"
        );
    }
    let tilted = looked(&still(10, [5.7, 5.6, 5.7]));
    assert_eq!(tilted.quality.gravity, None);
}

#[test]
fn most_forces_of_one_g_tell_the_unit_where_nothing_is_still_and_motion_alone_does_not() {
    // Turned and shaken about: gravity and 0.3 of it, in every direction, at a rate that is never even.
    let shaken = |gravity: f64, shake: f64| -> Vec<RawSample> {
        let at = |n: i64| {
            let t = n as f64 * 0.01;
            let (a, b) = ((2.0 * t).sin(), (1.3 * t).cos());
            let up = nalgebra::Vector3::new(a, b, 0.5 - a * b).normalize();
            let other =
                nalgebra::Vector3::new((31.0 * t).sin(), (37.0 * t).cos(), (41.0 * t).sin());
            RawSample {
                gyro: Some([(9.0 * t).sin(), (7.0 * t).cos(), 1.0]),
                accel: Some((up * gravity + other * shake).into()),
                ..sample(n)
            }
        };
        (0..2000).map(at).collect()
    };
    let unit = |raw: &[RawSample]| {
        let found = of_samples(&looked(raw));
        assert!(codes(&found).contains(&"never-still"), "{found:?}");
        let one = one(&found, "accel-unit")?;
        let share = one.evidence["share_of_one_g"].as_f64().unwrap();
        assert!((0.5..=1.0).contains(&share), "{share}");
        one.evidence["plausible_unit"].as_str().map(str::to_owned)
    };
    assert_eq!(unit(&shaken(1.0, 0.1)), Some("g".to_owned()));
    assert_eq!(unit(&shaken(1000.0, 100.0)), Some("mg".to_owned()));
    assert_eq!(unit(&shaken(9.81, 3.0)), None);
    // Without gravity, of any size.
    for size in [0.3, 0.6, 0.8, 1.0, 1.3, 2.0] {
        let mut raw = shaken(0.0, 1.0);
        // Three numbers that are spread normally, or nearly: the sum of twelve that are even.
        let mut state = 1_u64;
        let mut normal = || {
            let mut even = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 11) as f64 / (1_u64 << 53) as f64
            };
            (0..12).map(|_| even()).sum::<f64>() - 6.0
        };
        for one in &mut raw {
            one.accel = Some([size * normal(), size * normal(), size * normal()]);
        }
        assert_eq!(unit(&raw), None, "{size}");
    }
    // Of a few samples nothing is said.
    let few = shaken(1.0, 0.1).into_iter().take(19).collect::<Vec<_>>();
    assert!(!codes(&of_samples(&looked(&few))).contains(&"accel-unit"));
}

#[test]
fn rates_no_gyro_has_are_taken_for_degrees_but_a_spike_is_not() {
    let turning = |n: i64, peak: f64| RawSample {
        gyro: Some([peak * (n as f64 * 0.01).sin(), 0.0, 1.0]),
        ..sample(n)
    };
    let raw: Vec<RawSample> = (0..2000).map(|n| turning(n, 500.0)).collect();
    let degrees = |raw: &[RawSample]| codes(&of_samples(&looked(raw))).contains(&"unit-degrees");
    assert!(degrees(&raw));
    // Counts are no deg/s either.
    let raw: Vec<RawSample> = (0..2000).map(|n| turning(n, 30_000.0)).collect();
    let found = codes(&of_samples(&looked(&raw)));
    assert!(
        !degrees(&raw) && found.contains(&"unit-unknown"),
        "{found:?}"
    );
    let mut raw: Vec<RawSample> = (0..2000).map(|n| turning(n, 5.0)).collect();
    raw[1000].gyro = Some([700.0, 0.0, 0.0]);
    raw[1001].gyro = Some([6e302, 0.0, 0.0]);
    assert!(!degrees(&raw));
}

#[test]
fn a_clipped_and_a_stuck_axis_are_found() {
    let raw: Vec<RawSample> = (0..4000)
        .map(|n| {
            let x = 50.0 * (n as f64 * 0.013).sin();
            // Dies after a thousand samples.
            let z = 0.001 * n.min(1000) as f64;
            RawSample {
                gyro: Some([x.clamp(-34.9, 34.9), (n as f64 * 0.007).cos(), z]),
                ..sample(n)
            }
        })
        .collect();
    let found = of_samples(&looked(&raw));
    let saturated = one(&found, "saturated").unwrap();
    assert_eq!(saturated.evidence["axis"], "x");
    assert_eq!(saturated.evidence["reading"], 34.9);
    let stuck = one(&found, "stuck").unwrap();
    assert_eq!(stuck.evidence["axis"], "z");
    assert_eq!(stuck.evidence["samples"], 3000);
}

#[test]
fn exact_data_is_neither_clipped_nor_stuck_nor_short_of_samples() {
    // A coning body: two axes swing to the same largest value again and again, the third is constant;
    // stamps that jitter by a third of a step without one missing.
    let looked = looked(
        &(0..2000)
            .map(|n| {
                let phase = std::f64::consts::TAU * (n % 40) as f64 / 40.0;
                let jitter = [0, 0, 0, -1_700_000, 1_700_000, 0, 0, 0][n as usize % 8];
                let stamp = sample(n).header.map(|Nanos(t)| Nanos(t + jitter));
                RawSample {
                    gyro: Some([3.0 * phase.cos(), 3.0 * phase.sin(), -0.25]),
                    header: stamp,
                    ..sample(n)
                }
            })
            .collect::<Vec<_>>(),
    );
    assert!(
        looked.quality.missing > 0,
        "steps of 8.4 ms instead of 5 look like gaps: {looked:?}"
    );
    let found = of_samples(&looked);
    for wrong in ["saturated", "stuck", "missing"] {
        assert!(!codes(&found).contains(&wrong), "{found:?}");
    }
}

#[test]
fn a_finding_is_a_row_of_the_table() {
    fn toy(seen: &Seen<'_>, out: &mut Vec<Finding>) {
        let n = seen.looked.quality.with_accel;
        if n > 0 {
            out.push(Finding::new(Severity::Note, "toy", "forces").with("count", n));
        }
    }
    let looked = looked(&(0..20).map(sample).collect::<Vec<_>>());
    let seen = Seen::of(&looked, 20);
    let [found] = found_by(&[toy], &seen).try_into().unwrap();
    assert_eq!((found.code, &found.evidence["count"]), ("toy", &20.into()));
    assert_eq!(found_by(&[], &seen), []);
}

#[test]
fn gravity_tells_the_unit_of_the_rates_and_where_they_disagree() {
    // One radian a second about x, and what the gyro says of it.
    let read = |gyro: f64| {
        let at = |n: i64| {
            let angle = n as f64 * 0.005;
            RawSample {
                gyro: Some([gyro, 0.0, 0.0]),
                accel: Some([0.0, 9.81 * angle.sin(), 9.81 * angle.cos()]),
                ..sample(n)
            }
        };
        looked(&(0..2000).map(at).collect::<Vec<_>>())
    };
    let flags =
        |looked: &Inspection| one(&of_samples(looked), "unit-against-gravity").map(Finding::flags);
    let advice = |gyro: f64| flags(&read(gyro));
    assert_eq!(advice(1.0), None);
    assert_eq!(advice(1_f64.to_degrees()), Some("gyro_unit deg".to_owned()));
    assert_eq!(advice(1000.0), Some("gyro_unit mrad".to_owned()));
    assert_eq!(advice(-1.0), Some("body MAP, or gyro_unit deg".to_owned()));
    // Counts of the common chips, some percent off; what lies between them is not named.
    for (counts, factor) in [
        (131.0, "0.0001332"),
        (16.4, "0.001064"),
        (65.5, "0.0002665"),
    ] {
        let read = 1.03 * counts * 1_f64.to_degrees();
        assert_eq!(advice(read), Some(format!("gyro_scale {factor}")));
    }
    // A unit that was stated and is another: by the format, or in a stream; and by who replays.
    let stated = |gyro: f64, judged_in| {
        let mut looked = read(gyro);
        (looked.resolved.unit, looked.quality_unit) = (GyroUnit::Deg, judged_in);
        flags(&looked)
    };
    let rad = Some("gyro_unit rad".to_owned());
    assert_eq!(stated(1_f64.to_radians(), GyroUnit::Rad), rad);
    assert_eq!(stated(1.0, GyroUnit::Deg), rad);
    assert_eq!(stated(1.0, GyroUnit::Rad), None);
    let between = advice(100.0 * 1_f64.to_degrees());
    assert_eq!(between, Some("body MAP, or gyro_unit deg".to_owned()));
}
