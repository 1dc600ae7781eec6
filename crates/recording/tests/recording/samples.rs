//! A recording of any kind, opened and read: which samples come, in which units and order, and what is told of it.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use strapd_attitude::record::{RawSample, SampleKind};
use strapd_recording::pool::Pool;
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::topic_reading::{TopicItem, TopicReading};
use strapd_recording::{Error, Input, Recording, Selection, TopicBeside, Warn};

const TWO_SENSORS: &str = r#"{"id":"left","stamp":{"sec":1,"nsec":0},"gyro":[0.5,0,0]}
{"id":"right","stamp":{"sec":1,"nsec":5},"gyro":[0,0.25,0]}
{"id":"left","stamp":{"sec":2,"nsec":0},"gyro":[1.5,0,0]}
{"id":"right","stamp":{"sec":2,"nsec":5},"gyro":[0,0.75,0]}
"#;

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures")).join(name)
}

/// Whoever is told, and what was.
fn listener() -> (Warn, Arc<Mutex<Vec<String>>>) {
    let told = Arc::new(Mutex::new(Vec::new()));
    let to = told.clone();
    let warn = Warn::by(move |what| to.lock().unwrap().push(what.to_owned()));
    (warn, told)
}

fn of(topic: &str) -> Selection {
    Selection {
        topic: Some(topic.to_owned()),
        ..Selection::default()
    }
}

type Samples = Vec<(String, RawSample, Option<SampleKind>)>;

fn all(recording: &Recording, selection: &Selection, pool: &Pool) -> Result<(Samples, u64), Error> {
    let mut samples = Vec::new();
    let lost = recording.samples(selection, pool, |topic, sample, kind| {
        samples.push((topic.to_owned(), *sample, kind));
        Ok::<_, Error>(ControlFlow::Continue(()))
    })?;
    Ok((samples, lost))
}

fn lines(text: &str, selection: &Selection, pool: &Pool) -> Recording {
    let (warn, _) = listener();
    let input = Input::of_stream(Path::new("two.ndjson"), text.as_bytes(), &warn).unwrap();
    Recording::told_apart(&input, selection.topic.as_deref(), &selection.decode, pool).unwrap()
}

#[test]
fn a_file_and_a_stream_of_its_bytes_give_the_same_samples_on_any_number_of_threads() {
    // As other programs count them (fixtures/README.md).
    for (name, count) in [
        ("xsens_mti.mcap", 953),
        ("constant_rate_lz4.bag", 251),
        ("px4_flight.ulg", 3627),
    ] {
        let selection = Selection::default();
        let (warn, _) = listener();
        let path = fixture(name);
        let pool = Pool::new(1).unwrap();
        let file = Recording::open(&path, &selection, &pool, &warn).unwrap();
        let (from_file, lost) = all(&file, &selection, &pool).unwrap();
        let own = from_file.iter().filter(|(_, sample, _)| !sample.is_beside);
        assert_eq!(own.count(), count, "{name}");
        let bytes = std::fs::read(&path).unwrap();
        let input = Input::of_stream(Path::new(name), bytes.as_slice(), &warn).unwrap();
        let pool = Pool::new(3).unwrap();
        let stream = Recording::told_apart(&input, None, &selection.decode, &pool).unwrap();
        let (from_stream, lost_of_stream) = all(&stream, &selection, &pool).unwrap();
        assert_eq!(format!("{from_file:?}"), format!("{from_stream:?}"));
        assert_eq!(lost, lost_of_stream);
    }
}

#[test]
fn samples_come_in_the_body_axes_that_are_said_whatever_those_of_the_format() {
    let (selection, pool) = (Selection::default(), Pool::new(1).unwrap());
    let (warn, _) = listener();
    // PX4's are x forward, y right, z down.
    let path = fixture("px4_flight.ulg");
    let recording = Recording::open(&path, &selection, &pool, &warn).unwrap();
    let (samples, _) = all(&recording, &selection, &pool).unwrap();
    let mut decoders = Decoders::new(&selection.decode);
    let reading = TopicReading::new(&recording, None, &mut decoders).unwrap();
    let mut raw = Vec::new();
    let took = reading.walk(&pool, |taken| {
        if let TopicItem::Sample(_, sample) = taken
            && let Some(gyro) = sample.gyro
        {
            raw.push(gyro);
        }
        Ok::<_, Error>(ControlFlow::Continue(()))
    });
    took.unwrap();
    let in_flu: Vec<[f64; 3]> = samples.iter().filter_map(|(_, s, _)| s.gyro).collect();
    assert_eq!(raw.len(), in_flu.len());
    for ([x, y, z], is) in raw.iter().zip(in_flu) {
        assert_eq!(is, [*x, -y, -z]);
    }
}

