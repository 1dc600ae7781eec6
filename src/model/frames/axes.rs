//! Axis labels -> rotations, and the only conversions between world conventions. Pure.
//!
//! Beside `frames` because labels are chosen at run time (`--body frd --world ned`) and types at
//! compile time. World and body change together or not at all: turning an NED attitude into ENU
//! and leaving the body FRD is the classic bug (microstrain_mips#4, vectornav#146, mavros#216),
//! so a world without its body has no function here.

use super::{Body, Dcm, Enu, Flu, Frd, In, Ned, Nwu, Sensor};
use crate::model::attitude::Quaternion;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::FRAC_1_SQRT_2;
use std::fmt;
use std::str::FromStr;

/// A relabelling of axes: each output axis is one input axis, perhaps negated.
///
/// # Convention
/// gyroflow's spelling: letter i names the **input** axis that output axis i takes, lower case
/// negates. `YxZ`: x' = y, y' = -x, z' = z (gyroflow#144).
///
/// A map may mirror (`XYz`): loggers in the field do write mirrored axes (the default of
/// esp-gyrologger is `xyz`) and [`AxisMap::apply`] relabels numbers as gyroflow does. But a mirror
/// is no rotation and no way to mount a sensor, so [`AxisMap::to_dcm`] and [`BodyAxes`] refuse it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct AxisMap([Take; 3]);

#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
struct Take {
    axis: Axis,
    negated: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
enum Axis {
    X,
    Y,
    Z,
}

impl AxisMap {
    /// `XYZ`: every axis is itself.
    pub const IDENTITY: AxisMap =
        AxisMap([Take::new(Axis::X), Take::new(Axis::Y), Take::new(Axis::Z)]);

    /// Relabels three components. No arithmetic but signs: exact.
    #[must_use]
    pub fn apply(self, v: [f64; 3]) -> [f64; 3] {
        self.0.map(|take| {
            let [x, y, z] = v;
            let component = match take.axis {
                Axis::X => x,
                Axis::Y => y,
                Axis::Z => z,
            };
            if take.negated { -component } else { component }
        })
    }

    /// Whether it turns right-handed axes into left-handed ones.
    #[must_use]
    pub fn mirrors(self) -> bool {
        self.matrix().determinant() < 0.0
    }

    /// The map as a rotation; the caller says which frames it joins. `None` when it mirrors.
    #[must_use]
    pub fn to_dcm<To, From>(self) -> Option<Dcm<To, From>> {
        (!self.mirrors()).then(|| Dcm::assume(self.matrix()))
    }

    fn matrix(self) -> Matrix3<f64> {
        let column = |unit: [f64; 3]| Vector3::from(self.apply(unit));
        Matrix3::from_columns(&[
            column([1.0, 0.0, 0.0]),
            column([0.0, 1.0, 0.0]),
            column([0.0, 0.0, 1.0]),
        ])
        // Negating 0 leaves -0 behind; adding 0 makes it +0 and changes nothing else.
        .add_scalar(0.0)
    }
}

impl Take {
    const fn new(axis: Axis) -> Take {
        Take {
            axis,
            negated: false,
        }
    }

    fn from_letter(letter: char) -> Option<Take> {
        let axis = match letter.to_ascii_uppercase() {
            'X' => Axis::X,
            'Y' => Axis::Y,
            'Z' => Axis::Z,
            _ => return None,
        };
        Some(Take {
            axis,
            negated: letter.is_ascii_lowercase(),
        })
    }

    fn letter(self) -> char {
        let upper = match self.axis {
            Axis::X => 'X',
            Axis::Y => 'Y',
            Axis::Z => 'Z',
        };
        if self.negated {
            upper.to_ascii_lowercase()
        } else {
            upper
        }
    }
}

impl FromStr for AxisMap {
    type Err = AxisMapError;

    /// # Errors
    /// [`AxisMapError::NotAPermutation`] unless the text is x, y and z in some order, each once.
    fn from_str(text: &str) -> Result<AxisMap, AxisMapError> {
        let refused = || AxisMapError::NotAPermutation { text: quoted(text) };
        let mut letters = text.chars().map(Take::from_letter);
        let mut next = || letters.next().flatten().ok_or_else(refused);
        let map = [next()?, next()?, next()?];
        let [a, b, c] = map.map(|take| take.axis);
        if letters.next().is_some() || a == b || b == c || a == c {
            return Err(refused());
        }
        Ok(AxisMap(map))
    }
}

impl fmt::Display for AxisMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|t| write!(f, "{}", t.letter()))
    }
}

/// Why a text is no axis map, or no rotation.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum AxisMapError {
    /// Not the letters x, y, z, each once.
    NotAPermutation {
        /// What was given, shortened and escaped.
        text: String,
    },
    /// A signed permutation with determinant -1.
    Mirrors {
        /// What was given.
        map: AxisMap,
    },
}

