//! A serial port -> the ports there are, a file of what it sends for some seconds, or its lines to a daemon. I/O.
//!
//! Apart from the commands because `cat`, `check`, `info` and `send` take a port as they take a recording.

use super::{Outcome, print};
use crate::client;
use crate::client::link::{Heard, Link};
use crate::client::remote::Remote;
use crate::client::secret::Secret;
use crate::client::sender::Sender;
use crate::client::serial::{self, Legibility, SerialPlace};
use crate::error::{Error, Result};
use crate::serve::guard::shutdown::Signals;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::Nanos;
use strapd_recording::decode::framing::{Framed, Framer};
use strapd_recording::devices::{self, Asked};
use strapd_recording::format::{Format, HEAD};
use tempfile::TempDir;
use tokio::time::{Instant, timeout_at};

/// Seconds for which a port is listened to.
const SECONDS: f64 = 10.0;
/// Bytes of it that are kept.
const MOST: usize = 256 << 20;
/// Longest message, of links that have such.
const MAX_MESSAGE: usize = 64 << 10;

/// Lists the ports.
///
/// # Errors
/// stdout cannot be written.
pub(super) fn list() -> Result<Outcome> {
    print(&serial::listing())?;
    Ok(Outcome::Done)
}

/// Whether a word is meant as a port, or asks for those there are.
pub(super) fn is_meant(text: &Path) -> bool {
    let text = text.to_str().unwrap_or_default();
    text.starts_with("serial://") || serial::asks_for_ports(text)
}

/// Whether a word asks for the ports there are.
pub(super) fn asks_for_ports(text: &Path) -> bool {
    serial::asks_for_ports(text.to_str().unwrap_or_default())
}

/// Name of a capture in what is printed: the file itself is gone when it is read.
const CAPTURE: &str = "capture.csv";

/// A recording, or what was captured in place of one.
#[derive(Debug)]
pub(super) struct Captured {
    path: PathBuf,
    /// Address of the port.
    address: Option<String>,
    /// Folder that is removed with the value.
    _folder: Option<TempDir>,
}

impl Captured {
    /// File to read.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Text about the file, for people: of a capture with how to keep one.
    pub(super) fn retold(&self, text: &str) -> String {
        let Some(address) = &self.address else {
            return text.to_owned();
        };
        let text = text.replace(&*self.path.to_string_lossy(), CAPTURE);
        format!("{text}to keep   strapd cat '{address}' --format csv > {CAPTURE}\n")
    }
}

/// Listens to a port for so many seconds, or for `?for=`; any other path is given back as it is.
///
/// # Errors
/// The port cannot be opened, or brings nothing that can be read.
pub(super) fn captured(path: &Path, seconds: Option<f64>) -> Result<Captured> {
    if !is_meant(path) {
        return Ok(Captured {
            path: path.to_owned(),
            address: None,
            _folder: None,
        });
    }
    let text = path.to_str().unwrap_or_default();
    let (place, stated, protocol) = parsed(text)?;
    let seconds = seconds.or(stated).unwrap_or(SECONDS);
    tracing::info!("{place}: listening for {seconds} s");
    let time = Duration::from_secs_f64(seconds);
    let bytes = client::run(text, listened(&place, time, protocol))?;
    let kept = kept_of(&place, bytes, protocol)?;
    let folder = TempDir::new().map_err(|e| Error::writing("a temporary folder", e))?;
    let path = folder.path().join(format!("{}.txt", place.sensor()));
    std::fs::File::create(&path)
        .and_then(|mut file| file.write_all(&kept))
        .map_err(|e| Error::writing("a temporary file", e))?;
    Ok(Captured {
        path,
        address: Some(addressed(&place, protocol)),
        _folder: Some(folder),
    })
}

/// The port of an address, its `?for=` and its `?protocol=`.
fn parsed(text: &str) -> Result<(SerialPlace, Option<f64>, Asked)> {
    let refuse = |what: String| {
        let what = format!("{}: {what}", crate::address::Address::from(text));
        let help = format!(
            "serial:///dev/PORT?baud=RATE&for=SECONDS&protocol=NAME; protocols: {}",
            Asked::names()
        );
        Error::usage(Diagnostic::new(what).help(help))
    };
    let (remote, parameters) = Remote::with_parameters(text, |_| true)?;
    let Remote::Serial(place) = remote else {
        return Err(refuse("is no serial port".to_owned()));
    };
    let (mut seconds, mut protocol) = (None, Asked::Lines);
    for (name, value) in parameters {
        if name == "protocol" {
            let asked = Asked::parse(&value);
            protocol = asked.map_err(|why| refuse(format!("?protocol={why}")))?;
            continue;
        }
        let value: Option<f64> = value.parse().ok().filter(|v| (0.1..=86_400.0).contains(v));
        match (name.as_str(), value) {
            ("for", Some(value)) => seconds = Some(value),
            ("for", None) => return Err(refuse("?for= needs seconds, 0.1 to 86400".to_owned())),
            (other, _) => {
                let other = strapd_recording::text::printable(other);
                return Err(refuse(format!("there is no ?{other}= here")));
            }
        }
    }
    Ok((place, seconds, protocol))
}

