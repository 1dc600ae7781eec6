//! Promise: where a sensor samples evenly and its stamps jitter, `--regularise-stamps` gives back
//! nearly all the accuracy (`docs/theory/attitude.md` 6.4); it is never done unasked, and never silently.

mod files;
mod segments;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use strapd_attitude::condition::regularise::{Lines, Regulariser, Report, Survey, Value};
use strapd_attitude::condition::{Conditioner, Settings as Conditioning, StampRepair};
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::propagate::{Method, Order, Placement, Propagator, Sequential, Settings};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeSample, Nanos, RateSample, RawSample, SampleKind};
use strapd_bodies::motion::BandLimited;

/// 200 Hz, 2024.
const STEP: i64 = 5_000_000;
const START: i64 = 1_710_000_000_000_000_000;
const SECONDS: i64 = 60;
const ARCSEC: f64 = 180.0 * 3600.0 / std::f64::consts::PI;

/// A normal deviate.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let u: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
    let v: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    (-2.0 * u.ln()).sqrt() * v.cos()
}

/// Log of what was measured, when it truly was, and the truth then.
struct Log {
    raw: Vec<RawSample>,
    truth: Vec<Quaternion<Nav, Body>>,
}

/// Faults of a log: where its jitter is.
#[derive(Clone, Copy)]
struct Faults {
    /// Standard deviation of the stamps' noise, parts of a step: stamps lie, sampling is even.
    stamps: f64,
    /// Half-width of the sampling's own jitter, parts of a step: stamps are true.
    sampling: f64,
    /// Part of the samples that are missing.
    lost: f64,
}

const EVEN: Faults = Faults {
    stamps: 0.0,
    sampling: 0.0,
    lost: 0.0,
};

/// The same motion at the same instants, stamped with noise.
fn restamped(even: &Log, seed: u64, sigma: f64) -> Log {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let raw = even.raw.iter().map(|raw| {
        let noise = (sigma * normal(&mut rng) * STEP as f64).round() as i64;
        RawSample {
            header: raw.header.map(|stamp| Nanos(stamp.0 + noise)),
            ..*raw
        }
    });
    Log {
        raw: raw.collect(),
        truth: even.truth.clone(),
    }
}

/// Random motion of 2 rad/s rms about each axis up to a tenth of the sampling rate.
fn log(seed: u64, kind: SampleKind, faults: Faults) -> Log {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut motion = BandLimited::random(seed, 2.0, 20.0, 40).unwrap();
    let mut log = Log {
        raw: Vec::new(),
        truth: Vec::new(),
    };
    let mut before = 0;
    for k in 1..=SECONDS * 1_000_000_000 / STEP {
        let at = k * STEP + (faults.sampling * rng.random_range(-1.0..1.0) * STEP as f64) as i64;
        let stamp = at + (faults.stamps * normal(&mut rng) * STEP as f64).round() as i64;
        let (from, to) = (before as u64, at as u64);
        before = at;
        if k > 40 && rng.random_range(0.0..1.0) < faults.lost {
            continue;
        }
        let spin = motion.at_nanos(to);
        let angle = motion.delta_angle(from, to);
        log.raw.push(RawSample {
            header: Some(Nanos(START + stamp)),
            log: Nanos(START + stamp),
            gyro: Some(match kind {
                SampleKind::Rate => spin.w_nb_b.into(),
                SampleKind::Average => (angle / ((to - from) as f64 * 1e-9)).into(),
                SampleKind::DeltaAngle | SampleKind::Rotation => angle.into(),
            }),
            ..RawSample::default()
        });
        log.truth.push(spin.q_nb);
    }
    log
}

fn conditioned(raw: &[RawSample], kind: SampleKind) -> Vec<RateSample> {
    let settings = Conditioning {
        kind,
        // As an estimation whose stamps are straightened has them.
        repair: StampRepair::AsRecorded,
        ..Conditioning::default()
    };
    let mut conditioner = Conditioner::new(&settings).unwrap();
    let mut out = Vec::new();
    conditioner.push(raw, &mut out);
    conditioner.finish(&mut out);
    out
}

