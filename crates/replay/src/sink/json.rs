//! AttitudeSample -> the `ATT` object and `foxglove.FrameTransform`, as JSON. Pure.
//!
//! Written by hand around the numbers: the names never change within a stream, so a line is a few
//! copies and ten floats. Floats are the shortest decimals that read back to the same bits.
//! JSON has no NaN: what is not finite is `null`.

use super::Transforms;
use super::datagram::RecordObject;
use super::form::{Form, Opening, Slot};
use super::plot::PlotObject;
use super::stream::{Content, Stream};
use super::text::{
    TEMPERATURE, of_transform, parent_and_child, push_array3, push_f64, push_i64, push_stamp,
    push_status, push_string, push_temperature, push_u64,
};
use crate::error::Result;
use strapd_attitude::record::{AttitudeSample, RawSample, SampleKind};

/// Form of the objects sent to somebody.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Profile {
    /// The lines of NDJSON.
    #[default]
    Lines,
    /// Form that PlotJuggler's UDP server reads with its JSON protocol.
    PlotJuggler,
    /// Records that [`Datagrams`](super::Datagrams) makes datagrams of: attitudes alone, and no lines.
    Records,
}

/// The lines of one stream.
#[derive(Debug)]
pub struct Objects(Object);

#[derive(Debug)]
enum Object {
    Att(AttObject),
    Rate(RateObject),
    Plot(PlotObject),
    Record(RecordObject),
}

impl Objects {
    /// Makes those of `stream` in the form that `profile` reads.
    #[must_use]
    pub fn new(stream: &Stream, profile: Profile) -> Objects {
        Objects(match (profile, stream.content) {
            (Profile::PlotJuggler, _) => Object::Plot(PlotObject::new(stream)),
            (Profile::Records, _) => Object::Record(RecordObject::new(stream)),
            (Profile::Lines, Content::Attitude | Content::Truth) => {
                Object::Att(AttObject::new(stream))
            }
            (Profile::Lines, Content::Samples(kind)) => Object::Rate(RateObject::new(stream, kind)),
        })
    }

    /// Appends the line of an attitude, number `seq` of its stream.
    pub fn push_attitude(&self, out: &mut Vec<u8>, seq: u64, sample: &AttitudeSample) {
        match &self.0 {
            Object::Att(object) => object.push(out, seq, sample),
            Object::Plot(object) => object.push(out, sample),
            Object::Record(object) => return object.push(out, sample),
            Object::Rate(_) => return,
        }
        out.push(b'\n');
    }

    /// Appends the line of a sample, number `seq` of its stream.
    pub fn push_raw(&self, out: &mut Vec<u8>, seq: u64, sample: &RawSample) {
        match &self.0 {
            Object::Rate(object) => object.push(out, seq, sample),
            Object::Plot(object) => object.push_raw(out, sample),
            Object::Att(_) | Object::Record(_) => return,
        }
        out.push(b'\n');
    }
}

/// Lines of every stream.
#[derive(Debug)]
struct Lines(Vec<Objects>);

/// Begins lines of objects.
pub(super) fn begin(opening: &Opening<'_>, _: &mut Vec<u8>) -> Result<Box<dyn Form>> {
    let streams = opening.streams.iter();
    let objects = streams.map(|s| Objects::new(s, opening.profile));
    Ok(Box::new(Lines(objects.collect())))
}

impl Form for Lines {
    fn encode(&self, slot: &mut Slot) {
        let Slot { batch, text, .. } = slot;
        let Some(objects) = self.0.get(batch.stream) else {
            return;
        };
        for (seq, sample) in (batch.first..).zip(&batch.samples) {
            objects.push_attitude(text, seq, sample);
        }
        for (seq, sample) in (batch.first..).zip(&batch.raw) {
            objects.push_raw(text, seq, sample);
        }
    }
}

/// The `RATE` object of one stream: what is absent is left out. Rate in rad/s (a delta angle in
/// rad), specific force in m/s^2, field in T.
#[derive(Debug)]
struct RateObject {
    head: Vec<u8>,
    kind: Vec<u8>,
}

impl RateObject {
    pub(super) fn new(stream: &Stream, kind: SampleKind) -> RateObject {
        let mut head = b"{\"class\":\"RATE\",\"id\":".to_vec();
        push_string(&mut head, &stream.id);
        head.extend_from_slice(b",\"seq\":");
        // Always: without it a reader goes by the step.
        let mut named = b",\"sample_kind\":".to_vec();
        push_string(&mut named, kind.name());
        RateObject { head, kind: named }
    }

