//! Keys, attachments and tokens of ROS 2 over zenoh (rmw_zenoh) <-> what they say. Pure.
//!
//! # Source
//! rmw_zenoh, docs/design.md and `rmw_zenoh_cpp/src/detail/{attachment_helpers,liveliness_utils}.cpp`
//! (github.com/ros2/rmw_zenoh, Jazzy and later).

use strapd_attitude::record::Nanos;
use strapd_recording::text::printable;

/// `sensor_msgs/msg/Imu`, as it stands in keys.
pub const IMU: &str = "sensor_msgs::msg::dds_::Imu_";
/// Type hash of Imu (REP-2016); a subscriber needs none.
const IMU_HASH: &str = "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b";
/// Prefix of tokens.
const TOKENS: &str = "@ros2_lv";
/// Our node, as others see it.
const NODE: &str = "strapd";
/// Reliable, volatile, the last ten.
const QOS: &str = "1:2:1,10:,:,:,,";
/// Beginning of the identity of each of our publishers: what we publish is not to be heard by us, nor by
/// another of us, which would say it again.
const OURS: &[u8; 6] = b"strapd";
/// Bytes of an attachment: a number, a time, the length of an identity, the identity.
const ATTACHMENT: usize = 33;

/// Identity of a publisher.
pub type Gid = [u8; 16];

/// Key to subscribe to for every Imu of these topics.
#[must_use]
pub fn subscription(key: &str) -> String {
    match key.contains("::dds_::") {
        true => key.to_owned(),
        false => format!("{key}/{IMU}/*"),
    }
}

/// The tokens of these topics' domain.
#[must_use]
pub fn tokens(key: &str) -> String {
    let domain = key.split('/').next().unwrap_or("*");
    format!("{TOKENS}/{domain}/**")
}

/// A message's key: `<domain>/<topic>/<type>/<hash>`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key<'a> {
    /// The domain.
    pub domain: &'a str,
    /// The topic with its slash, `/imu/data`.
    pub topic: String,
}

impl<'a> Key<'a> {
    /// Reads it.
    #[must_use]
    pub fn read(key: &'a str) -> Option<Key<'a>> {
        let mut parts = key.rsplitn(3, '/');
        let (_hash, _type, rest) = (parts.next()?, parts.next()?, parts.next()?);
        let (domain, topic) = rest.split_once('/')?;
        Some(Key {
            domain,
            topic: format!("/{topic}"),
        })
    }
}

/// The key under which Imu messages of this topic (`<domain>/<topic>`) are published.
#[must_use]
pub fn key_of(topic: &str) -> String {
    format!("{topic}/{IMU}/{IMU_HASH}")
}

/// The topic of a sensor: of its name, what no topic of ROS can hold is written `_XX`, and no part begins
/// with a digit.
#[must_use]
pub fn topic_of(id: &str) -> String {
    let mut topic = String::new();
    for part in id.split('/').filter(|part| !part.is_empty()) {
        if !topic.is_empty() {
            topic.push('/');
        }
        if part.starts_with(|c: char| c.is_ascii_digit()) {
            topic.push('_');
        }
        for byte in part.bytes() {
            match byte {
                b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'_' => topic.push(char::from(byte)),
                other => topic.push_str(&format!("_{other:02X}")),
            }
        }
    }
    match topic.is_empty() {
        true => "imu".to_owned(),
        false => topic,
    }
}

/// Attachment of each message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Number; that of the next is one more.
    pub sequence: i64,
    /// Time at which it was sent, on the sender's clock.
    pub sent: Nanos,
    /// Publisher.
    pub gid: Gid,
}

impl Attachment {
    /// Reads it: little endian, nothing between.
    ///
    /// # Errors
    /// In words.
    pub fn read(bytes: &[u8]) -> Result<Attachment, String> {
        let fields = || {
            let (sequence, rest) = bytes.split_first_chunk::<8>()?;
            let (sent, rest) = rest.split_first_chunk::<8>()?;
            let (length, rest) = rest.split_first()?;
            let gid: Gid = rest.try_into().ok()?;
            (*length == 16).then_some(Attachment {
                sequence: i64::from_le_bytes(*sequence),
                sent: Nanos(i64::from_le_bytes(*sent)),
                gid,
            })
        };
        fields().ok_or_else(|| {
            format!(
                "an attachment of {} bytes is none of rmw_zenoh's, which has {ATTACHMENT} and says 16 at the 17th: nothing tells which messages are missing",
                bytes.len()
            )
        })
    }

    /// Bytes.
    #[must_use]
    pub fn to_bytes(self) -> [u8; ATTACHMENT] {
        let mut bytes = [0; ATTACHMENT];
        let fields = [
            &self.sequence.to_le_bytes()[..],
            &self.sent.0.to_le_bytes(),
            &[16],
            &self.gid,
        ]
        .concat();
        for (place, byte) in bytes.iter_mut().zip(fields) {
            *place = byte;
        }
        bytes
    }

    /// Whether a strapd has sent it.
    #[must_use]
    pub fn is_ours(&self) -> bool {
        self.gid.starts_with(OURS)
    }
}

/// The identity of our publisher number `number` in the session with this name.
#[must_use]
pub fn gid(session: &str, number: u32) -> Gid {
    let mut gid = [0; 16];
    // Six bytes of the session's name, in hexadecimal digits, tell one daemon from another.
    let digits = session.as_bytes().chunks(2).map(|two| {
        let text = std::str::from_utf8(two).unwrap_or_default();
        u8::from_str_radix(text, 16).unwrap_or_default()
    });
    let bytes = OURS.iter().copied().chain(digits.chain([0; 6]).take(6));
    let bytes = bytes.chain(number.to_le_bytes());
    for (place, byte) in gid.iter_mut().zip(bytes) {
        *place = byte;
    }
    gid
}

