//! Time -> joints: sinusoids, rests joined by smooth legs, knots. Pure.

use super::error::bounded;
use super::joints::{JOINTS, TableJoints, TableMotion};
use super::limits::Limits;
use super::timing::slow_down;
use super::{Arm, ArmError};
use crate::rest_to_rest::{PEAK, rest_to_rest};

mod knots;

/// `c + A sin(w t + p)` with its derivatives.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Sinusoid {
    /// c
    pub centre: f64,
    /// A
    pub amplitude: f64,
    /// w, rad/s
    pub angular_frequency: f64,
    /// p, rad
    pub phase: f64,
}

impl Sinusoid {
    /// Value, first and second derivative at `secs`.
    #[must_use]
    pub fn at(&self, secs: f64) -> [f64; 3] {
        let w = self.angular_frequency;
        let (s, c) = (w * secs + self.phase).sin_cos();
        let a = self.amplitude;
        [self.centre + a * s, a * w * c, -a * w * w * s]
    }

    /// The same curve, `factor` times as slow.
    #[must_use]
    pub fn slowed(&self, factor: f64) -> Self {
        Self {
            angular_frequency: self.angular_frequency / factor,
            ..*self
        }
    }

    pub(super) fn checked(self, what: &'static str) -> Result<Self, ArmError> {
        let Self {
            centre,
            amplitude,
            angular_frequency,
            phase,
        } = self;
        bounded(what, [centre, amplitude, phase], 1e4)?;
        bounded(what, [angular_frequency], 1e3)?;
        Ok(self)
    }
}

/// Instants looked at between two knots.
const BETWEEN: usize = 16;

/// One leg of a path: to these joints in so many seconds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Leg {
    /// End of the leg.
    pub to: TableJoints,
    /// Duration, s.
    pub duration: f64,
}

/// A path in joint space, parametrised by time from zero.
#[derive(Clone, PartialEq, Debug)]
pub enum JointPath {
    /// Each joint by itself.
    Sinusoids([Sinusoid; JOINTS]),
    /// Legs from rest to rest; the arm stays at the last.
    Legs {
        /// Start of the path.
        from: TableJoints,
        /// Legs in order.
        legs: Vec<Leg>,
    },
    /// Joints, rates and accelerations at equal intervals; polynomials of fifth degree between.
    Knots {
        /// Interval, s.
        step: f64,
        /// The first is at zero.
        knots: Vec<TableMotion>,
    },
}

impl JointPath {
    /// Five sinusoids.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`]; [`ArmError::TooLarge`] beyond 1e4 rad or 1e3 rad/s.
    pub fn sinusoids(joints: [Sinusoid; JOINTS]) -> Result<Self, ArmError> {
        for joint in joints {
            joint.checked("sinusoid of a joint")?;
        }
        Ok(Self::Sinusoids(joints))
    }

    /// Legs of given durations.
    ///
    /// # Errors
    /// A duration below a millisecond or above 1e9 s.
    pub fn legs(from: TableJoints, legs: Vec<Leg>) -> Result<Self, ArmError> {
        for leg in &legs {
            bounded("duration of a leg (s)", [leg.duration], 1e9)?;
            if leg.duration < 1e-3 {
                return Err(ArmError::Impossible {
                    what: "a leg must last at least a millisecond (s)",
                    value: leg.duration,
                });
            }
        }
        Ok(Self::Legs { from, legs })
    }

    /// Through the given joints, resting at each, each leg as fast as the arm's fastest rates allow.
    ///
    /// # Errors
    /// As [`JointPath::legs`].
    pub fn through(arm: &Arm, points: &[TableJoints]) -> Result<Self, ArmError> {
        let fastest = arm.parameters().fastest;
        let Some((first, rest)) = points.split_first() else {
            return Err(ArmError::Impossible {
                what: "a path needs at least one point",
                value: 0.0,
            });
        };
        let mut before = *first;
        let mut legs = Vec::with_capacity(rest.len());
        for to in rest {
            let mut duration = 1e-3_f64;
            for ((a, b), limit) in before.angles().iter().zip(to.angles()).zip(fastest) {
                duration = duration.max(PEAK * (b - a).abs() / limit);
            }
            legs.push(Leg { to: *to, duration });
            before = *to;
        }
        Self::legs(*first, legs)
    }

