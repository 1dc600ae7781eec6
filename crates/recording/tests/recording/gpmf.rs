//! Telemetry of GoPro's cameras: the numbers that GoPro's own parser reads of the same payloads, alone and as a track
//! of a video, with stamps; cut, changed, and videos of something else.

use crate::mcap_logs::{from_bytes, read};
use crate::meter::Meter;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;
use std::time::Duration;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::Error;
use strapd_recording::decode::{Channel, Decoder, Options};
use strapd_recording::format::Format;
use strapd_recording::mcap::{Message, Reader, WalkOptions, WalkReport, walk};
use strapd_recording::pool::Pool;
use strapd_recording::recording::instants::Instants;

fn fixture(name: &str) -> Vec<u8> {
    let fixtures = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures");
    std::fs::read(PathBuf::from(fixtures).join(name)).unwrap()
}

/// Every sample, in order.
fn samples(bytes: &[u8]) -> (Vec<RawSample>, WalkReport) {
    let mut found = Vec::new();
    let report = walk(
        from_bytes(bytes).unwrap(),
        &WalkOptions::default(),
        |channel| {
            let schema = channel.schema.as_deref()?;
            let channel = Channel {
                topic: &channel.topic,
                message_encoding: &channel.message_encoding,
                schema_name: &schema.name,
                schema_encoding: &schema.encoding,
                schema_data: &schema.data,
            };
            Some(Decoder::compile(&channel, &Options::default()).unwrap())
        },
        |decoder: &Decoder, message: &Message<'_>, out: &mut Vec<RawSample>| {
            let log = Nanos(message.log_time as i64);
            decoder.decode(message.data, log, log, out).unwrap();
        },
        |items| {
            found.append(items);
            std::ops::ControlFlow::Continue(())
        },
    )
    .unwrap();
    (found, report)
}

fn boxed(kind: &[u8; 4], parts: &[&[u8]]) -> Vec<u8> {
    let inner = parts.concat();
    let length = (8 + inner.len() as u32).to_be_bytes();
    [&length[..], kind, &inner].concat()
}

fn words(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_be_bytes()).collect()
}

/// 2024-05-31 19:33:20 UTC, as videos count.
const CREATED: u32 = 3_800_000_000;
const SINCE_1970: u64 = 3_800_000_000 - 2_082_844_800;

/// A video with a picture track and these payloads, each 1.001 s, `per_chunk` of them in a run.
fn video(payloads: &[&[u8]], per_chunk: usize, kind: &[u8; 4]) -> Vec<u8> {
    let head = boxed(b"ftyp", &[b"mp41", &words(&[0]), b"mp41"]);
    let data = payloads.concat();
    let mut at = head.len() + 8;
    let mut places = Vec::new();
    for run in payloads.chunks(per_chunk) {
        places.push(at as u32);
        at += run.iter().map(|payload| payload.len()).sum::<usize>();
    }
    let count = payloads.len() as u32;
    let sizes: Vec<u32> = payloads
        .iter()
        .map(|payload| payload.len() as u32)
        .collect();
    let entry = boxed(kind, &[&[0; 8]]);
    let tables = boxed(
        b"stbl",
        &[
            &boxed(b"stsd", &[&words(&[0, 1]), &entry]),
            &boxed(b"stts", &[&words(&[0, 1, count, 1001])]),
            &boxed(b"stsc", &[&words(&[0, 1, 1, per_chunk as u32, 1])]),
            &boxed(b"stsz", &[&words(&[0, 0, count]), &words(&sizes)]),
            &boxed(
                b"stco",
                &[&words(&[0, places.len() as u32]), &words(&places)],
            ),
        ],
    );
    let clock = words(&[0, CREATED, CREATED, 1000, count * 1001, 0]);
    let track = |tables: &[u8], handler: &[u8; 4]| {
        let media = boxed(
            b"mdia",
            &[
                &boxed(b"mdhd", &[&clock]),
                &boxed(b"hdlr", &[&words(&[0, 0]), handler, &[0; 12]]),
                &boxed(b"minf", &[tables]),
            ],
        );
        boxed(b"trak", &[&boxed(b"tkhd", &[&[0; 84]]), &media])
    };
    // Four frames of a byte each, wherever.
    let picture = boxed(
        b"stbl",
        &[
            &boxed(b"stsd", &[&words(&[0, 1]), &boxed(b"avc1", &[&[0; 8]])]),
            &boxed(b"stts", &[&words(&[0, 2, 3, 33, 1, 34])]),
            &boxed(b"stsc", &[&words(&[0, 1, 1, 4, 1])]),
            &boxed(b"stsz", &[&words(&[0, 1, 4])]),
            &boxed(b"stco", &[&words(&[0, 1, 8])]),
        ],
    );
    let index = boxed(
        b"moov",
        &[
            &boxed(b"mvhd", &[&clock]),
            &track(&picture, b"vide"),
            &track(&tables, b"meta"),
        ],
    );
    [head, boxed(b"mdat", &[&data]), index].concat()
}

