//! Messages of topics of ROS 2 -> samples, or why not. Pure.
//!
//! One topic is one sensor. Who publishes it is remembered, as two of them would be integrated as one.

use super::rings::Message;
use super::ros::{Attachment, Gid, Key};
use std::collections::HashMap;
use std::time::{Duration, Instant};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Channel, Decoder, Options};
use strapd_recording::text::printable;

/// While a topic's publisher was heard in this time, another one of the same topic is not.
const HEARD: Duration = Duration::from_secs(1);
/// Topics that are remembered; beyond, all are met anew.
const MOST: usize = 100_000;

/// Publisher of a topic.
#[derive(Debug)]
struct Topic {
    domain: String,
    /// `None`: it does not say.
    gid: Option<Gid>,
    heard: Instant,
}

/// Outcome of a message.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Read {
    /// Samples, and the number of the message where it has one; what is wrong beside them.
    Samples(Option<u64>, Option<String>),
    /// Message of a strapd, passed over.
    Ours,
    /// Message that cannot be read.
    Undecodable(String),
    /// Message that would be mixed with another publisher's.
    Others(String),
}

/// Reads `sensor_msgs/msg/Imu` in CDR, with what rmw_zenoh puts beside it.
#[derive(Debug)]
pub(super) struct Robots {
    decoder: Decoder,
    topics: HashMap<String, Topic>,
}

impl Robots {
    /// # Errors
    /// In words: the fields that the user names are none of an Imu.
    pub(super) fn new(options: &Options) -> Result<Robots, String> {
        let channel = Channel {
            message_encoding: "cdr",
            schema_name: "sensor_msgs/msg/Imu",
            ..Channel::default()
        };
        Ok(Robots {
            decoder: Decoder::compile(&channel, options).map_err(|why| why.to_string())?,
            topics: HashMap::new(),
        })
    }

