//! Noise of a gyro as numbers. Pure.

use std::fmt;

/// Noise of the gyro, one standard deviation, SI, by body axis.
///
/// `w_measured = (1 + G) w_true + b + n`: white noise n of density [`arw`](Self::arw), a bias b that begins
/// with [`bias`](Self::bias) and is driven by white noise of density [`rrw`](Self::rrw), and a matrix G that does
/// not change: [`scale`](Self::scale) on its diagonal, [`misalignment`](Self::misalignment) beside it.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Noise {
    /// Uncertainty of the initial attitude, rad, about the body axes of that moment.
    pub initial: [f64; 3],
    /// Angle random walk N, rad/sqrt(s).
    pub arw: [f64; 3],
    /// Uncertainty of the bias that remains after correction, rad/s: turn-on bias.
    pub bias: [f64; 3],
    /// Rate random walk K, rad/s/sqrt(s).
    pub rrw: [f64; 3],
    /// Error of each scale factor, as a share: what grows with the angle turned.
    pub scale: f64,
    /// Angle by which each axis is off towards each other, rad.
    pub misalignment: f64,
    /// Time constant of the bias, s: `db/dt = -b/tau + K n`, a Gauss-Markov process of standard deviation
    /// `K sqrt(tau/2)` in the end. `None`: the bias is a random walk.
    pub bias_tau: Option<f64>,
}

impl Noise {
    /// The same white noise and turn-on bias about all axes, nothing else.
    #[must_use]
    pub fn isotropic(arw: f64, bias: f64) -> Noise {
        Noise {
            arw: [arw; 3],
            bias: [bias; 3],
            ..Noise::default()
        }
    }

    /// The name and value of a number that cannot be, if any.
    pub(crate) fn fault(&self) -> Option<(&'static str, f64)> {
        let tau = self.bias_tau.unwrap_or(1.0);
        if tau.is_nan() || tau <= 0.0 {
            return Some(("bias tau", tau));
        }
        [
            ("scale", [self.scale; 3]),
            ("misalignment", [self.misalignment; 3]),
            ("initial", self.initial),
            ("arw", self.arw),
            ("bias", self.bias),
            ("rrw", self.rrw),
        ]
        .into_iter()
        .flat_map(|(name, axes)| axes.map(|value| (name, value)))
        .find(|(_, value)| !(0.0..1e6).contains(value))
    }

    /// Whether some axis differs from the others.
    pub(super) fn differs(axes: [f64; 3]) -> bool {
        let [x, y, z] = axes;
        x != y || y != z
    }
}

impl fmt::Display for Noise {
    /// Form that `--noise` takes, in SI: three numbers joined by `/` where the axes differ.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axes = |[x, y, z]: [f64; 3]| {
            if Noise::differs([x, y, z]) {
                format!("{x:e}/{y:e}/{z:e}")
            } else {
                format!("{x:e}")
            }
        };
        write!(
            f,
            "arw={},bias={},rrw={},initial={}",
            axes(self.arw),
            axes(self.bias),
            axes(self.rrw),
            axes(self.initial)
        )?;
        for (name, value) in [("scale", self.scale), ("misalignment", self.misalignment)] {
            if value != 0.0 {
                write!(f, ",{name}={value:e}")?;
            }
        }
        Ok(())
    }
}
