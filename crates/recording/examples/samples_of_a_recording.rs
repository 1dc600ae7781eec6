//! The samples of a recording of any kind, without the rest of strapd.
//!
//! ```sh
//! cargo run -p strapd-recording --example samples_of_a_recording fixtures/xsens_mti.mcap
//! ```
//!
//! Prints the first samples and how many there are in all. MCAP, ULog, ROS 1 bags, lines of JSON, tables, a folder of one
//! of them, a pipe, or `-` for standard input; a second argument names the topic, `all` takes each that carries rates.
#![allow(clippy::print_stdout)]

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::PathBuf;
use strapd_recording::pool::Pool;
use strapd_recording::{Error, Recording, Selection, Warn};

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let path = PathBuf::from(arguments.next().unwrap_or_else(|| "-".to_owned()));
    let selection = Selection {
        topic: arguments.next(),
        ..Selection::default()
    };
    // A thread for each core. How many there are changes no sample and no order.
    let pool = Pool::new(0)?;
    let warn = Warn::by(|what| eprintln!("warning: {what}"));
    let recording = Recording::open(&path, &selection, &pool, &warn)?;
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    let lost = recording.samples(&selection, &pool, |topic, sample, _| {
        if sample.is_beside {
            // A force or a field of another sensor, to correct with.
            return Ok::<_, Error>(ControlFlow::Continue(()));
        }
        let count = counts.entry(topic.to_owned()).or_default();
        *count += 1;
        if *count <= 3 {
            // Nanoseconds; rad/s about body axes x forward, y left, z up; m/s^2.
            let stamp = sample.header.unwrap_or(sample.log);
            println!("{topic} {} {:?} {:?}", stamp.0, sample.gyro, sample.accel);
        }
        Ok(ControlFlow::Continue(()))
    })?;
    for (topic, count) in counts {
        println!("{topic}: {count} samples");
    }
    if lost > 0 {
        eprintln!("{lost} payloads or records of the file could not be read");
    }
    Ok(())
}
