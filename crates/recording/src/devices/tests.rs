//! Promise: frames of each protocol give the samples that others read in them, cut and damaged in any way, and captures
//! and living links the same.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod link;
mod made;
mod orientation;

use super::reader::Reader;
use super::sample::Sample;
use super::*;
use crate::format::Format;
use crate::mcap::{Reader as Log, WalkOptions, survey};
use crate::records::problem::ProblemKind;
use made::{hex, stream};
use strapd_attitude::record::{Nanos, SampleKind};

fn named(name: &str) -> &'static Protocol {
    PROTOCOLS.iter().find(|row| row.name == name).unwrap()
}

fn read(name: &str, bytes: &[u8]) -> (Vec<Sample>, Reader) {
    let mut reader = Reader::of(named(name), named(name).device().unwrap());
    reader.push(bytes);
    (std::mem::take(&mut reader.taken.samples), reader)
}

fn close(one: [f64; 3], other: [f64; 3]) {
    for (one, other) in one.into_iter().zip(other) {
        assert!(
            (one - other).abs() <= 1e-6 * other.abs().max(1e-3),
            "{one} {other}"
        );
    }
}

/// Devices, each with bytes of 40 samples.
fn devices() -> Vec<(&'static str, Vec<u8>)> {
    let devices = PROTOCOLS.iter().filter(|row| row.device().is_some());
    devices
        .map(|row| (row.name, stream(row.name, 40)))
        .collect()
}

#[test]
fn packets_of_an_mti_are_those_that_its_makers_tool_recorded() {
    // Captured from an MTi by github.com/einride/xsens-go (testdata/1, MIT), with the numbers that it decodes.
    let bytes = [
        "faff3662102002a9861060040314ed5310100c07440be007e301140d2f1837e020040180000740200cbc8e5466c0e82f10bf9ad29e40100cb935269fbd949930bc46234680200cbb425c343b1068df3ae1c7e58030103f800001b778c7f03738d82737107feef7",
        "faff3671102002a9871060040314edb710100c07dca26007e301140d2f1837e020040000000520300cc2c6ec743e083f53c33330cb40200c3ce7e9cbc11a8e2fbfd04d0c40100c39931323bdc5d49bbc8552c480200c3ab21f42bb513ab9bb51e94c8030103f80000136e3ff0cb785e822b78657df19",
        "faff3671102002a9891060040314ee7f10100c090dcf6007e301140d2f1837e020040000000520300cc2c6ec343e05cd53c333305b40200c3c920368c11b1e34bfd2cdd740100c39378fb2bdc68d15bc86e98680200cb99c407aba915cddbb6364708030103f800001b5c8009db6ba1076b79187f6a1",
    ];
    let bytes = hex(&bytes.concat());
    let (samples, reader) = read("xsens", &bytes);
    assert_eq!((samples.len(), reader.frames), (3, 3));
    // Between 43399 and 43401 one packet was left out here.
    assert_eq!(reader.taken.missing, 1);
    let times: Vec<u64> = samples.iter().map(|s| s.time.unwrap()).collect();
    assert_eq!(
        times,
        [51_703_123, 51_703_223, 51_703_423].map(|n| n * 100_000)
    );
    let first = &samples[0];
    assert_eq!(first.kind, Some(SampleKind::Rotation));
    // Twice the vector part of DeltaQ, which is small.
    close(
        first.rate.unwrap(),
        [
            -1.482850348111242e-5,
            1.101758152799448e-5,
            8.612854799139313e-6,
        ]
        .map(|v| 2.0 * v),
    );
    close(
        first.force.unwrap(),
        [
            -0.017374228686094284,
            -7.255744934082031,
            -1.209552526473999,
        ],
    );
    assert_eq!(first.orientation, None);
}

