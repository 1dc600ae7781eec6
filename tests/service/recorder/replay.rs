//! Promise: recordings replay to the attitude of what was received; and what recording costs in size.

use super::{assert_whole, attitude, sample};
use nalgebra::Vector3;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use strapd::pipeline::opening;
use strapd::pipeline::replay::run;
use strapd::pipeline::request::ReplayRequest;
use strapd::serve::core::recorder::{Recorder, Settings, stream_of};
use strapd::sink::Compression;
use strapd::sink::{Options, Target, Transforms};
use strapd_attitude::frames::In;
use strapd_attitude::record::{LinearAcceleration, RawSample};
use strapd_recording::Recording;
use strapd_recording::Selection;
use strapd_recording::Source;
use strapd_recording::decode;
use strapd_recording::mcap::{WalkOptions, walk};
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::{Item, Route};

/// The samples of a fixture, decoded as `replay` decodes them.
fn samples(path: &Path) -> Vec<RawSample> {
    let log = Recording::of(
        &opening::open(path).unwrap(),
        &decode::Options::default(),
        &Pool::new(1).unwrap(),
    )
    .unwrap();
    let topic = log.choose(path, None).unwrap().topics.remove(0);
    let known = log
        .channels
        .iter()
        .find(|k| k.channel.topic == topic)
        .unwrap();
    let decoder = known.decoder(&mut Default::default()).unwrap();
    let mut all = Vec::new();
    walk(
        log.reader().unwrap(),
        &WalkOptions::default(),
        |channel| (channel.topic == topic).then(|| Route::samples(decoder.clone(), 0)),
        Route::map,
        |items| {
            for item in items.drain(..) {
                if let Item::Sample(_, raw) = item {
                    all.push(raw);
                }
            }
            ControlFlow::Continue(())
        },
    )
    .unwrap();
    all
}

/// The lines of the NDJSON a replay of `path` gives, without what names the stream.
fn attitudes(path: &Path, topic: Option<&str>, out: &Path) -> Vec<serde_json::Value> {
    let replay = ReplayRequest {
        targets: vec![Target::parse(out.to_str().unwrap()).unwrap()],
        selection: Selection {
            topic: topic.map(str::to_owned),
            ..Selection::default()
        },
        options: Options {
            force: true,
            ..Options::default()
        },
        command: "test".to_owned(),
        ..ReplayRequest::new(Source::File(path.to_owned()))
    };
    run(&replay, &Pool::new(1).unwrap(), &mut |_| {}).unwrap();
    std::fs::read_to_string(out)
        .unwrap()
        .lines()
        .map(|line| {
            let mut line: serde_json::Value = serde_json::from_str(line).unwrap();
            line.as_object_mut().unwrap().remove("id");
            line
        })
        .collect()
}

#[test]
fn a_recording_replays_to_the_same_attitude_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["xsens_mti.mcap", "ximu3.mcap", "coning_jitter.mcap"] {
        let fixture = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("fixtures")
            .join(name);
        let path = dir.path().join(name);
        let mut settings = Settings::new(&path);
        settings.min_free = 0;
        settings.flush_every = Duration::from_millis(1);
        let recorder = Recorder::start(settings).unwrap();
        let (handle, id) = (recorder.handle(), Arc::from("imu"));
        let samples = samples(&fixture);
        assert!(samples.len() > 400, "{name}");
        for (k, batch) in samples.chunks(7).enumerate() {
            handle.input(&id, batch.to_vec());
            // Other attitudes than a replay gives: they must not be taken for samples.
            let made = batch.iter().map(|_| attitude(&sample(0, 200))).collect();
            handle.attitude(&id, 7 * k as u64, made);
        }
        let status = recorder.finish();
        assert!(!status.is_lossy(), "{name}: {status:?}");
        assert_eq!(status.samples, samples.len() as u64);
        assert_whole(&path);
        let out = dir.path().join("out.ndjson");
        // The recording holds two Imu topics, the samples and the attitudes made of them live.
        let expected = attitudes(&fixture, None, &out);
        let found = attitudes(&path, Some(super::RAW), &out);
        assert_eq!(found.len(), expected.len(), "{name}");
        assert!(
            found == expected,
            "{name}: {} and {}",
            expected[9],
            found[9]
        );
    }
}

