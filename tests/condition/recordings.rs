//! The recordings nobody here wrote, read without the crate's own decoders, so that these tests
//! say something about conditioning alone.

use super::run;
use crate::shared_data::shared;
use nalgebra::Vector3;
use strapd::condition::quality::{Advice, Quality, QualitySummary};
use strapd::condition::stillness::{
    Limits, NoRest, Rests, Stillness, accel_at_start, estimate_bias, level,
};
use strapd::condition::{Clock, OnGap, Settings, choose_clock};
use strapd::record::{Join, Nanos, RateSample, RawSample, SampleKind, Verdict};

fn f64s<const N: usize>(bytes: &[u8], at: usize, big: bool) -> Option<[f64; N]> {
    let mut out = [0.0; N];
    for (i, v) in out.iter_mut().enumerate() {
        let b: [u8; 8] = bytes.get(at + 8 * i..at + 8 * i + 8)?.try_into().ok()?;
        *v = if big {
            f64::from_be_bytes(b)
        } else {
            f64::from_le_bytes(b)
        };
    }
    Some(out)
}

fn u32_at(bytes: &[u8], at: usize, big: bool) -> Option<u32> {
    let b: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
    Some(if big {
        u32::from_be_bytes(b)
    } else {
        u32::from_le_bytes(b)
    })
}

/// `sensor_msgs/msg/Imu`, CDR (`cdr`) or ROS 1.
fn imu(bytes: &[u8], cdr: bool) -> Option<RawSample> {
    let big = cdr && bytes.get(1)? & 1 == 0;
    let sec = u32_at(bytes, 4, big)?;
    let nanos = u32_at(bytes, 8, big)?;
    let n = u32_at(bytes, 12, big)? as usize;
    let base = if cdr {
        4 + (12 + n).div_ceil(8) * 8
    } else {
        16 + n
    };
    Some(RawSample {
        header: Some(Nanos::from_sec_nanosec(i64::from(sec as i32), nanos)),
        gyro: Some(f64s(bytes, base + 104, big)?),
        accel: Some(f64s(bytes, base + 200, big)?),
        ..RawSample::default()
    })
}

/// Field number and content of a protobuf message's varint, 32-bit and length-delimited fields.
fn fields(mut bytes: &[u8]) -> Vec<(u64, u64, &[u8])> {
    fn varint(bytes: &mut &[u8]) -> u64 {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let (byte, rest) = bytes.split_first().unwrap();
            *bytes = rest;
            value |= u64::from(byte & 127) << shift;
            if byte & 128 == 0 {
                break;
            }
        }
        value
    }
    let mut out = Vec::new();
    while !bytes.is_empty() {
        let key = varint(&mut bytes);
        match key & 7 {
            0 => out.push((key >> 3, varint(&mut bytes), &[][..])),
            5 => {
                let (word, rest) = bytes.split_at(4);
                out.push((
                    key >> 3,
                    u64::from(u32::from_le_bytes(word.try_into().unwrap())),
                    &[][..],
                ));
                bytes = rest;
            }
            2 => {
                let n = varint(&mut bytes) as usize;
                let (content, rest) = bytes.split_at(n);
                out.push((key >> 3, 0, content));
                bytes = rest;
            }
            wire => panic!("wire type {wire}"),
        }
    }
    out
}

fn field(bytes: &[u8], number: u64) -> (u64, &[u8]) {
    fields(bytes)
        .into_iter()
        .find(|f| f.0 == number)
        .map_or((0, &[]), |f| (f.1, f.2))
}

/// The batches of the gait recording: packets of (accelerometer, gyroscope) reports.
fn batch(bytes: &[u8]) -> Vec<RawSample> {
    let vector = |report: &[u8]| {
        let vec = field(report, 2).1;
        [1, 2, 3].map(|i| f64::from(f32::from_bits(field(vec, i).0 as u32)))
    };
    fields(bytes)
        .into_iter()
        .filter(|f| f.0 == 1)
        .map(|(_, _, packet)| {
            let gyro = field(packet, 2).1;
            let stamp = field(field(gyro, 1).1, 2).1;
            let (sec, nanos) = (field(stamp, 1).0, field(stamp, 2).0);
            RawSample {
                header: Some(Nanos::from_sec_nanosec(sec as i64, nanos as u32)),
                gyro: Some(vector(gyro)),
                accel: Some(vector(field(packet, 1).1)),
                ..RawSample::default()
            }
        })
        .collect()
}

