//! Attitude files -> a track of attitudes over time, for `compare`. I/O.
//!
//! Attitudes in NDJSON and CSV are our own outputs; all else goes through the same walk and decoders as a replay.

use super::simulate::TRUTH_TOPIC;
use crate::error::{Error, Result};
use crate::shell::quoted_file;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::io::{BufRead, BufReader};
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::orientation_convention;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeCovariance, Nanos, RawSample};
use strapd_attitude::setting::{REF_TOPIC, SECOND_TOPIC, TOPIC};
use strapd_attitude::worlds::{Convention, World};
use strapd_recording::Input;
use strapd_recording::Recording;
use strapd_recording::attitude_line::{Attitude, sensor_of_truth};
use strapd_recording::decode::Options;
use strapd_recording::format::Format;
use strapd_recording::mcap::Survey;
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::{Item, Route};
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::log_channel::{LogChannel, is_mounting, rank};
use strapd_recording::recording::opened::{AHEAD, problems};
use strapd_recording::recording::sources::is_same;
use strapd_recording::recording::topics;
use strapd_recording::text::printable;

/// One attitude as found: `[w, x, y, z]`, unchecked.
pub type Entry = (Nanos, [f64; 4]);

/// A track of attitudes.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// File and topic, for people.
    pub name: String,
    /// Entries in file order; ENU (or start) and FLU.
    pub entries: Vec<Entry>,
    /// Instants of its resets: from each on its world is another.
    pub cuts: Vec<Nanos>,
    /// Covariances of their errors that the file states, in body axes (FLU); empty if it does not for all.
    pub covariances: Vec<AttitudeCovariance>,
    /// Problems of the file.
    pub problems: Vec<String>,
}

/// Side for which a track is read: of several attitudes in a file, the truth is one's reference and never
/// one's estimate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Side {
    /// The attitude under test.
    Estimate,
    /// Attitude of the other of two bodies, under test as the first.
    Second,
    /// Reference of the comparison.
    Reference,
}

/// Reads a track: NDJSON, CSV or MCAP, by what the file holds.
///
/// # Errors
/// The file cannot be read, or holds no attitude, or several and none named.
pub fn read(
    input: &Input,
    side: Side,
    topic: Option<&str>,
    options: &Options,
    pool: &Pool,
) -> Result<Track> {
    // A phone has a file for what it says of its own orientation.
    if let Some(own) = input.orientation()?.filter(|_| topic.is_none()) {
        return read(&own, side, topic, options, pool);
    }
    // They are for the one of the two that is another maker's table.
    let plainly = Options::default();
    let plain = |read: Vec<(Entry, [f64; 3])>| {
        let sigmas = || read.iter().map(|(_, sigma)| Vector3::from(*sigma));
        Track {
            name: input.name().display().to_string(),
            covariances: if sigmas().all(|s| s.iter().all(|v| v.is_finite())) {
                let radians = sigmas().map(|s| s.map(f64::to_radians));
                radians.map(AttitudeCovariance::from_sigma).collect()
            } else {
                Vec::new()
            },
            entries: read.into_iter().map(|(entry, _)| entry).collect(),
            cuts: Vec::new(),
            problems: Vec::new(),
        }
    };
    match input.format() {
        table if table.is_table() && input.is_own_table(options)? => from_csv(input).map(plain),
        table if table.is_table() => from_log(input, side, topic, options, pool),
        Format::Lines => match from_ndjson(input, side, topic)? {
            // Samples may have orientations beside them.
            none if none.is_empty() => from_log(input, side, topic, &plainly, pool),
            some => Ok(plain(some)),
        },
        _ => from_log(input, side, topic, &plainly, pool),
    }
}

/// The world that our own outputs say the numbers of a topic are in.
fn world_of<'s>(survey: &'s Survey, topic: &str) -> Option<&'s String> {
    let labels = &survey.facts.provenance;
    let of_topic = || labels.get(&format!("{topic} world"));
    labels.get("world").or_else(of_topic)
}

