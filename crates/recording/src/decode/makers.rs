//! Names in a topic or a type -> what the samples of that maker's sensors usually are. Pure.
//!
//! Apart from what types state because a name fixes nothing: it stands behind every statement (`docs/theory/clocks.md`,
//! "What a sample means").

use strapd_attitude::record::SampleKind;

/// Makers as their drivers call them, without punctuation: what a sample of theirs was found to be, against their own
/// orientations.
const MAKERS: [(&str, SampleKind); 8] = [
    ("vectornav", SampleKind::Rate),
    ("xsens", SampleKind::Average),
    ("movella", SampleKind::Average),
    ("ximu3", SampleKind::Average),
    ("gazebo", SampleKind::Average),
    ("ignitionmsgs", SampleKind::Average),
    ("gzmsgs", SampleKind::Average),
    ("gzsim", SampleKind::Average),
];

/// Kind that samples usually are whose topic or type names a maker.
pub(super) fn usual_kind(names: [&str; 2]) -> Option<SampleKind> {
    let plain = names.map(|name| {
        let letters = name.chars().filter(char::is_ascii_alphanumeric);
        letters.collect::<String>().to_ascii_lowercase()
    });
    let named = |maker: &str| plain.iter().any(|name| name.contains(maker));
    MAKERS
        .iter()
        .find(|(maker, _)| named(maker))
        .map(|(_, kind)| *kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn makers_are_known_by_topic_or_type_and_nobody_else_is() {
        for (topic, schema, kind) in [
            (
                "/vectornav/IMU",
                "sensor_msgs/msg/Imu",
                Some(SampleKind::Rate),
            ),
            (
                "/imu",
                "vectornav_msgs/msg/ImuGroup",
                Some(SampleKind::Rate),
            ),
            ("/x-imu3/inertial", "", Some(SampleKind::Average)),
            (
                "/XSens/imu/data",
                "sensor_msgs/Imu",
                Some(SampleKind::Average),
            ),
            (
                "/world/default/imu",
                "gz.msgs.IMU",
                Some(SampleKind::Average),
            ),
            ("/imu/data", "sensor_msgs/msg/Imu", None),
            ("/vector/imu", "geometry_msgs/msg/Vector3Stamped", None),
        ] {
            assert_eq!(usual_kind([topic, schema]), kind, "{topic} {schema}");
        }
    }
}