fn failed(place: &SerialPlace, what: String) -> Error {
    Error::Remote {
        address: place.to_string().into(),
        what: what.into(),
    }
}

async fn listened(place: &SerialPlace, time: Duration, protocol: Asked) -> Result<Vec<u8>> {
    let remote = Remote::Serial(place.clone());
    let link = Link::connect(&remote, None, MAX_MESSAGE).await;
    let mut link = link.map_err(|why| failed(place, why))?;
    let until = Instant::now() + time;
    let (mut all, mut bytes, mut seen) = (Vec::new(), Vec::new(), Legibility::default());
    while let Ok(heard) = timeout_at(until, link.read(&mut bytes)).await {
        match heard {
            Ok(Heard::Bytes | Heard::Message) => {}
            // Unplugged: what came until then is there.
            Ok(Heard::Closed(_)) | Err(_) => break,
        }
        seen.take(&bytes);
        all.extend_from_slice(&bytes);
        if all.len() > MOST {
            break;
        }
    }
    match seen.bytes() {
        0 => Err(failed(
            place,
            format!(
                "nothing came in {} s: does the board send?",
                time.as_secs_f64()
            ),
        )),
        bytes if protocol.is_lines() && !seen.is_text() => {
            Err(failed(place, place.unreadable(bytes)))
        }
        _ => Ok(all),
    }
}

/// Bytes of a port that are kept: of a sensor's frames all, of other frames lines of their samples, of lines those that
/// may be samples.
fn kept_of(place: &SerialPlace, bytes: Vec<u8>, protocol: Asked) -> Result<Vec<u8>> {
    let Some(mut link) = devices::Link::of(protocol) else {
        return Ok(lines_of(&bytes));
    };
    let mut lines = Vec::new();
    // All of it came by the end; frames without a time have none here.
    link.push(&bytes, Nanos(0), None, &mut lines);
    link.push(&[], Nanos(LATE), None, &mut lines);
    link.finish(&mut lines);
    let notes = link.notes();
    for note in &notes {
        tracing::info!("{place}: {}", note.text);
    }
    let (has_frames, head) = (link.has_frames(), bytes.get(..HEAD));
    if has_frames && link.counts().0 > 0 {
        let is_capture = Format::of_bytes(head.unwrap_or(&bytes)) == Some(Format::Device);
        return Ok(if is_capture { bytes } else { lines });
    }
    if has_frames || lines.is_empty() {
        let why = notes.last().map(|note| note.text.clone());
        let why = why.unwrap_or_else(|| "no sample in what came".to_owned());
        return Err(failed(place, why));
    }
    Ok(lines_of(&lines))
}

/// The address of a port with the protocol that is asked for.
fn addressed(place: &SerialPlace, protocol: Asked) -> String {
    let address = place.to_string();
    match protocol {
        Asked::Lines => address,
        asked => {
            let mark = if address.contains('?') { '&' } else { '?' };
            format!("{address}{mark}protocol={}", asked.name())
        }
    }
}

/// Time after which a protocol must have shown itself, ns.
const LATE: i64 = 10_000_000_000;

/// Whole lines of a capture that may be samples: the first one may be half of one, the last one is, and a board says
/// what it is before it sends objects.
fn lines_of(bytes: &[u8]) -> Vec<u8> {
    let whole = bytes
        .iter()
        .rposition(|b| *b == b'\n')
        .map_or(0, |at| at + 1);
    let bytes = bytes.get(..whole).unwrap_or_default();
    let is_object = |line: &[u8]| line.trim_ascii_start().first() == Some(&b'{');
    let lines = || bytes.split_inclusive(|b| *b == b'\n');
    let has_objects = lines().any(is_object);
    let has_letters = |line: &[u8]| line.iter().any(u8::is_ascii_alphabetic);
    let kept = lines().enumerate().filter(|(n, line)| match has_objects {
        true => is_object(line),
        false => *n > 0 || has_letters(line),
    });
    kept.flat_map(|(_, line)| line.iter().copied()).collect()
}

