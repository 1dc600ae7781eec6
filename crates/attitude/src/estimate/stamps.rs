//! `--regularise-stamps`: what becomes of the stamps of a run. Pure.
//!
//! Apart from the preparation because a recording needs a pass of its own for it, whatever else is
//! known, and because a stream cannot have one.

use super::first_pass::{Conditioned, FEW};
use super::meaning::Meaning;
use super::plan::EstimationSettings;
use super::sample_kind::{KindChoice, KindReason};
use crate::condition::regularise::{Lines, Regulariser, Survey, Value};
use crate::diagnostic::Diagnostic;
use crate::record::{RawSample, SampleKind};
use crate::setting::REGULARISE_STAMPS;
use std::sync::Arc;

/// Treatment of the stamps.
#[derive(Clone, Debug, Default)]
pub enum Stamps {
    /// Stamps as recorded.
    #[default]
    AsRecorded,
    /// Stamps on the lines laid through all of them before, for each meaning a sample is given (that
    /// decides which samples there are).
    OnLines {
        /// Lines by the meaning.
        lines: Vec<(SampleKind, Arc<Lines>)>,
        /// Whether the messages state how long they integrated.
        states_interval: bool,
    },
    /// Stamps filtered as they come.
    Causal {
        /// Whether the messages state how long they integrated.
        states_interval: bool,
    },
}

impl Stamps {
    /// The stage that does it for samples of one meaning; `None` where nothing is to be done.
    ///
    /// # Errors
    /// In words: no lines for that meaning.
    pub fn regulariser(&self, kind: SampleKind) -> Result<Option<Regulariser>, Diagnostic> {
        match self {
            Stamps::AsRecorded => Ok(None),
            Stamps::OnLines {
                lines,
                states_interval,
            } => {
                let (_, lines) = lines.iter().find(|(of, _)| *of == kind).ok_or_else(|| {
                    format!(
                        "{REGULARISE_STAMPS}: no pass was made for {} samples",
                        kind.name()
                    )
                })?;
                let value = Value::of(kind, *states_interval);
                Ok(Some(Regulariser::by_lines(lines.clone(), value)))
            }
            Stamps::Causal { states_interval } => {
                let value = Value::of(kind, *states_interval);
                Ok(Some(Regulariser::causal(value)))
            }
        }
    }

    /// Words for the output's metadata; `None` for stamps as recorded.
    #[must_use]
    pub fn words(&self, kind: SampleKind) -> Option<String> {
        match self {
            Stamps::AsRecorded => None,
            Stamps::OnLines { lines, .. } => {
                let (_, lines) = lines.iter().find(|(of, _)| *of == kind)?;
                let rate = lines
                    .rate_hz()
                    .map_or_else(String::new, |hz| format!(", {hz:.6} Hz in the first"));
                Some(format!(
                    "regularised by straight lines: segments {}{rate}, jitter {:.3} % of the step (rms)",
                    lines.len(),
                    lines.jitter() * 100.0
                ))
            }
            Stamps::Causal { .. } => Some("regularised by a causal tracker".to_owned()),
        }
    }
}

/// A pass over the samples of a stream that only looks at their stamps.
#[derive(Debug)]
pub struct StampPass {
    /// One for each meaning samples are given.
    surveys: Vec<(SampleKind, Conditioned, Survey)>,
    taken: usize,
    states_interval: bool,
}

impl StampPass {
    /// Makes one for samples understood as `meaning`, and as each of `others` they are compared under; `None` where
    /// the plan leaves stamps as they are.
    #[must_use]
    pub fn new(
        plan: &EstimationSettings,
        meaning: &Meaning,
        others: impl IntoIterator<Item = SampleKind>,
    ) -> Option<StampPass> {
        if !plan.regularise_stamps {
            return None;
        }
        let mut surveys: Vec<(SampleKind, Conditioned, Survey)> = Vec::new();
        // Which of the two it is, the samples tell.
        let either = meaning.is_kind_open().then_some(SampleKind::Average);
        for kind in std::iter::once(meaning.kind).chain(either).chain(others) {
            if surveys.iter().all(|(known, ..)| *known != kind) {
                let reason = KindReason::Setting;
                let meant = meaning.with_kind(&KindChoice { kind, reason });
                surveys.push((kind, Conditioned::new(plan, &meant), Survey::new()));
            }
        }
        Some(StampPass {
            surveys,
            taken: 0,
            states_interval: false,
        })
    }

    /// Takes a sample.
    ///
    /// # Errors
    /// In words, when the settings do not fit.
    pub fn push(&mut self, raw: &RawSample) -> Result<(), Diagnostic> {
        self.taken += 1;
        self.states_interval |= self.taken <= FEW && raw.interval_nanos.is_some_and(|n| n > 0);
        for (_, conditioned, survey) in &mut self.surveys {
            conditioned.push(std::slice::from_ref(raw), |sample| survey.push(sample))?;
        }
        Ok(())
    }

    /// The lines.
    ///
    /// # Errors
    /// In words: there is no constant rate.
    pub fn finish(self) -> Result<Stamps, Diagnostic> {
        let mut lines = Vec::new();
        for (kind, mut conditioned, mut survey) in self.surveys {
            conditioned.finish(|sample| survey.push(sample))?;
            let found = survey.finish().map_err(|e| Diagnostic::from(&e))?;
            lines.push((kind, Arc::new(found)));
        }
        Ok(Stamps::OnLines {
            lines,
            states_interval: self.states_interval,
        })
    }
}
