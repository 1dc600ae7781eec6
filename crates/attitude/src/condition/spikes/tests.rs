//! Spikes that are found, and motion that is none. Numbers by an independent implementation are named where they stand.

use crate::condition::{Conditioner, Report, Settings, SpikePolicy};
use crate::record::{Measured, Nanos, RateSample, RawSample, SampleKind, Status};
use nalgebra::{Rotation3, Vector3};

const T0: i64 = 1_700_000_000_000_000_000;

/// Numbers of mean 0 and deviation 1, uniform, from a 64-bit linear congruence.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut x = seed;
    move || {
        x = x
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((x >> 11) as f64 / 2_f64.powi(53) - 0.5) * 12_f64.sqrt()
    }
}

/// A hand: still for 3 s, then roll, pitch and yaw swing by 50, 40 and 120 degrees. Rates in rad/s, forces in m/s^2.
pub(crate) fn hand(secs: usize, hz: usize) -> Vec<RawSample> {
    let mut noise = noise(1);
    (0..secs * hz)
        .map(|n| {
            let t = n as f64 / hz as f64;
            let v = (t - 3.0).clamp(0.0, 1.0);
            let (u, du) = match v < 1.0 {
                true => (v * v * (3.0 - 2.0 * v), 6.0 * v * (1.0 - v)),
                false => (1.0, 0.0),
            };
            let swing = |degrees: f64, k: f64| {
                let (sin, cos) = (k * (t - 3.0)).sin_cos();
                let size = degrees.to_radians();
                (size * sin * u, size * (k * cos * u + sin * du))
            };
            let ((r, dr), (p, dp), (y, dy)) =
                (swing(50.0, 1.7), swing(40.0, 1.1), swing(120.0, 0.6));
            let rate = Vector3::new(
                dr - dy * p.sin(),
                dp * r.cos() + dy * p.cos() * r.sin(),
                dy * p.cos() * r.cos() - dp * r.sin(),
            );
            let force =
                Rotation3::from_euler_angles(r, p, y).inverse() * Vector3::new(0.0, 0.0, 9.806_65);
            let mut noisy = |v: Vector3<f64>, sigma: f64| {
                [
                    v.x + noise() * sigma,
                    v.y + noise() * sigma,
                    v.z + noise() * sigma,
                ]
            };
            let gyro = noisy(rate, 0.1_f64.to_radians());
            let accel = noisy(force, 0.03);
            let _field = noisy(Vector3::zeros(), 0.0);
            RawSample {
                header: Some(Nanos(T0 + (n * 1_000_000_000 / hz) as i64)),
                gyro: Some(gyro),
                accel: Some(accel),
                ..RawSample::default()
            }
        })
        .collect()
}

pub(crate) fn add(raw: &mut RawSample, axis: usize, rate: f64) {
    if let Some(value) = raw.gyro.as_mut().and_then(|gyro| gyro.get_mut(axis)) {
        *value += rate;
    }
}

/// Samples out of the conditioner, fed in pieces of so many.
pub(crate) fn conditioned(
    settings: &Settings,
    raw: &[RawSample],
    piece: usize,
) -> (Vec<RateSample>, Report) {
    let mut conditioner = Conditioner::new(settings).unwrap();
    let mut out = Vec::new();
    for piece in raw.chunks(piece) {
        conditioner.push(piece, &mut out);
    }
    conditioner.finish(&mut out);
    (out, conditioner.report().clone())
}

fn repaired(out: &[RateSample]) -> Vec<usize> {
    let is_repaired = |(_, sample): &(usize, &RateSample)| sample.status.has(Status::REPAIRED);
    let found = out.iter().enumerate().filter(is_repaired);
    found.map(|(n, _)| n).collect()
}

pub(crate) fn rate(sample: &RateSample) -> Vector3<f64> {
    match sample.gyro {
        Measured::Rate(rate) => rate.0,
        Measured::Increment(angle) => angle.0,
    }
}

