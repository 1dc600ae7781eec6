//! Samples and attitudes <-> packed objects: the compact form beside the lines. Pure.
//!
//! Apart from the lines because there is nothing to parse: fixed places, little endian, naturally
//! aligned. The mark begins no line and occurs in no UTF-8, so both forms go through one stream. Which
//! stream a number means is said by lines (`PACKED`).
//!
//! ```text
//!        0 u8 mark 0xF8 | 1 u8 kind | 2 u16 length, of all | 4 u32 stream | 8 u64 seq | 16 i64 stamp ns
//! RATE 1 24 3 x f64 gyro (48) | 48 3 x f64 accel (72) | 72 i64 interval ns (80) | 80 3 x f64 mag (104)
//! ATT  2 24 4 x f64 q w, x, y, z | 56 3 x f64 rate | 80 3 x f64 sigma_deg | 104 u32 status | 108 u32 reset (112)
//! ```
//!
//! A `RATE` may end after any of its four parts. What is longer than known is read by its known part. In
//! a vector NaN is no data, as `null` in a line.

mod binding;

pub use binding::{Unbound, binding};
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};

/// The first byte of every packed object.
pub const MARK: u8 = 0xF8;
/// Bytes before what depends on the kind.
pub const HEAD: usize = 8;
/// Bytes of an attitude.
pub const ATT: usize = 112;
/// Bytes of a sample, with a specific force, with an interval too, and with a magnetic field.
pub const RATE: [usize; 4] = [48, 72, 80, 104];
/// The stamp, or interval, that is none.
const NO_TIME: i64 = i64::MIN;
/// The sequence number that is none.
pub const NO_SEQ: u64 = u64::MAX;

const KIND_RATE: u8 = 1;
const KIND_ATT: u8 = 2;

/// Form in which the objects of a stream are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Form {
    /// One line each.
    #[default]
    Lines,
    /// Packed.
    Packed,
}

/// One object.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Object {
    /// A sample and the sender's number of it.
    Rate {
        /// Number of the stream.
        stream: u32,
        /// The sender's number.
        seq: Option<u64>,
        /// The sample; when it was received is not in it.
        sample: RawSample,
    },
    /// An attitude.
    Att {
        /// Number of the stream.
        stream: u32,
        /// Attitude that it holds.
        attitude: Attitude,
    },
}

/// An attitude as it is packed: the numbers of an `ATT` line.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Attitude {
    /// Number in its stream.
    pub seq: u64,
    /// The instant it holds for.
    pub stamp: Nanos,
    /// w, x, y, z; sensor (or body) to world.
    pub q: [f64; 4],
    /// Body rate, rad/s.
    pub rate: [f64; 3],
    /// Standard deviation about each body axis, degrees.
    pub sigma_deg: [f64; 3],
    /// The bits of [`strapd_attitude::record::Status`].
    pub status: u32,
    /// Number of times it has been reset or held.
    pub reset: u32,
}

impl Attitude {
    /// The sample that it is to whoever integrates its rates anew.
    #[must_use]
    pub fn as_sample(&self, received: Nanos) -> RawSample {
        RawSample {
            header: Some(self.stamp),
            log: received,
            publish: received,
            gyro: some_vector(self.rate),
            orientation: Some(self.q).filter(|q| q.iter().all(|v| v.is_finite())),
            ..RawSample::default()
        }
    }
}

/// Why an object says nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unreadable {
    /// Bytes that do not begin with the mark, or are not as long as they state.
    NoObject,
    /// Unknown kind.
    Kind(u8),
    /// Object shorter than its kind.
    Short {
        /// Bytes it has.
        have: usize,
        /// Bytes its kind needs.
        need: usize,
    },
}

impl std::fmt::Display for Unreadable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Unreadable::NoObject => write!(f, "no whole packed object"),
            Unreadable::Kind(kind) => write!(
                f,
                "packed kind {kind} is not known; there are 1 RATE, 2 ATT"
            ),
            Unreadable::Short { have, need } => {
                write!(f, "a packed object of {have} bytes, need {need}")
            }
        }
    }
}

