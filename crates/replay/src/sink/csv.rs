//! AttitudeSample -> a CSV row. Pure.
//!
//! The names of the columns are those that [`strapd_recording::table`] reads.

use super::axes::roll_pitch_yaw;
use super::form::{Form, Opening, Slot};
use super::stream::{Content, Stream};
use super::text::{
    ACCELERATIONS, TEMPERATURE, accelerations, push_f64, push_i64, push_status, push_temperature,
};
use crate::error::Result;
use strapd_attitude::record::{AttitudeSample, RawSample};

/// The first row. Angles in degrees, rates in rad/s, stamps in nanoseconds; roll, pitch and yaw are
/// turned about z, then y, then x (ZYX).
const HEADER: &[u8] = b"stamp_ns,qw,qx,qy,qz,roll_deg,pitch_deg,yaw_deg,wx,wy,wz,sigma_x_deg,sigma_y_deg,sigma_z_deg,status,world\n";

/// The first row over samples of a gyro. Rates in rad/s (delta angles in rad), specific force in
/// m/s^2; `qw,qx,qy,qz` is the orientation that goes with the sample, where there is one.
pub const RAW_HEADER: &[u8] =
    b"stamp_ns,log_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,qw,qx,qy,qz,interval_ns,sample_kind\n";

/// The same over samples of a synthetic gyro, whose stamps may be wrong: the orientation is the truth at the true instant.
const SYNTHETIC_HEADER: &[u8] =
    b"stamp_ns,true_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,qw,qx,qy,qz,interval_ns,sample_kind\n";

/// Rows of attitudes or samples.
#[derive(Debug)]
struct Rows {
    /// Content of the last column of each row.
    last: String,
    /// Whether the acceleration without gravity follows.
    is_accelerated: bool,
    /// Whether the temperature follows.
    has_temperature: bool,
}

/// Begins a table of the one stream that has rows in it.
pub(super) fn begin(opening: &Opening<'_>, head: &mut Vec<u8>) -> Result<Box<dyn Form>> {
    let mut streams = opening.streams.iter();
    let stream = streams.find(|s| s.content != Content::Truth);
    let (header, last) = match stream.map(|s| (s.content, s.world_axes.clone())) {
        Some((Content::Samples(kind), _)) => (SYNTHETIC_HEADER, kind.name().to_owned()),
        Some((_, world)) => (HEADER, world),
        None => (HEADER, String::new()),
    };
    head.extend_from_slice(header);
    let rows = Rows {
        last,
        is_accelerated: stream.is_some_and(|s| s.has_linear_acceleration),
        has_temperature: stream.is_some_and(|s| s.has_temperature),
    };
    head.pop();
    let accelerations = ACCELERATIONS.iter().filter(|_| rows.is_accelerated);
    let temperature = Some(&TEMPERATURE).filter(|_| rows.has_temperature);
    for name in accelerations.chain(temperature) {
        head.push(b',');
        head.extend_from_slice(name.as_bytes());
    }
    head.push(b'\n');
    Ok(Box::new(rows))
}

impl Form for Rows {
    fn encode(&self, slot: &mut Slot) {
        for sample in &slot.batch.samples {
            push_row(&mut slot.text, sample, self);
        }
        for sample in &slot.batch.raw {
            push_raw_row(&mut slot.text, sample, &self.last);
        }
    }

    /// The truth has no rows.
    fn leaves_out(&self, stream: &Stream) -> bool {
        stream.content == Content::Truth
    }
}

/// Appends one row with its line end; what is absent is an empty cell. `kind` is what the sample means.
pub fn push_raw_row(out: &mut Vec<u8>, sample: &RawSample, kind: &str) {
    push_i64(out, sample.header.unwrap_or(sample.log).0);
    out.push(b',');
    push_i64(out, sample.log.0);
    let vectors = [sample.gyro, sample.accel].map(|v| v.map_or([None; 3], |v| v.map(Some)));
    let orientation = sample.orientation.map_or([None; 4], |q| q.map(Some));
    for value in vectors.into_iter().flatten().chain(orientation) {
        out.push(b',');
        if let Some(value) = value {
            push_number(out, value);
        }
    }
    out.push(b',');
    if let Some(interval) = sample.interval_nanos {
        push_i64(out, interval);
    }
    end_row(out, kind);
}

