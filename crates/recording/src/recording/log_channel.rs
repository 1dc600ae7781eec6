//! A channel of a log, with its first messages -> what it can serve as, and its decoder. Pure.

use super::decoders::{Decoders, plain};
use super::payload_type::PayloadType;
use super::topics::{Candidate, PICKED_UNNAMED};
use crate::decode::{Decoder, Rank, Role, Stated, Unsupported, role_of};
use crate::mcap::Channel;
use std::sync::Arc;
use strapd_attitude::record::Nanos;

/// Topic of frames that do not move.
pub const TF_STATIC: &str = "/tf_static";

/// A channel and its first message.
#[derive(Clone, Debug)]
pub struct LogChannel {
    /// The channel.
    pub channel: Arc<Channel>,
    /// Messages on it.
    pub messages: u64,
    /// Log time and payload of its first message, where there is one.
    pub first: Option<(Nanos, Vec<u8>)>,
    /// Log times and payloads of its first messages, where one does not tell enough.
    pub openings: Vec<(Nanos, Vec<u8>)>,
    /// Role in which it can serve.
    pub role: Role,
    /// Meaning of its samples, where they come as such.
    pub stated: Option<Stated>,
    /// Type of the samples of a text, with how its columns are read.
    pub(super) read_as: Option<PayloadType>,
    /// Whether these are attitudes that strapd made: its rates are another channel's, less the bias.
    pub is_derived: bool,
    /// Name of the columns that tell it from other sensors of its table.
    pub(super) sensor_column: Option<String>,
}

impl LogChannel {
    /// Candidate for the choice of topics.
    #[must_use]
    pub fn candidate(&self) -> Candidate {
        Candidate {
            topic: self.channel.topic.clone(),
            of: self.channel.topic.clone(),
            described: described(&self.channel).to_string(),
            messages: Some(self.messages),
            rank: self.rank(),
            is_derived: self.is_derived,
            sensor_column: self.sensor_column.clone(),
        }
    }

    /// Type of its payloads, as a run names it.
    #[must_use]
    pub fn read_as(&self) -> PayloadType {
        let of_text = self.read_as.clone();
        of_text.unwrap_or_else(|| described(&self.channel))
    }

    /// The [`rank`] of its role: 0 for a channel without a message, whatever its type, and behind every recorded sensor
    /// what strapd made of one.
    #[must_use]
    pub fn rank(&self) -> u8 {
        match (self.messages, rank(&self.role)) {
            (0, _) => 0,
            (_, rank) if self.is_derived => rank.min(PICKED_UNNAMED),
            (_, rank) => rank,
        }
    }

    /// Whether it carries attitudes of something that moves: how the frames of a robot lie in each other is none.
    #[must_use]
    pub fn has_attitudes(&self) -> bool {
        self.role.has_orientation && self.messages > 0 && !is_mounting(&self.channel.topic)
    }

    /// Whether a replay finds in it, by itself, what samples of `frame` are held against.
    #[must_use]
    pub fn is_reference_of(&self, frame: &str) -> bool {
        rank(&self.role) <= 1 && self.has_attitudes() && !self.is_of_another_frame(frame)
    }

    /// Whether it carries transforms, and the first message names no frame `frame`: they are of another body, mounted
    /// to it nobody knows how. Of no name this is not known.
    fn is_of_another_frame(&self, frame: &str) -> bool {
        let schema = self.channel.schema.as_deref().map_or("", |s| &s.name);
        let is_transform = ["TFMessage", "FrameTransform", "FrameTransforms"]
            .iter()
            .any(|name| schema.ends_with(name));
        let frame = frame.trim_start_matches('/');
        let first = self.first.as_ref();
        is_transform
            && !frame.is_empty()
            && first.is_some_and(|(_, payload)| !names(payload, frame.as_bytes()))
    }