/// Length of an object that begins so; `None` while that cannot be seen, or where no object begins.
#[must_use]
pub fn length(beginning: &[u8]) -> Option<usize> {
    match beginning {
        [MARK, _, low, high, ..] => Some(usize::from(u16::from_le_bytes([*low, *high]))),
        _ => None,
    }
}

/// Whether packed objects stand in a stretch of whole ones, or of whole lines.
#[must_use]
pub fn is_packed(stretch: &[u8]) -> bool {
    stretch.first() == Some(&MARK)
}

/// The objects in a stretch of whole ones; a rest that is none is left out.
pub fn objects(stretch: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = stretch;
    std::iter::from_fn(move || {
        let length = length(rest).filter(|n| *n >= HEAD)?;
        let (object, after) = rest.split_at_checked(length)?;
        rest = after;
        Some(object)
    })
}

/// Reads one whole object; `received` becomes the log and publish time of a sample.
///
/// # Errors
/// [`Unreadable`], to be counted.
pub fn read(object: &[u8], received: Nanos) -> Result<Object, Unreadable> {
    if length(object) != Some(object.len()) {
        return Err(Unreadable::NoObject);
    }
    let need = match object.get(1) {
        Some(&KIND_RATE) => RATE[0],
        Some(&KIND_ATT) => ATT,
        kind => return Err(Unreadable::Kind(kind.copied().unwrap_or_default())),
    };
    let short = Unreadable::Short {
        have: object.len(),
        need,
    };
    let read = || {
        let stream = u32_at(object, 4)?;
        let (seq, stamp) = (u64_at(object, 8)?, u64_at(object, 16)?.cast_signed());
        if need == ATT {
            let attitude = Attitude {
                seq,
                stamp: Nanos(stamp),
                q: floats_at(object, 24)?,
                rate: floats_at(object, 56)?,
                sigma_deg: floats_at(object, 80)?,
                status: u32_at(object, 104)?,
                reset: u32_at(object, 108)?,
            };
            return Some(Object::Att { stream, attitude });
        }
        let sample = RawSample {
            header: some_time(stamp).map(Nanos),
            log: received,
            publish: received,
            gyro: some_vector(floats_at(object, 24)?),
            accel: floats_at(object, 48).and_then(some_vector),
            mag: floats_at(object, 80).and_then(some_vector),
            orientation: None,
            orientation_resets: None,
            interval_nanos: u64_at(object, 72).and_then(|n| some_time(n.cast_signed())),
            is_beside: false,
        };
        let seq = Some(seq).filter(|n| *n != NO_SEQ);
        Some(Object::Rate {
            stream,
            seq,
            sample,
        })
    };
    read().ok_or(short)
}

/// Appends an attitude, number `seq` of its stream.
pub fn push_attitude(out: &mut Vec<u8>, stream: u32, seq: u64, sample: &AttitudeSample) {
    let mut object = [0; ATT];
    begin(&mut object, KIND_ATT, stream, seq, sample.stamp.0);
    put_floats(&mut object, 24, sample.q_nb.wxyz());
    put_floats(&mut object, 56, sample.rate.into());
    let sigma = sample.covariance.sigma().map(f64::to_degrees);
    put_floats(&mut object, 80, sigma.into());
    object[104..108].copy_from_slice(&u32::from(sample.status.0).to_le_bytes());
    object[108..112].copy_from_slice(&sample.reset_count.to_le_bytes());
    out.extend_from_slice(&object);
}

/// Appends a sample, number `seq` of its stream, as short as what it has allows. Stamped as its line
/// would be: with its own stamp, else with when it was logged.
pub fn push_sample(out: &mut Vec<u8>, stream: u32, seq: u64, sample: &RawSample) {
    let [bare, with_accel, with_interval, with_mag] = RATE;
    let stamp = sample.header.unwrap_or(sample.log).0;
    let mut object = [0; RATE[3]];
    put_floats(&mut object, 24, sample.gyro.unwrap_or([f64::NAN; 3]));
    put_floats(&mut object, 48, sample.accel.unwrap_or([f64::NAN; 3]));
    put(
        &mut object,
        72,
        sample.interval_nanos.unwrap_or(NO_TIME).to_le_bytes(),
    );
    put_floats(&mut object, 80, sample.mag.unwrap_or([f64::NAN; 3]));
    let length = match (sample.accel, sample.interval_nanos, sample.mag) {
        (_, _, Some(_)) => with_mag,
        (_, Some(_), None) => with_interval,
        (Some(_), None, None) => with_accel,
        (None, None, None) => bare,
    };
    let object = &mut object[..length];
    begin(object, KIND_RATE, stream, seq, stamp);
    out.extend_from_slice(object);
}

