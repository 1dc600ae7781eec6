//! Live attitudes after a spike against those of a stream that never had it; the numbers are those of a repair in a recording.

use crate::condition::spikes::tests::{add, conditioned, hand, rate};
use crate::condition::{Settings, SpikePolicy};
use crate::estimate::{Aid, EstimationSettings, Estimator, Meaning, RestartRequest, at_once};
use crate::propagate::{Method, Sequential};
use crate::record::{AttitudeSample, Declared, Nanos, RawSample, SampleKind, Status};

const HZ: usize = 200;

fn plan(aid: Aid, kind: SampleKind, spikes: SpikePolicy) -> EstimationSettings {
    EstimationSettings {
        method: Method::COMMIT,
        aid,
        kind: Some(kind),
        spikes,
        ..EstimationSettings::default()
    }
}

fn live(plan: &EstimationSettings, first: &RawSample) -> Estimator {
    let meaning = Meaning::new(plan, &Declared::default());
    let prepared = at_once(plan, &meaning, std::slice::from_ref(first)).unwrap();
    let mut estimator = Estimator::live(plan, &meaning, &prepared).unwrap();
    estimator.watch_sensors_live(&meaning, &prepared);
    estimator
}

/// Attitudes of samples that come in pieces of so many.
fn attitudes(estimator: &mut Estimator, raw: &[RawSample], piece: usize) -> Vec<AttitudeSample> {
    let mut out = Vec::new();
    for piece in raw.chunks(piece) {
        piece.iter().for_each(|raw| estimator.take(raw));
        out.extend_from_slice(estimator.attitudes(&Sequential));
    }
    out.extend(estimator.finish(&Sequential));
    out
}

fn run(plan: &EstimationSettings, raw: &[RawSample]) -> (Vec<AttitudeSample>, Estimator) {
    let mut estimator = live(plan, &raw[0]);
    let out = attitudes(&mut estimator, raw, 1);
    (out, estimator)
}

/// The samples as a recording of them is repaired.
fn repaired(raw: &[RawSample]) -> Vec<RawSample> {
    let (out, _) = conditioned(&Settings::default(), raw, raw.len());
    let both = raw.iter().zip(&out);
    both.map(|(raw, out)| RawSample {
        gyro: Some(rate(out).into()),
        accel: raw.accel.filter(|_| raw.is_beside || out.accel.is_some()),
        ..*raw
    })
    .collect()
}

/// Spikes: first sample, size in rad/s, number.
const SPIKES: [(usize, f64, usize); 8] = [
    (300, 30.0, 1),
    (900, -8.0, 2),
    (1200, 8.0, 1),
    (1500, 30.0, 2),
    (1703, -3.0, 1),
    (1706, 30.0, 1),
    (2000, 1.9, 1),
    (2500, 8.0, 2),
];

fn spiked() -> Vec<RawSample> {
    let mut raw = hand(20, HZ);
    for (n, (at, size, count)) in SPIKES.into_iter().enumerate() {
        for sample in raw.iter_mut().skip(at).take(count) {
            add(sample, n % 3, size);
        }
    }
    // A glitch of the whole bus.
    raw[1200].accel = Some([78.0, -78.0, 78.0]);
    raw
}

fn apart(a: &AttitudeSample, b: &AttitudeSample) -> f64 {
    a.q_nb.angle_to(&b.q_nb)
}

