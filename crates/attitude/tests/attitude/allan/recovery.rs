//! Promise: the noise that was put in comes out again.

use super::{at_rest, curve};
use strapd_attitude::noise::allan::{AllanFit, MAX_MISFIT, fit};
use strapd_attitude::noise::sensor_error::ImuError;
use strapd_attitude::record::SampleKind;

/// The three axes' fits of a record.
fn fits(text: &str, interval_nanos: i64, n: usize, seed: u64) -> Vec<AllanFit> {
    let error = ImuError::parse(text).unwrap();
    let record = at_rest(
        &error,
        SampleKind::DeltaAngle,
        interval_nanos,
        n,
        seed,
        0.012_345,
    );
    (0..3)
        .map(|axis| fit(&curve(&record, axis, interval_nanos)).unwrap())
        .collect()
}

/// Recovery of one coefficient over seeds and axes: rms relative error, worst, rms of error over stated error, and
/// how often it was not seen.
#[derive(Debug, Default)]
struct Recovered {
    rms: f64,
    worst: f64,
    pull: f64,
    unseen: usize,
    of: usize,
}

fn recover(text: &str, interval_nanos: i64, n: usize, seeds: u64) -> [Recovered; 4] {
    let put = ImuError::parse(text).unwrap();
    let mut all: [Recovered; 4] = Default::default();
    for seed in 0..seeds {
        for got in fits(text, interval_nanos, n, seed) {
            let terms = [
                (got.quantization, put.quantization),
                (got.arw, put.arw),
                (got.bias_instability, put.bias_instability),
                (got.rrw, put.rrw),
            ];
            for (sum, (term, put)) in all.iter_mut().zip(terms) {
                sum.of += 1;
                match term.value {
                    Some(value) if put > 0.0 => {
                        let off = value / put - 1.0;
                        sum.rms += off * off;
                        sum.worst = sum.worst.max(off.abs());
                        sum.pull += ((value - put) / term.error).powi(2);
                    }
                    Some(_) => sum.worst = f64::INFINITY,
                    None => sum.unseen += 1,
                }
            }
        }
    }
    for sum in &mut all {
        let seen = (sum.of - sum.unseen).max(1) as f64;
        sum.rms = (sum.rms / seen).sqrt();
        sum.pull = (sum.pull / seen).sqrt();
    }
    all
}

/// Two hours at 100 Hz, as the model of each term asks.
#[test]
#[ignore = "two hours at 100 Hz, ten seeds: about a minute; run by hand, figures in docs/allan.md"]
fn two_hours_give_each_term_back() {
    for text in [
        "arw=0.3",
        "arw=0.3,quantization=1",
        "arw=0.3,bias-instability=30",
        "arw=0.3,rrw=60",
        "arw=0.3,quantization=1,bias-instability=30",
        "arw=0.3,rrw=300",
        "arw=0.3,quantization=1,bias-instability=30,rrw=400",
        "consumer_mems_b",
        "tactical",
    ] {
        let [q, n, b, k] = recover(text, 10_000_000, 720_000, 10);
        println!("{text}");
        for (name, r) in [("Q", q), ("N", n), ("B", b), ("K", k)] {
            println!(
                "   {name}: rms {:.2} %, worst {:.2} %, pull {:.2}, unseen {} of {}",
                100.0 * r.rms,
                100.0 * r.worst,
                r.pull,
                r.unseen,
                r.of
            );
        }
    }
}

/// Twenty minutes at 100 Hz, each term large enough to be seen in them.
#[test]
fn what_was_put_in_comes_out_again() {
    const MOST: [f64; 4] = [0.02, 0.05, 0.10, 0.15];
    for (text, seen) in [
        ("arw=0.3,quantization=1", [true, true, false, false]),
        (
            "arw=0.3,quantization=1,bias-instability=40",
            [true, true, true, false],
        ),
        ("arw=0.1,rrw=1000", [false, true, false, true]),
    ] {
        let found = recover(text, 10_000_000, 120_000, 1);
        for ((found, most), seen) in found.iter().zip(MOST).zip(seen) {
            assert_eq!(
                found.unseen,
                if seen { 0 } else { found.of },
                "{text}: {found:?}"
            );
            assert!(found.worst < most, "{text}: {found:?} beyond {most}");
        }
    }
}

#[test]
fn misfit_is_small_where_the_model_holds() {
    for got in fits("arw=0.3,bias-instability=30", 10_000_000, 60_000, 3) {
        assert!(got.misfit < MAX_MISFIT, "{}", got.misfit);
    }
}
