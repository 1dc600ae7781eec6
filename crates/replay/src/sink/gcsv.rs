//! AttitudeSample, RawSample -> rows of a `.gcsv` for Gyroflow. Pure.
//!
//! Rates and forces, as Gyroflow makes attitudes of its own; the format has no column for a quaternion. The first row is
//! nought on its clock, and the head says when that was. Numbers are written whole: rates in rad/s, forces in m/s^2 with
//! the scale that makes g of them, the field in gauss.
//!
//! `orientation` names, for each of Gyroflow's axes (x up, y left, z backwards, as the lens looks), the axis of the body it
//! is: right where the body looks ahead along the lens.
//!
//! # Source
//! docs.gyroflow.xyz, "GCSV format" (1.3) and "IMU orientation"; `telemetry-parser`, `src/gyroflow/gcsv.rs`: columns by
//! their place, angles by the head's scales.

use super::axes::convention;
use super::form::{Form, Opening, Slot};
use super::stream::{Content, Stream};
use super::text::{push_f64, push_i64};
use crate::error::Result;
use std::io;
use strapd_attitude::record::Nanos;
use strapd_attitude::worlds::Convention;

/// Factor from m/s^2 to g.
const ASCALE: f64 = 1.0 / 9.806_65;
/// Factor from the tesla of a sample to gauss.
const MSCALE: f64 = 1e4;

/// Rows of one stream, from the first stamp on.
#[derive(Debug)]
struct Log {
    orientation: &'static str,
    name: String,
    /// Whether a field has columns.
    has_field: bool,
    /// Stamp of the first row, and whether forces have columns.
    begun: Option<(Nanos, bool)>,
}

/// Values of a row.
struct Row {
    stamp: Nanos,
    rate: [f64; 3],
    force: Option<[f64; 3]>,
    field: Option<[f64; 3]>,
}

/// Begins a log of the one stream that has rows in it.
pub(super) fn begin(opening: &Opening<'_>, _: &mut Vec<u8>) -> Result<Box<dyn Form>> {
    let mut streams = opening.streams.iter();
    let stream = streams.find(|s| s.content != Content::Truth);
    let is_down = stream.is_some_and(|s| convention(&s.world_axes) == Convention::NedFrd);
    let letter = |c: char| match c.is_ascii_alphanumeric() {
        true => c,
        false => '_',
    };
    let id = stream.map_or("", |s| s.id.trim_matches('/'));
    Ok(Box::new(Log {
        orientation: if is_down { "zyx" } else { "ZYx" },
        name: id.chars().map(letter).collect(),
        has_field: stream.is_some_and(|s| s.field_topic.is_some()),
        begun: None,
    }))
}

impl Form for Log {
    /// Nothing: a row counts from the first of all.
    fn encode(&self, _: &mut Slot) {}

    fn in_order<'s>(&mut self, slot: &'s mut Slot) -> io::Result<[&'s [u8]; 3]> {
        let Slot { batch, text, .. } = slot;
        let of_attitudes = batch.samples.iter().map(|sample| Row {
            stamp: sample.stamp,
            rate: sample.rate.into(),
            force: sample.accel.map(Into::into),
            field: None,
        });
        let of_samples = batch.raw.iter().filter_map(|sample| {
            Some(Row {
                stamp: sample.header.unwrap_or(sample.log),
                rate: sample.gyro?,
                force: sample.accel,
                field: sample.mag,
            })
        });
        let rows: Vec<Row> = of_attitudes.chain(of_samples).filter(is_finite).collect();
        if let (None, Some(first)) = (self.begun, rows.first()) {
            let has_force = self.has_field || rows.iter().any(|row| row.force.is_some());
            self.begin(text, first.stamp, has_force);
        }
        for row in &rows {
            self.push(text, row);
        }
        Ok([text, &[], &[]])
    }

    fn closing(&mut self) -> io::Result<Vec<u8>> {
        let mut text = Vec::new();
        if self.begun.is_none() {
            self.begin(&mut text, Nanos(0), false);
        }
        Ok(text)
    }

    /// The truth has no rows.
    fn leaves_out(&self, stream: &Stream) -> bool {
        stream.content == Content::Truth
    }
}

/// Whether its rate is a number: there is no word for what is none.
fn is_finite(row: &Row) -> bool {
    row.rate.iter().all(|c| c.is_finite())
}

impl Log {
    fn begin(&mut self, out: &mut Vec<u8>, first: Nanos, has_force: bool) {
        self.begun = Some((first, has_force));
        let (seconds, _) = first.to_sec_nanosec();
        let mut head = format!(
            "GYROFLOW IMU LOG\nversion,1.3\nid,{}\norientation,{}\nnote,first row at {} ns\nfwversion,strapd_{}\ntimestamp,{seconds}\nvendor,strapd\ntscale,0.000000001\ngscale,1\n",
            self.name,
            self.orientation,
            first.0,
            env!("CARGO_PKG_VERSION"),
        );
        let mut columns = "t,gx,gy,gz".to_owned();
        if has_force {
            head += &format!("ascale,{ASCALE}\n");
            columns += ",ax,ay,az";
        }
        if self.has_field {
            head += &format!("mscale,{MSCALE}\n");
            columns += ",mx,my,mz";
        }
        out.extend_from_slice(head.as_bytes());
        out.extend_from_slice(columns.as_bytes());
        out.push(b'\n');
    }

    fn push(&self, out: &mut Vec<u8>, row: &Row) {
        let Some((first, has_force)) = self.begun else {
            return;
        };
        push_i64(out, row.stamp.since(first));
        let mut cells = |vector: Option<[f64; 3]>| {
            let vector = vector.filter(|v| v.iter().all(|c| c.is_finite()));
            for value in vector.map_or([None; 3], |v| v.map(Some)) {
                out.push(b',');
                if let Some(value) = value {
                    push_f64(out, value);
                }
            }
        };
        cells(Some(row.rate));
        if has_force {
            cells(row.force);
        }
        if self.has_field {
            cells(row.field);
        }
        out.push(b'\n');
    }
}
