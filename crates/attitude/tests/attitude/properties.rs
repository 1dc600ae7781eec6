//! Properties that must hold for any stream: bounds, invariances, and that nothing a sensor may say breaks the state.

use nalgebra::Vector3;
use proptest::prelude::*;
use strapd_attitude::frames::In;
use strapd_attitude::propagate::{
    Executor, Method, Noise, Order, Placement, Propagator, Sequential, Settings,
};
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{
    AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status,
};

const KINDS: [SampleKind; 3] = [
    SampleKind::Rate,
    SampleKind::Average,
    SampleKind::DeltaAngle,
];

const METHODS: [Method; 14] = [
    Method::Auto,
    Method::Magnus {
        window: 2,
        order: Order::M4,
        placement: Placement::Centred,
    },
    Method::Magnus {
        window: 3,
        order: Order::M6,
        placement: Placement::Centred,
    },
    Method::Magnus {
        window: 7,
        order: Order::M8,
        placement: Placement::Centred,
    },
    Method::Magnus {
        window: 24,
        order: Order::Exact,
        placement: Placement::Centred,
    },
    Method::Magnus {
        window: 5,
        order: Order::M6,
        placement: Placement::Causal,
    },
    Method::CommitProvisional {
        window: 6,
        order: Order::M8,
        finals: false,
    },
    Method::DcmLeft,
    Method::DcmRight,
    Method::DcmMean,
    Method::RotvecSum,
    Method::Coning3,
    Method::Coning4,
    Method::Rk4,
];

fn propagator(method: Method, kind: SampleKind) -> Propagator {
    Propagator::new(Settings {
        method,
        kind,
        initial: Quaternion::assume_unit([0.5, -0.5, 0.5, 0.5]),
        noise: Noise {
            initial: [0.01, 0.02, 0.0],
            arw: [1e-3, 2e-3, 1e-3],
            bias: [1e-3; 3],
            rrw: [1e-5; 3],
            bias_tau: None,
            ..Noise::default()
        },
        ..Settings::default()
    })
    .unwrap()
}

