//! Order of convergence with the sampling interval, method by method, on the top and on random smooth motion; and
//! the columns of the coning table (`docs/theory/attitude.md` 6.1) that one sampling rate and ten degrees do not show.

use super::coning::Coning;
use super::run::{propagate, sample, worst_inside};
use super::{MARGIN, assert_near, causal, centred, commit, coning_error, top_error_inside};
use strapd_attitude::propagate::{Method, Order};
use strapd_attitude::record::{RateSample, SampleKind};
use strapd_bodies::motion::BandLimited;

/// Order expected of a method, and the sampling rates on the top between which it shows: slow enough that the
/// error is above rounding, fast enough that the next term of it is small.
const ORDERS: [(Method, SampleKind, f64, usize); 17] = {
    const RATE: SampleKind = SampleKind::Rate;
    const DELTA: SampleKind = SampleKind::DeltaAngle;
    const EXACT: Order = Order::Exact;
    [
        (Method::DcmLeft, RATE, 1.0, 1000),
        (Method::DcmRight, RATE, 1.0, 1000),
        (Method::DcmMean, RATE, 2.0, 1000),
        (Method::Rk4, RATE, 2.0, 1000),
        (causal(3, Order::M6), RATE, 3.0, 1000),
        (causal(4, Order::M6), RATE, 4.0, 2000),
        (causal(5, Order::M6), RATE, 5.0, 2000),
        (commit(4), RATE, 4.0, 1000),
        (commit(6), RATE, 6.0, 1000),
        (centred(4, EXACT), RATE, 4.0, 1000),
        (centred(6, EXACT), RATE, 6.0, 1000),
        (centred(8, EXACT), RATE, 8.0, 500),
        (Method::DcmRight, DELTA, 2.0, 1000),
        (Method::Coning2, DELTA, 4.0, 1000),
        (Method::Coning3, DELTA, 3.0, 1000),
        (centred(5, EXACT), DELTA, 6.0, 1000),
        (centred(7, EXACT), DELTA, 8.0, 500),
    ]
};

#[test]
fn each_method_has_its_order_on_the_top() {
    for (method, kind, expected, rate) in ORDERS {
        let coarse = top_error_inside(rate, method, kind);
        let fine = top_error_inside(2 * rate, method, kind);
        let found = (coarse / fine).log2();
        eprintln!("{method}, {}: order {found:.2}", kind.name());
        assert!(
            (found - expected).abs() < 0.3,
            "{method}, {kind:?}: order {found:.2}, {coarse:e} and {fine:e} degrees"
        );
    }
}

/// Greatest error in degrees over 10 s of motion up to 2 Hz, 2 rad/s rms about each axis.
fn on_random_motion(method: Method, kind: SampleKind, rate: u64) -> f64 {
    let mut motion = BandLimited::random(7, 2.0, 2.0, 40).unwrap();
    let step = 1_000_000_000 / rate;
    let (mut samples, mut truth) = (Vec::<RateSample>::new(), Vec::new());
    for k in 0..=10 * rate {
        let (before, now) = (k.saturating_sub(1) * step, k * step);
        let spin = motion.at_nanos(now);
        samples.push(match kind {
            SampleKind::Rate => sample(now as i64, now as i64, spin.w_nb_b.into()),
            _ => sample(
                before as i64,
                now as i64,
                motion.delta_angle(before, now).into(),
            ),
        });
        truth.push(spin.q_nb.wxyz());
    }
    let block = if matches!(method, Method::Coning2) {
        2
    } else {
        1
    };
    let out: Vec<_> = propagate(method, kind, truth[0], &samples)
        .into_iter()
        .step_by(block)
        .collect();
    worst_inside(&out, |i| truth[i * block], MARGIN)
}

