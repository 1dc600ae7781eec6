//! AttitudeSample, RawSample -> objects for PlotJuggler's UDP server with its JSON protocol. Pure.
//!
//! That server (`plotjuggler_plugins/DataStreamUDP/udp_server.cpp`: port 9870, at most 2048 bytes a
//! datagram, `json` by default) gives each datagram to one parser (`nlohmann_parsers.cpp`), which makes
//! a curve of every number, named by its path (`/imu0/q/w`), and reads the time from a number
//! `timestamp` at the top when it is told to use it. Text makes no curve, and a datagram that is no
//! JSON stops it. So: seconds as a float, then one object named like the sensor, with nothing but
//! finite numbers in it.

use super::stream::Stream;
use super::text::{push_f64, push_i64, push_string};
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};

const AXES: [&str; 3] = ["x", "y", "z"];

/// The objects of one stream.
#[derive(Debug)]
pub(crate) struct PlotObject {
    head: Vec<u8>,
}

impl PlotObject {
    pub(crate) fn new(stream: &Stream) -> PlotObject {
        let mut head = b",".to_vec();
        // A slash begins a branch of the tree, and the path begins with one already.
        push_string(&mut head, stream.id.trim_start_matches('/'));
        head.extend_from_slice(b":{");
        PlotObject { head }
    }

    fn begin(&self, out: &mut Vec<u8>, stamp: Nanos) {
        out.extend_from_slice(b"{\"timestamp\":");
        let (sec, nsec) = stamp.to_sec_nanosec();
        push_f64(out, sec as f64 + f64::from(nsec) * 1e-9);
        out.extend_from_slice(&self.head);
    }

    /// Appends an attitude: `q`, angles in degrees, `rate` in rad/s, `sigma_deg`, `reset`.
    pub(crate) fn push(&self, out: &mut Vec<u8>, sample: &AttitudeSample) {
        self.begin(out, sample.stamp);
        push_group(out, "q", &["w", "x", "y", "z"], &sample.q_nb.wxyz());
        let angles = sample.q_nb.yaw_pitch_roll();
        for (name, angle) in [
            ("roll_deg", angles.roll),
            ("pitch_deg", angles.pitch),
            ("yaw_deg", angles.yaw),
        ] {
            if angle.is_finite() {
                push_name(out, name);
                push_f64(out, angle.to_degrees());
                out.push(b',');
            }
        }
        push_group(out, "rate", &AXES, &<[f64; 3]>::from(sample.rate));
        let sigma: [f64; 3] = sample.covariance.sigma().map(f64::to_degrees).into();
        push_group(out, "sigma_deg", &AXES, &sigma);
        push_name(out, "reset");
        push_i64(out, i64::from(sample.reset_count));
        out.extend_from_slice(b"}}");
    }

    /// Appends what a sensor put out: `gyro`, `accel`, `mag`.
    pub(crate) fn push_raw(&self, out: &mut Vec<u8>, sample: &RawSample) {
        self.begin(out, sample.header.unwrap_or(sample.log));
        for (name, vector) in [
            ("gyro", sample.gyro),
            ("accel", sample.accel),
            ("mag", sample.mag),
        ] {
            if let Some(vector) = vector {
                push_group(out, name, &AXES, &vector);
            }
        }
        if out.last() == Some(&b',') {
            out.pop();
        }
        out.extend_from_slice(b"}}");
    }
}

fn push_name(out: &mut Vec<u8>, name: &str) {
    out.push(b'"');
    out.extend_from_slice(name.as_bytes());
    out.extend_from_slice(b"\":");
}

/// `"name":{"x":1.0,...},`; what is not finite is left out.
fn push_group(out: &mut Vec<u8>, name: &str, names: &[&str], values: &[f64]) {
    push_name(out, name);
    out.push(b'{');
    for (name, value) in names.iter().zip(values).filter(|(_, v)| v.is_finite()) {
        push_name(out, name);
        push_f64(out, *value);
        out.push(b',');
    }
    if out.last() == Some(&b',') {
        out.pop();
    }
    out.extend_from_slice(b"},");
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::sink::tests::sample;
    use nalgebra::Vector3;
    use serde_json::{Value, json};
    use strapd_attitude::quaternion::BodyRate;

    /// Whether a value is numbers all the way down.
    fn is_numeric(value: &Value) -> bool {
        match value {
            Value::Object(fields) => fields.values().all(is_numeric),
            other => other.is_number(),
        }
    }

    #[test]
    fn an_object_is_a_timestamp_and_finite_numbers_under_the_name_of_the_sensor() {
        let object = PlotObject::new(&Stream::new("/imu/data_raw", "imu_link"));
        let mut s = sample(Nanos(1_500_000_000));
        s.rate = BodyRate(Vector3::new(f64::NAN, 1.0, f64::INFINITY));
        let mut out = Vec::new();
        object.push(&mut out, &s);
        let value: Value = serde_json::from_slice(&out).unwrap();
        assert!(is_numeric(&value), "{value}");
        assert_eq!(value["timestamp"], 1.5);
        let sensor = &value["imu/data_raw"];
        assert_eq!(
            sensor["q"],
            json!({"w": 0.5, "x": -0.5, "y": 0.5, "z": 0.5})
        );
        assert_eq!(sensor["rate"], json!({"y": 1.0}));
        assert!(sensor["yaw_deg"].is_f64() && sensor["sigma_deg"]["z"].is_f64());
        assert!(out.len() <= 2048, "{} bytes", out.len());

        let raw = RawSample {
            header: Some(Nanos(-500_000_000)),
            gyro: Some([0.1, f64::NAN, 0.3]),
            ..RawSample::default()
        };
        for (raw, expected) in [
            (raw, json!({"gyro": {"x": 0.1, "z": 0.3}})),
            (RawSample { gyro: None, ..raw }, json!({})),
        ] {
            out.clear();
            object.push_raw(&mut out, &raw);
            let value: Value = serde_json::from_slice(&out).unwrap();
            assert_eq!(value["timestamp"], -0.5);
            assert_eq!(value["imu/data_raw"], expected);
        }
    }
}
