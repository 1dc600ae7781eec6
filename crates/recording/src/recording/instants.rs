//! Instants at which attitudes are wanted: frames of a video, stamps of a topic, rows of a table. I/O.
//!
//! A stage of its own because nothing of them is a sample: all that is read of a message, a frame or a row is when it is.

use super::channel_route::{Item, Route};
use super::input::Input;
use super::message_reader::MessageReader;
use super::opened::{AHEAD, Recording};
use super::warn::Warn;
use crate::columns::{Delimiter, Meant, Name, Unit};
use crate::decode::{Bare, Options, bare_of_text, decimal_in_steps, instant_of_date, unit_of};
use crate::error::{Error, Result};
use crate::format::is_video;
use crate::gpmf;
use crate::mcap::Channel;
use crate::pool::Pool;
use crate::text::{named_few, snippet};
use std::io::{BufRead, BufReader, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{Nanos, TimeUnit};

/// Longest row of a table that is read, bytes.
const LONGEST_ROW: u64 = 64 * 1024;
/// Most instants that are kept: 400 MB.
const MOST: usize = 50_000_000;

/// Source of instants.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Instants {
    /// Frames of the picture in the video that is the recording.
    Frames,
    /// Rows of a table with a column of stamps.
    Table(PathBuf),
    /// Messages of a topic of the recording, by the stamp in their header.
    Topic(String),
}

impl Instants {
    /// The word for the frames of a video.
    pub const FRAMES: &'static str = "frames";

    /// Reads what somebody names: `frames`, a file that is there, else a topic.
    #[must_use]
    pub fn named(text: &str) -> Instants {
        match text {
            Self::FRAMES => Instants::Frames,
            _ if Path::new(text).is_file() => Instants::Table(text.into()),
            _ => Instants::Topic(text.to_owned()),
        }
    }

    /// Reads them, in order of time, on the clock of the recording at `source`. With a note where they are
    /// of another clock than headers are.
    ///
    /// # Errors
    /// One of the files cannot be read; it has no video, no such topic, no stamps, or none whose unit can be told.
    pub fn read(
        &self,
        source: &Path,
        options: &Options,
        pool: &Pool,
    ) -> Result<(Vec<Nanos>, Option<String>)> {
        let (mut instants, note) = match self {
            Instants::Frames => (frames(source)?, None),
            Instants::Table(path) => (of_table(path)?, None),
            Instants::Topic(topic) => of_topic(source, topic, options, pool)?,
        };
        instants.sort_unstable();
        Ok((instants, note))
    }
}

fn refused(path: &Path, what: impl Into<String>, help: impl Into<String>) -> Error {
    Error::unsupported(path, Diagnostic::new(what).help(help))
}

/// Frames of the picture of a video.
fn frames(path: &Path) -> Result<Vec<Nanos>> {
    let no_video = |what: &str| {
        refused(
            path,
            format!("no frames of a video: {what}"),
            "the name of a table with a column of stamps, or a topic with the frames",
        )
    };
    let mut file = crate::format::open(path)?;
    let mut head = [0; 16];
    let have = file.read(&mut head).unwrap_or(0);
    if !head.get(..have).is_some_and(is_video) {
        return Err(no_video("it is none"));
    }
    let read = |source| Error::Read {
        path: path.to_owned(),
        offset: 0,
        source,
    };
    gpmf::frames(&mut file).map_err(read)?.map_err(no_video)
}

/// Stamps of the messages of a topic.
fn of_topic(
    source: &Path,
    topic: &str,
    options: &Options,
    pool: &Pool,
) -> Result<(Vec<Nanos>, Option<String>)> {
    let input = Input::open(source, &Warn::by(|_| {}))?;
    let log = Recording::of(&input, options, pool)?;
    let (mut instants, mut by_log, mut met) = (Vec::new(), 0_usize, false);
    log.walk::<Error>(
        AHEAD,
        pool,
        |channel| {
            (channel.topic == topic).then(|| {
                met = true;
                Route::only_copied(channel.clone())
            })
        },
        |items| {
            for item in items.drain(..) {
                let Item::Copy(message) = item else { continue };
                let header = header_stamp(&message.channel, &message.data);
                by_log += usize::from(header.is_none());
                let recorded = i64::try_from(message.log_time).unwrap_or(i64::MAX);
                instants.push(header.unwrap_or(Nanos(recorded)));
            }
            Ok(match instants.len() > MOST {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            })
        },
    )?;
    if !met {
        let topics: Vec<&str> = log
            .channels
            .iter()
            .map(|c| c.channel.topic.as_str())
            .collect();
        return Err(refused(
            source,
            format!(
                "neither a file nor a topic of the recording is called {}; it holds {}",
                snippet(topic.as_bytes()),
                named_few(&topics)
            ),
            format!(
                "a topic, a table with a column of stamps, or {} of a video",
                Instants::FRAMES
            ),
        ));
    }
    if instants.is_empty() {
        let what = format!("{topic} holds no messages that have an instant");
        return Err(refused(source, what, "a table with a column of stamps"));
    }
    few_enough(source, instants.len())?;
    let note = (by_log > 0).then(|| {
        format!("{by_log} messages of {topic} have no header with a stamp: they count when they were recorded")
    });
    Ok((instants, note))
}