    /// Knots every `step` seconds.
    ///
    /// # Errors
    /// A step below a microsecond or above 1000 s; no knots.
    pub fn knots(step: f64, knots: Vec<TableMotion>) -> Result<Self, ArmError> {
        bounded("interval between knots (s)", [step], 1e3)?;
        if step < 1e-6 || knots.is_empty() {
            return Err(ArmError::Impossible {
                what: "knots must be at least one, and a microsecond apart (s)",
                value: step,
            });
        }
        Ok(Self::Knots { step, knots })
    }

    /// Default motion of the simulator: every joint swings between its stops, none above 90 deg/s.
    #[must_use]
    pub fn demonstration() -> Self {
        let swing = |centre, amplitude, angular_frequency, phase| Sinusoid {
            centre,
            amplitude,
            angular_frequency,
            phase,
        };
        Self::Sinusoids([
            swing(0.0, 1.1, 0.7, 0.0),
            swing(-0.3, 0.35, 1.1, 0.4),
            swing(0.6, 0.5, 1.3, 1.0),
            swing(1.4, 0.6, 0.9, -0.5),
            swing(0.0, 1.6, 0.8, 0.2),
        ])
    }

    /// Length in s; `None` for a path without end.
    #[must_use]
    pub fn duration(&self) -> Option<f64> {
        match self {
            Self::Sinusoids(_) => None,
            Self::Legs { legs, .. } => Some(legs.iter().map(|leg| leg.duration).sum()),
            Self::Knots { step, knots } => Some(step * (knots.len() - 1) as f64),
        }
    }

    /// Joints, rates and accelerations at `secs`; before the start and after the end it rests.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`] time; [`ArmError::TooLarge`] beyond 1e9 s.
    pub fn at(&self, secs: f64) -> Result<TableMotion, ArmError> {
        bounded("time on the path (s)", [secs], 1e9)?;
        let motion = self.motion(secs);
        TableMotion::new(
            TableJoints::new(motion.q().angles())?,
            motion.qd(),
            motion.qdd(),
        )
    }

    /// Same as [`JointPath::at`] for a finite time, without a look at the size of the numbers.
    pub(super) fn motion(&self, secs: f64) -> TableMotion {
        match self {
            Self::Sinusoids(joints) => {
                let (mut q, mut qd, mut qdd) = ([0.0; JOINTS], [0.0; JOINTS], [0.0; JOINTS]);
                for (i, joint) in joints.iter().enumerate() {
                    [q[i], qd[i], qdd[i]] = joint.at(secs);
                }
                TableMotion::computed(q, qd, qdd)
            }
            Self::Knots { step, knots } => knots::at(*step, knots, secs),
            Self::Legs { from, legs } => {
                let mut start = 0.0;
                let mut before = *from;
                for leg in legs {
                    if secs < start + leg.duration {
                        return along(&before, leg, secs - start);
                    }
                    start += leg.duration;
                    before = leg.to;
                }
                before.at_rest()
            }
        }
    }

    /// Whether no joint ever passes its stop.
    ///
    /// # Errors
    /// [`ArmError::Limit`] with the joint and the farthest it goes; for knots also the time.
    pub fn check(&self, limits: &Limits) -> Result<(), ArmError> {
        match self {
            Self::Sinusoids(joints) => {
                for side in [1.0, -1.0] {
                    let farthest = joints.map(|j| {
                        if j.angular_frequency == 0.0 {
                            return j.centre + j.amplitude * j.phase.sin();
                        }
                        j.centre + j.amplitude.abs() * side
                    });
                    limits.check(&TableJoints::new(farthest)?)?;
                }
                Ok(())
            }
            // Between two points every joint stays between its two angles.
            Self::Legs { from, legs } => {
                limits.check(from)?;
                legs.iter().try_for_each(|leg| limits.check(&leg.to))
            }
            Self::Knots { step, knots } => {
                for (knot, i) in knots.iter().zip(0_u32..) {
                    limits.check(knot.q()).map_err(|why| ArmError::Path {
                        secs: step * f64::from(i),
                        why: Box::new(why),
                    })?;
                }
                Ok(())
            }
        }
    }

