//! The top.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod shared_data;

use serde_json::Value;
use strapd::model::attitude::Quaternion;
use strapd::model::frames::{Body, Nav};
use strapd::model::top::*;

fn angle(a: &Quaternion<Nav, Body>, b: &Quaternion<Nav, Body>) -> f64 {
    let (a, b) = (a.wxyz(), b.wxyz());
    // Chord on the sphere of quaternions, sign taken out; good to one rounding near zero.
    let d = |s: f64| {
        a.iter()
            .zip(b)
            .map(|(x, y)| (x - s * y).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    4.0 * (0.5 * d(1.0).min(d(-1.0))).asin()
}

fn cusped() -> (SymmetricTop, EulerState) {
    let top = SymmetricTop::seed();
    let start = Case::Cusped
        .start(&top, Case::SEED_TILT, Case::SEED_W3)
        .unwrap();
    (top, start)
}

#[test]
fn the_exact_top_agrees_with_the_golden_rows() {
    let Some(path) = shared_data::shared("golden/attitude.json") else {
        return;
    };
    let golden: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let number = |v: &Value| v.as_str().unwrap().parse::<f64>().unwrap();
    let (top, start) = cusped();
    let mut exact = top.exact(&start).unwrap();
    let rows = golden["lagrange_top"]["rows"].as_array().unwrap();
    for row in rows {
        let t = row["t"].as_f64().unwrap();
        let spin = exact.at_nanos((t * 1e9).round() as u64);
        let q = row["q_wxyz"].as_array().unwrap();
        let q =
            Quaternion::assume_unit([number(&q[0]), number(&q[1]), number(&q[2]), number(&q[3])]);
        let error = angle(&spin.q_nb, &q);
        let w = row["w_body"].as_array().unwrap();
        let dw = (0..3)
            .map(|i| (spin.w_nb_b[i] - number(&w[i])).abs())
            .fold(0.0, f64::max);
        println!("{t} {error:e} {dw:e}");
    }
    for m in compare(&TopMethod::ALL, &top, &start, 2000.0, 2400).unwrap() {
        println!(
            "{:14} {:.4} {:.4}",
            m.method.name(),
            m.axis_max.to_degrees(),
            m.attitude_max.to_degrees()
        );
    }
    for m in compare(&TopMethod::ALL, &top, &start, 2500.0, 3625).unwrap() {
        println!(
            "{:14} {:.4} {:.4}",
            m.method.name(),
            m.axis_max.to_degrees(),
            m.attitude_max.to_degrees()
        );
    }
}

#[test]
fn closed() {
    let (top, start) = cusped();
    let mut exact = top.exact(&start).unwrap();
    let form = ClosedForm::new(&top, &start).unwrap();
    println!("{form:?} {:?} {}", form.nutation_range(), form.nutation_period());
    for ms in [0u64, 1, 10, 100, 1200, 10000, 60000] {
        let q = exact.at_nanos(ms * 1_000_000).q_nb;
        let c = form.at_nanos(ms * 1_000_000);
        println!("{ms} {:e} {c:?}", angle(&q, &c.quaternion()));
    }
}
