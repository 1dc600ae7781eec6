//! Cost of smoothing a long recording: made on the fly, never held.
//!
//! ```text
//! cargo run --release -p strapd-attitude --example smooth_long -- HOURS HERTZ [field] [THREADS]
//! ```
//!
//! A hand that moves for half of every five minutes. Prints time a sample and the largest resident memory.

#![allow(clippy::print_stdout)]

use nalgebra::Vector3;
use std::convert::Infallible;
use std::num::NonZero;
use std::time::Instant;
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, Quaternion, RotationVector};
use strapd_attitude::record::Nanos;
use strapd_attitude::smooth::{Sample, Samples, Settings, smooth};

struct Made {
    count: u64,
    hertz: f64,
    has_field: bool,
}

impl Samples for Made {
    type Error = Infallible;

    fn pass(&mut self, take: &mut dyn FnMut(&[Sample])) -> Result<(), Infallible> {
        let mut q = Quaternion::<(), ()>::identity();
        let mut chunk = Vec::with_capacity(4096);
        for i in 0..self.count {
            let t = i as f64 / self.hertz;
            let share = (t * std::f64::consts::TAU / 300.0).sin().max(0.0);
            let rate = Vector3::new(
                (1.1 * t).sin(),
                (0.7 * t + 1.0).sin(),
                (1.7 * t + 2.0).sin(),
            ) * share;
            q = (q * Quaternion::from_rotation_vector(&RotationVector(rate / self.hertz)))
                .normalised();
            let to_body = q.to_dcm().as_matrix().transpose();
            // Noise of a sort, not the same in neighbours.
            let noise = ((i * 7919) % 1009) as f64 / 1009.0 - 0.5;
            chunk.push(Sample {
                stamp: Nanos((t * 1e9).round() as i64),
                rate: BodyRate(rate.add_scalar(0.005 + 2e-3 * noise)),
                force: Some(In::assume(
                    to_body * Vector3::new(0.0, 0.0, 9.81) + Vector3::repeat(0.05 * noise),
                )),
                field: self
                    .has_field
                    .then(|| In::assume(to_body * Vector3::new(0.0, 18.0, -45.0))),
                is_saturated: false,
            });
            if chunk.len() == 4096 {
                take(&chunk);
                chunk.clear();
            }
        }
        take(&chunk);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [hours, hertz, rest @ ..] = &arguments[..] else {
        return Err("HOURS HERTZ [field] [THREADS]".into());
    };
    let (hours, hertz): (f64, f64) = (hours.parse()?, hertz.parse()?);
    let threads = rest
        .iter()
        .find_map(|argument| argument.parse().ok())
        .unwrap_or(NonZero::<usize>::MIN);
    let mut samples = Made {
        count: (hours * 3600.0 * hertz) as u64,
        hertz,
        has_field: rest.iter().any(|argument| argument == "field"),
    };
    let start = Instant::now();
    let smoothed = smooth(
        &mut samples,
        &Settings {
            threads,
            ..Settings::default()
        },
    )?;
    let mut last = None;
    smoothed.attitudes(&mut samples, |chunk| last = chunk.last().copied().or(last))?;
    let nanos = start.elapsed().as_nanos() as f64 / samples.count as f64;
    println!("{:?} {:?}", smoothed.outcome(), smoothed.counts());
    println!(
        "{} samples, {nanos:.0} ns each (with making them in each pass)",
        samples.count
    );
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status
        .lines()
        .filter(|line| line.starts_with("VmHWM"))
        .for_each(|line| println!("{line}"));
    Ok(())
}
