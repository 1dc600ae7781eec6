//! Samples -> `sensor_msgs/msg/Imu`, `sensor_msgs/msg/MagneticField`, `tf2_msgs/msg/TFMessage`,
//! `geometry_msgs/msg/QuaternionStamped` and `geometry_msgs/msg/Vector3Stamped` message records in CDR. Pure.
//!
//! Within a stream only numbers change from message to message, always at the same places. So each
//! stream lays its record out once and then copies and patches it: about 30 ns a message.

use crate::sink::Transforms;
use crate::sink::text::{of_transform, parent_and_child};
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};
use strapd_recording::mcap::MessageRecord;
use strapd_recording::records::cdr::{Cdr, put};
use strapd_recording::records::imu;

/// Template: where the numbers of a message record begin, and the record with zeros in their places.
#[derive(Debug)]
struct Template {
    record: Vec<u8>,
    /// Offset of the stamp.
    stamp: usize,
    /// Offset of the first f64.
    numbers: usize,
}

impl Template {
    fn new(channel: u16, (payload, stamp, numbers): (Vec<u8>, usize, usize)) -> Template {
        let mut record = MessageRecord::head(channel, 0, (0, 0), payload.len()).to_vec();
        record.extend_from_slice(&payload);
        Template {
            record,
            stamp: MessageRecord::HEAD + stamp,
            numbers: MessageRecord::HEAD + numbers,
        }
    }

    /// Appends a copy; the caller fills in the numbers behind the ones done here. The log time is
    /// the publish time too: there is no publisher whose clock it could be.
    fn append<'a>(
        &self,
        out: &'a mut Vec<u8>,
        sequence: u32,
        log_time: u64,
        stamp: [u8; 8],
    ) -> &'a mut [u8] {
        self.append_at(out, sequence, (log_time, log_time), stamp)
    }

    /// Appends a copy with these log and publish times.
    fn append_at<'a>(
        &self,
        out: &'a mut Vec<u8>,
        sequence: u32,
        times: (u64, u64),
        stamp: [u8; 8],
    ) -> &'a mut [u8] {
        let start = out.len();
        out.extend_from_slice(&self.record);
        let record = &mut out[start..];
        if let Some(head) = record.first_chunk_mut() {
            MessageRecord::number(head, sequence, times);
        }
        record[self.stamp..self.stamp + 8].copy_from_slice(&stamp);
        &mut record[self.numbers..]
    }
}

/// `builtin_interfaces/msg/Time`: 32-bit seconds end in 2038 (and 1901). Beyond them the nearest
/// time there is, and `false`.
pub(super) fn ros_time(stamp: Nanos) -> ([u8; 8], bool) {
    let (sec, nanosec) = stamp.to_sec_nanosec();
    let (sec, nanosec, fits) = match i32::try_from(sec) {
        Ok(sec) => (sec, nanosec, true),
        Err(_) if sec < 0 => (i32::MIN, 0, false),
        Err(_) => (i32::MAX, 999_999_999, false),
    };
    let (s, n) = (sec.to_le_bytes(), nanosec.to_le_bytes());
    ([s[0], s[1], s[2], s[3], n[0], n[1], n[2], n[3]], fits)
}

/// `sensor_msgs/msg/Imu` of one stream.
#[derive(Debug)]
pub(crate) struct Imu(Template);

impl Imu {
    pub(super) fn new(channel: u16, frame_id: &str) -> Imu {
        Imu(Template::new(channel, imu::empty(Cdr::default(), frame_id)))
    }

    /// Bytes of one message record.
    pub(super) fn len(&self) -> usize {
        self.0.record.len()
    }

    /// Appends the record. Covariances as REP-145 reads them: ours of the orientation, about the fixed
    /// axes of the world (`docs/conventions.md`; zeros when it is not finite: unknown), of the rate
    /// unknown, of an absent acceleration -1.
    pub(super) fn append(
        &self,
        out: &mut Vec<u8>,
        sequence: u32,
        log_time: u64,
        stamp: [u8; 8],
        sample: &AttitudeSample,
    ) {
        let numbers = self.0.append(out, sequence, log_time, stamp);
        let [w, x, y, z] = sample.q_nb.wxyz();
        put(numbers, imu::ORIENTATION, [x, y, z, w]);
        let p = sample.covariance.in_navigation_axes(&sample.q_nb);
        if p.iter().all(|v| v.is_finite()) {
            // Symmetric: columns are rows.
            put::<9>(
                numbers,
                imu::ORIENTATION_COVARIANCE,
                std::array::from_fn(|i| p[i]),
            );
        }
        put(numbers, imu::RATE, sample.rate.into());
        match sample.accel {
            Some(accel) => put(numbers, imu::FORCE, accel.into()),
            None => put(numbers, imu::FORCE_COVARIANCE, [-1.0]),
        }
    }

