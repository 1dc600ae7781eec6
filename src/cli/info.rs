//! `strapd info FILE...`: what a log holds, how good it is, and what to do next. I/O.

mod aids;
mod words;

use super::tables::Tables;
use super::{Global, Outcome, print, serial, with_each};
use crate::error::{Error, Result};
use crate::pipeline::inspection::look;
use crate::pipeline::opening;
use clap::Args;
use std::path::{Path, PathBuf};
use strapd_recording::Recording;
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;
use strapd_recording::recording::opened::problems;
use strapd_recording::recording::topics;
use strapd_replay::info::Overview;

/// Topics, rates, clocks and frames of a log, and what to do next.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd info flight.mcap
  strapd info *.mcap                               (one behind the other)
  strapd info flight.mcap --json | jq '.imu[0].rate_hz'
  strapd info serial:///dev/ttyUSB0?baud=115200    ten seconds of a board on a serial port; serial: lists the ports")]
pub struct Info {
    #[arg(value_name = "FILE", required = true, help = super::recordings("Recordings", ", or folders of one"))]
    pub files: Vec<PathBuf>,
    /// Look at this topic too, even if it does not look like an IMU
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Path of a value in the message: ROLE=PATH, as in replay
    #[arg(long = "field", value_name = "ROLE=PATH")]
    pub fields: Vec<String>,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
}

/// Runs it.
///
/// # Errors
/// The log cannot be read, or the topic named is not in it.
pub fn run(global: &Global, args: &Info) -> Result<Outcome> {
    let pool = Pool::new(global.threads)?;
    let mut options = Options {
        fields: args
            .fields
            .iter()
            .map(|f| f.parse().map_err(|e| Error::usage(format!("--field: {e}"))))
            .collect::<Result<_>>()?,
        ..Options::default()
    };
    args.tables.put(&mut options)?;
    if args.files.iter().any(|file| serial::asks_for_ports(file)) {
        return serial::list();
    }
    let mut between = "";
    with_each(&args.files, |file| {
        let file = serial::captured(file, None)?;
        let (text, outcome) = one(global, args, file.path(), (&options, &pool))?;
        let text = match global.json {
            true => text,
            false => file.retold(&text),
        };
        print(&format!("{between}{text}"))?;
        between = if global.json { "" } else { "\n" };
        Ok(outcome)
    })
}

fn one(
    global: &Global,
    args: &Info,
    file: &Path,
    (options, pool): (&Options, &Pool),
) -> Result<(String, Outcome)> {
    let input = opening::open(file)?;
    let log = Recording::told_apart(&input, args.topic.as_deref(), options, pool)?;
    if let Some(topic) = &args.topic
        && !log.has(topic)
    {
        return Err(strapd_recording::Error::NoSuchTopic {
            path: input.name().to_owned(),
            topic: topic.clone(),
            topics: topics::listing(&log.candidates()),
        }
        .into());
    }
    let looks = look(&log, args.topic.as_deref(), options, pool)?;
    let survey = &looks.survey;
    let lossy = survey.problems.losses() > 0;
    let found = Overview {
        input: &input,
        made_before: log.made_before().filter(|_| args.topic.is_none()),
        survey,
        problems: problems(survey),
        channels: &log.channels,
        looked: &looks.topics,
        left_out: &looks.left_out,
    };
    let text = match global.json {
        true => format!("{}\n", found.json()),
        false => words::text(&found),
    };
    let outcome = match lossy {
        true => Outcome::Lossy,
        false => Outcome::Done,
    };
    Ok((text, outcome))
}
