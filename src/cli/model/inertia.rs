//! `strapd model inertia`: mass properties -> matrices, checks and the motion they cause. I/O.

use super::filter::{self, Refusal};
use crate::cli::Outcome;
use crate::error::Result;
use clap::Args;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde::Deserialize;
use serde_json::{Value, json};
use strapd_bodies::inertia::{AddedMass, InertiaError, RigidBody};

/// Mass, centre of gravity, inertia -> 6x6 matrices, Coriolis forces, acceleration.
#[derive(Args, Debug)]
#[command(
    after_help = "Request, one JSON object a line (SI, body axes b with origin O, G the centre of gravity):
  mass, r_og_b [3], inertia_cg [[3]x3]   a body: the tensor about G, entry (1,2) = -int xy dm
  or bodies [{mass, r_og_b, inertia_cg}, ..]   several, welded together
  or m_co [[6]x6]                         its mass matrix at O, taken apart
  nu [6]            velocity of O and body rate, [v; w]
  tau [6]           force and moment about O, [f; n]; zero when only nu is given
  added_mass [[6]x6]   of the fluid that is carried along

Answer: mass, r_og_b, inertia_cg, principal_moments, m_cg, m_co, condition; with nu: c_nu = C(nu) nu,
nu_dot from (M_RB + M_A) nu_dot + C(nu) nu = tau, energy (fluid included in all three).
condition.relative_error is what taking m_co apart costs the tensor.

Example:
  echo '{\"mass\":1000,\"r_og_b\":[0.5,0,0.3],\"inertia_cg\":[[500,0,0],[0,2000,0],[0,0,2100]]}' \\
    | strapd model inertia | jq .m_co"
)]
pub struct Inertia {}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    mass: f64,
    #[serde(default)]
    r_og_b: [f64; 3],
    inertia_cg: [[f64; 3]; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    mass: Option<f64>,
    r_og_b: Option<[f64; 3]>,
    inertia_cg: Option<[[f64; 3]; 3]>,
    bodies: Option<Vec<Body>>,
    m_co: Option<[[f64; 6]; 6]>,
    nu: Option<[f64; 6]>,
    tau: Option<[f64; 6]>,
    added_mass: Option<[[f64; 6]; 6]>,
}

/// Runs it.
///
/// # Errors
/// Standard input or output fails.
pub(super) fn run(_: &Inertia) -> Result<Outcome> {
    filter::run(|request: Request| answer(&request))
}

fn answer(request: &Request) -> std::result::Result<Value, Refusal> {
    let (body, relative_error) = body(request)?;
    let mut answer = json!({
        "mass": body.mass(),
        "r_og_b": body.r_og_b().as_slice(),
        "inertia_cg": rows(&body.inertia_cg()),
        "principal_moments": body.principal_moments(),
        "m_cg": rows(&body.mass_matrix_cg()),
        "m_co": rows(&body.mass_matrix()),
        "condition": { "relative_error": relative_error },
    });
    let added = request
        .added_mass
        .as_ref()
        .map(|m| AddedMass::new(matrix(m)).map_err(|e| of_added_mass(&e)))
        .transpose()?;
    let Some(nu) = request.nu.map(Vector6::from) else {
        if request.tau.is_some() || added.is_some() {
            return Err(format!(
                "{} needs nu: \"nu\":[0,0,0,0,0,0] for a body at rest",
                if added.is_some() { "added_mass" } else { "tau" }
            )
            .into());
        }
        return Ok(answer);
    };
    let tau = request.tau.map_or_else(Vector6::zeros, Vector6::from);
    let (fluid_c, fluid_m) = added.map_or((Vector6::zeros(), Matrix6::zeros()), |a| {
        (a.coriolis(&nu), *a.matrix())
    });
    let nu_dot = match &added {
        None => body.acceleration(&nu, &tau),
        Some(added) => added.acceleration(&body, &nu, &tau),
    }
    .map_err(|e| named(&e))?;
    answer["c_nu"] = (body.coriolis(&nu) + fluid_c).as_slice().into();
    answer["nu_dot"] = nu_dot.as_slice().into();
    answer["energy"] = (body.kinetic_energy(&nu) + 0.5 * nu.dot(&(fluid_m * nu))).into();
    Ok(answer)
}

