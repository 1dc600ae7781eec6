//! A recording -> the samples that are selected, in order. I/O.
//!
//! Apart from the recording because it is all of it at once: opened, chosen from, read.

use super::decoders::Decoders;
use super::input::Input;
use super::opened::Recording;
use super::selection::Selection;
use super::topic_reading::{TopicReading, walk_in_flu};
use super::warn::Warn;
use crate::error::{Error, Result};
use crate::pool::Pool;
use crate::text::printable;
use std::ops::ControlFlow;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{RawSample, SampleKind};

impl Recording {
    /// Opens a recording of any format, a folder of one, a pipe, or standard input (`-`), and looks at what is in it.
    /// What is to be known of it and is no error is told to `warn`.
    ///
    /// # Errors
    /// It cannot be opened or read, or is none.
    pub fn open(path: &Path, selection: &Selection, pool: &Pool, warn: &Warn) -> Result<Recording> {
        let input = Input::open(path, warn)?;
        Recording::told_apart(&input, selection.topic.as_deref(), &selection.decode, pool)
    }

    /// Gives `take` the samples that are selected, in the order of the recording, until it has enough or fails: the
    /// topic
    /// of each, or of several publishers on one the name that tells them apart; the sample in rad/s, m/s^2 and body
    /// axes
    /// x forward, y left, z up; and what its format says a rate means. Forces and fields with stamps of their own that
    /// belong to the samples of the one topic come between them ([`RawSample::is_beside`]). Payloads that could not
    /// be read are told to whom the recording was opened with, and how many were lost comes back.
    ///
    /// # Errors
    /// No topic of samples, several and none selected, one that cannot be decoded; reading fails; as `take`.
    pub fn samples<E: From<Error>>(
        &self,
        selection: &Selection,
        pool: &Pool,
        mut take: impl FnMut(
            &str,
            &RawSample,
            Option<SampleKind>,
        ) -> std::result::Result<ControlFlow<()>, E>,
    ) -> std::result::Result<u64, E> {
        let choice = self.choose(self.name(), selection.topic.as_deref())?;
        if let Some(note) = &choice.note {
            let said = format!("{}: {note}", self.name().display());
            self.input().warn().say(&said);
        }
        let mut decoders = Decoders::new(&selection.decode);
        let mut readings = Vec::new();
        for topic in &choice.topics {
            readings.push(TopicReading::of(self, topic, &mut decoders)?);
        }
        let asked = selection.accel.as_ref().or(selection.mag.as_ref());
        match (readings.pop(), asked) {
            (Some(one), _) if readings.is_empty() => readings.push(one.with_besides(selection)?),
            (_, Some(asked)) => {
                return Err(self
                    .belongs_to_any(&asked.topic, choice.topics.len())
                    .into());
            }
            (last, None) => readings.extend(last),
        }
        walk_in_flu(self, &readings, pool, |at, raw, kind| {
            let topic = readings.get(at).map_or("", TopicReading::name);
            take(topic, raw, kind)
        })
    }

    fn belongs_to_any(&self, topic: &str, topics: usize) -> Error {
        Error::Unsupported {
            path: self.name().to_owned(),
            what: Diagnostic::new(format!(
                "{} could belong to any of {topics} topics",
                printable(topic)
            ))
            .help("select one of them"),
        }
    }
}
