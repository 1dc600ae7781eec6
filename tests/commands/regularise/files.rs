//! End to end: a file is fitted as a whole, a pipe as it comes, and both say so.

use crate::made_logs::{ImuSample, START, STEP, motion, written};
use crate::replays::{assert_rotations, attitudes, done, only, replay_of, replay_with, target};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use strapd::pipeline::replay::run;
use strapd_attitude::condition::Clock;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::SampleKind;
use strapd_recording::pool::Pool;

/// Stamps off even ones by up to 3 % of the step, as a lattice.
fn jittered(n: usize) -> Vec<ImuSample> {
    let mut samples = motion(n);
    for (k, sample) in samples.iter_mut().enumerate() {
        sample.stamp += (k as i64 * 7919 % 600_001) - 300_000;
    }
    samples
}

fn regularised() -> EstimationSettings {
    EstimationSettings {
        regularise_stamps: true,
        // The log says so, and lines do not.
        kind: Some(SampleKind::Rate),
        ..EstimationSettings::default()
    }
}

fn lines_of(dir: &Path, samples: &[ImuSample]) -> PathBuf {
    let path = dir.join("log.ndjson");
    let mut file = std::fs::File::create(&path).unwrap();
    for s in samples {
        let (sec, nsec) = (s.stamp / 1_000_000_000, s.stamp % 1_000_000_000);
        let [x, y, z] = s.gyro;
        writeln!(
            file,
            r#"{{"class":"RATE","stamp":{{"sec":{sec},"nsec":{nsec}}},"gyro":[{x},{y},{z}]}}"#
        )
        .unwrap();
    }
    path
}

#[test]
fn stamps_stay_unless_one_asks() {
    assert!(!EstimationSettings::default().regularise_stamps);
    let dir = tempfile::tempdir().unwrap();
    let samples = jittered(1000);
    let path = written(dir.path(), "log.mcap", &samples);
    let (summary, found) = attitudes(&replay_of(&path), dir.path());
    assert!(only(&summary).stamps.is_none());
    assert!(!summary.text().contains("regularised"));
    for (sample, attitude) in samples.iter().zip(&found) {
        assert_eq!(sample.stamp, attitude.stamp);
    }
}

#[test]
fn a_file_is_fitted_as_a_whole_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &jittered(3000));
    let (summary, found) = attitudes(&replay_with(&path, regularised()), dir.path());
    assert_rotations(&found, "regularised");
    for (k, attitude) in found.iter().enumerate() {
        let off = attitude.stamp - START - k as i64 * STEP;
        assert!(off.abs() < STEP / 1000, "{k}: {off} ns");
    }
    let stamps = only(&summary).stamps.as_ref().unwrap();
    assert!(!stamps.causal && !stamps.uneven);
    assert_eq!((stamps.segments, stamps.ambiguous), (1, 0));
    // A lattice over +-300 us: uniform.
    assert!((stamps.rms_nanos / (300e3 / 3_f64.sqrt()) - 1.0).abs() < 0.01);
    assert!((stamps.max_nanos - 300_000).abs() < 10_000);
    let text = summary.text();
    assert!(
        text.contains("regularised by straight lines") && text.contains("Hz from"),
        "{text}"
    );
    let json = summary.json();
    let told = &json["topics"][0]["regularised_stamps"];
    assert_eq!(told["mode"], "lines");
    let hz = told["kept_segments"][0]["rate_hz"].as_f64().unwrap();
    assert!((hz - 100.0).abs() < 1e-3, "{hz}");
    assert!(told["jitter_removed_ns"]["p99"].as_f64().unwrap() > 280e3);
}

