//! Source texts and recipes -> every fixture's name and bytes. Pure but for reading the texts.
//!
//! A stage of its own because two callers need it: the program that writes the fixtures and the test
//! that checks the committed ones against it. `fixtures/README.md` says what each file proves.

pub(crate) mod faults;
pub(crate) mod imu_cdr;
pub(crate) mod log;
pub(crate) mod motions;
pub(crate) mod other_wires;
pub(crate) mod recordings;
pub(crate) mod turns;

use imu_cdr::{
    HEADER, ImuSample, QUATERNION, SENSOR_DATA_QOS, TIME, VECTOR3, cdr_message, definition,
    imu_definition, imu_message,
};
use log::{Log, Storage};
use mcap::{Compression, McapResult};
use motions::Motion;
use recordings::{EPOCH, XsensRow};
use std::error::Error;
use std::path::Path;

/// A file of `fixtures/`.
pub(crate) struct Fixture {
    /// Name in `fixtures/`.
    pub(crate) name: &'static str,
    /// Contents.
    pub(crate) bytes: Vec<u8>,
}

/// The sensor's frame in every fixture.
pub(crate) const SENSOR_FRAME: &str = "imu_link";

/// Makes every fixture. `sources` is the folder of the recordings' original texts.
pub(crate) fn make_all(sources: &Path) -> Result<Vec<Fixture>, Box<dyn Error>> {
    let read = |name: &str| {
        let path = sources.join(name);
        std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let xsens = recordings::xsens(&read("xsens_mti.txt")?)?;
    let inertial = recordings::ximu3_inertial(&read("ximu3_inertial.csv")?)?;
    let quaternion = recordings::ximu3_quaternion(&read("ximu3_quaternion.csv")?)?;
    let lz4 = Storage::Chunks(Some(Compression::Lz4));
    let zstd = Storage::Chunks(Some(Compression::Zstd));
    let uncompressed = Storage::Chunks(None);

    let coning = instants(2001, 10_000_000, 0);
    let quarter = instants(251, 20_000_000, 0);
    Ok(vec![
        fixture("xsens_mti.mcap", xsens_log(&xsens, zstd)?),
        fixture("ximu3.mcap", ximu3_log(&inertial, &quaternion, lz4)?),
        fixture(
            "coning.mcap",
            motion_log(Motion::Coning, Sampling::Rate, &coning, zstd)?,
        ),
        fixture(
            "coning_average.mcap",
            motion_log(Motion::Coning, Sampling::Average, &coning, zstd)?,
        ),
        fixture(
            "coning_jitter.mcap",
            motion_log(
                Motion::Coning,
                Sampling::Rate,
                &instants(2001, 10_000_000, 3_000_000),
                zstd,
            )?,
        ),
        fixture(
            "constant_rate.mcap",
            motion_log(Motion::ConstantRate, Sampling::Rate, &quarter, uncompressed)?,
        ),
        fixture("constant_rate_ros1.mcap", ros1_log(&quarter, lz4)?),
        fixture(
            "constant_rate_json.mcap",
            json_log(&quarter, Storage::NoChunks)?,
        ),
        fixture("faults.mcap", faults::log(lz4)?),
    ])
}

fn fixture(name: &'static str, bytes: Vec<u8>) -> Fixture {
    Fixture { name, bytes }
}

/// Meaning of one message for the motion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Sampling {
    /// The rate at the stamp.
    Rate,
    /// Mean since the stamp before; for the first sample, over as long an interval before the start:
    /// a sensor that averages was running before it was recorded.
    Average,
}

/// `count` stamps in nanoseconds after the start, `period` apart, all but the first moved by up to
/// `jitter` either way; the moves are a fixed pseudo-random sequence.
fn instants(count: i64, period: i64, jitter: i64) -> Vec<i64> {
    (0..count)
        .map(|k| {
            if k == 0 || jitter == 0 {
                return k * period;
            }
            let span = 2 * jitter.unsigned_abs() + 1;
            k * period - jitter + (scrambled(k.unsigned_abs()) % span) as i64
        })
        .collect()
}