fn few_enough(path: &Path, count: usize) -> Result<()> {
    match count > MOST {
        true => Err(refused(
            path,
            format!("more than {MOST} instants"),
            "the attitude at every sample needs none",
        )),
        false => Ok(()),
    }
}

/// Stamp in the header that a message of ROS begins with; `None` where it begins with something else, or is zero.
fn header_stamp(channel: &Channel, data: &[u8]) -> Option<Nanos> {
    let schema = channel.schema.as_ref()?;
    let text = std::str::from_utf8(&schema.data).ok()?;
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'))?;
    let kind = first.split_whitespace().next()?;
    if !["std_msgs/Header", "std_msgs/msg/Header", "Header"].contains(&kind) {
        return None;
    }
    let mut reader = MessageReader::of(&channel.message_encoding, data)?;
    reader.stamp().filter(|stamp| stamp.0 != 0)
}

/// Stamps of the rows of a table: of the column that is named as one, else of the first.
fn of_table(path: &Path) -> Result<Vec<Nanos>> {
    let input = crate::format::open(path)?;
    let mut reader = BufReader::new(input);
    let mut line = Vec::new();
    let mut table: Option<Column> = None;
    let mut stamps: Vec<Bare> = Vec::new();
    let mut dates: Vec<Nanos> = Vec::new();
    for number in 1_u64.. {
        line.clear();
        let mut limited = reader.by_ref().take(LONGEST_ROW);
        let read = limited.read_until(b'\n', &mut line);
        let read = read.map_err(|source| Error::Read {
            path: path.to_owned(),
            offset: 0,
            source,
        })?;
        if read == 0 {
            break;
        }
        if read as u64 == LONGEST_ROW && !line.ends_with(b"\n") {
            let what = format!("line {number} is longer than {LONGEST_ROW} bytes");
            return Err(refused(path, what, "a table with one instant a line"));
        }
        let row = line.trim_ascii();
        if row.is_empty() {
            continue;
        }
        let column = match &table {
            Some(column) => column,
            None => {
                let column = Column::of(row);
                let is_header = column.is_header;
                let column = table.insert(column);
                if is_header {
                    continue;
                }
                column
            }
        };
        let cell = column.cell(row);
        if let Some(date) = instant_of_date(&cell) {
            dates.push(date);
            few_enough(path, dates.len())?;
            continue;
        }
        let stamp = match column.nanos {
            Some(nanos) => decimal_in_steps(&cell, nanos).map(|stamp| Bare::whole(stamp.0)),
            None => bare_of_text(&cell),
        };
        let stamp = stamp.ok_or_else(|| {
            refused(
                path,
                format!(
                    "line {number}: no stamp in column {}: {}",
                    column.name,
                    snippet(row)
                ),
                "a table with a column of stamps (t_ns, t_us, t_ms, t_s; or dates of RFC 3339), or one number a line",
            )
        })?;
        stamps.push(stamp);
        few_enough(path, stamps.len())?;
    }
    match (stamps.is_empty(), dates.is_empty()) {
        (true, false) => return Ok(dates),
        (false, false) => {
            let what = format!(
                "{} of its stamps are dates and {} are numbers",
                dates.len(),
                stamps.len()
            );
            return Err(refused(path, what, "a column of one kind"));
        }
        (_, true) => {}
    }
    let Some(column) = table.filter(|_| !stamps.is_empty()) else {
        return Err(refused(path, "it holds no stamps", "one number a line"));
    };
    let unit = match column.nanos {
        Some(_) => TimeUnit::Nano,
        None => unit_of(stamps.iter().take(1000).copied()).map_err(|why| {
            let help = "a header that names the unit: t_ns, t_us, t_ms or t_s";
            refused(
                path,
                format!("column {}: {}", column.name, why.what()),
                help,
            )
        })?,
    };
    let instants = stamps.into_iter().map(|stamp| stamp.in_unit(unit));
    Ok(instants.collect())
}