#[test]
fn frames_of_the_picture_are_instants_on_the_clock_of_the_telemetry() {
    let payload = [0; 40];
    let file = tempfile::NamedTempFile::new().unwrap();
    let frames = |bytes: &[u8]| {
        std::fs::write(file.path(), bytes).unwrap();
        let pool = Pool::new(1).unwrap();
        let read = Instants::named("frames").read(file.path(), &Options::default(), &pool);
        read.map(|(frames, _)| frames.iter().map(|t| t.0).collect::<Vec<_>>())
    };
    let whole = video(&[&payload], 1, b"gpmd");
    let begins = SINCE_1970 as i64 * 1_000_000_000;
    let expected = [0, 33, 66, 99].map(|ms| begins + ms * 1_000_000);
    assert_eq!(frames(&whole).unwrap(), expected);
    // A count that no file of this size can have is not believed.
    let at = memchr::memmem::find(&whole, &words(&[0, 1, 4])).unwrap();
    let mut many = whole.clone();
    many[at + 8..at + 12].copy_from_slice(&u32::MAX.to_be_bytes());
    let at = memchr::memmem::find(&many, &words(&[0, 1, 1, 4, 1])).unwrap();
    many[at + 12..at + 16].copy_from_slice(&u32::MAX.to_be_bytes());
    assert_eq!(frames(&many).unwrap().len(), many.len());
    let none = [&whole[..], b""].concat();
    let at = memchr::memmem::find(&none, b"vide").unwrap();
    let mut sound = none;
    sound[at..at + 4].copy_from_slice(b"soun");
    let error = frames(&sound).unwrap_err().to_string();
    assert!(error.contains("no track with a picture"), "{error}");
    let error = frames(b"t_ns\n1\n").unwrap_err().to_string();
    assert!(error.contains("it is none"), "{error}");
    // Whatever stands in its boxes, it ends with no more frames than bytes.
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for _ in 0..4000 {
        let mut changed = whole.clone();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..changed.len());
            changed[at] = rng.random();
        }
        if let Ok(found) = frames(&changed) {
            assert!(found.len() <= changed.len());
        }
    }
}

/// Sums over the samples of a vector, and of its parts without their signs.
fn sums(vectors: impl Iterator<Item = [f64; 3]>) -> [f64; 6] {
    vectors.fold([0.0; 6], |mut sums, vector| {
        for (axis, value) in vector.iter().enumerate() {
            sums[axis] += value;
            sums[3 + axis] += value.abs();
        }
        sums
    })
}

#[track_caller]
fn close(ours: [f64; 6], theirs: [f64; 6]) {
    for (ours, theirs) in ours.iter().zip(theirs) {
        // They are printed with eight digits behind the point.
        assert!((ours - theirs).abs() < 1e-8, "{ours} {theirs}");
    }
}

