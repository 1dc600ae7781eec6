//! The formats that attitudes and samples are written in: one row each. Pure.
//!
//! Apart from the sink, which knows of a format what its row says: names of files and lists in help texts come from here,
//! and what a batch becomes is the business of the [`Form`] that the row opens.

use super::form::{Form, Opening};
use super::{csv, gcsv, json, mcap, poses, tum};
use crate::error::Result;

/// Format of a file or pipe.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Format {
    /// An indexed MCAP file.
    Mcap,
    /// One `ATT` object per line.
    Ndjson,
    /// One row per sample under a header row.
    Csv,
    /// A trajectory as `evo` reads it.
    Tum,
    /// Rates and forces for Gyroflow.
    Gcsv,
    /// Orientations of every sensor in rows for OpenSim.
    Sto,
    /// A motion of a flat skeleton, a joint for every sensor.
    Bvh,
    /// A table in Parquet.
    Parquet,
    /// Format of this table's test.
    #[cfg(test)]
    Toy,
}

/// Opener of a form; what stands before the first sample goes to the vector.
type Open = fn(&Opening<'_>, &mut Vec<u8>) -> Result<Box<dyn Form>>;

/// Feature of a build that a format needs.
#[derive(Debug)]
pub(super) struct Feature {
    pub(super) name: &'static str,
    /// Ending of a format that serves without it, and who reads that.
    pub(super) instead: (&'static str, &'static str),
}

/// Facts of a format.
#[derive(Debug)]
struct Row {
    format: Format,
    /// Endings of names, the usual one first.
    endings: &'static [&'static str],
    /// Program it is for, where it is for one.
    reader: Option<&'static str>,
    feature: Option<Feature>,
    /// Whether several topics have a place in it.
    takes_several: bool,
    /// Whether it takes samples of a sensor, beside attitudes.
    takes_samples: bool,
    /// Opener; `None`: the build has not its feature.
    open: Option<Open>,
}

/// Row of a format that takes everything: what a row below leaves out.
const ANY: Row = Row {
    format: Format::Mcap,
    endings: &["mcap"],
    reader: None,
    feature: None,
    takes_several: true,
    takes_samples: true,
    open: Some(mcap::begin),
};

/// The formats, in the order in which texts list them.
const ROWS: &[Row] = &[
    ANY,
    Row {
        format: Format::Ndjson,
        endings: &["ndjson", "jsonl"],
        open: Some(json::begin),
        ..ANY
    },
    Row {
        format: Format::Csv,
        endings: &["csv"],
        takes_several: false,
        open: Some(csv::begin),
        ..ANY
    },
    Row {
        format: Format::Tum,
        endings: &["tum"],
        reader: Some("evo"),
        takes_several: false,
        takes_samples: false,
        open: Some(tum::begin),
        ..ANY
    },
    Row {
        format: Format::Gcsv,
        endings: &["gcsv"],
        reader: Some("Gyroflow"),
        takes_several: false,
        open: Some(gcsv::begin),
        ..ANY
    },
    Row {
        format: Format::Sto,
        endings: &["sto"],
        reader: Some("OpenSim"),
        takes_samples: false,
        open: Some(poses::begin_sto),
        ..ANY
    },
    Row {
        format: Format::Bvh,
        endings: &["bvh"],
        reader: Some("animation"),
        takes_samples: false,
        open: Some(poses::begin_bvh),
        ..ANY
    },
    Row {
        format: Format::Parquet,
        endings: &["parquet", "pq"],
        feature: Some(Feature {
            name: "parquet",
            instead: ("csv", "polars, pandas and duckdb"),
        }),
        #[cfg(feature = "parquet")]
        open: Some(super::parquet::begin),
        #[cfg(not(feature = "parquet"))]
        open: None,
        ..ANY
    },
    #[cfg(test)]
    tests::TOY,
];

impl Format {
    fn row(self) -> &'static Row {
        let mut rows = ROWS.iter();
        rows.find(|row| row.format == self).unwrap_or(&ANY)
    }

    /// The format that an ending of a name, in any case, stands for.
    pub(super) fn of_ending(ending: &str) -> Option<Format> {
        let has = |row: &&Row| {
            let mut known = row.endings.iter();
            known.any(|known| known.eq_ignore_ascii_case(ending))
        };
        ROWS.iter().find(has).map(|row| row.format)
    }

    /// Ending of a format that holds this one, or that it holds.
    pub(super) fn like(ending: &str) -> Option<&'static str> {
        if ending.len() < 3 {
            return None;
        }
        let mut known = ROWS.iter().flat_map(|row| row.endings).rev().copied();
        known.find(|known| known.contains(ending) || ending.contains(known))
    }

    /// Feature that this build lacks for it.
    pub(super) fn missing(self) -> Option<&'static Feature> {
        let row = self.row();
        row.feature.as_ref().filter(|_| row.open.is_none())
    }

    /// Whether several topics have a place in it.
    pub(super) fn takes_several(self) -> bool {
        self.row().takes_several
    }

    /// Whether it takes samples of a sensor, beside attitudes.
    pub(super) fn takes_samples(self) -> bool {
        self.row().takes_samples
    }

    /// Begins an output; what stands before the first sample goes to `head`. `None`: see [`Format::missing`].
    pub(super) fn open(
        self,
        opening: &Opening<'_>,
        head: &mut Vec<u8>,
    ) -> Option<Result<Box<dyn Form>>> {
        self.row().open.map(|open| open(opening, head))
    }

    /// List of the endings for attitudes: `.mcap, .ndjson, .csv, .tum (evo) or .parquet`.
    #[must_use]
    pub fn endings() -> String {
        list(ROWS.iter().map(|row| match row.reader {
            Some(reader) => format!(".{} ({reader})", row.ending()),
            None => format!(".{}", row.ending()),
        }))
    }

    /// List of the endings for samples, and of those that hold the truth about them alone.
    #[must_use]
    pub fn endings_for_samples() -> (String, String) {
        let of = |takes: bool| {
            let rows = ROWS.iter().filter(move |row| row.takes_samples == takes);
            list(rows.map(|row| format!(".{}", row.ending())))
        };
        (of(true), of(false))
    }

    /// Names of files for messages: `FILE.mcap, FILE.ndjson (or .jsonl), ...`.
    pub(super) fn files() -> String {
        let file = |row: &Row| {
            let others = row.endings.iter().skip(1);
            let mut notes: Vec<String> = others.map(|other| format!("or .{other}")).collect();
            notes.extend(row.reader.map(|reader| format!("for {reader}")));
            let feature = row.feature.as_ref().map(|feature| feature.name);
            notes.extend(feature.map(|feature| format!("with the feature {feature}")));
            match notes.is_empty() {
                true => format!("FILE.{}", row.ending()),
                false => format!("FILE.{} ({})", row.ending(), notes.join("; ")),
            }
        };
        ROWS.iter().map(file).collect::<Vec<_>>().join(", ")
    }
}

impl Row {
    fn ending(&self) -> &'static str {
        self.endings.first().copied().unwrap_or_default()
    }
}

/// `a, b or c`.
fn list(items: impl Iterator<Item = String>) -> String {
    let items: Vec<String> = items.collect();
    match items.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests;
