//! Samples that a program holds -> their attitudes and the summary of a replay. I/O: a temporary file, of a long
//! recording that is smoothed.
//!
//! The steps, and the words, of a replay of a file: what must be known first is found by a pass over the samples.

use super::mend;
use super::replay_start::preparation;
use super::request::ReplayRequest;
use super::session::{Topic, TopicInfo};
use super::summarise;
use crate::error::Error;
use crate::findings::{of_sensor, of_stream};
use crate::summary::TopicSummary;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{
    EstimationSettings, Estimator, Meaning, Patience, Prepared, learned,
};
use strapd_attitude::propagate::Sequential;
use strapd_attitude::record::{AttitudeSample, Declared, RawSample};
use strapd_recording::Source;
use strapd_recording::recording::payload_type::PayloadType;

/// The name of samples that have none.
const NAME: &str = "samples";
/// Type and encoding in the summary.
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
    plan: &EstimationSettings,
    samples: impl Iterator<Item = RawSample> + Clone,
    mut take: impl FnMut(&[AttitudeSample]) -> Result<(), E>,
) -> Result<TopicSummary, Stop<E>> {
    let plan = mend::settled(plan, |plan| {
        let tried = estimate_by(plan, samples.clone(), |_| take(&[]))?;
        Ok::<_, Stop<E>>(Some(tried.findings))
    })?;
    estimate_by(&plan, samples, take)
}

