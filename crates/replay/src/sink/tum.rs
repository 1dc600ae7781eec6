//! AttitudeSample -> a row of a TUM trajectory. Pure.
//!
//! What `evo` reads: `timestamp tx ty tz qx qy qz qw`, seconds and metres, sensor to world; a gyro knows no place, so
//! the translation is nought.
//!
//! # Source
//! Sturm, Engelhard, Endres, Burgard, Cremers, A Benchmark for the Evaluation of RGB-D SLAM Systems (IROS 2012): the
//! format of its ground truth.

use super::form::{Form, Opening, Slot};
use super::text::push_f64;
use crate::error::Result;
use strapd_attitude::record::AttitudeSample;

/// The first row, a comment to who reads it.
const HEADER: &[u8] = b"# timestamp tx ty tz qx qy qz qw\n";

#[derive(Debug)]
struct Trajectory;

/// Begins a trajectory.
pub(super) fn begin(_: &Opening<'_>, head: &mut Vec<u8>) -> Result<Box<dyn Form>> {
    head.extend_from_slice(HEADER);
    Ok(Box::new(Trajectory))
}

impl Form for Trajectory {
    fn encode(&self, slot: &mut Slot) {
        for sample in &slot.batch.samples {
            push_row(&mut slot.text, sample);
        }
    }
}

/// Appends one row with its line end: the stamp to the nanosecond, floats as the shortest decimals that read back to
/// the same bits. An attitude that is no number is left out: the form has no word for it.
fn push_row(out: &mut Vec<u8>, sample: &AttitudeSample) {
    let [w, x, y, z] = sample.q_nb.wxyz();
    if ![w, x, y, z].iter().all(|c| c.is_finite()) {
        return;
    }
    // Seconds before 1970 count down: -0.25 s is not -1 s and 0.75.
    let nanos = sample.stamp.0;
    let sign = if nanos < 0 { "-" } else { "" };
    let (sec, nsec) = (
        nanos.unsigned_abs() / 1_000_000_000,
        nanos.unsigned_abs() % 1_000_000_000,
    );
    out.extend_from_slice(format!("{sign}{sec}.{nsec:09} 0 0 0").as_bytes());
    for value in [x, y, z, w] {
        out.push(b' ');
        push_f64(out, value);
    }
    out.push(b'\n');
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::sink::tests::sample;
    use strapd_attitude::record::Nanos;

    #[test]
    fn a_row_keeps_the_nanosecond_and_every_bit_of_the_attitude() {
        for (nanos, text) in [
            (1_700_000_000_123_456_789, "1700000000.123456789"),
            (-250_000_000, "-0.250000000"),
            (5, "0.000000005"),
            (i64::MIN, "-9223372036.854775808"),
        ] {
            let sample = sample(Nanos(nanos));
            let mut row = Vec::new();
            push_row(&mut row, &sample);
            let row = String::from_utf8(row).unwrap();
            let cells: Vec<&str> = row.trim_end().split(' ').collect();
            assert_eq!(cells.len(), 8, "{row}");
            assert_eq!(cells[0], text);
            assert_eq!(cells[1..4], ["0", "0", "0"]);
            let [w, x, y, z] = sample.q_nb.wxyz();
            for (cell, value) in cells[4..].iter().zip([x, y, z, w]) {
                assert_eq!(cell.parse::<f64>().unwrap().to_bits(), value.to_bits());
            }
        }
    }
}