    /// Appends the record of what a sensor put out: no orientation, covariances unknown; a rate or
    /// specific force that is absent is marked so.
    pub(super) fn append_raw(
        &self,
        out: &mut Vec<u8>,
        sequence: u32,
        log_time: u64,
        stamp: [u8; 8],
        sample: &RawSample,
    ) {
        let numbers = self.0.append(out, sequence, log_time, stamp);
        // REP-145: a quaternion of no rotation, and a covariance that says it is none.
        put(numbers, imu::ORIENTATION + 3, [1.0, -1.0]);
        for (vector, at) in [(sample.gyro, imu::RATE), (sample.accel, imu::FORCE)] {
            match vector {
                Some(vector) => put(numbers, at, vector),
                None => put(numbers, at + 3, [-1.0]),
            }
        }
    }
}

/// A header and `N` numbers: `geometry_msgs/msg/QuaternionStamped` (x, y, z, w),
/// `geometry_msgs/msg/Vector3Stamped` and `sensor_msgs/msg/MagneticField` (and its covariance) of one stream.
#[derive(Debug)]
pub(crate) struct Stamped<const N: usize>(Template);

impl<const N: usize> Stamped<N> {
    pub(super) fn new(channel: u16, frame_id: &str) -> Self {
        let mut cdr = Cdr::default();
        let stamp = cdr.stamp();
        cdr.string(frame_id);
        let numbers = cdr.numbers(N);
        Stamped(Template::new(channel, (cdr.into_bytes(), stamp, numbers)))
    }

    /// Bytes of one message record.
    pub(super) fn len(&self) -> usize {
        self.0.record.len()
    }

    /// Appends the record.
    pub(super) fn append(
        &self,
        out: &mut Vec<u8>,
        sequence: u32,
        log_time: u64,
        stamp: [u8; 8],
        values: [f64; N],
    ) {
        put(self.0.append(out, sequence, log_time, stamp), 0, values);
    }
}

impl Imu {
    /// Appends an input sample as it was received, with its own clocks; what it lacks is marked as
    /// absent (REP-145: -1 as the covariance's first element), what it has is of unknown covariance.
    pub(super) fn append_input(
        &self,
        out: &mut Vec<u8>,
        sequence: u32,
        times: [u64; 2],
        stamp: [u8; 8],
        sample: &RawSample,
    ) {
        let [log_time, publish_time] = times;
        let times = (log_time, publish_time);
        let numbers = self.0.append_at(out, sequence, times, stamp);
        match sample.orientation {
            Some([w, x, y, z]) => put(numbers, imu::ORIENTATION, [x, y, z, w]),
            None => put(numbers, imu::ORIENTATION_COVARIANCE, [-1.0]),
        }
        match sample.gyro {
            Some(gyro) => put(numbers, imu::RATE, gyro),
            None => put(numbers, imu::RATE_COVARIANCE, [-1.0]),
        }
        match sample.accel {
            Some(accel) => put(numbers, imu::FORCE, accel),
            None => put(numbers, imu::FORCE_COVARIANCE, [-1.0]),
        }
    }
}

/// `tf2_msgs/msg/TFMessage` of one stream: one transform, no translation.
#[derive(Debug)]
pub(crate) struct Tf(Template, Transforms);

impl Tf {
    /// The transform between a world and the frame of a sensor.
    pub(super) fn new(channel: u16, way: Transforms, world: &str, sensor: &str) -> Tf {
        let [parent, child] = parent_and_child(way, world, sensor);
        let mut cdr = Cdr::default();
        cdr.u32(1);
        let stamp = cdr.stamp();
        cdr.string(parent);
        cdr.string(child);
        let numbers = cdr.numbers(3 + 4);
        Tf(
            Template::new(channel, (cdr.into_bytes(), stamp, numbers)),
            way,
        )
    }

    /// Bytes of one message record.
    pub(super) fn len(&self) -> usize {
        self.0.record.len()
    }

