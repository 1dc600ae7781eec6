//! Meaning of a sender's first rates -> the run goes on, or begins anew in another meaning. Pure.
//!
//! Apart from [`joining`](super::joining) because a meaning is stated before any stamp is known.

use super::SensorStream;
use super::run::SampleRun;
use crate::serve::guard::fault::Fault;
use strapd_attitude::estimate::{EstimationSettings, Meaning};
use strapd_attitude::record::Declared;
use strapd_recording::decode::Line;

/// Meaning that a line states.
pub(super) fn declared(stated: &Line) -> Declared {
    Declared {
        sample_kind: stated.sample_kind,
        gyro_unit: stated.gyro_unit,
        accel_unit: stated.accel_unit,
        ..Declared::default()
    }
}

impl SensorStream {
    /// Holds a run against the meaning of those before. The first rates of a sender may have another than those of the
    /// sender before: the sensor begins a run in it, and what is to be known of that comes back.
    ///
    /// # Errors
    /// The fault to answer with: the meaning changed amid one connection, or no run can begin in it.
    pub fn understand(
        &mut self,
        plan: &EstimationSettings,
        run: &SampleRun<'_>,
    ) -> Result<Option<Fault>, Fault> {
        let is_open = self.is_meaning_open;
        let fault = |id: &str, code, what: String| Fault {
            id: Some(id.to_owned()),
            ..Fault::new(code, what)
        };
        let note = match self.difference(plan, run.head) {
            None => None,
            Some(difference) if is_open => {
                let resolved = Meaning::new(plan, &declared(run.head));
                let resets = self.rebuild(plan, resolved, run.samples)?;
                if let Some(doubts) = &mut self.doubts {
                    doubts.forget(&self.estimator);
                }
                let what = format!(
                    "its samples mean something else now ({difference}): begun again, reset {}",
                    resets.saturating_add(1)
                );
                Some(fault(&self.id, "new_run", what))
            }
            Some(difference) => {
                let what = format!(
                    "its samples mean something else now ({difference}), which one connection may not change: connect again, or send them under another id (`id`; of a table ?id=NAME)"
                );
                return Err(fault(&self.id, "meaning_changed", what));
            }
        };
        self.is_meaning_open &= run.samples.iter().all(|raw| raw.is_beside);
        Ok(note)
    }

    /// Difference of what a later line means by its numbers, in words; `None` where it is the same. `plan` wins over
    /// both.
    fn difference(&self, plan: &EstimationSettings, line: &Line) -> Option<String> {
        let (kind, unit) = (self.estimator.sample_kind().kind, self.resolved.unit);
        let new_kind = plan.kind.or(line.sample_kind).unwrap_or(kind);
        let new_unit = plan.unit.or(line.gyro_unit).unwrap_or(unit);
        let units = (new_unit != unit)
            .then(|| format!("{}/s before, {}/s now", unit.name(), new_unit.name()));
        let kinds =
            (new_kind != kind).then(|| format!("{} before, {} now", kind.name(), new_kind.name()));
        let all: Vec<String> = units.into_iter().chain(kinds).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}
