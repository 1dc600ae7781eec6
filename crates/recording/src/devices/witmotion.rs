//! Frames of WitMotion's standard protocol -> a sample. Pure.
//!
//! A cycle consists of frames of eleven bytes, one for each quantity, in the order of their numbers: time, acceleration, rate,
//! angles, field, quaternion. The rate makes the sample, with the acceleration and the time that came before it in the
//! cycle; nothing waits for the next. Axes are those printed on the case, right-handed, z up: taken as they come.
//!
//! # Source
//! WitMotion Standard Communication Protocol (WIT Standard): numbers of frames, ranges of 16 g and 2000 deg/s, sum. The
//! same numbers in PyPI `witmotion` 0.0.1 (its date begins in 1970; the maker's year is of this century).

use super::Device;
use super::frame::{Cut, sum};
use super::numbers::{G, array, i16_le, scaled};
use super::orientation::{of_angles, unit};
use super::sample::{Sample, Taken};
use crate::decode::days_since_1970;
use std::f64::consts::PI;

const MARK: u8 = 0x55;
/// Bytes of a frame.
const TOTAL: usize = 11;
/// Full scale of a number.
const FULL: f64 = 32_768.0;

/// Cuts a frame.
pub(super) fn cut(bytes: &[u8]) -> Cut {
    match bytes {
        [] => Cut::Need(1),
        [MARK] => Cut::Need(TOTAL),
        [MARK, 0x50..=0x5f, ..] => match bytes.get(..TOTAL) {
            None => Cut::Need(TOTAL),
            Some([summed @ .., last]) => Cut::checked(sum(summed) == *last, TOTAL),
            Some([]) => Cut::No,
        },
        _ => Cut::No,
    }
}

/// A sensor.
#[derive(Debug, Default)]
pub(super) struct WitMotion {
    /// Time and acceleration of this cycle.
    time: Option<u64>,
    force: Option<[f64; 3]>,
    /// Time of the rate of this cycle, for the field and for the orientation behind it.
    for_field: Option<Option<u64>>,
    for_orientation: Option<u64>,
    /// Number of the frames whose orientation is taken: the first that came.
    orientation: Option<u8>,
    /// Whether the device sends its time.
    has_clock: bool,
}

impl Device for WitMotion {
    fn take(&mut self, frame: &[u8], to: &mut Taken) {
        let Some(vector) = i16_le(frame, 2) else {
            return;
        };
        match frame.get(1) {
            Some(0x50) => {
                self.has_clock = true;
                self.time = date(frame);
            }
            Some(0x51) => self.force = Some(scaled(vector, 16.0 * G / FULL)),
            Some(0x52) => {
                let (time, force) = (self.time.take(), self.force.take());
                // One without its time would be stamped otherwise than its neighbours.
                if self.has_clock && time.is_none() {
                    to.missing += 1;
                    (self.for_field, self.for_orientation) = (None, None);
                    return;
                }
                (self.for_field, self.for_orientation) = (Some(time), time);
                to.add(Sample {
                    time,
                    rate: Some(scaled(vector, 2000f64.to_radians() / FULL)),
                    force,
                    ..Sample::default()
                });
            }
            Some(0x54) => {
                if let Some(time) = self.for_field.take() {
                    to.add(Sample {
                        time,
                        field: Some(vector),
                        ..Sample::default()
                    });
                }
            }
            Some(&number @ (0x53 | 0x59)) => self.orientation(number, frame, to),
            _ => {}
        }
    }
}

impl WitMotion {
    /// Tells the orientation of a frame of angles (roll, pitch, yaw), or of a quaternion, to east, north, up.
    fn orientation(&mut self, number: u8, frame: &[u8], to: &mut Taken) {
        if *self.orientation.get_or_insert(number) != number {
            return;
        }
        // Without a time it belongs to no instant.
        let Some(time) = self.for_orientation.take() else {
            return;
        };
        let part = |at| Some(f64::from(i16::from_le_bytes(array(frame, at)?)) / FULL);
        let parts = [part(2), part(4), part(6), part(8)];
        let q = match (number, parts) {
            (0x59, [Some(w), Some(x), Some(y), Some(z)]) => unit([w, x, y, z]),
            (_, [Some(roll), Some(pitch), Some(yaw), _]) => {
                of_angles([roll, pitch, yaw].map(|half_turns| half_turns * PI))
            }
            _ => None,
        };
        to.add(Sample {
            time: Some(time),
            orientation: q.map(|q| q.wxyz()),
            ..Sample::default()
        });
    }
}

/// Nanoseconds since 1970 of a frame of time, whose date is the sensor's own and says no zone; `None` where there is no
/// such date.
fn date(frame: &[u8]) -> Option<u64> {
    let [year, month, day, hour, minute, second] = array(frame, 2)?;
    let millis = u64::from(u16::from_le_bytes(array(frame, 8)?));
    // A clock that was never set has neither month nor day.
    let [month, day] = [month, day].map(|n| i64::from(n.max(1)));
    let days = u64::try_from(days_since_1970(2000 + i64::from(year), month, day)).ok()?;
    let seconds = u64::from(hour) * 3600 + u64::from(minute) * 60 + u64::from(second);
    Some((days * 86_400 + seconds) * 1_000_000_000 + millis * 1_000_000)
}