    /// Appends the samples of a message of the sensor `id`, received at `received`, `now` by the clock that
    /// nobody sets.
    pub(super) fn read(
        &mut self,
        (key, id): (&Key<'_>, &str),
        message: &Message,
        (received, now): (Nanos, Instant),
        samples: &mut Vec<RawSample>,
    ) -> Read {
        let read = message.attachment.as_deref().map(Attachment::read);
        let (attachment, wrong) = match read {
            None => (None, None),
            Some(Ok(attachment)) if attachment.is_ours() => return Read::Ours,
            Some(Ok(attachment)) => (Some(attachment), None),
            Some(Err(what)) => (None, Some(what)),
        };
        if let Err(what) = self.check_publisher(key, id, attachment.map(|a| a.gid), now) {
            return Read::Others(what);
        }
        let sent = attachment.map_or(received, |a| a.sent);
        let decoder = &self.decoder;
        match decoder.decode(&message.payload, received, sent, samples) {
            Ok(_) => {
                let number = attachment.and_then(|a| a.sequence.try_into().ok());
                Read::Samples(number, wrong)
            }
            Err(why) => Read::Undecodable(why.to_string()),
        }
    }

    /// Checks the publisher; one that does not name itself is believed.
    fn check_publisher(
        &mut self,
        key: &Key<'_>,
        id: &str,
        gid: Option<Gid>,
        now: Instant,
    ) -> Result<(), String> {
        let Some(known) = self.topics.get_mut(id) else {
            if self.topics.len() >= MOST {
                self.topics.clear();
            }
            let known = Topic {
                domain: key.domain.to_owned(),
                gid,
                heard: now,
            };
            self.topics.insert(id.to_owned(), known);
            return Ok(());
        };
        let is_recent = now.duration_since(known.heard) < HEARD;
        if is_recent && known.domain != key.domain {
            return Err(format!(
                "{} is in domain {} and in domain {}, and they would be one sensor; say which in the address",
                printable(&key.topic),
                printable(&known.domain),
                printable(key.domain)
            ));
        }
        let is_other = matches!((known.gid, gid), (Some(known), Some(gid)) if known != gid);
        if is_recent && is_other {
            return Err(format!(
                "{} has two publishers, and they would be one sensor; the second is not read while the first is there",
                printable(&key.topic)
            ));
        }
        (known.gid, known.heard) = (gid.or(known.gid), now);
        if known.domain != key.domain {
            key.domain.clone_into(&mut known.domain);
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::serve::brokers::zenoh::ros;

    /// An Imu without a frame: its header, and 37 doubles.
    fn imu() -> Vec<u8> {
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend([7_u32, 5, 1, 0].iter().flat_map(|v| v.to_le_bytes()));
        let mut body = [0.0_f64; 37];
        body[13..16].copy_from_slice(&[0.1, 0.2, 0.3]);
        bytes.extend(body.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    fn message(payload: Vec<u8>, gid: Option<Gid>) -> Message {
        let attachment = gid.map(|gid| Attachment {
            sequence: 9,
            sent: Nanos(3),
            gid,
        });
        Message {
            payload: payload.into(),
            attachment: attachment.map(|a| a.to_bytes().to_vec().into()),
        }
    }

    /// Reads messages, each with its domain and so many milliseconds after the first.
    fn read(messages: &[(&str, u64, Message)]) -> (Vec<Read>, Vec<RawSample>) {
        let mut robots = Robots::new(&Options::default()).unwrap();
        let (began, mut samples) = (Instant::now(), Vec::new());
        let all = messages.iter().map(|(domain, millis, message)| {
            let text = format!("{domain}/imu/{}/x", ros::IMU);
            let key = Key::read(&text).unwrap();
            let now = began + Duration::from_millis(*millis);
            robots.read((&key, "/imu"), message, (Nanos(4), now), &mut samples)
        });
        (all.collect(), samples)
    }

    #[test]
    fn a_message_is_read_with_its_number_and_its_times() {
        let (read, samples) = read(&[("0", 0, message(imu(), Some([1; 16])))]);
        assert_eq!(read, [Read::Samples(Some(9), None)]);
        let [sample] = samples.as_slice() else {
            panic!("{samples:?}");
        };
        assert_eq!(sample.header, Some(Nanos(7_000_000_005)));
        assert_eq!((sample.publish, sample.log), (Nanos(3), Nanos(4)));
        assert_eq!(sample.gyro, Some([0.1, 0.2, 0.3]));
    }

    #[test]
    fn what_has_no_attachment_is_read_and_what_is_none_is_said() {
        let mut bad = message(imu(), None);
        bad.attachment = Some(vec![0; 32].into());
        let (read, samples) = read(&[("0", 0, message(imu(), None)), ("0", 1, bad)]);
        assert_eq!(read[0], Read::Samples(None, None));
        assert!(matches!(&read[1], Read::Samples(None, Some(what)) if what.contains("32 bytes")));
        assert_eq!(samples.len(), 2);
    }

    #[test]
    fn a_second_publisher_waits_until_the_first_is_silent() {
        let of = |gid| message(imu(), Some([gid; 16]));
        let (read, samples) = read(&[
            ("0", 0, of(1)),
            ("0", 500, of(2)),
            ("7", 600, of(1)),
            ("0", 999, of(1)),
            ("0", 1_998, of(2)),
            ("7", 3_000, of(2)),
        ]);
        let taken: Vec<_> = read
            .iter()
            .map(|r| matches!(r, Read::Samples(..)))
            .collect();
        assert_eq!(taken, [true, false, false, true, false, true]);
        let words = |n: usize| match &read[n] {
            Read::Others(what) => what.clone(),
            other => format!("{other:?}"),
        };
        assert!(
            words(1).contains("two publishers") && words(2).contains("domain 0 and in domain 7")
        );
        assert_eq!(samples.len(), 3);
    }

    #[test]
    fn what_a_strapd_says_is_passed_over_and_garbage_leaves_nothing() {
        let (read, samples) = read(&[
            ("0", 0, message(imu(), Some(ros::gid("1f2e3d", 1)))),
            ("0", 0, message(imu()[..40].to_vec(), None)),
        ]);
        assert_eq!(read[0], Read::Ours);
        assert!(matches!(read[1], Read::Undecodable(_)), "{read:?}");
        assert_eq!(samples, []);
    }
}
