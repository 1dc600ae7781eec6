//! Inertial sensors that send frames of their maker's -> samples in SI, from a living link or from captured bytes. Pure.
//!
//! A stage of its own because such a sensor is the commonest source there is, and has neither lines nor a file format:
//! each protocol is one file, which says how a frame is cut and what its numbers are, and one row of [`PROTOCOLS`].
//! Everything else (half frames, damage, losses, names, captures, recognition) is the same for all of them.
//!
//! ```text
//! bytes -> cut (a whole frame whose checksum holds) -> device (samples in SI, x forward, y left, z up)
//!       -> link (lines of a daemon), transcriber (records of a capture)
//! ```

mod auto;
mod bno08x_rvc;
mod clock;
mod frame;
mod link;
mod mip;
mod motion;
mod numbers;
mod orientation;
mod reader;
mod recognise;
mod sample;
mod transcriber;
mod vectornav;
mod witmotion;
mod ximu3;
mod xsens;

pub use link::{Link, Note};
pub(crate) use recognise::{is_capture, may_be_capture};
pub(crate) use transcriber::Transcriber;

use crate::text::printable;
use frame::Cut;
use sample::Taken;
use std::fmt::{self, Debug};

/// Protocol of a link that has no lines.
pub struct Protocol {
    /// Name in addresses.
    pub name: &'static str,
    /// Name as people call it.
    pub title: &'static str,
    /// Contents that are read, for help and documents.
    pub carries: &'static str,
    /// Cuts the frame that begins here.
    cut: fn(&[u8]) -> Cut,
    opens: Opens,
}

/// Reader of a protocol.
enum Opens {
    /// MAVLink, which has senders, and files of its own.
    Mavlink,
    /// A sensor.
    Device(fn() -> Box<dyn Device>),
    /// Nothing, for this reason.
    Nothing(&'static str),
}

/// Protocols, in the order in which texts list them.
pub const PROTOCOLS: &[Protocol] = &[
    Protocol {
        name: "mavlink",
        title: "MAVLink",
        carries: "HIGHRES_IMU, SCALED_IMU, SCALED_IMU2, SCALED_IMU3, RAW_IMU",
        cut: crate::mavlink::cut,
        opens: Opens::Mavlink,
    },
    Protocol {
        name: "ximu3",
        title: "x-IMU3",
        carries: "inertial, magnetometer and orientation messages, binary and ASCII, also through a multiplexer",
        cut: ximu3::cut,
        opens: Opens::Device(|| Box::new(ximu3::Ximu3)),
    },
    Protocol {
        name: "xsens",
        title: "Xsens MTData2",
        carries: "DeltaQ, RateOfTurn or RateOfTurnHR; Acceleration, DeltaV; MagneticField; Quaternion",
        cut: xsens::cut,
        opens: Opens::Device(|| Box::new(xsens::Xsens::default())),
    },
    Protocol {
        name: "witmotion",
        title: "WitMotion",
        carries: "frames 0x50 (time), 0x51 (acceleration), 0x52 (rate), 0x53 (angles), 0x54 (field), 0x59 (quaternion)",
        cut: witmotion::cut,
        opens: Opens::Device(|| Box::new(witmotion::WitMotion::default())),
    },
    Protocol {
        name: "vectornav",
        title: "VectorNav",
        carries: "binary groups 1 to 3 and 5 (DeltaTheta, AngularRate, UncompGyro, Quaternion), $VNYMR, $VNQMR, $VNIMU",
        cut: vectornav::cut,
        opens: Opens::Device(|| Box::new(vectornav::VectorNav::default())),
    },
    Protocol {
        name: "mip",
        title: "MicroStrain MIP",
        carries: "set 0x80: delta theta or scaled gyro; scaled accelerometer and magnetometer; orientation of sets 0x80 and 0x82",
        cut: mip::cut,
        opens: Opens::Device(|| Box::new(mip::Mip::default())),
    },
    Protocol {
        name: "bno08x-rvc",
        title: "BNO08x in UART-RVC mode",
        carries: "nothing: it has an attitude and no rate",
        cut: bno08x_rvc::cut,
        opens: Opens::Nothing(
            "its frames hold an attitude and an acceleration, but no rate, so that nothing can be integrated; the sensor's SHTP mode sends rates",
        ),
    },
];

/// Sensor whose frames come one after another.
pub(crate) trait Device: Send + Sync {
    /// Takes a whole frame.
    fn take(&mut self, frame: &[u8], to: &mut Taken);
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl fmt::Debug for dyn Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Device")
    }
}

impl Protocol {
    /// Reader of its frames; `None` of one that has other readers.
    fn device(&self) -> Option<Box<dyn Device>> {
        match self.opens {
            Opens::Device(open) => Some(open()),
            Opens::Mavlink | Opens::Nothing(_) => None,
        }
    }

    /// Reason why nothing of it can be used.
    #[must_use]
    pub fn refusal(&self) -> Option<&'static str> {
        match self.opens {
            Opens::Nothing(why) => Some(why),
            Opens::Mavlink | Opens::Device(_) => None,
        }
    }
}

impl Debug for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Protocol {
    fn eq(&self, other: &Protocol) -> bool {
        self.name == other.name
    }
}

/// Protocol that an address asks for (`?protocol=`).
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Asked {
    /// Lines of text.
    #[default]
    Lines,
    /// The one that the bytes show.
    Auto,
    /// A protocol.
    Named(&'static Protocol),
}

impl Asked {
    /// Reads the value of `?protocol=`.
    ///
    /// # Errors
    /// In words: a name that is none, with those there are, or a protocol of which nothing can be used.
    pub fn parse(name: &str) -> Result<Asked, String> {
        let mut known = PROTOCOLS.iter();
        match (name, known.find(|protocol| protocol.name == name)) {
            ("lines", _) => Ok(Asked::Lines),
            ("auto", _) => Ok(Asked::Auto),
            (_, Some(protocol)) => match protocol.refusal() {
                Some(why) => Err(format!("{name}: {why}")),
                None => Ok(Asked::Named(protocol)),
            },
            _ => Err(format!("{}: one of {}", printable(name), Asked::names())),
        }
    }

    /// Names that can be asked for, separated by commas.
    #[must_use]
    pub fn names() -> String {
        let usable = PROTOCOLS.iter().filter(|row| row.refusal().is_none());
        let names: Vec<&str> = usable.map(|row| row.name).collect();
        format!("auto, {}, lines", names.join(", "))
    }

    /// Name in addresses.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Asked::Lines => "lines",
            Asked::Auto => "auto",
            Asked::Named(protocol) => protocol.name,
        }
    }

    /// Whether its bytes are lines of text for sure.
    #[must_use]
    pub fn is_lines(self) -> bool {
        self == Asked::Lines
    }
}

#[cfg(test)]
mod tests;
