//! A recording -> whether it holds nothing but attitudes that strapd made before. I/O.
//!
//! A stage of its own because such files lie beside the recordings they were made of, where a pattern of a shell
//! takes both,
//! and look like them: an IMU with rates. Those are the recording's, less the bias, and to integrate them again says
//! less than the recording does.

use super::log_channel::LogChannel;
use crate::format::Format;
use crate::lines::{HEAD_KEPT, Lines};
use crate::mcap::{self, OURS, Reader, Survey, WalkOptions};
use crate::parquet::Rows;
use std::collections::BTreeSet;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// First bytes that tell whether to look closer.
pub(super) const HEAD: u64 = HEAD_KEPT as u64;
/// Beginning of a table of attitudes.
const TABLE: &[u8] = b"stamp_ns,qw,qx,qy,qz,roll_deg,";
/// The same of one in Parquet, as text.
const TABLE_BY_COLUMNS: &[u8] = b"stamp_ns,qw,qx,qy,qz,wx,wy,wz,sigma_x,";
/// Beginning of a line with an attitude.
const LINE: &[u8] = b"{\"class\":\"ATT\",";
/// The transforms beside the attitudes.
const TRANSFORMS: &str = "/tf";

/// Attitudes of a run of strapd.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MadeBefore {
    /// Recording it was made of, as far as it states that.
    pub of: Option<String>,
}

impl fmt::Display for MadeBefore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = self.of.as_deref().map(crate::text::printable);
        let of = of.map_or_else(String::new, |of| format!(" of {of}"));
        write!(f, "attitudes that strapd made{of}, and no recording")
    }
}

impl MadeBefore {
    /// Finds whether a file on this machine was made before, by its beginning and the summary at its end (one of ours
    /// without a summary is read whole); of anything else, and where it cannot be read, nothing is said.
    #[must_use]
    pub fn in_file(path: &Path) -> Option<MadeBefore> {
        if !path.is_file() {
            return None;
        }
        let mut head = Vec::new();
        let file = File::open(path).ok()?;
        file.take(HEAD).read_to_end(&mut head).ok()?;
        if let Some(text) = in_text(&head) {
            return Some(text);
        }
        if Format::of_bytes(&head) == Some(Format::Parquet) {
            let rows = Rows::open(File::open(path).ok()?, None).ok()?;
            let mut text = Vec::new();
            rows.take(HEAD).read_to_end(&mut text).ok()?;
            return in_text(&text);
        }
        let is_ours = Format::of_bytes(&head) == Some(Format::Mcap)
            && head.windows(OURS.len()).any(|part| part == OURS.as_bytes());
        let reader = Reader::open(path).ok().filter(|_| is_ours)?;
        in_survey(&mcap::survey(&reader, &WalkOptions::default()).ok()?)
    }

    /// Finds the same of lines or rows that are being read, from a file or a pipe: by what had come of them when they
    /// were opened.
    #[must_use]
    pub fn in_lines(lines: &Lines<impl Read>) -> Option<MadeBefore> {
        in_text(lines.head())
    }
}

/// Finds the same in metadata that name the topics it was written with, if there are no others.
pub(super) fn in_survey(survey: &Survey) -> Option<MadeBefore> {
    let outputs = outputs(survey);
    let is_ours = |topic: &str| topic == TRANSFORMS || outputs.contains(topic);
    let mut topics = survey.channels.iter().map(|c| c.channel.topic.as_str());
    (!outputs.is_empty() && topics.all(is_ours)).then(|| MadeBefore {
        of: survey
            .facts
            .provenance
            .get("input")
            .filter(|name| !name.is_empty())
            .cloned(),
    })
}

/// Topics that a run put out, by its metadata.
fn outputs(survey: &Survey) -> BTreeSet<&str> {
    let said = survey.facts.provenance.iter();
    said.filter(|(key, _)| *key == "output_topic" || key.ends_with(" output_topic"))
        .map(|(_, topic)| topic.as_str())
        .collect()
}

/// Marks what a run put out, by its metadata or by its name beside the input's.
pub(super) fn mark(channels: &mut [LogChannel], survey: &Survey) {
    let outputs = outputs(survey);
    let inputs: BTreeSet<String> = channels
        .iter()
        .filter(|k| k.role.has_rate)
        .filter_map(|k| k.channel.topic.strip_suffix("/data_raw"))
        .map(str::to_owned)
        .collect();
    for known in channels {
        let topic = known.channel.topic.as_str();
        let is_beside = topic
            .strip_suffix("/data")
            .is_some_and(|name| inputs.contains(name));
        known.is_derived =
            known.channel.metadata.contains_key("rotates") || outputs.contains(topic) || is_beside;
    }
}

/// The first bytes of a text are of attitudes.
pub(super) fn in_text(head: &[u8]) -> Option<MadeBefore> {
    let has = |head: &[u8], word: &[u8]| head.windows(word.len()).any(|part| part == word);
    let first = head.split(|byte| *byte == b'\n').next().unwrap_or_default();
    // Lines of a daemon and of a simulation have rates between them, and the truth is nobody's estimate.
    let is_line = first.starts_with(LINE)
        && has(first, b"\"rotates\":")
        && !has(first, b"\"id\":\"truth\"")
        && !has(head, b"\"class\":\"RATE\"");
    let is_table = [TABLE, TABLE_BY_COLUMNS]
        .iter()
        .any(|table| head.starts_with(table));
    (is_line || is_table).then_some(MadeBefore { of: None })
}
