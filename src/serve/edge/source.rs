//! A source on the command line -> where to connect and how to understand what comes. Pure but for
//! reading a token file.
//!
//! A phone's SensorServer (Android) is a WebSocket server; each message is one event,
//! `{"values":[x,y,z],"timestamp":ns,"accuracy":3}`, and where several sensors are asked for at once
//! each names its own in `type`. The gyroscope's values are rad/s about the device's axes. The stamps
//! are nanoseconds since the phone was started, a clock of their own that no restart of the app, but
//! every restart of the phone, sets back.
//!
//! # Source
//! SensorServer: its README and `SensorWebSocketServer.kt` (`/sensor/connect?type=T`,
//! `/sensors/connect?types=["T","U"]`, close codes 4001-4009), github.com/umer0586/SensorServer.
//! Stamps: Android's `SensorEvent.timestamp`, the time base of `SystemClock.elapsedRealtimeNanos()`.
//! Units and the six values of the uncalibrated gyroscope: Android's `SensorEvent.values`.

use crate::address::Address;
use crate::client::remote::{Parameter, Remote};
use crate::client::secret::Secret;
use crate::error::{Error, Result};
use crate::serve::core::outgoing::Outgoing;
use crate::serve::core::reading::{LineParameters, Reading};
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::decode::{LineDecoder, Options};
use strapd_recording::devices::Asked;
use strapd_recording::text::printable;

/// The parameters that are ours beside those of lines.
const OURS: [&str; 2] = ["proto", "token-file"];

/// Something to connect to for samples.
#[derive(Clone, Debug)]
pub struct Source {
    /// Remote address.
    pub remote: Remote,
    /// Id of its sensor here, whatever it calls itself.
    pub id: Option<String>,
    /// Protocol to speak with it.
    pub protocol: Protocol,
    /// Token that it wants to see first.
    pub token: Option<Secret>,
    /// Way in which its lines are read.
    pub lines: LineParameters,
    /// Address for people: of the query the names, and the values that are ours and no secret.
    pub name: String,
}

/// The sensor's name among the parameters of an address.
fn lines_id(parameters: &[Parameter]) -> Option<&str> {
    let mut named = parameters.iter().filter(|(name, _)| name == "id");
    named.next().map(|(_, id)| id.as_str())
}

/// Whether a parameter of an address is for us, and not for a server.
fn is_ours(parameter: &str) -> bool {
    OURS.contains(&parameter) || LineParameters::KEYS.contains(&parameter)
}

/// Place from which samples are fetched.
#[derive(Clone, Debug)]
pub enum Endpoint {
    /// Somebody who listens.
    Source(Box<Source>),
    /// A subject of NATS.
    #[cfg(feature = "nats")]
    Nats(Box<crate::serve::brokers::nats::address::NatsAddress>),
    /// A key of zenoh.
    #[cfg(feature = "zenoh")]
    Zenoh(Box<crate::serve::brokers::zenoh::address::ZenohAddress>),
}

impl Endpoint {
    /// Reads what the user wrote: the address of a [`Source`], of a subject of NATS, or of a key of zenoh.
    ///
    /// # Errors
    /// As [`Source::parse`]; a broker is meant and was not built in.
    pub fn parse(text: &str) -> Result<Endpoint> {
        if means_nats(text) {
            #[cfg(feature = "nats")]
            return crate::serve::brokers::nats::address::NatsAddress::source(text)
                .map(|address| Endpoint::Nats(Box::new(address)));
            #[cfg(not(feature = "nats"))]
            return Err(without_nats("serve", text));
        }
        if means_zenoh(text) {
            #[cfg(feature = "zenoh")]
            return crate::serve::brokers::zenoh::address::ZenohAddress::source(text)
                .map(|address| Endpoint::Zenoh(Box::new(address)));
            #[cfg(not(feature = "zenoh"))]
            return Err(without_zenoh("serve", text));
        }
        Source::parse(text).map(|source| Endpoint::Source(Box::new(source)))
    }

