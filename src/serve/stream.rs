//! Raw samples of one sensor -> attitudes, live. Pure.
//!
//! The estimator is the one of a replay; what differs is decided here: the method needs no later
//! sample, no sample is held back, and nothing is looked at before the first attitude leaves.

use crate::condition::{GyroUnit, Report};
use crate::config::Plan;
use crate::decode::{Line, Stated};
use crate::model::attitude::Quaternion;
use crate::pipeline::estimator::Estimator;
use crate::pipeline::opening::labelled;
use crate::pipeline::preparation::{Prepared, Resolved, at_once};
use crate::propagate::{Method, Sequential};
use crate::record::{AttitudeSample, Nanos, RawSample, SampleKind, Verdict};
use crate::serve::channel::Channel;
use crate::serve::recorder::stream_of;
use crate::serve::state::Saved;
use crate::serve::wire::Fault;
use crate::sink::Stream;
use std::sync::Arc;

/// Numbers a sample may come behind its turn. Further back, the sender counts anew.
const OVERTAKEN: u64 = 64;

/// The name of a sensor that gives none.
pub const NAMELESS: &str = "imu";

/// One sensor: its estimator, what its attitudes are called, and what has been said of it.
#[derive(Debug)]
pub struct SensorStream {
    id: Arc<str>,
    estimator: Estimator,
    channel: Arc<Channel>,
    kind: SampleKind,
    unit: GyroUnit,
    prepared: Prepared,
    /// Attitudes so far: the number of the next.
    next_seq: u64,
    /// The sender's number expected next.
    expected: Option<u64>,
    /// Samples that by the sender's numbers did not come in their turn: never, or late.
    missing: u64,
    last: Option<AttitudeSample>,
    /// Distance of a step from the ordinary one, s, smoothed over about 16 steps.
    jitter_secs: f64,
    /// Verdicts that were said once, as bits.
    told: u32,
}

/// The plan as it is for live streams: `auto` is the method without latency.
///
/// # Errors
/// In words, with the flag that helps: what a live stream can not do.
pub fn live_plan(plan: &Plan) -> Result<Plan, String> {
    if plan.topic.is_some() {
        return Err(
            "--topic: a sensor is named by `id` in its samples, and chosen with WATCH".to_owned(),
        );
    }
    let mut plan = plan.clone();
    if plan.method == Method::Auto {
        plan.method = "commit".parse::<Method>().map_err(|e| e.to_string())?;
    }
    let resolved = Resolved::new(&plan, &Stated::default());
    // An orientation, so that only what no sample can bring is refused.
    let sample = RawSample {
        orientation: Some(
            Quaternion::<crate::model::frames::Nav, crate::model::frames::Body>::identity().wxyz(),
        ),
        ..RawSample::default()
    };
    let prepared = at_once(&plan, &resolved, &sample)?;
    Estimator::live(&plan, &resolved, &prepared)?;
    Ok(plan)
}

impl SensorStream {
    /// For the sensor `id`, whose first line says `stated` and brings `first`. `plan` is a
    /// [`live_plan`]. It goes on from `saved`, where there is such; `declare` makes its labels known to
    /// clients.
    ///
    /// # Errors
    /// The fault to answer with: the samples do not fit the plan.
    pub fn new(
        plan: &Plan,
        id: Arc<str>,
        stated: &Line,
        first: &RawSample,
        saved: Option<&Saved>,
        declare: impl FnOnce(&Stream) -> Arc<Channel>,
    ) -> Result<SensorStream, Fault> {
        let fault = |what: String| Fault {
            id: Some(id.to_string()),
            ..Fault::new("not_ready", what)
        };
        let stated = Stated {
            sample_kind: stated.sample_kind,
            gyro_unit: stated.gyro_unit,
            ..Stated::default()
        };
        let resolved = Resolved::new(plan, &stated);
        let mut prepared = at_once(plan, &resolved, first).map_err(fault)?;
        let mut estimator = Estimator::live(plan, &resolved, &prepared).map_err(fault)?;
        let labels = labelled(stream_of(&id), plan, &resolved, &prepared);
        if let Some(saved) = saved {
            let resumed = saved
                .attitude(&labels)
                .and_then(|last| estimator.resume(&last));
            match resumed {
                Ok(()) => "as saved before the restart".clone_into(&mut prepared.initial_origin),
                Err(why) => prepared.warnings.push(why),
            }
        }
        Ok(SensorStream {
            channel: declare(&labels),
            id,
            estimator,
            kind: resolved.kind,
            unit: resolved.unit,
            prepared,
            next_seq: 0,
            expected: None,
            missing: 0,
            last: None,
            jitter_secs: 0.0,
            told: 0,
        })
    }

    /// As clients know it.
    #[must_use]
    pub fn channel(&self) -> &Arc<Channel> {
        &self.channel
    }

    /// Its name.
    #[must_use]
    pub fn id(&self) -> &Arc<str> {
        &self.id
    }

    /// Whether a later line means the same by its numbers as the first. `plan` wins over both.
    #[must_use]
    pub fn agrees(&self, plan: &Plan, line: &Line) -> bool {
        let kind = plan.kind.or(line.sample_kind).unwrap_or(self.kind);
        let unit = plan.unit.or(line.gyro_unit).unwrap_or(self.unit);
        (kind, unit) == (self.kind, self.unit)
    }