#[test]
fn the_samples_of_a_camera_are_those_that_its_makers_parser_reads() {
    // py-gpmf-parser 0.1.1 (GoPro's gpmf-parser): sums of its columns, which it brings into the order z, x, y.
    let sorted = |[z, x, y]: [f64; 3], [az, ax, ay]: [f64; 3]| [x, y, z, ax, ay, az];
    for (name, rates, forces, (n, m)) in [
        (
            "gopro_hero6.raw",
            sorted(
                [-29.03194888, 36.04526092, -11.91586794],
                [29.13951012, 36.25399361, 44.67412141],
            ),
            sorted(
                [2035.59330144, -59.14354067, -11.99521531],
                [2035.59330144, 59.14354067, 11.99521531],
            ),
            (198, 198),
        ),
        (
            "gopro_fusion.raw",
            sorted(
                [-119.01916933, 192.88072417, -669.82641108],
                [426.12247071, 516.41853035, 1140.87007455],
            ),
            sorted(
                // The first five of 197 were taken before the first rate, to which the sixth belongs.
                [127.3995208, -488.44258407, 1740.18660259],
                [294.88277414, 488.44258407, 1740.18660259],
            ),
            (3300, 192),
        ),
    ] {
        let raw = fixture(name);
        for bytes in [raw.clone(), video(&[&raw], 1, b"gpmd")] {
            let (ours, report) = samples(&bytes);
            assert_eq!(ours.len(), n, "{name}");
            close(sums(ours.iter().map(|s| s.gyro.unwrap())), rates);
            assert_eq!(
                ours.iter().filter(|s| s.accel.is_some()).count(),
                m,
                "{name}"
            );
            close(sums(ours.iter().filter_map(|s| s.accel)), forces);
            assert!(ours.iter().all(|s| s.orientation.is_none()));
            assert_eq!(report.survey.facts.format, Format::Gpmf);
            assert!(
                report.survey.problems.is_empty(),
                "{:?}",
                report.survey.problems
            );
        }
    }
}

#[test]
fn samples_lie_evenly_between_the_beginnings_of_payloads() {
    let raw = fixture("gopro_hero6.raw");
    let (ours, report) = samples(&video(&[&raw, &raw, &raw], 2, b"gpmd"));
    assert_eq!(ours.len(), 594);
    assert_eq!(report.survey.facts.library, "GoPro Hero6 Black");
    for (nth, sample) in ours.iter().enumerate() {
        let (payload, k) = (nth as u64 / 198, nth as u64 % 198);
        let expected =
            SINCE_1970 * 1_000_000_000 + payload * 1_001_000_000 + 1_001_000_000 * k / 198;
        assert_eq!(sample.header, Some(Nanos(expected as i64)), "{nth}");
        assert_eq!(sample.log.0, expected as i64);
    }
    // Alone, without a clock of its own: a second for each payload.
    let (alone, _) = samples(&[&raw[..], &raw].concat());
    assert_eq!(alone.len(), 396);
    assert_eq!(alone[198].log.0 - alone[0].log.0, 1_000_000_000);
}

/// An item: its key, the kind of its values, how large one is and how many, and their bytes, filled up to four.
fn item(key: &[u8; 4], kind: u8, size: u8, bytes: &[u8]) -> Vec<u8> {
    let count = (bytes.len() / usize::from(size)) as u16;
    let mut item = [&key[..], &[kind, size], &count.to_be_bytes(), bytes].concat();
    item.resize(item.len().next_multiple_of(4), 0);
    item
}

/// A payload of so many rates.
fn rates(count: usize) -> Vec<u8> {
    let rates: Vec<u8> = (0..3 * count)
        .flat_map(|n| (n as i16).to_be_bytes())
        .collect();
    let scale = item(b"SCAL", b's', 2, &1000_i16.to_be_bytes());
    let stream = [scale, item(b"GYRO", b's', 6, &rates)].concat();
    let number = item(b"DVID", b'L', 4, &1_u32.to_be_bytes());
    let device = [number, item(b"STRM", 0, 1, &stream)].concat();
    item(b"DEVC", 0, 1, &device)
}

