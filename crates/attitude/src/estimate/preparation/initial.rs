//! First samples and rests -> the attitude of the first sample, and the Earth at a fixed site. Pure.

use super::super::aiding::Aiding;
use super::super::meaning::Meaning;
use super::super::plan::{EstimationSettings, Initial};
use crate::condition::stillness::{self, Limits, NoRest, Rests};
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, In, Nav};
use crate::quaternion::{Quaternion, YawPitchRoll};
use crate::record::RawSample;
use crate::setting::{AID, DECLINATION, EARTH_RATE, GYRO_UNIT, INIT};
use crate::worlds::{self, Convention, World};
use nalgebra::Vector3;

/// Decides the attitude of the first sample, its origin in words, and the world; `gathered` are the first samples.
pub(in crate::estimate) fn decide_initial(
    (plan, aiding): (&EstimationSettings, Option<&Aiding>),
    resolved: &Meaning,
    gathered: &[RawSample],
    rests: &Rests,
    warnings: &mut Vec<Diagnostic>,
) -> Result<(Quaternion<Nav, Body>, String, World), Diagnostic> {
    // What the user gives is in the convention of the world asked for.
    let asked = plan.world.convention().unwrap_or(Convention::EnuFlu);
    let inside = |q: Quaternion<Nav, Body>| asked.convert(Convention::EnuFlu, q);
    let has_field = aiding.is_some_and(|aiding| aiding.settings.has_field);
    // Gravity gives the vertical, whatever it starts from, and a field north.
    let world = match (aiding, plan.world) {
        (Some(_), World::Start) if has_field => World::Enu,
        (Some(_), World::Start) => World::Level,
        (_, asked) => asked,
    };
    match plan.initial {
        Initial::Identity | Initial::Gravity if has_field => {
            if plan.declination == 0.0 {
                warnings.push(
                    format!(
                        "{world}: north is magnetic north; {DECLINATION} DEG makes it true north"
                    )
                    .into(),
                );
            }
            Ok((
                Quaternion::identity(),
                "level from the first specific force, north by the field".to_owned(),
                world,
            ))
        }
        Initial::Identity if aiding.is_some() => {
            if world != World::Level {
                warnings.push(format!(
                    "the heading at the first sample was taken as 0 in {world}: gravity does not tell it; {INIT} first-orientation, q=.. or rpy=.. gives a real one"
                ).into());
            }
            Ok((
                inside(Quaternion::identity()),
                "level from the first specific force, heading 0".to_owned(),
                world,
            ))
        }
        Initial::Identity => {
            if plan.world != World::Start {
                warnings.push(format!(
                    "the initial attitude was taken as identity in {}: {INIT} gravity, first-orientation, q=.. or rpy=.. gives a real one",
                    plan.world
                ).into());
            }
            Ok((
                inside(Quaternion::identity()),
                "identity".to_owned(),
                plan.world,
            ))
        }
        Initial::Given(q_nb) => Ok((inside(q_nb), "as given".to_owned(), world)),
        Initial::Gravity => {
            let level =
                stillness::accel_at_start(rests, &Limits::default()).map_err(|e| not_level(&e))?;
            let level = stillness::level(&level).ok_or(format!(
                "{INIT} gravity: the accelerometer reads zero at rest"
            ))?;
            // Heading is unknown: zero in the convention that is shown.
            let shown = Convention::EnuFlu.convert(asked, level);
            let angles = shown.yaw_pitch_roll();
            let q = Quaternion::from_yaw_pitch_roll(&YawPitchRoll { yaw: 0.0, ..angles });
            Ok((inside(q), "level from gravity, heading 0".to_owned(), world))
        }
        Initial::FirstOrientation => {
            let found = gathered
                .iter()
                .filter_map(|s| s.orientation)
                .find_map(|wxyz| resolved.recorded_attitude(wxyz));
            let q = found.ok_or_else(|| {
                Diagnostic::new(format!(
                    "{INIT} first-orientation: the first samples carry no orientation"
                ))
                .help(format!(
                    "{INIT} gravity, identity, q=w,x,y,z or rpy=roll,pitch,yaw"
                ))
            })?;
            let world = match (plan.world, resolved.recorded) {
                (World::Start | World::Level, Convention::NedFrd) => World::Ned,
                (World::Start | World::Level, _) => World::Enu,
                (asked, _) => asked,
            };
            Ok((q, "first recorded orientation".to_owned(), world))
        }
    }
}

/// The Earth at a fixed site.
#[derive(Clone, Copy, Debug)]
pub(super) struct Earth {
    latitude: f64,
    /// Rate of the Earth in ENU, in which everything is computed.
    pub(super) w_ie: In<Nav>,
}

impl Earth {
    pub(super) fn at(latitude: f64) -> Earth {
        Earth {
            latitude,
            w_ie: Convention::EnuFlu.earth_rate(latitude),
        }
    }

    /// C_nb^T w_ie: what a gyro at rest in this attitude reads of it, rad/s.
    pub(super) fn felt_by(self, q_nb: &Quaternion<Nav, Body>) -> Vector3<f64> {
        *(q_nb.to_dcm().transpose() * self.w_ie).as_vector()
    }

    /// Warning that nobody stated where the body heads.
    pub(super) fn heading_warning(self, initial: Initial) -> Option<Diagnostic> {
        let why = match initial {
            Initial::Gravity => format!("{INIT} gravity knows no heading, 0 was taken"),
            Initial::Identity => format!("{INIT} identity has heading 0"),
            Initial::FirstOrientation | Initial::Given(_) => return None,
        };
        let deg_per_h = |w: f64| w.to_degrees() * 3600.0;
        let level = deg_per_h(worlds::EARTH_RATE * self.latitude.cos().abs());
        Some(
            Diagnostic::new(format!(
                "{EARTH_RATE}: {why}: a heading off by 10 degrees leaves {:.1} deg/h of the Earth's rotation, any other at most {:.1} (where nothing taken out leaves {:.1})",
                2.0 * level * 5_f64.to_radians().sin(),
                2.0 * level,
                deg_per_h(worlds::EARTH_RATE)
            ))
            .help(format!(
                "{INIT} first-orientation, q=w,x,y,z or rpy=roll,pitch,yaw states it"
            ))
        )
    }
}

/// Why `--init gravity` cannot be. The reasons are those of a bias, the ways out are not.
fn not_level(why: &NoRest) -> Diagnostic {
    let said = Diagnostic::from(why).at(format_args!("{INIT} gravity"));
    match why {
        NoRest::Moving { .. } | NoRest::Disagree { .. } => {
            said.help(format!("without {INIT} a specific force levels it on the way ({AID} gravity); {INIT} first-orientation takes a recorded one, {INIT} identity starts unlevelled, {INIT} rpy=roll,pitch,yaw (degrees) as you say; if the rates look too large, {GYRO_UNIT} deg"))
        }
        NoRest::NotAtStart { .. } | NoRest::NoAccel => said,
    }
}