#[test]
fn numbers_of_an_mti_come_in_four_forms_and_from_what_it_was_told_to_send() {
    let rate = [0.5, -1.25, 3.0];
    for form in 0..4u16 {
        let bytes = made::xsens(
            &[(0x8020 | form, made::numbers(form, &rate))],
            Some(7),
            Some(9),
        );
        let (samples, _) = read("xsens", &bytes);
        assert_eq!(
            (samples[0].rate, samples[0].kind),
            (Some(rate), None),
            "{form}"
        );
    }
    // pi as the maker's document has it in 16.32.
    let pi = made::xsens(
        &[(0x8022, hex("243958100003243958100003243958100003"))],
        None,
        None,
    );
    assert!((read("xsens", &pi).0[0].rate.unwrap()[0] - std::f64::consts::PI).abs() < 1e-4);
    // A world other than east, north, up is left out; clipped axes are counted.
    let q = made::numbers(0, &[1.0, 0.0, 0.0, 0.0]);
    let of = |id, word: u32| {
        let rate = (0x8020, made::numbers(0, &rate));
        made::xsens(
            &[rate, (id, q.clone()), (0xe020, word.to_be_bytes().to_vec())],
            None,
            None,
        )
    };
    let (samples, reader) = read(
        "xsens",
        &[of(0x2010, 1 << 12), of(0x2014, 1 << 23)].concat(),
    );
    assert_eq!(samples[0].orientation, Some([1.0, 0.0, 0.0, 0.0]));
    assert_eq!((samples[1].orientation, reader.taken.clipped), (None, 1));
    // Velocity over the time since the packet before is the force.
    let of = |n: u16| {
        let items = [
            (0x8033, made::numbers(3, &[1.0, 0.0, 0.0, 0.0])),
            (0x4013, made::numbers(3, &[0.0, 0.0, 0.098])),
        ];
        made::xsens(&items, Some(n), Some(u32::from(n) * 100))
    };
    let (samples, _) = read("xsens", &[of(1), of(2), of(4)].concat());
    let forces: Vec<_> = samples.iter().map(|s| s.force).collect();
    close(forces[1].unwrap(), [0.0, 0.0, 9.8]);
    assert_eq!(
        (forces[0], forces[2]),
        (None, None),
        "over a loss there is no interval"
    );
}

#[test]
fn a_rotation_keeps_its_size_and_sign_beyond_a_half_turn_of_its_quaternion() {
    let half = 0.7f64;
    let q = [half.cos(), 0.0, half.sin(), 0.0];
    for sign in [1.0, -1.0] {
        let item = (0x8033, made::numbers(3, &q.map(|v| v * sign)));
        let (samples, _) = read("xsens", &made::xsens(&[item], None, None));
        close(samples[0].rate.unwrap(), [0.0, 1.4, 0.0]);
    }
}

#[test]
fn messages_of_an_ximu3_are_read_in_both_forms_alike_and_behind_a_multiplexer() {
    let numbers = [10.0, -20.5, 0.25, 0.0, 0.125, -1.0];
    let binary = made::ximu3(b'I', 1_234_567, &numbers);
    let text = b"I,1234567,10.0,-20.5,0.25,0.0,0.125,-1.0\r\n".to_vec();
    let (one, _) = read("ximu3", &binary);
    let (other, _) = read("ximu3", &text);
    assert_eq!(one, other);
    close(
        one[0].rate.unwrap(),
        [10.0, -20.5, 0.25].map(f64::to_radians),
    );
    close(one[0].force.unwrap(), [0.0, 1.225_831_25, -9.80665]);
    assert_eq!(one[0].time, Some(1_234_567_000));
    // Line feeds and escapes within a message are stuffed.
    let stuffed = made::ximu3(b'M', 0x0a_db_0a, &[0.5, 0.25, -0.5]);
    assert!(stuffed.len() > 22);
    let (samples, _) = read("ximu3", &stuffed);
    assert_eq!(
        (samples[0].time, samples[0].field),
        (Some(0x0a_db_0a * 1000), Some([0.5, 0.25, -0.5]))
    );
    let of = |unit: u8| [&[b'^', unit], binary.as_slice()].concat();
    let (samples, _) = read("ximu3", &[of(b'A'), of(b'B')].concat());
    assert_eq!(
        samples.iter().map(|s| s.unit).collect::<Vec<_>>(),
        [Some(b'A'), Some(b'B')]
    );
}