impl fmt::Display for AxisMapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            AxisMapError::NotAPermutation { text } => write!(
                f,
                "`{text}` is not an axis map\n  help: three letters, each axis once, lower case \
                 negates: `YxZ` means x' = y, y' = -x, z' = z"
            ),
            AxisMapError::Mirrors { map } => {
                let AxisMap([a, b, c]) = *map;
                let flipped = AxisMap([
                    a,
                    b,
                    Take {
                        negated: !c.negated,
                        ..c
                    },
                ]);
                write!(
                    f,
                    "axis map `{map}` mirrors: it turns right-handed axes into left-handed ones, \
                     and no mounting does that\n  help: change the case of one letter, as in `{flipped}`"
                )
            }
        }
    }
}

impl std::error::Error for AxisMapError {}

/// Which axes the gyro's numbers are in (`--body`).
///
/// # Convention
/// strapd integrates in [`Flu`] body axes; this is the rotation from the numbers to those.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum BodyAxes {
    /// x forward, y left, z up: taken as they are.
    #[default]
    Flu,
    /// x forward, y right, z down.
    Frd,
    /// A relabelling that gives FLU; never one that mirrors when it comes from [`FromStr`].
    Map(AxisMap),
}

impl BodyAxes {
    /// C_bs from the recorded axes to FLU body axes. `None` for a map that mirrors.
    #[must_use]
    pub fn c_bs(self) -> Option<Dcm<Body, Sensor>> {
        match self {
            BodyAxes::Flu => Some(Dcm::identity()),
            BodyAxes::Frd => Some(Dcm::assume(half_turn_about_x())),
            BodyAxes::Map(map) => map.to_dcm(),
        }
    }
}

impl FromStr for BodyAxes {
    type Err = AxisMapError;

    /// # Errors
    /// [`AxisMapError`] for anything but `flu`, `frd` or a right-handed axis map.
    fn from_str(text: &str) -> Result<BodyAxes, AxisMapError> {
        if text.eq_ignore_ascii_case("flu") {
            return Ok(BodyAxes::Flu);
        }
        if text.eq_ignore_ascii_case("frd") {
            return Ok(BodyAxes::Frd);
        }
        let map: AxisMap = text.parse()?;
        if map.mirrors() {
            return Err(AxisMapError::Mirrors { map });
        }
        Ok(BodyAxes::Map(map))
    }
}

impl fmt::Display for BodyAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BodyAxes::Flu => f.write_str("flu"),
            BodyAxes::Frd => f.write_str("frd"),
            BodyAxes::Map(map) => map.fmt(f),
        }
    }
}

/// The world of the output (`--world`).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum World {
    /// The attitude at the first sample: gyros alone know no other world.
    #[default]
    Start,
    /// x east, y north, z up, with an FLU body.
    Enu,
    /// x north, y east, z down, with an FRD body.
    Ned,
    /// x north, y west, z up, with an FLU body.
    Nwu,
}

impl World {
    /// The pair of world and body axes; `None` for [`World::Start`], which names no directions.
    #[must_use]
    pub fn convention(self) -> Option<Convention> {
        match self {
            World::Start => None,
            World::Enu => Some(Convention::EnuFlu),
            World::Ned => Some(Convention::NedFrd),
            World::Nwu => Some(Convention::NwuFlu),
        }
    }
}

impl FromStr for World {
    type Err = ParseLabelError;

    /// # Errors
    /// [`ParseLabelError`] for anything but `enu`, `ned`, `nwu`, `start`.
    fn from_str(text: &str) -> Result<World, ParseLabelError> {
        match text.to_ascii_lowercase().as_str() {
            "enu" => Ok(World::Enu),
            "ned" => Ok(World::Ned),
            "nwu" => Ok(World::Nwu),
            "start" => Ok(World::Start),
            _ => Err(ParseLabelError { text: quoted(text) }),
        }
    }
}

impl fmt::Display for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            World::Start => "start",
            World::Enu => "enu",
            World::Ned => "ned",
            World::Nwu => "nwu",
        })
    }
}

/// A text that names no world.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ParseLabelError {
    text: String,
}

impl fmt::Display for ParseLabelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` is no world\n  help: enu, ned, nwu or start",
            self.text
        )
    }
}

impl std::error::Error for ParseLabelError {}

/// A world with the body that goes with it, as run-time labels for [`Nav`](super::Nav) and [`Body`].
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

fn half_turn_about_x() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

/// Outside text, fit for a message: short, and without control characters.
fn quoted(text: &str) -> String {
    let mut quoted: String = text.chars().take(16).flat_map(char::escape_debug).collect();
    if text.chars().nth(16).is_some() {
        quoted.push_str("...");
    }
    quoted
}
