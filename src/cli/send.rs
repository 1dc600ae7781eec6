//! `strapd send LOG ADDRESS`: a recording's samples to a daemon, as they were measured in time. I/O.
//!
//! Apart from `cat` because it has two ends: the log is read ahead by a thread of its own, so that a line leaves when
//! it is due, and what the daemon answers is heard all the while.

use super::cat::line;
use super::tables::Tables;
use super::{Global, Outcome, known_words, replay, serial};
use crate::client;
use crate::client::remote::Remote;
use crate::client::secret::Secret;
use crate::client::sender::Sender;
use crate::config::selection;
use crate::error::{Error, Result};
use crate::pipeline::opening;
use crate::pipeline::pace::Pace;
use crate::sink::UNAUTHORISED;
use clap::Args;
use serde_json::json;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::Nanos;
use strapd_recording::Recording;
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::topic_reading::TopicReading;
use tokio::sync::mpsc;

/// Lines handed over at once by the thread that reads.
const BATCH: usize = 256;
/// Batches read ahead of what was sent.
const AHEAD_BATCHES: usize = 8;
/// Bytes sent at once, when nothing waits for its time.
const CHUNK: usize = 32 << 10;

/// A recording's samples to a daemon (strapd serve), as fast as they were measured.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd send flight.mcap                                  to the daemon of this machine
  strapd send flight.mcap tcp://robot:4550 --speed max     all at once
  strapd send flight.ulg ws://127.0.0.1:8765 --id left     under another name
  strapd send serial:///dev/ttyUSB0 tcp://robot:4550       lines of a board, as they come
  zstd -dc log.mcap.zst | strapd send - unix:///run/strapd.sock   a pipe, which is read to its end first")]
pub struct Send {
    #[arg(value_name = "LOG", help = super::recordings("Recording", ""))]
    pub source: PathBuf,
    /// Address of the daemon: tcp://HOST:PORT, ws://HOST:PORT, unix:///PATH
    #[arg(value_name = "ADDRESS", default_value = "tcp://127.0.0.1:4550")]
    pub address: String,
    /// Topic; the IMU topic by default
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Path of a value in the message: ROLE=PATH, as in replay
    #[arg(long = "field", value_name = "ROLE=PATH")]
    pub fields: Vec<String>,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
    /// Name for the sensor in the daemon; the topic by default
    #[arg(long, value_name = "NAME")]
    pub id: Option<String>,
    /// Speed as a factor of the time in which they were measured, or max
    #[arg(
        long,
        value_name = "FACTOR",
        default_value = "1",
        value_parser = known_words::speed(),
        hide_possible_values = true
    )]
    pub speed: String,
    /// The token the daemon asks for is in this file (first line, mode 0600)
    #[arg(long, value_name = "FILE", env = "STRAPD_TOKEN_FILE")]
    pub token_file: Option<PathBuf>,
}

/// A sample as it is sent.
struct Line {
    due: Nanos,
    text: String,
    /// Whether it has no rate: a force or a field that corrects those that have one.
    is_beside: bool,
}

/// Progress of the thread that reads.
#[derive(Debug, Default)]
struct Read {
    topic: String,
    lost: u64,
}

/// Runs it.
///
/// # Errors
/// The log cannot be read or decoded; nobody answers, or whoever answered has gone.
pub fn run(global: &Global, args: &Send) -> Result<Outcome> {
    let remote = Remote::parse(&args.address)?;
    if matches!(remote, Remote::UdpListen(_)) {
        return Err(Error::usage(
            Diagnostic::new(format!(
                "send: {}: listens, and sends nothing",
                args.address
            ))
            .help("tcp://HOST:PORT, ws://HOST:PORT or unix:///PATH of a strapd serve"),
        ));
    }
    if serial::asks_for_ports(&args.source) {
        return serial::list();
    }
    let pace = Pace::new(replay::speed(&args.speed)?);
    let token = args
        .token_file
        .as_deref()
        .map(|file| Secret::read("--token-file", file))
        .transpose()?;
    if serial::is_meant(&args.source) {
        return serial::forward(&args.source, &remote, token.as_ref());
    }
    let mut options = selection(None, &args.fields, false, [None; 2])?.decode;
    args.tables.put(&mut options)?;
    // Looked at before anybody is called: a log that cannot be read is not the daemon's business.
    let pool = Pool::new(global.threads)?;
    let log = Recording::told_apart(
        &opening::open(&args.source)?,
        args.topic.as_deref(),
        &options,
        &pool,
    )?;
    let (give, mut take) = mpsc::channel::<Vec<Line>>(AHEAD_BATCHES);
    let begun = Instant::now();
    let (read, sent) = std::thread::scope(|scope| {
        let (options, pool) = (&options, &pool);
        let reader = scope.spawn(move || read(args, &log, options, pool, give));
        let source = super::outputs::shown(&args.source.to_string_lossy());
        let name = format!("send {source}");
        let sent = client::run(&name, send(&remote, token.as_ref(), pace, &mut take));
        // Whoever reads on is told that nobody sends.
        drop(take);
        let read = reader
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (read, sent)
    });
    let sent = sent?;
    let read = read?;
    say(global, &remote, (&read, &sent), begun.elapsed())?;
    Ok(match read.lost + sent.complaints {
        0 => Outcome::Done,
        _ => Outcome::Lossy,
    })
}

