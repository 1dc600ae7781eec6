//! One topic of a log -> angles at even intervals, and what was wrong with them. I/O.

use crate::error::{Error, Result};
use crate::report::summary::significant;
use nalgebra::Vector3;
use std::ops::ControlFlow;
use strapd_attitude::condition::stillness::{Limits, Rests, Stillness};
use strapd_attitude::condition::{ClockWarning, Conditioner, Report, choose_clock_as};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::estimate::Meaning;
use strapd_attitude::noise::allan::AngleRecord;
use strapd_attitude::quaternion::BodyRate;
use strapd_attitude::record::{Join, Nanos, RateSample, RawSample, SampleKind};
use strapd_recording::Input;
use strapd_recording::Recording;
use strapd_recording::Selection;
use strapd_recording::pool::Pool;
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::log_channel::described;
use strapd_recording::recording::opened::problems;
use strapd_recording::recording::topic_reading::{TopicItem, TopicReading};

/// Angles held at most: 24 bytes each, 200 MB.
pub(super) const CAPACITY: usize = 1 << 23;
/// Samples that tell which clock moves.
const FEW: usize = 512;
/// A record at rest for less than this part of its length is said to move.
const RESTING: f64 = 0.95;
/// Missing samples filled in one place; more of them split the record whatever `--max-gap` says.
const FILLED_AT_ONCE: i64 = 100_000;
/// A rest worth naming, s.
const USEFUL: f64 = 10.0;
/// Spread of the intervals, as a part of their mean, from which stamps are said to be uneven.
const UNEVEN: f64 = 0.05;

/// A record and what is known about it.
pub(super) struct AngleSeries {
    pub(super) topic: String,
    pub(super) described: String,
    pub(super) resolved: Meaning,
    /// Angles; of rates in units of `interval`.
    pub(super) record: AngleRecord,
    /// Number it holds at most.
    capacity: usize,
    /// Mean sampling interval where samples follow each other, s.
    pub(super) interval: f64,
    /// Root mean square of its variation, s.
    pub(super) unevenness: f64,
    /// Time from the first stamp to the last, s.
    pub(super) secs: f64,
    /// Missing samples replaced by a straight line, and in how many places.
    pub(super) filled: u64,
    pub(super) bridges: u64,
    /// Places where the record was split.
    pub(super) splits: u64,
    pub(super) rests: Rests,
    pub(super) report: Report,
    pub(super) undecodable: u64,
    /// `--start`, s.
    skipped: f64,
    notes: Vec<String>,
    lost_in_file: bool,
}

/// Decodes, conditions and gathers the topic chosen; at most `capacity` angles are held.
///
/// # Errors
/// The log cannot be read, no topic or several, or a topic without a rate.
pub(super) fn gather(
    input: &Input,
    (selection, plan): (&Selection, &EstimationSettings),
    capacity: usize,
    pool: &Pool,
) -> Result<AngleSeries> {
    if selection.topic.as_deref() == Some("all") {
        return Err(Error::usage(
            Diagnostic::new("--topic all: one topic at a time").help("--topic NAME"),
        ));
    }
    let log = Recording::told_apart(input, selection.topic.as_deref(), &selection.decode, pool)?;
    let mut decoders = Decoders::of_run(plan, &selection.decode);
    let reading = TopicReading::new(&log, selection.topic.as_deref(), &mut decoders)?;
    let topic = reading.name().to_owned();
    let (known, decoder) = reading.plan().first_with_rate(log.name())?;
    let described = described(&known.channel).to_string();
    let mut gathering = Gathering::new(
        plan,
        Meaning::new(plan, &decoder.stated().declared),
        capacity,
    );
    let fails = |what| {
        strapd_recording::Error::Topic {
            path: log.name().to_owned(),
            topic: topic.clone(),
            what,
        }
        .into()
    };
    let survey = reading.walk::<Error>(pool, |taken| {
        match taken {
            TopicItem::Sample(_, raw) if raw.is_beside => {}
            TopicItem::Sample(_, raw) => gathering.take(raw).map_err(fails)?,
            TopicItem::Undecodable(..) => gathering.undecodable(),
        }
        Ok(ControlFlow::Continue(()))
    })?;
    let mut notes: Vec<String> = reading.note.iter().map(ToString::to_string).collect();
    notes.extend(problems(&survey));
    gathering
        .finish(
            topic.clone(),
            described,
            notes,
            survey.problems.losses() > 0,
        )
        .map_err(fails)
}

