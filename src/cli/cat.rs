//! `strapd cat SOURCE`: decoded samples of a file, or attitudes of a daemon, as NDJSON, CSV or a table. I/O.

pub(super) mod line;
mod url;

use super::tables::Tables;
use super::{Global, Outcome, serial};
use crate::client::remote::Remote;
use crate::config::selection;
use crate::error::{Error, Result};
use crate::pipeline::opening;
use crate::sink::{RAW_HEADER, push_raw_row};
use clap::{Args, ValueEnum};
use std::io::{BufWriter, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{RawSample, SampleKind};
use strapd_recording::Recording;
use strapd_recording::pool::Pool;
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::topic_reading::TopicReading;
use strapd_recording::remote_object;

/// Decoded samples of a file, or attitudes of a daemon, as NDJSON, CSV or a table: rad/s, m/s^2, axes FLU.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd cat flight.mcap -n 5 --format table
  strapd cat flight.mcap --topic /imu > samples.ndjson     (strapd replay samples.ndjson reads it)
  strapd cat flight.mcap --topic /odom --format csv        (so it does a CSV)
  strapd cat tcp://127.0.0.1:4550 -n 100                   attitudes of a daemon as they come
  strapd cat ws://127.0.0.1:8765 --id imu0 --rate-hz 10 -x 60 --format csv
  strapd cat udp-listen://127.0.0.1:9870                   attitudes that somebody sends here
  strapd cat serial:///dev/ttyUSB0 -x 5                    samples of a board in 5 s; serial: lists the ports")]
pub struct Cat {
    #[arg(value_name = "SOURCE", help = super::recordings(
        "Recording",
        "; or a daemon: tcp://HOST:PORT, ws://HOST:PORT, unix:///PATH, udp-listen://HOST:PORT",
    ))]
    pub source: PathBuf,
    /// Topic; the IMU topic by default
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Path of a value in the message: ROLE=PATH, as in replay
    #[arg(long = "field", value_name = "ROLE=PATH")]
    pub fields: Vec<String>,
    /// Layout of a table.
    #[command(flatten)]
    pub tables: Tables,
    /// Form of the output
    #[arg(long, value_enum, default_value = "ndjson")]
    pub format: Format,
    /// Stop after so many samples (of a daemon: attitudes)
    #[arg(short = 'n', long, value_name = "N")]
    pub count: Option<u64>,
    /// Stop after so many seconds
    #[arg(short = 'x', long, value_name = "SECS", value_parser = seconds, help_heading = "Daemon")]
    pub seconds: Option<f64>,
    /// Only this sensor. May be given several times
    #[arg(long = "id", value_name = "NAME", help_heading = "Daemon")]
    pub ids: Vec<String>,
    /// Largest number of attitudes a second of each sensor
    #[arg(long, value_name = "HZ", value_parser = seconds, help_heading = "Daemon")]
    pub rate_hz: Option<f64>,
    /// The token the daemon asks for is in this file (first line, mode 0600)
    #[arg(
        long,
        value_name = "FILE",
        env = "STRAPD_TOKEN_FILE",
        help_heading = "Daemon"
    )]
    pub token_file: Option<PathBuf>,
}

/// `--format`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// One JSON object per sample.
    Ndjson,
    /// One row per sample under a header row.
    Csv,
    /// Aligned columns for people.
    Table,
}

