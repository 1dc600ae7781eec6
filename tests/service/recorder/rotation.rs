//! One recording in several files.

use super::{assert_whole, sample};
use std::sync::Arc;
use std::time::Duration;
use strapd::serve::core::recorder::{Recorder, Settings, Split, stream_of};

#[test]
fn a_recording_split_by_size_loses_nothing_between_its_files_and_overwrites_none() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    std::fs::write(dir.path().join("a_0001.mcap"), b"precious").unwrap();
    let mut settings = Settings::new(&path);
    settings.min_free = 0;
    settings.force = true;
    settings.flush_every = Duration::from_millis(5);
    settings.split = Some("200kB".parse::<Split>().unwrap());
    let recorder = Recorder::start(settings).unwrap();
    let (handle, id) = (recorder.handle(), Arc::from("imu"));
    let mut k = 0;
    while handle.status().files.len() < 4 {
        handle.input(&id, (k..k + 100).map(|k| sample(k, 1000)).collect());
        k += 100;
        std::thread::sleep(Duration::from_millis(1));
    }
    let status = recorder.finish();
    assert!(!status.is_lossy(), "{status:?}");
    let names: Vec<_> = status
        .files
        .iter()
        .map(|f| f.file_name().unwrap())
        .collect();
    assert_eq!(
        &names[..4],
        ["a_0002.mcap", "a_0003.mcap", "a_0004.mcap", "a_0005.mcap"],
        "behind what is there: one that was moved away is not replaced by a newer one"
    );
    assert_eq!(
        std::fs::read(dir.path().join("a_0001.mcap")).unwrap(),
        b"precious"
    );
    let messages: u64 = status.files.iter().map(|file| assert_whole(file)).sum();
    assert_eq!((messages, status.samples), (k, k));
    let bytes: u64 = status
        .files
        .iter()
        .map(|f| f.metadata().unwrap().len())
        .sum();
    assert_eq!(bytes, status.bytes);
    let first = status.files[0].metadata().unwrap().len();
    assert!((200_000..400_000).contains(&first), "{first}");
}

#[test]
fn reopening_after_the_file_was_moved_away_begins_a_new_one_under_the_same_name() {
    let dir = tempfile::tempdir().unwrap();
    let (path, moved) = (dir.path().join("a.mcap"), dir.path().join("old.mcap"));
    let mut settings = Settings::new(&path);
    settings.min_free = 0;
    let recorder = Recorder::start(settings).unwrap();
    let (handle, id) = (recorder.handle(), Arc::from("imu"));
    handle.input(&id, vec![sample(0, 200)]);
    std::fs::rename(&path, &moved).unwrap();
    handle.reopen();
    handle.input(&id, vec![sample(1, 200), sample(2, 200)]);
    let status = recorder.finish();
    assert_eq!(status.files, [path.clone(), path.clone()], "{status:?}");
    assert_eq!((assert_whole(&moved), assert_whole(&path)), (1, 2));
}

#[test]
fn sizes_and_times_are_read_and_everything_else_is_refused() {
    for (text, split) in [
        ("512MiB", Split::Bytes(512 << 20)),
        ("2 GB", Split::Bytes(2_000_000_000)),
        ("90s", Split::Every(Duration::from_secs(90))),
        ("10min", Split::Every(Duration::from_secs(600))),
        ("1h", Split::Every(Duration::from_secs(3600))),
    ] {
        assert_eq!(text.parse::<Split>().unwrap(), split, "{text}");
    }
    for text in [
        "",
        "5",
        "0s",
        "-1h",
        "1.5h",
        "99999999999999GiB",
        "MiB",
        "10 parsecs",
    ] {
        assert!(text.parse::<Split>().is_err(), "{text}");
    }
}

#[test]
fn a_stream_nobody_named_is_recorded_beside_its_attitude() {
    for (id, input, output, frame) in [
        ("imu0", "imu0/data_raw", "imu0/data", "imu0"),
        ("/arm/imu/", "/arm/imu/data_raw", "/arm/imu/data", "arm/imu"),
        (
            "/imu/data_raw",
            "/imu/data_raw",
            "/imu/data",
            "imu/data_raw",
        ),
    ] {
        let stream = stream_of(id);
        assert_eq!(
            (stream.id.as_str(), stream.input_topic.as_str()),
            (id, input)
        );
        assert_eq!(
            (stream.output_topic.as_str(), stream.frame_id.as_str()),
            (output, frame)
        );
    }
}
