//! `serial:///dev/ttyUSB0?baud=115200` -> an open port, or why it cannot be opened and what helps. I/O.
//!
//! Apart from the link because a port has what no socket has: a rate that the other end cannot be asked for, rights, and
//! names that change when the board is plugged in again.

use super::remote::Parameter;
use serial2_tokio::SerialPort;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use strapd_recording::text::printable;

/// Rate of a port that no address states.
const BAUD: u32 = 115_200;
/// Rates that a port can have.
const BAUDS: std::ops::RangeInclusive<u32> = 50..=20_000_000;
/// Rates that boards have mostly, for an error.
const USUAL: &str = "9600, 57600, 115200, 230400, 460800, 921600";

/// A port, and its rate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialPlace {
    /// Path, or name (`COM3`).
    pub port: PathBuf,
    /// Bits a second.
    pub baud: u32,
}

impl SerialPlace {
    /// Reads what stands behind `serial://`, and takes `baud` out of the parameters.
    ///
    /// # Errors
    /// In words.
    pub fn parse(port: &str, parameters: &mut Vec<Parameter>) -> Result<SerialPlace, String> {
        let port = port.trim_end_matches('/');
        if port.is_empty() {
            return Err("a port is needed; serial: alone lists those there are".to_owned());
        }
        let is_name = !port.contains('/') && port.len() < 32;
        if !port.starts_with('/') && !is_name {
            return Err("an absolute path, or a name such as COM3, is needed".to_owned());
        }
        let mut stated = parameters.extract_if(.., |(name, _)| name == "baud");
        let baud = match (stated.next(), stated.next()) {
            (None, _) => BAUD,
            (Some(_), Some(_)) => return Err("?baud= is given twice".to_owned()),
            (Some((_, text)), None) => {
                let baud = text.parse().ok().filter(|baud| BAUDS.contains(baud));
                baud.ok_or_else(|| {
                    format!("?baud={}: is no rate; usual are {USUAL}", printable(&text))
                })?
            }
        };
        Ok(SerialPlace {
            port: PathBuf::from(port),
            baud,
        })
    }

    /// Name for the sensor of a board that names none: the last part of the path.
    #[must_use]
    pub fn sensor(&self) -> String {
        let name = self.port.file_name().unwrap_or(self.port.as_os_str());
        let name = printable(&name.to_string_lossy());
        name.chars().take(64).collect()
    }

    /// Opens the port, raw, with eight bits and no parity.
    ///
    /// # Errors
    /// In words, with what helps.
    pub(crate) fn open(&self) -> Result<SerialPort, String> {
        SerialPort::open(&self.port, self.baud).map_err(|why| self.explained(&why))
    }

    fn explained(&self, why: &io::Error) -> String {
        let port = printable(&self.port.display().to_string());
        match why.kind() {
            io::ErrorKind::NotFound => {
                let there: Vec<String> = ports().into_iter().map(|port| port.path).collect();
                let there = match there.as_slice() {
                    [] => "no port is there".to_owned(),
                    all => format!("there are {}", all.join(", ")),
                };
                format!("{port}: there is no such port ({there}); is the board plugged in?")
            }
            io::ErrorKind::PermissionDenied => format!("{port}: no rights; {}", rights(&self.port)),
            io::ErrorKind::ResourceBusy => {
                format!("{port}: another program has it open; close its serial monitor")
            }
            io::ErrorKind::InvalidInput => {
                format!(
                    "{port}: it cannot have {} baud; usual are {USUAL}",
                    self.baud
                )
            }
            _ if why.raw_os_error() == Some(NO_TERMINAL) => {
                format!("{port}: is no serial port; serial: alone lists those there are")
            }
            _ => format!("{port}: {why}"),
        }
    }

    /// Words for bytes of which no line could be read.
    #[must_use]
    pub fn unreadable(&self, bytes: u64) -> String {
        format!(
            "{bytes} bytes at {} baud and no line that can be read in 2 s: the board has another rate? ?baud=RATE states it, usual are {USUAL}",
            self.baud
        )
    }
}

/// Share of what a port can carry, a tenth of its rate in bytes, from which on it is full: no board sends so much by
/// chance, and its clock may be off by 2 %.
const FULL: std::ops::RangeInclusive<f64> = 0.985..=1.02;
/// Time over which bytes are counted, and how often in a row the port must be full.
const COUNTED: Duration = Duration::from_secs(2);
const IN_A_ROW: u32 = 2;

/// Bytes of a port against what it can carry.
#[derive(Debug, Default)]
pub struct PortLoad {
    since: Option<Instant>,
    bytes: usize,
    full: u32,
    is_told: bool,
}

