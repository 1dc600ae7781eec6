//! `strapd recover IN -o OUT`: everything intact in a damaged MCAP -> an intact MCAP. I/O.

use super::progress::Reporter;
use super::replay::CompressionArg;
use super::{Global, Outcome, print};
use crate::error::Result;
use crate::pipeline::recover::{self, Recovered};
use crate::report::summary::human_bytes;
use crate::sink::{Options, Target};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use strapd_recording::Source;
use strapd_recording::pool::Pool;
use strapd_recording::text::printable;

/// Salvage every intact message of a damaged recording, as an MCAP.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd recover crashed.mcap -o whole.mcap          a cut file, a crash while writing, flipped bits
  strapd recover crashed.mcap -o whole.mcap --json   what was salvaged and what was lost, for scripts

Channels, messages, attachments and metadata are carried over as they are, in the order of the file; the
output has the chunks, the index and the summary that the input may lack. A chunk whose checksum is wrong
is left out whole: nothing tells which of its messages are still true. What carries no checksum is
kept, and counted as unverified.

Exit codes: 0 nothing was damaged; 3 recovered, but something was damaged; 1 nothing was written.")]
pub struct Recover {
    /// The damaged recording (MCAP, ROS bag, ULog, rosbag2), or - for standard input
    #[arg(value_name = "IN")]
    pub source: String,
    /// The MCAP file to write
    #[arg(short, long = "output", value_name = "OUT")]
    pub output: String,
    /// Replace the output if it exists (never the input)
    #[arg(long)]
    pub force: bool,
    /// Compression of the output
    #[arg(long, value_enum, default_value = "zstd")]
    pub compression: CompressionArg,
}

/// Runs it.
///
/// # Errors
/// The input cannot be read or is no MCAP; the output cannot be written.
pub fn run(global: &Global, args: &Recover) -> Result<Outcome> {
    let run = recover::Recover {
        source: Source::parse(&args.source),
        target: Target::parse(&args.output)?,
        options: Options {
            force: args.force,
            compression: args.compression.into(),
            ..Options::default()
        },
    };
    let pool = Pool::new(global.threads)?;
    let mut reporter = Reporter::new(global, &args.source);
    let result = recover::run(&run, &pool, &mut |position| reporter.update(position));
    reporter.finish();
    let recovered = result?;
    if global.json {
        print(&format!("{}\n", as_json(&args.source, &recovered)))?;
    } else if !global.quiet {
        print(&text(&args.source, &recovered))?;
    }
    if !recovered.was_damaged() {
        return Ok(Outcome::Done);
    }
    if global.quiet || global.json {
        tracing::warn!("{}: {}", args.source, verdict(&recovered));
    }
    Ok(Outcome::Lossy)
}

/// Problems written out in the text; `--json` has all that are kept.
const SAID: usize = 20;

fn verdict(recovered: &Recovered) -> String {
    let problems = &recovered.survey.problems;
    let places = match problems.total() {
        1 => "1 place".to_owned(),
        n => format!("{n} places"),
    };
    let mut verdict = format!(
        "damaged in {places}, {} not used",
        human_bytes(problems.bytes_skipped())
    );
    if problems.messages_lost() > 0 {
        let _ = write!(
            verdict,
            ", at least {} messages lost",
            problems.messages_lost()
        );
    }
    verdict
}

fn text(source: &str, recovered: &Recovered) -> String {
    let Recovered {
        written, survey, ..
    } = recovered;
    let mut out = format!("{source}: ");
    out.push_str(&match recovered.was_damaged() {
        true => verdict(recovered),
        false => "nothing was damaged".to_owned(),
    });
    out.push('\n');
    let problems = &survey.problems;
    for problem in problems.first().iter().take(SAID) {
        let _ = writeln!(out, "  {}", printable(&problem.to_string()));
    }
    let said = problems.first().len().min(SAID) as u64;
    if problems.total() > said {
        let _ = writeln!(out, "  and {} more", problems.total() - said);
    }
    let unverified = survey.facts.unverified_chunks;
    if unverified > 0 {
        let _ = writeln!(out, "  {unverified} chunks carry no CRC: kept unverified");
    }
    let _ = writeln!(
        out,
        "{}  {}  {} messages",
        written
            .path
            .as_deref()
            .map_or_else(String::new, |p| p.display().to_string()),
        human_bytes(written.bytes),
        written.messages
    );
    for found in &survey.channels {
        let topic = printable(&found.channel.topic);
        let described = strapd_recording::recording::log_channel::described(&found.channel);
        let _ = writeln!(out, "  {topic}  {described}  {} messages", found.messages);
    }
    for (count, what) in [
        (recovered.attachments, "attachments"),
        (recovered.metadata, "metadata records"),
    ] {
        if count > 0 {
            let _ = writeln!(out, "  {count} {what}");
        }
    }
    out
}

fn as_json(source: &str, recovered: &Recovered) -> Value {
    let Recovered {
        written, survey, ..
    } = recovered;
    let problems = &survey.problems;
    json!({
        "source": source,
        "input_bytes": survey.file_size,
        "output": written.path.as_ref().map(|p| p.display().to_string()),
        "output_bytes": written.bytes,
        "messages": written.messages,
        "topics": survey.channels.iter().map(|found| json!({
            "topic": found.channel.topic,
            "type": found.channel.schema.as_deref().map(|s| s.name.as_str()),
            "encoding": found.channel.message_encoding,
            "messages": found.messages,
        })).collect::<Vec<_>>(),
        "attachments": recovered.attachments,
        "metadata": recovered.metadata,
        "unverified_chunks": survey.facts.unverified_chunks,
        "damaged": recovered.was_damaged(),
        "bytes_skipped": problems.bytes_skipped(),
        "messages_lost_at_least": problems.messages_lost(),
        "problems_total": problems.total(),
        "problems": problems.first().iter().map(|problem| json!({
            "offset": problem.offset,
            "what": problem.kind.to_string(),
            "messages": problem.messages,
        })).collect::<Vec<_>>(),
    })
}
