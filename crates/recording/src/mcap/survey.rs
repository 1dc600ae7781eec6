//! A file -> what is in it, without decoding. I/O.
//!
//! A stage of its own because the question comes before any choice of topic. The summary answers
//! at once where it can be believed; otherwise the whole file is walked, in bounded memory.

use super::block::Compression;
use super::channels::{Channel, Table};
use super::container::{self, Container};
use super::index::PassedOver;
use super::input::Input;
use super::messages::Tally;
use super::scan::{Facts, OtherRecords, Scanner};
use super::summary::{self, Summary};
use super::walk::{WalkOptions, walk};
use super::{Reader, read_error};
use crate::error::{Error, Result};
use crate::format::Format;
use crate::records::op;
use crate::records::problem::{ProblemKind, Problems};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A channel and what its messages add up to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ChannelSurvey {
    /// The channel.
    pub channel: Arc<Channel>,
    /// Number of messages.
    pub messages: u64,
    /// Least and greatest log time, ns; unknown when the summary was asked.
    pub times: Option<(u64, u64)>,
    /// Bytes of payload; unknown when the summary was asked.
    pub bytes: Option<u64>,
}

/// Name that a header gives this program, before its version.
pub(crate) const OURS: &str = "strapd ";

/// Contents of a log.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Survey {
    /// Facts that it states about itself.
    pub facts: Facts,
    /// Bytes of the file; unknown for a stream.
    pub file_size: Option<u64>,
    /// Channels, in order of definition (from the summary: by id).
    pub channels: Vec<ChannelSurvey>,
    /// Messages on all channels.
    pub messages: u64,
    /// Least and greatest log time, ns; `None` when there is no message.
    pub times: Option<(u64, u64)>,
    /// Whether the file has a summary that can be used.
    pub has_summary: bool,
    /// Whether the counts above are the summary's, not our own.
    pub from_summary: bool,
    /// Problems.
    pub problems: Problems,
    /// Chunks that were not read: its summary states that nothing there was wanted.
    pub passed_over: PassedChunks,
}

/// Chunks that were not read.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct PassedChunks {
    /// Number of chunks.
    pub chunks: u64,
    /// Size of them as they lie in the file, bytes.
    pub bytes: u64,
}

impl Survey {
    /// Adds what is in the next file of the same recording, whose channels are these of all.
    pub(crate) fn append(&mut self, next: &Survey, whole: &[Arc<Channel>]) {
        if self.channels.is_empty() {
            self.facts = next.facts.clone();
            self.has_summary = next.has_summary;
            self.from_summary = next.from_summary;
        }
        self.has_summary &= next.has_summary;
        self.from_summary &= next.from_summary;
        self.file_size = match (self.file_size, next.file_size) {
            (Some(a), Some(b)) => a.checked_add(b),
            (a, b) => a.or(b),
        };
        self.messages = self.messages.saturating_add(next.messages);
        let all = [self.times, next.times].into_iter().flatten();
        self.times = all.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
        self.problems.merge(next.problems.clone());
        self.passed_over.chunks += next.passed_over.chunks;
        self.passed_over.bytes += next.passed_over.bytes;
        for (found, channel) in next.channels.iter().zip(whole) {
            let mut all = self.channels.iter_mut();
            match all.find(|of| Arc::ptr_eq(&of.channel, channel)) {
                Some(of) => of.messages = of.messages.saturating_add(found.messages),
                None => self.channels.push(ChannelSurvey {
                    channel: channel.clone(),
                    ..found.clone()
                }),
            }
        }
    }

    /// Takes what was not read from the summary that says what is there.
    pub(super) fn pass_over(&mut self, passed: &PassedOver) {
        self.passed_over = PassedChunks {
            chunks: passed.chunks.len() as u64,
            bytes: passed.bytes(),
        };
        for found in &mut self.channels {
            let id = found.channel.id;
            if !passed.is_wanted(id) {
                found.messages = passed.counts.get(&id).copied().unwrap_or(0);
                (found.times, found.bytes) = (None, None);
            }
        }
        self.messages = self.channels.iter().map(|found| found.messages).sum();
        self.times = passed.times;
    }

    pub(super) fn add_up<'a>(&mut self, channels: impl Iterator<Item = (&'a Arc<Channel>, Tally)>) {
        let mut all = Tally::default();
        for (channel, tally) in channels {
            all.merge(&tally);
            self.channels.push(ChannelSurvey {
                channel: Arc::clone(channel),
                messages: tally.messages,
                times: (tally.messages > 0).then_some((tally.first, tally.last)),
                bytes: Some(tally.bytes),
            });
        }
        self.messages = all.messages;
        self.times = (all.messages > 0).then_some((all.first, all.last));
    }
}

