//! `strapd cat URL`: attitudes of a daemon as NDJSON, CSV or a table. I/O.

use super::{Cat, Format};
use crate::address::Address;
use crate::cli::Outcome;
use crate::cli::send::with_help;
use crate::client;
use crate::client::remote::Remote;
use crate::client::secret::Secret;
use crate::client::watcher::{Said, Watcher, request};
use crate::error::{Error, Result};
use crate::serve::guard::limits::Allowance;
use crate::serve::guard::shutdown::Signals;
use crate::sink::roll_pitch_yaw;
use std::collections::BTreeSet;
use std::io::{BufWriter, Stdout, Write};
use std::time::{Duration, Instant};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::attitude_line::Attitude;
use strapd_recording::decode::packed::Form;

const CSV_HEADER: &str = "id,stamp_ns,qw,qx,qy,qz,roll_deg,pitch_deg,yaw_deg,wx,wy,wz,sigma_x_deg,sigma_y_deg,sigma_z_deg,status,world\n";
const TABLE_HEADER: &str = "               stamp s        qw        qx        qy        qz    roll deg   pitch deg     yaw deg     rate x        y        z  status, id\n";

/// Runs it.
///
/// # Errors
/// Nobody answers, or whoever answered has gone; stdout cannot be written.
pub(super) fn run(args: &Cat, url: &str) -> Result<Outcome> {
    let file_flags = [
        (args.topic.is_some(), "--topic", "--id NAME names a sensor"),
        (
            !args.fields.is_empty(),
            "--field",
            "a daemon has read the fields already",
        ),
    ];
    for (given, flag, help) in file_flags {
        if given {
            return Err(Error::usage(
                Diagnostic::new(format!("cat {url}: {flag} is for files")).help(help),
            ));
        }
    }
    let remote = Remote::parse(url)?;
    let token = args
        .token_file
        .as_deref()
        .map(|file| Secret::read("--token-file", file))
        .transpose()?;
    client::run(&format!("cat {url}"), print(args, &remote, token.as_ref()))
}

async fn print(args: &Cat, remote: &Remote, token: Option<&Secret>) -> Result<Outcome> {
    let failed = |what: String| Error::Remote {
        address: remote.to_string().into(),
        what: with_help(what, token.is_some()),
    };
    // A second one ends the process even when nobody reads our output.
    let mut signals = Signals::new().map_err(|e| Error::usage(format!("signals: {e}")))?;
    let stop = signals.first(|| false);
    tokio::pin!(stop);
    let until = tokio::time::sleep(args.seconds.map_or(Duration::MAX, Duration::from_secs_f64));
    tokio::pin!(until);
    let mut printer = Printer::new(args, remote)?;
    // Lines are printed as they came; rows are made of what costs the least to read.
    let form = match args.format {
        Format::Ndjson => Form::Lines,
        Format::Csv | Format::Table => Form::Packed,
    };
    let request = request(&args.ids, args.rate_hz, form);
    let mut watcher = tokio::select! {
        connected = Watcher::connect(remote, token, &request) => connected.map_err(failed)?,
        () = &mut until => return Ok(Outcome::Done),
        _ = &mut stop => return Ok(Outcome::Done),
    };
    if matches!(remote, Remote::UdpListen(_)) {
        tracing::info!("listening on {}", watcher.peer());
    }
    let ended = loop {
        let mut take = |said: Said<'_>| printer.take(said);
        let next = tokio::select! {
            next = watcher.next(&mut take) => next,
            () = &mut until => break Ok(()),
            _ = &mut stop => break Ok(()),
        };
        if let Err(why) = printer.flush() {
            printer.sum_up();
            return Err(why);
        }
        match next {
            Ok(true) => {}
            Ok(false) => break Ok(()),
            Err(why) => break Err(failed(why)),
        }
    };
    printer.flush()?;
    printer.sum_up();
    ended.map(|()| match printer.dropped {
        0 => Outcome::Done,
        _ => Outcome::Lossy,
    })
}

struct Printer {
    out: BufWriter<Stdout>,
    format: Format,
    /// Address that is listened to.
    address: Address,
    left: u64,
    dropped: u64,
    gap_told: bool,
    complaints: Complaints,
    failure: Option<Error>,
}