#[test]
fn threads_and_the_container_change_no_bit() {
    let dir = tempfile::tempdir().unwrap();
    let samples = jittered(5000);
    let mcap = written(dir.path(), "log.mcap", &samples);
    let (_, expected) = attitudes(&replay_with(&mcap, regularised()), dir.path());
    let lines = lines_of(dir.path(), &samples);
    let (summary, from_lines) = attitudes(&replay_with(&lines, regularised()), dir.path());
    assert!(!only(&summary).stamps.as_ref().unwrap().causal);
    assert_eq!(from_lines, expected);
    for threads in [1, 3] {
        let out = dir.path().join("out.ndjson");
        let mut replay = replay_with(&mcap, regularised());
        replay.targets = vec![target(&out)];
        replay.options.force = true;
        run(&replay, &Pool::new(threads).unwrap(), &mut |_| {}).unwrap();
        let found = crate::replays::ndjson(&std::fs::read_to_string(&out).unwrap());
        assert_eq!(found, expected, "{threads} threads");
    }
}

#[test]
fn a_pipe_is_filtered_as_it_comes_and_says_that_its_numbers_differ() {
    let dir = tempfile::tempdir().unwrap();
    let path = lines_of(dir.path(), &jittered(3000));
    for (input, is_mcap) in [
        (std::fs::read(&path).unwrap(), false),
        (
            std::fs::read(written(dir.path(), "log.mcap", &jittered(3000))).unwrap(),
            true,
        ),
    ] {
        let out = assert_cmd::Command::new(env!("CARGO_BIN_EXE_strapd"))
            .args(["replay", "-", "--regularise-stamps", "-v", "-o", "null:"])
            .write_stdin(input)
            .assert()
            .success();
        let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned()
            + &String::from_utf8_lossy(&out.get_output().stdout);
        assert!(
            said.contains("regularised causally"),
            "mcap {is_mcap}: {said}"
        );
        assert!(
            said.contains("can be read only once"),
            "mcap {is_mcap}: {said}"
        );
    }
}

#[test]
fn a_log_without_a_rate_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(2000);
    let mut now = START;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for sample in &mut samples {
        now += rng.random_range(STEP / 5..STEP * 9 / 5);
        sample.stamp = now;
    }
    for path in [
        written(dir.path(), "log.mcap", &samples),
        lines_of(dir.path(), &samples),
    ] {
        let out = dir.path().join("out.ndjson");
        let mut replay = replay_with(&path, regularised());
        replay.targets = vec![target(&out)];
        let said = done(&replay).unwrap_err().to_string();
        assert!(said.contains("there is no constant rate"), "{said}");
        assert!(said.contains("time index rate_hz HZ"), "{said}");
        assert!(!out.exists());
    }
}

#[test]
fn index_time_has_nothing_to_regularise() {
    let plan = EstimationSettings {
        clock: Clock::Index { rate_hz: 100.0 },
        ..regularised()
    };
    let said = plan.check().unwrap_err().to_string();
    assert!(
        said.contains("regularise_stamps") && said.contains("time index"),
        "{said}"
    );
}

#[test]
fn the_output_s_metadata_states_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &jittered(500));
    let out = dir.path().join("out.mcap");
    let mut replay = replay_with(&path, regularised());
    replay.targets = vec![target(&out)];
    done(&replay).unwrap();
    let bytes = std::fs::read(&out).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let at = summary
        .metadata_indexes
        .iter()
        .find(|m| m.name == "strapd")
        .unwrap();
    let metadata = mcap::read::metadata(&bytes, at).unwrap();
    let said = &metadata.metadata["stamps"];
    // A line through 500 stamps of this jitter knows the rate to 17 ppm.
    assert!(
        said.starts_with("regularised by straight lines: segments 1, 99.999")
            || said.starts_with("regularised by straight lines: segments 1, 100.00"),
        "{said}"
    );
}

#[test]
fn every_meaning_is_compared_on_its_own_lines() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = jittered(1500);
    // The truth of nothing in particular: what counts is that all three meanings can be run.
    for (k, sample) in samples.iter_mut().enumerate() {
        let half = 0.001 * k as f64;
        sample.orientation = Some([half.cos(), 0.0, 0.0, half.sin()]);
    }
    let path = written(dir.path(), "log.mcap", &samples);
    let mut replay = replay_with(&path, regularised());
    replay.against = Some(String::new());
    let summary = done(&replay).unwrap();
    assert_eq!(
        only(&summary).against.len(),
        4,
        "{:?}",
        only(&summary).warnings()
    );
}