/// Surveys a file: from its summary when that holds together and has statistics, else by
/// walking all of it. Damage in the data section shows only in a walk.
///
/// # Errors
/// [`Error::Read`]; [`Error::NotTwice`] for a stream, whose survey is in the report of its [`walk()`].
pub fn survey(reader: &Reader, options: &WalkOptions<'_>) -> Result<Survey> {
    let (Input::File(file), Some(again)) = (&reader.input, reader.again()) else {
        return Err(Error::NotTwice {
            path: reader.name().to_owned(),
        });
    };
    let found = match reader.format {
        Format::Mcap => summary::read(file, reader.limits),
        _ => Ok(Ok(None)),
    };
    let found = found.map_err(|e| read_error(&file.path, 0, e))?;
    if let Ok(Some(summary)) = found
        && let Some(survey) = from_summary(reader, summary)?
    {
        return Ok(survey);
    }
    let nothing = |_: &(), _: &super::Message<'_>, _: &mut Vec<()>| {};
    let report = walk(
        again,
        options,
        |_| None::<()>,
        nothing,
        |_| ControlFlow::Continue(()),
    )?;
    Ok(report.survey)
}

fn from_summary(reader: &Reader, summary: Summary) -> Result<Option<Survey>> {
    // Topics without a message are not chosen: that there is none anywhere is looked up.
    let Some(statistics) = summary.statistics.filter(|s| s.message_count > 0) else {
        return Ok(None);
    };
    let mut problems = Problems::default();
    let mut table = Table::<()>::new(Default::default(), reader.limits.definitions);
    let definitions = &summary.definitions;
    let schemas = definitions.schemas.values().map(|body| (op::SCHEMA, body));
    let channels = definitions
        .channels
        .values()
        .map(|body| (op::CHANNEL, body));
    for (opcode, body) in schemas.chain(channels) {
        table.define(opcode, body, 0, &mut |_| None, &mut problems);
    }
    // Statistics about channels the summary does not define would be counts of unknown things.
    let counts: BTreeMap<u16, u64> = statistics.channel_message_counts.iter().copied().collect();
    let known = |id| definitions.channels.contains_key(id);
    let sum = counts.values().try_fold(0u64, |sum, n| sum.checked_add(*n));
    if !problems.is_empty()
        || sum != Some(statistics.message_count)
        || counts.iter().any(|(id, n)| *n > 0 && !known(id))
    {
        return Ok(None);
    }
    let mut survey = Survey {
        file_size: reader.size(),
        has_summary: true,
        from_summary: true,
        messages: statistics.message_count,
        times: Some((statistics.message_start_time, statistics.message_end_time)),
        facts: header(reader)?,
        problems,
        ..Survey::default()
    };
    survey.facts.metadata = u64::from(statistics.metadata_count);
    survey.facts.attachments = u64::from(statistics.attachment_count);
    let mut chunks = 0;
    for (name, n) in &summary.chunks {
        let Some(compression) = Compression::named(name) else {
            return Ok(None);
        };
        survey.facts.chunks.insert(compression, *n);
        chunks += n;
    }
    if chunks != u64::from(statistics.chunk_count) {
        return Ok(None);
    }
    survey.channels = table
        .channels()
        .map(|channel| ChannelSurvey {
            channel: Arc::clone(channel),
            messages: counts.get(&channel.id).copied().unwrap_or(0),
            times: None,
            bytes: None,
        })
        .collect();
    Ok(Some(survey))
}

/// The facts known from the header, and of what strapd wrote from the metadata behind it.
fn header(reader: &Reader) -> Result<Facts> {
    let Some(again) = reader.again() else {
        return Ok(Facts::default());
    };
    let name = again.name().to_owned();
    let mut scanner = Scanner::new(again.input, again.limits, OtherRecords::Everything);
    scanner.next().map_err(|e| read_error(&name, 0, e))?;
    if scanner.facts.library.starts_with(OURS) {
        scanner.next().map_err(|e| read_error(&name, 0, e))?;
    }
    Ok(Facts {
        profile: scanner.facts.profile,
        library: scanner.facts.library,
        provenance: scanner.facts.provenance,
        ..Facts::default()
    })
}

/// Whether a file's summary can be used, and the definitions in it; what is wrong with it is noted.
pub(super) fn fallback(
    reader: &Reader,
    problems: &mut Problems,
) -> std::io::Result<(bool, super::channels::Fallback)> {
    let Input::File(file) = &reader.input else {
        return Ok(Default::default());
    };
    match reader.format {
        Format::Mcap => {}
        Format::Bag => return Ok((false, container::bag::definitions(file, reader.limits)?)),
        _ => return Ok(Default::default()),
    }
    match summary::read(file, reader.limits)? {
        Ok(Some(summary)) => Ok((true, summary.definitions)),
        Ok(None) => Ok(Default::default()),
        Err(why) => {
            problems.add(file.len, ProblemKind::BadSummary { why }, None);
            Ok(Default::default())
        }
    }
}
