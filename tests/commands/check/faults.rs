//! Faults put into clean synthetic logs: each is found, and the clean log has none.

use super::{codes, found};
use crate::made_logs::{ImuSample, PACKINGS, START, TOPIC, bytes, logged, written};
use crate::program::strapd;
use strapd_bodies::motion::BandLimited;

/// A body on the table for 1.5 s, then moved at random; exact rates and orientation, gravity's reaction
/// alone. Between 50 and 400 Hz, by the seed.
fn clean(seed: u64) -> Vec<ImuSample> {
    let rate_hz = [50, 100, 200, 400][seed as usize % 4];
    let step = 1_000_000_000 / rate_hz;
    let still = 3 * rate_hz / 2;
    let mut motion = BandLimited::random(seed, 0.8, 1.5, 6).unwrap();
    let first = motion.at_nanos(0).q_nb;
    (0..8 * rate_hz)
        .map(|k| {
            let moving = (k - still).max(0);
            let spin = motion.at_nanos((moving * step) as u64);
            let q = (first.inverse() * spin.q_nb).normalised();
            let up = q.to_dcm().as_matrix().transpose() * nalgebra::Vector3::z();
            let gyro = if k < still {
                [0.0; 3]
            } else {
                spin.w_nb_b.into()
            };
            ImuSample {
                stamp: START + k * step,
                orientation: Some(q.wxyz()),
                gyro,
                gyro_covariance_0: 0.0,
                accel: (up * 9.80665).into(),
            }
        })
        .collect()
}

/// A clean log, spoilt.
fn with(fault: impl Fn(usize, &mut ImuSample)) -> Vec<&'static str> {
    let mut samples = clean(2);
    for (i, sample) in samples.iter_mut().enumerate() {
        fault(i, sample);
    }
    codes_of(&samples)
}

fn codes_of(samples: &[ImuSample]) -> Vec<&'static str> {
    let dir = tempfile::tempdir().unwrap();
    codes(&found(&written(dir.path(), "log.mcap", samples)))
}

#[test]
fn nothing_is_invented_about_clean_logs() {
    for seed in 0..100 {
        assert_eq!(codes_of(&clean(seed)), Vec::<&str>::new(), "seed {seed}");
    }
}

#[test]
fn bad_values_are_found() {
    assert_eq!(
        with(|i, s| if i == 700 {
            s.gyro[1] = f64::NAN
        }),
        ["not-finite"]
    );
    assert_eq!(
        with(|i, s| if i % 50 == 0 {
            s.gyro_covariance_0 = -1.0
        }),
        ["gyro-absent"]
    );
    let lone_zeros = with(|i, s| {
        if i > 400 && i % 100 == 0 {
            s.gyro = [0.0; 3]
        }
    });
    assert!(lone_zeros.contains(&"zero-rows"), "{lone_zeros:?}");
    let clipped = with(|_, s| s.gyro[0] = s.gyro[0].clamp(-1.2, 1.2));
    assert!(clipped.contains(&"saturated"), "{clipped:?}");
    // At rest everything repeats itself rightly, without noise; these logs begin behind the rest.
    let mut dead = clean(2);
    dead[600..].iter_mut().for_each(|s| s.gyro[2] = 0.111);
    let dead = codes_of(&dead[400..]);
    assert!(dead.contains(&"stuck"), "{dead:?}");
    let mut held = clean(2);
    for i in (401..held.len()).step_by(2) {
        held[i].gyro = held[i - 1].gyro;
    }
    let held = codes_of(&held[400..]);
    assert!(held.contains(&"repeated-rows"), "{held:?}");
}

#[test]
fn bad_units_and_axes_are_found() {
    let degrees = with(|_, s| s.gyro = s.gyro.map(f64::to_degrees));
    assert_eq!(degrees, ["gyro-scale"]);
    let without_a_reference = with(|_, s| {
        s.gyro = s.gyro.map(f64::to_degrees);
        s.orientation = None;
    });
    let codes = ["unit-degrees", "unit-against-gravity"];
    let is_named = without_a_reference.iter().any(|code| codes.contains(code));
    assert!(is_named, "{without_a_reference:?}");
    let frd = with(|_, s| {
        let flip = |v: [f64; 3]| [v[0], -v[1], -v[2]];
        (s.gyro, s.accel) = (flip(s.gyro), flip(s.accel));
        s.orientation = None;
    });
    assert_eq!(frd, ["looks-frd"]);
    let in_g = with(|_, s| s.accel = s.accel.map(|a| a / 9.80665));
    assert_eq!(in_g, ["accel-unit"]);
    // These begin behind the rest, and are never still.
    let moving = |of: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let mut samples = clean(2);
        samples.drain(..600);
        samples.iter_mut().for_each(|s| s.accel = of(s.accel));
        codes_of(&samples)
    };
    let scaled = |by: f64| move |accel: [f64; 3]| accel.map(|a| a * by / 9.80665);
    assert_eq!(moving(&scaled(9.80665)), Vec::<&str>::new());
    assert_eq!(moving(&scaled(1.0)), ["accel-unit"]);
    assert_eq!(moving(&scaled(1000.0)), ["accel-unit"]);
    assert_eq!(with(|_, s| s.gyro[1] += 0.01), ["bias"]);
}