impl PortLoad {
    /// Takes so many bytes that came at `now`; in words, once, that the port carries no more.
    pub fn take(&mut self, place: &SerialPlace, bytes: usize, now: Instant) -> Option<String> {
        let since = *self.since.get_or_insert(now);
        let passed = now.saturating_duration_since(since);
        if passed < COUNTED {
            self.bytes += bytes;
            return None;
        }
        let rate = self.bytes as f64 / passed.as_secs_f64();
        (self.since, self.bytes) = (Some(now), bytes);
        let most = f64::from(place.baud) / 10.0;
        // A port of USB itself has a rate in name only.
        let is_full = FULL.contains(&(rate / most)) && !place.sensor().starts_with("ttyACM");
        self.full = if is_full { self.full + 1 } else { 0 };
        if self.full < IN_A_ROW || std::mem::replace(&mut self.is_told, true) {
            return None;
        }
        Some(format!(
            "{rate:.0} bytes a second are all that {} baud carry: what the board cannot send it delays or leaves out; a higher rate on both sides (?baud=), fewer samples or shorter lines",
            place.baud
        ))
    }
}

/// `ENOTTY`, the same on all systems that have it.
const NO_TERMINAL: i32 = 25;

impl fmt::Display for SerialPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "serial://{}", self.port.display())?;
        match self.baud {
            BAUD => Ok(()),
            baud => write!(f, "?baud={baud}"),
        }
    }
}

/// Advice for a port that this user may not open.
#[cfg(unix)]
fn rights(port: &Path) -> String {
    use std::os::unix::fs::MetadataExt;
    let gid = std::fs::metadata(port).map(|of| of.gid()).ok();
    let groups = std::fs::read_to_string("/etc/group").unwrap_or_default();
    let group = groups.lines().find_map(|line| {
        let mut parts = line.split(':');
        let name = parts.next()?;
        (parts.nth(1)?.parse().ok() == gid).then(|| printable(name))
    });
    let group = group.unwrap_or_else(|| "dialout".to_owned());
    format!(
        "it belongs to the group {group}: `sudo usermod -aG {group} $USER` and log in again, or a udev rule in /etc/udev/rules.d/60-serial.rules: SUBSYSTEM==\"tty\", ENV{{ID_BUS}}==\"usb\", TAG+=\"uaccess\""
    )
}

#[cfg(not(unix))]
fn rights(_: &Path) -> String {
    "another program may have it open".to_owned()
}

/// A port that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortFound {
    /// Path, fit for a terminal.
    pub path: String,
    /// Maker and product, as far as the system knows them.
    pub what: String,
}

/// Ports that are there, with what each is where the system says so.
#[must_use]
pub fn ports() -> Vec<PortFound> {
    let mut ports = SerialPort::available_ports().unwrap_or_default();
    ports.sort();
    let found = ports.iter().map(|port| PortFound {
        path: printable(&port.display().to_string()),
        what: described(port),
    });
    found.collect()
}

/// Ports as text, one a line, to be pasted.
#[must_use]
pub fn listing() -> String {
    let ports = ports();
    if ports.is_empty() {
        return "no serial port is there\n".to_owned();
    }
    let lines = ports.iter().map(|port| {
        let address = format!("serial://{}", port.path);
        format!("{address:<32} {}", port.what).trim_end().to_owned() + "\n"
    });
    lines.collect()
}

/// Whether a word asks for the ports there are.
#[must_use]
pub fn asks_for_ports(text: &str) -> bool {
    matches!(text, "serial:" | "serial:/" | "serial://" | "serial:///")
}

/// Product, maker and numbers of the USB device behind a port.
#[cfg(target_os = "linux")]
fn described(port: &Path) -> String {
    let Some(name) = port.file_name() else {
        return String::new();
    };
    let device = Path::new("/sys/class/tty").join(name).join("device");
    let Ok(device) = device.canonicalize() else {
        return String::new();
    };
    // The interface of a USB device is one or two folders below it.
    let found = device.ancestors().take(4).find_map(|folder| {
        let read = |file: &str| {
            let text = std::fs::read_to_string(folder.join(file)).ok()?;
            Some(printable(text.trim()))
        };
        let ids = format!("{}:{}", read("idVendor")?, read("idProduct")?);
        let product = read("product").unwrap_or_default();
        let maker = read("manufacturer").unwrap_or_default();
        Some(format!("{product} ({maker}, {ids})"))
    });
    found.unwrap_or_default()
}

