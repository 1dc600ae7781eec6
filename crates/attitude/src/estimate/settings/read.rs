//! Texts as people write them -> numbers, rotations, figures of noise. Pure.

use crate::diagnostic::Diagnostic;
use crate::estimate::noise_figures::NOISE_FIGURES;
use crate::estimate::plan::Noise;
use crate::quaternion::{Quaternion, YawPitchRoll};
use crate::setting::Setting;
use std::fmt::Display;

/// A number behind `before`.
pub(super) fn number(before: &str, text: &str) -> Option<f64> {
    text.strip_prefix(before)?.trim().parse().ok()
}

/// `N` finite numbers separated by commas.
pub(super) fn numbers<const N: usize>(list: &str) -> Option<[f64; N]> {
    let parsed: Option<Vec<f64>> = list.split(',').map(finite).collect();
    parsed?.try_into().ok()
}

/// One factor for all axes, or one of each; above 0.
pub(super) fn factors(text: &str) -> Option<[f64; 3]> {
    let all = numbers(text).or_else(|| finite(text).map(|all| [all; 3]))?;
    all.iter().all(|factor| *factor > 0.0).then_some(all)
}

fn finite(text: &str) -> Option<f64> {
    number("", text).filter(|v| v.is_finite())
}

/// Rotation of four numbers of about unit norm, normalised. A norm off by more than 1 % is a mistake, not rounding.
pub(super) fn unit<To, From>(
    what: impl Display,
    q: [f64; 4],
) -> Result<Quaternion<To, From>, Diagnostic> {
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (norm - 1.0).abs() > 0.01 {
        let [w, x, y, z] = q;
        return Err(format!(
            "{what} q={w},{x},{y},{z}: a unit quaternion w,x,y,z is needed, this one has norm {norm}"
        )
        .into());
    }
    Ok(Quaternion::assume_unit(q.map(|v| v / norm)))
}

/// Rotation of `rpy=roll,pitch,yaw` in degrees: attitude of the second frame in the first.
pub(super) fn roll_pitch_yaw<To, From>(text: &str) -> Option<Quaternion<To, From>> {
    let [roll, pitch, yaw] = numbers(text.strip_prefix("rpy=")?)?.map(f64::to_radians);
    let angles = YawPitchRoll { yaw, pitch, roll };
    Some(Quaternion::from_yaw_pitch_roll(&angles))
}

/// Description of a list of figures.
pub(super) fn figures_expected() -> String {
    let figures = NOISE_FIGURES.map(|figure| format!("{} in {}", figure.key, figure.unit));
    format!(
        "figures joined by commas ({}), each one number or three x/y/z",
        figures.join(", ")
    )
}

/// Noise of figures in the units of data sheets.
pub(super) fn figures(setting: Setting, given: &[(String, [f64; 3])]) -> Result<Noise, Diagnostic> {
    let figures = given.iter().map(|(key, axes)| (key.as_str(), *axes));
    let noise = Noise::of_figures("given", figures);
    noise.map_err(|why| why.at(setting).help(figures_expected()))
}

/// Noise of a text: `arw=..` and any other of [`NOISE_FIGURES`], in the units of data sheets; each one number, or three
/// joined by `/` for the body axes x, y, z.
pub(super) fn list_of_figures(setting: Setting, text: &str) -> Result<Noise, Diagnostic> {
    let wrong = |what: &str| {
        let classes = super::row(setting.name()).map(super::Row::expected);
        Diagnostic::new(format!("{setting} {text}: {what}")).help(classes.unwrap_or_default())
    };
    let mut given = Vec::new();
    for part in text.split(',') {
        let (key, value) = part.split_once('=').unwrap_or((part, ""));
        let key = key.trim();
        let is_figure = |key: &str| NOISE_FIGURES.iter().any(|figure| figure.key == key);
        if !is_figure(&key.replace('_', "-")) {
            return Err(wrong(&format!(
                "`{key}` is no class and no figure of noise"
            )));
        }
        let axes = by_axis(value).ok_or_else(|| {
            wrong(&format!(
                "{key}={value} is neither one number nor three x/y/z, from 0 up"
            ))
        })?;
        given.push((key, axes));
    }
    Noise::of_figures(text, given).map_err(|why| wrong(why.what()))
}

/// One number for all axes, or three joined by `/`; finite and not negative.
fn by_axis(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text
        .split('/')
        .map(|part| finite(part).filter(|v| *v >= 0.0))
        .collect();
    match numbers?.as_slice() {
        [all] => Some([*all; 3]),
        [x, y, z] => Some([*x, *y, *z]),
        _ => None,
    }
}
