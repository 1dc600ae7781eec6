//! Writes a log of any length for measuring speed and memory: `sensor_msgs/msg/Imu` messages of 324 bytes
//! of a smooth, random-looking motion.
//!
//! ```text
//! cargo run --release --example generate_log -- OUT.mcap --messages 5000000 --compression zstd
//! ```
//!
//! Rates and forces are sums of sines with incommensurable frequencies, so all 53 bits of each number
//! look random: this is harder on a compressor than a real sensor, whose numbers come from 16 bits.

#![allow(clippy::print_stdout)]

#[path = "make_fixtures/imu_cdr.rs"]
mod imu_cdr;

use clap::{Parser, ValueEnum};
use imu_cdr::{ImuSample, SENSOR_DATA_QOS, imu_definition, imu_message};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Generates an IMU log for measurements.
#[derive(Parser, Debug)]
struct Arguments {
    /// File to write; replaced when it exists.
    output: PathBuf,
    /// Number of messages.
    #[arg(long, default_value_t = 5_000_000)]
    messages: u64,
    /// Stop sooner, when the file has this many bytes.
    #[arg(long)]
    max_bytes: Option<u64>,
    /// Compression of the chunks (the `mcap` crate's default level and chunk size).
    #[arg(long, value_enum, default_value_t = Compression::Zstd)]
    compression: Compression,
    /// Messages per second of log time.
    #[arg(long, default_value_t = 1000.0, value_parser = positive)]
    rate_hz: f64,
    /// Moves each stamp by up to this many nanoseconds either way; under half a period, so that order stays.
    #[arg(long, default_value_t = 0)]
    jitter_ns: i64,
    /// Topic of the messages.
    #[arg(long, default_value = "/imu/data_raw")]
    topic: String,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum Compression {
    None,
    Lz4,
    Zstd,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if rate > 0.0 && rate <= 1e6 => Ok(rate),
        Ok(rate) => Err(format!("{rate} is not above 0 and up to 1e6")),
        Err(error) => Err(error.to_string()),
    }
}

/// 2023-11-14 22:13:20 UTC.
const START: i64 = 1_700_000_000_000_000_000;

/// Offset in the 324 bytes of the numbers that change.
const GYRO_OFFSET: usize = 132;
const ACCEL_OFFSET: usize = 228;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let period = 1e9 / arguments.rate_hz;
    if arguments.jitter_ns < 0 || arguments.jitter_ns as f64 >= period / 2.0 {
        return Err(format!(
            "--jitter-ns {} is not in 0 .. {:.0}, half a period",
            arguments.jitter_ns,
            period / 2.0
        )
        .into());
    }

    let file = BufWriter::with_capacity(1 << 20, File::create(&arguments.output)?);
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .library("strapd generate_log")
        .compression(match arguments.compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        })
        .create(file)?;
    let schema = writer.add_schema(
        "sensor_msgs/msg/Imu",
        "ros2msg",
        imu_definition().as_bytes(),
    )?;
    let qos = BTreeMap::from([(
        "offered_qos_profiles".to_owned(),
        SENSOR_DATA_QOS.to_owned(),
    )]);
    let channel_id = writer.add_channel(schema, &arguments.topic, "cdr", &qos)?;

    let motion = Motion::new();
    let mut message = imu_message(
        "imu_link",
        &ImuSample {
            stamp: START,
            orientation: None,
            gyro: [0.0; 3],
            gyro_covariance_0: 0.0,
            accel: [0.0; 3],
        },
    );
    let mut written = 0;
    let mut moves = 0x853c_49e6_748f_ea9b_u64;
    while written < arguments.messages {
        let mut nanos = (written as f64 * period).round() as i64;
        if arguments.jitter_ns > 0 {
            moves = xorshift(moves);
            let span = 2 * arguments.jitter_ns.unsigned_abs() + 1;
            nanos += (moves % span) as i64 - arguments.jitter_ns;
        }
        let stamp = START + nanos;
        put(
            &mut message,
            4,
            &((stamp / 1_000_000_000) as i32).to_le_bytes(),
        );
        put(
            &mut message,
            8,
            &((stamp % 1_000_000_000) as u32).to_le_bytes(),
        );
        let values = motion.at(nanos as f64 * 1e-9);
        let offsets = [GYRO_OFFSET, ACCEL_OFFSET].into_iter();
        for (at, value) in offsets.flat_map(|at| [at, at + 8, at + 16]).zip(values) {
            put(&mut message, at, &value.to_le_bytes());
        }
        let header = MessageHeader {
            channel_id,
            sequence: written as u32,
            log_time: stamp.unsigned_abs(),
            publish_time: stamp.unsigned_abs(),
        };
        writer.write_to_known_channel(&header, &message)?;
        written += 1;
        if let Some(limit) = arguments.max_bytes
            && written % 4096 == 0
            && std::fs::metadata(&arguments.output)?.len() >= limit
        {
            break;
        }
    }
    writer.finish()?;
    writer.into_inner().flush()?;
    let bytes = std::fs::metadata(&arguments.output)?.len();
    println!(
        "{}: {written} messages of {} bytes, {bytes} bytes in all",
        arguments.output.display(),
        message.len(),
    );
    Ok(())
}

/// Overwrites part of the message; the places are constants inside its 324 bytes.
fn put(message: &mut [u8], at: usize, bytes: &[u8]) {
    message[at..at + bytes.len()].copy_from_slice(bytes);
}

/// Marsaglia (2003), shifts 13, 7, 17.
fn xorshift(mut state: u64) -> u64 {
    state ^= state << 13;
    state ^= state >> 7;
    state ^ (state << 17)
}

const SINES: usize = 5;

/// Three rates (rad/s) and three specific forces (m/s^2), each a sum of sines from 0.1 Hz to 20 Hz.
struct Motion {
    /// Amplitude, angular frequency in rad/s, phase.
    sines: [[(f64, f64, f64); SINES]; 6],
}

impl Motion {
    fn new() -> Motion {
        let primes = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47_u32];
        let mut roots = primes.into_iter().cycle().map(|p| f64::from(p).sqrt());
        let sines = std::array::from_fn(|channel| {
            let scale = if channel < 3 { 1.0 } else { 2.0 };
            std::array::from_fn(|k| {
                let root = roots.next().unwrap_or(1.0);
                let hertz = 0.05 * root * 2.7_f64.powi(k as i32) * (1.0 + 0.1 * channel as f64);
                (scale / (1.0 + k as f64), TAU * hertz, root * 10.0)
            })
        });
        Motion { sines }
    }

    fn at(&self, seconds: f64) -> [f64; 6] {
        let mut values = self.sines.map(|sines| {
            sines
                .iter()
                .map(|(amplitude, omega, phase)| amplitude * (omega * seconds + phase).sin())
                .sum()
        });
        values[5] += 9.80665;
        values
    }
}