#[test]
fn from_the_sample_behind_a_spike_on_attitudes_are_those_of_a_repaired_recording() {
    let raw = spiked();
    let clean = repaired(&raw);
    for aid in [Aid::None, Aid::Gravity] {
        for kind in [SampleKind::Rate, SampleKind::Average] {
            let (expected, _) = run(&plan(aid, kind, SpikePolicy::Keep), &clean);
            let (kept, _) = run(&plan(aid, kind, SpikePolicy::Keep), &raw);
            let (found, estimator) = run(&plan(aid, kind, SpikePolicy::Repair), &raw);
            assert_eq!(found.len(), raw.len());
            let in_doubt = |n: usize| {
                SPIKES
                    .iter()
                    .any(|(at, _, count)| (*at..*at + count + 1).contains(&n))
            };
            for n in 0..raw.len() {
                if in_doubt(n) {
                    continue;
                }
                let off = apart(&found[n], &expected[n]);
                assert!(off < 1e-9, "{aid:?} {kind:?}: {off} rad at {n}");
                let sigma = |a: &AttitudeSample| a.covariance.sigma().map(|s| (s * 1e12).round());
                assert_eq!(sigma(&found[n]), sigma(&expected[n]), "{n}");
            }
            assert_eq!(found[300].q_nb, kept[300].q_nb, "it had left");
            assert!(apart(&kept[2999], &expected[2999]) > 0.05);
            let marks = found.iter().filter(|a| a.status.has(Status::REPAIRED));
            assert!(marks.count() >= SPIKES.len() - 1);
            assert!(found[301].status.has(Status::REPAIRED));
            let report = estimator.conditioning();
            let (_, of_recording) = conditioned(&Settings::default(), &raw, 100);
            assert_eq!(report.spikes, of_recording.spikes);
            assert!(report.spikes.samples >= 10, "{:?}", report.spikes);
            assert_eq!(
                (report.spikes_left.samples, report.counts.used()),
                (0, 4000)
            );
        }
    }
}

#[test]
fn a_force_that_is_a_glitch_is_taken_back() {
    let at = [300, 900, 901, 1700, 2600];
    let (mut raw, mut without) = (hand(20, HZ), hand(20, HZ));
    for n in at {
        raw[n].accel = raw[n].accel.map(|[x, y, z]| [x + 78.0, y - 30.0, z]);
        without[n].accel = None;
    }
    let of = |raw: &[RawSample], spikes| run(&plan(Aid::Gravity, SampleKind::Rate, spikes), raw);
    let (expected, _) = of(&without, SpikePolicy::Keep);
    let (kept, _) = of(&raw, SpikePolicy::Keep);
    let (found, estimator) = of(&raw, SpikePolicy::Repair);
    assert_eq!(estimator.conditioning().force_spikes.samples, 5);
    assert_eq!(estimator.conditioning().spikes.samples, 0);
    let worst = |of: &[AttitudeSample]| {
        let last = of.iter().zip(&expected).skip(2700);
        last.map(|(a, b)| apart(a, b)).fold(0.0, f64::max)
    };
    assert!(worst(&kept) > 1e-4, "{}", worst(&kept));
    assert!(worst(&found) < 1e-9, "{}", worst(&found));
}

#[test]
fn attitudes_are_the_same_however_samples_come() {
    let raw = spiked();
    for aid in [Aid::None, Aid::Gravity] {
        let plan = plan(aid, SampleKind::Rate, SpikePolicy::Repair);
        let (one_by_one, _) = run(&plan, &raw);
        for piece in [2, 3, 7, 64, 4000] {
            let found = attitudes(&mut live(&plan, &raw[0]), &raw, piece);
            assert_eq!(found, one_by_one, "{piece}");
        }
    }
}

#[test]
fn motion_that_begins_like_a_spike_keeps_its_bits() {
    let mut raw = hand(20, HZ);
    for (n, at) in (400..3800).step_by(170).enumerate() {
        // Blows that the accelerometer feels, steps that stay, pulses of 25 ms.
        let length = [2, 40, 5][n % 3];
        for (k, sample) in raw.iter_mut().enumerate().skip(at).take(length) {
            add(sample, n % 3, 6.0);
            if length == 2 {
                sample.accel = Some([20.0, 5.0 * (k % 2) as f64, -10.0]);
            }
        }
    }
    for aid in [Aid::None, Aid::Gravity] {
        let of = |spikes| run(&plan(aid, SampleKind::Rate, spikes), &raw);
        let (kept, _) = of(SpikePolicy::Keep);
        let (found, estimator) = of(SpikePolicy::Repair);
        assert_eq!(estimator.conditioning().spikes.samples, 0);
        assert_eq!(found, kept);
    }
}

