//! Smoothed recordings with a reference, in the official metric of BROAD.
//!
//! ```text
//! cargo run --release -p strapd-attitude --example smooth_csv -- [6|9] [NAME=VALUE ...] FILE.csv ...
//! ```
//!
//! Columns: t_ns, gyro (rad/s), force (m/s^2), field (uT), reference (w, x, y, z; sensor to east, north, up), scored.
//! Errors are those of earth axes; 6D is turned about the vertical so that its heading agrees at the first sample
//! that is scored, 9D is not. Settings: process (0: independent nodes), unresolved, loose, untruncate, spacing,
//! delay, threads, instant, every, offset, moving.

#![allow(clippy::print_stdout)]

use nalgebra::Vector3;
use std::num::NonZero;
use std::time::Instant;
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::Nanos;
use strapd_attitude::smooth::{
    Estimate, MotionModel, Outcome, PriorScale, Sample, SampleModel, Settings, smooth,
};

type Failure = Box<dyn std::error::Error>;
type Q = Quaternion<(), ()>;

/// A recording, and where it is scored against what.
#[derive(Default)]
struct Recording {
    samples: Vec<Sample>,
    references: Vec<Option<[f64; 4]>>,
}

/// Part that is left out of a recording.
#[derive(Clone, Copy)]
struct Cut {
    every: usize,
    offset: usize,
    is_moving_only: bool,
}

fn read(path: &str, has_field: bool, cut: Cut) -> Result<Recording, Failure> {
    let text = std::fs::read_to_string(path)?;
    let mut rows = Vec::new();
    for line in text.lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let stamp: i64 = columns.first().ok_or("a line is empty")?.parse()?;
        let values = columns[1..].iter().map(|c| c.parse());
        let values: Vec<f64> = values.collect::<Result<_, _>>()?;
        let [g0, g1, g2, a0, a1, a2, m0, m1, m2, w, x, y, z, scored] = values[..] else {
            return Err("15 columns are wanted".into());
        };
        let field = Vector3::new(m0, m1, m2);
        let is_field = has_field && field.iter().all(|m| m.is_finite());
        let sample = Sample {
            stamp: Nanos(stamp),
            rate: BodyRate([g0, g1, g2].into()),
            force: Some(In::assume([a0, a1, a2].into())),
            field: is_field.then(|| In::assume(field)),
            is_saturated: false,
        };
        rows.push((sample, (scored > 0.5).then_some([w, x, y, z])));
    }
    let scored = |row: &(Sample, Option<[f64; 4]>)| row.1.is_some();
    let (first, last) = (rows.iter().position(scored), rows.iter().rposition(scored));
    let range = match (cut.is_moving_only, first, last) {
        (true, Some(first), Some(last)) => first..last + 1,
        _ => 0..rows.len(),
    };
    let mut recording = Recording::default();
    for (sample, reference) in rows[range].iter().skip(cut.offset).step_by(cut.every) {
        recording.samples.push(*sample);
        recording.references.push(*reference);
    }
    Ok(recording)
}

/// Total, heading, inclination (root mean squares, deg); shares inside 3 sigma of tilt and heading; mean squares of
/// normalised errors.
fn score(estimates: &[Estimate], references: &[Option<[f64; 4]>], is_aligned: bool) -> [f64; 7] {
    let mut align: Option<Q> = None;
    let (mut squares, mut inside, mut normalised, mut count) = ([0.0; 3], [0.0; 2], [0.0; 2], 0.0);
    for (estimate, reference) in estimates.iter().zip(references) {
        let Some(reference) = reference else { continue };
        let error = Q::assume_unit(estimate.q_nb.wxyz()) * Q::assume_unit(*reference).inverse();
        let [w, _, _, z] = error.wxyz();
        let by = *align.get_or_insert_with(|| {
            if is_aligned {
                Q::assume_unit([w, 0.0, 0.0, -z]).normalised()
            } else {
                Q::identity()
            }
        });
        let error = by * error;
        let [w, _, _, z] = error.wxyz();
        let parts = [
            2.0 * w.abs().min(1.0).acos(),
            2.0 * (z / w).abs().atan(),
            2.0 * w.hypot(z).min(1.0).acos(),
        ];
        for (sum, part) in squares.iter_mut().zip(parts) {
            *sum += part.to_degrees().powi(2);
        }
        let phi = error.rotation_vector().0;
        let sigma = [0, 1, 2].map(|i| estimate.covariance[(i, i)].sqrt());
        let tilt = 0.5 * ((phi.x / sigma[0]).powi(2) + (phi.y / sigma[1]).powi(2));
        inside[0] += f64::from(u8::from(
            phi.x.abs() < 3.0 * sigma[0] && phi.y.abs() < 3.0 * sigma[1],
        ));
        inside[1] += f64::from(u8::from(phi.z.abs() < 3.0 * sigma[2]));
        normalised[0] += tilt;
        normalised[1] += (phi.z / sigma[2]).powi(2);
        count += 1.0;
    }
    let [total, heading, tilt] = squares.map(|sum: f64| (sum / count).sqrt());
    [
        total,
        heading,
        tilt,
        inside[0] / count,
        inside[1] / count,
        normalised[0] / count,
        normalised[1] / count,
    ]
}