fn from_log(
    input: &Input,
    side: Side,
    topic: Option<&str>,
    options: &Options,
    pool: &Pool,
) -> Result<Track> {
    let path = input.name();
    let log = Recording::told_apart(input, topic, options, pool)?;
    let known = attitude_channel(path, &log, side, topic)?;
    let decoder = known
        .decoder(&mut Decoders::default())
        .map_err(|why| Error::unsupported(path, &why))?;
    let stated = orientation_convention(&decoder.stated().declared);
    let mut entries: Vec<Entry> = Vec::new();
    let (mut resets, mut cuts) = (None, Vec::new());
    let mut covariances = Vec::new();
    let survey = log.walk::<Error>(
        AHEAD,
        pool,
        |channel| {
            let reference = || Route::reference(decoder.clone()).with_covariances();
            is_same(&known.channel, channel).then(reference)
        },
        |items| {
            for item in items.drain(..) {
                let Item::Reference(raw, covariance) = item else {
                    continue;
                };
                let Some(wxyz) = raw.orientation else {
                    continue;
                };
                let stamp = raw.header.filter(|s| s.0 != 0).unwrap_or(raw.log);
                cuts.extend(cut(&mut resets, &raw, stamp));
                entries.push((stamp, wxyz));
                covariances.push(covariance.map(|rows| Matrix3::from_row_slice(&rows[..])));
            }
            Ok(std::ops::ControlFlow::Continue(()))
        },
    )?;
    let world = world_of(&survey, &known.channel.topic);
    let convention = world.map_or(stated, |world| convention_of(world));
    // About which axes another program's are is known of none.
    let pairs = entries.iter().zip(covariances);
    let covariances: Option<Vec<AttitudeCovariance>> = pairs
        .map(|((_, wxyz), said)| in_body(said.filter(|_| world.is_some())?, convention, *wxyz))
        .collect();
    for (_, wxyz) in &mut entries {
        *wxyz = in_flu(convention, *wxyz);
    }
    Ok(Track {
        name: format!("{} {}", path.display(), known.channel.topic),
        entries,
        cuts,
        covariances: covariances.unwrap_or_default(),
        problems: problems(&survey),
    })
}

/// Returns the instant of an orientation if its source has reset it since the one before.
pub(super) fn cut(resets: &mut Option<u8>, raw: &RawSample, stamp: Nanos) -> Option<Nanos> {
    let now = raw.orientation_resets?;
    let before = resets.replace(now)?;
    (now != before).then_some(stamp)
}

/// The convention behind our own `world` label; `start` and what is not known are taken as ENU, FLU.
fn convention_of(world: &str) -> Convention {
    world
        .parse::<World>()
        .ok()
        .and_then(World::convention)
        .unwrap_or(Convention::EnuFlu)
}

/// Converts to FLU. A row that is no rotation stays what it is, to be counted by the comparison.
fn in_flu(recorded: Convention, wxyz: [f64; 4]) -> [f64; 4] {
    Quaternion::<Nav, Body>::try_from_wxyz(wxyz)
        .map_or(wxyz, |q| recorded.convert(Convention::EnuFlu, q).wxyz())
}

/// A covariance about the world's axes of `convention`, as our own Imu messages have it, about the body's (FLU).
fn in_body(
    said: Matrix3<f64>,
    convention: Convention,
    wxyz: [f64; 4],
) -> Option<AttitudeCovariance> {
    let q = Quaternion::<Nav, Body>::try_from_wxyz(wxyz).ok()?;
    let c_nb = *q.to_dcm().as_matrix();
    let p = c_nb.transpose() * said * c_nb;
    let p = AttitudeCovariance::from_upper([p.m11, p.m12, p.m13, p.m22, p.m23, p.m33]);
    p.upper()
        .iter()
        .all(|v| v.is_finite())
        .then(|| match convention {
            Convention::EnuFlu => p,
            other => p.relabelled(|v| other.convert_body(Convention::EnuFlu, v)),
        })
}

