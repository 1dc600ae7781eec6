//! Samples of one topic in order -> its estimator, and the watches over its sensor. I/O: a temporary file for what does
//! not fit in memory.
//!
//! Apart from the session because a topic knows no other, and no outlet: samples that a program holds go through it, too.

use super::attitude_stats::AttitudeStats;
use super::warming_watch::WarmingWatch;
use crate::error::Result;
use crate::field_watch::FieldWatch;
use crate::pipeline::delivery::Resampled;
use crate::pipeline::history::History;
use crate::pipeline::recorded::RecordedTrack;
use crate::pipeline::sample_kinds::AgainstRecorded;
use crate::sink::Target;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::condition::LoneZeros;
use strapd_attitude::condition::quality::BrokenAxes;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, EstimationSettings, Estimator, Meaning, Prepared};
use strapd_attitude::record::{Nanos, RawSample, SampleKind};
use strapd_recording::decode::Undecodable;
use strapd_recording::recording::channel_route::PayloadNotes;
use strapd_recording::recording::payload_type::PayloadType;

/// One estimated topic of a run.
#[derive(Debug)]
pub(in crate::pipeline) struct Topic {
    /// Name of its source.
    pub name: String,
    /// Topic of its attitude.
    pub output_topic: String,
    /// Type and encoding.
    pub described: PayloadType,
    /// Meaning of its samples.
    pub resolved: Meaning,
    /// Decisions made before the first was integrated.
    pub prepared: Prepared,
    /// Observations in its payloads.
    pub noticed: Arc<PayloadNotes>,
    /// Things to know, beside those of `prepared`.
    pub warnings: Vec<Diagnostic>,
    /// Estimator.
    pub estimator: Estimator,
    /// Figures of its attitudes.
    pub output: AttitudeStats,
    /// Samples without any rate amid others.
    pub zeros: LoneZeros,
    /// The stamp of the last sample, used or not.
    pub last_stamp: Option<Nanos>,
    /// Whether its magnetic field is one, where it is to tell north.
    pub field: Option<FieldWatch>,
    /// The first payload that could not be decoded.
    pub first_undecodable: Option<(Nanos, Undecodable)>,
    /// Comparison with the recorded orientation.
    pub against: Option<AgainstRecorded>,
    /// Outcome of the instants of `--at`.
    pub instants: Option<Resampled>,
    /// Series kept to be drawn, for a report.
    pub history: Option<History>,
    /// The recorded orientation, for who is shown it beside the estimate.
    pub recorded: Option<RecordedTrack>,
    /// The bias against the temperature of its samples.
    pub warming: WarmingWatch,
    /// Faults of single axes of the gyro.
    pub broken: BrokenAxes,
}

impl Topic {
    /// A topic ready to run.
    ///
    /// # Errors
    /// [`strapd_recording::Error::Topic`] when the settings do not fit it.
    pub(in crate::pipeline) fn new(
        path: &Path,
        plan: &EstimationSettings,
        found: TopicInfo,
        prepared: Prepared,
        against: bool,
    ) -> Result<Topic> {
        let refuse = |what: Diagnostic| strapd_recording::Error::Topic {
            path: path.to_owned(),
            topic: found.name.clone(),
            what,
        };
        // What nothing stated, the preparation has found out.
        let resolved = found.resolved.with_kind(&prepared.sample_kind);
        let mut estimator = Estimator::new(plan, &resolved, &prepared).map_err(refuse)?;
        estimator.watch_sensors(&resolved, &prepared);
        let against = against
            .then(|| AgainstRecorded::new(plan, &resolved, &prepared))
            .transpose()
            .map_err(refuse)?;
        let field = (plan.aid == Aid::GravityAndField).then(|| FieldWatch::new(resolved.kind));
        let mut warnings = found.warnings;
        let known = plan.calibration.as_deref();
        let mismatch = known.and_then(|known| known.mismatch(&found.name));
        warnings.extend(mismatch.map(Diagnostic::from));
        Ok(Topic {
            name: found.name,
            output_topic: found.output_topic,
            described: found.described,
            resolved,
            prepared,
            noticed: found.noticed,
            warnings,
            estimator,
            output: AttitudeStats::default(),
            zeros: LoneZeros::default(),
            last_stamp: None,
            field,
            first_undecodable: None,
            instants: None,
            against,
            history: None,
            recorded: None,
            warming: WarmingWatch::default(),
            broken: BrokenAxes::new(1.0),
        })
    }

    /// Takes a sample: into the estimator, and before the watches over its sensor. Whether it is time to look at what
    /// is known by it.
    pub(in crate::pipeline) fn take(&mut self, raw: &RawSample) -> bool {
        self.watch(raw);
        let is_due = self.warming.note(raw);
        self.estimator.take(raw);
        if raw.is_beside {
            return is_due;
        }
        let is_rate = matches!(self.resolved.kind, SampleKind::Rate | SampleKind::Average);
        if let Some(rates) = raw.gyro.map(|gyro| self.resolved.rates(gyro)) {
            self.zeros.push(&rates);
            if is_rate {
                self.broken.push(&rates);
            }
        }
        is_due
    }

    /// Notes the stamp of a sample, and looks at its field.
    pub(super) fn watch(&mut self, raw: &RawSample) {
        let Some(stamp) = self.prepared.clock.read(raw) else {
            return;
        };
        if !raw.is_beside {
            self.last_stamp = Some(stamp);
        }
        let Some(field) = &mut self.field else { return };
        let raw = self.resolved.in_flu(raw);
        if let Some(mag) = raw.mag {
            field.take_field(mag, stamp);
        }
        if let Some(gyro) = raw.gyro.filter(|_| !raw.is_beside) {
            field.take_rate(gyro, stamp);
        }
    }

    /// Puts what does not fit in memory of a recording that is smoothed into a file without a name in the folder of the
    /// output, or in that of temporary files.
    pub(in crate::pipeline) fn spool_beside(&mut self, targets: &[Target]) {
        let folder = targets.iter().find_map(|target| match target {
            Target::File { path, .. } => path.parent(),
            _ => None,
        });
        let here = folder.map(|folder| match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        });
        let beside = here.and_then(|here| tempfile::tempfile_in(here).ok());
        match beside.map_or_else(tempfile::tempfile, Ok) {
            Ok(file) => self.estimator.spool_to(Box::new(file)),
            Err(why) => tracing::warn!(
                "{}: all samples are held in memory: no temporary file in {}: {why}",
                self.name,
                std::env::temp_dir().display()
            ),
        }
    }
}

/// Facts about a topic before its first sample.
#[derive(Clone, Debug)]
pub(in crate::pipeline) struct TopicInfo {
    /// Name.
    pub name: String,
    /// Topic of its attitude.
    pub output_topic: String,
    /// Type and encoding.
    pub described: PayloadType,
    /// Meaning of its samples.
    pub resolved: Meaning,
    /// Observations in its payloads.
    pub noticed: Arc<PayloadNotes>,
    /// Things to know.
    pub warnings: Vec<Diagnostic>,
}
