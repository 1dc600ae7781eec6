//! Worlds with their bodies, and the only conversions between them. Pure.
//!
//! Apart from `axes` because here world and body change together or not at all: turning an NED attitude
//! into ENU and leaving the body FRD is the classic bug (microstrain_mips#4, vectornav#146,
//! mavros#216), so a world without its body has no function here.

use crate::diagnostic::Diagnostic;
use crate::frames::{Enu, Flu, Frd, In, Nav, Ned, Nwu, quoted};
use crate::quaternion::Quaternion;
use nalgebra::Vector3;
use std::f64::consts::FRAC_1_SQRT_2;
use std::fmt;
use std::str::FromStr;

/// The world of the output (`--world`).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum World {
    /// The attitude at the first sample: gyros alone know no other world.
    #[default]
    Start,
    /// z up, heading as at the first sample, with an FLU body: what gravity and gyros know.
    Level,
    /// x east, y north, z up, with an FLU body.
    Enu,
    /// x north, y east, z down, with an FRD body.
    Ned,
    /// x north, y west, z up, with an FLU body.
    Nwu,
}

impl World {
    /// Name of the world as a setting has it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            World::Start => "start",
            World::Level => "level",
            World::Enu => "enu",
            World::Ned => "ned",
            World::Nwu => "nwu",
        }
    }

    /// The pair of world and body axes; `None` for [`World::Start`] and [`World::Level`], which name no
    /// direction on the ground.
    #[must_use]
    pub fn convention(self) -> Option<Convention> {
        match self {
            World::Start | World::Level => None,
            World::Enu => Some(Convention::EnuFlu),
            World::Ned => Some(Convention::NedFrd),
            World::Nwu => Some(Convention::NwuFlu),
        }
    }
}

impl FromStr for World {
    type Err = ParseWorldError;

    /// # Errors
    /// [`ParseWorldError`] for anything but `enu`, `ned`, `nwu`, `level`, `start`.
    fn from_str(text: &str) -> Result<World, ParseWorldError> {
        match text.to_ascii_lowercase().as_str() {
            "enu" => Ok(World::Enu),
            "ned" => Ok(World::Ned),
            "nwu" => Ok(World::Nwu),
            "level" => Ok(World::Level),
            "start" => Ok(World::Start),
            _ => Err(ParseWorldError {
                text: quoted(text, 16),
            }),
        }
    }
}

impl fmt::Display for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A text that names no world.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ParseWorldError {
    text: String,
}

impl From<&ParseWorldError> for Diagnostic {
    fn from(error: &ParseWorldError) -> Diagnostic {
        Diagnostic::new(format!("`{}` is no world", error.text))
            .help("enu, ned, nwu, level or start")
    }
}

impl fmt::Display for ParseWorldError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for ParseWorldError {}

/// A world with the body that goes with it, as run-time labels for [`Nav`] and [`Body`](crate::frames::Body).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Convention {
    /// ROS, Foxglove, Rerun; strapd's own.
    EnuFlu,
    /// PX4, MAVLink, aviation.
    NedFrd,
    /// x-io by default.
    NwuFlu,
}

impl Convention {
    /// The same attitude said in another convention. World and body change together.
    ///
    /// # Accuracy
    /// 5e-16 rad; unchanged bits when both are the same.
    #[must_use]
    pub fn convert<N, B>(self, to: Convention, q_nb: Quaternion<N, B>) -> Quaternion<N, B> {
        if self == to {
            return q_nb;
        }
        let (world_in, body_in) = self.to_enu_flu::<N, B>();
        let (world_out, body_out) = to.to_enu_flu::<N, B>();
        (world_out.inverse() * world_in * q_nb * body_in.inverse() * body_out).normalised()
    }

    /// A body vector (rate, specific force) in the other convention's body axes: signs only, exact.
    #[must_use]
    pub fn convert_body(self, to: Convention, v_b: Vector3<f64>) -> Vector3<f64> {
        if (self == Convention::NedFrd) == (to == Convention::NedFrd) {
            v_b
        } else {
            Vector3::new(v_b.x, -v_b.y, -v_b.z)
        }
    }

    /// World to ENU and body to FLU. Frames here are run-time labels, so the tags are the caller's.
    fn to_enu_flu<N, B>(self) -> (Quaternion<N, N>, Quaternion<B, B>) {
        let (world, body) = match self {
            Convention::EnuFlu => (ONE, ONE),
            Convention::NwuFlu => ([FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2], ONE),
            Convention::NedFrd => (
                [0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0],
                [0.0, 1.0, 0.0, 0.0],
            ),
        };
        (
            Quaternion::assume_unit(world),
            Quaternion::assume_unit(body),
        )
    }
}

