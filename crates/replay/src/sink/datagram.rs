//! Attitudes -> the datagrams of protocols that other programs speak, and their answers. Pure: no socket, no clock.
//!
//! ```text
//! attitude -> record (encoded with its stream) -> Datagrams -> opentrack, OSC, VMC, SlimeVR, MAVLink
//! ```
//!
//! A stage of its own because these have a memory that lines have not: numbers of packets, who is known, when a sign of life
//! is due. Whoever has the socket hands over what it got and sends what this makes.

mod mavlink;
mod opentrack;
mod osc;
mod record;
mod slimevr;
#[cfg(test)]
mod tests;

pub(super) use record::RecordObject;

use super::axes::{north_east_down, north_west_up, roll_pitch_yaw};
use super::decimate::Decimator;
use mavlink::Vehicle;
use record::Attitude;
use slimevr::SlimeVr;
use std::collections::BTreeMap;
use std::collections::VecDeque;
use std::fmt;
use std::time::{Duration, Instant};
use strapd_attitude::worlds::Convention;

/// Time between two signs of life.
const TICK: Duration = Duration::from_secs(1);

/// Protocol of a receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Protocol {
    /// Six doubles for opentrack.
    OpenTrack,
    /// Messages of Open Sound Control.
    Osc,
    /// Trackers of the VMC protocol, over OSC.
    Vmc,
    /// Sensors of a SlimeVR tracker.
    SlimeVr,
    /// Attitudes of a vehicle that speaks MAVLink.
    Mavlink,
}

impl Protocol {
    const ALL: [Protocol; 5] = [
        Protocol::OpenTrack,
        Protocol::Osc,
        Protocol::Vmc,
        Protocol::SlimeVr,
        Protocol::Mavlink,
    ];

    /// Scheme of its addresses.
    #[must_use]
    pub fn scheme(self) -> &'static str {
        match self {
            Protocol::OpenTrack => "opentrack",
            Protocol::Osc => "osc",
            Protocol::Vmc => "vmc",
            Protocol::SlimeVr => "slimevr",
            Protocol::Mavlink => "mavlink",
        }
    }

    fn of_scheme(scheme: &str) -> Option<Protocol> {
        let mut all = Protocol::ALL.into_iter();
        all.find(|protocol| protocol.scheme() == scheme)
    }

    /// List of their addresses for messages.
    #[must_use]
    pub fn addresses() -> String {
        let all = Protocol::ALL.map(|p| format!("{}://HOST:PORT", p.scheme()));
        format!("{} (?id=NAME, ?rate=HZ)", all.join(", "))
    }
}

/// Receiver of datagrams, and what it is sent.
#[derive(Clone, PartialEq, Debug)]
pub struct Recipient {
    /// Protocol it speaks.
    pub protocol: Protocol,
    /// HOST:PORT.
    pub address: String,
    /// Sensor whose attitudes it gets; `None` = all, or the first where the protocol has room for one.
    id: Option<String>,
    /// Most attitudes a second of each sensor.
    rate: Option<f64>,
    /// Number of the vehicle in MAVLink.
    system: u8,
}

// No number in it is NaN.
impl Eq for Recipient {}

impl Recipient {
    /// Reads the address behind a scheme; `None`: no protocol has this scheme.
    ///
    /// # Errors
    /// Words for what is wrong with it.
    pub(super) fn parse(
        scheme: &str,
        address: &str,
        query: Option<&str>,
    ) -> Option<Result<Recipient, String>> {
        let protocol = Protocol::of_scheme(scheme)?;
        let mut recipient = Recipient {
            protocol,
            address: address.to_owned(),
            id: None,
            rate: None,
            system: 1,
        };
        let mut parts = query.iter().flat_map(|query| query.split('&'));
        let wrong = parts.find_map(|part| recipient.set(part).err());
        Some(wrong.map_or(Ok(recipient), Err))
    }

    fn set(&mut self, part: &str) -> Result<(), String> {
        let (name, value) = part.split_once('=').unwrap_or((part, ""));
        match (name, value) {
            ("id", id) if !id.is_empty() => self.id = Some(id.to_owned()),
            ("rate", text) => {
                let rate = text.parse().ok().filter(|rate: &f64| {
                    *rate > 0.0 && rate.is_finite() && Decimator::new(*rate).is_some()
                });
                self.rate = Some(rate.ok_or(format!("rate={text}: a rate above 0 Hz"))?);
            }
            ("system", text) if self.protocol == Protocol::Mavlink => {
                let system = text.parse().ok().filter(|system| *system > 0);
                self.system = system.ok_or(format!("system={text}: a number from 1 to 255"))?;
            }
            _ => {
                return Err(format!(
                    "what may follow ? is id=NAME, rate=HZ{}",
                    match self.protocol {
                        Protocol::Mavlink => ", system=NUMBER",
                        _ => "",
                    }
                ));
            }
        }
        Ok(())
    }

    /// Whether somebody answers, or wants signs of life.
    #[must_use]
    pub fn converses(&self) -> bool {
        matches!(self.protocol, Protocol::SlimeVr | Protocol::Mavlink)
    }
}

impl fmt::Display for Recipient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://{}", self.protocol.scheme(), self.address)
    }
}

/// State of a conversation.
#[derive(Debug)]
enum Speaker {
    OpenTrack,
    Osc,
    Vmc,
    SlimeVr(SlimeVr),
    Mavlink(Vehicle),
}

/// A sensor that has a place.
#[derive(Debug)]
struct Sensor {
    number: usize,
    decimator: Option<Decimator>,
}

