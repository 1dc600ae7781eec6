//! Text in the units of data sheets <-> [`ImuError`]. Pure.

use super::{ImuError, ImuErrorFault, PRESETS};
use crate::diagnostic::Diagnostic;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// One key of `--noise`: its data-sheet unit, and where the value lies.
#[derive(Debug)]
pub struct Term {
    /// Key as written; hyphens are as good as underscores.
    pub key: &'static str,
    /// Unit of the number.
    pub unit: &'static str,
    /// The unit in SI.
    pub si: f64,
    /// Largest number taken.
    pub most: f64,
    /// The value of this term, SI; 0 where absent.
    pub read: fn(&ImuError) -> f64,
    write: fn(&mut ImuError, f64),
}

const DEG: f64 = PI / 180.0;
const DEG_PER_H: f64 = DEG / 3600.0;
/// Standard gravity, m/s^2.
const G: f64 = 9.80665;

macro_rules! term {
    ($key:literal, $field:ident, $unit:literal, $si:expr, $most:expr) => {
        Term {
            key: $key,
            unit: $unit,
            si: $si,
            most: $most,
            read: |e| e.$field,
            write: |e, v| e.$field = v,
        }
    };
    (some $key:literal, $field:ident, $unit:literal, $si:expr, $most:expr) => {
        Term {
            key: $key,
            unit: $unit,
            si: $si,
            most: $most,
            read: |e| e.$field.unwrap_or(0.0),
            write: |e, v| e.$field = Some(v),
        }
    };
}

/// Every key, in the order of [`ImuError::text`]: the noise first.
pub static TERMS: [Term; 31] = [
    term!("arw", arw, "deg/sqrt(h)", DEG / 60.0, 1e4),
    term!(
        "bias_instability",
        bias_instability,
        "deg/h",
        DEG_PER_H,
        1e7
    ),
    term!("rrw", rrw, "deg/h/sqrt(h)", DEG_PER_H / 60.0, 1e7),
    term!("quantization", quantization, "arcsec", DEG / 3600.0, 1e6),
    term!("rate_ramp", rate_ramp, "deg/h/h", DEG_PER_H / 3600.0, 1e9),
    term!("gm_sigma", gm_sigma, "deg/h", DEG_PER_H, 1e7),
    term!("gm_tau", gm_tau, "s", 1.0, 1e9),
    term!("turn_on_bias", turn_on_bias, "deg/h", DEG_PER_H, 1e7),
    term!(
        "temperature_coefficient",
        temperature_coefficient,
        "deg/h/K",
        DEG_PER_H,
        1e6
    ),
    term!("scale_ppm", scale, "ppm", 1e-6, 2e5),
    term!("misalignment", misalignment, "deg", DEG, 20.0),
    term!("nonlinearity_ppm", nonlinearity, "ppm of range", 1e-6, 2e5),
    term!(
        "nonlinearity3_ppm",
        nonlinearity3,
        "ppm of range",
        1e-6,
        2e5
    ),
    term!(
        "g_sensitivity",
        g_sensitivity,
        "deg/h/g",
        DEG_PER_H / G,
        1e6
    ),
    term!(some "range", range, "deg/s", DEG, 1e6),
    term!("lsb", lsb, "deg/s, or deg for delta angles", DEG, 1e4),
    term!(some "bandwidth_hz", bandwidth_hz, "Hz", 1.0, 1e6),
    term!("damping", damping, "of one", 1.0, 10.0),
    Term {
        key: "flicker_tau_min",
        unit: "s",
        si: 1.0,
        most: 1e9,
        read: |e| e.flicker_tau.map_or(0.0, |t| t[0]),
        write: |e, v| e.flicker_tau = Some([v, e.flicker_tau.map_or(0.0, |t| t[1])]),
    },
    Term {
        key: "flicker_tau_max",
        unit: "s",
        si: 1.0,
        most: 1e9,
        read: |e| e.flicker_tau.map_or(0.0, |t| t[1]),
        write: |e, v| e.flicker_tau = Some([e.flicker_tau.map_or(0.0, |t| t[0]), v]),
    },
    term!("accel_noise", accel_noise, "ug/sqrt(Hz)", G * 1e-6, 1e7),
    term!("accel_bias", accel_bias, "mg", G * 1e-3, 1e5),
    term!("accel_scale_ppm", accel_scale, "ppm", 1e-6, 2e5),
    term!("accel_misalignment", accel_misalignment, "deg", DEG, 20.0),
    term!(some "accel_range", accel_range, "g", G, 1e5),
    term!("accel_lsb", accel_lsb, "mg", G * 1e-3, 1e6),
    term!(
        "truncation",
        truncation,
        "deg/s, or deg for delta angles",
        DEG,
        1e4
    ),
    term!("mag_noise", mag_noise, "uT", 1e-6, 1e6),
    term!("mag_hard_iron", mag_hard_iron, "uT", 1e-6, 1e6),
    term!("mag_soft_iron", mag_soft_iron, "%", 1e-2, 20.0),
    term!("mag_lsb", mag_lsb, "uT", 1e-6, 1e6),
];

