//! Promise: a format that is added to the table, with a form of its own, is written by everything that writes.

#![allow(clippy::unwrap_used)]

use super::*;
use crate::error::Error;
use crate::sink::form::Slot;
use crate::sink::tests::sample;
use crate::sink::{Options, Provenance, Sink, Stream, Target};
use strapd_attitude::record::Nanos;

/// Row of a format with one byte a sample.
pub(super) const TOY: Row = Row {
    format: Format::Toy,
    endings: &["toy", "toys"],
    reader: Some("children"),
    takes_several: false,
    open: Some(|_, head| {
        head.extend_from_slice(b"TOYS!\n");
        Ok(Box::new(Toy))
    }),
    ..ANY
};

#[derive(Debug)]
struct Toy;

impl Form for Toy {
    fn encode(&self, slot: &mut Slot) {
        let stamps = slot.batch.samples.iter().map(|sample| sample.stamp.0);
        slot.text.extend(stamps.map(|stamp| b'0' + stamp as u8));
    }

    fn closing(&mut self) -> std::io::Result<Vec<u8>> {
        Ok(b"\nbye".to_vec())
    }
}

#[test]
fn a_format_of_which_the_table_has_a_row_is_listed_opened_by_its_ending_and_written() {
    assert!(Format::endings().ends_with(".parquet or .toy (children)"));
    assert!(Format::endings_for_samples().0.ends_with("or .toy"));
    for (name, listed) in [
        ("a.bag", "FILE.toy (or .toys; for children)"),
        ("a", "FILE.toy (or .toys; for children), s3://"),
        ("a.toysx", "-o a.toys? files: "),
    ] {
        let said = Target::parse(name).unwrap_err().to_string();
        assert!(said.contains(listed), "{said}");
    }

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.TOYS");
    let target = Target::from_path(&path).unwrap();
    assert_eq!(target.format(), Some(Format::Toy));
    let (options, provenance) = (Options::default(), Provenance::default());
    let streams = [Stream::new("/imu", "imu"), Stream::new("/other", "imu")];
    let refused = Sink::create(&target, &[], options, &streams, &provenance);
    assert!(matches!(refused, Err(Error::Usage(_))));
    let mut sink = Sink::create(&target, &[], options, &streams[..1], &provenance).unwrap();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let samples = [3, 1, 4].map(|stamp| sample(Nanos(stamp)));
    let _ = sink.write(0, &samples, &pool).unwrap();
    assert_eq!(sink.finish().unwrap().messages, 3);
    assert_eq!(std::fs::read(&path).unwrap(), b"TOYS!\n314\nbye");
}

#[test]
fn a_format_whose_feature_the_build_lacks_is_refused_with_what_serves_instead() {
    let parsed = Target::parse("dir/a.pq");
    match Format::Parquet.missing() {
        None => assert_eq!(parsed.unwrap().format(), Some(Format::Parquet)),
        Some(_) => {
            let said = parsed.unwrap_err().to_string();
            for words in ["without the feature parquet", "-o dir/a.csv, which polars"] {
                assert!(said.contains(words), "{said}");
            }
        }
    }
}