fn estimate_by<E>(
    plan: &EstimationSettings,
    samples: impl Iterator<Item = RawSample> + Clone,
    mut take: impl FnMut(&[AttitudeSample]) -> Result<(), E>,
) -> Result<TopicSummary, Stop<E>> {
    let path = Path::new(NAME);
    let run = ReplayRequest {
        plan: plan.clone(),
        ..ReplayRequest::new(Source::File(PathBuf::from(path)))
    };
    let found = TopicInfo {
        name: NAME.to_owned(),
        output_topic: String::new(),
        described: PayloadType::of_memory(DESCRIBED),
        resolved: Meaning::new(plan, &Declared::default()),
        noticed: Arc::default(),
        warnings: Vec::new(),
    };
    let prepared = prepare(&run, &found, samples.clone(), &mut take)?;
    let mut topic = Topic::new(path, plan, found, prepared, false)?;
    // That a calibration is of a sensor of another name: these have none.
    topic.warnings.clear();
    if plan.smooth {
        topic.spool_beside(&[]);
    }
    for (n, raw) in samples.enumerate() {
        let _ = topic.take(&raw);
        if (n + 1).is_multiple_of(BLOCK) {
            let attitudes = topic.estimator.attitudes(&Sequential);
            topic.output.add(attitudes);
            take(attitudes).map_err(Stop::Ended)?;
        }
    }
    let (estimator, output) = (&mut topic.estimator, &mut topic.output);
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
    let summary = summarise::of_topic(&run, &mut topic);
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

/// Finds what must be known before the first attitude.
fn prepare<E>(
    run: &ReplayRequest,
    found: &TopicInfo,
    samples: impl Iterator<Item = RawSample>,
    take: &mut impl FnMut(&[AttitudeSample]) -> Result<(), E>,
) -> Result<Prepared, Stop<E>> {
    let mut preparation = preparation(run, found, Patience::WholeLog);
    for (n, raw) in samples.enumerate() {
        if n.is_multiple_of(BLOCK) {
            if n > 0 && !preparation.wants_more() {
                break;
            }
            take(&[]).map_err(Stop::Ended)?;
        }
        preparation.take(&raw).map_err(Stop::Refused)?;
    }
    preparation.decide().map_err(Stop::Refused)
}

/// The same of an estimator whose samples still come, under the same names: what it knows now. It has given `written`
/// attitudes, of which `last` is the newest.
#[must_use]
pub fn so_far(
    of: (&EstimationSettings, &Meaning, &Prepared),
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
    summary.findings.extend(of_stream(report, true));
    for finding in &mut summary.findings {
        finding.topic.clone_from(&summary.topic);
    }
    summary
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use serde_json::Value;
    use std::collections::BTreeSet;
    use strapd_attitude::estimate::{Aid, Truncation, at_once};
    use strapd_attitude::record::Nanos;

    fn keys(value: &Value, at: &str, all: &mut BTreeSet<String>) {
        for (key, value) in value.as_object().into_iter().flatten() {
            let at = format!("{at}.{key}");
            keys(value, &at, all);
            all.insert(at);
        }
    }

    fn keys_of(summary: &TopicSummary) -> BTreeSet<String> {
        let mut all = BTreeSet::new();
        keys(&summary.json(), "", &mut all);
        all
    }

    /// A steady turn with gravity along z, and a gap of half a second before the last of 300.
    fn raw() -> Vec<RawSample> {
        let stamp = |n: i64| 1_700_000_000_000_000_000 + n * 10_000_000 + n / 299 * 500_000_000;
        (0..300)
            .map(|n| RawSample {
                header: Some(Nanos(stamp(n))),
                log: Nanos(stamp(n)),
                gyro: Some([0.1, 0.2, 0.3]),
                accel: Some([0.0, 0.0, 9.81]),
                ..RawSample::default()
            })
            .collect()
    }

    fn whole(plan: &EstimationSettings) -> TopicSummary {
        estimate(plan, raw().into_iter(), |_| Ok::<(), ()>(())).unwrap()
    }

    fn live(plan: &EstimationSettings) -> TopicSummary {
        let raw = raw();
        let meaning = Meaning::new(plan, &Declared::default());
        let prepared = at_once(plan, &meaning, raw.get(..1).unwrap()).unwrap();
        let mut estimator = Estimator::live(plan, &meaning, &prepared).unwrap();
        raw.iter().for_each(|raw| estimator.take(raw));
        let known = estimator.attitudes(&Sequential);
        let (written, last) = (known.len() as u64, known.last().copied());
        so_far(
            (plan, &meaning, &prepared),
            &estimator,
            written,
            last.as_ref(),
        )
    }

    /// Codes of what is found in `rates` of a lively motion.
    fn found(rate: impl Fn(f64) -> [f64; 3]) -> Vec<String> {
        let raw = (0..6000_i64).map(|n| {
            let stamp = Nanos(1_700_000_000_000_000_000 + n * 10_000_000);
            RawSample {
                header: Some(stamp),
                log: stamp,
                gyro: Some(rate(n as f64 * 0.01)),
                ..RawSample::default()
            }
        });
        let plan = EstimationSettings::default();
        let summary = estimate(&plan, raw, |_| Ok::<(), ()>(())).unwrap();
        let found = summary.findings.iter();
        found.map(|f| f.code.to_owned()).collect()
    }

    #[test]
    fn an_axis_that_hangs_is_found_in_samples_of_a_program_as_in_a_file() {
        let lively = |t: f64| [(3.0 * t).sin(), (2.3 * t).cos(), 0.5 * (1.7 * t).sin()];
        let hung = |t: f64| {
            let [x, y, z] = lively(t);
            [x, if (20.0..40.0).contains(&t) { 0.7 } else { y }, z]
        };
        assert!(!found(lively).contains(&"stuck".to_owned()));
        assert!(
            found(hung).contains(&"stuck".to_owned()),
            "{:?}",
            found(hung)
        );
    }

    #[test]
    fn samples_that_still_come_have_every_key_of_a_replay_and_no_other() {
        let alone = EstimationSettings::default();
        let aided = EstimationSettings {
            aid: Aid::Auto,
            ..EstimationSettings::default()
        };
        assert_eq!(keys_of(&live(&aided)), keys_of(&whole(&aided)));
        assert_eq!(keys_of(&live(&alone)), keys_of(&whole(&alone)));
        assert_ne!(keys_of(&live(&alone)), keys_of(&whole(&aided)));
        let cut = EstimationSettings {
            truncation: Truncation::Steps(0.001),
            ..aided.clone()
        };
        let step = live(&cut).json()["truncation_step_rad_s"].as_f64();
        assert_eq!(step, Some(0.001));
        let json = live(&aided).json();
        assert!(json["truncation_step_rad_s"].is_null());
        assert_eq!(json.pointer("/written"), Some(&300.into()));
        assert_eq!(
            json.pointer("/aid/learned/mag_hard_iron"),
            Some(&Value::Null)
        );
        // The gap begins with the last sample but one.
        let at = json.pointer("/gaps/longest_at_s").and_then(Value::as_f64);
        assert!((at.unwrap() - 2.98).abs() < 1e-9, "{at:?}");
    }
}