/// Appends one row with its line end. Several status names are joined by `|`; the last column is what it is relative to.
fn push_row(out: &mut Vec<u8>, sample: &AttitudeSample, rows: &Rows) {
    push_i64(out, sample.stamp.0);
    let q = sample.q_nb.wxyz();
    let [roll, pitch, yaw] = roll_pitch_yaw(q).map(f64::to_degrees);
    let sigma = sample.covariance.sigma().map(f64::to_degrees);
    let numbers = q
        .into_iter()
        .chain([roll, pitch, yaw])
        .chain(sample.rate.0.iter().copied())
        .chain(sigma.iter().copied());
    for value in numbers {
        out.push(b',');
        push_number(out, value);
    }
    out.push(b',');
    push_status(out, sample, b"", b"|");
    out.push(b',');
    out.extend_from_slice(rows.last.as_bytes());
    if rows.is_accelerated {
        push_acceleration(out, sample);
    }
    if rows.has_temperature {
        out.push(b',');
        push_temperature(out, sample.temperature);
    }
    out.push(b'\n');
}

/// Appends the acceleration without gravity to a row.
fn push_acceleration(out: &mut Vec<u8>, sample: &AttitudeSample) {
    let of = accelerations(sample);
    for place in 0..ACCELERATIONS.len() {
        out.push(b',');
        if let Some(numbers) = &of {
            push_number(out, numbers[place]);
        }
    }
}

fn end_row(out: &mut Vec<u8>, last: &str) {
    out.push(b',');
    out.extend_from_slice(last.as_bytes());
    out.push(b'\n');
}

/// Unlike JSON, CSV readers agree on `nan` and `inf`.
fn push_number(out: &mut Vec<u8>, value: f64) {
    if value.is_finite() {
        push_f64(out, value);
    } else if value.is_nan() {
        out.extend_from_slice(b"nan");
    } else {
        out.extend_from_slice(if value > 0.0 { b"inf" } else { b"-inf" });
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::sink::axes::half_turn;
    use crate::sink::tests::sample;
    use nalgebra::{UnitQuaternion, Vector3};
    use strapd_attitude::record::{AttitudeCovariance, Nanos, Status};

    /// Another way: nalgebra composes the three turns.
    fn quaternion(roll: f64, pitch: f64, yaw: f64) -> [f64; 4] {
        let turn = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        let q = turn(Vector3::z_axis(), yaw)
            * turn(Vector3::y_axis(), pitch)
            * turn(Vector3::x_axis(), roll);
        [q.w, q.i, q.j, q.k]
    }

    #[test]
    fn roll_pitch_yaw_come_back_from_the_three_turns_they_made() {
        for r in -17..=18 {
            for p in -8..=8 {
                for y in -17..=18 {
                    let angles = [r, p, y].map(|a| f64::from(a) * 10f64.to_radians());
                    let q = quaternion(angles[0], angles[1], angles[2]);
                    // q and -q are the same rotation; a continuous sign brings both.
                    for got in [q, q.map(|c| -c)].map(roll_pitch_yaw) {
                        for (a, b) in got.iter().zip(angles) {
                            // 4e-15 rad, modulo a full turn: a handful of roundings of numbers up to
                            // pi, times 1/cos(80 deg) = 5.8 for the input's own rounding.
                            let d = half_turn(a - b).abs();
                            assert!(d < 4e-15, "{angles:?} -> {got:?}: {d:e}");
                            assert!(a.abs() <= std::f64::consts::PI, "{got:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn pitch_keeps_its_digits_next_to_ninety_degrees() {
        for tilt in [1e-3, 1e-6, 1e-9, 0.0] {
            let pitch = std::f64::consts::FRAC_PI_2 - tilt;
            let got = roll_pitch_yaw(quaternion(0.3, pitch, -0.2));
            // An arcsine would be wrong by 1e-8 here.
            assert!(
                (got[1] - pitch).abs() < 1e-15,
                "{tilt:e}: {:e}",
                got[1] - pitch
            );
            assert!(got.iter().all(|a| a.is_finite()));
        }
    }

    #[test]
    fn a_row_has_a_value_under_every_heading() {
        let mut s = sample(Nanos(1_700_000_000_000_000_001));
        s.covariance = AttitudeCovariance::from_sigma(Vector3::new(f64::NAN, f64::INFINITY, 0.0));
        s.status = Status::HELD.with(Status::SATURATED);
        let mut out = HEADER.to_vec();
        let rows = Rows {
            last: "enu".to_owned(),
            is_accelerated: false,
            has_temperature: false,
        };
        push_row(&mut out, &s, &rows);
        let mut reader = csv::Reader::from_reader(out.as_slice());
        assert_eq!(reader.headers().unwrap().len(), 16);
        let row = reader.records().next().unwrap().unwrap();
        assert_eq!(row.len(), 16, "{row:?}");
        assert_eq!(&row[0], "1700000000000000001", "exact to the nanosecond");
        let w: f64 = row[1].parse().unwrap();
        assert_eq!(w.to_bits(), s.q_nb.wxyz()[0].to_bits());
        assert_eq!((&row[11], &row[12]), ("nan", "inf"));
        assert_eq!((&row[14], &row[15]), ("held|saturated", "enu"));
    }
}