/// `sensor_combined` of PX4: means with their own interval, FRD.
fn px4(bytes: &[u8]) -> RawSample {
    let json: serde_json::Value = serde_json::from_slice(bytes).unwrap();
    let vector = |name: &str| [0, 1, 2].map(|i| json[name][i].as_f64().unwrap());
    RawSample {
        header: Some(Nanos(json["timestamp"].as_i64().unwrap() * 1000)),
        gyro: Some(vector("gyro_rad")),
        accel: Some(vector("accelerometer_m_s2")),
        interval_nanos: Some(json["gyro_integral_dt"].as_i64().unwrap() * 1000),
        ..RawSample::default()
    }
}

/// All samples of a topic; `None` where the recordings are absent.
fn read(file: &str, topic: &str) -> Option<Vec<RawSample>> {
    let bytes = std::fs::read(shared(&format!("logs/{file}"))?).unwrap();
    let mut out = Vec::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        if message.channel.topic != topic {
            continue;
        }
        let samples = match message.channel.message_encoding.as_str() {
            "cdr" => imu(&message.data, true).into_iter().collect(),
            "ros1" => imu(&message.data, false).into_iter().collect(),
            "protobuf" => batch(&message.data),
            "json" => vec![px4(&message.data)],
            other => panic!("{other}"),
        };
        out.extend(samples.into_iter().map(|sample| RawSample {
            log: Nanos(message.log_time as i64),
            publish: Nanos(message.publish_time as i64),
            ..sample
        }));
    }
    Some(out)
}

fn rests(kind: SampleKind, samples: &[RateSample]) -> Rests {
    let mut stillness = Stillness::new(kind, Limits::default());
    samples.iter().for_each(|s| stillness.push(s));
    stillness.finish()
}

fn quality(raw: &[RawSample], clock: Clock) -> QualitySummary {
    let mut quality = Quality::new(clock);
    raw.iter().for_each(|r| quality.push(r));
    quality.summary()
}

const REAL: [(&str, &str); 7] = [
    ("real/ximu3_ros2_zstd.mcap", "/imu"),
    ("real/xsens_mti_ros2_none.mcap", "/imu"),
    ("real/px4_fmuv6c_json_zstd.mcap", "/sensor_combined"),
    ("real/husky_ros1_lz4.mcap", "/imu/data"),
    ("real/xio_fusion_ros2_lz4.mcap", "/imu"),
    ("real/xio_gait_short_walk_protobuf_batch.mcap", "/imu"),
    ("real/broad07_60s_ros2_zstd.mcap", "/imu"),
];

#[test]
#[ignore = "prints"]
fn print_what_is_known_of_the_recordings() {
    for (file, topic) in REAL {
        let raw = read(file, topic).unwrap();
        let kind = SampleKind::Average;
        let (out, report) = run(
            &Settings {
                kind,
                ..Settings::default()
            },
            &raw,
        );
        println!("== {file}: {} in, {} out", raw.len(), out.len());
        for v in Verdict::ALL {
            if report.counts.get(v) > 0 {
                println!("   {} {}", v.name(), report.counts.get(v));
            }
        }
        println!(
            "   gaps {} missing {} total {:.3} s bound {:.4} rad spacing {:?}",
            report.gaps.count,
            report.gaps.missing,
            report.gaps.total_nanos as f64 * 1e-9,
            report.gaps.rotation_bound,
            report.spacing_nanos
        );
        let rests = rests(kind, &out);
        println!(
            "   rests {} {:.1} s, first {:?}",
            rests.count, rests.secs, rests.first
        );
        for r in rests.kept.iter().take(5) {
            println!(
                "     {:.2}..{:.2} rate {:?} sigma {:?} accel {:?}",
                r.start.secs_since(out[0].stamp),
                r.end.secs_since(out[0].stamp),
                r.mean_rate.as_slice(),
                r.sigma.as_slice(),
                r.mean_accel.map(|a| a.norm())
            );
        }
        match estimate_bias(&rests, &Limits::default()) {
            Ok(b) => println!(
                "   bias {:?} +- {:?}",
                b.bias.as_slice(),
                b.sigma.as_slice()
            ),
            Err(e) => println!("   {e}"),
        }
        match accel_at_start(&rests, &Limits::default()) {
            Ok(a) => println!("   level {:?}", level(&a)),
            Err(e) => println!("   {e}"),
        }
        let mut q = quality(&raw, Clock::Header);
        let advice = std::mem::take(&mut q.advice);
        println!(
            "   {:?} {:?} {:?} {:?}",
            q.gyro_against_gravity, q.gravity, q.accel_at_rest, q.quietest_deviation
        );
        for a in advice {
            println!("   -> {a}");
        }
    }
}