fn begin(object: &mut [u8], kind: u8, stream: u32, seq: u64, stamp: i64) {
    // The longest is 112.
    let [low, high] = (object.len() as u16).to_le_bytes();
    object[..4].copy_from_slice(&[MARK, kind, low, high]);
    object[4..8].copy_from_slice(&stream.to_le_bytes());
    put(object, 8, seq.to_le_bytes());
    put(object, 16, stamp.to_le_bytes());
}

fn put(object: &mut [u8], at: usize, bytes: [u8; 8]) {
    object[at..at + 8].copy_from_slice(&bytes);
}

/// Writes numbers; one that is not finite is `null` in a line, and NaN here: one NaN, so that equal attitudes are
/// equal bytes.
fn put_floats<const N: usize>(object: &mut [u8], at: usize, values: [f64; N]) {
    for (n, value) in values.into_iter().enumerate() {
        let value = if value.is_finite() { value } else { f64::NAN };
        put(object, at + 8 * n, value.to_le_bytes());
    }
}

fn bytes_at<const N: usize>(object: &[u8], at: usize) -> Option<[u8; N]> {
    object.get(at..at + N)?.try_into().ok()
}

fn u32_at(object: &[u8], at: usize) -> Option<u32> {
    bytes_at(object, at).map(u32::from_le_bytes)
}

fn u64_at(object: &[u8], at: usize) -> Option<u64> {
    bytes_at(object, at).map(u64::from_le_bytes)
}

fn floats_at<const N: usize>(object: &[u8], at: usize) -> Option<[f64; N]> {
    let mut values = [0.0; N];
    for (n, value) in values.iter_mut().enumerate() {
        *value = f64::from_le_bytes(bytes_at(object, at + 8 * n)?);
    }
    Some(values)
}

fn some_time(nanos: i64) -> Option<i64> {
    Some(nanos).filter(|n| *n != NO_TIME)
}

