//! The other end of a session -> how its lines are read, and what its sensors are called here. Pure.

use crate::serve::guard::fault::Fault;
use crate::serve::protocol::upstream::Event;
use strapd_recording::decode::{Line, LineDecoder};

/// Side that has connected, and what follows from it.
#[derive(Debug)]
pub enum Side {
    /// A client of ours, who need not show a token when trusted.
    Client {
        /// Whether it has shown the token, or need not.
        trusted: bool,
    },
    /// Sender that is told nothing: what it asks for is passed over.
    ListenOnly {
        /// Whether it is trusted.
        trusted: bool,
    },
    /// A source we connected to: nobody who asks anything of us.
    Source(Box<SourceNames>),
}

/// Naming: how the lines of a source are read and its sensor is called.
#[derive(Debug)]
pub struct SourceNames {
    pub(super) id: Option<String>,
    /// Name of a sensor that does not state one: the subject of its message does.
    pub(super) subject: Option<String>,
    pub(super) decoder: Option<LineDecoder>,
    /// Name in the lines of the sensor that is called `id` here, or that has no other name.
    called: Option<Origin>,
    pub(super) events: Vec<Event>,
}

/// A sensor by what its lines say: `id`, and which of a device's sensors.
type Origin = (Option<String>, Option<String>);

impl Side {
    /// A source whose sensor is called `id` whatever it calls itself, and whose lines `decoder` reads
    /// where that is not the one of everybody.
    #[must_use]
    pub fn source(id: Option<String>, decoder: Option<LineDecoder>) -> Side {
        Side::Source(Box::new(SourceNames {
            id,
            subject: None,
            decoder,
            called: None,
            events: Vec::new(),
        }))
    }

    /// Whether we connected to it.
    pub(super) fn is_source(&self) -> bool {
        matches!(self, Side::Source(_))
    }

    /// Whether it is told nothing.
    pub(super) fn is_deaf(&self) -> bool {
        matches!(self, Side::ListenOnly { .. })
    }

    /// Whether its lines may be rows of a table: not where a message says whose it is, or a phone what it is.
    pub(super) fn takes_rows(&self) -> bool {
        match self {
            Side::Client { .. } | Side::ListenOnly { .. } => true,
            Side::Source(naming) => naming.subject.is_none() && naming.decoder.is_none(),
        }
    }

    /// Whether it speaks for many sensors.
    pub(super) fn is_broker(&self) -> bool {
        matches!(self, Side::Source(naming) if naming.subject.is_some())
    }

    /// A broker, whose messages are of many sensors, or all of the one that is called `id` here.
    #[cfg(any(test, feature = "nats", feature = "zenoh"))]
    #[must_use]
    pub fn broker(id: Option<String>) -> Side {
        let mut side = Side::source(id, None);
        if let Side::Source(naming) = &mut side {
            naming.subject = Some(String::new());
        }
        side
    }
}

impl SourceNames {
    /// Gives a line's sensor its name here. What comes beside the gyro belongs to it (`is_beside`).
    pub(super) fn name(&mut self, head: &mut Line, is_beside: bool) -> Result<(), Fault> {
        if self.id.is_none() && head.id.is_some() {
            return Ok(());
        }
        if let Some(subject) = &self.subject {
            head.id = Some(self.id.as_ref().unwrap_or(subject).clone());
            return Ok(());
        }
        let mut origin = (head.id.clone(), head.sensor.clone());
        let called = if is_beside {
            origin.1 = self.called.as_ref().and_then(|called| called.1.clone());
            self.called.as_ref().unwrap_or(&origin)
        } else {
            self.called.get_or_insert_with(|| origin.clone())
        };
        if *called != origin {
            let name = |(id, sensor): &Origin| {
                id.clone()
                    .or(sensor.clone())
                    .unwrap_or_else(|| "one without a name".to_owned())
            };
            return Err(Fault::new(
                "several_sensors",
                format!(
                    "the source sends several sensors ({} and {}), which must not be mixed; leave ?id= away where they have ids of their own, or ask for one of them",
                    name(called),
                    name(&origin)
                ),
            ));
        }
        if self.id.is_some() {
            head.id.clone_from(&self.id);
        }
        Ok(())
    }
}
