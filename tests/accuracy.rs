//! How far from truth the propagator is, in degrees and arc seconds, against motions known otherwise.
//! The tables are those of `attitude.md` 6 and `top.md` 4.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "accuracy/double.rs"]
mod double;
#[path = "accuracy/run.rs"]
mod run;
#[path = "shared_data/mod.rs"]
mod shared_data;
#[path = "accuracy/top.rs"]
mod top;

use run::{angle_degrees, propagate, sample, worst};
use strapd::propagate::{Method, Order, Placement};
use strapd::record::{RateSample, SampleKind};
use top::{FINE_RATE, Top};

const TOP_STEPS: usize = FINE_RATE * 6 / 5;

fn centred(window: usize, order: Order) -> Method {
    Method::Magnus {
        window,
        order,
        placement: Placement::Centred,
    }
}

fn causal(window: usize, order: Order) -> Method {
    Method::Magnus {
        window,
        order,
        placement: Placement::Causal,
    }
}

fn top_error(top: &Top, rate: usize, method: Method, kind: SampleKind) -> f64 {
    let skip = FINE_RATE / rate;
    let step = 1_000_000_000 / rate as i64;
    let samples: Vec<RateSample> = (0..top.q.len())
        .step_by(skip)
        .enumerate()
        .map(|(i, k)| {
            let stamp = i as i64 * step;
            if kind == SampleKind::Rate {
                return sample(stamp, stamp, top.w[k]);
            }
            let before = if i == 0 { 0 } else { k - skip };
            let delta = std::array::from_fn(|a| (top.angle[k][a] - top.angle[before][a]).value());
            sample(if i == 0 { stamp } else { stamp - step }, stamp, delta)
        })
        .collect();
    let out = propagate(method, kind, top.q[0], &samples);
    worst(&out, |i| top.q[i * skip])
}

#[test]
fn print_table() {
    let top = top::cusped(TOP_STEPS);
    for (name, method) in [
        ("left", Method::DcmLeft),
        ("right", Method::DcmRight),
        ("mean", Method::DcmMean),
        ("rk4", Method::Rk4),
        ("causal3", causal(3, Order::M6)),
        ("causal4", causal(4, Order::M6)),
        ("causal5", causal(5, Order::M6)),
        ("causal6", causal(6, Order::M6)),
        ("commit6", Method::CommitProvisional { window: 6, order: Order::M8, finals: false }),
        ("commit8", Method::CommitProvisional { window: 8, order: Order::M8, finals: false }),
        ("c4", centred(4, Order::M8)),
        ("c6", centred(6, Order::M8)),
        ("c8", centred(8, Order::M8)),
        ("c10", centred(10, Order::M8)),
        ("c6 m2", centred(6, Order::M2)),
        ("c6 m4", centred(6, Order::M4)),
        ("c6 m6", centred(6, Order::M6)),
        ("c6 ex", centred(6, Order::Exact)),
        ("auto", Method::Auto),
    ] {
        let e: Vec<String> = [500, 1000, 2000, 4000].iter().map(|&r| format!("{:.2e}", top_error(&top, r, method, SampleKind::Rate))).collect();
        let d: Vec<String> = [500, 1000, 2000, 4000].iter().map(|&r| format!("{:.2e}", top_error(&top, r, method, SampleKind::DeltaAngle))).collect();
        eprintln!("{name:10} {} | {}", e.join(" "), d.join(" "));
    }
}