/// Column of stamps in a table.
struct Column {
    delimiter: Delimiter,
    at: usize,
    name: String,
    /// Nanoseconds in one of its unit, where its name says that.
    nanos: Option<i64>,
    /// Whether the first row names it, and is none of the stamps.
    is_header: bool,
}

impl Column {
    /// Finds it in the first row: the one that is named as a stamp, else the first.
    fn of(row: &[u8]) -> Column {
        let holds = |delimiter: &Delimiter| delimiter.cells(row).nth(1).is_some();
        let delimiter = Delimiter::TRIED.into_iter().find(holds);
        let delimiter = delimiter.unwrap_or(Delimiter::Byte(b','));
        let cells: Vec<_> = delimiter.cells(row).collect();
        // A row that begins with an instant names nothing, whatever stands behind.
        let is_header = cells.iter().all(|cell| {
            let text = String::from_utf8_lossy(cell);
            let text = text.trim();
            bare_of_text(text).is_none() && instant_of_date(text).is_none()
        });
        let names = cells.iter().map(|cell| Name::of(cell));
        let named = names
            .enumerate()
            .find(|(_, name)| is_header && name.meant == Meant::Stamp);
        let nanos = |name: &Name| match &name.unit {
            Some(Ok(Unit::Time(nanos))) => Some(*nanos as i64),
            _ => None,
        };
        match named {
            Some((at, name)) => Column {
                delimiter,
                at,
                nanos: nanos(&name),
                name: name.text,
                is_header,
            },
            None => Column {
                delimiter,
                at: 0,
                nanos: None,
                name: "1".to_owned(),
                is_header,
            },
        }
    }

    /// Text of the row's cell; empty where there is none.
    fn cell(&self, row: &[u8]) -> String {
        let mut cells = self.delimiter.cells(row);
        let cell = cells.nth(self.at).unwrap_or_default();
        String::from_utf8_lossy(&cell).trim().to_owned()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<i64>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Ok(of_table(file.path())?.into_iter().map(|t| t.0).collect())
    }

    #[test]
    fn a_column_named_as_a_stamp_is_taken_in_its_unit() {
        let said = "frame,t_us,name\n0,1700000000000001,a\n1,1700000000033334,b\n";
        let expected = vec![1_700_000_000_000_001_000, 1_700_000_000_033_334_000];
        assert_eq!(read(said).unwrap(), expected);
        assert_eq!(
            read("t_s\r\n0.0333667\r\n1.5\r\n").unwrap(),
            [33_366_700, 1_500_000_000]
        );
        // Exact to the nanosecond, and nothing rounded on the way.
        assert_eq!(
            read("time_s;n\n1700000000.123456789;1\n").unwrap(),
            [1_700_000_000_123_456_789]
        );
    }

    #[test]
    fn bare_numbers_are_of_the_unit_that_fits() {
        let ns = "1700000000000000000\n1700000000033366700\n";
        assert_eq!(read(ns).unwrap()[1], 1_700_000_000_033_366_700);
        let secs = "1700000000.0\n1700000000.5\n\n1700000001.0\n";
        assert_eq!(read(secs).unwrap()[1], 1_700_000_000_500_000_000);
    }

    #[test]
    fn dates_are_instants_with_and_without_a_header() {
        let rows = "2023-11-14T22:13:20.5Z,a\n2023-11-14T23:13:21+01:00,b\n";
        let expected = [1_700_000_000_500_000_000, 1_700_000_001_000_000_000];
        assert_eq!(read(rows).unwrap(), expected);
        assert_eq!(read(&format!("time,name\n{rows}")).unwrap(), expected);
        assert_eq!(
            read("name;time\na;2023-11-14 22:13:20.5\n").unwrap(),
            expected[..1]
        );
        let mixed = read("time\n2023-11-14T22:13:20Z\n1700000000\n").unwrap_err();
        assert!(
            mixed.to_string().contains("1 of its stamps are dates"),
            "{mixed}"
        );
    }

    #[test]
    fn what_is_no_stamp_is_refused_with_its_line() {
        for (text, says) in [
            ("", "empty"),
            ("t_ns\n", "holds no stamps"),
            ("t_ns\n1\nx\n", "line 3"),
            ("a,t_ns\n1\n", "line 2"),
            ("t\n3\n", "unit"),
            // The rest of a long row is no row of its own.
            (
                &format!("t_ns\n1,{}\n", "7".repeat(70_000)),
                "line 2 is longer",
            ),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(says), "{text:?}: {error}");
        }
    }
}