/// Runs it.
///
/// # Errors
/// The log cannot be read or decoded; stdout cannot be written.
pub fn run(global: &Global, args: &Cat) -> Result<Outcome> {
    if serial::asks_for_ports(&args.source) {
        return serial::list();
    }
    let is_port = serial::is_meant(&args.source);
    match args.source.to_str() {
        Some(text)
            if !is_port && Remote::is_meant(text) && remote_object::meant(text).is_none() =>
        {
            return url::run(args, text);
        }
        _ => {}
    }
    for (given, flag) in [
        (args.seconds.is_some() && !is_port, "-x"),
        (!args.ids.is_empty(), "--id"),
        (args.rate_hz.is_some(), "--rate-hz"),
    ] {
        if given {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "cat {}: {flag} is for daemons",
                    super::outputs::shown(&args.source.to_string_lossy())
                ))
                .help("-n N stops after N samples, --topic NAME takes one topic"),
            ));
        }
    }
    let mut options = selection(None, &args.fields, false, [None; 2])?.decode;
    args.tables.put(&mut options)?;
    let pool = Pool::new(global.threads)?;
    let source = serial::captured(&args.source, args.seconds)?;
    let log = Recording::told_apart(
        &opening::open(source.path())?,
        args.topic.as_deref(),
        &options,
        &pool,
    )?;
    let mut decoders = Decoders::new(&options);
    let reading = TopicReading::new(&log, args.topic.as_deref(), &mut decoders)?.with_fields();
    reading.say_note();
    let mut printer = Printer::new(args.format, reading.name(), args.count)?;
    let lost = reading.walk_in_flu::<Error>(&pool, |raw, kind| {
        let wants_more = printer
            .print(raw, kind)
            .map_err(|e| Error::writing("stdout", e))?;
        Ok(match wants_more {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        })
    })?;
    printer
        .out
        .flush()
        .map_err(|e| Error::writing("stdout", e))?;
    if printer.left_out > 0 {
        tracing::warn!(
            "{} forces or fields with stamps of their own have no row: --format ndjson has them",
            printer.left_out
        );
    }
    if lost > 0 {
        return Ok(Outcome::Lossy);
    }
    Ok(Outcome::Done)
}

/// A number of seconds (or times a second) above 0, and not above a century.
fn seconds(text: &str) -> std::result::Result<f64, String> {
    text.strip_suffix('s')
        .unwrap_or(text)
        .parse()
        .ok()
        .filter(|v| *v > 0.0 && *v < 3.2e9)
        .ok_or_else(|| "expected a number above 0".to_owned())
}

struct Printer {
    out: BufWriter<std::io::Stdout>,
    format: Format,
    topic: String,
    left: u64,
    /// Forces and fields of other sensors, which no row has a place for.
    left_out: u64,
    seq: u64,
    row: Vec<u8>,
}

impl Printer {
    fn new(format: Format, topic: &str, count: Option<u64>) -> Result<Printer> {
        let mut out = BufWriter::with_capacity(1 << 16, std::io::stdout());
        let head = match format {
            Format::Ndjson => b"".as_slice(),
            Format::Csv => RAW_HEADER,
            Format::Table => {
                b"               stamp s            gyro x            y            z      accel x            y            z           qw       qx       qy       qz\n"
            }
        };
        out.write_all(head)
            .map_err(|e| Error::writing("stdout", e))?;
        Ok(Printer {
            out,
            format,
            topic: topic.to_owned(),
            left: count.unwrap_or(u64::MAX),
            left_out: 0,
            seq: 0,
            row: Vec::new(),
        })
    }

    /// Prints one, with what the format says it means; says whether more are wanted.
    fn print(&mut self, raw: &RawSample, kind: Option<SampleKind>) -> std::io::Result<bool> {
        if raw.is_beside {
            match self.format {
                Format::Ndjson => writeln!(self.out, "{}", line::rate(&self.topic, 0, raw, kind))?,
                Format::Csv | Format::Table => self.left_out += 1,
            }
            return Ok(true);
        }
        if self.left == 0 {
            return Ok(false);
        }
        self.left -= 1;
        match self.format {
            Format::Ndjson => {
                writeln!(self.out, "{}", line::rate(&self.topic, self.seq, raw, kind))?;
            }
            Format::Csv => {
                self.row.clear();
                push_raw_row(&mut self.row, raw, kind.map_or("", SampleKind::name));
                self.out.write_all(&self.row)?;
            }
            Format::Table => self.table(raw)?,
        }
        self.seq += 1;
        Ok(self.left > 0)
    }

    fn table(&mut self, raw: &RawSample) -> std::io::Result<()> {
        let (sec, nsec) = raw.header.unwrap_or(raw.log).to_sec_nanosec();
        write!(self.out, "{sec:>12}.{nsec:09}     ")?;
        for vector in [raw.gyro, raw.accel] {
            match vector {
                Some(v) => v.iter().try_for_each(|c| write!(self.out, "{c:>13.6}"))?,
                None => write!(self.out, "{:>13}{:>13}{:>13}", "-", "-", "-")?,
            }
        }
        match raw.orientation {
            Some([w, rest @ ..]) => {
                write!(self.out, "{w:>13.6}")?;
                rest.iter().try_for_each(|c| write!(self.out, "{c:>9.6}"))?;
            }
            None => write!(self.out, "{:>13}", "-")?,
        }
        writeln!(self.out)
    }
}
