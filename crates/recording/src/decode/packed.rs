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
//!        112 3 x f64 acceleration without gravity, body axes | 136 3 x f64 its sigma (160)
//! ```
//!
//! A `RATE` may end after any of its four parts, an `ATT` after either of its two. What is longer than known is read by its known part. In
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
/// Bytes of an attitude with its acceleration without gravity.
const ATT_WITH_ACCELERATION: usize = 160;
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
    /// Acceleration without gravity along the body, m/s^2, and its standard deviation.
    pub linear_acceleration: Option<([f64; 3], [f64; 3])>,
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
                linear_acceleration: floats_at(object, ATT)
                    .and_then(some_vector)
                    .zip(floats_at(object, ATT + 24)),
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
            temperature: None,
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
    let mut object = [0; ATT_WITH_ACCELERATION];
    let object = match &sample.linear_acceleration {
        Some(of) => {
            put_floats(&mut object, ATT, (*of.body.as_vector()).into());
            put_floats(&mut object, ATT + 24, of.sigma().into());
            &mut object[..]
        }
        None => &mut object[..ATT],
    };
    begin(object, KIND_ATT, stream, seq, sample.stamp.0);
    put_floats(object, 24, sample.q_nb.wxyz());
    put_floats(object, 56, sample.rate.into());
    let sigma = sample.covariance.sigma().map(f64::to_degrees);
    put_floats(object, 80, sigma.into());
    object[104..108].copy_from_slice(&u32::from(sample.status.0).to_le_bytes());
    object[108..112].copy_from_slice(&sample.reset_count.to_le_bytes());
    out.extend_from_slice(object);
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
    // The longest is 160.
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
mod tests;