    /// The fastest each joint ever moves, rad/s; exact, but between knots the most of sixteen instants.
    #[must_use]
    pub fn peak_rates(&self) -> [f64; JOINTS] {
        match self {
            Self::Sinusoids(joints) => {
                joints.map(|joint| (joint.amplitude * joint.angular_frequency).abs())
            }
            Self::Legs { from, legs } => {
                let mut peaks = [0.0_f64; JOINTS];
                let mut before = from.angles();
                for leg in legs {
                    let to = leg.to.angles();
                    for ((peak, a), b) in peaks.iter_mut().zip(before).zip(to) {
                        *peak = peak.max(PEAK * (b - a).abs() / leg.duration);
                    }
                    before = to;
                }
                peaks
            }
            Self::Knots { step, knots } => {
                let mut peaks = [0.0_f64; JOINTS];
                for i in 0..=knots.len().saturating_sub(1) * BETWEEN {
                    let motion = self.motion(step * i as f64 / BETWEEN as f64);
                    for (peak, rate) in peaks.iter_mut().zip(motion.qd()) {
                        *peak = rate.abs().max(*peak);
                    }
                }
                peaks
            }
        }
    }

    /// The same path, `factor` times as slow.
    ///
    /// # Errors
    /// A factor that is not above zero and finite, or takes the path out of what [`JointPath::legs`] and
    /// [`JointPath::sinusoids`] accept.
    pub fn slowed(&self, factor: f64) -> Result<Self, ArmError> {
        let factor = slow_down(factor)?;
        match self {
            Self::Sinusoids(joints) => Self::sinusoids(joints.map(|joint| joint.slowed(factor))),
            Self::Legs { from, legs } => {
                let mut legs = legs.clone();
                for leg in &mut legs {
                    leg.duration *= factor;
                }
                Self::legs(*from, legs)
            }
            Self::Knots { step, knots } => {
                let slow = |knot: &TableMotion| {
                    let qd = knot.qd().map(|w| w / factor);
                    let qdd = knot.qdd().map(|a| a / (factor * factor));
                    TableMotion::new(*knot.q(), qd, qdd)
                };
                let knots: Result<Vec<_>, _> = knots.iter().map(slow).collect();
                Self::knots(step * factor, knots?)
            }
        }
    }

    /// Slowed as much as the arm's fastest rates ask, and by how much.
    ///
    /// # Errors
    /// As [`JointPath::slowed`].
    pub fn within_rates(&self, arm: &Arm) -> Result<(Self, f64), ArmError> {
        let mut factor = 1.0_f64;
        for (peak, limit) in self.peak_rates().into_iter().zip(arm.parameters().fastest) {
            factor = factor.max(peak / limit);
        }
        Ok((self.slowed(factor)?, factor))
    }
}

/// A leg, `secs` after its start.
fn along(from: &TableJoints, leg: &Leg, secs: f64) -> TableMotion {
    let [s, sd, sdd] = rest_to_rest(secs, leg.duration);
    let start = from.angles();
    let (mut q, mut qd, mut qdd) = (start, [0.0; JOINTS], [0.0; JOINTS]);
    for (i, (a, b)) in start.into_iter().zip(leg.to.angles()).enumerate() {
        let way = b - a;
        (q[i], qd[i], qdd[i]) = (a + way * s, way * sd, way * sdd);
    }
    TableMotion::computed(q, qd, qdd)
}
