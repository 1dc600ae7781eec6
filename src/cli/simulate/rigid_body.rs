//! `strapd simulate rigid-body`. Pure.

use super::{Made, parameter, sampling::Common};
use crate::config::{numbers, parse_initial};
use crate::error::{Error, Result};
use clap::Args;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use strapd_attitude::estimate::Initial;
use strapd_attitude::quaternion::Quaternion;
use strapd_bodies::inertia::{self, InertiaError};
use strapd_bodies::motion::Motion;
use strapd_bodies::rigid_body::{HeavyBody, Rotor, Spin};
use strapd_bodies::synthetic::ForceSampling;

/// Any rigid body about a fixed point, free or under gravity.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd simulate rigid-body -o flip.mcap                        turns over about its middle axis
  strapd simulate rigid-body --inertia 0.2,0.2,0.3 --body-rate 1,0,4 -o free.mcap
  strapd simulate rigid-body --body-rate 0,0,60 -o pendulum.mcap \\
    --inertia '{\"mass\":1,\"r_og_b\":[0,0.01,0.04],\"inertia_cg\":[[4e-4,0,0],[0,5e-4,0],[0,0,8e-4]]}'")]
pub struct RigidBody {
    /// Inertia tensor about the fixed point, kg m^2: Ixx,Iyy,Izz or, with the entries of the matrix
    /// (URDF: -int xy dm), Ixx,Iyy,Izz,Ixy,Ixz,Iyz: a body no gravity turns. Or a heavy one as JSON:
    /// {"mass":..,"r_og_b":[3],"inertia_cg":[[3]x3]}, r_og_b from the fixed point
    #[arg(long, value_name = "INERTIA", default_value = "0.1,0.2,0.28")]
    pub inertia: String,
    /// Body rate at the start, rad/s
    #[arg(
        long,
        value_name = "X,Y,Z",
        default_value = "0.01,5,0",
        allow_hyphen_values = true
    )]
    pub body_rate: String,
    /// Attitude at the start: identity, q=w,x,y,z, or rpy=roll,pitch,yaw in degrees
    #[arg(long, value_name = "ATTITUDE", default_value = "identity")]
    pub attitude: String,
    /// Gravity, m/s^2, downwards
    #[arg(
        long,
        value_name = "M_S2",
        default_value_t = 9.80665,
        allow_negative_numbers = true
    )]
    pub gravity: f64,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub common: Common,
}

/// A heavy body, as `model inertia` takes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Heavy {
    mass: f64,
    r_og_b: [f64; 3],
    inertia_cg: [[f64; 3]; 3],
}

impl RigidBody {
    pub(super) fn made(&self) -> Result<Made> {
        let refused = |e: InertiaError| Error::usage(format!("--inertia {}: {e}", self.inertia));
        let (tensor, mass_times_r) = self.body()?;
        let rotor = Rotor::new(tensor).map_err(refused)?;
        let q_nb = match parse_initial(&self.attitude) {
            Ok(Initial::Identity) => Quaternion::identity(),
            Ok(Initial::Given(q_nb)) => q_nb,
            _ => {
                return Err(Error::usage(format!(
                    "--attitude {}: identity, q=w,x,y,z or rpy=roll,pitch,yaw (degrees) is needed",
                    self.attitude
                )));
            }
        };
        let start = Spin {
            q_nb,
            w_nb_b: Vector3::from(numbers::<3>("--body-rate", &self.body_rate)?),
        };
        let gravity_n = Vector3::new(0.0, 0.0, -self.gravity);
        let body = HeavyBody::new(rotor, mass_times_r, gravity_n, start)
            .map_err(|e| Error::usage(format!("simulate rigid-body: {e}")))?;
        Ok(Made {
            motion: Motion::HeavyBody(Box::new(body)),
            force: ForceSampling::Instant,
            gravity: Some(self.gravity),
            parameters: vec![
                parameter("inertia", &self.inertia),
                parameter("body_rate_rad_s", &self.body_rate),
                parameter("attitude", &self.attitude),
            ],
            notes: Vec::new(),
        })
    }

    /// Tensor about the fixed point, and mass times the centre of gravity seen from there.
    fn body(&self) -> Result<(Matrix3<f64>, Vector3<f64>)> {
        let text = self.inertia.trim();
        let usage = |e: &dyn std::fmt::Display| Error::usage(format!("--inertia {text}: {e}"));
        if text.starts_with('{') {
            let heavy: Heavy = serde_json::from_str(text).map_err(|e| usage(&e))?;
            let r_og_b = Vector3::from(heavy.r_og_b);
            let tensor = Matrix3::from_fn(|i, j| heavy.inertia_cg[i][j]);
            let body =
                inertia::RigidBody::new(heavy.mass, r_og_b, tensor).map_err(|e| usage(&e))?;
            return Ok((body.inertia_at_origin(), body.r_og_b() * body.mass()));
        }
        let [xx, yy, zz, xy, xz, yz] = match text.split(',').count() {
            3 => {
                let [xx, yy, zz] = numbers("--inertia", text)?;
                [xx, yy, zz, 0.0, 0.0, 0.0]
            }
            6 => numbers("--inertia", text)?,
            _ => {
                return Err(usage(
                    &"expected Ixx,Iyy,Izz or Ixx,Iyy,Izz,Ixy,Ixz,Iyz, or a body as JSON",
                ));
            }
        };
        let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        // The mass plays no part: any will do to ask whether matter can be spread like that.
        let body = inertia::RigidBody::new(1.0, Vector3::zeros(), tensor).map_err(|e| usage(&e))?;
        Ok((body.inertia_cg(), Vector3::zeros()))
    }
}