/// A 64-bit mix of `k` (SplitMix64's finaliser: Steele, Lea, Flood 2014).
fn scrambled(k: u64) -> u64 {
    let mut z = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The sample of a motion at an instant after the start.
pub(crate) fn sample_of(motion: Motion, nanos: i64) -> ImuSample {
    ImuSample {
        stamp: EPOCH + nanos,
        orientation: None,
        gyro: motion.rate(nanos),
        gyro_covariance_0: 0.0,
        accel: motion.specific_force(nanos),
    }
}

/// Adds a topic of `sensor_msgs/msg/Imu`.
pub(crate) fn imu_topic(log: &mut Log, topic: &str) -> McapResult<u16> {
    let schema = ("sensor_msgs/msg/Imu", "ros2msg", &*imu_definition());
    log.topic(
        topic,
        "cdr",
        schema,
        &[("offered_qos_profiles", SENSOR_DATA_QOS)],
    )
}

/// Adds a topic of `geometry_msgs/msg/QuaternionStamped`.
pub(crate) fn quaternion_topic(log: &mut Log, topic: &str) -> McapResult<u16> {
    let text = definition(
        "std_msgs/Header header\ngeometry_msgs/Quaternion quaternion\n",
        &[HEADER, TIME, QUATERNION],
    );
    let schema = ("geometry_msgs/msg/QuaternionStamped", "ros2msg", &*text);
    log.topic(
        topic,
        "cdr",
        schema,
        &[("offered_qos_profiles", SENSOR_DATA_QOS)],
    )
}

/// Body to `frame_id`, `[w, x, y, z]`, as `geometry_msgs/msg/QuaternionStamped`.
pub(crate) fn quaternion_message(stamp: i64, frame_id: &str, [w, x, y, z]: [f64; 4]) -> Vec<u8> {
    cdr_message(stamp, frame_id, &[x, y, z, w])
}

const SCIKIT_KINEMATICS: [(&str, &str); 2] = [
    (
        "source",
        "scikit-kinematics 0.10.4 (PyPI), Thomas Haslwanter",
    ),
    (
        "license",
        "BSD-3-Clause, Copyright (C) 2016 Thomas Haslwanter; full text in fixtures/source",
    ),
];

/// Rate, specific force and the device's own orientation in one message; the field on a second topic.
fn xsens_log(rows: &[XsensRow], storage: Storage) -> McapResult<Vec<u8>> {
    let mut log = Log::new("ros2", storage)?;
    let imu = imu_topic(&mut log, "/imu/data")?;
    let text = definition(
        "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\n\
         float64[9] magnetic_field_covariance\n",
        &[HEADER, TIME, VECTOR3],
    );
    let schema = ("sensor_msgs/msg/MagneticField", "ros2msg", &*text);
    let mag = log.topic(
        "/imu/mag",
        "cdr",
        schema,
        &[("offered_qos_profiles", SENSOR_DATA_QOS)],
    )?;
    for XsensRow { imu: sample, field } in rows {
        let stamp = sample.stamp;
        log.write(imu, stamp, &imu_message(SENSOR_FRAME, sample))?;
        let mut numbers = [0.0; 12];
        numbers[..3].copy_from_slice(field);
        log.write(mag, stamp, &cdr_message(stamp, SENSOR_FRAME, &numbers))?;
    }
    log.finish(&SCIKIT_KINEMATICS)
}

/// Rate and specific force in one topic, the device's own orientation in another.
fn ximu3_log(
    inertial: &[ImuSample],
    quaternion: &[(i64, [f64; 4])],
    storage: Storage,
) -> McapResult<Vec<u8>> {
    let mut log = Log::new("ros2", storage)?;
    let imu = imu_topic(&mut log, "/imu/data_raw")?;
    let reference = quaternion_topic(&mut log, "/reference/orientation")?;
    for (sample, (stamp, wxyz)) in inertial.iter().zip(quaternion) {
        log.write(imu, sample.stamp, &imu_message(SENSOR_FRAME, sample))?;
        log.write(
            reference,
            *stamp,
            &quaternion_message(*stamp, "world", *wxyz),
        )?;
    }
    log.finish(&SCIKIT_KINEMATICS)
}

/// A motion in closed form with its attitude on `/truth`.
fn motion_log(
    motion: Motion,
    sampling: Sampling,
    instants: &[i64],
    storage: Storage,
) -> McapResult<Vec<u8>> {
    let mut log = Log::new("ros2", storage)?;
    let imu = imu_topic(&mut log, "/imu/data_raw")?;
    let truth = quaternion_topic(&mut log, "/truth")?;
    let mut before = match instants {
        [first, second, ..] => first - (second - first),
        _ => 0,
    };
    for &nanos in instants {
        let mut sample = sample_of(motion, nanos);
        if sampling == Sampling::Average {
            sample.gyro = motion.mean_rate(before, nanos);
        }
        before = nanos;
        let stamp = sample.stamp;
        log.write(imu, stamp, &imu_message(SENSOR_FRAME, &sample))?;
        let message = quaternion_message(stamp, "start", motion.attitude(nanos));
        log.write(truth, stamp, &message)?;
    }
    log.finish(&[("motion", &format!("{motion:?}, {sampling:?}"))])
}

/// The constant rate as ROS 1 messages.
fn ros1_log(instants: &[i64], storage: Storage) -> McapResult<Vec<u8>> {
    let mut log = Log::new("ros1", storage)?;
    let definition = other_wires::ros1_definition();
    let schema = ("sensor_msgs/Imu", "ros1msg", &*definition);
    let imu = log.topic("/imu/data_raw", "ros1", schema, &[])?;
    for (sequence, &nanos) in (0..).zip(instants) {
        let sample = sample_of(Motion::ConstantRate, nanos);
        let message = other_wires::ros1_message(sequence, SENSOR_FRAME, &sample);
        log.write(imu, sample.stamp, &message)?;
    }
    log.finish(&[("motion", "ConstantRate, Rate")])
}

/// The constant rate as JSON objects.
fn json_log(instants: &[i64], storage: Storage) -> McapResult<Vec<u8>> {
    let mut log = Log::new("", storage)?;
    let schema = ("sensor_msgs/Imu", "jsonschema", other_wires::JSON_SCHEMA);
    let imu = log.topic("/imu/data_raw", "json", schema, &[])?;
    for &nanos in instants {
        let sample = sample_of(Motion::ConstantRate, nanos);
        let message = other_wires::json_message(SENSOR_FRAME, &sample);
        log.write(imu, sample.stamp, &message)?;
    }
    log.finish(&[("motion", "ConstantRate, Rate")])
}