#[test]
fn frames_of_witmotion_are_in_si_and_dated() {
    // 2015-03-09 12:30:45.678; 1 g on z; 1000 deg/s about x.
    let time = made::witmotion(0x50, [15 | 3 << 8, 9 | 12 << 8, 30 | 45 << 8, 678]);
    let force = made::witmotion(0x51, [0, 0, 2048, 0]);
    let rate = made::witmotion(0x52, [16_384, 0, -16_384, 0]);
    let field = made::witmotion(0x54, [100, -200, 300, 0]);
    let (samples, _) = read(
        "witmotion",
        &[time.clone(), force.clone(), rate.clone(), field].concat(),
    );
    assert_eq!(samples.len(), 2);
    assert_eq!(samples[0].time, Some(1_425_904_245_678_000_000));
    assert_eq!(samples[1].time, samples[0].time);
    close(
        samples[0].rate.unwrap(),
        [1000.0, 0.0, -1000.0].map(f64::to_radians),
    );
    close(samples[0].force.unwrap(), [0.0, 0.0, 9.80665]);
    assert_eq!(samples[1].field, Some([100.0, -200.0, 300.0]));
    // A time that was damaged costs the sample; a device without times has none to lose.
    let (samples, reader) = read(
        "witmotion",
        &[&time, &rate, &force, &rate].map(Vec::as_slice).concat(),
    );
    assert_eq!((samples.len(), reader.taken.missing), (1, 1));
    let (samples, reader) = read(
        "witmotion",
        &[&force, &rate, &force, &rate].map(Vec::as_slice).concat(),
    );
    assert_eq!(
        (samples.len(), samples[1].time, reader.taken.missing),
        (2, None, 0)
    );
}

#[test]
fn lines_and_messages_of_a_vectornav_are_read_with_up_as_up() {
    // As a VN-100 sent it (public drivers quote it): nose down by 37.3 degrees.
    let line = b"$VNYMR,-165.981,-037.301,+001.245,+00.2901,+00.0720,+00.7482,-05.966,-00.150,-07.836,+00.001373,-00.001533,-00.001054*68\r\n";
    let (samples, _) = read("vectornav", line);
    assert_eq!(samples[0].force, Some([-5.966, 0.150, 7.836]));
    assert_eq!(samples[0].rate, Some([0.001373, 0.001533, 0.001054]));
    assert_eq!(
        (samples[0].field, samples[0].time),
        (Some([0.2901, -0.0720, -0.7482]), None)
    );
    let f = |v: [f32; 3]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    // Group 1: time and DeltaTheta (interval, degrees, velocity). Group 3: raw rates, saturation.
    let delta = [
        0.01f32.to_le_bytes().to_vec(),
        f([1.0, 2.0, -3.0]),
        f([0.0, 0.0, -0.098]),
    ]
    .concat();
    let of = |n: u64| {
        let common = [(n * 10_000_000).to_le_bytes().to_vec(), delta.clone()].concat();
        made::vectornav(&[
            (0, 1 | 1 << 11, common),
            (2, 1 << 3 | 1 << 11, [f([9.0; 3]), vec![0x40, 0]].concat()),
        ])
    };
    let (samples, reader) = read("vectornav", &[of(1), of(2)].concat());
    assert_eq!((samples.len(), reader.taken.clipped), (2, 2));
    assert_eq!(
        (samples[1].time, samples[1].kind),
        (Some(20_000_000), Some(SampleKind::Rotation))
    );
    close(
        samples[1].rate.unwrap(),
        [1.0, -2.0, 3.0].map(f64::to_radians),
    );
    close(samples[1].force.unwrap(), [0.0, 0.0, 9.8]);
    // Fields of the fifth group are stepped over; a group whose lengths change is none that can be cut.
    let attitude = (4, 1 << 1, f([1.0, 2.0, 3.0]));
    let (samples, _) = read(
        "vectornav",
        &made::vectornav(&[(0, 1 << 5, f([1.0, 2.0, 3.0])), attitude]),
    );
    assert_eq!(samples[0].rate, Some([1.0, -2.0, -3.0]));
    assert_eq!(
        read("vectornav", &made::vectornav(&[(3, 1, vec![0; 8])])).0,
        []
    );
}