/// The channel to take attitudes from: the one named, else the best kind of which there is just one.
fn attitude_channel<'l>(
    path: &Path,
    log: &'l Recording,
    side: Side,
    topic: Option<&str>,
) -> Result<&'l LogChannel> {
    if let Some(name) = topic {
        return log
            .channels
            .iter()
            .find(|k| k.channel.topic == name)
            .ok_or_else(|| {
                strapd_recording::Error::NoSuchTopic {
                    path: path.to_owned(),
                    topic: name.to_owned(),
                    topics: topics::listing(&log.candidates()),
                }
                .into()
            });
    }
    let mut decoders = Decoders::default();
    let mut all: Vec<(u8, &LogChannel)> = log
        .channels
        .iter()
        .filter(|k| k.role.has_orientation && carries_orientation(k, &mut decoders))
        .map(|k| (goodness(k, side), k))
        .collect();
    all.sort_by_key(|(goodness, _)| std::cmp::Reverse(*goodness));
    match all.as_slice() {
        [] => {
            let holds = topics::listing(&log.candidates());
            let what = Diagnostic::new(format!("holds no attitude; it holds:{holds}"));
            let has_rates = log.channels.iter().any(|known| known.role.has_rate);
            let made = format!(
                "strapd replay {} -o attitude.mcap makes one",
                quoted_file(path)
            );
            let what = if has_rates { what.help(made) } else { what };
            Err(Error::unsupported(path, what))
        }
        [(best, known), rest @ ..] if rest.first().is_none_or(|(next, _)| next < best) => Ok(known),
        several => {
            let list: Vec<_> = several.iter().map(|(_, k)| k.candidate()).collect();
            let list = topics::listing(&list);
            let what = Diagnostic::new(format!("several topics carry an attitude:{list}")).help(
                match side {
                    Side::Reference => format!("{REF_TOPIC} NAME takes one"),
                    Side::Estimate => format!("{TOPIC} NAME takes one"),
                    Side::Second => format!("{SECOND_TOPIC} NAME takes one"),
                },
            );
            Err(Error::unsupported(path, what))
        }
    }
}

/// The truth, for a reference, before all, and for an estimate what strapd made; an orientation of its own topic before
/// one in an Imu, before poses of other things and `/tf`.
fn goodness(known: &LogChannel, side: Side) -> u8 {
    let topic = known.channel.topic.as_str();
    match rank(&known.role) {
        _ if topic == TRUTH_TOPIC => match side {
            Side::Reference => 4,
            Side::Estimate | Side::Second => 0,
        },
        _ if known.is_derived => match side {
            Side::Reference => 1,
            Side::Estimate | Side::Second => 4,
        },
        _ if topic.trim_start_matches('/') == "tf" || is_mounting(topic) => 0,
        0 => 3,
        1 => 1,
        _ => 2,
    }
}

/// Whether the first message really has one: an Imu may mark it as absent. A track whose first rows
/// are NaN still counts.
fn carries_orientation(known: &LogChannel, decoders: &mut Decoders) -> bool {
    if let Some(stated) = &known.stated {
        return stated.has_orientation;
    }
    let Some((log, payload)) = &known.first else {
        return false;
    };
    let Ok(decoder) = known.decoder(decoders) else {
        // By its first message it has one; what is wrong with its stamps is said when it is read.
        return true;
    };
    let mut samples = Vec::new();
    decoder.decode(payload, *log, *log, &mut samples).is_ok()
        && (samples.iter().any(|s| s.orientation.is_some()) || rank(&known.role) == 0)
}

/// The longest line read from an NDJSON file.
const LINE_LIMIT: u64 = 64 * 1024;

/// Choice between two streams of attitudes.
enum Better {
    Before,
    Same,
    This,
}

/// Returns whether the stream of a line is read instead of the one before: the truth for a reference alone.
fn better(before: Option<&str>, this: &str, side: Side) -> std::result::Result<Better, String> {
    let Some(before) = before else {
        return Ok(Better::This);
    };
    let wanted = |id: &str| sensor_of_truth(id).is_some() == (side == Side::Reference);
    match (wanted(before), wanted(this)) {
        _ if before == this => Ok(Better::Same),
        (true, false) => Ok(Better::Before),
        (false, true) => Ok(Better::This),
        _ => Err(format!(
            "attitudes of both `{}` and `{}`; {TOPIC} ID takes one",
            printable(before),
            printable(this)
        )),
    }
}

