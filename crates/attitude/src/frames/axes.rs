//! Axis labels of the input -> rotations. Pure.
//!
//! Beside `frames` because these labels are chosen at run time (`--body frd`) and types at compile time.

use super::{Body, Dcm, Sensor, quoted};
use crate::diagnostic::Diagnostic;
use nalgebra::{Matrix3, Vector3};
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

impl Default for AxisMap {
    fn default() -> AxisMap {
        AxisMap::IDENTITY
    }
}

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

    /// `Xyz`: half a turn about x, which takes FRD to FLU and back.
    const HALF_TURN_ABOUT_X: AxisMap = AxisMap([
        Take::new(Axis::X),
        Take::new(Axis::Y).negated(),
        Take::new(Axis::Z).negated(),
    ]);

    /// The map of a signed permutation matrix; `None` of any other.
    pub(crate) fn from_matrix(matrix: &Matrix3<f64>) -> Option<AxisMap> {
        let take = |row: usize| {
            let entries = [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate();
            entries
                .map(|(column, axis)| (axis, matrix[(row, column)]))
                .find(|(_, entry)| *entry != 0.0)
                .map(|(axis, entry)| Take {
                    axis,
                    negated: entry < 0.0,
                })
        };
        let map = AxisMap([take(0)?, take(1)?, take(2)?]);
        (map.matrix() == *matrix).then_some(map)
    }

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

    /// The map that relabels as `first` does, and then as this one.
    #[must_use]
    pub fn after(self, first: AxisMap) -> AxisMap {
        AxisMap(self.0.map(|take| {
            let by = match take.axis {
                Axis::X => first.0[0],
                Axis::Y => first.0[1],
                Axis::Z => first.0[2],
            };
            match take.negated {
                true => by.negated(),
                false => by,
            }
        }))
    }

    /// The map that undoes this one.
    #[must_use]
    pub fn inverse(self) -> AxisMap {
        // The transpose of a signed permutation is one.
        AxisMap::from_matrix(&self.matrix().transpose()).unwrap_or(self)
    }

    /// The map whose axes all point the other way.
    #[must_use]
    pub fn reversed(self) -> AxisMap {
        AxisMap(self.0.map(Take::negated))
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

    /// Signed permutation matrix, for kernels.
    pub fn matrix(self) -> Matrix3<f64> {
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

    const fn negated(self) -> Take {
        Take {
            negated: !self.negated,
            ..self
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
        let refused = || AxisMapError::NotAPermutation {
            text: quoted(text, 16),
        };
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
        /// Text as given, shortened and escaped.
        text: String,
    },
    /// A signed permutation with determinant -1.
    Mirrors {
        /// Map as given.
        map: AxisMap,
    },
}

impl From<&AxisMapError> for Diagnostic {
    fn from(error: &AxisMapError) -> Diagnostic {
        match error {
            AxisMapError::NotAPermutation { text } => {
                Diagnostic::new(format!("`{text}` is not an axis map")).help(
                    "three letters, each axis once, lower case negates: `YxZ` means x' = y, y' = -x, z' = z",
                )
            }
            AxisMapError::Mirrors { map } => {
                let AxisMap([a, b, c]) = *map;
                let flipped = AxisMap([a, b, c.negated()]);
                Diagnostic::new(format!(
                    "axis map `{map}` mirrors: it turns right-handed axes into left-handed ones, and no mounting does that"
                ))
                .help(format!("change the case of one letter, as in `{flipped}`"))
            }
        }
    }
}

impl fmt::Display for AxisMapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for AxisMapError {}

/// Axes of the gyro's numbers (`--body`).
///
/// # Convention
/// strapd integrates in [`Flu`](super::Flu) body axes; this is the rotation from the numbers to those.
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
    /// The relabelling that takes the recorded axes to FLU body axes.
    #[must_use]
    pub fn map(self) -> AxisMap {
        match self {
            BodyAxes::Flu => AxisMap::IDENTITY,
            BodyAxes::Frd => AxisMap::HALF_TURN_ABOUT_X,
            BodyAxes::Map(map) => map,
        }
    }

    /// The same as a rotation, C_bs. `None` for a map that mirrors.
    #[must_use]
    pub fn c_bs(self) -> Option<Dcm<Body, Sensor>> {
        self.map().to_dcm()
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
