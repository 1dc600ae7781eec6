//! Decoders: hand-made bytes with known numbers, every recording, and bytes nobody made on purpose.

mod bare_stamps;
mod hostile;
mod json;
mod protobuf;
mod recordings;
mod roles;
mod ros;
mod speed;
mod writer;

#[allow(unreachable_pub)]
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Channel, Decoder, Options, Undecodable};

/// Time at which the test's messages were received and sent.
const LOG: Nanos = Nanos(1_700_000_000_500_000_000);
const PUBLISH: Nanos = Nanos(1_700_000_000_400_000_000);

fn channel<'a>(message_encoding: &'a str, schema_name: &'a str, schema: &'a str) -> Channel<'a> {
    let schema_encoding = match message_encoding {
        "cdr" => "ros2msg",
        "ros1" => "ros1msg",
        "json" => "jsonschema",
        _ => "",
    };
    Channel {
        topic: "/imu",
        message_encoding,
        schema_name,
        schema_encoding,
        schema_data: schema.as_bytes(),
    }
}

fn options(fields: &[&str]) -> Options {
    Options {
        fields: fields.iter().map(|f| f.parse().unwrap()).collect(),
        ..Options::default()
    }
}

fn decode(decoder: &Decoder, payload: &[u8]) -> Result<Vec<RawSample>, Undecodable> {
    let mut out = Vec::new();
    let outcome = decoder.decode(payload, LOG, PUBLISH, &mut out);
    assert!(
        outcome.is_ok() || out.is_empty(),
        "a failure pushes nothing"
    );
    let outcome = outcome?;
    assert_eq!(outcome.samples, out.len());
    assert!(out.iter().all(|s| s.log == LOG && s.publish == PUBLISH));
    Ok(out)
}

fn decode_one(decoder: &Decoder, payload: &[u8]) -> RawSample {
    let samples = decode(decoder, payload).unwrap();
    assert_eq!(samples.len(), 1);
    samples[0]
}