/// A record being gathered.
struct Gathering {
    plan: EstimationSettings,
    resolved: Meaning,
    first: Vec<RawSample>,
    running: Option<Conditioner>,
    conditioned: Vec<RateSample>,
    notes: Vec<String>,
    record: AngleRecord,
    capacity: usize,
    detector: Stillness,
    last: Option<(Nanos, Vector3<f64>)>,
    begin: Option<Nanos>,
    /// Intervals between samples that follow each other: how many, their sum, and the sum of the
    /// squares of what they differ from the first, ns.
    steps: u64,
    step_sum: i128,
    step_first: i64,
    step_squares: f64,
    filled: u64,
    bridges: u64,
    splits: u64,
    undecodable: u64,
}

impl Gathering {
    fn new(plan: &EstimationSettings, resolved: Meaning, capacity: usize) -> Gathering {
        Gathering {
            plan: plan.clone(),
            detector: Stillness::new(Limits::default()),
            resolved,
            first: Vec::new(),
            running: None,
            conditioned: Vec::new(),
            notes: Vec::new(),
            record: AngleRecord::new(capacity),
            capacity,
            last: None,
            begin: None,
            steps: 0,
            step_sum: 0,
            step_first: 0,
            step_squares: 0.0,
            filled: 0,
            bridges: 0,
            splits: 0,
            undecodable: 0,
        }
    }

    fn take(&mut self, raw: RawSample) -> std::result::Result<(), Diagnostic> {
        match &mut self.running {
            Some(conditioner) => {
                conditioner.push(std::slice::from_ref(&raw), &mut self.conditioned);
                self.drain();
            }
            None => {
                self.first.push(raw);
                if self.first.len() >= FEW {
                    self.begin()?;
                }
            }
        }
        Ok(())
    }

    fn undecodable(&mut self) {
        self.undecodable += 1;
        if let Some(conditioner) = &mut self.running {
            conditioner.push_undecodable(1);
        }
    }

    fn begin(&mut self) -> std::result::Result<(), Diagnostic> {
        let first = std::mem::take(&mut self.first);
        let (clock, warning) = choose_clock_as(&first, self.plan.clock, self.plan.stamps);
        if let Some(fatal @ ClockWarning::NoneMoves) = warning {
            return Err(Diagnostic::from(&fatal));
        }
        self.notes.extend(warning.map(|w| w.to_string()));
        self.resolved = self.resolved.settled(&first, clock);
        let settings = self
            .resolved
            .conditioning(&self.plan, clock, BodyRate::ZERO);
        let mut conditioner = Conditioner::new(&settings).map_err(|e| e.to_string())?;
        conditioner.push(&first, &mut self.conditioned);
        self.running = Some(conditioner);
        self.drain();
        Ok(())
    }

    fn drain(&mut self) {
        let spacing = self
            .running
            .as_ref()
            .and_then(|c| c.report().spacing_nanos)
            .unwrap_or(0);
        let mut samples = std::mem::take(&mut self.conditioned);
        for sample in samples.drain(..) {
            self.detector.push(&sample);
            self.add(&sample, spacing);
        }
        self.conditioned = samples;
    }

    fn add(&mut self, sample: &RateSample, spacing: i64) {
        self.begin.get_or_insert(sample.stamp);
        let value = match self.resolved.kind {
            SampleKind::Rate | SampleKind::DeltaAngle | SampleKind::Rotation => {
                *sample.gyro.as_vector()
            }
            SampleKind::Average => {
                let secs = sample.stamp.secs_since(sample.start);
                if secs <= 0.0 {
                    return;
                }
                sample.gyro.as_vector() / secs
            }
        };
        match (sample.join, self.last) {
            (Join::Continuous, Some((last, _))) => {
                let step = sample.stamp.since(last);
                if self.steps == 0 {
                    self.step_first = step;
                }
                self.steps += 1;
                self.step_sum += i128::from(step);
                self.step_squares += ((step - self.step_first) as f64).powi(2);
            }
            (Join::Bridge, Some((last, before))) => {
                let step = sample.stamp.since(last);
                let missing = if spacing > 0 {
                    (step.saturating_add(spacing / 2) / spacing - 1).max(0)
                } else {
                    0
                };
                if missing > FILLED_AT_ONCE {
                    self.splits += 1;
                    self.record.split();
                    self.record.push(&value);
                    self.last = Some((sample.stamp, value));
                    return;
                }
                self.bridges += 1;
                self.filled += missing as u64;
                for k in 1..=missing {
                    let part = k as f64 / (missing + 1) as f64;
                    self.record.push(&(before + (value - before) * part));
                }
            }
            (Join::Start, _) | (_, None) => {}
            (Join::Hold | Join::Reset, Some(_)) => {
                self.splits += 1;
                self.record.split();
            }
        }
        self.record.push(&value);
        self.last = Some((sample.stamp, value));
    }