#[cfg(not(target_os = "linux"))]
fn described(_: &Path) -> String {
    String::new()
}

/// Bytes of a port, judged for whether anything of them can be read.
#[derive(Debug, Default)]
pub struct Legibility {
    bytes: u64,
    odd: u64,
    lines: u64,
}

impl Legibility {
    /// Takes the next bytes.
    pub fn take(&mut self, bytes: &[u8]) {
        let is_odd = |b: &&u8| !matches!(b, b'\t' | b'\r' | b'\n' | b' '..0x7f);
        self.bytes += bytes.len() as u64;
        self.odd += bytes.iter().filter(is_odd).count() as u64;
        self.lines += bytes.iter().filter(|b| **b == b'\n').count() as u64;
    }

    /// Bytes so far.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Whether there is text in lines: of another rate one byte in three is no letter, and line ends are rare.
    #[must_use]
    pub fn is_text(&self) -> bool {
        self.lines > 0 && self.odd * 8 < self.bytes
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn parsed(text: &str, query: &str) -> Result<SerialPlace, String> {
        let mut parameters = super::super::remote::parameters(query).unwrap();
        SerialPlace::parse(text, &mut parameters)
    }

    #[test]
    fn a_port_has_a_path_and_a_rate() {
        let place = parsed("/dev/ttyUSB0", "baud=921600").unwrap();
        assert_eq!(place.to_string(), "serial:///dev/ttyUSB0?baud=921600");
        assert_eq!(
            (place.sensor(), place.baud),
            ("ttyUSB0".to_owned(), 921_600)
        );
        assert_eq!(parsed("COM3", "").unwrap().to_string(), "serial://COM3");
        for (text, query, words) in [
            ("", "", "serial: alone lists"),
            ("dev/ttyUSB0", "", "absolute path"),
            (
                "/dev/ttyUSB0",
                "baud=fast",
                "?baud=fast: is no rate; usual are 9600",
            ),
            ("/dev/ttyUSB0", "baud=1", "no rate"),
            ("/dev/ttyUSB0", "baud=9600&baud=9600", "twice"),
        ] {
            let why = parsed(text, query).unwrap_err();
            assert!(why.contains(words), "{text} {query}: {why}");
        }
    }

    #[test]
    fn a_port_that_cannot_be_opened_says_what_helps() {
        let missing = parsed("/dev/ttyNONE9", "").unwrap();
        let why = missing.explained(&io::ErrorKind::NotFound.into());
        assert!(
            why.contains("no such port") && why.contains("plugged in"),
            "{why}"
        );
        let why = missing.explained(&io::ErrorKind::PermissionDenied.into());
        assert!(
            !cfg!(unix) || (why.contains("usermod -aG") && why.contains("udev")),
            "{why}"
        );
        let why = missing.explained(&io::ErrorKind::ResourceBusy.into());
        assert!(why.contains("another program"), "{why}");
    }

    #[test]
    fn a_port_that_carries_no_more_is_named_once_and_one_with_room_never() {
        let begin = Instant::now();
        let told = |name: &str, baud: u32, rate: usize| {
            let place = SerialPlace {
                port: PathBuf::from("/dev").join(name),
                baud,
            };
            let mut load = PortLoad::default();
            // Fifty times a second, for twenty seconds.
            let each = |n: u32| load.take(&place, rate / 50, begin + n * Duration::from_millis(20));
            (0..1000).filter_map(each).collect::<Vec<_>>()
        };
        let full = told("ttyUSB0", 9600, 950);
        assert_eq!(full.len(), 1, "{full:?}");
        assert!(full[0].contains("9600 baud"), "{full:?}");
        for (name, baud, rate) in [
            ("ttyUSB0", 9600, 850),
            ("ttyUSB0", 9600, 2000),
            ("ttyUSB0", 115_200, 950),
            ("ttyACM0", 9600, 950),
            ("ttyUSB0", 9600, 0),
        ] {
            assert!(told(name, baud, rate).is_empty(), "{name} {baud} {rate}");
        }
    }

    #[test]
    fn text_is_told_from_bytes_of_another_rate() {
        let mut text = Legibility::default();
        text.take(b"ets Jun  8 2016 00:22:57\r\nms,gx,gy,gz\r\n12,0.1,0.2,0.3\r\n");
        assert!(text.is_text());
        let mut noise = Legibility::default();
        (0..2000u32).for_each(|n| noise.take(&[(n.wrapping_mul(2_654_435_761) >> 24) as u8]));
        assert!(!noise.is_text());
        assert!(!Legibility::default().is_text());
    }
}