impl ImuError {
    /// A preset's name; or terms, `arw=0.15,bias-instability=0.5`; or a preset with terms replaced,
    /// `tactical,range=200`. Units are those of [`TERMS`]. `none` = no errors.
    ///
    /// # Errors
    /// An unknown name or key (with the list), a bad number, or what [`ImuError::check`] refuses.
    pub fn parse(text: &str) -> Result<ImuError, ImuErrorFault> {
        let mut parts = text.split(',').map(str::trim).peekable();
        let mut error = ImuError::default();
        if let Some(name) = parts.next_if(|p| !p.contains('='))
            && name != "none"
        {
            error = PRESETS
                .iter()
                .find(|p| same(p.name, name))
                .ok_or_else(|| ImuErrorFault(unknown_preset(name)))?
                .error()?;
        }
        let mut seen = Vec::new();
        for part in parts {
            let (key, number) = part.split_once('=').ok_or_else(|| {
                ImuErrorFault(format!("`{part}`: expected KEY=NUMBER after a comma").into())
            })?;
            let term = TERMS
                .iter()
                .find(|t| same(t.key, key.trim()))
                .ok_or_else(|| ImuErrorFault(unknown_key(key)))?;
            if seen.contains(&term.key) {
                return Err(ImuErrorFault(format!("{} is given twice", term.key).into()));
            }
            seen.push(term.key);
            let value: f64 = number.trim().parse().map_err(|_| {
                ImuErrorFault(format!("{part}: expected a number, {}", term.unit).into())
            })?;
            (term.write)(&mut error, value * term.si);
        }
        error.check()?;
        Ok(error)
    }

    /// The terms that are not absent, as [`ImuError::parse`] takes them, 6 digits; `none` without any.
    #[must_use]
    pub fn text(&self) -> String {
        let plain = ImuError::default();
        let mut out = String::new();
        for term in &TERMS {
            let value = (term.read)(self);
            if value != (term.read)(&plain) {
                let comma = if out.is_empty() { "" } else { "," };
                let shown = significant(value / term.si);
                let _ = write!(out, "{comma}{}={shown}", term.key.replace('_', "-"));
            }
        }
        if out.is_empty() {
            "none".to_owned()
        } else {
            out
        }
    }
}

/// Six digits, without trailing zeros.
fn significant(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn same(name: &str, given: &str) -> bool {
    name.eq_ignore_ascii_case(&given.replace('-', "_"))
}

fn unknown_preset(name: &str) -> Diagnostic {
    let names: Vec<&str> = PRESETS.iter().map(|p| p.name).collect();
    Diagnostic::new(format!("`{name}`: no such preset, and not KEY=NUMBER"))
        .help(format!("presets are none, {}", names.join(", ")))
}

fn unknown_key(key: &str) -> Diagnostic {
    let keys: Vec<String> = TERMS
        .iter()
        .map(|t| format!("{} ({})", t.key, t.unit))
        .collect();
    Diagnostic::new(format!("`{key}`: no such term")).help(format!("terms are {}", keys.join(", ")))
}