#[test]
fn several_topics_come_in_one_walk_each_sample_under_the_name_of_its_own() {
    let pool = Pool::new(1).unwrap();
    let selection = of("all");
    let recording = lines(TWO_SENSORS, &selection, &pool);
    let (samples, lost) = all(&recording, &selection, &pool).unwrap();
    let said: Vec<(&str, [f64; 3])> = samples
        .iter()
        .map(|(topic, sample, _)| (topic.as_str(), sample.gyro.unwrap()))
        .collect();
    let should = [
        ("left", [0.5, 0.0, 0.0]),
        ("right", [0.0, 0.25, 0.0]),
        ("left", [1.5, 0.0, 0.0]),
        ("right", [0.0, 0.75, 0.0]),
    ];
    assert_eq!((said.as_slice(), lost), (should.as_slice(), 0));
}

#[test]
fn several_topics_and_none_selected_are_refused_with_their_names() {
    let (pool, selection) = (Pool::new(1).unwrap(), Selection::default());
    let recording = lines(TWO_SENSORS, &selection, &pool);
    let error = all(&recording, &selection, &pool).unwrap_err();
    assert!(matches!(error, Error::SeveralImuTopics { .. }), "{error:?}");
    let said = error.to_string();
    assert!(said.contains("left") && said.contains("right"), "{said}");
}

#[test]
fn what_is_selected_beside_several_topics_belongs_to_none_and_is_refused() {
    let pool = Pool::new(1).unwrap();
    let selection = Selection {
        mag: Some(TopicBeside {
            topic: "field".to_owned(),
            fields: Vec::new(),
        }),
        ..of("all")
    };
    let recording = lines(TWO_SENSORS, &selection, &pool);
    let error = all(&recording, &selection, &pool).unwrap_err();
    let said = error.to_string();
    assert!(
        said.contains("field could belong to any of 2 topics"),
        "{said}"
    );
}

#[test]
fn who_has_enough_is_given_no_more_and_who_fails_is_told_so() {
    #[derive(Debug)]
    enum Mine {
        Theirs(Error),
        Own(u32),
    }
    impl From<Error> for Mine {
        fn from(error: Error) -> Mine {
            Mine::Theirs(error)
        }
    }
    let (pool, selection) = (Pool::new(2).unwrap(), Selection::default());
    let (warn, _) = listener();
    let path = fixture("xsens_mti.mcap");
    let recording = Recording::open(&path, &selection, &pool, &warn).unwrap();
    let mut given = 0;
    let ended = recording.samples(&selection, &pool, |_, _, _| {
        given += 1;
        Ok::<_, Error>(match given {
            5 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        })
    });
    assert_eq!((ended.unwrap(), given), (0, 5));
    let failed = recording.samples(&selection, &pool, |_, _, _| Err(Mine::Own(7)));
    assert!(matches!(failed, Err(Mine::Own(7))), "{failed:?}");
    let failed = recording.samples(&of("/none"), &pool, |_, _, _| Err(Mine::Own(7)));
    assert!(
        matches!(failed, Err(Mine::Theirs(Error::NoSuchTopic { .. }))),
        "{failed:?}"
    );
}

#[test]
fn what_is_no_error_is_told_in_words_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let text = format!("{TWO_SENSORS}{{\"id\":\"left\",\"gy\n").replace("right", "left");
    std::fs::write(&path, text).unwrap();
    let (pool, selection) = (Pool::new(1).unwrap(), Selection::default());
    let (warn, told) = listener();
    let recording = Recording::open(&path, &selection, &pool, &warn).unwrap();
    let (samples, lost) = all(&recording, &selection, &pool).unwrap();
    assert_eq!((samples.len(), lost), (4, 1));
    let told = told.lock().unwrap();
    let has = |words: &str| told.iter().any(|what| what.contains(words));
    assert!(has("it is called CSV, but holds NDJSON"), "{told:?}");
    assert!(has("first undecodable payload, line 5"), "{told:?}");
    assert!(has("1 payloads could not be decoded"), "{told:?}");
}