#[test]
fn each_method_has_its_order_on_random_smooth_motion() {
    let mut off = Vec::new();
    for (method, kind, expected, _) in ORDERS {
        // Blocks of three do not fit the seconds; theirs is on the top.
        if matches!(method, Method::Coning3) {
            continue;
        }
        // A low order shows late, a high one meets rounding early.
        let rate = match expected {
            order if order < 3.0 => 400,
            order if order < 6.0 => 100,
            _ => 50,
        };
        let coarse = on_random_motion(method, kind, rate);
        let fine = on_random_motion(method, kind, 2 * rate);
        let found = (coarse / fine).log2();
        eprintln!(
            "{method}, {}: order {found:.2}, {coarse:.1e} degrees",
            kind.name()
        );
        if (found - expected).abs() >= 0.3 {
            off.push(format!("{method}, {kind:?}: order {found:.2}"));
        }
    }
    assert!(off.is_empty(), "{off:#?}");
}

#[test]
fn the_other_columns_of_the_coning_table_are_reproduced() {
    const RATE: SampleKind = SampleKind::Rate;
    const DELTA: SampleKind = SampleKind::DeltaAngle;
    const NONE: f64 = f64::NAN;
    // Half angle 10 degrees with .001 and .2; 1 degree with .01, .03, .1, .2, .3. NaN: wrapped, or the table's own
    // rounding.
    let columns = [
        (10.0, 1, 1000),
        (10.0, 20, 100),
        (1.0, 1, 100),
        (1.0, 3, 100),
        (1.0, 10, 100),
        (1.0, 20, 100),
        (1.0, 30, 100),
    ];
    let rows: [(Method, SampleKind, [f64; 7]); 13] = [
        (
            Method::DcmRight,
            RATE,
            [2.3e2, NONE, 2.3e2, 6.9e2, 4.5e3, 3.2e4, 1.1e5],
        ),
        (
            Method::DcmMean,
            RATE,
            [1.5, NONE, 16.0, 4.2e2, 1.5e4, 1.0e5, 2.7e5],
        ),
        (
            causal(3, Order::M6),
            RATE,
            [7.4e-4, NONE, 7.5e-2, 2.5, 5.8e2, 1.5e4, 8.8e4],
        ),
        (
            causal(5, Order::M6),
            RATE,
            [1.3e-8, NONE, 1.4e-4, 8.3e-2, 3.0e2, 2.2e4, 1.4e5],
        ),
        (
            commit(6),
            RATE,
            [NONE, NONE, 4.8e-6, 1.0e-2, 43.0, 4.4e3, 5.2e4],
        ),
        (
            commit(8),
            RATE,
            [NONE, 1.3e5, 4.3e-9, 7.9e-5, 3.6, 1.4e3, 3.1e4],
        ),
        (
            centred(8, Order::M8),
            RATE,
            [NONE, 1.3e5, 4.1e-9, 7.7e-5, 3.6, 1.3e3, 3.1e4],
        ),
        (
            Method::Auto,
            RATE,
            [NONE, 1.4e3, NONE, NONE, 2.1e-4, 14.0, 4.3e3],
        ),
        (
            Method::DcmRight,
            DELTA,
            [0.77, NONE, 7.7, 2.1e2, 7.6e3, 5.7e4, 1.7e5],
        ),
        (
            Method::Coning3,
            DELTA,
            [6.1e-5, NONE, 6.3e-5, 1.1e-2, 48.0, 4.9e3, 5.7e4],
        ),
        (
            Method::Coning4,
            DELTA,
            [2.0e-4, NONE, 2.0e-4, 6.4e-3, 7.3, 1.6e3, 3.4e4],
        ),
        (
            commit(7),
            DELTA,
            [NONE, 1.3e5, 3.9e-9, 7.7e-5, 3.6, 1.3e3, 3.1e4],
        ),
        (
            Method::Auto,
            DELTA,
            [NONE, 1.4e3, NONE, NONE, 2.1e-4, 14.0, 4.3e3],
        ),
    ];
    for (method, kind, row) in rows {
        for ((degrees, cone, sampling), expected) in columns.into_iter().zip(row) {
            if expected.is_nan() {
                continue;
            }
            let cone = Coning {
                a: f64::to_radians(degrees),
                cone,
                sampling,
            };
            // A minute at 100 Hz: only the ratio of the frequencies counts.
            let found = coning_error(&cone, method, kind, 6001);
            assert_near(
                found,
                expected,
                0.2,
                &format!(
                    "{method}, {kind:?}, {degrees} degrees, {}/{sampling}",
                    cone.cone
                ),
            );
        }
    }
}