#[test]
fn forces_in_messages_of_their_own_are_taken_again_with_the_rates() {
    let split = |raw: &[RawSample]| -> Vec<RawSample> {
        let both = raw.iter().flat_map(|raw| {
            let force = RawSample {
                gyro: None,
                is_beside: true,
                ..*raw
            };
            [
                force,
                RawSample {
                    accel: None,
                    ..*raw
                },
            ]
        });
        both.collect()
    };
    // Without a force only single ones far off are spikes.
    let mut raw = hand(20, HZ);
    for at in [900, 1700, 2600] {
        add(&mut raw[at], 0, 30.0);
    }
    let plan = |spikes| EstimationSettings {
        has_forces_beside: true,
        ..plan(Aid::Gravity, SampleKind::Rate, spikes)
    };
    let (expected, _) = run(&plan(SpikePolicy::Keep), &split(&repaired(&raw)));
    let (found, estimator) = run(&plan(SpikePolicy::Repair), &split(&raw));
    assert_eq!(estimator.conditioning().spikes.samples, 3);
    let off = found.iter().zip(&expected).map(|(a, b)| apart(a, b));
    let wrong: Vec<usize> = off
        .enumerate()
        .filter(|(_, off)| *off > 1e-9)
        .map(|(n, _)| n)
        .collect();
    assert_eq!(wrong, [900, 1700, 2600]);
}

#[test]
fn a_reset_a_heading_and_a_saved_state_amid_a_doubt_go_on_sanely() {
    let mut raw = hand(10, HZ);
    add(&mut raw[1500], 0, 30.0);
    let plan = plan(Aid::Gravity, SampleKind::Rate, SpikePolicy::Repair);
    let started = || {
        let mut estimator = live(&plan, &raw[0]);
        for raw in &raw[..1501] {
            estimator.take(raw);
            let _ = estimator.attitudes(&Sequential);
        }
        estimator
    };
    let mut other = live(&plan, &raw[0]);
    let mut same = started();
    let memory = same.memory().unwrap();
    assert!(other.recall(&memory));
    let rest = |estimator: &mut Estimator| attitudes(estimator, &raw[1501..], 1);
    let (goes_back, stays) = (rest(&mut same), rest(&mut other));
    assert_eq!(goes_back.len(), stays.len());
    assert!(goes_back[0].status.has(Status::REPAIRED) && !stays[0].status.has(Status::REPAIRED));

    let mut turned = started();
    assert!(turned.turn_heading(1.0));
    let turned = rest(&mut turned);
    let heading = turned[0].q_nb.yaw_pitch_roll().yaw;
    assert!((heading - 1.0).abs() < 1e-9, "{heading}");
    assert!(turned[0].status.has(Status::REPAIRED) && turned[0].status.has(Status::RESET));

    let mut reset = started();
    reset.begin_anew(&RestartRequest {
        attitude: crate::quaternion::Quaternion::identity(),
        start: crate::aid::Start::Known {
            tilt: 0.01,
            heading: 0.1,
        },
        origin: String::new(),
    });
    let reset = rest(&mut reset);
    assert!(reset[0].status.has(Status::RESET) && reset[0].q_nb.wxyz()[0] > 0.999);
    assert!(reset.iter().all(|a| !a.status.has(Status::REPAIRED)));
}

/// Fields at stamps of their own among the samples: in order, late, far ahead, doubled, and a clock that is set back.
fn with_fields(raw: Vec<RawSample>) -> Vec<RawSample> {
    let mut all = Vec::new();
    for (n, sample) in raw.into_iter().enumerate() {
        let jumped = n > 2000;
        let mut stamp = sample.header.unwrap_or_default();
        let sample = RawSample {
            header: Some(Nanos(stamp.0 - i64::from(jumped) * 40_000_000_000)),
            ..sample
        };
        stamp = sample.header.unwrap_or_default();
        let by = match n % 11 {
            3 => -12_000_000,
            5 => 7_000_000,
            8 => 300_000_000,
            9 => -700_000_000,
            _ => 0,
        };
        let angle = 0.01 * n as f64;
        let field = RawSample {
            header: Some(Nanos(stamp.0 + by)),
            log: sample.log,
            publish: sample.publish,
            mag: Some([20.0 * angle.cos(), 20.0 * angle.sin(), -40.0]),
            is_beside: true,
            ..RawSample::default()
        };
        if n % 2 == 0 {
            all.push(field);
        }
        all.push(sample);
        if n % 13 == 6 {
            all.push(field);
        }
    }
    all
}