/// Reads the `ATT` lines of an NDJSON file; `id` picks one of several streams, of which the truth is
/// taken for a reference and left for an estimate.
///
/// # Errors
/// The file cannot be read, a line is not JSON or is too long, or several ids and none named.
fn from_ndjson(input: &Input, side: Side, id: Option<&str>) -> Result<Vec<(Entry, [f64; 3])>> {
    let path = input.name();
    let file = input.bytes()?;
    let mut reader = BufReader::new(file);
    let mut track = Vec::new();
    let mut seen: Option<String> = None;
    let mut line = Vec::new();
    let (mut number, mut offset) = (0u64, 0u64);
    loop {
        line.clear();
        number += 1;
        let read = std::io::Read::take(&mut reader, LINE_LIMIT)
            .read_until(b'\n', &mut line)
            .map_err(|source| strapd_recording::Error::Read {
                path: path.to_owned(),
                offset,
                source,
            })?;
        offset += read as u64;
        if read == 0 {
            return Ok(track);
        }
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        if read as u64 == LINE_LIMIT {
            return Err(bad_line(path, number, "longer than 64 KiB"));
        }
        let read = Attitude::read(&line).map_err(|what| bad_line(path, number, &what))?;
        let Some(att) = read.filter(|att| id.is_none_or(|id| id == att.id)) else {
            continue;
        };
        match better(seen.as_deref(), &att.id, side)
            .map_err(|what| bad_line(path, number, &what))?
        {
            Better::Before => continue,
            Better::Same => {}
            Better::This => {
                track.clear();
                seen = Some(att.id.clone());
            }
        }
        if let Some(stamp) = att.stamp {
            let entry = (stamp, in_flu(convention_of(&att.world), att.q));
            track.push((entry, att.sigma_deg));
        }
    }
}

#[derive(Deserialize)]
struct Row {
    stamp_ns: i64,
    /// Instant of the attitude beside a synthetic sample whose stamp may be wrong.
    true_ns: Option<i64>,
    // As they were called at first.
    #[serde(alias = "w")]
    qw: Option<f64>,
    #[serde(alias = "x")]
    qx: Option<f64>,
    #[serde(alias = "y")]
    qy: Option<f64>,
    #[serde(alias = "z")]
    qz: Option<f64>,
    /// About the body's axes.
    sigma_x_deg: Option<f64>,
    sigma_y_deg: Option<f64>,
    sigma_z_deg: Option<f64>,
    #[serde(default)]
    world: String,
}

/// Reads a CSV file with at least the columns `stamp_ns,qw,qx,qy,qz`.
///
/// # Errors
/// The file cannot be read, a cell is not a number, or no row has an attitude.
fn from_csv(input: &Input) -> Result<Vec<(Entry, [f64; 3])>> {
    let path = input.name();
    let refuse = |what: String| {
        let what = Diagnostic::new(what).help("columns stamp_ns,qw,qx,qy,qz are needed");
        Error::unsupported(path, what)
    };
    let mut track = Vec::new();
    for row in csv::Reader::from_reader(BufReader::new(input.text(&Options::default())?))
        .deserialize::<Row>()
    {
        let row = row.map_err(|e| refuse(e.to_string()))?;
        // A sample without an orientation.
        let (Some(w), Some(x), Some(y), Some(z)) = (row.qw, row.qx, row.qy, row.qz) else {
            continue;
        };
        let stamp = Nanos(row.true_ns.unwrap_or(row.stamp_ns));
        let sigma = [row.sigma_x_deg, row.sigma_y_deg, row.sigma_z_deg];
        let entry = (stamp, in_flu(convention_of(&row.world), [w, x, y, z]));
        track.push((entry, sigma.map(|s| s.unwrap_or(f64::NAN))));
    }
    if track.is_empty() {
        return Err(refuse("no row carries an attitude".to_owned()));
    }
    Ok(track)
}

fn bad_line(path: &Path, number: u64, what: &str) -> Error {
    Error::unsupported(path, format!("line {number}: {what}"))
}
