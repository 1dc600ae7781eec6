//! Attitudes of every stream -> one table of frames: BVH for animation, `.sto` for OpenSim. Pure.
//!
//! Both say first how many rows follow or have all sensors in one row, so attitudes are kept until the end: 40 bytes each.
//! Rows are even in time, at the median step of the first stream; between two of its attitudes a sensor turns about one
//! axis at one rate. They begin where the last sensor begins and end where the first ends: nothing is made up.

mod bvh;
mod sto;
#[cfg(test)]
mod tests;

use super::axes::{convention, north_west_up};
use super::form::{Form, Opening, Slot};
use crate::error::Result;
use std::io;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::Nanos;
use strapd_attitude::worlds::Convention;

/// Most rows for an attitude: stamps that ask for more are far from even.
const MOST_ROWS: i64 = 64;
/// Step of a table in which no sensor has two attitudes, ns.
const ONE_ROW: i64 = 10_000_000;

/// Attitudes of a sensor in time.
#[derive(Debug)]
struct Track {
    id: String,
    world: Convention,
    /// Stamp and `[w, x, y, z]`, FLU body to a world with z up.
    poses: Vec<(Nanos, [f64; 4])>,
}

/// Rows of a table: instants that are even, and the attitude of each sensor at each.
struct Frames {
    names: Vec<String>,
    /// Time between two rows, ns.
    step: i64,
    /// Attitudes of all sensors, row by row.
    rows: Vec<Vec<[f64; 4]>>,
}

/// Writer of a table.
type Write = fn(&Frames) -> Vec<u8>;

#[derive(Debug)]
struct Poses {
    tracks: Vec<Track>,
    write: Write,
}

/// Begins a motion in BVH.
pub(super) fn begin_bvh(opening: &Opening<'_>, _: &mut Vec<u8>) -> Result<Box<dyn Form>> {
    Ok(begin(opening, bvh::write))
}

/// Begins a table of orientations for OpenSim.
pub(super) fn begin_sto(opening: &Opening<'_>, _: &mut Vec<u8>) -> Result<Box<dyn Form>> {
    Ok(begin(opening, sto::write))
}

fn begin(opening: &Opening<'_>, write: Write) -> Box<dyn Form> {
    let tracks = opening.streams.iter().map(|stream| Track {
        id: stream.id.clone(),
        world: convention(&stream.world_axes),
        poses: Vec::new(),
    });
    Box::new(Poses {
        tracks: tracks.collect(),
        write,
    })
}

impl Form for Poses {
    /// Nothing: all is written at the end.
    fn encode(&self, _: &mut Slot) {}

    fn in_order<'s>(&mut self, slot: &'s mut Slot) -> io::Result<[&'s [u8]; 3]> {
        let batch = &slot.batch;
        if let Some(track) = self.tracks.get_mut(batch.stream) {
            for sample in &batch.samples {
                // A stamp that goes back has no place in a table; of two alike the first has it.
                let is_later = track.poses.last().is_none_or(|last| sample.stamp > last.0);
                if let (true, Some(q)) = (is_later, north_west_up(track.world, sample)) {
                    track.poses.push((sample.stamp, q));
                }
            }
        }
        Ok([&[], &[], &[]])
    }

    fn closing(&mut self) -> io::Result<Vec<u8>> {
        frames(&self.tracks).map(|frames| (self.write)(&frames))
    }
}

/// The rows that all sensors have in common.
fn frames(tracks: &[Track]) -> io::Result<Frames> {
    let tracks: Vec<&Track> = tracks.iter().filter(|t| !t.poses.is_empty()).collect();
    let names = names(&tracks);
    let begin = tracks.iter().filter_map(|t| t.poses.first()).map(|p| p.0);
    let end = tracks.iter().filter_map(|t| t.poses.last()).map(|p| p.0);
    let (Some(begin), Some(end), Some(first)) = (begin.max(), end.min(), tracks.first()) else {
        return Ok(Frames {
            names,
            step: ONE_ROW,
            rows: Vec::new(),
        });
    };
    let refuse = |what: String| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    if end < begin {
        return refuse(
            "the sensors have no time in common, and a row has the attitude of each".to_owned(),
        );
    }
    let step = median_step(&first.poses);
    let count = end.since(begin) / step + 1;
    let all: usize = tracks.iter().map(|t| t.poses.len()).sum();
    if count > MOST_ROWS.saturating_mul(i64::try_from(all).unwrap_or(i64::MAX)) {
        return refuse(format!(
            "{count} rows a step of {} s apart for {all} attitudes: the stamps are too far from even",
            step as f64 * 1e-9
        ));
    }
    let mut places = vec![0; tracks.len()];
    let row = |n: i64| {
        let at = Nanos(begin.0.saturating_add(n.saturating_mul(step)));
        let of = |(track, place): (&&Track, &mut usize)| pose_at(&track.poses, place, at);
        tracks.iter().zip(&mut places).map(of).collect()
    };
    Ok(Frames {
        names,
        step,
        rows: (0..count).map(row).collect(),
    })
}

/// Names without what ends a word, each once.
fn names(tracks: &[&Track]) -> Vec<String> {
    let letter = |c: char| match c {
        c if c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.') => c,
        _ => '_',
    };
    let mut names: Vec<String> = Vec::new();
    for track in tracks {
        let plain: String = track.id.trim_matches('/').chars().map(letter).collect();
        let plain = if plain.is_empty() {
            "sensor".to_owned()
        } else {
            plain
        };
        let numbered = (2..).map(|n| format!("{plain}_{n}"));
        let mut free = std::iter::once(plain.clone()).chain(numbered);
        let free = free.find(|name| !names.contains(name));
        names.push(free.unwrap_or(plain));
    }
    names
}

fn median_step(poses: &[(Nanos, [f64; 4])]) -> i64 {
    let mut steps: Vec<i64> = poses
        .windows(2)
        .map(|two| two[1].0.since(two[0].0))
        .collect();
    if steps.is_empty() {
        return ONE_ROW;
    }
    let middle = steps.len() / 2;
    (*steps.select_nth_unstable(middle).1).max(1)
}

/// The attitude at an instant, on the way from the one before it to the one behind it; `place` is that of the one before, and
/// goes on alone.
fn pose_at(poses: &[(Nanos, [f64; 4])], place: &mut usize, at: Nanos) -> [f64; 4] {
    while poses.get(*place + 1).is_some_and(|next| next.0 <= at) {
        *place += 1;
    }
    let Some((from, q)) = poses.get(*place) else {
        return [1.0, 0.0, 0.0, 0.0];
    };
    match poses.get(*place + 1) {
        Some((until, next)) if at > *from => {
            let part = at.since(*from) as f64 / until.since(*from) as f64;
            let (q, next) = (
                Quaternion::<(), ()>::assume_unit(*q),
                Quaternion::assume_unit(*next),
            );
            q.slerp(&next, part).wxyz()
        }
        _ => *q,
    }
}
