//! Promise: messages that the crate `mcap` has read give the samples that strapd's own reader gives, to the bit.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Channel, Handed, HandedDecoders, Refused};
use strapd_recording::pool::Pool;
use strapd_recording::{Error, Recording, Selection, Warn};

#[allow(dead_code)]
#[path = "../../examples/messages_of_another_reader.rs"]
mod example;

#[test]
fn messages_of_the_crate_mcap_decode_to_the_samples_of_our_own_reader() {
    let pool = Pool::new(2).unwrap();
    let selection = Selection {
        topic: Some("all".to_owned()),
        ..Selection::default()
    };
    let mut compared = 0;
    for name in ["xsens_mti.mcap", "coning_average.mcap"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../fixtures")
            .join(name);
        let warn = Warn::by(|_| {});
        let recording = Recording::open(&path, &selection, &pool, &warn).unwrap();
        let mut ours: BTreeMap<String, Vec<RawSample>> = BTreeMap::new();
        let lost = recording.samples(&selection, &pool, |topic, sample, _| {
            if sample.gyro.is_some() {
                ours.entry(topic.to_owned()).or_default().push(*sample);
            }
            Ok::<_, Error>(ControlFlow::Continue(()))
        });
        let (theirs, unreadable) = example::samples(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!((lost.unwrap(), unreadable), (0, 0));
        for (topic, samples) in &ours {
            assert_eq!(samples, &theirs[topic], "{name} {topic}");
            compared += samples.len();
        }
    }
    assert!(compared > 2000, "{compared}");
}

#[test]
fn a_channel_of_something_else_is_refused_each_time_and_a_cut_message_once() {
    let mut decoders = HandedDecoders::default();
    let channel = |name| Channel {
        topic: "/t",
        message_encoding: "cdr",
        schema_name: name,
        schema_encoding: "ros2msg",
        schema_data: b"",
    };
    let handed = |channel_id| Handed {
        channel_id,
        log: Nanos(1),
        publish: Nanos(1),
        payload: &[0, 1, 0, 0],
    };
    let mut out = Vec::new();
    for _ in 0..2 {
        let refused = decoders.decode(&channel("a/msg/Unknown"), &handed(1), &mut out);
        assert!(matches!(refused, Err(Refused::Channel(_))), "{refused:?}");
        let refused = decoders.decode(&channel("sensor_msgs/msg/Imu"), &handed(2), &mut out);
        assert!(matches!(refused, Err(Refused::Message(_))), "{refused:?}");
    }
    assert!(out.is_empty());
}