/// Lines in a row that say nothing after which nobody listens any longer.
const MOST_IN_A_ROW: u32 = 100;
/// Complaints said at once, before they are thinned to one a second.
const BURST: u32 = 8;
/// Complaints remembered, so that each is said once.
const MOST_TOLD: usize = 64;

/// Complaints about what comes: each once, not many at a time, and an end where there is nothing else.
struct Complaints {
    allowance: Allowance,
    told: BTreeSet<String>,
    in_a_row: u32,
    unsaid: u64,
}

impl Complaints {
    fn new() -> Complaints {
        Complaints {
            allowance: Allowance::new(BURST),
            told: BTreeSet::new(),
            in_a_row: 0,
            unsaid: 0,
        }
    }

    /// Whether this one is to be said.
    fn is_due(&mut self, what: &str, now: Instant) -> bool {
        self.in_a_row += 1;
        let is_new = !self.told.contains(what) && self.allowance.take(now).is_some();
        if is_new && self.told.len() < MOST_TOLD {
            self.told.insert(what.to_owned());
        }
        self.unsaid += u64::from(!is_new);
        is_new
    }
}

impl Printer {
    fn new(args: &Cat, remote: &Remote) -> Result<Printer> {
        let mut out = BufWriter::with_capacity(1 << 16, std::io::stdout());
        let head = match args.format {
            Format::Ndjson => "",
            Format::Csv => CSV_HEADER,
            Format::Table => TABLE_HEADER,
        };
        out.write_all(head.as_bytes())
            .and_then(|()| out.flush())
            .map_err(|e| Error::writing("stdout", e))?;
        Ok(Printer {
            out,
            format: args.format,
            address: remote.to_string().into(),
            left: args.count.unwrap_or(u64::MAX),
            dropped: 0,
            gap_told: false,
            complaints: Complaints::new(),
            failure: None,
        })
    }

    /// Prints what was said; says whether more is wanted.
    fn take(&mut self, said: Said<'_>) -> bool {
        if self.left == 0 || self.failure.is_some() {
            return false;
        }
        match said {
            Said::Attitude(line) => {
                let printed = self.line(line);
                self.printed(printed);
            }
            Said::Packed(attitude) => {
                let printed = self.packed(&attitude);
                self.printed(printed);
            }
            Said::Gap { id, dropped } => {
                self.complaints.in_a_row = 0;
                if !std::mem::replace(&mut self.gap_told, true) {
                    tracing::warn!(
                        "{id}: {dropped} attitudes came faster than they were taken here, and were dropped; the sum is said at the end"
                    );
                }
                self.dropped += dropped;
            }
            Said::Complaint(what) => self.complain(&format!("the daemon says {what}")),
            Said::Status(_) => self.complaints.in_a_row = 0,
        }
        self.left > 0 && self.failure.is_none()
    }

    /// Whether one was printed, and why not.
    fn printed(&mut self, printed: std::io::Result<bool>) {
        match printed {
            Ok(is_one) => self.left -= u64::from(is_one),
            Err(why) => self.failure = Some(Error::writing("stdout", why)),
        }
    }

    /// Says what is wrong, unless that was said; after too much of it there is an end.
    fn complain(&mut self, what: &str) {
        if self.complaints.is_due(what, Instant::now()) {
            tracing::error!("{what}");
        }
        if self.complaints.in_a_row >= MOST_IN_A_ROW {
            self.failure = Some(Error::Remote {
                address: self.address.clone(),
                what: Diagnostic::new(format!(
                    "{MOST_IN_A_ROW} lines in a row that are no attitudes, last: {what}"
                ))
                .help("is this the port of a strapd?"),
            });
        }
    }

    /// Prints what was counted instead of being printed.
    fn sum_up(&self) {
        match self.complaints.unsaid {
            0 => {}
            n => tracing::error!("{n} more lines were wrong in the same or other ways"),
        }
        match self.dropped {
            0 => {}
            n => tracing::warn!("{n} attitudes were lost in all"),
        }
    }