    /// Appends the record.
    pub(super) fn append(
        &self,
        out: &mut Vec<u8>,
        sequence: u32,
        log_time: u64,
        stamp: [u8; 8],
        sample: &AttitudeSample,
    ) {
        let numbers = self.0.append(out, sequence, log_time, stamp);
        let [w, x, y, z] = of_transform(self.1, sample);
        put(numbers, 3, [x, y, z, w]);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::sink::tests::sample;
    use nalgebra::Vector3;
    use strapd_attitude::frames::In;
    use strapd_attitude::quaternion::{BodyRate, Quaternion};
    use strapd_attitude::record::AttitudeCovariance;

    fn f64_at(bytes: &[u8], at: usize) -> f64 {
        f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
    }

    /// Offsets measured against rosbags 0.11.9: `base = 4 + align8(12 + n + 1)`, total `base + 296`.
    #[test]
    fn the_imu_layout_is_the_measured_one_for_every_length_of_frame_id() {
        for n in 0..40 {
            let imu = Imu::new(1, &"f".repeat(n));
            let base = 4 + (12 + n + 1).next_multiple_of(8);
            assert_eq!(imu.len() - MessageRecord::HEAD, base + 296, "{n}");
            let mut s = sample(Nanos(5_000_000_007));
            // A quarter turn about z: body x is world y, body y is world -x.
            let half = std::f64::consts::FRAC_1_SQRT_2;
            s.q_nb = Quaternion::assume_unit([half, 0.0, 0.0, half]);
            s.rate = BodyRate(Vector3::new(1.0, 2.0, 3.0));
            s.accel = Some(In::assume(Vector3::new(4.0, 5.0, 6.0)));
            s.covariance = AttitudeCovariance {
                xy: 1.0,
                xz: 2.0,
                yz: 3.0,
                ..AttitudeCovariance::from_sigma(Vector3::new(7.0, 8.0, 9.0))
            };
            let mut out = Vec::new();
            imu.append(&mut out, 0, 0, ros_time(s.stamp).0, &s);
            let m = &out[MessageRecord::HEAD..];
            assert_eq!(m[..12], [0, 1, 0, 0, 5, 0, 0, 0, 7, 0, 0, 0]);
            assert_eq!(m[12..16], (n as u32 + 1).to_le_bytes());
            assert_eq!(m[16 + n], 0);
            let xyzw: Vec<f64> = (0..4).map(|i| f64_at(m, base + 8 * i)).collect();
            assert_eq!(xyzw, [0.0, 0.0, half, half]);
            let covariance: Vec<f64> = (0..9).map(|i| f64_at(m, base + 32 + 8 * i)).collect();
            let expected = [64.0, -1.0, -3.0, -1.0, 49.0, 2.0, -3.0, 2.0, 81.0];
            for (found, expected) in covariance.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-13, "{covariance:?}");
            }
            assert_eq!(f64_at(m, base + 104), 1.0);
            assert_eq!(f64_at(m, base + 120), 3.0);
            assert_eq!(f64_at(m, base + 200), 4.0);
            assert_eq!(f64_at(m, base + 224), 0.0);
        }
    }

    #[test]
    fn what_is_unknown_is_marked_as_rep_145_marks_it() {
        let imu = Imu::new(1, "");
        let mut s = sample(Nanos(0));
        s.accel = None;
        s.covariance = AttitudeCovariance::from_sigma(Vector3::new(f64::NAN, 1.0, 1.0));
        let mut out = Vec::new();
        imu.append(&mut out, 0, 0, [0; 8], &s);
        let m = &out[MessageRecord::HEAD..];
        // base is 20 for an empty frame_id.
        assert!(
            m[52..52 + 72].iter().all(|b| *b == 0),
            "unknown orientation covariance"
        );
        assert_eq!(f64_at(m, 20 + 224), -1.0, "absent acceleration");
    }

    #[test]
    fn the_tf_layout_is_the_measured_one() {
        let tf = Tf::new(2, Transforms::Forward, "world", "imu_link");
        assert_eq!(tf.len() - MessageRecord::HEAD, 100);
        let mut s = sample(Nanos(0));
        s.q_nb = Quaternion::assume_unit([0.1, 0.2, 0.3, 0.4]);
        let mut out = Vec::new();
        tf.append(&mut out, 0, 0, [0; 8], &s);
        let m = &out[MessageRecord::HEAD..];
        let xyzw: Vec<f64> = (0..4).map(|i| f64_at(m, 68 + 8 * i)).collect();
        assert_eq!(xyzw, [0.2, 0.3, 0.4, 0.1]);
    }

    #[test]
    fn stamps_beyond_32_bit_seconds_stop_at_the_end_and_say_so() {
        let second = 1_000_000_000;
        let (bytes, fits) = ros_time(Nanos((i64::from(i32::MAX) + 1) * second));
        assert_eq!(
            (bytes[..4].to_vec(), fits),
            (i32::MAX.to_le_bytes().to_vec(), false)
        );
        let (bytes, fits) = ros_time(Nanos(-second / 2));
        assert_eq!(
            (bytes[..4].to_vec(), fits),
            ((-1i32).to_le_bytes().to_vec(), true)
        );
        let (bytes, fits) = ros_time(Nanos(i64::MIN));
        assert_eq!(
            (bytes[..4].to_vec(), fits),
            (i32::MIN.to_le_bytes().to_vec(), false)
        );
    }
}