#[test]
fn packets_of_mip_are_read_by_any_of_their_clocks() {
    let f = |v: [f32; 3]| v.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    let rate = (0x05, f([0.1, -0.2, 0.3]));
    let force = (0x04, f([0.0, 0.0, -1.0]));
    let gps = [5000.5f64.to_be_bytes().to_vec(), vec![0x08, 0xfc, 0, 0x1f]].concat();
    for (clock, time) in [
        ((0xd5, 77u64.to_be_bytes().to_vec()), Some(77)),
        (
            (0xd3, gps),
            Some((315_964_800 + 2300 * 604_800 + 5000) * 1_000_000_000 + 500_000_000),
        ),
        (
            (0x0e, 62_500u32.to_be_bytes().to_vec()),
            Some(1_000_000_000),
        ),
        ((0x17, vec![0; 4]), None),
    ] {
        let (samples, _) = read(
            "mip",
            &made::mip(0x80, &[force.clone(), rate.clone(), clock]),
        );
        assert_eq!((samples[0].time, samples[0].kind), (time, None));
        close(samples[0].rate.unwrap(), [0.1, 0.2, -0.3]);
        close(samples[0].force.unwrap(), [0.0, 0.0, 9.80665]);
    }
    // Angles before rates; answers and other sets are no samples.
    let angle = made::mip(0x80, &[rate.clone(), (0x07, f([1e-3, 0.0, 0.0]))]);
    let bytes = [
        made::mip(0x82, std::slice::from_ref(&rate)),
        angle,
        made::mip(0x80, &[rate]),
    ]
    .concat();
    let (samples, _) = read("mip", &bytes);
    assert_eq!(
        (samples.len(), samples[0].kind),
        (1, Some(SampleKind::DeltaAngle))
    );
}

#[test]
fn bytes_cut_anywhere_give_the_same_samples_behind_a_boot_text_and_half_a_frame() {
    for (name, bytes) in devices() {
        let (all, _) = read(name, &bytes);
        assert!(all.len() >= 40, "{name}: {}", all.len());
        let text = b"ets Jun  8 2016 00:22:57\r\nboot: ok\r\n";
        let noisy = [text, &bytes[3..], &bytes].concat();
        for size in [1, 2, 3, 7, 31, 256, 4096] {
            let mut reader = Reader::of(named(name), named(name).device().unwrap());
            noisy.chunks(size).for_each(|part| reader.push(part));
            let rest = &reader.taken.samples[reader.taken.samples.len() - all.len()..];
            assert_eq!(rest.len(), all.len());
            let motions = |samples: &[Sample]| {
                samples
                    .iter()
                    .map(|s| (s.rate, s.field))
                    .collect::<Vec<_>>()
            };
            assert_eq!(motions(rest), motions(&all), "{name} {size}");
        }
    }
}

#[test]
fn a_frame_with_a_changed_byte_is_left_out_and_those_around_it_are_not() {
    for (name, bytes) in devices() {
        // Messages of an x-IMU3 have no checksum: of a changed number nobody knows.
        if name == "ximu3" {
            continue;
        }
        let (all, _) = read(name, &bytes);
        let mut lost = 0;
        for at in (0..bytes.len()).step_by(5) {
            let mut changed = bytes.clone();
            changed[at] ^= 0x11;
            let (samples, _) = read(name, &changed);
            assert!(
                samples.len() + 3 >= all.len(),
                "{name} {at}: {}",
                samples.len()
            );
            assert!(
                samples
                    .iter()
                    .all(|sample| all.iter().any(|s| s.rate == sample.rate)),
                "{name} {at}"
            );
            lost += usize::from(samples.len() < all.len());
        }
        assert!(lost > 10, "{name}");
    }
}

