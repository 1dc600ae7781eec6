//! The flags that say which top, and how it starts: shared by `simulate top` and `model top`. Pure.

use crate::cli::known_words;
use crate::config::numbers;
use crate::error::{Error, Result};
use clap::Args;
use std::f64::consts::TAU;
use strapd_bodies::top::method_errors::body;
use strapd_bodies::top::{Case, EulerAngles, EulerState, SymmetricTop};

/// Top, and how it starts. The defaults are the source document's.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Top")]
pub struct TopFlags {
    /// cusped, wavy, looping, steady-slow, steady-fast, sleeping or falling [default: cusped]
    #[arg(long, value_name = "CASE", value_parser = known_words::top_case(), hide_possible_values = true, conflicts_with_all = ["euler", "euler_rates"])]
    pub case: Option<Case>,
    /// Turns a second about the axis of symmetry (the body's z rate) [default: 20]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub spin_hz: Option<f64>,
    /// Angle of the axis from the vertical at the start, degrees [default: 54.57]
    #[arg(
        long,
        value_name = "DEG",
        allow_negative_numbers = true,
        conflicts_with = "euler"
    )]
    pub tilt_deg: Option<f64>,
    /// Any start: precession,nutation,spin angles in degrees, turned about z, x', z''
    #[arg(long, value_name = "DEG,DEG,DEG", allow_hyphen_values = true)]
    pub euler: Option<String>,
    /// Rates of the start, degrees a second; instead of --spin-hz
    #[arg(
        long,
        value_name = "DPS,DPS,DPS",
        allow_hyphen_values = true,
        requires = "euler",
        conflicts_with = "spin_hz"
    )]
    pub euler_rates: Option<String>,
    /// Mass, kg [default: 1]
    #[arg(long, value_name = "KG", allow_negative_numbers = true)]
    pub mass: Option<f64>,
    /// Pivot to centre of gravity, m [default: 0.04]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub arm: Option<f64>,
    /// Moments of inertia about the pivot, across and along the axis, kg m^2 [default: 0.002,0.0008]
    #[arg(long, value_name = "ACROSS,ALONG", allow_hyphen_values = true)]
    pub inertia: Option<String>,
    /// Gravity, m/s^2, downwards [default: 9.8]
    #[arg(long, value_name = "M_S2", allow_negative_numbers = true)]
    pub gravity: Option<f64>,
}

impl TopFlags {
    /// The top.
    ///
    /// # Errors
    /// [`Error::Usage`] for a body that cannot be.
    pub(crate) fn body(&self) -> Result<SymmetricTop> {
        let seed = SymmetricTop::published();
        let [across, along] = match &self.inertia {
            Some(list) => numbers("--inertia", list)?,
            None => [seed.transverse(), seed.axial()],
        };
        body(
            self.mass.unwrap_or(seed.mass()),
            self.arm.unwrap_or(seed.arm()),
            [across, along],
            self.gravity.unwrap_or(seed.gravity()),
        )
        .map_err(|e| Error::usage(format!("top: {e}")))
    }

    /// Whether no flag says anything.
    pub(crate) fn is_bare(&self) -> bool {
        self.case.is_none()
            && self.tilt_deg.is_none()
            && self.euler.is_none()
            && self.spin_hz.is_none()
            && self.mass.is_none()
            && self.arm.is_none()
            && self.inertia.is_none()
            && self.gravity.is_none()
    }

    fn spin_hz(&self) -> f64 {
        self.spin_hz.unwrap_or(20.0)
    }

    /// Start of the top.
    ///
    /// # Errors
    /// [`Error::Usage`] for a start the case does not have.
    pub(crate) fn start(&self, top: &SymmetricTop) -> Result<EulerState> {
        let w3 = self.spin_hz() * TAU;
        let Some(euler) = &self.euler else {
            let tilt = self.tilt_deg.map_or(Case::SEED_TILT, f64::to_radians);
            let case = self.case.unwrap_or(Case::Cusped);
            return case
                .start(top, tilt, w3)
                .map_err(|e| Error::usage(format!("top, case {}: {e}", case.name())));
        };
        let degrees = |flag, list: &str| numbers::<3>(flag, list).map(|v| v.map(f64::to_radians));
        let [precession, nutation, spin] = degrees("--euler", euler)?;
        let mut state = EulerState {
            angles: EulerAngles {
                precession,
                nutation,
                spin,
            },
            w3,
            ..EulerState::default()
        };
        if let Some(rates) = &self.euler_rates {
            let [precession_rate, nutation_rate, spin_rate] = degrees("--euler-rates", rates)?;
            state.precession_rate = precession_rate;
            state.nutation_rate = nutation_rate;
            state.w3 = precession_rate * nutation.cos() + spin_rate;
        }
        Ok(state)
    }

    /// Parameters that were asked for, by name.
    pub(crate) fn parameters(&self) -> Vec<(&'static str, String)> {
        let seed = SymmetricTop::published();
        let inertia = || format!("{},{}", seed.transverse(), seed.axial());
        let mut list = vec![
            ("mass_kg", self.mass.unwrap_or(seed.mass()).to_string()),
            ("arm_m", self.arm.unwrap_or(seed.arm()).to_string()),
            (
                "inertia_across_along_kg_m2",
                self.inertia.clone().unwrap_or_else(inertia),
            ),
        ];
        match &self.euler {
            None => {
                let case = self.case.unwrap_or(Case::Cusped);
                list.push(("case", case.name().to_owned()));
                if case != Case::Sleeping {
                    list.push(("tilt_deg", self.tilt_deg.unwrap_or(54.57).to_string()));
                }
            }
            Some(euler) => list.push(("euler_deg", euler.clone())),
        }
        match &self.euler_rates {
            None => list.push(("spin_hz", self.spin_hz().to_string())),
            Some(rates) => list.push(("euler_rates_deg_s", rates.clone())),
        }
        list
    }

    /// Notes on what a start leads to that may not have been meant.
    pub(crate) fn notes(top: &SymmetricTop, start: &EulerState) -> Vec<String> {
        let mut notes = Vec::new();
        let spin_hz = start.w3.abs() / TAU;
        let upright = start.angles.nutation.sin().abs() < 1e-6 && start.angles.nutation.cos() > 0.0;
        if upright {
            let threshold = top.sleeping_threshold();
            if start.w3.abs() < threshold {
                notes.push(format!(
                    "spin {spin_hz:.3} Hz is below the {:.3} Hz at which an upright top sleeps: the least push tips it over",
                    threshold / TAU
                ));
            }
        } else {
            let threshold = top.spin_threshold_hz(start.angles.nutation);
            if spin_hz < threshold {
                notes.push(format!(
                    "spin {spin_hz:.3} Hz is below the threshold of {threshold:.3} Hz (sqrt(M g arm sin(tilt) / (2 pi I3))): it tips over rather than precess"
                ));
            }
        }
        notes
    }
}
