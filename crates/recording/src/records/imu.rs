//! A rate and a force -> the message ROS 2 has for them. Pure.
//!
//! Apart from the containers because several have samples in layouts of their own: told as this, viewers of an MCAP
//! made of them read them, too.

/// The type.
pub(crate) const TYPE: &str = "sensor_msgs/msg/Imu";

/// Covariance that marks a field as absent.
const ABSENT: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Writes a CDR message in place of what is in `out`: stamp in ns, rate in rad/s, force in m/s^2, no orientation.
pub(crate) fn imu(
    out: &mut Vec<u8>,
    (time, frame): (u64, &str),
    rate: [f64; 3],
    force: Option<[f64; 3]>,
) {
    out.clear();
    out.extend([0, 1, 0, 0]);
    let secs = i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX);
    out.extend(secs.to_le_bytes());
    out.extend(((time % 1_000_000_000) as u32).to_le_bytes());
    out.extend((frame.len() as u32 + 1).to_le_bytes());
    out.extend(frame.as_bytes());
    out.push(0);
    // Numbers stand at multiples of eight behind the first four bytes.
    out.resize((out.len() - 4).next_multiple_of(8) + 4, 0);
    let mut doubles = |values: &[f64]| {
        for value in values {
            out.extend(value.to_le_bytes());
        }
    };
    doubles(&[0.0, 0.0, 0.0, 1.0]);
    doubles(&ABSENT);
    doubles(&rate);
    doubles(&[0.0; 9]);
    doubles(&force.unwrap_or_default());
    doubles(if force.is_some() { &[0.0; 9] } else { &ABSENT });
}