fn run(method: Method, kind: SampleKind, samples: &[RateSample]) -> Vec<AttitudeSample> {
    let mut propagator = propagator(method, kind);
    let mut out = Vec::new();
    propagator.push(samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    out
}

/// The bits of everything that comes out, so that -0 and 0, and NaN and NaN, are told apart.
fn bits(out: &[AttitudeSample]) -> Vec<([u64; 16], i64, Status, u32)> {
    out.iter()
        .map(|a| {
            let covariance = a.covariance.matrix();
            let numbers = a
                .q_nb
                .wxyz()
                .into_iter()
                .chain(a.rate.0.iter().copied())
                .chain(covariance.iter().copied());
            let mut bits = [0; 16];
            for (bit, number) in bits.iter_mut().zip(numbers) {
                *bit = number.to_bits();
            }
            (bits, a.stamp.0, a.status, a.reset_count)
        })
        .collect()
}

/// A number no gyro should say, among those it may.
fn value() -> impl Strategy<Value = f64> {
    prop_oneof![
        20 => -3.0..3.0,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(f64::NEG_INFINITY),
        1 => Just(f64::MAX),
        1 => Just(1e4),
        1 => Just(-999.0),
        1 => Just(5e-324),
        1 => Just(-0.0),
    ]
}

fn join() -> impl Strategy<Value = Join> {
    prop_oneof![
        60 => Just(Join::Continuous),
        2 => Just(Join::Bridge),
        1 => Just(Join::Hold),
        1 => Just(Join::Reset),
        1 => Just(Join::Start),
    ]
}

/// Nanoseconds to the next sample: mostly regular, sometimes jittered, sometimes absurd.
fn spacing() -> impl Strategy<Value = i64> {
    prop_oneof![
        30 => Just(5_000_000_i64),
        10 => 4_000_000_i64..6_000_000,
        2 => Just(25_000_000_i64),
        1 => Just(0_i64),
        1 => Just(1_i64),
        1 => Just(-7_000_000_i64),
        1 => Just(i64::MAX / 4),
        1 => Just(i64::MIN / 4),
    ]
}

/// Start that an increment states, before its own stamp.
fn length() -> impl Strategy<Value = Option<i64>> {
    prop_oneof![
        30 => Just(None),
        2 => Just(Some(5_000_000_i64)),
        1 => Just(Some(0_i64)),
        1 => Just(Some(-5_i64)),
        1 => Just(Some(i64::MAX)),
    ]
}

fn hostile(kind: SampleKind) -> impl Strategy<Value = Vec<RateSample>> {
    let one = (prop::array::uniform3(value()), join(), spacing(), length());
    prop::collection::vec(one, 0..120).prop_map(move |parts| {
        let mut stamp = 1_700_000_000_000_000_000_i64;
        parts
            .into_iter()
            .map(|(value, join, spacing, length)| {
                let before = stamp;
                stamp = stamp.saturating_add(spacing);
                let start = match (kind, length) {
                    (SampleKind::Rate, _) => stamp,
                    (_, None) => before,
                    (_, Some(length)) => stamp.saturating_sub(length),
                };
                RateSample {
                    stamp: Nanos(stamp),
                    start: Nanos(start),
                    gyro: Measured::assume(kind, value.into()),
                    accel: None,
                    join,
                    status: Status::OK,
                    log: Nanos(stamp),
                }
            })
            .collect()
    })
}

/// A well-behaved log of `n` samples with gaps and breaks at fixed places, for the invariances.
fn log(kind: SampleKind, n: i64, origin: i64, jitter: i64) -> Vec<RateSample> {
    let mut before = origin - 5_000_000;
    (0..n)
        .filter(|i| ![40, 41, 200, 303].contains(i))
        .map(|i| {
            // A deterministic shuffle of the last digits stands for jitter.
            let off = if jitter > 0 { (i * 7_919) % jitter } else { 0 };
            let t = i as f64 * 5e-3 + off as f64 * 1e-9;
            let stamp = origin + i * 5_000_000 + off;
            let mut value = [
                (7.0 * t).sin(),
                2.0 * (3.0 * t).cos(),
                0.3 + (11.0 * t).sin(),
            ];
            let missing = stamp - before > 6_000_000;
            let start = if missing { stamp - 5_000_000 } else { before };
            if kind != SampleKind::Rate {
                value = value.map(|v| v * (stamp - start) as f64 * 1e-9);
            }
            before = stamp;
            RateSample {
                stamp: Nanos(stamp),
                start: Nanos(if kind == SampleKind::Rate {
                    stamp
                } else {
                    start
                }),
                gyro: Measured::assume(kind, value.into()),
                accel: None,
                join: match i {
                    0 => Join::Start,
                    150 => Join::Hold,
                    230 => Join::Reset,
                    _ if missing => Join::Bridge,
                    _ => Join::Continuous,
                },
                status: Status::OK,
                log: Nanos(stamp),
            }
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_a_sensor_says_the_state_stays_a_rotation(
        (kind, samples) in prop::sample::select(&KINDS[..])
            .prop_flat_map(|kind| (Just(kind), hostile(kind))),
        cut in 0_usize..120,
    ) {
        for method in METHODS {
            let mut propagator = propagator(method, kind);
            let mut out = Vec::new();
            let cut = cut.min(samples.len());
            propagator.push(&samples[..cut], &Sequential, &mut out);
            propagator.push(&samples[cut..], &Sequential, &mut out);
            propagator.finish(&Sequential, &mut out);
            prop_assert_eq!(out.len(), samples.len(), "{}", method);
            prop_assert_eq!(propagator.report().samples, samples.len() as u64);
            let mut before: Option<[f64; 4]> = None;
            for a in &out {
                let q = a.q_nb.wxyz();
                let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
                // AttitudeSample promises 1e-15; the sum of squares rounds as much again.
                prop_assert!((norm - 1.0).abs() < 1.5e-15, "{}: norm {:e}", method, norm - 1.0);
                prop_assert!(a.rate.0.iter().all(|c| c.is_finite()), "{}", method);
                prop_assert!(a.covariance.sigma().iter().all(|c| (0.0..=3.2).contains(c)), "{}", method);
                if let (Some(b), Method::Auto) = (before, method) {
                    let dot: f64 = q.iter().zip(b).map(|(a, b)| a * b).sum();
                    // Less than half a turn since: the sign did not jump.
                    let turned = a.status.has(Status::UNDERSAMPLED);
                    prop_assert!(dot > -1e-9 || turned, "the sign jumped: {}", dot);
                }
                before = Some(q);
            }
            let report = propagator.report();
            prop_assert!(report.angle_turned.is_finite() && report.integrated_secs.is_finite());
        }
    }

    #[test]
    fn how_the_stream_is_cut_changes_no_bit(
        cuts in prop::collection::vec(0_usize..400, 0..12),
        jitter in prop::sample::select(&[0_i64, 1_000_000][..]),
    ) {
        for kind in [SampleKind::Rate, SampleKind::DeltaAngle] {
            let samples = log(kind, 400, 0, jitter);
            for method in METHODS {
                let whole = bits(&run(method, kind, &samples));
                let mut cuts: Vec<usize> = cuts.iter().map(|c| c % samples.len()).collect();
                cuts.sort_unstable();
                cuts.push(samples.len());
                let mut propagator = propagator(method, kind);
                let mut out = Vec::new();
                let mut from = 0;
                for to in cuts {
                    propagator.push(&samples[from..to], &Sequential, &mut out);
                    from = to;
                }
                propagator.finish(&Sequential, &mut out);
                prop_assert_eq!(&bits(&out), &whole, "{}, {:?}", method, kind);
            }
        }
    }
}

#[test]
fn one_sample_at_a_time_gives_the_same_bits_as_all_at_once() {
    // Long enough for old samples to be forgotten and for several segments.
    for kind in [SampleKind::Rate, SampleKind::DeltaAngle] {
        let samples = log(kind, 9_000, 0, 1_000);
        for method in METHODS {
            let whole = bits(&run(method, kind, &samples));
            let mut propagator = propagator(method, kind);
            let mut out = Vec::new();
            for sample in &samples {
                propagator.push(std::slice::from_ref(sample), &Sequential, &mut out);
            }
            propagator.finish(&Sequential, &mut out);
            assert!(bits(&out) == whole, "{method}, {kind:?}");
        }
    }
}

/// Works on the pieces from the last to the first, on a thread each.
struct Backwards;

impl Executor for Backwards {
    fn map<T: Send, F: Fn(usize) -> T + Sync>(&self, n: usize, f: F) -> Vec<T> {
        let mut results: Vec<T> = std::thread::scope(|scope| {
            let f = &f;
            let threads: Vec<_> = (0..n).rev().map(|i| scope.spawn(move || f(i))).collect();
            threads.into_iter().map(|t| t.join().unwrap()).collect()
        });
        results.reverse();
        results
    }
}

#[test]
fn who_executes_changes_no_bit() {
    let samples = log(SampleKind::Rate, 20_000, 0, 0);
    for method in METHODS {
        let sequential = bits(&run(method, SampleKind::Rate, &samples));
        let mut propagator = propagator(method, SampleKind::Rate);
        let mut out = Vec::new();
        propagator.push(&samples, &Backwards, &mut out);
        propagator.finish(&Backwards, &mut out);
        assert!(bits(&out) == sequential, "{method}");
    }
}

#[test]
fn a_later_epoch_changes_no_bit_but_the_stamps() {
    const SHIFT: i64 = 1_700_000_000_000_000_000;
    for kind in KINDS {
        for jitter in [0, 1_000_000] {
            for method in METHODS {
                let here = run(method, kind, &log(kind, 400, 0, jitter));
                let mut there = run(method, kind, &log(kind, 400, SHIFT, jitter));
                for a in &mut there {
                    a.stamp = Nanos(a.stamp.0 - SHIFT);
                }
                assert!(bits(&here) == bits(&there), "{method}, {kind:?}");
            }
        }
    }
}

#[test]
fn the_shortest_streams_work() {
    for kind in KINDS {
        for method in METHODS {
            assert!(run(method, kind, &[]).is_empty());
            for n in 1..30 {
                let samples = log(kind, n, 0, 0);
                let out = run(method, kind, &samples);
                assert_eq!(out.len(), samples.len(), "{method}, {kind:?}, {n} samples");
                let q = out[0].q_nb.wxyz();
                for (found, initial) in q.into_iter().zip([0.5, -0.5, 0.5, 0.5]) {
                    // Summed rotation vectors start from its logarithm: one rounding.
                    assert!((found - initial).abs() < 2e-16, "{method} starts at {q:?}");
                }
            }
        }
    }
}

#[test]
fn samples_that_do_not_advance_turn_nothing_and_are_counted() {
    for kind in KINDS {
        let mut samples = log(kind, 39, 0, 0);
        let mut twin = samples[20];
        twin.join = Join::Continuous;
        twin.gyro = twin.gyro.with(twin.gyro.as_vector() * 50.0);
        samples.insert(21, twin);
        let mut late = samples[10];
        late.join = Join::Continuous;
        samples.insert(30, late);
        let clean: Vec<RateSample> = log(kind, 39, 0, 0);
        for method in METHODS {
            let mut propagator = propagator(method, kind);
            let mut out = Vec::new();
            propagator.push(&samples, &Sequential, &mut out);
            propagator.finish(&Sequential, &mut out);
            assert_eq!(propagator.report().stalled, 2, "{method}");
            if !matches!(method, Method::CommitProvisional { .. }) {
                assert_eq!(out[21].q_nb, out[20].q_nb, "{method}");
                assert_eq!(out[30].q_nb, out[29].q_nb, "{method}");
            }
            // They leave no trace in the others.
            let mut others = out.clone();
            others.remove(30);
            others.remove(21);
            assert!(
                bits(&others) == bits(&run(method, kind, &clean)),
                "{method}, {kind:?}"
            );
        }
    }
}

#[test]
fn a_value_that_is_no_number_is_counted_flagged_and_forgotten() {
    for bad in [f64::NAN, f64::INFINITY, -1e300, 2e4] {
        let mut samples = log(SampleKind::Rate, 39, 0, 0);
        let mut spoilt = *samples[20].gyro.as_vector();
        spoilt.y = bad;
        samples[20].gyro = samples[20].gyro.with(spoilt);
        let mut propagator = propagator(Method::Auto, SampleKind::Rate);
        let mut out = Vec::new();
        propagator.push(&samples, &Sequential, &mut out);
        propagator.finish(&Sequential, &mut out);
        assert_eq!(propagator.report().rejected, 1);
        let flagged: Vec<usize> = (0..out.len())
            .filter(|&i| out[i].status.has(Status::REJECTED_BEFORE))
            .collect();
        assert_eq!(flagged, [20]);
        assert_eq!(out[20].rate, out[19].rate, "the rate before stands in");
    }
}

#[test]
fn a_sample_of_another_kind_than_was_announced_counts_as_what_it_is() {
    // A constant rate, of which both kinds tell the same. The announced ones are of one kind, every other sample is
    // of the other.
    let rate = Vector3::new(0.4, -0.7, 1.1);
    let step = 10_000_000;
    let sample = |i: i64, kind: SampleKind| RateSample {
        stamp: Nanos(i * step),
        start: Nanos(if kind == SampleKind::Rate { i } else { i - 1 } * step),
        gyro: match kind {
            SampleKind::Rate => Measured::Rate(BodyRate(rate)),
            _ => Measured::Increment(BodyRate(rate).held_for(0.01)),
        },
        accel: None,
        join: if i == 0 {
            Join::Start
        } else {
            Join::Continuous
        },
        status: Status::OK,
        log: Nanos(0),
    };
    let (rates, increments) = (SampleKind::Rate, SampleKind::DeltaAngle);
    for (announced, other) in [(rates, increments), (increments, rates)] {
        let mixed: Vec<RateSample> = (0..100)
            .map(|i| sample(i, if i % 2 == 0 { announced } else { other }))
            .collect();
        let of_one: Vec<RateSample> = (0..100).map(|i| sample(i, announced)).collect();
        for method in METHODS {
            let method = method.for_kind(announced);
            let (found, expected) = (
                run(method, announced, &mixed),
                run(method, announced, &of_one),
            );
            for (a, b) in found.iter().zip(&expected) {
                // An increment over its interval is the rate but for a rounding or two.
                assert!((a.rate.0 - b.rate.0).norm() < 1e-14, "{method}");
                assert!(a.q_nb.angle_to(&b.q_nb) < 1e-13, "{method}");
                assert_eq!(a.status, b.status, "{method}");
            }
        }
    }
}

#[test]
fn more_than_half_a_turn_in_a_step_is_said() {
    let samples: Vec<RateSample> = (0..30)
        .map(|i| {
            let mut sample = log(SampleKind::Rate, 1, 0, 0)[0];
            sample.stamp = Nanos(i * 100_000_000);
            sample.join = Join::Continuous;
            // Four radians, and almost twice round.
            sample.gyro = Measured::Rate(BodyRate([0.0, 40.0, 0.0].into()));
            sample
        })
        .collect();
    let twice_round: Vec<RateSample> = samples
        .iter()
        .map(|s| RateSample {
            gyro: Measured::Rate(BodyRate([0.0, 0.0, 125.6].into())),
            ..*s
        })
        .collect();
    for method in METHODS {
        let mut propagator = propagator(method, SampleKind::Rate);
        propagator.push(&twice_round, &Sequential, &mut Vec::new());
        propagator.finish(&Sequential, &mut Vec::new());
        assert_eq!(propagator.report().undersampled, 29, "{method}");
    }
    for method in [Method::Auto, Method::DcmRight] {
        let mut propagator = propagator(method, SampleKind::Rate);
        let mut out = Vec::new();
        propagator.push(&samples, &Sequential, &mut out);
        propagator.finish(&Sequential, &mut out);
        let report = propagator.report();
        assert_eq!(report.undersampled, 29, "{method}");
        assert!(out[1..].iter().all(|a| a.status.has(Status::UNDERSAMPLED)));
        // Four radians a step; a fixed axis is followed all the same.
        assert!(
            (report.largest_step - 4.0).abs() < 1e-12,
            "{}",
            report.largest_step
        );
        assert!((report.angle_turned - 116.0).abs() < 1e-9);
    }
}

#[test]
fn settings_that_can_not_be_are_refused_with_the_flag_that_helps() {
    let settings = Settings::default();
    let refused = |settings: Settings| Propagator::new(settings).unwrap_err().to_string();
    for window in [0, 1, 25, usize::MAX] {
        let method = Method::Magnus {
            window,
            order: Order::Exact,
            placement: Placement::Centred,
        };
        assert!(refused(Settings { method, ..settings }).contains("window takes 2 to 24"));
    }
    for wxyz in [[0.0; 4], [1.0, 1.0, 0.0, 0.0], [f64::NAN; 4]] {
        let initial = Quaternion::assume_unit(wxyz);
        assert!(
            refused(Settings {
                initial,
                ..settings
            })
            .contains("init")
        );
    }
    for arw in [-1.0, f64::NAN, f64::INFINITY] {
        let noise = Noise {
            arw: [0.0, arw, 0.0],
            ..Noise::default()
        };
        assert!(refused(Settings { noise, ..settings }).contains("noise"));
        let world_rate = In::assume([0.0, 20.0 * arw, 0.0].into());
        let turning = Settings {
            world_rate,
            ..settings
        };
        assert!(refused(turning).contains("earth_rate"));
    }
}