#[test]
fn what_becomes_of_forces_in_g_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let checked =
        |file: &str, flags: &str| strapd(dir.path(), &format!("check {file} {flags}")).out;
    let replayed = |file: &str, flags: &str| {
        let ran = strapd(
            dir.path(),
            &format!("replay {file} -o null: --aid auto {flags}"),
        );
        ran.done().out.clone()
    };
    let samples = |by: f64| {
        let mut samples = clean(2);
        samples.drain(..600);
        for sample in &mut samples {
            sample.accel = sample.accel.map(|a| a * by / 9.80665);
        }
        samples
    };
    // A message of ROS has m/s^2.
    written(dir.path(), "log.mcap", &samples(1.0));
    let said = checked("log.mcap", "");
    assert!(
        said.contains("100 % of the accelerations have the length of gravity in g, not in m/s^2")
            && said.contains("no setting says otherwise"),
        "{said}"
    );
    assert!(replayed("log.mcap", "").contains("the gyro's alone"));
    // A table has what its columns say, if they do.
    let table = |name: &str, by: f64| {
        let mut rows = "time_s,gx,gy,gz,ax,ay,az\n".to_owned();
        for (i, s) in samples(by).iter().enumerate() {
            let ([x, y, z], [u, v, w]) = (s.gyro, s.accel);
            rows += &format!("{:.3},{x},{y},{z},{u},{v},{w}\n", i as f64 * 0.005);
        }
        std::fs::write(dir.path().join(name), rows).unwrap();
    };
    table("g.csv", 1.0);
    assert!(checked("g.csv", "").contains("-> taken to be in g where gravity corrects"));
    assert!(replayed("g.csv", "").contains("taken to be in g, not in m/s^2"));
    table("mg.csv", 1000.0);
    let said = checked("mg.csv", "");
    let help = "--columns accel=X:Y:Z:mg";
    assert!(
        said.contains("of gravity in mg") && said.contains(help),
        "{said}"
    );
    assert!(replayed("mg.csv", "").contains("the gyro's alone"));
    let stated = "--columns accel=ax:ay:az:mg";
    let said = checked("mg.csv", stated);
    assert!(!said.contains("accel-unit"), "{said}");
    assert!(replayed("mg.csv", stated).contains("aid      gravity"));
}

#[test]
fn bad_clocks_are_found() {
    let jitter = with(|i, s| s.stamp += [0, 900_000, -900_000, 400_000, -200_000][i % 5]);
    assert_eq!(jitter, ["jitter"]);
    let mut gap = clean(2);
    gap.drain(700..900);
    assert_eq!(codes_of(&gap), ["gap-held", "missing"]);
    let mut repeated = clean(2);
    repeated[800] = repeated[799];
    let repeated = codes_of(&repeated);
    assert!(repeated.contains(&"repeats"), "{repeated:?}");
    // Received in order, stamped out of it.
    let samples = clean(2);
    let mut messages = logged(TOPIC, &samples);
    let payload = messages[800].payload.clone();
    messages[800].payload = std::mem::replace(&mut messages[801].payload, payload);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("swapped.mcap");
    std::fs::write(&path, bytes(PACKINGS[0].1, 4096, &messages)).unwrap();
    let swapped = codes(&found(&path));
    assert_eq!(swapped, ["disorder"]);
    // Received in time, stamped never.
    let mut messages = logged(TOPIC, &clean(2));
    let unstamped: Vec<ImuSample> = samples
        .iter()
        .map(|s| ImuSample { stamp: 0, ..*s })
        .collect();
    for (message, blank) in messages.iter_mut().zip(logged(TOPIC, &unstamped)) {
        message.payload = blank.payload;
    }
    std::fs::write(&path, bytes(PACKINGS[0].1, 4096, &messages)).unwrap();
    assert_eq!(codes(&found(&path)), ["clock"]);
}

#[test]
fn too_few_samples_for_the_motion_are_found() {
    let fast = with(|i, s| {
        if (700..760).contains(&i) {
            s.gyro = [0.0, 0.0, 800.0];
        }
    });
    assert!(fast.contains(&"under-sampled"), "{fast:?}");
}

#[test]
fn an_orientation_that_is_no_truth_is_told_from_one_that_is() {
    let inverse = with(|_, s| {
        s.orientation = s.orientation.map(|[w, x, y, z]| [w, -x, -y, -z]);
    });
    assert_eq!(inverse, ["orientation-inverse"]);
    // Turned by 120 degrees about (1, 1, 1): x is the gyro's y.
    let other = with(|_, s| s.gyro = [s.gyro[1], s.gyro[2], s.gyro[0]]);
    assert!(other.contains(&"orientation-other-axes"), "{other:?}");
    let constant = with(|_, s| s.orientation = Some([1.0, 0.0, 0.0, 0.0]));
    assert_eq!(constant, ["orientation-constant"]);
    let invalid = with(|i, s| {
        if i % 3 == 0 {
            s.orientation = Some([3.0, 0.0, 0.0, 4.0])
        }
    });
    assert_eq!(invalid, ["orientation-invalid"]);
    let mut elsewhere = clean(2);
    let others: Vec<_> = clean(6).iter().map(|s| s.orientation).collect();
    for (sample, other) in elsewhere.iter_mut().zip(others) {
        sample.orientation = other;
    }
    assert_eq!(codes_of(&elsewhere), ["orientation-unrelated"]);
}
