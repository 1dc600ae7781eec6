//! Results of looking at a log's topics of samples, and of replaying them.
//!
//! Below the pipeline, which finds it out, and the findings, which judge it.

use crate::finding::Finding;
use crate::summary::TopicSummary;
use strapd_attitude::condition::ClockWarning;
use strapd_attitude::condition::quality::QualitySummary;
use strapd_attitude::condition::stillness::{self, Rests};
use strapd_attitude::condition::{Clock, ClockSet, GyroUnit};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, Aiding, ClockVerdict, EstimationSettings, Meaning};
use strapd_attitude::record::{Counts, RawSample};
use strapd_recording::MadeBefore;
use strapd_recording::recording::beside::TopicOfVectors;
use strapd_recording::recording::payload_type::PayloadType;

/// One topic of samples, looked at.
#[derive(Debug)]
pub struct Inspection {
    /// Name: the topic, or one of several sources on it.
    pub topic: String,
    /// The topic.
    pub of: String,
    /// Type and encoding.
    pub described: PayloadType,
    /// The frame its first message names.
    pub frame: String,
    /// Meaning of its samples by default.
    pub resolved: Meaning,
    /// Statistics.
    pub quality: QualitySummary,
    /// The unit of its rates: rad/s where the format states any, else that which was taken for granted.
    pub quality_unit: GyroUnit,
    /// Rests, rad/s.
    pub rests: Rests,
    /// The bias they give.
    pub bias: Option<stillness::BiasEstimate>,
    /// Outcomes of its samples in a run by default.
    pub counts: Counts,
    /// Steps of its stamp clock that the recorder's did not make.
    pub clock_set: Option<ClockSet>,
    /// Batches in its stamps, and their speed by the recorder's clock.
    pub clocks: ClockVerdict,
    /// Payloads that could not be decoded.
    pub undecodable: u64,
    /// The clock the statistics are on.
    pub clock: Clock,
    /// Warning about the clock.
    pub clock_warning: Option<Diagnostic>,
    /// Auxiliary measurements that may correct its attitude.
    pub aid: Aids,
    /// Whether it is as likely the IMU as any: what is taken where nobody names another.
    pub is_likely: bool,
    /// Whether there is an orientation to be held against, in its samples or in messages of its own.
    pub has_reference: bool,
}

impl Inspection {
    /// Returns whether no clock of the recording moves: nothing is left but a stated rate.
    #[must_use]
    pub fn has_no_clock(&self) -> bool {
        let warning = self.clock_warning.as_ref();
        warning.and_then(Diagnostic::code) == Some(ClockWarning::NO_CLOCK)
    }
}

/// Measurements in the samples themselves, or on topics of their own, that may correct an attitude.
#[derive(Clone, Debug, Default)]
pub struct Aids {
    /// Whether the samples carry specific forces.
    pub has_force: bool,
    /// Mean length of the forces in the first samples, as recorded in the unit the format states (else its own).
    pub mean_force: Option<f64>,
    /// Factor that makes them m/s^2: 9.80665 of forces in g.
    pub force_scale: f64,
    /// Whether `--aid auto` takes gravity.
    pub gravity: bool,
    /// Notes about the forces.
    pub notes: Vec<String>,
    /// Length of the first field in the samples themselves.
    pub own_field: Option<f64>,
    /// Topics with fields, and the one that is taken unnamed.
    pub fields: (Vec<TopicOfVectors>, Option<String>),
    /// Topics with forces.
    pub forces: Vec<TopicOfVectors>,
}

impl Aids {
    /// Makes it from the first samples of a topic.
    pub(crate) fn of(
        plan: &EstimationSettings,
        resolved: &Meaning,
        first: &[RawSample],
        beside: &[RawSample],
    ) -> Aids {
        let plan = EstimationSettings {
            aid: Aid::Auto,
            ..plan.clone()
        };
        let has_force = |samples: &[RawSample]| samples.iter().any(|raw| raw.accel.is_some());
        // Forces in messages of their own stand in where the rates come alone.
        let of_forces = match !has_force(first) && has_force(beside) {
            true => beside,
            false => first,
        };
        let mut notes = Vec::new();
        // With `auto` what cannot be is a warning.
        let aiding = Aiding::decide(&plan, resolved, of_forces, &mut notes).unwrap_or_default();
        let forces = || {
            of_forces
                .iter()
                .filter_map(|raw| raw.accel)
                .map(|f| resolved.force(f).as_vector().norm())
        };
        let (sum, n) = forces()
            .filter(|length| length.is_finite())
            .fold((0.0, 0.0), |(sum, n), length| (sum + length, n + 1.0));
        let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
        Aids {
            has_force: forces().next().is_some(),
            mean_force: (n > 0.0).then(|| sum / n),
            force_scale: aiding.map_or(1.0, |aiding| aiding.force_scale),
            gravity: aiding.is_some(),
            notes: notes.iter().map(ToString::to_string).collect(),
            own_field: first
                .iter()
                .chain(beside)
                .find_map(|raw| raw.mag)
                .map(length),
            ..Aids::default()
        }
    }
}

/// A log, examined.
#[derive(Debug)]
pub struct Checked {
    /// Problems of the file itself, the first few in words.
    pub problems: Vec<String>,
    /// Number of these that lost data.
    pub file_losses: u64,
    /// Size in bytes, where that can be known.
    pub file_size: Option<u64>,
    /// The profile it names.
    pub profile: String,
    /// Origin of attitudes that are no recording.
    pub made_before: Option<MadeBefore>,
    /// Finding that no topic of samples could be chosen.
    pub no_topic: Option<Finding>,
    /// Nothing was to correct the attitude that is judged.
    pub is_gyro_alone: bool,
    /// Settings by which the log was examined, with what was mended.
    pub plan: EstimationSettings,
    /// Topics of samples.
    pub topics: Vec<CheckedTopic>,
    /// Topics of samples beyond those, which were not examined.
    pub left_out: Vec<String>,
}

impl Checked {
    /// Calls the file `name` in all words in which it was called `path`.
    pub fn rename(&mut self, path: &str, name: &str) {
        let summaries = self.topics.iter_mut().map(|topic| &mut topic.replayed);
        let mut words: Vec<&mut String> = Vec::new();
        for summary in summaries {
            match summary {
                Ok(summary) => {
                    words.extend(summary.findings.iter_mut().map(|found| &mut found.what))
                }
                Err(why) => words.extend(why.texts()),
            }
        }
        let no_topic = self.no_topic.iter_mut();
        words.extend(no_topic.flat_map(|found| [&mut found.what, &mut found.advice]));
        words.extend(&mut self.problems);
        for word in words {
            if word.contains(path) {
                *word = word.replace(path, name);
            }
        }
    }
}

/// A topic of samples, looked at and replayed.
#[derive(Debug)]
pub struct CheckedTopic {
    /// Statistics of the samples as recorded.
    pub looked: Inspection,
    /// Summary of a replay with the same settings, or the reason why it refuses.
    pub replayed: std::result::Result<Box<TopicSummary>, Diagnostic>,
}