    fn finish(
        mut self,
        topic: String,
        described: String,
        mut notes: Vec<String>,
        lost_in_file: bool,
    ) -> std::result::Result<AngleSeries, Diagnostic> {
        if self.running.is_none() {
            self.begin()?;
        }
        let mut report = Report::default();
        if let Some(mut conditioner) = self.running.take() {
            conditioner.finish(&mut self.conditioned);
            report = conditioner.report().clone();
            self.running = Some(conditioner);
        }
        self.drain();
        notes.append(&mut self.notes);
        let steps = self.steps.max(1) as f64;
        let mean = self.step_sum as f64 / steps;
        let off = mean - self.step_first as f64;
        Ok(AngleSeries {
            topic,
            described,
            resolved: self.resolved,
            record: self.record,
            capacity: self.capacity,
            interval: mean * 1e-9,
            unevenness: (self.step_squares / steps - off * off).max(0.0).sqrt() * 1e-9,
            secs: self
                .begin
                .zip(self.last)
                .map_or(0.0, |(begin, (end, _))| end.secs_since(begin)),
            filled: self.filled,
            bridges: self.bridges,
            splits: self.splits,
            rests: self.detector.finish(),
            report,
            undecodable: self.undecodable,
            skipped: self.plan.start.unwrap_or(0.0),
            notes,
            lost_in_file,
        })
    }
}

impl AngleSeries {
    /// Whether samples were lost.
    pub(super) fn is_lossy(&self) -> bool {
        self.lost_in_file || self.undecodable > 0 || self.report.counts.lost() > 0
    }

    /// Seconds at rest, of which the detector's last window may be cut short.
    pub(super) fn resting(&self) -> f64 {
        if self.rests.secs > 0.0 {
            (self.rests.secs + Limits::default().window_secs).min(self.secs)
        } else {
            0.0
        }
    }

    /// Whether it moved, so that what was fitted is motion and no noise.
    pub(super) fn moved(&self) -> bool {
        self.resting() < RESTING * self.secs
    }

    /// Warnings to read before the numbers are believed.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut all = self.notes.clone();
        if self.moved() {
            all.push(self.moving().to_string());
        }
        if self.bridges > 0 {
            all.push(
                Diagnostic::new(format!(
                    "{} missing samples in {} places were filled with straight lines",
                    self.filled, self.bridges
                ))
                .help("--max-gap 0 splits the record there instead")
                .to_string(),
            );
        }
        if self.splits > 0 {
            all.push(format!(
                "{} gaps split the record; no cluster reaches across one, so the longest times are lost",
                self.splits
            ));
        }
        if self.record.stride() > 1 {
            all.push(format!(
                "{} samples are more than the {} angles held: every {}th was kept, and the curve begins at {} s",
                self.record.count(),
                self.capacity,
                self.record.stride(),
                significant(self.record.stride() as f64 * self.interval, 3)
            ));
        }
        if self.unevenness > UNEVEN * self.interval {
            all.push(format!(
                "the stamps are uneven (rms {} of {} ms): samples were taken as evenly spaced",
                significant(self.unevenness * 1e3, 3),
                significant(self.interval * 1e3, 5)
            ));
        }
        let lost = self.report.counts.lost() + self.undecodable;
        if lost > 0 {
            all.push(format!("{lost} samples could not be used"));
        }
        all
    }

    /// Warning about how much it moved, and which part did not.
    fn moving(&self) -> Diagnostic {
        let said = Diagnostic::new(format!(
            "the sensor moved: at rest for {:.1} of {:.1} s, and motion looks like noise",
            self.resting(),
            self.secs
        ));
        let longest = self
            .rests
            .kept
            .iter()
            .max_by(|a, b| a.secs().total_cmp(&b.secs()));
        match (longest.filter(|r| r.secs() >= USEFUL), self.rests.first) {
            (Some(rest), Some(begin)) => said.help(format!("its longest rest is --start {:.1} --until {:.1}", self.skipped + rest.start.secs_since(begin), self.skipped + rest.end.secs_since(begin))),
            _ => said.help("record the sensor fixed to something heavy; if the rates look too large, --gyro-unit deg"),
        }
    }
}