#[test]
fn a_chunk_every_two_hundred_milliseconds_costs_a_few_hundred_bytes_each() {
    // By the clock of the data, not of the wall: the recorder is given a chunk's worth of samples and
    // as long as it wants to write them.
    let dir = tempfile::tempdir().unwrap();
    let size = |compression: Compression, rate_hz: u64, per_chunk: u64| {
        let path = dir.path().join("a.mcap");
        let provenance = Default::default();
        let mut live = strapd::sink::LiveMcap::new(compression, &provenance).unwrap();
        let stream = live
            .stream(&strapd::serve::core::recorder::stream_of("imu"))
            .unwrap();
        let mut bytes = 0;
        for k in 0..60 * rate_hz {
            let raw = sample(k, rate_hz);
            live.input(stream, k, &raw);
            live.attitude(stream, k, &attitude(&raw));
            if (k + 1) % per_chunk == 0 {
                bytes += live.seal(&path).unwrap().len();
                live.booked();
            }
        }
        bytes += live.seal(&path).unwrap().len();
        live.booked();
        (bytes + live.closings()[0].len()) as f64
    };
    // The default of others' writers: chunks of 1 MiB, here 1380 samples of 760 bytes.
    for (compression, most_each, most_percent) in [
        // The goal of 1 % was set where a chunk of 40 samples is 30 kB.
        (Compression::None, 256.0, [1.0, 1.0]),
        // The first message of a chunk, which the compressor has seen nothing like, costs something
        // too, and all else is a fifth of the size: the same bytes are a greater share.
        (Compression::Zstd, 400.0, [8.0, 1.5]),
    ] {
        for (rate_hz, most_percent) in [200, 1000].into_iter().zip(most_percent) {
            let often = size(compression, rate_hz, rate_hz / 5);
            let seldom = size(compression, rate_hz, 1380);
            let more_chunks = (300 - 60 * rate_hz / 1380) as f64;
            let each = (often - seldom) / more_chunks;
            let percent = 100.0 * (often / seldom - 1.0);
            let name = compression.name();
            let said = format!(
                "{name}, {rate_hz} Hz: {:.1} kB/s, {each:.0} bytes a chunk, {percent:.2} % in all",
                often / 60e3
            );
            eprintln!("{said}");
            assert!((100.0..=most_each).contains(&each), "{said}");
            assert!(percent <= most_percent, "{said}");
        }
    }
}

#[test]
fn a_recording_has_the_accelerations_and_the_transforms_that_its_streams_have() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("named.mcap");
    let mut settings = Settings::new(&path);
    settings.min_free = 0;
    let recorder = Recorder::start(settings).unwrap();
    let handle = recorder.handle();
    for (id, transforms) in [("imu0", Transforms::None), ("imu1", Transforms::Reverse)] {
        let mut stream = stream_of(id);
        stream.has_linear_acceleration = id == "imu0";
        stream.transforms = transforms;
        stream.world_frame = "odom".to_owned();
        handle.declare(stream);
        for k in 0..20 {
            let raw = sample(k, 100);
            let mut made = attitude(&raw);
            // The first is not known yet.
            made.linear_acceleration = (k > 0).then(|| LinearAcceleration {
                body: In::assume(Vector3::new(0.1 * k as f64, 0.0, -1.0)),
                covariance: [0.01, 0.0, 0.0, 0.04, 0.0, 0.09],
            });
            handle.input(&Arc::from(id), vec![raw]);
            handle.attitude(&Arc::from(id), k, vec![made]);
        }
    }
    assert!(!recorder.finish().is_lossy());
    let bytes = std::fs::read(&path).unwrap();
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    let mut transform = Vec::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
        if message.channel.topic == "/tf" {
            transform = message.data.to_vec();
        }
    }
    let counts: Vec<_> = counts.iter().map(|(t, n)| (t.as_str(), *n)).collect();
    let expected = [
        ("/tf", 20),
        ("imu0/data", 20),
        ("imu0/data/linear_acceleration", 19),
        ("imu0/data_raw", 20),
        ("imu1/data", 20),
        ("imu1/data_raw", 20),
    ];
    assert_eq!(counts, expected);
    let at = |name: &[u8]| transform.windows(name.len()).position(|part| part == name);
    let (sensor, world) = (at(b"imu1\0").unwrap(), at(b"odom\0").unwrap());
    assert!(sensor < world, "the sensor is the parent");
}
