//! A topic -> the type of its payloads, as it is shown and as it is asked for. Pure.
//!
//! Apart from the channel because samples that came as lines or rows have one too, and no channel: who has to know whether
//! they did reads a format here, and no text.

use crate::format::Format;
use crate::mcap::Channel;
use crate::text::printable;
use std::fmt;

/// Type of a topic's payloads, with what they are written in.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct PayloadType {
    shown: String,
    /// Format of lines or rows; `None` of messages, and of samples in memory.
    pub text: Option<Format>,
}

impl PayloadType {
    /// Makes that of a channel: `sensor_msgs/msg/Imu [cdr]`.
    #[must_use]
    pub fn of(channel: &Channel) -> PayloadType {
        let schema = channel.schema.as_deref();
        let name = schema.map_or("(no type)", |schema| schema.name.as_str());
        PayloadType {
            shown: printable(&format!("{name} [{}]", channel.message_encoding)),
            text: channel.text,
        }
    }

    /// Makes that of lines or rows of a format, of which this may be said besides: `gyro=wx:wy:wz [CSV]`.
    pub(super) fn of_text(format: Format, besides: &str) -> PayloadType {
        PayloadType {
            shown: match besides {
                "" => format.name().to_owned(),
                besides => format!("{besides} [{}]", format.name()),
            },
            text: Some(format),
        }
    }

    /// Makes that of samples in memory, which have no payloads.
    #[must_use]
    pub fn of_memory(name: &str) -> PayloadType {
        PayloadType {
            shown: name.to_owned(),
            text: None,
        }
    }
}

impl fmt::Display for PayloadType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.shown)
    }
}
