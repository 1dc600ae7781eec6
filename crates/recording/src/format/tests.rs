//! Promise: a format that is added to the table, with a transcriber of its own, is read by everything that reads logs.

#![allow(clippy::unwrap_used)]

use super::*;
use crate::mcap::{Reader, WalkOptions, survey};
use crate::pool::Pool;
use crate::records::imu;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::{ReadProgress, Transcript};
use crate::{Recording, Selection, Warn};
use std::ops::ControlFlow;

/// Row of a format with a rate every millisecond, as three bytes of 0.1 rad/s.
pub(super) const TOY: Row = Row {
    format: Format::Toy,
    name: "toy",
    magic: b"TOYS!\n",
    endings: &["toy"],
    reading: Reading::Transcribed(|| Box::new(Toy { at: 0 })),
    ..LOG
};

/// Transcriber of the format.
#[derive(Debug)]
struct Toy {
    at: usize,
}

impl Transcribe for Toy {
    fn step(&mut self, ahead: &[u8], is_end: bool, to: &mut Transcript) -> ReadProgress {
        let length = if self.at == 0 { TOY.magic.len() } else { 3 };
        let Some(record) = ahead.get(..length) else {
            return match is_end {
                true => ReadProgress::Used(ahead.len()),
                false => ReadProgress::Need(length),
            };
        };
        match (self.at, record) {
            (1.., [x, y, z]) => {
                let time = self.at as u64 * 1_000_000;
                let rate = [x, y, z].map(|byte| f64::from(*byte) / 10.0);
                let mut message = Vec::new();
                imu::imu(&mut message, (time, "toy"), rate, None);
                to.message(1, 0, time, &message);
            }
            _ => {
                let text = crate::decode::known_definition(imu::TYPE).unwrap_or_default();
                to.schema(1, imu::TYPE, "ros2msg", text.as_bytes());
                to.channel(1, 1, "toy/imu", "cdr", &[]);
            }
        }
        self.at += 1;
        ReadProgress::Used(length)
    }

    fn finish(self: Box<Self>) -> (String, Problems) {
        let mut problems = Problems::default();
        problems.add(self.at as u64, ProblemKind::NoIndex, None);
        ("Toys Ltd".to_owned(), problems)
    }
}

#[test]
fn a_format_of_which_the_table_has_a_row_is_told_apart_listed_surveyed_and_read_to_its_samples() {
    let mut bytes = TOY.magic.to_vec();
    for n in 0..200_u8 {
        bytes.extend([n, 10, 20]);
    }
    assert_eq!(Format::of_bytes(&bytes), Some(Format::Toy));
    assert_eq!(Format::of_name(Path::new("a.TOY")), Some(Format::Toy));
    assert!(Format::may_be_log(b"TOY") && Format::names().ends_with("Parquet, toy"));
    assert!(!Format::Toy.is_text() && !Format::Toy.is_read_anywhere());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("called.csv");
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(Format::of_file(&path).unwrap(), Some(Format::Toy));

    let found = survey(&Reader::open(&path).unwrap(), &WalkOptions::default()).unwrap();
    assert_eq!((found.facts.format, found.messages), (Format::Toy, 200));
    assert_eq!(found.facts.library, "Toys Ltd");
    assert_eq!(found.problems.first()[0].kind, ProblemKind::NoIndex);

    let pool = Pool::new(2).unwrap();
    let warn = Warn::by(|_| {});
    let selection = Selection::default();
    let recording = Recording::open(&path, &selection, &pool, &warn).unwrap();
    let mut rates = Vec::new();
    let taken = recording.samples(&selection, &pool, |_, sample, _| {
        rates.push(sample.gyro.unwrap());
        Ok::<_, Error>(ControlFlow::Continue(()))
    });
    taken.unwrap();
    assert_eq!(rates.len(), 200);
    assert_eq!(rates[150], [15.0, 1.0, 2.0]);
}

#[test]
fn each_row_of_the_table_is_of_another_format_and_no_ending_stands_for_two() {
    for (at, row) in ROWS.iter().enumerate() {
        let before = ROWS.get(..at).unwrap();
        for other in before {
            assert_ne!(row.format, other.format);
            assert_ne!(row.name, other.name);
            let shared = |ending| other.endings.contains(ending);
            assert!(!row.endings.iter().any(shared), "{}", row.name);
        }
    }
}
