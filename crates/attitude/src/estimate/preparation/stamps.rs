//! Stamps of the first samples, and what a pass over all of them found -> whose stamps count, and how they are made
//! regular. Pure.
//!
//! Apart from the rest of the preparation because nothing else of it looks at clocks.

use super::Patience;
use crate::condition::{ClockWarning, choose_clock_as};
use crate::diagnostic::Diagnostic;
use crate::estimate::clock_pass::{ClockPass, ClockVerdict};
use crate::estimate::intervals::Mismatch;
use crate::estimate::meaning::Meaning;
use crate::estimate::plan::EstimationSettings;
use crate::estimate::stamps::{StampPass, Stamps};
use crate::record::RawSample;
use crate::setting::REGULARISE_STAMPS;

/// Decides whose stamps count, and whether they are those of batches or of a coarse clock.
pub(super) fn decide_clock(
    (plan, resolved): (&EstimationSettings, &Meaning),
    first: &[RawSample],
    clocks: Option<ClockPass>,
    warnings: &mut Vec<Diagnostic>,
) -> Result<ClockVerdict, Diagnostic> {
    let prefix = clocks.as_ref().map_or(first, |pass| pass.prefix(first));
    let (clock, warning) = choose_clock_as(prefix, plan.clock, plan.stamps);
    if let Some(fatal @ ClockWarning::NoneMoves) = warning {
        return Err(Diagnostic::from(&fatal));
    }
    warnings.extend(warning.iter().map(Diagnostic::from));
    let unjudged = || ClockVerdict {
        clock,
        ..ClockVerdict::default()
    };
    let of = (plan, resolved);
    let mut clocks = clocks.map_or_else(unjudged, |pass| pass.finish(clock, of));
    warnings.extend(clocks.of_batches.take());
    warnings.extend(clocks.of_speed.take());
    if let Some(mismatch) = Mismatch::between(first, clocks.clock, resolved.kind) {
        if !resolved.interval_unit_given {
            return Err(mismatch.refusal(resolved.interval.as_ref()));
        }
        warnings.push(format!("{mismatch}: what lies between is bridged").into());
    }
    Ok(clocks)
}

/// Decides how stamps are made regular, where that was asked for.
pub(super) fn decide_stamps(
    pass: Option<StampPass>,
    patience: Patience,
    warnings: &mut Vec<Diagnostic>,
) -> Result<Stamps, Diagnostic> {
    let found = pass.map(StampPass::finish).transpose()?;
    Ok(match (found, patience) {
        (None, _) => Stamps::AsRecorded,
        (
            Some(Stamps::OnLines {
                states_interval, ..
            }),
            Patience::FirstMinute,
        ) => {
            warnings.push(format!("{REGULARISE_STAMPS}: this stream can be read only once, so each stamp was filtered by those before it; a file is fitted as a whole, which is more accurate and gives other numbers").into());
            Stamps::Causal { states_interval }
        }
        (Some(stamps), _) => stamps,
    })
}