#[test]
fn however_much_comes_at_once_the_bits_are_those_of_one_after_the_other() {
    let raw = with_fields(hand(20, HZ));
    for kind in [SampleKind::Rate, SampleKind::Average] {
        let plan = plan(Aid::GravityAndField, kind, SpikePolicy::Repair);
        let first = raw.iter().find(|raw| !raw.is_beside).unwrap();
        let of = |piece: usize| attitudes(&mut live(&plan, first), &raw, piece);
        let expected = of(1);
        assert!(expected.len() > 3900, "{}", expected.len());
        for piece in [7, 100, raw.len()] {
            assert!(of(piece) == expected, "{kind:?} in pieces of {piece}");
        }
    }
}

#[test]
fn a_smoother_has_the_same_bits_however_much_comes_at_once() {
    let raw = with_fields(hand(20, HZ));
    let plan = EstimationSettings {
        method: Method::Auto,
        smooth: true,
        ..plan(Aid::GravityAndField, SampleKind::Average, SpikePolicy::Keep)
    };
    let meaning = Meaning::new(&plan, &Declared::default());
    let first = raw.iter().find(|raw| !raw.is_beside).unwrap();
    let prepared = at_once(&plan, &meaning, std::slice::from_ref(first)).unwrap();
    let of = |piece: usize| {
        let mut estimator = Estimator::new(&plan, &meaning, &prepared).unwrap();
        attitudes(&mut estimator, &raw, piece)
    };
    let expected = of(1);
    assert!(expected.len() > 3900, "{}", expected.len());
    for piece in [7, raw.len()] {
        assert!(of(piece) == expected, "in pieces of {piece}");
    }
}

#[test]
fn wrong_first_samples_are_taken_back_once_those_behind_have_come() {
    let clean = hand(8, HZ);
    let mut first = clean.clone();
    let wrong = [[12.2, 16.3, -16.0], [11.5, -12.2, -13.0]];
    for (sample, wrong) in first.iter_mut().zip(wrong) {
        sample.gyro = Some(wrong);
    }
    // Amid the first ones, between neighbours.
    let mut tenth = clean.clone();
    add(&mut tenth[9], 1, -30.0);
    for (raw, at, count) in [(first, 0, 2), (tenth, 9, 1)] {
        let repaired = repaired(&raw);
        for aid in [Aid::None, Aid::Gravity] {
            let of = |raw: &[RawSample], spikes| run(&plan(aid, SampleKind::Rate, spikes), raw);
            let (expected, _) = of(&repaired, SpikePolicy::Keep);
            let (kept, _) = of(&raw, SpikePolicy::Keep);
            let (found, estimator) = of(&raw, SpikePolicy::Repair);
            let report = estimator.conditioning();
            let counts = (report.spikes.samples, report.spikes_left.samples);
            assert_eq!(counts, (count, 0), "{aid:?} {at}");
            // It has sixteen behind it then.
            for n in at + 17..raw.len() {
                let off = apart(&found[n], &expected[n]);
                assert!(off < 1e-9, "{aid:?} {at}: {off} rad at {n}");
            }
            assert!(apart(&kept[60], &expected[60]) > 0.01);
        }
    }
    // Who begins in motion is doubted, and keeps every bit.
    let moving = clean.get(4 * HZ..).unwrap();
    let of = |spikes| run(&plan(Aid::Gravity, SampleKind::Rate, spikes), moving).0;
    let (found, kept) = (of(SpikePolicy::Repair), of(SpikePolicy::Keep));
    assert!(found.iter().zip(&kept).all(|(a, b)| a.q_nb == b.q_nb));
}
