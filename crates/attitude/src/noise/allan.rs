//! Angles at even intervals -> overlapping Allan deviation -> noise terms. Pure.
//!
//! A stage of its own because it turns a recording at rest into the numbers an estimator needs: how
//! fast its attitude diffuses and its bias wanders. [`AngleRecord`] gathers, [`deviation`] computes,
//! [`fit`] names the terms, [`variance`] is the theory they are fitted with.
//!
//! # Convention
//! For the angle theta at steps of tau_0, a cluster of m steps, tau = m tau_0:
//! `sigma^2(tau) = sum (theta_{i+2m} - 2 theta_{i+m} + theta_i)^2 / (2 tau^2 (N - 2m + 1))`, where N
//! counts the intervals and the sum runs over all N - 2m + 1 places. rad/s, the unit of a rate.
//!
//! A gap splits the record. Sums and counts of the pieces are added, so that no cluster reaches
//! across a gap and none of the data on either side is lost.
//!
//! # Source
//! IEEE Std 952-1997, annex C; overlapping form: W. J. Riley, "Handbook of Frequency Stability
//! Analysis", NIST SP 1065, 2008, 5.2.4, with phase read as angle.

mod fit;
mod record;
mod theory;

pub use fit::{AllanFit, FittedTerm, MAX_MISFIT, fit};
pub use record::AngleRecord;
pub use theory::variance;

use std::fmt;

/// One point of the curve.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Point {
    /// Steps of a cluster.
    pub steps: usize,
    /// Length of a cluster, s.
    pub tau: f64,
    /// Allan deviation, rad/s.
    pub sigma: f64,
    /// Relative standard error, 1 / sqrt(2 (N/m - 1)): conservative, that of N/m separate clusters.
    pub error: f64,
}

/// A record without an Allan deviation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum AllanError {
    /// Fewer than nine intervals in a row.
    TooShort {
        /// Number of intervals in the longest piece.
        intervals: usize,
    },
    /// The interval is no length of time.
    Interval {
        /// Value as given, s.
        secs: f64,
    },
}

/// Fewest intervals in a row: nine clusters of one step.
const MIN_INTERVALS: usize = 9;

impl fmt::Display for AllanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooShort { intervals } => write!(
                f,
                "too short: {intervals} sampling intervals without a gap, {MIN_INTERVALS} are the least"
            ),
            Self::Interval { secs } => write!(f, "a sampling interval of {secs} s"),
        }
    }
}

impl std::error::Error for AllanError {}

/// Cluster sizes, logarithmically spaced, about `per_decade` a decade, each once, from 1 to `most`.
#[must_use]
pub fn cluster_sizes(most: usize, per_decade: u32) -> Vec<usize> {
    let mut sizes = Vec::new();
    let mut index = 0;
    loop {
        let size = 10f64
            .powf(f64::from(index) / f64::from(per_decade.max(1)))
            .round();
        if size > most as f64 {
            return sizes;
        }
        if sizes.last() != Some(&(size as usize)) {
            sizes.push(size as usize);
        }
        index += 1;
    }
}

/// Overlapping Allan deviation of one axis. `pieces` are angles in rad at steps of `interval` seconds,
/// each piece unbroken. Sizes above a ninth of the longest piece are left out: they mean nothing.
///
/// # Accuracy
/// Second differences of angles: rounding is 1e-16 of the largest angle over tau. Agrees with
/// allantools 2024.6 to 1e-9 (`tests/oracles/allan.py`).
///
/// # Errors
/// No piece is long enough, or the interval is not positive.
pub fn deviation(
    pieces: &[&[f64]],
    interval: f64,
    sizes: &[usize],
) -> Result<Vec<Point>, AllanError> {
    if !(interval > 0.0 && interval.is_finite()) {
        return Err(AllanError::Interval { secs: interval });
    }
    let longest = pieces.iter().map(|p| p.len()).max().unwrap_or(0);
    let longest = longest.saturating_sub(1);
    if longest < MIN_INTERVALS {
        return Err(AllanError::TooShort { intervals: longest });
    }
    let mut points = Vec::new();
    for &steps in sizes {
        if steps == 0 || steps > longest / MIN_INTERVALS {
            continue;
        }
        let (mut sum, mut places, mut intervals) = (0.0, 0, 0);
        for piece in pieces {
            let n = (piece.len().max(1)) - 1;
            if n < 2 * steps {
                continue;
            }
            sum += second_differences(piece, steps);
            places += n + 1 - 2 * steps;
            intervals += n;
        }
        let tau = steps as f64 * interval;
        points.push(Point {
            steps,
            tau,
            sigma: (sum / (2.0 * places as f64)).sqrt() / tau,
            error: 1.0 / (2.0 * (intervals as f64 / steps as f64 - 1.0)).sqrt(),
        });
    }
    Ok(points)
}

/// Sum of the squares, in blocks so that the rounding of millions of additions stays small.
fn second_differences(angles: &[f64], steps: usize) -> f64 {
    let Some(later) = angles.get(steps..) else {
        return 0.0;
    };
    let Some(latest) = angles.get(2 * steps..) else {
        return 0.0;
    };
    const BLOCK: usize = 4096;
    let blocks = latest
        .chunks(BLOCK)
        .zip(later.chunks(BLOCK))
        .zip(angles.chunks(BLOCK));
    blocks
        .map(|((c, b), a)| {
            c.iter()
                .zip(b)
                .zip(a)
                .map(|((c, b), a)| {
                    let second = c - 2.0 * b + a;
                    second * second
                })
                .sum::<f64>()
        })
        .sum()
}