/// A camera's last payload holds less than a second if the recording was stopped within one.
#[test]
fn samples_of_the_last_payload_are_as_far_apart_as_those_before_unless_the_track_says_how_long_it_is()
 {
    let payloads = [rates(200), rates(200), rates(118)];
    let last_step = |bytes: &[u8]| {
        let (ours, report) = samples(bytes);
        assert_eq!(ours.len(), 518, "{:?}", report.survey.problems);
        (ours[517].log.0 - ours[400].log.0) / 117
    };
    assert_eq!(last_step(&payloads.concat()), 5_000_000);
    // One length for all is not that of the last.
    let whole: Vec<&[u8]> = payloads.iter().map(Vec::as_slice).collect();
    let alike = video(&whole, 1, b"gpmd");
    assert_eq!(last_step(&alike), 5_005_000);
    // A length of its own is: here 0.8 s.
    let table = boxed(b"stts", &[&words(&[0, 1, 3, 1001])]);
    let own = boxed(b"stts", &[&words(&[0, 2, 2, 1001, 1, 800])]);
    let at = memchr::memmem::find(&alike, &table).unwrap();
    let mut changed = [&alike[..at], &own, &alike[at + table.len()..]].concat();
    for kind in [b"stbl", b"minf", b"mdia", b"trak", b"moov"] {
        // The last of its kind: that of the telemetry, which the index ends with.
        let at = memchr::memmem::rfind(&changed, kind).unwrap() - 4;
        let length = u32::from_be_bytes(changed[at..at + 4].try_into().unwrap()) + 8;
        changed[at..at + 4].copy_from_slice(&length.to_be_bytes());
    }
    assert_eq!(last_step(&changed), 800_000_000 / 118);
}

#[test]
fn the_cameras_own_stamps_are_preferred_to_the_time_of_the_payload() {
    let raw = fixture("gopro_fusion.raw");
    let mut later = raw.clone();
    // The second payload's samples are stamped 0.98 s later than the first's.
    for stamp in [82_006_526_u64, 81_978_859] {
        let at = memchr::memmem::find(&later, &stamp.to_be_bytes()).unwrap();
        later[at..at + 8].copy_from_slice(&(stamp + 980_000).to_be_bytes());
    }
    let (ours, _) = samples(&video(&[&raw, &later], 1, b"gpmd"));
    let time = |nth: usize| ours[nth].header.unwrap().0;
    assert_eq!(time(3300) - time(0), 980_000_000);
    assert_eq!(time(1650) - time(0), 490_000_000);
    // Of the last, nothing follows.
    assert_eq!(time(3300 + 1650) - time(3300), 500_500_000);
    // Across the border of payloads no force is lost.
    let forces = ours.iter().filter(|s| s.accel.is_some()).count();
    assert_eq!(forces, 197 + 192);
    // The first stamp of all, that of the exposure times, is not looked at: forces come first.
    assert_eq!(time(0) as u64, SINCE_1970 * 1_000_000_000 + 27_667_000);
}

#[test]
fn a_video_without_telemetry_or_without_its_index_is_called_so() {
    let raw = fixture("gopro_hero6.raw");
    let whole = video(&[&raw, &raw], 1, b"gpmd");
    let index = memchr::memmem::find(&whole, b"moov").unwrap();
    for bytes in [
        video(&[&raw], 1, b"tmcd"),
        whole[..index - 4].to_vec(),
        whole[..whole.len() - 100].to_vec(),
    ] {
        let error = from_bytes(&bytes).unwrap_err();
        let Error::NotRead { format, .. } = error else {
            panic!("{error}");
        };
        assert!(format.name.contains("a video"), "{}", format.name);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("v.mp4");
        std::fs::write(&path, &bytes).unwrap();
        assert!(Format::of_file(&path).is_err());
        assert!(Reader::open(&path).is_err());
    }
}