#[test]
fn the_spikes_of_a_moving_hand_are_found_and_nothing_else() {
    let clean = hand(40, 50);
    let mut raw = clean.clone();
    for (at, size) in [(300, 30.0), (411, 0.5), (640, 3.0), (1000, -8.0)] {
        add(&mut raw[at], 2, size);
    }
    let (out, report) = conditioned(&Settings::default(), &raw, 7);
    // The reference finds these three; 0.5 rad/s is motion like that around it. It is 30.0044572 rad/s off there.
    assert_eq!(repaired(&out), [300, 640, 1000]);
    assert_eq!(report.spikes.samples, 3);
    assert_eq!(report.spikes.first, raw[300].header);
    assert!(
        (report.spikes.largest - 30.0044572).abs() < 1e-6,
        "{report:?}"
    );
    let truth = conditioned(&Settings::default(), &clean, 2000).0;
    for n in [300, 640, 1000] {
        // A step of this motion is 0.06 rad/s at most.
        assert!((rate(&out[n]) - rate(&truth[n])).norm() < 0.1);
    }
    assert!(repaired(&truth).is_empty());
}

#[test]
fn a_run_of_three_is_bridged_and_a_longer_one_is_motion() {
    let clean = hand(10, 400);
    for (length, found) in [(1, 1), (2, 2), (3, 3), (5, 0), (8, 0)] {
        let mut raw = clean.clone();
        for sample in raw.iter_mut().skip(2000).take(length) {
            add(sample, 0, 6.0);
        }
        let (out, report) = conditioned(&Settings::default(), &raw, 100);
        assert_eq!(report.spikes.samples, found, "{length}");
        let places: Vec<usize> = (2000..2000 + found as usize).collect();
        assert_eq!(repaired(&out), places, "{length}");
    }
}

#[test]
fn a_blow_that_the_accelerometer_feels_is_kept_and_a_glitch_of_the_whole_bus_is_not() {
    let clean = hand(10, 400);
    let mut blow = clean.clone();
    for (n, sample) in blow.iter_mut().skip(2000).take(2).enumerate() {
        add(sample, 0, 6.0);
        sample.accel = Some([20.0, 5.0 * n as f64, -10.0]);
    }
    assert_eq!(
        conditioned(&Settings::default(), &blow, 99)
            .1
            .spikes
            .samples,
        0
    );
    // One sample alone of 30 rad/s is no blow; its force is as wrong as its rate.
    let mut glitch = clean;
    add(&mut glitch[2000], 0, 30.0);
    glitch[2000].accel = Some([78.0, 78.0, -78.0]);
    let (out, _) = conditioned(&Settings::default(), &glitch, 99);
    assert_eq!(repaired(&out), [2000]);
    assert!(out[2000].accel.is_none() && out[2001].accel.is_some());
}

/// Places of the samples without a force.
fn without_force(out: &[RateSample]) -> Vec<usize> {
    let found = out.iter().enumerate().filter(|(_, s)| s.accel.is_none());
    found.map(|(n, _)| n).collect()
}

#[test]
fn a_glitch_of_the_accelerometer_alone_is_left_out_and_a_blow_is_not() {
    let clean = hand(20, 400);
    let at = [2000, 2500, 2501, 3001, 4444, 6000, 6001, 6002];
    let mut raw = clean.clone();
    for n in at {
        raw[n].accel = raw[n].accel.map(|[x, y, z]| [x + 78.0, y, z - 40.0]);
    }
    let (out, report) = conditioned(&Settings::default(), &raw, 33);
    assert_eq!(without_force(&out), at);
    assert_eq!((report.force_spikes.samples, report.spikes.samples), (8, 0));
    assert_eq!(report.force_spikes.first, raw[2000].header);
    assert!(
        (report.force_spikes.largest - 87.7).abs() < 0.5,
        "{report:?}"
    );
    // Rates, stamps and marks are as they were.
    let of = |raw: &[RawSample]| conditioned(&Settings::default(), raw, 33).0;
    for (found, clean) in out.iter().zip(of(&clean)) {
        assert_eq!((found.gyro, found.status), (clean.gyro, clean.status));
    }
    // Longer than 20 ms; felt by the gyro; one of many, but for the first; a step that stays.
    for (n, sample) in raw.iter_mut().enumerate() {
        *sample = clean[n];
        let hit = match n {
            2000..2008 => 60.0,
            3000 => 40.0,
            4000..4100 => 50.0 * (n % 2) as f64,
            6000.. => 20.0,
            _ => 0.0,
        };
        sample.accel = sample.accel.map(|[x, y, z]| [x, y + hit, z]);
        if n == 3000 {
            add(sample, 0, 0.2);
        }
    }
    let (out, report) = conditioned(&Settings::default(), &raw, 33);
    assert_eq!(without_force(&out), [4001], "{report:?}");
    let keep = Settings {
        spikes: SpikePolicy::Keep,
        ..Settings::default()
    };
    raw = clean;
    raw[2000].accel = Some([78.0, 0.0, 0.0]);
    assert_eq!(without_force(&conditioned(&keep, &raw, 33).0), [0; 0]);
}

