//! Joint motion -> what a perfect IMU mounted on the gripper reads, and its exact attitude. Pure.

use super::error::bounded;
use super::follow::ToolTrack;
use super::joints::TableMotion;
use super::path::JointPath;
use super::{Arm, ArmError, Base, Tool};
use crate::dh::Transform;
use crate::gauss::NODES;
use crate::kinematics::Kinematics;
use crate::rigid_body::Spin;
use nalgebra::Vector3;
use strapd_attitude::frames::{Dcm, In, NotARotation, Sensor};
use strapd_attitude::quaternion::{BodyRate, DeltaAngle, Quaternion};

/// Mounting of an IMU on the gripper: its axes and its position in the tool frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ImuMount {
    t_tool_imu: Transform<Tool, Sensor>,
}

impl ImuMount {
    /// Mounting at the tool point, axes along the tool's.
    #[must_use]
    pub fn at_tool() -> Self {
        Self {
            t_tool_imu: Transform::identity(),
        }
    }

    /// Anywhere, any way round.
    ///
    /// # Errors
    /// [`ArmError::NotARotation`]; a place not finite or beyond 1 km.
    pub fn new(t_tool_imu: Transform<Tool, Sensor>) -> Result<Self, ArmError> {
        let c = Dcm::<Tool, Sensor>::try_from_matrix(*t_tool_imu.rotation().as_matrix());
        let defect = t_tool_imu.rotation().orthonormality_defect();
        c.map_err(ArmError::NotARotation)?;
        if defect > 1e-9 {
            return Err(ArmError::NotARotation(NotARotation::NotOrthonormal {
                defect,
            }));
        }
        let r = t_tool_imu.translation();
        let r = r.as_vector();
        bounded("place of the IMU (m)", [r.x, r.y, r.z], 1e3)?;
        Ok(Self { t_tool_imu })
    }

    /// Reading during `motion`, under gravity `g_b` (m/s^2, base axes), with its pose.
    #[must_use]
    pub fn read(&self, arm: &Arm, motion: &TableMotion, g_b: &In<Base>) -> ImuReading {
        let t_base_tool = arm.forward(motion.q());
        let [.., tool] = arm.link_motions(motion);
        let (w, wd) = (tool.rate.as_vector(), tool.rate_change.as_vector());
        let lever = self.t_tool_imu.translation();
        let lever = lever.as_vector();
        let a = tool.acceleration.as_vector() + wd.cross(lever) + w.cross(&w.cross(lever));
        let c_tool_base = t_base_tool.rotation().transpose();
        let f = In::<Tool>::assume(a - (c_tool_base * *g_b).as_vector());
        let c_imu_tool = self.t_tool_imu.rotation().transpose();
        ImuReading {
            t_base_imu: t_base_tool * self.t_tool_imu,
            rate: BodyRate(*(c_imu_tool * In::<Tool>::assume(*w)).as_vector()),
            specific_force: c_imu_tool * f,
        }
    }

    /// Angular rate alone, in closed form: sensor axes, rad/s.
    ///
    /// `w = (c5 s qd1 + s5 Pd, c5 Pd - s5 s qd1, qd5 - c qd1)` in tool axes, `Pd = qd2 + qd3 + qd4`.
    #[must_use]
    pub fn rate(&self, arm: &Arm, motion: &TableMotion) -> BodyRate {
        let k = arm.planar(motion.q());
        let ((s, c), (s5, c5)) = (k.pitch, k.five);
        let [qd1, qd2, qd3, qd4, qd5] = motion.qd();
        let pitch = qd2 + qd3 + qd4;
        let w = Vector3::new(
            c5 * s * qd1 + s5 * pitch,
            c5 * pitch - s5 * s * qd1,
            qd5 - c * qd1,
        );
        BodyRate(self.t_tool_imu.rotation().as_matrix().tr_mul(&w))
    }
}

/// Reading and truth at one instant.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ImuReading {
    /// Pose of the IMU in the base frame: the truth.
    pub t_base_imu: Transform<Base, Sensor>,
    /// Angular rate, sensor axes, rad/s.
    pub rate: BodyRate,
    /// Reading of the accelerometer, `C (a - g)`, m/s^2.
    pub specific_force: In<Sensor>,
}

impl ImuReading {
    /// Exact attitude, w >= 0.
    #[must_use]
    pub fn attitude(&self) -> Quaternion<Base, Sensor> {
        Quaternion::from_dcm(&self.t_base_imu.rotation())
    }
}