/// Reads a vector; one with `null` in it is none, as in a line.
fn some_vector(vector: [f64; 3]) -> Option<[f64; 3]> {
    Some(vector).filter(|v| !v.iter().any(|c| c.is_nan()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use strapd_attitude::quaternion::{BodyRate, Quaternion};
    use strapd_attitude::record::{AttitudeCovariance, Status};

    /// An attitude with nothing special about it.
    fn sample(stamp: Nanos) -> AttitudeSample {
        AttitudeSample {
            stamp,
            q_nb: Quaternion::assume_unit([0.5, -0.5, 0.5, 0.5]),
            rate: BodyRate(Vector3::new(0.1, -0.2, 0.3)),
            accel: None,
            covariance: AttitudeCovariance::from_sigma(Vector3::new(1e-3, 2e-3, 3e-3)),
            status: Status::OK,
            reset_count: 0,
            log: stamp,
        }
    }

    fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|b| format!("{b:02x}")).collect()
    }

    #[test]
    fn a_packed_sample_is_these_bytes() {
        let mut bytes = Vec::new();
        let mut raw = RawSample {
            header: Some(Nanos(0x0102_0304_0506_0708)),
            gyro: Some([1.0, -2.0, 0.5]),
            ..RawSample::default()
        };
        push_sample(&mut bytes, 0x0a0b_0c0d, 17, &raw);
        let after_head = concat!(
            "0d0c0b0a",
            "1100000000000000",
            "0807060504030201",
            "000000000000f03f",
            "00000000000000c0",
            "000000000000e03f"
        );
        assert_eq!(hex(&bytes), format!("f8013000{after_head}"));
        let accel = "000000000000000000000000000000000000000000002440";
        raw.accel = Some([0.0, 0.0, 10.0]);
        bytes.clear();
        push_sample(&mut bytes, 0x0a0b_0c0d, 17, &raw);
        assert_eq!(hex(&bytes), format!("f8014800{after_head}{accel}"));
        raw.interval_nanos = Some(1_000_000);
        bytes.clear();
        push_sample(&mut bytes, 0x0a0b_0c0d, 17, &raw);
        assert_eq!(
            hex(&bytes),
            format!("f8015000{after_head}{accel}40420f0000000000")
        );
    }

    #[test]
    fn a_packed_attitude_is_these_bytes() {
        let mut s = sample(Nanos(-1));
        s.q_nb = Quaternion::assume_unit([1.0, 0.0, -0.0, 0.0]);
        s.rate = BodyRate(Vector3::new(0.5, f64::INFINITY, -2.0));
        s.covariance = AttitudeCovariance::default();
        s.status = Status::HELD.with(Status::RESTARTED);
        s.reset_count = 3;
        let mut bytes = Vec::new();
        push_attitude(&mut bytes, 2, 1, &s);
        let expected = concat!(
            "f8027000",
            "02000000",
            "0100000000000000",
            "ffffffffffffffff",
            "000000000000f03f",
            "0000000000000000",
            "0000000000000080",
            "0000000000000000",
            "000000000000e03f",
            "000000000000f87f",
            "00000000000000c0",
            "000000000000000000000000000000000000000000000000",
            "02020000",
            "03000000"
        );
        assert_eq!(hex(&bytes), expected);
    }

    #[test]
    fn status_bits_mean_what_the_protocol_says() {
        let page = include_str!("../../../../docs/protocol.md");
        let row = |bit: u32, name: &str| format!("| {bit} | `{name}` |");
        for bit in 0..16 {
            let names: Vec<_> = Status(1 << bit).names().collect();
            assert_eq!(names.len(), usize::from(bit < 14), "bit {bit}: {names:?}");
            for name in names {
                assert!(page.contains(&row(bit, name)), "bit {bit} is {name}");
            }
        }
    }

    #[test]
    fn what_is_packed_is_read_back_to_the_bit() {
        let received = Nanos(5);
        for gyro in [None, Some([0.1, -0.2, 5e-324])] {
            for accel in [None, Some([0.0, -0.0, 9.81])] {
                for (interval_nanos, mag) in [
                    (None, None),
                    (Some(0), None),
                    (Some(-7), Some([2e-5, -0.0, 4.5e-5])),
                    (None, Some([1.0, 2.0, 3.0])),
                ] {
                    let raw = RawSample {
                        header: Some(Nanos(-3)),
                        log: received,
                        publish: received,
                        gyro,
                        accel,
                        mag,
                        interval_nanos,
                        ..RawSample::default()
                    };
                    let mut bytes = Vec::new();
                    push_sample(&mut bytes, 9, 4, &raw);
                    assert_eq!(length(&bytes), Some(bytes.len()));
                    let object = Object::Rate {
                        stream: 9,
                        seq: Some(4),
                        sample: raw,
                    };
                    assert_eq!(read(&bytes, received), Ok(object));
                }
            }
        }
        let s = sample(Nanos(1_700_000_000_000_000_001));
        let mut bytes = Vec::new();
        push_attitude(&mut bytes, 7, u64::MAX, &s);
        let Ok(Object::Att { stream, attitude }) = read(&bytes, received) else {
            unreachable!("an attitude");
        };
        assert_eq!(
            (stream, attitude.seq, attitude.stamp),
            (7, u64::MAX, s.stamp)
        );
        assert_eq!(attitude.q, s.q_nb.wxyz());
        assert_eq!(attitude.rate, <[f64; 3]>::from(s.rate));
        let sigma = s.covariance.sigma().map(f64::to_degrees);
        assert_eq!(attitude.sigma_deg, <[f64; 3]>::from(sigma));
    }

    #[test]
    fn what_is_absent_is_absent_and_one_nan_takes_its_vector_with_it() {
        let mut bytes = Vec::new();
        let raw = RawSample {
            gyro: Some([1.0, f64::NAN, 1.0]),
            accel: Some([f64::NAN, 1.0, 1.0]),
            ..RawSample::default()
        };
        push_sample(&mut bytes, 1, NO_SEQ, &raw);
        bytes[16..24].copy_from_slice(&NO_TIME.to_le_bytes());
        let Ok(Object::Rate { seq, sample, .. }) = read(&bytes, Nanos(0)) else {
            unreachable!("a sample");
        };
        assert_eq!(
            (seq, sample.header, sample.gyro, sample.accel),
            (None, None, None, None)
        );
        // Infinity is no absence: it is counted as what it is.
        bytes[32..40].copy_from_slice(&f64::INFINITY.to_le_bytes());
        let Ok(Object::Rate { sample, .. }) = read(&bytes, Nanos(0)) else {
            unreachable!("a sample");
        };
        assert_eq!(sample.gyro, Some([1.0, f64::INFINITY, 1.0]));
    }

    #[test]
    fn an_attitude_is_a_sample_of_what_it_has() {
        let attitude = Attitude {
            stamp: Nanos(7),
            q: [1.0, 0.0, 0.0, 0.0],
            rate: [0.1, 0.2, 0.3],
            ..Attitude::default()
        };
        let sample = attitude.as_sample(Nanos(9));
        assert_eq!((sample.header, sample.log), (Some(Nanos(7)), Nanos(9)));
        assert_eq!(sample.gyro, Some(attitude.rate));
        assert_eq!(sample.orientation, Some(attitude.q));
        let nothing = Attitude {
            q: [1.0, f64::INFINITY, 0.0, 0.0],
            rate: [0.1, f64::NAN, 0.3],
            ..attitude
        };
        let sample = nothing.as_sample(Nanos(9));
        assert_eq!((sample.gyro, sample.orientation), (None, None));
    }

    fn sized(kind: u8, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        let [low, high] = (length as u16).to_le_bytes();
        bytes[..4].copy_from_slice(&[MARK, kind, low, high]);
        bytes
    }

    #[test]
    fn longer_objects_are_read_by_their_known_part_and_shorter_ones_are_refused() {
        for have in [8, 40, 47] {
            let need = 48;
            assert_eq!(
                read(&sized(1, have), Nanos(0)),
                Err(Unreadable::Short { have, need })
            );
        }
        for have in [8, 48, 111] {
            let need = 112;
            assert_eq!(
                read(&sized(2, have), Nanos(0)),
                Err(Unreadable::Short { have, need })
            );
        }
        for (length, accel, interval) in [
            (48, false, false),
            (71, false, false),
            (72, true, false),
            (79, true, false),
            (80, true, true),
            (65_535, true, true),
        ] {
            let Ok(Object::Rate { sample, .. }) = read(&sized(1, length), Nanos(0)) else {
                unreachable!("{length} bytes");
            };
            assert_eq!(sample.gyro, Some([0.0; 3]));
            assert_eq!(
                (sample.accel.is_some(), sample.interval_nanos.is_some()),
                (accel, interval),
                "{length}"
            );
        }
        assert!(matches!(
            read(&sized(2, 200), Nanos(0)),
            Ok(Object::Att { .. })
        ));
        assert_eq!(read(&sized(3, 200), Nanos(0)), Err(Unreadable::Kind(3)));
        assert_eq!(read(&[], Nanos(0)), Err(Unreadable::NoObject));
        assert_eq!(
            read(&sized(1, 48)[..47], Nanos(0)),
            Err(Unreadable::NoObject)
        );
    }

    #[test]
    fn a_stretch_is_taken_apart_and_a_rest_left_out() {
        let stretch = [sized(1, 48), sized(9, 8), sized(2, 112), sized(1, 7)].concat();
        let lengths: Vec<_> = objects(&stretch).map(<[u8]>::len).collect();
        assert_eq!(lengths, [48, 8, 112]);
        assert!(is_packed(&stretch) && !is_packed(b"{}\n") && !is_packed(b""));
    }
}