fn lines(samples: &[RateSample]) -> Lines {
    let mut survey = Survey::new();
    samples.iter().for_each(|s| survey.push(s));
    survey.finish().unwrap()
}

fn through(mut regulariser: Regulariser, samples: &[RateSample]) -> (Vec<RateSample>, Report) {
    let mut out = Vec::new();
    for cut in samples.chunks(501) {
        regulariser.push(cut, &mut out);
    }
    regulariser.finish(&mut out);
    assert_eq!(out.len(), samples.len(), "every sample comes out once");
    (out, regulariser.report())
}

fn offline(samples: &[RateSample], kind: SampleKind) -> (Vec<RateSample>, Report) {
    let lines = Arc::new(lines(samples));
    through(
        Regulariser::by_lines(lines, Value::of(kind, false)),
        samples,
    )
}

fn causal(samples: &[RateSample], kind: SampleKind) -> (Vec<RateSample>, Report) {
    through(Regulariser::causal(Value::of(kind, false)), samples)
}

/// Largest error of what was turned since shortly after the start, arc seconds.
fn error(samples: &[RateSample], log: &Log, kind: SampleKind, method: Method) -> f64 {
    let mut propagator = Propagator::new(Settings {
        method,
        kind,
        initial: log.truth[0],
        ..Settings::default()
    })
    .unwrap();
    let mut out: Vec<AttitudeSample> = Vec::new();
    propagator.push(samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    assert_eq!(out.len(), log.truth.len());
    let margin = 24;
    (margin..out.len() - margin)
        .map(|i| {
            let estimate = out[margin].q_nb.inverse() * out[i].q_nb;
            let truth = log.truth[margin].inverse() * log.truth[i];
            estimate.angle_to(&truth) * ARCSEC
        })
        .fold(0.0, f64::max)
}

/// Centred, eight samples: what the theory's row was measured with.
const EIGHT: Method = Method::Magnus {
    window: 8,
    order: Order::M8,
    placement: Placement::Centred,
};

#[test]
fn lines_restore_what_noisy_stamps_cost_and_the_tracker_most_of_it() {
    // sigma of the stamps in steps: raw, lines, tracker, arc seconds (docs/theory/attitude.md 6.4). The greatest error
    // of a minute hangs on the motion drawn: the median of three is within twice of the theory's one.
    let logs = [1, 2, 3].map(|seed| log(seed, SampleKind::Rate, EVEN));
    for (sigma, raw, lines, tracker) in [
        (0.001, 135.0, 0.15, 3.3),
        (0.01, 1750.0, 0.15, 43.0),
        (0.05, 7010.0, 0.16, 207.0),
    ] {
        let mut found = [[0.0; 3]; 3];
        for (seed, even) in logs.iter().enumerate() {
            let log = restamped(even, seed as u64, sigma);
            let recorded = conditioned(&log.raw, SampleKind::Rate);
            let (even, report) = offline(&recorded, SampleKind::Rate);
            let (live, _) = causal(&recorded, SampleKind::Rate);
            for (i, samples) in [&recorded, &even, &live].into_iter().enumerate() {
                found[i][seed] = error(samples, &log, SampleKind::Rate, EIGHT);
            }
            assert_eq!((report.segments, report.ambiguous), (1, 0), "{sigma}");
            assert!((report.jitter / sigma - 1.0).abs() < 0.03, "{report:?}");
            let hz = report.kept[0].rate_hz.unwrap();
            // Slope of a line through n points: sigma sqrt(12 / n^3), five of them.
            assert!((hz / 200.0 - 1.0).abs() < 5.0 * sigma * 2.7e-6, "{hz}");
        }
        eprintln!("sigma {sigma}: raw, lines, tracker {found:.3?} arcsec");
        let [found_raw, found_lines, found_tracker] = found.map(|mut three| {
            three.sort_by(f64::total_cmp);
            three[1]
        });
        assert!(
            found_raw > 0.5 * raw && found_raw < 2.0 * raw,
            "{sigma}: {found_raw}"
        );
        assert!(found_lines < 2.0 * lines, "{sigma}: {found_lines}");
        assert!(found_tracker < 2.0 * tracker, "{sigma}: {found_tracker}");
    }
}

#[test]
fn missing_samples_keep_their_place() {
    for sigma in [0.01, 0.05] {
        let faults = |stamps| Faults {
            stamps,
            lost: 0.01,
            ..EVEN
        };
        let log_true = log(2, SampleKind::Rate, faults(0.0));
        let log = log(2, SampleKind::Rate, faults(sigma));
        let recorded = conditioned(&log.raw, SampleKind::Rate);
        let (even, report) = offline(&recorded, SampleKind::Rate);
        let found = error(&even, &log, SampleKind::Rate, Method::Auto);
        let raw = error(&recorded, &log, SampleKind::Rate, Method::Auto);
        let true_stamps = conditioned(&log_true.raw, SampleKind::Rate);
        let best = error(&true_stamps, &log_true, SampleKind::Rate, Method::Auto);
        eprintln!("lost 1 %, sigma {sigma}: raw {raw:.1}, lines {found:.3}, true {best:.3} arcsec");
        assert!(
            found < 1.5 * best + 0.3,
            "{found} arcsec, true stamps {best}"
        );
        assert!(raw > 100.0 * found, "{raw}");
        assert_eq!((report.segments, report.ambiguous), (1, 0));
        // A sample counted wrongly would stand a whole step off.
        assert!(report.max_nanos < STEP / 2, "{report:?}");
    }
}

#[test]
fn true_jitter_of_the_sampling_is_hurt_by_it() {
    // The other case: the stamps are right, and moving them is the error. Nothing in the stamps tells.
    let faults = Faults {
        sampling: 0.2,
        ..EVEN
    };
    let log = log(3, SampleKind::Rate, faults);
    let recorded = conditioned(&log.raw, SampleKind::Rate);
    let raw = error(&recorded, &log, SampleKind::Rate, EIGHT);
    let (even, report) = offline(&recorded, SampleKind::Rate);
    let moved = error(&even, &log, SampleKind::Rate, EIGHT);
    eprintln!("true jitter of 20 %: as recorded {raw:.2}, regularised {moved:.0} arcsec");
    assert!(raw < 2.0 * 0.73, "{raw} arcsec");
    assert!(moved > 1000.0 * raw, "{moved} arcsec");
    // It looks like any even clock with noisy stamps: uniform over +-0.2 is 0.115 rms.
    assert_eq!(report.segments, 1);
    assert!((report.jitter - 0.2 / 3.0_f64.sqrt()).abs() < 0.005);
}

#[test]
fn means_and_angles_keep_their_intervals_joined_and_means_follow_them() {
    for kind in [SampleKind::Average, SampleKind::DeltaAngle] {
        let faults = Faults {
            stamps: 0.01,
            lost: 0.002,
            ..EVEN
        };
        let log = log(4, kind, faults);
        let recorded = conditioned(&log.raw, kind);
        for (what, (even, _)) in [
            ("lines", offline(&recorded, kind)),
            ("tracker", causal(&recorded, kind)),
        ] {
            for (i, (old, new)) in recorded.windows(2).zip(even.windows(2)).enumerate() {
                let joined = old[1].start == old[0].stamp;
                assert_eq!(new[1].start == new[0].stamp, joined, "{what} {kind:?} {i}");
                assert!(new[1].start < new[1].stamp && new[1].start >= new[0].stamp);
                let rate = |s: &RateSample| s.gyro.as_vector() / s.stamp.secs_since(s.start);
                if kind == SampleKind::Average {
                    // The mean rate is what was measured.
                    assert!((rate(&new[1]) - rate(&old[1])).norm() < 1e-9, "{what} {i}");
                } else {
                    assert_eq!(new[1].gyro, old[1].gyro, "{what} {i}");
                }
            }
        }
        if kind == SampleKind::Average {
            let (even, _) = offline(&recorded, kind);
            let found = error(&even, &log, kind, Method::Auto);
            let raw = error(&recorded, &log, kind, Method::Auto);
            eprintln!("{kind:?}: raw {raw:.1}, lines {found:.3} arcsec");
            assert!(raw > 50.0 * found, "{raw} {found}");
        }
    }
    // Where the messages say how long they integrated, the angle was measured by a better clock.
    assert_eq!(Value::of(SampleKind::Average, true), Value::Angle);
}