    /// Address, for people.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Endpoint::Source(source) => &source.name,
            #[cfg(feature = "nats")]
            Endpoint::Nats(address) => &address.name,
            #[cfg(feature = "zenoh")]
            Endpoint::Zenoh(address) => &address.name,
        }
    }

    /// Id of its sensor here, if one was given.
    #[must_use]
    pub fn id(&self) -> Option<&str> {
        match self {
            Endpoint::Source(source) => source.id.as_deref(),
            #[cfg(feature = "nats")]
            Endpoint::Nats(address) => address.id.as_deref(),
            #[cfg(feature = "zenoh")]
            Endpoint::Zenoh(address) => address.id.as_deref(),
        }
    }

    /// Connection that is not there yet.
    pub(in crate::serve) fn outgoing(&self) -> Outgoing {
        let outgoing = Outgoing::new(self.name(), self.id());
        match self {
            #[cfg(feature = "zenoh")]
            Endpoint::Zenoh(_) => outgoing.of_router(),
            _ => outgoing,
        }
    }

    /// Whether both are the same place.
    #[must_use]
    pub fn is_same_place(&self, other: &Endpoint) -> bool {
        match (self, other) {
            (Endpoint::Source(one), Endpoint::Source(other)) => one.remote == other.remote,
            #[cfg(feature = "nats")]
            (Endpoint::Nats(one), Endpoint::Nats(other)) => {
                (&one.place, &one.subject) == (&other.place, &other.subject)
            }
            #[cfg(feature = "zenoh")]
            (Endpoint::Zenoh(one), Endpoint::Zenoh(other)) => {
                (&one.place, &one.key) == (&other.place, &other.key)
            }
            #[cfg(any(feature = "nats", feature = "zenoh"))]
            _ => false,
        }
    }

    /// Another one has the same name: it is the `number`th.
    pub fn is_one_of(&mut self, number: usize) {
        let name = match self {
            Endpoint::Source(source) => &mut source.name,
            #[cfg(feature = "nats")]
            Endpoint::Nats(address) => &mut address.name,
            #[cfg(feature = "zenoh")]
            Endpoint::Zenoh(address) => &mut address.name,
        };
        name.push_str(&format!(" ({number})"));
    }
}

/// Whether a word is meant as a subject of NATS.
#[must_use]
pub fn means_nats(text: &str) -> bool {
    text.starts_with("nats://")
}

/// NATS is meant, and was not built in.
#[cfg(not(feature = "nats"))]
pub fn without_nats(before: &str, text: &str) -> Error {
    Error::usage(
        Diagnostic::new(format!(
            "{before} {}: this strapd was built without the feature nats",
            Address::from(text)
        ))
        .help(
            "cargo install --path . --features nats; or, without it: nats sub --raw 'imu.*' | strapd serve -",
        ),
    )
}

/// Whether a word is meant as a key of zenoh.
#[must_use]
pub fn means_zenoh(text: &str) -> bool {
    text.starts_with("zenoh://")
}

/// Zenoh is meant, and was not built in.
#[cfg(not(feature = "zenoh"))]
pub fn without_zenoh(before: &str, text: &str) -> Error {
    Error::usage(
        Diagnostic::new(format!(
            "{before} {}: this strapd was built without the feature zenoh",
            Address::from(text)
        ))
        .help("cargo install --path . --features zenoh"),
    )
}

/// Protocol to speak with a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// Nothing is said, unless it greets like a daemon: then it is asked to send what it has.
    Auto,
    /// Lines come by themselves.
    Lines,
    /// A daemon: it is asked at once.
    Strapd,
    /// A phone whose messages need not name this sensor.
    SensorServer(String),
}

impl Source {
    /// Reads what the user wrote: an address with `?id=NAME`, `?proto=auto|ndjson|strapd|sensorserver`
    /// and `?token-file=FILE`.
    ///
    /// # Errors
    /// [`Error::Usage`] with what is known; the token file cannot be read.
    pub fn parse(text: &str) -> Result<Source> {
        let (remote, parameters) = Remote::with_parameters(text, is_ours)?;
        let refuse = |what: String| {
            let shown = Address::from(text);
            Error::usage(
                Diagnostic::new(format!("serve {shown}: {what}")).help(format!(
                    "{}; protocols: {}; ?proto=auto|ndjson|strapd|sensorserver; ?token-file=FILE",
                    LineParameters::HELP,
                    Asked::names()
                )),
            )
        };
        if matches!(remote, Remote::UdpListen(_)) {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "serve {remote}: datagrams are listened for, not fetched"
                ))
                .help(format!("--listen {remote}")),
            ));
        }
        let is_web = matches!(remote, Remote::WebSocket { .. });
        let is_serial = matches!(remote, Remote::Serial(_)) && lines_id(&parameters).is_none();
        let of = |name: &str| {
            let mut values = parameters.iter().filter(|(n, _)| n == name);
            match (values.next(), values.next()) {
                (Some(_), Some(_)) => Err(refuse(format!("?{name}= is given twice"))),
                (value, None) => Ok(value.map(|(_, v)| v.as_str())),
                (None, Some(_)) => Ok(None),
            }
        };
        if let Some((other, _)) = parameters.iter().find(|(n, _)| !is_web && !is_ours(n)) {
            return Err(refuse(format!("there is no ?{other}=")));
        }
        let lines = LineParameters::parse(&parameters).map_err(refuse)?;
        let phone = match &remote {
            Remote::WebSocket { resource, .. } => {
                let asked = resource.typed();
                asked.starts_with("/sensor/connect") || asked.starts_with("/sensors/connect")
            }
            _ => false,
        };
        let sensor = match if is_web { of("type")? } else { None } {
            Some(sensor) if !sensor.to_ascii_lowercase().contains("gyro") && phone => {
                return Err(refuse(format!(
                    "`{sensor}` brings no body rate; take type=android.sensor.gyroscope, or gyroscope_uncalibrated whose bias nobody else removes"
                )));
            }
            Some(sensor) => sensor.to_ascii_lowercase(),
            None => "android.sensor.gyroscope".to_owned(),
        };
        let protocol = match of("proto")? {
            Some("sensorserver") => Protocol::SensorServer(sensor),
            None | Some("auto") if phone => Protocol::SensorServer(sensor),
            None | Some("auto") => Protocol::Auto,
            Some("ndjson") => Protocol::Lines,
            Some("strapd") => Protocol::Strapd,
            Some(other) => return Err(refuse(format!("there is no ?proto={other}"))),
        };
        let token = of("token-file")?
            .map(|file| Secret::read("token-file", Path::new(file)))
            .transpose()?;
        let mut lines = lines;
        if let Remote::Serial(place) = &remote {
            // A board has no other name.
            lines.id.get_or_insert_with(|| place.sensor());
        }
        Ok(Source {
            // Of a link it goes before the names of its sensors.
            id: lines
                .id
                .clone()
                .filter(|_| !is_serial && lines.protocol.is_lines()),
            lines,
            protocol,
            token,
            name: named(&remote, &parameters),
            remote,
        })
    }

    /// Way in which its lines are read, of a daemon with these options, and `by_default` where its address says nothing.
    #[must_use]
    pub(in crate::serve) fn reading(
        &self,
        options: &Options,
        by_default: &LineParameters,
    ) -> Reading {
        let reading = Reading::new(options, &self.lines.clone().or(by_default));
        match self.protocol {
            Protocol::Auto if matches!(self.remote, Remote::Serial(_)) => reading.joined_midway(),
            Protocol::Auto => reading,
            Protocol::Lines | Protocol::Strapd | Protocol::SensorServer(_) => reading.of_objects(),
        }
    }

    /// Decoder of its lines, if it is not the one of everybody's.
    #[must_use]
    pub fn decoder(&self, options: &Options) -> Option<LineDecoder> {
        match &self.protocol {
            Protocol::SensorServer(sensor) => {
                Some(LineDecoder::with_sensor(options, sensor).with_besides())
            }
            Protocol::Auto | Protocol::Lines | Protocol::Strapd => None,
        }
    }
}