/// The body, however it was given, and the relative error of a tensor taken out of its m_co.
fn body(request: &Request) -> std::result::Result<(RigidBody, f64), Refusal> {
    let single = request.mass.is_some() || request.r_og_b.is_some() || request.inertia_cg.is_some();
    match (single, &request.bodies, &request.m_co) {
        (true, None, None) => {
            let missing = |name: &str| Refusal::from(format!("missing field `{name}`"));
            let body = Body {
                mass: request.mass.ok_or_else(|| missing("mass"))?,
                r_og_b: request.r_og_b.unwrap_or_default(),
                inertia_cg: request.inertia_cg.ok_or_else(|| missing("inertia_cg"))?,
            };
            Ok(with_condition(physical(&body).map_err(|e| named(&e))?))
        }
        (false, Some(bodies), None) => {
            let parts = bodies
                .iter()
                .zip(1..)
                .map(|(body, number)| {
                    physical(body).map_err(|e| {
                        let refusal = named(&e);
                        Refusal {
                            error: format!("body {number}: {}", refusal.error),
                            ..refusal
                        }
                    })
                })
                .collect::<std::result::Result<Vec<_>, _>>()?;
            let whole = RigidBody::combined(&parts).map_err(|e| named(&e))?;
            Ok(with_condition(whole))
        }
        (false, None, Some(m_co)) => {
            let found = RigidBody::from_mass_matrix(&matrix(m_co)).map_err(|e| named(&e))?;
            Ok((found.body, found.relative_error))
        }
        _ => Err(
            "exactly one of these is needed: mass with inertia_cg, bodies, m_co"
                .to_owned()
                .into(),
        ),
    }
}

fn physical(body: &Body) -> std::result::Result<RigidBody, InertiaError> {
    RigidBody::new(
        body.mass,
        Vector3::from(body.r_og_b),
        Matrix3::from_fn(|i, j| body.inertia_cg[i][j]),
    )
}

fn with_condition(body: RigidBody) -> (RigidBody, f64) {
    let lost = body.mass() * body.r_og_b().norm_squared() / body.principal_moments()[0];
    (body, f64::EPSILON * (1.0 + lost))
}

fn matrix(rows: &[[f64; 6]; 6]) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| rows[i][j])
}

/// Row by row; a zero is written without sign.
fn rows<const N: usize>(m: &nalgebra::SMatrix<f64, N, N>) -> Vec<Vec<f64>> {
    m.row_iter()
        .map(|row| row.iter().map(|x| x + 0.0).collect())
        .collect()
}

/// The error in words, with a name for programs.
fn named(e: &InertiaError) -> Refusal {
    let reason = match e {
        InertiaError::NotFinite { .. } => Some("not_finite"),
        InertiaError::MassNotPositive { .. } => Some("mass_not_positive"),
        InertiaError::NotSymmetric { .. } => Some("not_symmetric"),
        InertiaError::NotPositive { .. } => Some("not_positive"),
        InertiaError::TriangleInequality { .. } => Some("triangle_inequality"),
        InertiaError::NotRigidMassMatrix { .. } => Some("not_a_rigid_mass_matrix"),
        InertiaError::NotInvertible => Some("not_invertible"),
        InertiaError::NoBodies => Some("no_bodies"),
        _ => None,
    };
    Refusal {
        error: e.to_string(),
        reason,
    }
}

fn of_added_mass(e: &InertiaError) -> Refusal {
    let refusal = named(e);
    Refusal {
        error: format!("added_mass: {}", refusal.error),
        ..refusal
    }
}
