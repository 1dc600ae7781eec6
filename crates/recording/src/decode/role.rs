//! Choice of "the IMU topic" among channels. Pure.
//!
//! Apart from decoding because it is asked of every channel of a log before one is chosen, and must
//! answer for those it cannot decode as well.

use super::schema::last_name;
use super::select::MatchQuality;
use super::{Channel, Decoder, Options, Stated, Unsupported};
use strapd_attitude::record::Nanos;

/// Quality of a channel as a source of body rates; the best rank in a log is taken, and when two
/// channels share it the user is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rank {
    /// An IMU: body rate under its own name, with a stamp.
    Imu,
    /// An IMU's numbers processed or thinned out (PX4 `vehicle_imu`).
    Processed,
    /// A vector whose topic says it is a body rate; PX4's filtered rates, and those of its spare IMUs.
    RateByTopic,
    /// A twist or vector that may be one, PX4's single sensors: taken only when nothing better is there.
    Weak,
    /// Never taken unless `--topic` names it: odometry, commands, other vectors, rates without stamp.
    ByNameOnly,
}

/// Role in which a channel can serve.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Role {
    /// Whether it carries a body rate or delta angle.
    pub has_rate: bool,
    /// Whether it carries an orientation, so that it can be a reference.
    pub has_orientation: bool,
    /// Quality as a source of body rates; meaningless without [`Role::has_rate`].
    pub rank: Rank,
}

impl Role {
    /// Whether it may be taken without being named.
    #[must_use]
    pub fn is_automatic(&self) -> bool {
        self.has_rate && self.rank < Rank::ByNameOnly
    }
}

/// Role of `channel`. JSON without a schema shows it only in a message: pass its first one.
/// A channel that cannot be decoded serves as nothing.
#[must_use]
pub fn role(channel: &Channel<'_>, first: Option<(&[u8], Nanos)>) -> Role {
    let decoder = Decoder::compile(channel, &Options::default());
    role_of(channel, decoder, first)
}

/// The same where its decoder, with default options, has been compiled.
#[must_use]
pub fn role_of(
    channel: &Channel<'_>,
    decoder: Result<Decoder, Unsupported>,
    first: Option<(&[u8], Nanos)>,
) -> Role {
    let nothing = Role {
        has_rate: false,
        has_orientation: false,
        rank: Rank::ByNameOnly,
    };
    let Ok(mut decoder) = decoder else {
        return nothing;
    };
    if let Some((payload, log)) = first {
        // A first message that is damaged says nothing; the schema may still.
        let _ = decoder.settle(payload, log);
    }
    let stated = decoder.stated();
    Role {
        has_rate: stated.has_gyro,
        has_orientation: stated.has_orientation,
        rank: rank(channel, decoder.found(), stated),
    }
}

/// Whether a topic is that of a second or later sensor of its kind: `vehicle_imu/1`.
fn is_spare(topic: &str) -> bool {
    let last = topic.rsplit_once('/').map(|(_, last)| last);
    last.and_then(|last| last.parse().ok())
        .is_some_and(|n: u8| n > 0)
}

fn rank(channel: &Channel<'_>, found: MatchQuality, stated: &Stated) -> Rank {
    let name = last_name(channel.schema_name)
        .to_ascii_lowercase()
        .replace('_', "");
    let topic = channel.topic.to_ascii_lowercase();
    let has = |words: &[&str]| words.iter().any(|w| topic.contains(w));
    let is_command = ["target", "setpoint", "command", "cmd"]
        .iter()
        .any(|w| name.contains(w));
    if !stated.has_stamp || name == "odometry" || is_command {
        return Rank::ByNameOnly;
    }
    match found {
        MatchQuality::Nothing => Rank::ByNameOnly,
        MatchQuality::Given => Rank::Imu,
        MatchQuality::Named => match name.as_str() {
            _ if topic.contains("groundtruth") => Rank::ByNameOnly,
            "vehicleimu" if !is_spare(&topic) => Rank::Processed,
            "vehicleimu" | "vehicleangularvelocity" | "vehicleodometry" => Rank::RateByTopic,
            // One of several sensors as it is, thinned out unless it was asked for.
            "sensorgyro" | "sensorgyrofifo" => Rank::Weak,
            // Older ones carry the filter's rates beside its attitude.
            "vehicleattitude" => Rank::Weak,
            _ => Rank::Imu,
        },
        // Several twists in a message are several bodies.
        MatchQuality::Twist if stated.batched => Rank::ByNameOnly,
        MatchQuality::Twist => Rank::Weak,
        MatchQuality::Vector => {
            let rate = has(&[
                "gyro",
                "angular_vel",
                "angular_rate",
                "angvel",
                "omega",
                "body_rate",
            ]);
            // What drivers publish as Vector3Stamped besides rates; and the truth about them, which
            // is no sensor.
            let other = has(&[
                "mag", "acc", "force", "gravity", "vel", "pos", "torque", "wind", "euler", "rpy",
                "angle", "dv", "dq", "bias", "cmd", "goal", "target", "setpoint", "temp", "field",
                "truth",
            ]);
            match (rate, other) {
                (true, _) if !has(&["bias", "mag", "cmd", "setpoint", "target", "truth"]) => {
                    Rank::RateByTopic
                }
                (false, false) => Rank::Weak,
                _ => Rank::ByNameOnly,
            }
        }
    }
}
