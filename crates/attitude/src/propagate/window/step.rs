//! A turn, as integrated over one interval -> its angle, status and error, or none where it is no number. Pure.
//!
//! Apart from the windows because classical methods make the same steps without any.

use super::super::turn::Turn;
use crate::lanes::Triple;
use crate::record::Status;

/// One interval, integrated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    /// `[cos(a/2) - 1, x, y, z]`.
    pub(crate) turn: [f64; 4],
    /// Angle turned, rad.
    pub(crate) angle: f64,
    /// Variance to add for what was interpolated across a gap, rad^2.
    pub(crate) gap_variance: f64,
    /// Change by the outermost samples of the window, rad, in the body axes at the end.
    pub(crate) outer: [f64; 3],
    /// Note of the careful path.
    pub(crate) note: Note,
}

/// Note to be counted about a step.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Note {
    #[default]
    Ordinary,
    /// Fewer samples than the method's window were used.
    Reduced,
    /// The interval holds missing samples.
    Bridged,
    /// The result was not finite and has been replaced by no rotation.
    Refused,
}

impl Step {
    /// A rotation vector where a turn is expected, for the method that sums vectors.
    pub(crate) fn of_vector(phi: Triple<1>, note: Note) -> Self {
        let turn = Turn {
            v: phi,
            ..Turn::NONE
        };
        Step {
            angle: phi.norm(),
            ..Step::new(turn, 0.0, note)
        }
    }

    /// Status of this step for the output at its end.
    #[inline(always)]
    pub(crate) fn status(&self) -> Status {
        let undersampled = if self.angle > std::f64::consts::PI {
            Status::UNDERSAMPLED
        } else {
            Status::OK
        };
        undersampled.with(match self.note {
            Note::Ordinary | Note::Reduced => Status::OK,
            Note::Bridged => Status::BRIDGED,
            Note::Refused => Status::REJECTED_BEFORE,
        })
    }

    /// Adds the change by the outermost samples, unless that is no number.
    pub(crate) fn with_outer(self, outer: Triple<1>) -> Self {
        let outer = [outer.x.0[0], outer.y.0[0], outer.z.0[0]];
        if outer.iter().all(|v| v.is_finite()) {
            Step { outer, ..self }
        } else {
            self
        }
    }

    /// `delta` is the size of the delta angle: a turn only knows its angle up to whole turns.
    pub(crate) fn new(turn: Turn<1>, delta: f64, note: Note) -> Self {
        let angle = if delta > std::f64::consts::PI {
            delta
        } else {
            turn.angle()
        };
        if angle.is_finite() && turn.parts().iter().all(|c| c.is_finite()) {
            return Step {
                turn: turn.parts(),
                angle,
                gap_variance: 0.0,
                outer: [0.0; 3],
                note,
            };
        }
        Step {
            turn: [0.0; 4],
            angle: 0.0,
            gap_variance: 0.0,
            outer: [0.0; 3],
            note: Note::Refused,
        }
    }
}