const ONE: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

macro_rules! attitude_conversions {
    ($($(#[$doc:meta])* $name:ident: $from:ident($n0:ident, $b0:ident) -> $to:ident($n1:ident, $b1:ident);)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $name(q: Quaternion<$n0, $b0>) -> Quaternion<$n1, $b1> {
            Quaternion::assume_unit(Convention::$from.convert(Convention::$to, q).wxyz())
        }
    )*};
}

attitude_conversions! {
    /// PX4, MAVLink -> ROS: `q(0, s, s, 0) q q(0, 1, 0, 0)` with s = sqrt(1/2).
    enu_flu_from_ned_frd: NedFrd(Ned, Frd) -> EnuFlu(Enu, Flu);
    /// ROS -> PX4, MAVLink.
    ned_frd_from_enu_flu: EnuFlu(Enu, Flu) -> NedFrd(Ned, Frd);
    /// x-io -> ROS: a quarter turn about the vertical.
    enu_flu_from_nwu_flu: NwuFlu(Nwu, Flu) -> EnuFlu(Enu, Flu);
    /// ROS -> x-io.
    nwu_flu_from_enu_flu: EnuFlu(Enu, Flu) -> NwuFlu(Nwu, Flu);
    /// PX4, MAVLink -> x-io: y and z of world and body change sign.
    nwu_flu_from_ned_frd: NedFrd(Ned, Frd) -> NwuFlu(Nwu, Flu);
    /// x-io -> PX4, MAVLink.
    ned_frd_from_nwu_flu: NwuFlu(Nwu, Flu) -> NedFrd(Ned, Frd);
}

/// A body vector from FRD to FLU: `(x, -y, -z)`, exact.
#[must_use]
pub fn flu_from_frd(v: In<Frd>) -> In<Flu> {
    In::assume(Convention::NedFrd.convert_body(Convention::EnuFlu, *v.as_vector()))
}

/// A body vector from FLU to FRD: `(x, -y, -z)`, exact.
#[must_use]
pub fn frd_from_flu(v: In<Flu>) -> In<Frd> {
    In::assume(Convention::EnuFlu.convert_body(Convention::NedFrd, *v.as_vector()))
}

/// A world vector from NED to ENU: `(y, x, -z)`, exact.
#[must_use]
pub fn enu_from_ned(v: In<Ned>) -> In<Enu> {
    let v = v.as_vector();
    In::assume(Vector3::new(v.y, v.x, -v.z))
}

/// A world vector from ENU to NED: `(y, x, -z)`, exact.
#[must_use]
pub fn ned_from_enu(v: In<Enu>) -> In<Ned> {
    let v = v.as_vector();
    In::assume(Vector3::new(v.y, v.x, -v.z))
}

/// A world vector from NWU to ENU: `(-y, x, z)`, exact.
#[must_use]
pub fn enu_from_nwu(v: In<Nwu>) -> In<Enu> {
    let v = v.as_vector();
    In::assume(Vector3::new(-v.y, v.x, v.z))
}

/// A world vector from ENU to NWU: `(y, -x, z)`, exact.
#[must_use]
pub fn nwu_from_enu(v: In<Enu>) -> In<Nwu> {
    let v = v.as_vector();
    In::assume(Vector3::new(v.y, -v.x, v.z))
}

/// Rate of the Earth relative to inertial space, rad/s.
///
/// # Source
/// WGS 84 (NIMA TR8350.2, 3rd edition, table 3.1): 7292115e-11 rad/s.
pub const EARTH_RATE: f64 = 7.292_115e-5;

/// Earth's rate w_ie at a latitude (rad, positive north), resolved in NED: `[cos L, 0, -sin L]` of
/// [`EARTH_RATE`], rad/s.
#[must_use]
pub fn earth_rate(latitude: f64) -> In<Ned> {
    let (sin, cos) = latitude.sin_cos();
    In::assume(Vector3::new(EARTH_RATE * cos, 0.0, -EARTH_RATE * sin))
}

impl Convention {
    /// [`earth_rate`] in this convention's world axes.
    #[must_use]
    pub fn earth_rate(self, latitude: f64) -> In<Nav> {
        let ned = earth_rate(latitude);
        In::assume(match self {
            Convention::NedFrd => *ned.as_vector(),
            Convention::EnuFlu => *enu_from_ned(ned).as_vector(),
            Convention::NwuFlu => *nwu_from_enu(enu_from_ned(ned)).as_vector(),
        })
    }
}