/// Sends the lines of a port to a daemon, until a signal.
///
/// # Errors
/// The port cannot be opened; nobody answers, or whoever answered has gone.
pub(super) fn forward(port: &Path, remote: &Remote, token: Option<&Secret>) -> Result<Outcome> {
    let text = port.to_str().unwrap_or_default();
    let (place, seconds, protocol) = parsed(text)?;
    client::run(
        &format!("send {text}"),
        forwarded(&place, (seconds, protocol), remote, token),
    )
}

async fn forwarded(
    place: &SerialPlace,
    (seconds, protocol): (Option<f64>, Asked),
    remote: &Remote,
    token: Option<&Secret>,
) -> Result<Outcome> {
    let gone = |what: String| Error::Remote {
        address: remote.to_string().into(),
        what: what.into(),
    };
    let mut signals = Signals::new().map_err(|e| Error::usage(format!("signals: {e}")))?;
    let stop = signals.first(|| false);
    tokio::pin!(stop);
    let until = tokio::time::sleep(seconds.map_or(Duration::MAX, Duration::from_secs_f64));
    tokio::pin!(until);
    let port = Link::connect(&Remote::Serial(place.clone()), None, MAX_MESSAGE).await;
    let mut port = port.map_err(|why| failed(place, why))?;
    let mut sender = Sender::connect(remote, token).await.map_err(gone)?;
    let (mut framer, mut bytes, mut lines, mut count) =
        (Framer::new(), Vec::new(), String::new(), 0u64);
    let (mut link, began) = (devices::Link::of(protocol), Instant::now());
    loop {
        let heard = tokio::select! {
            heard = port.read(&mut bytes) => heard,
            () = &mut until => break,
            _ = &mut stop => break,
        };
        match heard {
            Ok(Heard::Bytes | Heard::Message) => {}
            Ok(Heard::Closed(_)) => return Err(failed(place, "the port has gone".to_owned())),
            Err(why) => return Err(failed(place, why.to_string())),
        }
        if let Some(link) = &mut link {
            let elapsed = i64::try_from(began.elapsed().as_nanos()).unwrap_or(i64::MAX);
            let mut own = Vec::new();
            link.push(&bytes, Nanos(elapsed), Some(&place.sensor()), &mut own);
            for note in link.notes() {
                tracing::warn!("{place}: {}", note.text);
            }
            bytes = own;
        }
        framer.feed(&bytes, &mut |framed: Framed<'_>| {
            if let Framed::Line(_, line) = framed {
                if !lines.is_empty() {
                    lines.push('\n');
                }
                lines.push_str(&String::from_utf8_lossy(line));
                count += 1;
            }
            true
        });
        sender.send(&mut lines).await.map_err(gone)?;
    }
    let complaints = sender.finish().await.map_err(gone)?;
    tracing::info!("sent {count} lines of {place} to {remote}");
    Ok(match complaints {
        0 => Outcome::Done,
        _ => Outcome::Lossy,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn whole_lines_that_may_be_samples_are_kept() {
        let text = |bytes: &[u8]| String::from_utf8(lines_of(bytes)).unwrap();
        assert_eq!(text(b"2,3\n1,2,3\n4,5,6\n7,"), "1,2,3\n4,5,6\n");
        assert_eq!(text(b"t,x,y,z\n1,2,3,4\n"), "t,x,y,z\n1,2,3,4\n");
        assert_eq!(text(b"boot\nuro\":1}\n{\"a\":1}\n{\"b\""), "{\"a\":1}\n");
        assert_eq!(text(b"no end"), "");
    }

    #[test]
    fn an_address_of_a_port_says_for_how_long() {
        let (place, seconds, protocol) =
            parsed("serial:///dev/ttyUSB0?baud=9600&for=2.5&protocol=auto").unwrap();
        assert_eq!(
            (place.baud, seconds, protocol),
            (9600, Some(2.5), Asked::Auto)
        );
        for text in [
            "serial:///dev/a?for=x",
            "serial:///dev/a?stamp=arrival",
            "tcp://h:1",
        ] {
            assert!(parsed(text).is_err(), "{text}");
        }
        assert!(is_meant(Path::new("serial:")) && !is_meant(Path::new("serial.csv")));
    }
}
