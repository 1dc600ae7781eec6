//! The recordings nobody here wrote, read without the crate's own decoders, so that these tests
//! say something about conditioning alone.

use super::run;
use crate::shared_data::shared;
use nalgebra::Vector3;
use strapd_attitude::condition::quality::{Quality, QualitySummary};
use strapd_attitude::condition::stillness::{
    Limits, NoRest, Rests, Stillness, accel_at_start, estimate_bias, level,
};
use strapd_attitude::condition::{Clock, OnGap, Settings, choose_clock};
use strapd_attitude::quaternion::DeltaAngle;
use strapd_attitude::record::{Join, Measured, Nanos, RateSample, RawSample, SampleKind, Verdict};

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

fn rests(samples: &[RateSample]) -> Rests {
    let mut stillness = Stillness::new(Limits::default());
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

fn settings(kind: SampleKind) -> Settings {
    Settings {
        kind,
        ..Settings::default()
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn colliding_stamps_of_hostile_08_come_out_as_the_recording_they_were_made_from() {
    let (Some(spoilt), Some(good)) = (
        read("hostile/08_duplicate_stamps.mcap", "/imu"),
        read("real/xsens_mti_ros2_none.mcap", "/imu"),
    ) else {
        return;
    };
    for kind in [SampleKind::Rate, SampleKind::Average] {
        let (out, report) = run(&settings(kind), &spoilt);
        let (expected, _) = run(&settings(kind), &good);
        assert_eq!(report.counts.get(Verdict::Restamped), 136);
        assert_eq!(report.duplicates(), 136);
        assert_eq!(report.gaps.count, 0);
        assert_eq!(out.len(), 953);
        for (a, b) in out.iter().zip(&expected) {
            assert_eq!((a.stamp, a.start, a.gyro), (b.stamp, b.start, b.gyro));
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_gap_of_hostile_09_is_found_with_its_length_and_the_policy_applied() {
    let Some(raw) = read("hostile/09_gap_2s.mcap", "/imu") else {
        return;
    };
    for (on_gap, join) in [
        (OnGap::Hold, Join::Hold),
        (OnGap::Bridge, Join::Bridge),
        (OnGap::Reset, Join::Reset),
    ] {
        let (out, report) = run(
            &Settings {
                on_gap,
                ..Settings::default()
            },
            &raw,
        );
        assert_eq!(out.len(), 853);
        assert_eq!(report.gaps.count, 1);
        let gap = report.gaps.kept[0];
        assert_eq!(
            (gap.length_nanos, gap.missing, gap.join),
            (2_020_000_000, 100, join)
        );
        assert_eq!(out.iter().filter(|s| s.join == join).count(), 1);
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_bad_values_of_hostile_10_are_rejected_and_nothing_else() {
    let Some(raw) = read("hostile/10_nan_inf.mcap", "/imu") else {
        return;
    };
    let (out, report) = run(&Settings::default(), &raw);
    assert_eq!(report.counts.get(Verdict::NotFinite), 5);
    assert_eq!(report.first_bad(Verdict::NotFinite).unwrap().index, 100);
    assert_eq!(out.len(), 948);
    assert!(
        out.iter()
            .all(|s| s.gyro.as_vector().iter().all(|v| v.is_finite()))
    );
    // 100, 200, and 300 to 302: three places.
    assert_eq!((report.gaps.count, report.gaps.missing), (3, 5));
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_zero_stamps_of_hostile_07_fall_back_to_log_time() {
    let (Some(raw), Some(good)) = (
        read("hostile/07_zero_header_stamps.mcap", "/imu"),
        read("real/xsens_mti_ros2_none.mcap", "/imu"),
    ) else {
        return;
    };
    let (clock, warning) = choose_clock(&raw[..100], Clock::Header);
    assert_eq!(clock, Clock::Log);
    assert!(
        warning
            .unwrap()
            .to_string()
            .contains("100 of 100 header stamps are 0")
    );
    let (out, report) = run(
        &Settings {
            clock,
            ..Settings::default()
        },
        &raw,
    );
    assert_eq!((out.len(), report.counts.lost()), (953, 0));
    let (expected, _) = run(&Settings::default(), &good);
    assert!(out.iter().zip(&expected).all(|(a, b)| a.stamp == b.stamp));
    // No stamp advances, so there is no step.
    assert_eq!(quality(&raw, Clock::Header).spacing, None);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_repeats_and_losses_of_the_gait_recording_are_told_apart() {
    let Some(raw) = read("real/xio_gait_short_walk_protobuf_batch.mcap", "/imu") else {
        return;
    };
    assert_eq!(raw.len(), 16_539);
    for kind in [SampleKind::Rate, SampleKind::Average] {
        let (out, report) = run(&settings(kind), &raw);
        assert_eq!(report.counts.get(Verdict::Repeated), 205);
        assert_eq!(report.counts.lost(), 0);
        assert_eq!(out.len(), 16_334);
        // Counted with numpy from the steps: 112 double, 28 triple, 24 fourfold, 1 fivefold.
        assert_eq!((report.gaps.count, report.gaps.missing), (165, 244));
        assert!(out.windows(2).all(|w| w[0].stamp < w[1].stamp));
        // Time covered and time not covered add up.
        if kind == SampleKind::Average {
            let covered: i64 = out.iter().skip(1).map(|s| s.stamp.since(s.start)).sum();
            let all = out.last().unwrap().stamp.since(out[0].stamp);
            assert_eq!(covered + report.gaps.total_nanos, all);
        }
    }
    let quality = quality(&raw, Clock::Header);
    assert_eq!((quality.duplicates, quality.collisions), (205, 0));
    assert_eq!(quality.missing, 244);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn sound_recordings_pass_whole_and_contiguous() {
    for (file, topic) in REAL {
        if file.contains("gait") || file.contains("fusion") {
            continue;
        }
        let Some(raw) = read(file, topic) else { return };
        let (out, report) = run(&settings(SampleKind::Average), &raw);
        assert_eq!(out.len(), raw.len(), "{file}");
        assert_eq!(report.counts.get(Verdict::Accepted), raw.len() as u64);
        assert_eq!(report.gaps.count, 0, "{file}");
        assert!(out.windows(2).all(|w| w[1].start == w[0].stamp), "{file}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_means_of_px4_keep_their_own_intervals() {
    let Some(raw) = read("real/px4_fmuv6c_json_zstd.mcap", "/sensor_combined") else {
        return;
    };
    let (out, _) = run(&settings(SampleKind::Average), &raw);
    for (r, s) in raw.iter().zip(&out) {
        let secs = r.interval_nanos.unwrap() as f64 * 1e-9;
        let angle = Vector3::from(r.gyro.unwrap()) * secs;
        assert_eq!(s.gyro, Measured::Increment(DeltaAngle(angle)));
    }
    let quality = quality(&raw, Clock::Header);
    assert_eq!(quality.with_interval, 1297);
    // In flight the quietest half second is not a rest: one varies by less than 0.025 rad/s.
    assert!(quality.quietest_deviation.unwrap() > 0.025);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_recordings_rest_where_they_rest_and_nowhere_else() {
    let limits = Limits::default();
    for (file, topic) in REAL {
        let Some(raw) = read(file, topic) else { return };
        let (out, _) = run(&settings(SampleKind::Average), &raw);
        let rests = rests(&out);
        let bias = estimate_bias(&rests, &limits);
        let level_force = accel_at_start(&rests, &limits);
        let name = file.trim_start_matches("real/");
        match name.split('_').next().unwrap() {
            // Moving from the first sample to the last.
            "broad07" | "xsens" | "px4" => {
                assert!(matches!(bias, Err(NoRest::Moving { .. })), "{name}");
                assert!(bias.unwrap_err().to_string().contains("bias"));
                assert!(matches!(level_force, Err(NoRest::Moving { .. })), "{name}");
            }
            // Still for the first second alone.
            "ximu3" => {
                assert_eq!(rests.count, 1);
                assert!(bias.unwrap().bias.0.amax() < 1e-3);
                let force = level_force.unwrap();
                assert!((force.as_vector().norm() - 9.785).abs() < 0.01);
                // The sensor lies flat: tilted by less than half a degree.
                let q = level(&force).unwrap().wxyz();
                assert!(2.0 * q[0].acos() < 0.5_f64.to_radians());
            }
            "husky" => {
                assert!(matches!(level_force, Err(NoRest::NotAtStart { .. })));
                // The longest stop, seen by eye in the rates, is at 236 to 246 s.
                let first = rests.kept[0].start.secs_since(out[0].stamp);
                assert!((235.0..237.0).contains(&first), "{first}");
            }
            "xio" => {
                // The walker stands before and after the walk; the other one lies on a table between moves.
                let bias = bias.unwrap();
                assert!(
                    bias.bias.0.amax() < 4e-3 && bias.sigma.amax() < 2e-3,
                    "{name}: {bias:?}"
                );
                assert!(rests.secs > 10.0);
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_recording_in_degrees_is_found_out_by_gravity() {
    let Some(raw) = read("real/xio_fusion_ros2_lz4.mcap", "/imu") else {
        return;
    };
    let found = |raw: &[RawSample]| {
        let found = quality(raw, Clock::Header).gyro_against_gravity.unwrap();
        (found.correlation, found.factor)
    };
    let scaled = |factor: f64| -> Vec<RawSample> {
        raw.iter()
            .map(|r| RawSample {
                gyro: r.gyro.map(|g| g.map(|v| v * factor)),
                ..*r
            })
            .collect()
    };
    let (correlation, factor) = found(&raw);
    assert!(
        correlation > 0.7 && (0.4..2.5).contains(&factor),
        "{factor}"
    );
    // The factor is that of the rates, inverted; turned round, the signs disagree.
    for by in [180.0 / std::f64::consts::PI, 1000.0, -1.0] {
        let (scaled_correlation, scaled_factor) = found(&scaled(by));
        assert!((scaled_factor * by / factor - 1.0).abs() < 1e-9, "{by}");
        assert!(
            (scaled_correlation.abs() - correlation).abs() < 1e-9,
            "{by}"
        );
    }
}