#[test]
fn spikes_are_the_same_however_samples_come_and_left_where_that_is_asked_or_nothing_waits() {
    let mut raw = hand(10, 100);
    for at in [310, 500, 502, 990] {
        add(&mut raw[at], 1, -20.0);
    }
    let of = |settings: &Settings, piece: usize| conditioned(settings, &raw, piece);
    let whole = of(&Settings::default(), raw.len());
    assert_eq!(repaired(&whole.0), [310, 500, 502, 990]);
    for piece in [1, 2, 17, 64] {
        assert_eq!(of(&Settings::default(), piece), whole);
    }
    for settings in [
        Settings {
            spikes: SpikePolicy::Keep,
            ..Settings::default()
        },
        Settings {
            reorder_window: Settings::LIVE_WINDOW,
            ..Settings::default()
        },
    ] {
        assert_eq!(of(&settings, 10).1.spikes.samples, 0, "{settings:?}");
    }
}

#[test]
fn coarse_and_slow_rates_hold_no_spikes() {
    // A rest that toggles by one step of 0.1 rad/s, and single flicks of a sensor at 20 Hz.
    let mut coarse = hand(20, 100);
    for (n, sample) in coarse.iter_mut().enumerate() {
        sample.gyro = Some([0.0, if n % 37 == 36 { 0.1 } else { 0.0 }, 0.0]);
    }
    assert_eq!(
        conditioned(&Settings::default(), &coarse, 50)
            .1
            .spikes
            .samples,
        0
    );
    let mut slow = hand(60, 20);
    for at in [100, 400, 700] {
        add(&mut slow[at], 0, 8.0);
    }
    assert_eq!(
        conditioned(&Settings::default(), &slow, 50)
            .1
            .spikes
            .samples,
        0
    );
}

#[test]
fn the_first_samples_of_a_sensor_that_has_not_measured_yet_are_replaced() {
    let clean = hand(10, 200);
    let wrong = [
        [12.2, 16.3, -16.0],
        [11.5, -12.2, -13.0],
        [12.2, -16.0, 0.0],
    ];
    for (from, length) in [(0, 1), (0, 2), (0, 3), (1, 1), (7, 2), (16, 3)] {
        let mut raw = clean.clone();
        for (sample, wrong) in raw.iter_mut().skip(from).zip(wrong).take(length) {
            sample.gyro = Some(if from == 0 { wrong } else { [12.0, 0.0, 9.0] });
        }
        let places: Vec<usize> = (from..from + length).collect();
        for piece in [1, 33, raw.len()] {
            let (out, report) = conditioned(&Settings::default(), &raw, piece);
            assert_eq!(repaired(&out), places, "{from} {length} in {piece}");
            assert_eq!(report.spikes.first, raw[from].header);
            let off = |n: &usize| (rate(&out[*n]) - Vector3::from(clean[*n].gyro.unwrap())).norm();
            assert!(places.iter().all(|n| off(n) < 0.01));
        }
    }
    // The same behind a hole of a second, in motion.
    let mut raw = clean;
    raw.drain(1200..1400);
    for (sample, wrong) in raw.iter_mut().skip(1200).zip(wrong) {
        sample.gyro = Some(wrong);
    }
    let (out, _) = conditioned(&Settings::default(), &raw, 50);
    assert_eq!(repaired(&out), [1200, 1201, 1202]);
}

#[test]
fn a_stream_that_begins_in_motion_or_with_a_blow_keeps_its_first_samples() {
    let none = |raw: &[RawSample], why: &str| {
        let (out, report) = conditioned(&Settings::default(), raw, 64);
        assert_eq!(report.spikes.samples, 0, "{why}");
        assert!(repaired(&out).is_empty(), "{why}");
    };
    let moving = hand(10, 100).split_off(420);
    none(&moving, "motion");
    // A driver's zeros, and a table that was switched on: less than what follows.
    for length in 1..=3 {
        let mut zeros = hand(10, 100);
        for (n, sample) in zeros.iter_mut().enumerate() {
            sample.gyro = Some([0.0, 0.0, if n < length { 0.01 } else { 3.0 }]);
        }
        none(&zeros, "a step");
    }
    let mut blow = hand(10, 400);
    for (n, sample) in blow.iter_mut().take(2).enumerate() {
        add(sample, 0, 9.0);
        sample.accel = Some([30.0, 9.0 * n as f64, -20.0]);
    }
    none(&blow, "a blow");
    // Slow sensors, and too few samples to tell.
    let mut slow = hand(30, 20);
    add(&mut slow[0], 0, 9.0);
    none(&slow, "slow");
    let mut short = hand(1, 200);
    add(&mut short[0], 0, 9.0);
    short.truncate(9);
    none(&short, "short");
}

