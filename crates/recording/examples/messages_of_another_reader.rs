//! The samples of an MCAP that is read with the crate `mcap`: its messages are handed to the decoders of strapd.
//!
//! ```sh
//! cargo run -p strapd-recording --example messages_of_another_reader fixtures/xsens_mti.mcap
//! ```
//!
//! For whoever iterates over a log already. A damaged one ends here at the first fault, where `Recording` goes on.
#![allow(clippy::print_stdout)]

use std::collections::BTreeMap;
use std::error::Error;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Channel, Handed, HandedDecoders, Options, Refused};

/// Samples of each topic.
pub type Topics = BTreeMap<String, Vec<RawSample>>;

/// Samples of each topic that carries rates, in the order of the file, and the number of messages that cannot be read.
pub fn samples(log: &[u8]) -> Result<(Topics, u64), Box<dyn Error>> {
    let mut decoders = HandedDecoders::new(Options::default());
    let mut topics = Topics::new();
    let mut unreadable = 0;
    for message in mcap::MessageStream::new(log)? {
        let message = message?;
        let schema = message.channel.schema.as_deref();
        let channel = Channel {
            topic: &message.channel.topic,
            message_encoding: &message.channel.message_encoding,
            schema_name: schema.map_or("", |schema| &schema.name),
            schema_encoding: schema.map_or("", |schema| &schema.encoding),
            schema_data: schema.map_or(&[], |schema| &schema.data),
        };
        let handed = Handed {
            channel_id: message.channel.id,
            log: Nanos(i64::try_from(message.log_time)?),
            publish: Nanos(i64::try_from(message.publish_time)?),
            payload: &message.data,
        };
        let mut found = Vec::new();
        match decoders.decode(&channel, &handed, &mut found) {
            // A transform, a picture: most channels of a log are none of samples.
            Err(Refused::Channel(_)) => {}
            Err(Refused::Message(_)) => unreadable += 1,
            Ok(_) => {
                let rates = found.into_iter().filter(|sample| sample.gyro.is_some());
                let topic = channel.topic.to_owned();
                topics.entry(topic).or_default().extend(rates);
            }
        }
    }
    Ok((topics, unreadable))
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("name an MCAP")?;
    let (topics, unreadable) = samples(&std::fs::read(path)?)?;
    for (topic, samples) in &topics {
        for sample in samples.iter().take(3) {
            let stamp = sample.header.unwrap_or(sample.log);
            println!("{topic} {} {:?} {:?}", stamp.0, sample.gyro, sample.accel);
        }
        println!("{topic}: {} samples", samples.len());
    }
    if unreadable > 0 {
        eprintln!("{unreadable} messages could not be read");
    }
    Ok(())
}