    /// Appends the object, without a line end.
    pub(super) fn push(&self, out: &mut Vec<u8>, seq: u64, sample: &RawSample) {
        out.extend_from_slice(&self.head);
        push_u64(out, seq);
        out.extend_from_slice(b",\"stamp\":");
        push_stamp(out, sample.header.unwrap_or(sample.log));
        for (name, vector) in [
            (&b",\"gyro\":"[..], sample.gyro),
            (b",\"accel\":", sample.accel),
            (b",\"mag\":", sample.mag),
        ] {
            if let Some(vector) = vector {
                out.extend_from_slice(name);
                push_array3(out, vector);
            }
        }
        if let Some(interval) = sample.interval_nanos {
            out.extend_from_slice(b",\"dt_ns\":");
            push_i64(out, interval);
        }
        push_temperature_key(out, sample.temperature);
        out.extend_from_slice(&self.kind);
        out.push(b'}');
    }
}

/// Appends a temperature under its key, where there is one.
fn push_temperature_key(out: &mut Vec<u8>, temperature: Option<f32>) {
    if temperature.is_some_and(f32::is_finite) {
        out.extend_from_slice(b",\"");
        out.extend_from_slice(TEMPERATURE.as_bytes());
        out.extend_from_slice(b"\":");
        push_temperature(out, temperature);
    }
}

/// The `ATT` object of one stream, everything constant laid out beforehand.
#[derive(Debug)]
pub(super) struct AttObject {
    head: Vec<u8>,
    labels: Vec<u8>,
}

impl AttObject {
    pub(super) fn new(stream: &Stream) -> AttObject {
        let mut head = b"{\"class\":\"ATT\",\"id\":".to_vec();
        push_string(&mut head, &stream.id);
        head.extend_from_slice(b",\"seq\":");
        let mut labels = Vec::new();
        for (name, value) in [
            (&b"},\"rotates\":"[..], &stream.rotates),
            (b",\"world\":", &stream.world_axes),
            (b",\"body\":", &stream.body_axes),
        ] {
            labels.extend_from_slice(name);
            push_string(&mut labels, value);
        }
        labels.extend_from_slice(b",\"rate\":");
        AttObject { head, labels }
    }

    /// Appends the object, without a line end. Rate in rad/s, sigma in degrees, accelerations (and their sigma, along the
    /// body's axes) in m/s^2.
    pub(super) fn push(&self, out: &mut Vec<u8>, seq: u64, sample: &AttitudeSample) {
        out.extend_from_slice(&self.head);
        push_u64(out, seq);
        out.extend_from_slice(b",\"stamp\":");
        push_stamp(out, sample.stamp);
        let [w, x, y, z] = sample.q_nb.wxyz();
        for (name, value) in [
            (&b",\"q\":{\"w\":"[..], w),
            (b",\"x\":", x),
            (b",\"y\":", y),
            (b",\"z\":", z),
        ] {
            out.extend_from_slice(name);
            push_f64(out, value);
        }
        out.extend_from_slice(&self.labels);
        push_array3(out, sample.rate.into());
        out.extend_from_slice(b",\"sigma_deg\":");
        push_array3(out, sample.covariance.sigma().map(f64::to_degrees).into());
        out.extend_from_slice(b",\"status\":[");
        push_status(out, sample, b"\"", b",");
        out.extend_from_slice(b"],\"reset\":");
        push_u64(out, u64::from(sample.reset_count));
        if let Some(of) = &sample.linear_acceleration {
            let world = of.in_world(&sample.q_nb);
            for (name, vector) in [
                (&b",\"linear_acceleration\":"[..], of.body.as_vector()),
                (b",\"sigma_linear_acceleration\":", &of.sigma()),
                (b",\"world_linear_acceleration\":", world.as_vector()),
            ] {
                out.extend_from_slice(name);
                push_array3(out, (*vector).into());
            }
        }
        push_temperature_key(out, sample.temperature);
        out.push(b'}');
    }
}

/// The `foxglove.FrameTransform` object of one stream.
#[derive(Debug)]
pub(super) struct FrameTransform {
    frames: Vec<u8>,
    way: Transforms,
}