/// A publisher that says it is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Token {
    /// The domain.
    pub domain: String,
    /// The node, with its namespace; escaped for a terminal.
    pub node: String,
    /// The topic, `/imu/data`; escaped likewise.
    pub topic: String,
    /// The key under which it publishes.
    pub key: String,
}

impl Token {
    /// Reads the key of a publisher's token; `None`: it is somebody else's, or ours.
    #[must_use]
    pub fn read(key: &str) -> Option<Token> {
        let mut parts = key.split('/');
        let mut next = || parts.next();
        let (TOKENS, domain) = (next()?, next()?) else {
            return None;
        };
        let (_session, _node, _entity) = (next()?, next()?, next()?);
        let ("MP", _enclave, namespace) = (next()?, next()?, next()?) else {
            return None;
        };
        let (node, topic) = (next()?, next()?.replace('%', "/"));
        let (type_name, hash, _qos) = (next()?, next()?, next()?);
        let namespace = namespace.replace('%', "/");
        Some(Token {
            domain: printable(domain),
            node: printable(&format!("{}/{node}", namespace.trim_end_matches('/'))),
            key: format!(
                "{domain}/{}/{type_name}/{hash}",
                topic.trim_start_matches('/')
            ),
            topic: printable(&topic),
        })
    }

    /// Whether a strapd has declared it.
    #[must_use]
    pub fn is_ours(&self) -> bool {
        self.node.trim_start_matches('/') == NODE
    }
}

/// The token of our node in a session.
#[must_use]
pub fn node_token(domain: &str, session: &str) -> String {
    format!("{TOKENS}/{domain}/{session}/0/0/NN/%/%/{NODE}")
}

/// The token of our publisher number `number` of this topic (`<domain>/<topic>`).
#[must_use]
pub fn publisher_token(topic: &str, session: &str, number: u32) -> String {
    let (domain, topic) = topic.split_once('/').unwrap_or((topic, ""));
    let topic = topic.replace('/', "%");
    format!("{TOKENS}/{domain}/{session}/0/{number}/MP/%/%/{NODE}/%{topic}/{IMU}/{IMU_HASH}/{QOS}")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_others_are_read() {
        // As a public firmware for a microcontroller publishes.
        let key = "0/nucleo/imu/data/sensor_msgs::msg::dds_::Imu_/RIHS01_7d9a";
        let read = Key::read(key).unwrap();
        assert_eq!(
            (read.domain, read.topic.as_str()),
            ("0", "/nucleo/imu/data")
        );
        for short in ["", "0", "0/Imu_/hash", "a/b"] {
            assert_eq!(Key::read(short), None, "{short}");
        }
        assert_eq!(subscription("0/**"), format!("0/**/{IMU}/*"));
        assert_eq!(tokens("0/**"), "@ros2_lv/0/**");
    }

    #[test]
    fn an_attachment_has_33_bytes_and_nothing_else_is_one() {
        let one = Attachment {
            sequence: 0x0102_0304_0506_0708,
            sent: Nanos(-2),
            gid: *b"0123456789abcdef",
        };
        let bytes = one.to_bytes();
        assert_eq!(bytes[..8], [8, 7, 6, 5, 4, 3, 2, 1]);
        assert_eq!((bytes[8], bytes[16], bytes[32]), (0xfe, 16, b'f'));
        assert_eq!(Attachment::read(&bytes), Ok(one));
        let mut other = bytes;
        other[16] = 15;
        for bad in [
            &bytes[..32],
            &[bytes.as_slice(), &[0]].concat(),
            &[],
            &other,
        ] {
            assert!(Attachment::read(bad).unwrap_err().contains("33"));
        }
    }

    #[test]
    fn what_a_strapd_says_is_told_by_its_identity_and_no_two_publishers_have_one() {
        let of = |session, number| Attachment {
            sequence: 1,
            sent: Nanos(0),
            gid: gid(session, number),
        };
        assert!(of("1f2e3d4c5b6a79", 1).is_ours() && of("", 0).is_ours());
        let all = [of("1f2e3d", 1), of("1f2e3d", 2), of("1f2e3e", 1)];
        assert!(all[0].gid != all[1].gid && all[0].gid != all[2].gid);
    }

    #[test]
    fn tokens_say_who_publishes_what() {
        let robot = "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MP/%/%robot/talker/%imu%data/sensor_msgs::msg::dds_::Imu_/RIHS01_7d/::,10:,:,:,,";
        let token = Token::read(robot).unwrap();
        assert_eq!(token.node, "/robot/talker");
        assert_eq!(
            (token.domain.as_str(), token.topic.as_str()),
            ("0", "/imu/data")
        );
        assert_eq!(token.key, format!("0/imu/data/{IMU}/RIHS01_7d"));
        assert!(!token.is_ours());
        let own = Token::read(&publisher_token("0/imu/attitude", "ab", 3)).unwrap();
        assert!(own.is_ours());
        assert_eq!(own.key, key_of("0/imu/attitude"));
        for other in [
            node_token("0", "ab"),
            "@ros2_lv/0/MP".to_owned(),
            String::new(),
        ] {
            assert_eq!(Token::read(&other), None, "{other}");
        }
    }

    #[test]
    fn every_name_gives_a_topic_that_ros_takes() {
        for (id, topic) in [
            ("/imu/data", "imu/data"),
            ("imu0", "imu0"),
            ("a.b *", "a_2Eb_20_2A"),
            ("0imu//x/", "_0imu/x"),
            ("датчик", "_D0_B4_D0_B0_D1_82_D1_87_D0_B8_D0_BA"),
            ("//", "imu"),
        ] {
            assert_eq!(topic_of(id), topic);
        }
    }
}
