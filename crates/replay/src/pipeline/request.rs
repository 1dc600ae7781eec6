//! Request of a replay: from where, to where, how. Pure.

use super::attitude_track::Track;
use super::audience::Audience;
use crate::error;
use crate::sink::{self, FrameNames, Target};
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::condition::Clock;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::Nanos;
use strapd_recording::decode::Options;
use strapd_recording::{Error, Selection, Source};

/// A replay to be done.
#[derive(Clone, Debug)]
pub struct ReplayRequest {
    /// Source.
    pub source: Source,
    /// Targets.
    pub targets: Vec<Target>,
    /// Selection of samples.
    pub selection: Selection,
    /// Settings by which samples are understood and integrated.
    pub plan: EstimationSettings,
    /// Options by which outputs are made.
    pub options: sink::Options,
    /// Whether every message of the input is copied to MCAP outputs.
    pub copy_input: bool,
    /// `--out-rate`, Hz.
    pub out_rate: Option<f64>,
    /// `--at`: instants of the attitudes that are written, in place of the samples'.
    pub instants: Option<Arc<[Nanos]>>,
    /// Names of frames in outputs.
    pub frames: FrameNames,
    /// `--speed`; `None` = as fast as possible.
    pub speed: Option<f64>,
    /// Audience that is served if a target listens.
    pub audience: Option<Arc<dyn Audience>>,
    /// `--against-recorded`: the reference's topic, empty = found.
    pub against: Option<String>,
    /// A reference from another file: it is the one of `against`, and of an audience.
    pub reference: Option<Arc<Track>>,
    /// The command, for the output's metadata.
    pub command: String,
    /// Whether the output's metadata say in which folder the input lies.
    pub record_paths: bool,
}

impl ReplayRequest {
    /// A replay of `source` into nothing, every setting at its default.
    #[must_use]
    pub fn new(source: Source) -> ReplayRequest {
        ReplayRequest {
            source,
            targets: Vec::new(),
            selection: Selection::default(),
            plan: EstimationSettings::default(),
            options: sink::Options::default(),
            copy_input: false,
            out_rate: None,
            instants: None,
            frames: FrameNames::default(),
            speed: None,
            audience: None,
            against: None,
            reference: None,
            command: String::new(),
            record_paths: false,
        }
    }

    /// Options by which samples are read: under another clock than their own nobody needs their stamps.
    pub(super) fn decode_options(&self) -> Options {
        Options {
            are_stamps_unread: self.plan.clock != Clock::Header,
            is_unit_stated: self.plan.states_gyro_unit(),
            ..self.selection.decode.clone()
        }
    }

    /// Other meanings for which samples are taken, to compare.
    pub(super) fn other_kinds(&self) -> impl Iterator<Item = strapd_attitude::record::SampleKind> {
        self.against
            .iter()
            .flat_map(|_| super::sample_kinds::kinds())
    }
}

/// A topic that cannot be run, in the words of the stage that refused it.
pub(super) fn refused(path: &Path, topic: &str, what: Diagnostic) -> error::Error {
    Error::Topic {
        path: path.to_owned(),
        topic: topic.to_owned(),
        what,
    }
    .into()
}
