//! Figures in the units of data sheets -> the noise of a plan. Pure.
//!
//! The same names and units as the errors that are simulated ([`ImuError`](crate::noise::sensor_error::ImuError)):
//! what is read off a data sheet, or from an Allan deviation, means one thing everywhere.

use super::Noise;
use crate::diagnostic::Diagnostic;
use std::f64::consts::PI;

const DEG: f64 = PI / 180.0;
const DEG_PER_H: f64 = DEG / 3600.0;

/// A figure of noise.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NoiseFigure {
    /// Name in a list.
    pub key: &'static str,
    /// Unit on data sheets.
    pub unit: &'static str,
    /// Size of that unit in SI.
    pub si: f64,
    /// Whether the body axes may differ in it.
    pub by_axis: bool,
}

const fn figure(key: &'static str, unit: &'static str, si: f64, by_axis: bool) -> NoiseFigure {
    NoiseFigure {
        key,
        unit,
        si,
        by_axis,
    }
}

/// Terms that a list of noise may hold. `initial` is of the initial attitude, `tilt` of one that gravity has
/// levelled, and `scale-ppm` and `misalignment` grow with the angle turned.
pub const NOISE_FIGURES: [NoiseFigure; 8] = [
    figure("arw", "deg/sqrt(h)", DEG / 60.0, true),
    figure("bias-instability", "deg/h", DEG_PER_H, true),
    figure("rrw", "deg/h/sqrt(h)", DEG_PER_H / 60.0, true),
    figure("turn-on-bias", "deg/h", DEG_PER_H, true),
    figure("initial", "deg", DEG, true),
    figure("scale-ppm", "ppm", 1e-6, false),
    figure("misalignment", "deg", DEG, false),
    figure("tilt", "deg", DEG, false),
];

impl Noise {
    /// The noise of these figures, each by its name in [`NOISE_FIGURES`] (`_` does for `-`), about the body axes, in
    /// its unit of data sheets. What is not given is none.
    ///
    /// # Errors
    /// A name that is none or is given twice, a number below 0 or not finite, three where there is one, or no `arw`.
    pub fn of_figures<'a>(
        name: &str,
        given: impl IntoIterator<Item = (&'a str, [f64; 3])>,
    ) -> Result<Noise, Diagnostic> {
        let mut found: [Option<[f64; 3]>; NOISE_FIGURES.len()] = [None; NOISE_FIGURES.len()];
        for (key, axes) in given {
            let key = key.replace('_', "-");
            let slot = found.iter_mut().zip(&NOISE_FIGURES);
            let Some((slot, figure)) = slot.into_iter().find(|(_, figure)| figure.key == key)
            else {
                return Err(format!("`{key}` is no class and no figure of noise").into());
            };
            if axes.iter().any(|v| !v.is_finite() || *v < 0.0) {
                return Err(format!("{key} is a number from 0 up, in {}", figure.unit).into());
            }
            let [x, y, z] = axes;
            if !figure.by_axis && (x != y || y != z) {
                return Err(format!("{key} is one number").into());
            }
            if slot.replace(axes.map(|v| v * figure.si)).is_some() {
                return Err(format!("{key} is given twice").into());
            }
        }
        let [
            arw,
            bias_instability,
            rrw,
            turn_on_bias,
            initial,
            scale,
            misalignment,
            tilt,
        ] = found;
        let one = |axes: Option<[f64; 3]>| axes.map_or(0.0, |[x, ..]| x);
        Ok(Noise {
            name: name.to_owned(),
            arw: arw.ok_or("arw is missing, the angle random walk in deg/sqrt(h)")?,
            bias_instability: bias_instability.unwrap_or_default(),
            rrw: rrw.unwrap_or_default(),
            turn_on_bias: turn_on_bias.unwrap_or_default(),
            initial: initial.unwrap_or_default(),
            scale: one(scale),
            misalignment: one(misalignment),
            tilt: one(tilt),
            delay: 0.0,
            sensitivity: 0.0,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::noise::sensor_error::ImuError;

    #[test]
    fn a_figure_means_what_the_same_figure_of_a_simulated_sensor_means() {
        let text =
            "arw=0.15,bias_instability=2,rrw=30,turn_on_bias=500,scale_ppm=1000,misalignment=0.05";
        let simulated = ImuError::parse(text).unwrap();
        let figures = text.split(',').map(|part| {
            let (key, value) = part.split_once('=').unwrap();
            (key, [value.parse::<f64>().unwrap(); 3])
        });
        let noise = Noise::of_figures("list", figures).unwrap();
        assert_eq!(noise.arw, [simulated.arw; 3]);
        assert_eq!(noise.bias_instability, [simulated.bias_instability; 3]);
        assert_eq!(noise.rrw, [simulated.rrw; 3]);
        assert_eq!(noise.turn_on_bias, [simulated.turn_on_bias; 3]);
        assert_eq!(noise.scale, simulated.scale);
        assert_eq!(noise.misalignment, simulated.misalignment);
        // A data sheet of 0.15 deg/sqrt(h): 0.15 degrees after an hour.
        assert!((noise.arw[0] * 60.0 - 0.15f64.to_radians()).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_figure_is_refused() {
        for (given, said) in [
            (&[("rrw", [1.0; 3])][..], "arw is missing"),
            (&[("arw", [-1.0; 3])], "from 0 up, in deg/sqrt(h)"),
            (&[("arw", [f64::NAN; 3])], "from 0 up"),
            (&[("arw", [1.0; 3]), ("arw", [1.0; 3])], "given twice"),
            (&[("arw", [1.0; 3]), ("scale", [1.0; 3])], "`scale` is no"),
            (
                &[("arw", [1.0; 3]), ("tilt", [1.0, 1.0, 2.0])],
                "one number",
            ),
        ] {
            let refused = Noise::of_figures("list", given.iter().copied()).unwrap_err();
            assert!(refused.what().contains(said), "{given:?}: {refused}");
        }
    }
}