/// The gripper as a synthetic IMU: readings and exact attitude at any instant.
///
/// Everything that can go wrong on the way is found when it is made; after that every instant has an
/// answer.
#[derive(Clone, PartialEq, Debug)]
pub struct Gripper {
    arm: Arm,
    path: JointPath,
    mount: ImuMount,
    g_b: In<Base>,
}

impl Gripper {
    /// Along a path in joint space; gravity in m/s^2, base axes.
    ///
    /// # Errors
    /// [`ArmError::Limit`] when the path takes a joint past its stop at any time; gravity not finite or
    /// beyond 1e6 m/s^2.
    pub fn along_joints(
        arm: Arm,
        path: JointPath,
        mount: ImuMount,
        g_b: In<Base>,
    ) -> Result<Self, ArmError> {
        let g = g_b.as_vector();
        bounded("gravity (m/s^2)", [g.x, g.y, g.z], 1e6)?;
        path.check(arm.limits())?;
        Ok(Self {
            arm,
            path,
            mount,
            g_b,
        })
    }

    /// Along a path of the gripper, for `secs` seconds; after that it stands.
    ///
    /// # Errors
    /// [`ArmError::Path`] with the time and the reason.
    pub fn along_track(
        track: &ToolTrack,
        secs: f64,
        mount: ImuMount,
        g_b: In<Base>,
    ) -> Result<Self, ArmError> {
        let path = track.joint_path(secs)?;
        Self::along_joints(*track.arm(), path, mount, g_b)
    }

    /// The arm.
    #[must_use]
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// Joints at `nanos` nanoseconds from the start.
    #[must_use]
    pub fn joints(&self, nanos: u64) -> TableMotion {
        self.path.motion(secs(nanos))
    }

    /// Reading and truth at `nanos` nanoseconds from the start.
    #[must_use]
    pub fn read(&self, nanos: u64) -> ImuReading {
        self.mount.read(&self.arm, &self.joints(nanos), &self.g_b)
    }

    /// The truth as a motion of a body against a world: base axes are n, sensor axes are b.
    #[must_use]
    pub fn at_nanos(&self, nanos: u64) -> Spin {
        let reading = self.read(nanos);
        Spin {
            q_nb: Quaternion::assume_unit(reading.attitude().wxyz()),
            w_nb_b: reading.rate.0,
        }
    }

    /// Acceleration of the IMU, m/s^2, base axes.
    #[must_use]
    pub fn acceleration(&self, nanos: u64) -> In<Base> {
        let reading = self.read(nanos);
        let f = reading.t_base_imu.rotation() * reading.specific_force;
        In::assume(f.as_vector() + self.g_b.as_vector())
    }

    /// All that is felt at the IMU at `nanos` nanoseconds from the start.
    #[must_use]
    pub fn kinematics(&self, nanos: u64) -> Kinematics {
        let motion = self.joints(nanos);
        let [.., tool] = self.arm.link_motions(&motion);
        let c_imu_tool = self.mount.t_tool_imu.rotation().transpose();
        Kinematics {
            spin: self.at_nanos(nanos),
            rate_change: *(c_imu_tool * In::<Tool>::assume(*tool.rate_change.as_vector()))
                .as_vector(),
            acceleration_n: *self.acceleration(nanos).as_vector(),
        }
    }

    /// Integral of the angular rate over `from..to` nanoseconds, sensor axes: what an integrating gyro
    /// puts out.
    ///
    /// # Accuracy
    /// 1e-15 rad for intervals up to a second at the arm's rates: Gauss's rule of eight points on
    /// pieces of at most 50 ms (up to 14 h; longer for more) leaves less than rounding.
    #[must_use]
    pub fn delta_angle(&self, from: u64, to: u64) -> DeltaAngle {
        let (sign, from, to) = if to >= from {
            (1.0, from, to)
        } else {
            (-1.0, to, from)
        };
        let whole = secs(to - from);
        let pieces = (whole / 0.05).ceil().clamp(1.0, 1e6) as u32;
        let half = 0.5 * whole / f64::from(pieces);
        let start = secs(from);
        let mut sum = Vector3::zeros();
        for piece in 0..pieces {
            let middle = start + half * (2.0 * f64::from(piece) + 1.0);
            for (node, weight) in NODES {
                for at in [middle - half * node, middle + half * node] {
                    sum += self.mount.rate(&self.arm, &self.path.motion(at)).0 * weight;
                }
            }
        }
        DeltaAngle(sum * (half * sign))
    }
}

/// One rounding.
fn secs(nanos: u64) -> f64 {
    nanos as f64 / 1e9
}
