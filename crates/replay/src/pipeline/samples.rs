//! Samples that a program holds -> their attitudes and the summary of a replay. I/O: a temporary file, of a long
//! recording that is smoothed.
//!
//! The steps, and the words, of a replay of a file: what must be known first is found by a pass over the samples.

use super::replay_start::preparation;
use super::request::ReplayRequest;
use super::session::{Found, Topic};
use super::summarise;
use crate::error::Error;
use crate::findings::of_sensor;
use crate::summary::TopicSummary;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Estimator, Meaning, Patience, Plan, Prepared, learned};
use strapd_attitude::propagate::Sequential;
use strapd_attitude::record::{AttitudeSample, Declared, RawSample};
use strapd_recording::Source;
use strapd_recording::format::Format;

/// The name of samples that have none.
const NAME: &str = "samples";
/// Their type and encoding.
const DESCRIBED: &str = "arrays";
/// Samples between two looks at whether to go on.
const BLOCK: usize = 4096;

/// Why there is no attitude.
#[derive(Debug)]
pub enum Stop<E> {
    /// The samples, or the settings, do not allow it.
    Refused(Diagnostic),
    /// Whoever takes the attitudes has ended it.
    Ended(E),
}

impl<E> From<Error> for Stop<E> {
    fn from(why: Error) -> Stop<E> {
        match why {
            // Samples of a program have no file to be named.
            Error::Recording(strapd_recording::Error::Topic { what, .. }) => Stop::Refused(what),
            other => Stop::Refused(Diagnostic::from(&other)),
        }
    }
}

/// Attitudes of `samples` as `plan` asks for, given to `take` as they are made; every few thousand samples it is asked
/// whether to go on, with no attitudes where there are none yet.
///
/// # Errors
/// Samples or settings do not allow it; those of `take`.
pub fn estimate<E>(
    plan: &Plan,
    samples: impl Iterator<Item = RawSample> + Clone,
    mut take: impl FnMut(&[AttitudeSample]) -> Result<(), E>,
) -> Result<TopicSummary, Stop<E>> {
    let path = Path::new(NAME);
    let run = ReplayRequest {
        plan: plan.clone(),
        ..ReplayRequest::new(Source::File(PathBuf::from(path)))
    };
    let found = Found {
        name: NAME.to_owned(),
        output_topic: String::new(),
        described: DESCRIBED.to_owned(),
        resolved: Meaning::new(plan, &Declared::default()),
        noticed: Arc::default(),
        warnings: Vec::new(),
    };
    let mut preparation = preparation(&run, &found, Patience::WholeLog);
    for (n, raw) in samples.clone().enumerate() {
        if n.is_multiple_of(BLOCK) {
            if n > 0 && !preparation.wants_more() {
                break;
            }
            take(&[]).map_err(Stop::Ended)?;
        }
        preparation.take(&raw).map_err(Stop::Refused)?;
    }
    let prepared = preparation.decide().map_err(Stop::Refused)?;
    let mut topic = Topic::new(path, plan, found, prepared, false)?;
    // That a calibration is of a sensor of another name: these have none.
    topic.warnings.clear();
    if plan.smooth {
        topic.spool_beside(&[]);
    }
    let (estimator, output) = (&mut topic.estimator, &mut topic.output);
    for (n, raw) in samples.enumerate() {
        estimator.take(&raw);
        if !raw.is_beside {
            topic.zeros.take(raw.gyro);
        }
        if (n + 1).is_multiple_of(BLOCK) {
            let attitudes = estimator.attitudes(&Sequential);
            output.add(attitudes);
            take(attitudes).map_err(Stop::Ended)?;
        }
    }
    let attitudes = estimator.attitudes(&Sequential);
    output.add(attitudes);
    take(attitudes).map_err(Stop::Ended)?;
    let mut ended = Ok(());
    let finished = estimator.finish_into(&Sequential, |attitudes| {
        output.add(attitudes);
        if ended.is_ok() {
            ended = take(attitudes);
        }
        Ok::<(), Error>(())
    });
    ended.map_err(Stop::Ended)?;
    finished?;
    let summary = summarise::of_topic(&run, &mut topic, Format::default());
    Ok(TopicSummary {
        // Without the name that the samples have not.
        calibration: learned(
            (plan, &topic.resolved, &topic.prepared),
            topic.estimator.filter(),
            topic.estimator.smoothed().and_then(Result::ok),
        ),
        ..summary
    })
}

/// The same of an estimator whose samples still come, under the same names: what it knows now. It has given `written`
/// attitudes, of which `last` is the newest.
#[must_use]
pub fn so_far(
    of: (&Plan, &Meaning, &Prepared),
    estimator: &Estimator,
    written: u64,
    last: Option<&AttitudeSample>,
) -> TopicSummary {
    let mut summary = TopicSummary {
        topic: NAME.to_owned(),
        decoded_as: DESCRIBED.to_owned(),
        written,
        ..TopicSummary::of(of, estimator, last)
    };
    let (report, propagation) = (estimator.conditioning(), estimator.propagation());
    let found = of_sensor(report, &propagation, &summary.clock);
    summary.findings.extend(found);
    for finding in &mut summary.findings {
        finding.topic.clone_from(&summary.topic);
    }
    summary
}
