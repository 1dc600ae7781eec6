//! Attitude files -> a track of attitudes over time, for `compare`. I/O.
//!
//! NDJSON and CSV are our own outputs; MCAP goes through the same walk and decoders as a replay.

use crate::error::{Error, Result};
use crate::record::Nanos;
use serde::Deserialize;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// One attitude as found: `[w, x, y, z]`, unchecked.
pub type Entry = (Nanos, [f64; 4]);

/// The longest line read from an NDJSON file.
const LINE_LIMIT: u64 = 64 * 1024;

#[derive(Deserialize)]
struct Stamp {
    sec: i64,
    nsec: u32,
}

#[derive(Deserialize)]
struct Q {
    w: f64,
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize)]
struct Att {
    class: String,
    #[serde(default)]
    id: String,
    stamp: Option<Stamp>,
    q: Option<Q>,
}

/// Reads the `ATT` lines of an NDJSON file; `id` picks one of several streams.
///
/// # Errors
/// The file can not be read, a line is not JSON or is too long, or several ids and none named.
pub fn from_ndjson(path: &Path, id: Option<&str>) -> Result<Vec<Entry>> {
    let file = open(path)?;
    let mut reader = BufReader::new(file);
    let mut track = Vec::new();
    let mut seen: Option<String> = None;
    let mut line = Vec::new();
    let mut number = 0u64;
    loop {
        line.clear();
        number += 1;
        let read = std::io::Read::take(&mut reader, LINE_LIMIT)
            .read_until(b'\n', &mut line)
            .map_err(|source| Error::Read { path: path.to_owned(), offset: number, source })?;
        if read == 0 {
            return Ok(track);
        }
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        if read as u64 == LINE_LIMIT {
            return Err(bad_line(path, number, "longer than 64 KiB"));
        }
        let att: Att = serde_json::from_slice(&line)
            .map_err(|e| bad_line(path, number, &e.to_string()))?;
        if att.class != "ATT" || id.is_some_and(|id| id != att.id) {
            continue;
        }
        match &seen {
            Some(first) if *first != att.id => {
                return Err(bad_line(
                    path,
                    number,
                    &format!("attitudes of both `{first}` and `{}`; --topic ID takes one", att.id),
                ));
            }
            Some(_) => {}
            None => seen = Some(att.id.clone()),
        }
        if let (Some(stamp), Some(q)) = (att.stamp, att.q) {
            track.push((Nanos::from_sec_nanosec(stamp.sec, stamp.nsec), [q.w, q.x, q.y, q.z]));
        }
    }
}

#[derive(Deserialize)]
struct Row {
    stamp_ns: i64,
    w: f64,
    x: f64,
    y: f64,
    z: f64,
}

/// Reads a CSV file with at least the columns `stamp_ns,w,x,y,z`.
///
/// # Errors
/// The file can not be read, a column is missing, or a cell is not a number.
pub fn from_csv(path: &Path) -> Result<Vec<Entry>> {
    csv::Reader::from_reader(BufReader::new(open(path)?))
        .deserialize::<Row>()
        .map(|row| {
            row.map(|r| (Nanos(r.stamp_ns), [r.w, r.x, r.y, r.z])).map_err(|e| Error::Unsupported {
                path: path.to_owned(),
                what: format!("{e}\n  help: columns stamp_ns,w,x,y,z are needed"),
            })
        })
        .collect()
}

fn open(path: &Path) -> Result<File> {
    if path.is_dir() {
        return Err(Error::IsDirectory { path: path.to_owned() });
    }
    File::open(path).map_err(|source| Error::Open { path: path.to_owned(), source })
}

fn bad_line(path: &Path, number: u64, what: &str) -> Error {
    Error::Unsupported {
        path: path.to_owned(),
        what: format!("line {number}: {what}"),
    }
}