#[test]
fn the_last_samples_are_replaced_where_no_body_can_have_moved_so() {
    let clean = hand(10, 200);
    for length in 1..=3 {
        let mut raw = clean.clone();
        let from = raw.len() - length;
        for (n, sample) in raw.iter_mut().skip(from).enumerate() {
            sample.gyro = Some([-17.0, 9.0 + n as f64, 20.0]);
        }
        let places: Vec<usize> = (from..from + length).collect();
        for piece in [1, 33, raw.len()] {
            let (out, report) = conditioned(&Settings::default(), &raw, piece);
            assert_eq!(repaired(&out), places, "{length} in {piece}");
            assert_eq!(report.spikes.samples, length as u64);
        }
        // Who takes it up at the end turns it less, and is felt.
        for (rate, force) in [(4.0, 0.0), (17.0, 9.0)] {
            let mut taken = clean.clone();
            for (n, sample) in taken.iter_mut().skip(from).enumerate() {
                add(sample, 0, rate * (n + 1) as f64);
                sample.accel = sample.accel.map(|[x, y, z]| [x + force, y, z]);
            }
            taken.truncate(from + if rate < 5.0 { 1 } else { length });
            let (_, report) = conditioned(&Settings::default(), &taken, 64);
            assert_eq!(report.spikes.samples, 0, "{length} {rate}");
        }
    }
}

#[test]
fn a_violent_spike_is_found_where_it_takes_longer_and_a_flick_is_none() {
    for (hz, length) in [(50, 2), (50, 3), (20, 1)] {
        let clean = hand(40, hz);
        let mut raw = clean.clone();
        let places: Vec<usize> = (hz * 20..hz * 20 + length).collect();
        for n in &places {
            add(&mut raw[*n], 1, 40.0);
        }
        let (out, _) = conditioned(&Settings::default(), &raw, 64);
        assert_eq!(repaired(&out), places, "{hz} Hz");
        // What is felt, and what a hand may do, is kept.
        let mut felt = clean.clone();
        for (k, n) in places.iter().enumerate() {
            add(&mut felt[*n], 1, 40.0);
            felt[*n].accel = Some([15.0, 4.0 * k as f64, -9.0]);
        }
        let mut flick = clean;
        for n in &places {
            add(&mut flick[*n], 1, 12.0);
        }
        for raw in [&felt, &flick] {
            let (_, report) = conditioned(&Settings::default(), raw, 64);
            assert_eq!(report.spikes.samples, 0, "{hz} Hz");
        }
    }
}

#[test]
fn spikes_of_increments_are_found_and_one_that_covers_lost_samples_is_none() {
    let settings = Settings {
        kind: SampleKind::DeltaAngle,
        ..Settings::default()
    };
    let mut clean = hand(40, 100);
    for sample in &mut clean {
        sample.gyro = sample.gyro.map(|rate| rate.map(|rate| rate / 100.0));
    }
    let mut raw = clean.clone();
    let spikes = [700, 1500, 1501, 3999];
    for n in spikes {
        add(&mut raw[n], 2, 0.4);
    }
    let (out, report) = conditioned(&settings, &raw, 64);
    assert_eq!(repaired(&out), spikes);
    assert!((report.spikes.largest - 40.0).abs() < 0.2, "{report:?}");
    // A table that turns at 3 rad/s, whose driver missed three readings and summed.
    let mut table = hand(20, 100);
    for (n, sample) in table.iter_mut().enumerate() {
        let times = if n % 300 == 299 { 4.0 } else { 1.0 };
        sample.gyro = Some([0.0, 0.0, 0.03 * times]);
    }
    for raw in [&clean, &table] {
        assert_eq!(conditioned(&settings, raw, 64).1.spikes.samples, 0);
    }
}