/// The address as it is printed, with the sensor's name and the way to speak where they were given.
fn named(remote: &Remote, parameters: &[Parameter]) -> String {
    let mut name = remote.to_string();
    for (parameter, value) in parameters {
        if is_ours(parameter) && parameter != "token-file" {
            name.push(if name.contains('?') { '&' } else { '?' });
            name.push_str(&format!("{parameter}={}", printable(value)));
        }
    }
    name
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_phone_is_known_by_its_path_and_anything_else_by_what_arrives() {
        let of = |text: &str| Source::parse(text).unwrap();
        let phone = of("ws://p:8080/sensor/connect?type=android.sensor.gyroscope&id=phone");
        assert_eq!(
            phone.protocol,
            Protocol::SensorServer("android.sensor.gyroscope".to_owned())
        );
        assert_eq!(phone.id.as_deref(), Some("phone"));
        let Remote::WebSocket { resource, .. } = &phone.remote else {
            panic!("{}", phone.remote);
        };
        let asked = "/sensor/connect?type=android.sensor.gyroscope";
        assert_eq!(resource.typed(), asked);
        assert_eq!(phone.name, "ws://p:8080/sensor/connect?type=...&id=phone");
        assert_eq!(of("ws://p:8765/ws").protocol, Protocol::Auto);
        assert_eq!(of("tcp://p:1?proto=ndjson").protocol, Protocol::Lines);
        assert_eq!(of("tcp://p:1?proto=strapd").protocol, Protocol::Strapd);
        let board = of("serial:///dev/ttyACM0?baud=9600&stamp=arrival");
        assert_eq!(board.lines.id.as_deref(), Some("ttyACM0"));
        assert_eq!((board.id, board.lines.by_arrival), (None, true));
        assert_eq!(board.name, "serial:///dev/ttyACM0?baud=9600&stamp=arrival");
        let named = of("serial:///dev/ttyACM0?id=left");
        assert_eq!(named.id.as_deref(), Some("left"));
    }

    #[test]
    fn what_can_bring_no_rate_is_refused_with_what_can() {
        for (text, part) in [
            (
                "ws://p:1/sensor/connect?type=android.sensor.light",
                "android.sensor.gyroscope",
            ),
            ("tcp://p:1?name=x", "no ?name="),
            ("tcp://p:1?id=", "1 to 255 bytes"),
            ("tcp://p:1?id=a&id=b", "twice"),
            ("tcp://p:1?proto=mqtt", "no ?proto=mqtt"),
            ("udp-listen://:1", "--listen udp-listen://127.0.0.1:1"),
            ("flight.mcap", "no scheme"),
            ("serial://dev/ttyUSB0", "an absolute path"),
            ("serial:///dev/ttyUSB0?bauds=9600", "no ?bauds="),
            ("serial:///dev/ttyUSB0?baud=9", "is no rate"),
        ] {
            let said = Source::parse(text).unwrap_err().to_string();
            assert!(said.contains(part), "{text}: {said}");
        }
    }
}