    /// Prints one that came packed; says whether that was asked for.
    fn packed(&mut self, attitude: &Attitude) -> std::io::Result<bool> {
        if self.format == Format::Ndjson {
            self.complain("it says packed attitudes, which nobody asked for; skipped");
            self.dropped += 1;
            return Ok(false);
        }
        self.row(attitude).map(|()| true)
    }

    /// Prints one; says whether it was one.
    fn line(&mut self, line: &[u8]) -> std::io::Result<bool> {
        if self.format == Format::Ndjson {
            self.complaints.in_a_row = 0;
            self.out.write_all(&harmless(line))?;
            return self.out.write_all(b"\n").map(|()| true);
        }
        let read = Attitude::read(line);
        let a = match read.and_then(|read| read.ok_or_else(|| "no quaternion".to_owned())) {
            Ok(attitude) => attitude,
            Err(why) => {
                self.complain(&format!("an attitude that is none: {why}"));
                self.dropped += 1;
                return Ok(false);
            }
        };
        self.row(&a).map(|()| true)
    }

    fn row(&mut self, a: &Attitude) -> std::io::Result<()> {
        self.complaints.in_a_row = 0;
        match self.format {
            Format::Csv => self.csv(a),
            _ => self.table(a),
        }
    }

    fn csv(&mut self, a: &Attitude) -> std::io::Result<()> {
        let quoted = a.id.contains([',', '"']);
        match quoted {
            true => write!(self.out, "\"{}\"", a.id.replace('"', "\"\""))?,
            false => write!(self.out, "{}", a.id)?,
        }
        write!(self.out, ",{}", a.stamp.unwrap_or_default().0)?;
        let numbers = a.q.into_iter().chain(degrees(a)).chain(a.rate);
        for value in numbers.chain(a.sigma_deg) {
            match value.is_finite() {
                true => write!(self.out, ",{value:?}")?,
                false => write!(self.out, ",nan")?,
            }
        }
        let plain = |text: &str| text.replace([',', '"'], "_");
        writeln!(
            self.out,
            ",{},{}",
            plain(&a.status.join("|")),
            plain(&a.world)
        )
    }

    fn table(&mut self, a: &Attitude) -> std::io::Result<()> {
        let (sec, nsec) = a.stamp.unwrap_or_default().to_sec_nanosec();
        write!(self.out, "{sec:>12}.{nsec:09}")?;
        a.q.iter().try_for_each(|c| write!(self.out, " {c:>9.6}"))?;
        degrees(a)
            .iter()
            .try_for_each(|c| write!(self.out, " {c:>11.5}"))?;
        write!(self.out, "  ")?;
        a.rate
            .iter()
            .try_for_each(|c| write!(self.out, " {c:>8.4}"))?;
        writeln!(self.out, "  {} {}", a.status.join(","), a.id)
    }

    fn flush(&mut self) -> Result<()> {
        let flushed = self.out.flush();
        match self.failure.take() {
            Some(why) => Err(why),
            None => flushed.map_err(|e| Error::writing("stdout", e)),
        }
    }
}

/// Roll, pitch and yaw, turned about z, then y, then x.
fn degrees(a: &Attitude) -> [f64; 3] {
    roll_pitch_yaw(a.q).map(f64::to_degrees)
}

/// The same JSON, with every character that a terminal might obey, or that hides others, escaped. What
/// our own daemon sends has none.
fn harmless(line: &[u8]) -> std::borrow::Cow<'_, [u8]> {
    if line.iter().all(|b| (0x20..0x7f).contains(b)) {
        return line.into();
    }
    let mut out = String::with_capacity(line.len());
    for c in String::from_utf8_lossy(line).chars() {
        if matches!(c, '\r' | '\t') {
            // White space between the parts of an object: inside of a string JSON forbids it.
            out.push(' ');
            continue;
        }
        let one = strapd_recording::text::printable(c.encode_utf8(&mut [0; 4]));
        match one.starts_with("\\u{") {
            // JSON's own escape, inside of a string: nowhere else can such a character stand.
            true => c
                .encode_utf16(&mut [0; 2])
                .iter()
                .for_each(|unit| out.push_str(&format!("\\u{unit:04x}"))),
            false => out.push_str(&one),
        }
    }
    out.into_bytes().into()
}