/// Time that this process has computed, ns: not what it waited for a core. Where the system does not say: the clock's.
fn computed(since: Instant) -> f64 {
    let said = std::fs::read_to_string("/proc/self/schedstat").ok();
    let nanos = said.and_then(|text| text.split(' ').next().and_then(|n| n.parse().ok()));
    nanos.unwrap_or_else(|| since.elapsed().as_nanos() as f64)
}

fn main() -> Result<(), Failure> {
    let mut settings = Settings::default();
    let mut cut = Cut {
        every: 1,
        offset: 0,
        is_moving_only: false,
    };
    let (mut has_field, mut files) = (false, Vec::new());
    for argument in std::env::args().skip(1) {
        match argument.split_once('=') {
            Some(("process", "0")) => settings.motion = MotionModel::Independent,
            Some(("unresolved", value)) => settings.has_unresolved = value == "1",
            Some(("loose", value)) => {
                let by = value.parse()?;
                settings.looseness = PriorScale {
                    scale: by,
                    axes: by,
                    force: by,
                    sensitivity: by,
                };
            }
            Some(("untruncate", value)) => settings.undo_truncation = value == "1",
            Some(("spacing", value)) => settings.node_spacing = Some(value.parse()?),
            Some(("delay", value)) => settings.sensor_delay = value.parse()?,
            Some(("threads", value)) => settings.threads = value.parse::<NonZero<usize>>()?,
            Some(("instant", "1")) => settings.sample_model = SampleModel::Instant,
            Some(("every", value)) => cut.every = value.parse()?,
            Some(("offset", value)) => cut.offset = value.parse()?,
            Some(("moving", value)) => cut.is_moving_only = value == "1",
            _ if argument == "6" || argument == "9" => has_field = argument == "9",
            _ => files.push(argument),
        }
    }
    println!(
        "recording                      total heading incl.  in3 t in3 h  nees t nees h  sv sp  ns  iterations"
    );
    let mut sums = [0.0; 7];
    for file in &files {
        let recording = read(file, has_field, cut)?;
        let mut samples = recording.samples.as_slice();
        let start = Instant::now();
        let before = computed(start);
        let smoothed = smooth(&mut samples, &settings)?;
        let mut estimates = Vec::with_capacity(samples.len());
        smoothed.attitudes(&mut samples, |chunk| estimates.extend_from_slice(chunk))?;
        let nanos = (computed(start) - before) / samples.len() as f64;
        let figures = score(&estimates, &recording.references, !has_field);
        for (sum, figure) in sums.iter_mut().zip(figures) {
            *sum += figure;
        }
        let name = file.rsplit('/').next().unwrap_or(file);
        print!("{:30.30}", name.trim_end_matches(".csv"));
        figures.iter().for_each(|figure| print!(" {figure:6.3}"));
        let [sv, sp] = smoothed.bound();
        let [plain, field] = smoothed.counts().iterations;
        print!(" {sv:6.2} {sp:6.2} {nanos:5.0} {plain}+{field}");
        match smoothed.outcome() {
            Outcome::Converged => println!(),
            other => println!(" {other:?}"),
        }
    }
    print!("{:30}", "mean");
    sums.iter()
        .for_each(|sum| print!(" {:6.3}", sum / files.len() as f64));
    println!();
    Ok(())
}
