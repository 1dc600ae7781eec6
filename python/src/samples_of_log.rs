//! One topic of a recorded log -> its samples as numpy arrays. I/O.
//!
//! The guarded reader for whoever wants samples and no attitude: what `strapd cat` prints, without text in between.

use crate::errand::{self, Stopped};
use crate::noted::noted;
use crate::raw_columns::{RawColumns, Time};
use crate::recorded::{pool, raised};
use crate::refusal;
use crate::words::Words;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::SampleKind;
use strapd_recording::Recording;
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::topic_reading::TopicReading;
use strapd_replay::error::{Error, Result};
use strapd_replay::pipeline::opening;

/// Samples between two looks whether to end.
const BLOCK: usize = 4096;

struct LogSamples {
    topic: String,
    columns: RawColumns,
    kind: Option<SampleKind>,
    lost: u64,
}

/// The samples of a topic of the log at `path` (rad/s, m/s^2, x forward, y left, z up), and what was warned of.
#[pyfunction]
#[pyo3(signature = (path, words, /))]
pub fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    words: BTreeMap<String, Vec<String>>,
) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let words = Words::new(words);
    let (done, said) = errand::run(py, move |stopped| noted(|| taken(&path, &words, stopped)))?;
    let found = done.map_err(|error| raised(py, &error))?;
    let dict = found.columns.into_dict(py)?;
    dict.set_item("topic", found.topic)?;
    dict.set_item("kind", found.kind.map(SampleKind::name))?;
    dict.set_item("lost", found.lost)?;
    Ok((
        dict,
        said.iter().map(|line| refusal::of_log(line)).collect(),
    ))
}

fn taken(path: &Path, words: &Words, stopped: &Stopped) -> Result<LogSamples> {
    let time = match words.text("time").unwrap_or("header") {
        "header" => Time::Header,
        "log" => Time::Log,
        "publish" => Time::Publish,
        other => {
            return Err(Error::usage(
                Diagnostic::new(format!("time: there is no {other:?}"))
                    .help("one of header, log, publish"),
            ));
        }
    };
    let selection = words.selection()?;
    let (named, options) = (selection.topic.as_deref(), &selection.decode);
    let pool = pool(words.parsed("threads")?.unwrap_or(0))?;
    let log = Recording::told_apart(&opening::open(path)?, named, options, &pool)?;
    let mut decoders = Decoders::new(options);
    let reading = TopicReading::new(&log, named, &mut decoders)?.with_fields();
    let (mut columns, mut meant) = (RawColumns::new(time), None);
    let lost = reading.walk_in_flu(&pool, |raw, kind| {
        columns.push(raw);
        meant = meant.or(kind);
        let is_due = columns.len().is_multiple_of(BLOCK);
        Ok::<_, Error>(match is_due && stopped.is_set() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
    })?;
    if let Some(note) = &reading.note {
        tracing::warn!("{}: {note}", path.display());
    }
    Ok(LogSamples {
        topic: reading.name().to_owned(),
        columns,
        kind: meant,
        lost,
    })
}
