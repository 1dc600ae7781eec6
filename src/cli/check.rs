//! `strapd check FILE...`: every finding about a log, with the flag that helps. I/O.

use super::tables::Tables;
use super::{Global, Outcome, made_before, print, with_each};
use crate::error::{Error, Result};
use crate::pipeline::check::check;
use crate::pipeline::logged;
use crate::report::findings::{Finding, Severity, findings};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;
use strapd_recording::text::printable;
use strapd_replay::inspection::Checked;

/// Everything that may spoil the attitude from a log: stamps, gaps, units, axes, bias, bad samples.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd check flight.mcap
  strapd check *.mcap                               (one behind the other)
  strapd check flight.mcap --json | jq '.findings[] | select(.severity != \"note\")'

Exit codes: 0 nothing found; 3 errors or warnings found. Notes alone are no finding.")]
pub struct Check {
    /// Recordings: MCAP, ULog, bags of ROS 1 and 2, videos of a GoPro, NDJSON, tables, or folders of one; - is standard input
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Only this topic, though it be not obviously an IMU's
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Where a value lies in the message: ROLE=PATH, as in replay
    #[arg(long = "field", value_name = "ROLE=PATH")]
    pub fields: Vec<String>,
    /// How a table is to be read.
    #[command(flatten)]
    pub tables: Tables,
}

/// Runs it.
///
/// # Errors
/// The log can not be read, or the topic named is not in it.
pub fn run(global: &Global, args: &Check) -> Result<Outcome> {
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
    let mut between = "";
    let files = made_before::without(args.files.clone(), args.topic.as_deref())?;
    with_each(&files, |file| {
        let (text, outcome) = one(global, args, file, (&options, &pool))?;
        print(&format!("{between}{text}"))?;
        between = if global.json { "" } else { "\n" };
        Ok(outcome)
    })
}

fn one(
    global: &Global,
    args: &Check,
    file: &Path,
    (options, pool): (&Options, &Pool),
) -> Result<(String, Outcome)> {
    let input = logged::open(file)?;
    let checked = check(&input, args.topic.as_deref(), options, pool)?;
    let found = findings(&checked);
    let worst = found.iter().map(|f| f.severity).max();
    let text = if global.json {
        let value = json!({
            "file": input.name().display().to_string(),
            "findings": found.iter().map(Finding::json).collect::<Vec<_>>(),
            "worst": worst.map(Severity::name),
        });
        format!("{value}\n")
    } else {
        text(input.name(), &checked, &found)
    };
    let outcome = match worst > Some(Severity::Note) {
        true => Outcome::Lossy,
        false => Outcome::Done,
    };
    Ok((text, outcome))
}

fn text(file: &Path, checked: &Checked, found: &[Finding]) -> String {
    let mut out = String::new();
    let topics: Vec<String> = checked
        .topics
        .iter()
        .map(|t| {
            format!(
                "{} ({} samples)",
                printable(&t.looked.topic),
                t.looked.quality.count
            )
        })
        .collect();
    let _ = writeln!(out, "{}  {}", file.display(), topics.join(", "));
    for finding in found {
        let topic = if checked.topics.len() > 1 && !finding.topic.is_empty() {
            format!("{}: ", printable(&finding.topic))
        } else {
            String::new()
        };
        let _ = writeln!(
            out,
            "  {:<8} {:<22} {topic}{}",
            finding.severity.name(),
            finding.code,
            finding.what
        );
        let advice = match (finding.advice.as_str(), finding.flags().as_str()) {
            ("", "") => continue,
            (advice, "") => advice.to_owned(),
            ("", flags) => flags.to_owned(),
            (advice, flags) => format!("{advice}: {flags}"),
        };
        let _ = writeln!(out, "  {:<31} -> {advice}", "");
    }
    let count = |severity| found.iter().filter(|f| f.severity == severity).count();
    let _ = writeln!(
        out,
        "{}",
        match (count(Severity::Error), count(Severity::Warning)) {
            (0, 0) => "nothing wrong was found".to_owned(),
            (errors, warnings) => format!(
                "{errors} error{}, {warnings} warning{}",
                if errors == 1 { "" } else { "s" },
                if warnings == 1 { "" } else { "s" }
            ),
        }
    );
    out
}