#[test]
fn telemetry_cut_anywhere_gives_the_payloads_before_the_cut_and_says_so() {
    let raw = fixture("gopro_hero6.raw");
    let bytes = [&raw[..], &raw, &raw].concat();
    let (all, _) = samples(&bytes);
    for cut in (64..bytes.len()).step_by(61) {
        let (ours, report) = samples(&bytes[..cut]);
        let whole = cut / raw.len();
        assert!(ours.len() >= whole * 198, "{cut}: {}", ours.len());
        let same = ours.iter().zip(&all).take(whole * 198);
        assert!(same.into_iter().all(|(a, b)| a == b), "{cut}");
        let is_border = [0, 4396].contains(&(cut % raw.len()));
        assert!(is_border || report.survey.problems.losses() > 0, "{cut}");
    }
}

#[test]
fn what_stands_between_payloads_and_streams_of_other_forms_are_skipped_and_said() {
    let raw = fixture("gopro_hero6.raw");
    let (ours, report) = samples(&[&raw[..], &[0x55; 1000], &raw].concat());
    assert_eq!(ours.len(), 396);
    assert_eq!(report.survey.problems.bytes_skipped(), 1000);
    // A length that is damaged costs its own payload.
    for length in [0xff, 0x7f] {
        let mut changed = [&raw[..], &raw, &raw].concat();
        changed[raw.len() + 5] = length;
        let (ours, report) = samples(&changed);
        assert_eq!(ours.len(), 396, "{length}");
        assert!(report.survey.problems.losses() > 0);
    }
    for (from, to) in [
        (&b"rad/s"[..], &b"deg/s"[..]),
        (b"ORINc\x01\x00\x03YxZ", b"ORINc\x01\x00\x03YyZ"),
    ] {
        let mut changed = raw.clone();
        let gyro = memchr::memmem::find(&changed, b"Gyroscope").unwrap();
        let at = gyro + memchr::memmem::find(&changed[gyro..], from).unwrap();
        changed[at..at + to.len()].copy_from_slice(to);
        let (ours, report) = samples(&changed);
        assert!(ours.is_empty());
        assert_eq!(
            report.survey.problems.losses(),
            1,
            "{:?}",
            report.survey.problems
        );
    }
}

#[test]
fn thousands_of_changed_videos_and_streams_neither_panic_nor_hang() {
    let raw = fixture("gopro_hero6.raw");
    let seeds = [
        [&raw[..], &raw].concat(),
        video(&[&raw, &raw, &raw], 2, b"gpmd"),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    let mut meter = Meter::start();
    for case in 0..4_000 {
        let mut bytes = seeds[case % 2].clone();
        let index = bytes.len() - 700;
        for _ in 0..rng.random_range(1..5) {
            // Tables and heads hurt most.
            let at = match rng.random_range(0..3) {
                0 => rng.random_range(8..400),
                1 => rng.random_range(index..bytes.len() - 8),
                _ => rng.random_range(8..bytes.len() - 8),
            };
            match rng.random_range(0..4) {
                0 => bytes[at] ^= 1 << rng.random_range(0..8),
                1 => bytes[at..at + 4].fill([0, 0x7f, 0xff][rng.random_range(0..3)]),
                2 => bytes[at..at + 4].copy_from_slice(&[0, 0, 0, 1]),
                _ => bytes.truncate(bytes.len() - rng.random_range(0..8)),
            }
        }
        if let Ok(reader) = from_bytes(&bytes) {
            let (ours, report) = read(reader);
            assert!(ours.len() < bytes.len() / 3, "{case}");
            assert_eq!(report.survey.messages as usize, ours.len());
        }
        meter.lap(Duration::from_secs(20), case);
    }
}
