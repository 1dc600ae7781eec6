//! The integration error that a run reports of itself, against the true one: never below it, and no further
//! above it than the error of the narrower window it is compared with.

use super::random;
use super::run::{self, sample, worst};
use super::{FINE, causal, centred, coning::Coning, seed_top};
use strapd_attitude::propagate::{Method, Order, Placement, Sequential};
use strapd_attitude::record::{RateSample, SampleKind};

/// Worst true error and reported one, degrees.
fn errors(
    method: Method,
    kind: SampleKind,
    samples: &[RateSample],
    truth: impl Fn(usize) -> [f64; 4],
) -> (f64, Option<f64>) {
    let mut propagator = run::propagator(method, kind, truth(0));
    let mut out = Vec::new();
    propagator.push(samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    let reported = propagator.report().integration_error;
    (worst(&out, truth), reported.map(f64::to_degrees))
}

fn live(window: usize) -> Method {
    Method::CommitProvisional {
        window,
        order: Order::M8,
        finals: false,
    }
}

/// Whether it has all its samples for every step.
fn waits(method: Method) -> bool {
    match method {
        Method::Magnus { placement, .. } => placement == Placement::Centred,
        Method::CommitProvisional { .. } => false,
        _ => true,
    }
}

/// Wide methods, and the narrow one each is held against.
fn pairs(kind: SampleKind) -> Vec<(Method, Method)> {
    if kind == SampleKind::Rate {
        vec![
            (Method::Auto, centred(12, Order::Exact)),
            (centred(10, Order::M8), centred(6, Order::M8)),
            (centred(8, Order::M8), centred(4, Order::M8)),
            (centred(6, Order::M8), centred(2, Order::M8)),
            (causal(8, Order::M8), causal(4, Order::M8)),
            (live(8), live(4)),
        ]
    } else {
        vec![
            (Method::Auto, centred(11, Order::Exact)),
            (centred(9, Order::M8), centred(5, Order::M8)),
            (centred(7, Order::M8), centred(3, Order::M8)),
            (centred(5, Order::M8), centred(1, Order::M8)),
            (live(7), live(3)),
        ]
    }
}

/// The reported error, degrees, of each wide method against its own true error and that of the narrow one; truth
/// itself is `uncertain` by so many degrees.
fn check(
    what: &str,
    kind: SampleKind,
    samples: &[RateSample],
    truth: impl Fn(usize) -> [f64; 4],
    uncertain: f64,
) {
    for (wide, narrow) in pairs(kind) {
        let (own, reported) = errors(wide, kind, samples, &truth);
        let (narrower, _) = errors(narrow, kind, samples, &truth);
        let reported = reported.unwrap();
        assert!(
            reported >= own - uncertain,
            "{what}, {kind:?}, {wide}: {reported:e} but {own:e}"
        );
        // And no scare: of the size of the narrower one's, or of rounding. The ends of a run are held
        // against windows of four samples less than there are, down to two where a method does not wait.
        let factor = if waits(wide) { 10.0 } else { 30.0 };
        assert!(
            reported <= factor * narrower + 5e-12 + uncertain,
            "{what}, {kind:?}, {wide}: {reported:e} but {narrower:e}"
        );
    }
}

/// Start of a sample: a rate at its stamp, an increment a step before it, but for the first.
fn begin(kind: SampleKind, is_first: bool, stamp: i64, step: i64) -> i64 {
    match kind {
        SampleKind::Rate => stamp,
        _ if is_first => stamp,
        _ => stamp - step,
    }
}

#[test]
fn on_the_top() {
    let top = seed_top();
    for rate in [500, 1000, 2000] {
        let skip = FINE / rate;
        let step = (1_000_000_000 / rate) as i64;
        for kind in [SampleKind::Rate, SampleKind::DeltaAngle] {
            let samples: Vec<RateSample> = (0..top.q.len())
                .step_by(skip)
                .enumerate()
                .map(|(i, k)| {
                    let stamp = i as i64 * step;
                    let before = k.saturating_sub(skip);
                    let value = if kind == SampleKind::Rate {
                        top.w[k]
                    } else {
                        std::array::from_fn(|a| (top.angle[k][a] - top.angle[before][a]).value())
                    };
                    sample(begin(kind, i == 0, stamp, step), stamp, value)
                })
                .collect();
            check(
                &format!("top at {rate} Hz"),
                kind,
                &samples,
                |i| top.q[i * skip],
                0.0,
            );
        }
    }
}

#[test]
fn on_coning() {
    for cone in [1, 3, 10] {
        let coning = Coning {
            a: 10f64.to_radians(),
            cone,
            sampling: 100,
        };
        for kind in [SampleKind::Rate, SampleKind::DeltaAngle] {
            let samples: Vec<RateSample> = (0..1000)
                .map(|k| {
                    let stamp = k * 10_000_000;
                    let value = if kind == SampleKind::Rate {
                        coning.rate(k)
                    } else {
                        coning.increment(k)
                    };
                    let begin = begin(kind, k == 0, stamp, 10_000_000);
                    sample(begin, stamp, value)
                })
                .collect();
            let truth = |i: usize| coning.attitude(i as i64);
            check(&format!("coning at {cone} Hz"), kind, &samples, truth, 0.0);
        }
    }
}

#[test]
fn on_random_motion_with_jitter() {
    for part in [0.05, 0.1] {
        let log = random::recorded(1, part, 0.2);
        let truth = |i: usize| log.truth[i];
        // Truth is a power series: it is uncertain by rounding alone.
        let uncertain = 1e-13;
        let what = format!("random, {part} of the rate");
        check(&what, SampleKind::Rate, &log.rates, truth, uncertain);
        check(
            &what,
            SampleKind::DeltaAngle,
            &log.increments,
            truth,
            uncertain,
        );
    }
}

#[test]
fn a_method_without_a_narrower_one_says_that_it_does_not_know() {
    let samples: Vec<RateSample> = (0..100).map(|k| sample(k, k, [1.0, 0.0, 0.0])).collect();
    let reported = |method, kind| errors(method, kind, &samples, |_| [1.0, 0.0, 0.0, 0.0]).1;
    for method in [
        Method::DcmLeft,
        Method::Rk4,
        Method::Coning3,
        Method::RotvecSum,
        centred(5, Order::M8),
        // What M4 leaves out is the same for both windows.
        centred(8, Order::M4),
        causal(4, Order::Exact),
    ] {
        assert_eq!(reported(method, SampleKind::Rate), None, "{method}");
    }
    assert!(reported(centred(6, Order::M4), SampleKind::Rate).is_some());
    assert!(reported(centred(5, Order::M8), SampleKind::Average).is_some());
    assert!(reported(Method::Auto, SampleKind::Rate).unwrap() < 1e-9);
}