    /// A decoder for it that has seen its first message.
    ///
    /// # Errors
    /// The channel cannot be decoded: which, why, and the flag that helps.
    pub fn decoder(&self, decoders: &mut Decoders) -> std::result::Result<Decoder, Unsupported> {
        if let Some(stated) = &self.stated {
            return Ok(Decoder::of_samples(&plain(&self.channel), stated.clone()));
        }
        let own = decoders.of(&self.channel)?;
        let own = self.settled(own, decoders)?;
        // The message's own stamp, unless it is none and a nested one is.
        for nth in 0..own.stamps().len() {
            let decoder = decoders.with_stamp(&self.channel, nth)?;
            let Ok(decoder) = self.settled(decoder, decoders) else {
                continue;
            };
            if !self.openings.is_empty() && decoder.has_good_stamps(&self.openings) {
                return Ok(decoder);
            }
        }
        Ok(own)
    }

    fn settled(
        &self,
        mut decoder: Decoder,
        decoders: &Decoders,
    ) -> std::result::Result<Decoder, Unsupported> {
        if let Some((log, payload)) = &self.first {
            decoder.settle(payload, *log)?;
        }
        let first = match self.openings.as_slice() {
            // A batch tells as much by itself.
            [] => self.first.as_slice(),
            openings => openings,
        };
        decoders.settle_unit(&mut decoder, first)?;
        Ok(decoder)
    }
}

/// Whether a topic holds how frames lie in each other: that of a robot in a namespace of its own, too.
#[must_use]
pub fn is_mounting(topic: &str) -> bool {
    topic.rsplit('/').next() == TF_STATIC.strip_prefix('/')
}

/// Whether a payload holds this name whole, in whatever encoding: all of them have texts as they are.
fn names(payload: &[u8], name: &[u8]) -> bool {
    let is_of_name = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_' || *byte == b'-';
    payload.windows(name.len()).enumerate().any(|(at, window)| {
        let before = at.checked_sub(1).and_then(|at| payload.get(at));
        let after = payload.get(at.saturating_add(name.len()));
        window == name && !before.is_some_and(is_of_name) && !after.is_some_and(is_of_name)
    })
}

/// `sensor_msgs/msg/Imu [cdr]`, fit for a terminal.
#[must_use]
pub fn described(channel: &Channel) -> PayloadType {
    PayloadType::of(channel)
}

/// A role as a number: higher is more likely "the IMU" (see [`Candidate::rank`]).
#[must_use]
pub fn rank(role: &Role) -> u8 {
    if !role.has_rate {
        return 0;
    }
    match role.rank {
        Rank::Imu => 5,
        Rank::Processed => 4,
        Rank::RateByTopic => 3,
        Rank::Weak => 2,
        Rank::ByNameOnly => 1,
    }
}

/// A channel with what it can serve as; `decoders` are those of default options.
#[must_use]
pub fn known(
    channel: &Arc<Channel>,
    messages: u64,
    first: Option<(Nanos, Vec<u8>)>,
    decoders: &mut Decoders,
) -> LogChannel {
    let role = role_of(
        &plain(channel),
        decoders.of(channel),
        first.as_ref().map(|(log, data)| (data.as_slice(), *log)),
    );
    LogChannel {
        channel: channel.clone(),
        messages,
        first,
        openings: Vec::new(),
        role,
        stated: None,
        read_as: None,
        is_derived: false,
        sensor_column: None,
    }
}

/// A log time as a stamp; beyond 2262 it saturates.
#[must_use]
pub fn nanos(time: u64) -> Nanos {
    Nanos(i64::try_from(time).unwrap_or(i64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_named_whole_or_not_at_all() {
        let transform = b"\x05\0\0\0odom\0\0\0\0\x0a\0\0\0base_link\0".as_slice();
        assert!(names(transform, b"base_link") && names(transform, b"odom"));
        for other in ["imu_link", "base", "link", "base_link_2", "od"] {
            assert!(!names(transform, other.as_bytes()), "{other}");
        }
        assert!(names(br#"{"child_frame_id":"/imu_link"}"#, b"imu_link"));
        assert!(!names(b"", b"imu_link"));
    }
}
