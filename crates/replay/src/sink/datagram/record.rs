//! AttitudeSample <-> bytes with its name and world, on their way to who makes datagrams of them. Pure.
//!
//! Apart from the protocols because it is ours alone: attitudes are encoded once, by stream and on any thread, and become
//! datagrams where those are sent, by somebody who knows what went before.

use crate::sink::axes::convention;
use crate::sink::stream::Stream;
use nalgebra::Vector3;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};
use strapd_attitude::worlds::Convention;

/// Bytes before the name: stamp, world, quaternion, rate.
const HEAD: usize = 8 + 1 + 4 * 8 + 3 * 8;

/// Maker of the records of one stream.
#[derive(Debug)]
pub(in crate::sink) struct RecordObject {
    world: Convention,
    id: String,
}

impl RecordObject {
    pub(in crate::sink) fn new(stream: &Stream) -> RecordObject {
        RecordObject {
            world: convention(&stream.world_axes),
            id: stream.bounded().id,
        }
    }

    /// Appends a record behind its length.
    pub(in crate::sink) fn push(&self, out: &mut Vec<u8>, sample: &AttitudeSample) {
        let Ok(length) = u16::try_from(HEAD + self.id.len()) else {
            return;
        };
        out.extend_from_slice(&length.to_le_bytes());
        out.extend_from_slice(&sample.stamp.0.to_le_bytes());
        out.push(match self.world {
            Convention::EnuFlu => 0,
            Convention::NedFrd => 1,
            Convention::NwuFlu => 2,
        });
        let rate: [f64; 3] = sample.rate.into();
        for number in sample.q_nb.wxyz().into_iter().chain(rate) {
            out.extend_from_slice(&number.to_le_bytes());
        }
        out.extend_from_slice(self.id.as_bytes());
    }
}

/// An attitude of a stream.
#[derive(Debug)]
pub(super) struct Attitude<'a> {
    pub(super) id: &'a str,
    pub(super) world: Convention,
    /// Stamp, attitude and rate; the rest is not known here.
    pub(super) sample: AttitudeSample,
}

/// Takes one record from the front of `bytes`; `None` at their end.
pub(super) fn next<'a>(bytes: &mut &'a [u8]) -> Option<Attitude<'a>> {
    let (length, rest) = bytes.split_first_chunk::<2>()?;
    let (own, rest) = rest.split_at_checked(usize::from(u16::from_le_bytes(*length)))?;
    *bytes = rest;
    let (stamp, own) = own.split_first_chunk::<8>()?;
    let (world, mut own) = own.split_first()?;
    let mut number = || {
        let (number, rest) = own.split_first_chunk::<8>()?;
        own = rest;
        Some(f64::from_le_bytes(*number))
    };
    let q = [number()?, number()?, number()?, number()?];
    let rate = Vector3::new(number()?, number()?, number()?);
    let stamp = Nanos(i64::from_le_bytes(*stamp));
    Some(Attitude {
        id: std::str::from_utf8(own).ok()?,
        world: match world {
            0 => Convention::EnuFlu,
            1 => Convention::NedFrd,
            _ => Convention::NwuFlu,
        },
        sample: AttitudeSample {
            stamp,
            q_nb: Quaternion::assume_unit(q),
            rate: BodyRate(rate),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::from_sigma(Vector3::zeros()),
            status: Status::OK,
            reset_count: 0,
            log: stamp,
            temperature: None,
        },
    })
}