/// Prints what was sent.
fn say(
    global: &Global,
    remote: &Remote,
    (read, sent): (&Read, &Sent),
    took: Duration,
) -> Result<()> {
    let secs = took.as_secs_f64();
    if global.json {
        super::print(&format!(
            "{}\n",
            json!({
                "address": remote.to_string(), "topic": read.topic, "sent": sent.samples, "sent_beside": sent.besides,
                "data_secs": sent.data_secs, "elapsed_secs": secs, "lost": read.lost, "errors": sent.complaints,
            })
        ))?;
    } else if !global.quiet {
        let besides = match sent.besides {
            0 => String::new(),
            n => format!(" and {n} lines of forces or fields"),
        };
        tracing::info!(
            "sent {} samples of {}{besides} to {remote}: {:.3} s of data in {secs:.3} s",
            sent.samples,
            read.topic,
            sent.data_secs
        );
    }
    Ok(())
}

/// Reads the log and hands its lines over, until it ends or nobody takes them.
fn read(
    args: &Send,
    log: &Recording,
    options: &Options,
    pool: &Pool,
    give: mpsc::Sender<Vec<Line>>,
) -> Result<Read> {
    let mut decoders = Decoders::new(options);
    let reading = TopicReading::new(log, args.topic.as_deref(), &mut decoders)?.with_fields();
    reading.say_note();
    let topic = reading.name().to_owned();
    let id = args.id.as_deref().unwrap_or(&topic);
    let (mut batch, mut seq) = (Vec::with_capacity(BATCH), 0);
    let lost = reading.walk_in_flu::<Error>(pool, |raw, kind| {
        batch.push(Line {
            due: raw.header.unwrap_or(raw.log),
            text: line::rate(id, seq, raw, kind).to_string(),
            is_beside: raw.is_beside,
        });
        seq += u64::from(!raw.is_beside);
        let goes_on = batch.len() < BATCH || give.blocking_send(std::mem::take(&mut batch)).is_ok();
        Ok(match goes_on {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        })
    })?;
    // Nobody takes it: the other end says why.
    let _ = give.blocking_send(batch);
    Ok(Read { topic, lost })
}

/// Failure with what helps, where that is known.
pub(super) fn with_help(what: String, has_token: bool) -> Diagnostic {
    let says = |words: &[&str]| words.iter().any(|word| what.contains(word));
    let help = if says(&["Connection refused", "connection refused", "No such file"]) {
        "is `strapd serve` running there? ADDRESS names where it listens"
    } else if says(&[UNAUTHORISED, "bad_auth", "401"]) && !has_token {
        "--token-file FILE shows the daemon's token (or STRAPD_TOKEN_FILE)"
    } else if says(&[UNAUTHORISED, "bad_auth", "401"]) {
        "--token-file: the first line of FILE is to be the daemon's token"
    } else {
        return what.into();
    };
    Diagnostic::from(what).help(help)
}

/// Account of what was sent.
#[derive(Debug, Default)]
struct Sent {
    samples: u64,
    /// Lines of forces and fields beside them.
    besides: u64,
    /// Time between the first stamp and the last, s.
    data_secs: f64,
    /// Errors that came back.
    complaints: u64,
}

async fn send(
    remote: &Remote,
    token: Option<&Secret>,
    mut pace: Option<Pace>,
    lines: &mut mpsc::Receiver<Vec<Line>>,
) -> Result<Sent> {
    let failed = |what: String| Error::Remote {
        address: remote.to_string().into(),
        what: with_help(what, token.is_some()),
    };
    let mut sender = Sender::connect(remote, token).await.map_err(failed)?;
    let (mut sent, mut chunk) = (Sent::default(), String::new());
    let mut span: Option<(Nanos, Nanos)> = None;
    while let Some(batch) = lines.recv().await {
        for line in batch {
            let due = line.due;
            let wait = pace
                .as_mut()
                .map_or(Duration::ZERO, |pace| pace.until(due, Instant::now()));
            if !wait.is_zero() || chunk.len() + line.text.len() >= CHUNK {
                sender.send(&mut chunk).await.map_err(failed)?;
                sender.listen(wait).await.map_err(failed)?;
            }
            if !chunk.is_empty() {
                chunk.push('\n');
            }
            chunk.push_str(&line.text);
            if line.is_beside {
                sent.besides += 1;
            } else {
                sent.samples += 1;
            }
            let first = span.map_or(due, |(first, _)| first);
            span = Some((first, due));
        }
        // What is due leaves, though the reader be behind.
        if pace.is_some() || lines.is_empty() {
            sender.send(&mut chunk).await.map_err(failed)?;
        }
    }
    sender.send(&mut chunk).await.map_err(failed)?;
    sent.complaints = sender.finish().await.map_err(failed)?;
    sent.data_secs = span.map_or(0.0, |(first, last)| last.secs_since(first));
    Ok(sent)
}
