//! Attitudes -> packets of a tracker for the SlimeVR server, and its answers. Pure.
//!
//! One device with a sensor for each stream: a handshake, a packet of information for each sensor, rotations, and a sign of
//! life each second. Packets are a number of their kind (u32) and one that grows (u64), big-endian. The server turns a world
//! with z up into its own with y up; where the body is worn, and where forward is, it learns from its user (mounting and
//! yaw reset).
//!
//! # Source
//! github.com/SlimeVR/SlimeVR-Server, `server/core/src/main/java/dev/slimevr/tracking/trackers/udp/`: `UDPProtocolParser.kt`
//! (numbers of the packets, answer to the handshake), `UDPPacket.kt` (their fields), `TrackersUDPServer.kt` (order,
//! `AXES_OFFSET`, what a device without an address of its own is: one that nobody has to allow).

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// Kinds of packets.
const HEARTBEAT: u32 = 0;
const HANDSHAKE: u32 = 3;
const PING: u32 = 10;
const SENSOR_INFO: u32 = 15;
const ROTATION_DATA: u32 = 17;

/// Beginning of the server's answer to a handshake.
const WELCOME: &[u8] = b"\x03Hey OVR =D 5";
/// Version of the protocol that is spoken: sensors are made by their information from 9 on.
const VERSION: u32 = 17;
/// Time after which a server that says nothing is greeted again.
const SILENT: Duration = Duration::from_secs(3);

/// Conversation with a server.
#[derive(Debug, Default)]
pub(super) struct SlimeVr {
    /// Number of the packet sent last.
    number: u64,
    /// Number of sensors that were announced, and those whose announcement was acknowledged.
    sensors: u8,
    acknowledged: BTreeSet<u8>,
    heard: Option<Instant>,
}

impl SlimeVr {
    /// Most sensors of a device; 255 is the device itself.
    pub(super) const MOST: usize = 255;

    fn head(&mut self, kind: u32) -> Vec<u8> {
        self.number += 1;
        let mut packet = kind.to_be_bytes().to_vec();
        packet.extend_from_slice(&self.number.to_be_bytes());
        packet
    }

    fn handshake(&mut self) -> Vec<u8> {
        // The server counts anew from here.
        self.number = 0;
        self.acknowledged.clear();
        let mut packet = HANDSHAKE.to_be_bytes().to_vec();
        packet.extend_from_slice(&[0; 8]);
        // Board, sensor and processor, which are of no kind it knows, and three that nobody reads.
        packet.extend_from_slice(&[0; 6 * 4]);
        packet.extend_from_slice(&VERSION.to_be_bytes());
        let name = concat!("strapd ", env!("CARGO_PKG_VERSION"));
        packet.push(name.len() as u8);
        packet.extend_from_slice(name.as_bytes());
        // No hardware address.
        packet.extend_from_slice(&[0; 6]);
        packet
    }

    fn info(&mut self, sensor: u8) -> Vec<u8> {
        let mut packet = self.head(SENSOR_INFO);
        // It works, and is of no kind the server knows.
        packet.extend_from_slice(&[sensor, 1, 0]);
        packet
    }

    /// Makes what is due each second.
    pub(super) fn tick(&mut self, now: Instant, out: &mut Vec<Vec<u8>>) {
        let is_silent = self
            .heard
            .is_none_or(|heard| now.saturating_duration_since(heard) >= SILENT);
        if is_silent {
            let greeting = self.handshake();
            out.push(greeting);
        } else {
            let beat = self.head(HEARTBEAT);
            out.push(beat);
        }
        for sensor in 0..self.sensors {
            if !self.acknowledged.contains(&sensor) {
                let info = self.info(sensor);
                out.push(info);
            }
        }
    }

    /// Makes the packet of an attitude, FLU body to a world with z up; a sensor that is new is announced first.
    pub(super) fn attitude(&mut self, sensor: u8, [w, x, y, z]: [f64; 4], out: &mut Vec<Vec<u8>>) {
        if sensor >= self.sensors {
            self.sensors = sensor.saturating_add(1);
            let info = self.info(sensor);
            out.push(info);
        }
        let mut packet = self.head(ROTATION_DATA);
        packet.extend_from_slice(&[sensor, 1]);
        for number in [x, y, z, w] {
            packet.extend_from_slice(&(number as f32).to_be_bytes());
        }
        // Of its accuracy nothing is said.
        packet.push(0);
        out.push(packet);
    }

    /// Takes what the server says, and makes the answer, if it wants one.
    pub(super) fn hear(&mut self, said: &[u8], now: Instant, out: &mut Vec<Vec<u8>>) {
        self.heard = Some(now);
        if said.starts_with(WELCOME) {
            return;
        }
        let Some((kind, rest)) = said.split_first_chunk::<4>() else {
            return;
        };
        match (u32::from_be_bytes(*kind), rest) {
            (SENSOR_INFO, [sensor, _]) => {
                self.acknowledged.insert(*sensor);
            }
            (PING, [_, _, _, _, _, _, _, _, ping @ ..]) => {
                let mut packet = self.head(PING);
                packet.extend_from_slice(ping.get(..4).unwrap_or(&[0; 4]));
                out.push(packet);
            }
            _ => {}
        }
    }

    /// Whether a server has ever said something.
    pub(super) fn was_heard(&self) -> bool {
        self.heard.is_some()
    }
}
