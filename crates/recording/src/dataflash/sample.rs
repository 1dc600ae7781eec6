//! A message of a log by its layout -> a sample in ROS's messages. Pure.
//!
//! Apart from the walk because here is all that is known of single messages: their names, units and axes. The controller's
//! are forward, right, down.

use super::layout::Layout;
use crate::records::imu::{self, flu};
use strapd_attitude::quaternion::{Quaternion, YawPitchRoll};

/// Tesla of a milligauss.
const MILLIGAUSS: f64 = 1e-7;
/// Name of the frame.
const FRAME: &str = "vehicle";

/// Content of a message.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Content {
    Imu,
    Field,
    Attitude,
}

impl Content {
    /// Content of the messages of a name, and the instance it names; `None`: none that is read.
    pub(super) fn of(name: &str) -> Option<(Content, u8)> {
        Some(match name {
            "IMU" => (Content::Imu, 0),
            "IMU2" => (Content::Imu, 1),
            "IMU3" => (Content::Imu, 2),
            "MAG" => (Content::Field, 0),
            "MAG2" => (Content::Field, 1),
            "MAG3" => (Content::Field, 2),
            "ATT" => (Content::Attitude, 0),
            _ => return None,
        })
    }

    /// Number of its schema, and its type.
    pub(super) fn schema(self) -> (u16, &'static str) {
        match self {
            Content::Imu => (1, imu::TYPE),
            Content::Field => (2, imu::FIELD_TYPE),
            Content::Attitude => (3, imu::ATTITUDE_TYPE),
        }
    }

    /// Topic of an instance.
    pub(super) fn topic(self, instance: u8) -> String {
        let name = match self {
            Content::Imu => "IMU",
            Content::Field => "MAG",
            Content::Attitude => "ATT",
        };
        match instance {
            0 => name.to_owned(),
            n => format!("{name}/{n}"),
        }
    }

    /// Writes the message in place of what is in `out`; `None` where it lacks what it must have.
    pub(super) fn write(
        self,
        layout: &Layout,
        message: &[u8],
        time: u64,
        out: &mut Vec<u8>,
    ) -> Option<()> {
        match self {
            Content::Imu => {
                let rate = flu(layout.vector(message, ["GyrX", "GyrY", "GyrZ"])?);
                let force = layout.vector(message, ["AccX", "AccY", "AccZ"]).map(flu);
                imu::imu(out, (time, FRAME), rate, force);
            }
            Content::Field => {
                let field = flu(layout.vector(message, ["MagX", "MagY", "MagZ"])?);
                imu::field(out, (time, FRAME), field.map(|c| c * MILLIGAUSS));
            }
            Content::Attitude => {
                let angles = layout.vector(message, ["Roll", "Pitch", "Yaw"])?;
                imu::attitude(out, (time, FRAME), attitude(angles));
            }
        }
        Some(())
    }
}

/// `[x, y, z, w]`, FLU body to a world with x north, y west, z up, of angles in degrees, FRD body to NED.
fn attitude(angles: [f64; 3]) -> [f64; 4] {
    let [roll, pitch, yaw] = angles.map(f64::to_radians);
    let q = Quaternion::<(), ()>::from_yaw_pitch_roll(&YawPitchRoll { yaw, pitch, roll });
    imu::nwu_of_ned(&q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attitude_of_aviation_is_that_of_a_body_with_left_and_up() {
        // Nose up by 30 degrees: in FLU a turn about y (left) by -30.
        let [x, y, z, w] = attitude([0.0, 30.0, 0.0]);
        let (s, c) = 15f64.to_radians().sin_cos();
        let close = |a: f64, b: f64| (a - b).abs() < 1e-15;
        assert!(close(x, 0.0) && close(y, -s) && close(z, 0.0) && close(w, c));
        // To the right by 40: about z (up) by -40.
        let [_, _, z, w] = attitude([0.0, 0.0, 40.0]);
        let (s, c) = 20f64.to_radians().sin_cos();
        assert!(close(z, -s) && close(w, c));
        // Yaw, then pitch, then roll, as products of their quaternions in FLU: q_z(-40) q_y(-30) q_x(20).
        let [x, y, z, w] = attitude([20.0, 30.0, 40.0]);
        let [(sr, cr), (sp, cp), (sy, cy)] =
            [20f64, -30.0, -40.0].map(|angle| (angle.to_radians() / 2.0).sin_cos());
        let product = |[a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]| {
            [
                a * e - b * f - c * g - d * h,
                a * f + b * e + c * h - d * g,
                a * g - b * h + c * e + d * f,
                a * h + b * g - c * f + d * e,
            ]
        };
        let wanted = product(
            product([cy, 0.0, 0.0, sy], [cp, 0.0, sp, 0.0]),
            [cr, sr, 0.0, 0.0],
        );
        for (one, other) in [w, x, y, z].into_iter().zip(wanted) {
            assert!(close(one, other), "{wanted:?}");
        }
    }
}
