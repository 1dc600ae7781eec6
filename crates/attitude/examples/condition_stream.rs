//! A stream with everything wrong in it -> rates that can be integrated, and what became of the rest.
//!
//! ```sh
//! cargo run -p strapd-attitude --example condition_stream
//! ```
#![allow(clippy::print_stdout)]

use strapd_attitude::condition::{Conditioner, GyroUnit, Settings, SettingsError};
use strapd_attitude::record::{Nanos, RawSample};

fn main() -> Result<(), SettingsError> {
    // Degrees a second at 100 Hz: one not finite, one absurd, one sent twice, two swapped, half a second lost.
    let sample = |ms: i64, rate: f64| RawSample {
        header: Some(Nanos(ms * 1_000_000)),
        gyro: Some([rate, 0.0, 0.0]),
        ..RawSample::default()
    };
    let mut raw: Vec<RawSample> = (0..200).map(|k| sample(10 * k, 30.0)).collect();
    raw[20] = sample(200, f64::NAN);
    raw[40] = sample(400, 1e9);
    raw.insert(61, raw[60]);
    raw.swap(80, 81);
    raw.drain(100..150);

    let mut conditioner = Conditioner::new(&Settings {
        unit: GyroUnit::Deg,
        ..Settings::default()
    })?;
    let mut rates = Vec::new();
    // In pieces of any size: the same bits come out.
    for piece in raw.chunks(7) {
        conditioner.push(piece, &mut rates);
    }
    conditioner.finish(&mut rates);

    let report = conditioner.report();
    println!("{} of {} samples can be integrated", rates.len(), raw.len());
    for rate in rates
        .iter()
        .filter(|rate| rate.status.names().next().is_some())
    {
        let words: Vec<&str> = rate.status.names().collect();
        println!(
            "  at {:.2} s: {}",
            rate.stamp.0 as f64 * 1e-9,
            words.join(", ")
        );
    }
    let gaps = &report.gaps;
    println!(
        "lost: {}; {} gaps, {} samples missing in them",
        report.counts.lost(),
        gaps.count,
        gaps.missing
    );
    Ok(())
}