/// Datagrams to one receiver.
#[derive(Debug)]
pub struct Datagrams {
    recipient: Recipient,
    speaker: Speaker,
    sensors: BTreeMap<String, Sensor>,
    /// Sensors that have none: there are too many of them.
    left_out: u64,
    last_tick: Option<Instant>,
    ready: VecDeque<Vec<u8>>,
}

impl Datagrams {
    /// Begins a conversation.
    #[must_use]
    pub fn new(recipient: &Recipient) -> Datagrams {
        Datagrams {
            speaker: match recipient.protocol {
                Protocol::OpenTrack => Speaker::OpenTrack,
                Protocol::Osc => Speaker::Osc,
                Protocol::Vmc => Speaker::Vmc,
                Protocol::SlimeVr => Speaker::SlimeVr(SlimeVr::default()),
                Protocol::Mavlink => Speaker::Mavlink(Vehicle::new(recipient.system)),
            },
            recipient: recipient.clone(),
            sensors: BTreeMap::new(),
            left_out: 0,
            last_tick: None,
            ready: VecDeque::new(),
        }
    }

    /// Next datagram to be sent.
    pub fn ready(&mut self) -> Option<Vec<u8>> {
        self.ready.pop_front()
    }

    /// Makes the signs of life that are due.
    pub fn tick(&mut self, now: Instant) {
        let is_due = |last: Instant| now.saturating_duration_since(last) >= TICK;
        if !self.last_tick.is_none_or(is_due) {
            return;
        }
        self.last_tick = Some(now);
        let mut out = Vec::new();
        match &mut self.speaker {
            Speaker::SlimeVr(tracker) => tracker.tick(now, &mut out),
            Speaker::Mavlink(vehicle) => out.push(vehicle.heartbeat()),
            Speaker::OpenTrack | Speaker::Osc | Speaker::Vmc => {}
        }
        self.ready.extend(out);
    }

    /// Takes records as they were encoded.
    pub fn take(&mut self, mut records: &[u8]) {
        while let Some(mut attitude) = record::next(&mut records) {
            let wanted = self.recipient.id.as_deref();
            if wanted.is_some_and(|wanted| wanted != attitude.id) {
                continue;
            }
            let Some(sensor) = self.place(attitude.id) else {
                continue;
            };
            let number = sensor.number;
            if let Some(decimator) = &mut sensor.decimator {
                match decimator.keep(&attitude.sample) {
                    Some(kept) => attitude.sample = kept,
                    None => continue,
                }
            }
            // One that is no number has no form here.
            let _ = self.send(number, &attitude);
        }
    }

    /// Place of a sensor; a new one gets the next.
    fn place(&mut self, id: &str) -> Option<&mut Sensor> {
        let most = match self.speaker {
            Speaker::OpenTrack => 1,
            Speaker::Osc | Speaker::Vmc => usize::MAX,
            Speaker::SlimeVr(_) => SlimeVr::MOST,
            Speaker::Mavlink(_) => Vehicle::MOST,
        };
        if !self.sensors.contains_key(id) {
            let number = self.sensors.len();
            if number >= most {
                if self.left_out == 0 {
                    tracing::warn!(
                        "{}: has room for {most} of the sensors; {} and others are not sent there (?id=NAME chooses one)",
                        self.recipient,
                        strapd_recording::text::printable(id)
                    );
                }
                self.left_out = 1;
                return None;
            }
            let decimator = self.recipient.rate.and_then(Decimator::new);
            self.sensors
                .insert(id.to_owned(), Sensor { number, decimator });
        }
        self.sensors.get_mut(id)
    }

    fn send(&mut self, number: usize, attitude: &Attitude<'_>) -> Option<()> {
        let Attitude { id, world, sample } = attitude;
        let mut out = Vec::new();
        match &mut self.speaker {
            Speaker::OpenTrack => {
                opentrack::push(&mut out, north_east_down(*world, sample)?);
            }
            Speaker::Osc => {
                let own = Some(sample.q_nb.wxyz()).filter(|q| q.iter().all(|c| c.is_finite()));
                self.ready.extend(osc::messages(id, own?));
                return Some(());
            }
            Speaker::Vmc => osc::push_tracker(&mut out, id, north_west_up(*world, sample)?),
            Speaker::SlimeVr(tracker) => {
                let (q, sensor) = (north_west_up(*world, sample)?, u8::try_from(number).ok()?);
                let mut packets = Vec::new();
                tracker.attitude(sensor, q, &mut packets);
                self.ready.extend(packets);
                return Some(());
            }
            Speaker::Mavlink(vehicle) => {
                let q = north_east_down(*world, sample)?;
                let rates = world.convert_body(Convention::NedFrd, sample.rate.0);
                let angles = roll_pitch_yaw(q);
                let frames = vehicle.attitude(number, sample.stamp, q, angles, rates.into());
                self.ready.extend(frames);
                return Some(());
            }
        }
        self.ready.push_back(out);
        Some(())
    }

    /// Takes a datagram of the receiver.
    pub fn hear(&mut self, said: &[u8], now: Instant) {
        if let Speaker::SlimeVr(tracker) = &mut self.speaker {
            let mut out = Vec::new();
            tracker.hear(said, now, &mut out);
            self.ready.extend(out);
        }
    }

    /// Words about a receiver that should have answered, and has not.
    #[must_use]
    pub fn unanswered(&self) -> Option<String> {
        match &self.speaker {
            Speaker::SlimeVr(tracker) if !tracker.was_heard() => Some(format!(
                "{}: no SlimeVR server has answered there",
                self.recipient
            )),
            _ => None,
        }
    }
}