    /// What a recording calls it.
    #[must_use]
    pub fn recorded(&self) -> crate::sink::Stream {
        self.channel.stream().clone()
    }

    /// What a daemon after this one needs to go on; `None` before the first attitude.
    #[must_use]
    pub fn saved(&self) -> Option<Saved> {
        Some(Saved::new(self.last.as_ref()?, self.channel.stream()))
    }

    /// Takes samples in the order they came. The attitudes they give come from
    /// `attitudes`.
    pub fn take(&mut self, seq: Option<u64>, samples: &[RawSample]) {
        if let Some(seq) = seq {
            let expected = self.expected.unwrap_or(seq);
            self.missing = self.missing.saturating_add(seq.saturating_sub(expected));
            // One that was overtaken, or came twice, is no new beginning.
            if seq >= expected || expected - seq > OVERTAKEN {
                self.expected = Some(seq.saturating_add(1));
            }
        }
        for raw in samples {
            self.estimator.take(raw);
        }
    }

    /// A line that could not be decoded stood here.
    pub fn take_undecodable(&mut self) {
        self.estimator.take_undecodable();
    }

    /// The attitudes of what was taken, and the number of the first.
    pub(crate) fn attitudes(&mut self) -> (u64, &[AttitudeSample], &Arc<Channel>) {
        let first = self.next_seq;
        let spacing = self.estimator.conditioning().spacing_nanos;
        let attitudes = self.estimator.attitudes(&Sequential);
        let mut before = self.last.map(|l| l.stamp);
        for attitude in attitudes {
            let step = before.map(|b| attitude.stamp.since(b));
            before = Some(attitude.stamp);
            // A step over missing samples is a gap.
            if let (Some(spacing), Some(step)) = (spacing, step)
                && step < 2 * spacing
            {
                let off = (step - spacing).abs() as f64 * 1e-9;
                self.jitter_secs += (off - self.jitter_secs) / 16.0;
            }
        }
        self.next_seq += attitudes.len() as u64;
        self.last = attitudes.last().copied().or(self.last);
        (first, attitudes, &self.channel)
    }

    /// The kinds of loss that have happened for the first time since this was asked last.
    pub fn news(&mut self) -> Vec<Fault> {
        let counts = self.estimator.conditioning().counts;
        let mut news = Vec::new();
        for verdict in Verdict::ALL {
            let bit = 1 << verdict as u32;
            if self.told & bit == 0 && verdict.is_loss() && counts.get(verdict) > 0 {
                self.told |= bit;
                // An undecodable line was answered itself.
                if verdict != Verdict::Undecodable {
                    news.push(Fault {
                        id: Some(self.id.to_string()),
                        ..Fault::new(verdict.name(), explained(verdict))
                    });
                }
            }
        }
        news
    }

    /// What conditioning did.
    #[must_use]
    pub fn conditioning(&self) -> &Report {
        self.estimator.conditioning()
    }

    /// What is known of it, for `STATUS`.
    #[must_use]
    pub fn status(&self) -> serde_json::Value {
        let report = self.conditioning();
        let counts: serde_json::Map<_, _> = Verdict::ALL
            .into_iter()
            .filter(|v| report.counts.get(*v) > 0)
            .map(|v| (v.name().to_owned(), report.counts.get(v).into()))
            .collect();
        let stamp = |s: Nanos| {
            let (sec, nsec) = s.to_sec_nanosec();
            serde_json::json!({"sec": sec, "nsec": nsec})
        };
        serde_json::json!({
            "id": &*self.id,
            "samples": report.counts.total(),
            "lost": report.counts.lost(),
            "missing": self.missing,
            "counts": counts,
            "gaps": report.gaps.count,
            "not_bridged": report.gaps.not_bridged,
            "attitudes": self.next_seq,
            "reset": self.last.map_or(0, |l| l.reset_count),
            "last_stamp": self.last.map(|l| stamp(l.stamp)),
            "rate_hz": report.spacing_nanos.filter(|n| *n > 0).map(|n| 1e9 / n as f64),
            "jitter_s": self.jitter_secs,
            "sample_kind": self.kind.name(),
            "gyro_unit": self.unit.name(),
            "method": self.estimator.method().name(),
            "world": self.channel.stream().world_axes,
            "body": self.channel.stream().body_axes,
            "initial": self.prepared.initial_origin,
            "bias": self.prepared.bias_origin,
            "warnings": self.prepared.warnings,
        })
    }
}

/// What a verdict means to the one who sent the sample, and what helps.
fn explained(verdict: Verdict) -> String {
    let what = match verdict {
        Verdict::NoGyro => "a sample without a body rate (absent, or null as NaN becomes in JSON)",
        Verdict::NotFinite => "a body rate that is not finite",
        Verdict::Huge => {
            "a body rate no gyro can have; if it is in degrees, start the daemon with --gyro-unit deg"
        }
        Verdict::DuplicateStamp => "two samples with one stamp and other data",
        Verdict::Late => "a sample older than what was already integrated; send in order",
        Verdict::NoStamp => {
            "a sample without a usable stamp (absent, or 0); send `stamp`, or start the daemon with --time log to use the time of arrival"
        }
        Verdict::StrayStamp => "a stamp far ahead of its neighbours",
        other => other.name(),
    };
    format!("not used: {what}. Said once; STATUS counts")
}
