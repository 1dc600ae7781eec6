//! Commit/provisional: which window, and what its final outputs are (`docs/theory/attitude.md` 4.3).

use super::centred;
use super::coning::Coning;
use super::run::{propagator, sample};
use nalgebra::Vector3;
use strapd_attitude::frames::In;
use strapd_attitude::propagate::{Method, Order, Sequential};
use strapd_attitude::record::{AttitudeSample, Join, Nanos, RateSample, SampleKind, Status};

const CONE: Coning = Coning {
    a: 0.17,
    cone: 5,
    sampling: 100,
};
const STEP: i64 = 10_000_000;

/// Samples told apart by everything they carry: one shares its predecessor's stamp, one follows a loss.
fn samples(kind: SampleKind) -> Vec<RateSample> {
    let mut samples: Vec<RateSample> = (0..60)
        .filter(|k| *k != 30)
        .map(|k| {
            let mut sample = match kind {
                SampleKind::Rate => sample(k * STEP, k * STEP, CONE.rate(k)),
                _ => sample((k - 1) * STEP, k * STEP, CONE.increment(k)),
            };
            sample.accel = Some(In::assume(Vector3::new(k as f64, 0.0, 9.8)));
            sample.log = Nanos(k * STEP + 123_456);
            if k == 31 {
                sample.join = Join::Bridge;
            }
            if k % 7 == 0 {
                sample.status = Status::REORDERED;
            }
            sample
        })
        .collect();
    let mut again = samples[40];
    again.log = Nanos(again.log.0 + 1);
    samples.insert(41, again);
    samples
}

fn run(method: Method, kind: SampleKind, samples: &[RateSample]) -> Vec<AttitudeSample> {
    let mut propagator = propagator(method, kind, CONE.attitude(0));
    let mut out = Vec::new();
    for sample in samples {
        propagator.push(std::slice::from_ref(sample), &Sequential, &mut out);
    }
    propagator.finish(&Sequential, &mut out);
    assert_eq!(propagator.report().samples, samples.len() as u64);
    out
}

#[test]
fn commit_by_name_takes_six_rates_or_five_increments() {
    let named = Method::COMMIT;
    for (kind, expected) in [
        (SampleKind::Rate, 6),
        (SampleKind::Average, 5),
        (SampleKind::DeltaAngle, 5),
    ] {
        let method = propagator(named, kind, CONE.attitude(0)).method();
        assert!(
            matches!(method, Method::CommitProvisional { window, order: Order::M8, finals: false } if window == expected),
            "{kind:?}: {method}"
        );
    }
}

#[test]
fn finals_are_the_same_samples_again_with_the_attitude_of_centred_windows() {
    for (kind, window) in [(SampleKind::Rate, 6), (SampleKind::DeltaAngle, 5)] {
        let samples = samples(kind);
        let live = Method::Live {
            order: Order::M8,
            finals: true,
        };
        let (last, provisional): (Vec<_>, Vec<_>) = run(live, kind, &samples)
            .into_iter()
            .partition(|a| !a.status.has(Status::PROVISIONAL));
        let settled = run(centred(window, Order::M8), kind, &samples);
        assert_eq!(last.len(), samples.len(), "{kind:?}: one for each sample");
        // The first sample turns nothing: it is final at once.
        assert_eq!(provisional.len(), samples.len() - 1);
        for (i, (last, settled)) in last.iter().zip(&settled).enumerate() {
            // Attitude to the bit, stamp, log stamp, acceleration, rate, status, uncertainty.
            assert_eq!(last, settled, "{kind:?}, sample {i}");
            assert_eq!(last.accel, samples[i].accel);
            assert_eq!(last.log, samples[i].log);
        }
        assert!(last[30].status.has(Status::BRIDGED) && last[28].status.has(Status::REORDERED));
        for (provisional, last) in provisional.iter().zip(&last[1..]) {
            assert_eq!((provisional.log, provisional.accel), (last.log, last.accel));
        }
    }
}

#[test]
fn without_look_ahead_each_output_is_final_once_and_says_what_happened() {
    for finals in [false, true] {
        let method = Method::CommitProvisional {
            window: 2,
            order: Order::M4,
            finals,
        };
        let samples = samples(SampleKind::Rate);
        let out = run(method, SampleKind::Rate, &samples);
        assert_eq!(out.len(), samples.len());
        assert!(out.iter().all(|a| !a.status.has(Status::PROVISIONAL)));
        let bridged: Vec<usize> = (0..out.len())
            .filter(|&i| out[i].status.has(Status::BRIDGED))
            .collect();
        assert_eq!(bridged, [30]);
    }
}
