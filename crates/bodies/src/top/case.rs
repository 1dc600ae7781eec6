//! The name of a motion -> the start that leads to it. Pure.

use super::{EulerAngles, EulerState, SymmetricTop, TopError};

/// The motions a top is known by.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Case {
    /// Let go at rest but for its spin: the axis falls, and its path has cusps.
    Cusped,
    /// Pushed with half the slow precession: the path waves and never turns back.
    Wavy,
    /// Pushed backwards with the slow precession: the path makes loops.
    Looping,
    /// Slow steady precession, no nutation.
    SteadySlow,
    /// Fast steady precession, nearly that of a free top.
    SteadyFast,
    /// Upright. Stays so above [`SymmetricTop::sleeping_threshold`].
    Sleeping,
    /// Spin a tenth of the threshold of [`SymmetricTop::spin_threshold_hz`] at most: tips over.
    Falling,
}

impl Case {
    /// All seven.
    pub const ALL: [Self; 7] = [
        Self::Cusped,
        Self::Wavy,
        Self::Looping,
        Self::SteadySlow,
        Self::SteadyFast,
        Self::Sleeping,
        Self::Falling,
    ];

    /// The source document's tilt, rad.
    pub const SEED_TILT: f64 = 54.57 * std::f64::consts::PI / 180.0;
    /// The source document's spin, 20 turns a second, rad/s.
    pub const SEED_W3: f64 = 20.0 * std::f64::consts::TAU;

    /// The name at the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cusped => "cusped",
            Self::Wavy => "wavy",
            Self::Looping => "looping",
            Self::SteadySlow => "steady-slow",
            Self::SteadyFast => "steady-fast",
            Self::Sleeping => "sleeping",
            Self::Falling => "falling",
        }
    }

    /// Finds a case by its name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }

    /// The start at `tilt` rad from the vertical with body rate `w3` rad/s about the axis.
    ///
    /// # Errors
    /// [`TopError::OutOfRange`] for numbers that are not; [`TopError::NoSteadyPrecession`] where the
    /// case is defined by a precession the spin cannot hold.
    pub fn start(self, top: &SymmetricTop, tilt: f64, w3: f64) -> Result<EulerState, TopError> {
        for (what, value) in [("tilt", tilt), ("spin", w3)] {
            if !value.is_finite() {
                return Err(TopError::OutOfRange { what, value });
            }
        }
        let slow = || top.steady_precession(tilt, w3).map(|(slow, _)| slow);
        let mut state = EulerState {
            angles: EulerAngles {
                nutation: tilt,
                ..EulerAngles::default()
            },
            w3,
            ..EulerState::default()
        };
        match self {
            Self::Cusped => {}
            Self::Wavy => state.precession_rate = 0.5 * slow()?,
            Self::Looping => state.precession_rate = -slow()?,
            Self::SteadySlow => state.precession_rate = slow()?,
            Self::SteadyFast => {
                let (_, fast) = top.steady_precession(tilt, w3)?;
                // At 90 degrees the fast root has gone to infinity; rates a gyro cannot read are
                // no motion to simulate.
                let readable = fast.abs() <= 1e4;
                if !readable {
                    return Err(TopError::OutOfRange {
                        what: "fast precession (rad/s)",
                        value: fast,
                    });
                }
                state.precession_rate = fast;
            }
            Self::Sleeping => state.angles.nutation = 0.0,
            Self::Falling => {
                let most = 0.1 * std::f64::consts::TAU * top.spin_threshold_hz(tilt);
                state.w3 = w3.clamp(-most, most);
            }
        }
        Ok(state)
    }
}
