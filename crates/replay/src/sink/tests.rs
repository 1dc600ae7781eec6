//! Samples the tests of this stage share.

use nalgebra::Vector3;
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};

/// A sample with nothing special about it.
pub(super) fn sample(stamp: Nanos) -> AttitudeSample {
    AttitudeSample {
        stamp,
        q_nb: Quaternion::assume_unit([0.5, -0.5, 0.5, 0.5]),
        rate: BodyRate(Vector3::new(0.1, -0.2, 0.3)),
        accel: Some(In::assume(Vector3::new(0.0, 0.1, 9.8))),
        linear_acceleration: None,
        covariance: AttitudeCovariance::from_sigma(Vector3::new(1e-3, 2e-3, 3e-3)),
        status: Status::OK,
        reset_count: 0,
        log: stamp,
        temperature: None,
    }
}
