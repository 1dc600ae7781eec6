//! Attitudes -> frames of MAVLink 2 as a vehicle sends them. Pure.
//!
//! HEARTBEAT each second, and for each attitude ATTITUDE_QUATERNION and ATTITUDE: forward, right, down to north, east, down,
//! rad and rad/s, the time in ms since the first attitude. The first sensor is the autopilot, as ground stations show no
//! other; the next are components 25 to 99, which are free for users. Each counts its frames.
//!
//! # Source
//! <https://mavlink.io/en/guide/serialization.html>, <https://mavlink.io/en/messages/common.html>.

use strapd_attitude::record::Nanos;

/// Number of a message and the byte made of its fields that the checksum has beside the frame.
type Kind = (u32, u8);
const HEARTBEAT: Kind = (0, 50);
const ATTITUDE: Kind = (30, 39);
const ATTITUDE_QUATERNION: Kind = (31, 246);

/// A vehicle with its sensors.
#[derive(Debug)]
pub(super) struct Vehicle {
    system: u8,
    /// Number of the next frame of each component.
    next: Vec<u8>,
    first: Option<Nanos>,
}

impl Vehicle {
    /// Most sensors.
    pub(super) const MOST: usize = 76;

    pub(super) fn new(system: u8) -> Vehicle {
        let next = vec![0; Vehicle::MOST];
        Vehicle {
            system,
            next,
            first: None,
        }
    }

    /// Makes the sign of life.
    pub(super) fn heartbeat(&mut self) -> Vec<u8> {
        // No mode; a vehicle of no kind, without an autopilot that takes commands, active; version 3 of the dialect.
        self.frame(0, HEARTBEAT, &[0, 0, 0, 0, 0, 8, 0, 4, 3])
    }

    /// Makes both messages of an attitude, FRD body to NED; rates in FRD.
    pub(super) fn attitude(
        &mut self,
        sensor: usize,
        stamp: Nanos,
        q: [f64; 4],
        angles: [f64; 3],
        rates: [f64; 3],
    ) -> [Vec<u8>; 2] {
        let first = *self.first.get_or_insert(stamp);
        // It wraps after 49 days, and says so in the protocol.
        let boot = (stamp.since(first).div_euclid(1_000_000) as u32).to_le_bytes();
        let mut payload = |numbers: &[f64], kind| {
            let mut payload = boot.to_vec();
            for number in numbers.iter().chain(&rates) {
                payload.extend_from_slice(&(*number as f32).to_le_bytes());
            }
            self.frame(sensor, kind, &payload)
        };
        [payload(&q, ATTITUDE_QUATERNION), payload(&angles, ATTITUDE)]
    }

    fn frame(&mut self, sensor: usize, (number, extra): Kind, payload: &[u8]) -> Vec<u8> {
        let component = match sensor {
            0 => 1,
            n => 24u8.saturating_add(u8::try_from(n).unwrap_or(75)),
        };
        let sequence = self.next.get_mut(sensor).map_or(0, |next| {
            let sequence = *next;
            *next = next.wrapping_add(1);
            sequence
        });
        // Zeros at the end are left out, but for the first byte.
        let zeros = payload.iter().rev().take_while(|byte| **byte == 0).count();
        let length = payload.len().saturating_sub(zeros).max(1);
        let [low, middle, high, _] = number.to_le_bytes();
        let mut frame = vec![
            0xfd,
            length as u8,
            0,
            0,
            sequence,
            self.system,
            component,
            low,
            middle,
            high,
        ];
        frame.extend_from_slice(payload.get(..length).unwrap_or(payload));
        let sum = strapd_recording::mavlink::checksum(frame.get(1..).unwrap_or(&[]), extra);
        frame.extend_from_slice(&sum.to_le_bytes());
        frame
    }
}
