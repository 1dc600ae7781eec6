//! `strapd check FILE...`: every finding about a log, with the flag that helps. I/O.

use super::estimation::Estimation;
use super::frames::BaseFrame;
use super::tables::Tables;
use super::{Global, Outcome, own_output, print, serial, with_each};
use crate::error::Result;
use crate::pipeline::check::{Examination, examine};
use crate::pipeline::opening;
use crate::report::findings::Severity;
use crate::report::page::FindingRow;
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use strapd_recording::pool::Pool;
use strapd_recording::text::printable;
use strapd_replay::inspection::Checked;

/// Everything that may spoil the attitude from a log: stamps, gaps, units, axes, bias, bad samples.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd check flight.mcap
  strapd check *.mcap                               (one behind the other)
  strapd check flight.mcap --bias auto --gyro-range 34.9     judged as replay with these flags makes it
  strapd check flight.mcap --aid none                        the gyro alone
  strapd check 'serial:///dev/ttyUSB0?baud=115200&for=10'    ten seconds of a board on a serial port
  strapd check flight.mcap -v                                every finding, not the ten worst of the topic that is used
  strapd check flight.mcap --json | jq '.findings[] | select(.severity != \"note\")'

It judges the attitude that replay makes with the same flags, and marks what a flag deals with.
Exit codes: 0 nothing found; 3 errors or warnings found. Notes alone are no finding, nor is what a flag deals with.")]
pub struct Check {
    #[arg(value_name = "FILE", required = true, help = super::recordings("Recordings", ", or folders of one"))]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub estimation: Estimation,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub base: BaseFrame,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
}

/// Findings that are printed at most, and topics that are named without a choice.
const MOST: usize = 10;
const FEW: usize = 3;

/// Runs it.
///
/// # Errors
/// The log cannot be read, or the topic named is not in it.
pub fn run(global: &Global, args: &Check) -> Result<Outcome> {
    let pool = Pool::new(global.threads)?;
    let mut selection = args.estimation.selection()?;
    args.tables.put(&mut selection.decode)?;
    let asked = Examination {
        selection,
        plan: args.estimation.plan()?,
        reference_topic: String::new(),
        drawing: None,
        command: "strapd check".to_owned(),
    };
    let mut between = "";
    if args.files.iter().any(|file| serial::asks_for_ports(file)) {
        return serial::list();
    }
    let files = own_output::without(args.files.clone(), args.estimation.topic.as_deref())?;
    with_each(&files, |file| {
        let file = serial::captured(file, None)?;
        let (text, outcome) = one(global, file.path(), (&asked, &args.base), &pool)?;
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
    file: &Path,
    (asked, base): (&Examination<'_>, &BaseFrame),
    pool: &Pool,
) -> Result<(String, Outcome)> {
    let input = opening::open(file)?;
    let mut asked = asked.clone();
    base.put(&mut asked.plan, (&input, &asked.selection), pool)?;
    let checked = examine(&input, &asked, pool, &mut |_| {})?;
    let found = FindingRow::all(&checked, &checked.plan);
    let open = found.iter().filter(|row| row.answered.is_none());
    let worst = open.map(|row| row.finding.severity).max();
    let text = if global.json {
        let value = json!({
            "file": input.name().display().to_string(),
            "findings": found.iter().map(in_json).collect::<Vec<_>>(),
            "worst": worst.map(Severity::name),
        });
        format!("{value}\n")
    } else {
        text(input.name(), &checked, &found, global.verbose > 0)
    };
    let outcome = match worst > Some(Severity::Note) {
        true => Outcome::Lossy,
        false => Outcome::Done,
    };
    Ok((text, outcome))
}

/// JSON as a program in Python has it, which sets nothing that could deal with a finding.
fn in_json(row: &FindingRow) -> serde_json::Value {
    match row.answered {
        Some(_) => row.json(),
        None => row.finding.json(),
    }
}

/// Findings that are printed: those of the file and of topics that are used, the worst first, and no more than a screen
/// holds; with `is_all` every one.
fn printed<'f>(checked: &Checked, found: &'f [FindingRow], is_all: bool) -> Vec<&'f FindingRow> {
    if is_all {
        return found.iter().collect();
    }
    let is_used = |topic: &str| {
        let mut of = checked.topics.iter().filter(|t| t.looked.topic == topic);
        topic.is_empty() || of.any(|t| t.looked.is_likely)
    };
    let nobody_is_used = checked.topics.iter().all(|t| !t.looked.is_likely);
    let of_used = |row: &&FindingRow| nobody_is_used || is_used(&row.finding.topic);
    // What is open before what a flag deals with; the rest is in order already.
    let (open, answered): (Vec<_>, Vec<_>) = found
        .iter()
        .filter(of_used)
        .partition(|row| row.answered.is_none());
    open.into_iter().chain(answered).take(MOST).collect()
}

fn text(file: &Path, checked: &Checked, found: &[FindingRow], is_all: bool) -> String {
    let mut out = String::new();
    let shown = printed(checked, found, is_all);
    let is_listed = |used: bool| is_all || checked.topics.len() <= FEW || used;
    let left = checked
        .topics
        .iter()
        .filter(|t| !is_listed(t.looked.is_likely))
        .count();
    let mut topics: Vec<String> = checked
        .topics
        .iter()
        .filter(|t| is_listed(t.looked.is_likely))
        .map(|t| {
            format!(
                "{} ({} samples)",
                printable(&t.looked.topic),
                t.looked.quality.count
            )
        })
        .collect();
    if left > 0 {
        topics.push(format!("{left} more topics"));
    }
    let _ = writeln!(out, "{}  {}", file.display(), topics.join(", "));
    for row in &shown {
        let finding = &row.finding;
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
        if let Some(flag) = row.answered {
            let _ = writeln!(out, "  {:<31} -> dealt with by {flag}", "");
            continue;
        }
        let advice = match (finding.advice.as_str(), finding.flags().as_str()) {
            ("", "") => continue,
            (advice, "") => advice.to_owned(),
            ("", flags) => flags.to_owned(),
            (advice, flags) => format!("{advice}: {flags}"),
        };
        let _ = writeln!(out, "  {:<31} -> {advice}", "");
    }
    if shown.len() < found.len() {
        let left = found.len() - shown.len();
        let _ = writeln!(
            out,
            "  and {left} more: -v prints all, --topic NAME those of one topic"
        );
    }
    let count = |severity| found.iter().filter(|row| row.is_open(severity)).count();
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