impl FrameTransform {
    /// The transform between a world and the frame of a sensor.
    pub(super) fn new(way: Transforms, world: &str, sensor: &str) -> FrameTransform {
        let [parent, child] = parent_and_child(way, world, sensor);
        let mut frames = b",\"parent_frame_id\":".to_vec();
        push_string(&mut frames, parent);
        frames.extend_from_slice(b",\"child_frame_id\":");
        push_string(&mut frames, child);
        frames
            .extend_from_slice(b",\"translation\":{\"x\":0,\"y\":0,\"z\":0},\"rotation\":{\"x\":");
        FrameTransform { frames, way }
    }

    pub(super) fn push(&self, out: &mut Vec<u8>, sample: &AttitudeSample) {
        out.extend_from_slice(b"{\"timestamp\":");
        push_stamp(out, sample.stamp);
        out.extend_from_slice(&self.frames);
        let [w, x, y, z] = of_transform(self.way, sample);
        push_f64(out, x);
        for (name, value) in [(&b",\"y\":"[..], y), (b",\"z\":", z), (b",\"w\":", w)] {
            out.extend_from_slice(name);
            push_f64(out, value);
        }
        out.extend_from_slice(b"}}");
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::sink::tests::sample;
    use nalgebra::Vector3;
    use strapd_attitude::quaternion::{BodyRate, Quaternion};
    use strapd_attitude::record::Nanos;
    use strapd_attitude::record::{AttitudeCovariance, Status};

    fn att(stream: &Stream, seq: u64, s: &AttitudeSample) -> String {
        let mut out = Vec::new();
        AttObject::new(stream).push(&mut out, seq, s);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn the_att_object_is_the_one_of_the_wire_protocol_to_the_byte() {
        let mut stream = Stream::new("/imu/data_raw", "imu_link");
        stream.id = "imu0".to_owned();
        let mut s = sample(Nanos(1_700_000_000_005_000_000));
        s.q_nb = Quaternion::identity();
        s.rate = BodyRate(Vector3::new(0.01, 0.0, -0.2));
        let sigma = Vector3::new(0.5, 1.0, 2.0).map(f64::to_radians);
        s.covariance = AttitudeCovariance::from_sigma(sigma);
        let expected = concat!(
            r#"{"class":"ATT","id":"imu0","seq":17,"stamp":{"sec":1700000000,"nsec":5000000},"#,
            r#""q":{"w":1.0,"x":0.0,"y":0.0,"z":0.0},"rotates":"sensor_to_world","world":"start","#,
            r#""body":"flu","rate":[0.01,0.0,-0.2],"sigma_deg":[0.5,1.0,2.0],"status":["ok"],"reset":0}"#
        );
        assert_eq!(att(&stream, 17, &s), expected);
    }

    #[test]
    fn hostile_names_and_values_that_are_not_finite_still_give_json() {
        let stream = Stream::new("a\"\\\n\u{1b}[31m é", "f");
        let mut s = sample(Nanos(-1));
        s.rate = BodyRate(Vector3::new(f64::NAN, f64::INFINITY, 5e-324));
        s.status = Status::HELD.with(Status::RESET);
        s.reset_count = 3;
        let line = att(&stream, u64::MAX, &s);
        let v: serde_json::Value = serde_json::from_str(&line).unwrap();
        assert_eq!(v["id"], stream.id.as_str());
        assert_eq!(v["seq"], u64::MAX);
        // One nanosecond before the epoch.
        assert_eq!(v["stamp"]["sec"], -1);
        assert_eq!(v["stamp"]["nsec"], 999_999_999);
        assert_eq!(v["rate"], serde_json::json!([null, null, 5e-324]));
        assert_eq!(v["status"], serde_json::json!(["held", "reset"]));
        assert_eq!(v["reset"], 3);
        assert!(!line.contains('\n'), "one object, one line");
    }

    #[test]
    fn a_frame_transform_names_its_quaternion_and_its_frames() {
        let mut out = Vec::new();
        let mut s = sample(Nanos(1_500_000_000));
        s.q_nb = Quaternion::assume_unit([0.1, 0.2, 0.3, 0.4]);
        FrameTransform::new(Transforms::Forward, "world", "imu").push(&mut out, &s);
        let v: serde_json::Value = serde_json::from_slice(&out).unwrap();
        assert_eq!(
            v,
            serde_json::json!({
                "timestamp": {"sec": 1, "nsec": 500_000_000},
                "parent_frame_id": "world", "child_frame_id": "imu",
                "translation": {"x": 0, "y": 0, "z": 0},
                "rotation": {"x": 0.2, "y": 0.3, "z": 0.4, "w": 0.1}
            })
        );
    }
}