#[test]
fn a_capture_is_a_recording_of_the_same_samples_with_its_damage_named() {
    for (name, bytes) in devices() {
        let (all, _) = read(name, &bytes);
        let rates = all.iter().filter(|s| s.rate.is_some()).count();
        let fields = all.iter().filter(|s| s.field.is_some()).count();
        // From within a frame on, as captures begin.
        for begin in [0, 2] {
            let bytes = [b"boot\r\n", &bytes[begin..], &bytes].concat();
            assert_eq!(Format::of_bytes(&bytes), Some(Format::Device), "{name}");
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("capture.bin");
            std::fs::write(&path, &bytes).unwrap();
            let stream = Log::from_stream("c", Box::new(std::io::Cursor::new(bytes.clone())));
            assert_eq!(stream.unwrap().format(), Format::Device, "{name}");
            let survey = survey(&Log::open(&path).unwrap(), &WalkOptions::default()).unwrap();
            let messages = survey.messages;
            assert_eq!(survey.facts.format, Format::Device);
            assert_eq!(survey.facts.library, named(name).title);
            let (one, all) = ((rates + fields) as u64, 2 * (rates + fields) as u64);
            assert!(
                messages <= all && messages + one / 30 + 2 >= all,
                "{name}: {messages} of {all}"
            );
            let lost = |problem: &crate::records::problem::Problem| {
                !matches!(problem.kind, ProblemKind::FramesMissing { .. })
            };
            assert!(
                !survey.problems.first().iter().any(lost),
                "{name}: {:?}",
                survey.problems
            );
        }
    }
}

#[test]
fn a_capture_from_a_pipe_may_begin_within_a_frame() {
    for (name, bytes) in devices() {
        // Line ends stand in the middle of frames.
        let bytes = [b"\x0a\x00\x0a", &bytes[5..]].concat();
        let head = crate::format::head_of(&mut std::io::BufReader::with_capacity(16, &bytes[..]));
        assert_eq!(
            Format::of_bytes(&head.unwrap()),
            Some(Format::Device),
            "{name}"
        );
    }
}

#[test]
fn no_text_and_no_noise_is_taken_for_a_capture() {
    let mut seed = 1u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 24) as u8
    };
    for _ in 0..50 {
        let bytes: Vec<u8> = (0..4096).map(|_| noise()).collect();
        assert!(!is_capture(&bytes));
    }
    for text in [
        "I,x,y,z\n1,2,3,4\n",
        "t,gx,gy,gz\n0,1,2,3\n1,1,2,3\n",
        "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\n",
        "{\"gyro\":[1,2,3]}\n",
    ] {
        assert!(!is_capture(text.repeat(20).as_bytes()), "{text}");
        assert!(!may_be_capture(text.as_bytes()), "{text}");
    }
    assert!(may_be_capture(&stream("xsens", 1)) && may_be_capture(&[0xfa]));
}

#[test]
fn what_can_be_asked_for_is_the_table() {
    assert_eq!(Asked::parse("xsens"), Ok(Asked::Named(named("xsens"))));
    assert_eq!(
        Asked::names(),
        "auto, mavlink, ximu3, xsens, witmotion, vectornav, mip, lines"
    );
    assert!(Asked::parse("bno08x-rvc").unwrap_err().contains("no rate"));
    assert!(
        Asked::parse("x")
            .unwrap_err()
            .contains("one of auto, mavlink")
    );
}

#[test]
fn the_documents_have_a_row_for_each_protocol() {
    let page = include_str!("../../../../docs/connect.md");
    for row in PROTOCOLS {
        assert!(page.contains(row.title), "{}", row.title);
        let asked = format!("protocol={}", row.name);
        assert!(page.contains(&asked) || row.refusal().is_some(), "{asked}");
        assert!(!row.carries.is_empty());
    }
}
