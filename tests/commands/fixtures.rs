//! Promise: every file in `fixtures/` is what `fixtures/README.md` says, and the committed program makes it.
//!
//! Messages are decoded here by offset (the layout of `sensor_msgs/msg/Imu` in CDR), not by this
//! project's decoders: these files judge them.

#[path = "../../examples/make_fixtures/catalogue.rs"]
mod catalogue;

use catalogue::faults::{Fault, SAMPLES, fault_of};
use catalogue::motions::{Motion, SECOND};
use catalogue::turns::sin_cos;
use std::collections::BTreeMap;
use std::path::PathBuf;

fn fixtures() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fixtures")
}

/// Every message of a topic: log time and payload, in file order.
fn messages(file: &str, topic: &str) -> Vec<(i64, Vec<u8>)> {
    let bytes = std::fs::read(fixtures().join(file)).unwrap();
    mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .filter(|message| message.channel.topic == topic)
        .map(|message| (message.log_time as i64, message.data.into_owned()))
        .collect()
}

fn f64_at(payload: &[u8], offset: usize) -> f64 {
    f64::from_le_bytes(payload[offset..offset + 8].try_into().unwrap())
}

fn vector_at(payload: &[u8], offset: usize) -> [f64; 3] {
    [0, 8, 16].map(|step| f64_at(payload, offset + step))
}

fn stamp_of(payload: &[u8]) -> i64 {
    let sec = i32::from_le_bytes(payload[4..8].try_into().unwrap());
    let nanosec = u32::from_le_bytes(payload[8..12].try_into().unwrap());
    i64::from(sec) * SECOND + i64::from(nanosec)
}

// Offsets for a frame called `imu_link`: 4 of encapsulation, 8 of stamp, 4 of length, 9 of text, 3 of padding.
const ORIENTATION: usize = 28;
const GYRO: usize = ORIENTATION + 104;
const ACCEL: usize = ORIENTATION + 200;
const IMU_LENGTH: usize = 324;

/// `[w, x, y, z]` from the wire's x, y, z, w.
fn quaternion_at(payload: &[u8], offset: usize) -> [f64; 4] {
    let [x, y, z] = vector_at(payload, offset);
    [f64_at(payload, offset + 24), x, y, z]
}

/// The orientation of a `QuaternionStamped` whose frame is `world` or `start` (both five letters).
fn stamped_quaternion(payload: &[u8]) -> [f64; 4] {
    assert_eq!(payload.len(), 60);
    quaternion_at(payload, 28)
}

/// The columns of a source text, by the separator of either maker.
fn columns(file: &str, heading: usize) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(fixtures().join("source").join(file)).unwrap();
    text.lines()
        .skip(heading)
        .map(|line| {
            line.split(|c: char| c == ',' || c.is_whitespace())
                .filter(|field| !field.is_empty())
                .map(|field| field.parse().unwrap())
                .collect()
        })
        .collect()
}

fn product(p: [f64; 4], q: [f64; 4]) -> [f64; 4] {
    [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ]
}

fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}

/// `q v q*`: body components to world components.
fn rotated(q: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let [_, x, y, z] = product(product(q, [0.0, v[0], v[1], v[2]]), conjugate(q));
    [x, y, z]
}

fn exp(v: [f64; 3]) -> [f64; 4] {
    let angle = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let (sin, cos) = (angle / 2.0).sin_cos();
    let scale = if angle > 0.0 { sin / angle } else { 0.5 };
    [cos, v[0] * scale, v[1] * scale, v[2] * scale]
}

fn angle_deg([w, x, y, z]: [f64; 4]) -> f64 {
    2.0 * (x * x + y * y + z * z).sqrt().atan2(w.abs()).to_degrees()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn the_program_makes_every_committed_fixture_byte_for_byte() {
    let made = catalogue::make_all(&fixtures().join("source")).unwrap();
    let names: Vec<_> = made.iter().map(|fixture| fixture.name).collect();
    for fixture in &made {
        let committed = std::fs::read(fixtures().join(fixture.name)).unwrap();
        assert!(
            committed == fixture.bytes,
            "{}: {} bytes committed, {} made, first difference at byte {:?}",
            fixture.name,
            committed.len(),
            fixture.bytes.len(),
            committed
                .iter()
                .zip(&fixture.bytes)
                .position(|(a, b)| a != b),
        );
    }
    for entry in std::fs::read_dir(fixtures()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            !name.ends_with(".mcap") || names.contains(&&*name),
            "{name} is in fixtures/, and no program makes it"
        );
    }
}

#[test]
fn the_readme_names_every_fixture_and_they_stay_small() {
    let readme = std::fs::read_to_string(fixtures().join("README.md")).unwrap();
    let mut total = 0;
    for folder in [fixtures(), fixtures().join("source")] {
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            total += entry.metadata().unwrap().len();
            let is_described = readme.contains(&format!("`{name}`"));
            assert!(
                is_described || name == "README.md" || name == "source",
                "{name}"
            );
        }
    }
    // A clone stays quick and no file server is needed.
    assert!(total < 2_000_000, "{total} bytes");
}

#[test]
fn the_xsens_log_holds_the_text_row_by_row() {
    let rows = columns("xsens_mti.txt", 5);
    let imu = messages("xsens_mti.mcap", "/imu/data");
    let mag = messages("xsens_mti.mcap", "/imu/mag");
    assert_eq!((rows.len(), imu.len(), mag.len()), (953, 953, 953));
    for ((row, (log, payload)), (_, field)) in rows.iter().zip(&imu).zip(&mag) {
        assert_eq!(payload.len(), IMU_LENGTH);
        // The counter is the only clock; 50 Hz by the file's own heading.
        assert_eq!(
            stamp_of(payload),
            1_700_000_000 * SECOND + row[0] as i64 * 20_000_000
        );
        assert_eq!(*log, stamp_of(payload));
        // m/s^2 and rad/s already: the numbers pass unchanged, bit for bit.
        assert_eq!(vector_at(payload, ACCEL), row[1..4]);
        assert_eq!(vector_at(payload, GYRO), row[4..7]);
        assert_eq!(vector_at(field, ORIENTATION), row[7..10]);
        assert_eq!(quaternion_at(payload, ORIENTATION), row[10..14]);
        assert_eq!(
            f64_at(payload, ORIENTATION + 32),
            0.0,
            "covariance: unknown"
        );
    }
}

#[test]
fn the_x_imu3_log_holds_the_text_in_si_units() {
    let inertial = columns("ximu3_inertial.csv", 1);
    let quaternion = columns("ximu3_quaternion.csv", 1);
    let imu = messages("ximu3.mcap", "/imu/data_raw");
    let reference = messages("ximu3.mcap", "/reference/orientation");
    assert_eq!((imu.len(), reference.len()), (500, 500));
    for (row, (_, payload)) in inertial.iter().zip(&imu) {
        assert_eq!(payload.len(), IMU_LENGTH);
        assert_eq!(
            stamp_of(payload),
            1_700_000_000 * SECOND + row[0] as i64 * 1000
        );
        assert_eq!(
            f64_at(payload, ORIENTATION + 32),
            -1.0,
            "no orientation here"
        );
        for axis in 0..3 {
            // deg/s and g in the text. Two roundings more or fewer: 2 ulp, 4.4e-16 of the value.
            let rate = row[1 + axis] * std::f64::consts::PI / 180.0;
            let force = row[4 + axis] * 9.80665;
            let (got_rate, got_force) = (
                vector_at(payload, GYRO)[axis],
                vector_at(payload, ACCEL)[axis],
            );
            assert!((got_rate - rate).abs() <= 4.5e-16 * rate.abs());
            assert!((got_force - force).abs() <= 4.5e-16 * force.abs());
        }
    }
    for (row, (_, payload)) in quaternion.iter().zip(&reference) {
        assert_eq!(
            stamp_of(payload),
            1_700_000_000 * SECOND + row[0] as i64 * 1000
        );
        assert_eq!(stamped_quaternion(payload), row[1..5]);
    }
}

#[test]
fn recorded_orientations_take_the_specific_force_from_sensor_to_an_upright_world() {
    let xsens: Vec<_> = messages("xsens_mti.mcap", "/imu/data")
        .into_iter()
        .map(|(_, m)| (quaternion_at(&m, ORIENTATION), vector_at(&m, ACCEL)))
        .collect();
    let ximu3: Vec<_> = messages("ximu3.mcap", "/imu/data_raw")
        .into_iter()
        .zip(messages("ximu3.mcap", "/reference/orientation"))
        .map(|((_, m), (_, r))| (stamped_quaternion(&r), vector_at(&m, ACCEL)))
        .collect();
    for rows in [xsens, ximu3] {
        let mean_up = |direction: fn([f64; 4]) -> [f64; 4]| {
            rows.iter()
                .map(|&(q, f)| rotated(direction(q), f)[2])
                .sum::<f64>()
                / rows.len() as f64
        };
        // Hand-held for 10 and 19 s and at rest at both ends: the mean acceleration is a small part of
        // g, 1 %. Read the other way round the mean is -0.04 and 3.1 m/s^2.
        assert!((mean_up(|q| q) - 9.80665).abs() < 0.1, "{}", mean_up(|q| q));
        assert!((mean_up(conjugate) - 9.80665).abs() > 5.0);
    }
}

/// Median over the recording of the error of the rotation over one second (50 samples), in degrees.
/// `step(w_before, w_after, seconds)` is the rotation vector of an interval.
fn relative_error(
    samples: &[(i64, [f64; 3], [f64; 4])],
    step: fn([f64; 3], [f64; 3], f64) -> [f64; 3],
) -> f64 {
    let mut estimate = vec![[1.0, 0.0, 0.0, 0.0]];
    for pair in samples.windows(2) {
        let seconds = (pair[1].0 - pair[0].0) as f64 * 1e-9;
        let last = *estimate.last().unwrap();
        estimate.push(product(last, exp(step(pair[0].1, pair[1].1, seconds))));
    }
    let errors = (0..samples.len() - 50).map(|k| {
        let reference = product(conjugate(samples[k].2), samples[k + 50].2);
        let estimated = product(conjugate(estimate[k]), estimate[k + 50]);
        angle_deg(product(conjugate(reference), estimated))
    });
    median(errors.collect())
}

#[test]
fn the_recordings_turn_as_their_own_orientation_when_a_sample_is_the_mean_of_the_interval_before_it()
 {
    let xsens: Vec<_> = messages("xsens_mti.mcap", "/imu/data")
        .into_iter()
        .map(|(_, m)| {
            let q = quaternion_at(&m, ORIENTATION);
            (stamp_of(&m), vector_at(&m, GYRO), q)
        })
        .collect();
    let ximu3: Vec<_> = messages("ximu3.mcap", "/imu/data_raw")
        .into_iter()
        .zip(messages("ximu3.mcap", "/reference/orientation"))
        .map(|((_, m), (_, r))| (stamp_of(&m), vector_at(&m, GYRO), stamped_quaternion(&r)))
        .collect();
    // Measured here 1.3903 and 0.8611 deg; a sample shifted by one, a sign or a unit changes the first digit
    // (read as the mean of the interval after it: 1.83 and 5.70).
    let of_interval_before = |_, after: [f64; 3], h: f64| after.map(|w| w * h);
    let of_interval_after = |before: [f64; 3], _, h: f64| before.map(|w| w * h);
    let xsens_error = relative_error(&xsens, of_interval_before);
    let ximu3_error = relative_error(&ximu3, of_interval_before);
    assert!((xsens_error - 1.390).abs() < 0.005, "{xsens_error}");
    assert!((ximu3_error - 0.861).abs() < 0.005, "{ximu3_error}");
    assert!(relative_error(&xsens, of_interval_after) > 1.8);
    assert!(relative_error(&ximu3, of_interval_after) > 5.0);
}

#[test]
fn the_sine_of_a_fraction_of_a_turn_is_that_of_the_platform_to_the_last_bit_or_its_neighbour() {
    assert_eq!(sin_cos(0, 7), (0.0, 1.0));
    assert_eq!(sin_cos(3, 4), (-1.0, 0.0));
    assert_eq!(sin_cos(1, 12).0, 0.5);
    assert_eq!(sin_cos(-1, 6).1, 0.5);
    assert_eq!(sin_cos(1, 8), (0.5_f64.sqrt(), 0.5_f64.sqrt()));
    for k in -100_000..100_000 {
        let denominator = 16_384;
        let (sin, cos) = sin_cos(k, denominator);
        // The platform is given a rounded angle: near a zero, that rounding, at most half a step of 39 rad, shows.
        let angle = std::f64::consts::TAU * (k as f64 / denominator as f64);
        let tolerance = 2.3e-16 + 0.5 * angle.abs() * f64::EPSILON * 2.0;
        assert!((sin - angle.sin()).abs() <= tolerance, "{k}");
        assert!((cos - angle.cos()).abs() <= tolerance, "{k}");
        // Two correctly rounded numbers: the squares' sum is off by at most 2 (|s| + |c|) half steps.
        assert!((sin * sin + cos * cos - 1.0).abs() <= 4.5e-16, "{k}");
    }
}

#[test]
fn the_truth_of_each_motion_satisfies_the_kinematic_equation() {
    for motion in [Motion::Coning, Motion::ConstantRate] {
        assert_eq!(motion.attitude(0), [1.0, 0.0, 0.0, 0.0], "{motion:?}");
        for k in 0..997 {
            let nanos = k * 20_080_321;
            let q = motion.attitude(nanos);
            let norm = q.iter().map(|c| c * c).sum::<f64>();
            assert!((norm - 1.0).abs() < 1e-15, "{motion:?} at {nanos}: {norm}");
            // w = 2 q* dq/dt; five-point difference over 0.1 ms: truncation 19^5 h^4 / 30 = 8e-12,
            // rounding 1.5 eps / h = 3e-12; the sum, with the factor 2, stays below 5e-11 rad/s.
            let h = 100_000;
            let at = |steps: i64| motion.attitude(nanos + steps * h);
            let (a, b, c, d) = (at(-2), at(-1), at(1), at(2));
            let derivative = std::array::from_fn(|i| {
                (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h as f64 * 1e-9)
            });
            let [_, x, y, z] = product(conjugate(q), derivative);
            let rate = motion.rate(nanos);
            for (half, rate) in [x, y, z].into_iter().zip(rate) {
                assert!((2.0 * half - rate).abs() < 5e-11, "{motion:?} at {nanos}");
            }
            // Gravity's reaction points up in the world: three products of numbers below 10.
            let [east, north, up] = rotated(q, motion.specific_force(nanos));
            assert!(east.abs() < 2e-14 && north.abs() < 2e-14 && (up - 9.80665).abs() < 2e-14);
        }
    }
}

#[test]
fn a_mean_rate_is_the_integral_of_the_rate_over_its_interval() {
    // Gauss-Legendre, 5 nodes, on 10 ms: its error, (h/2)^11 omega^10 / 1e9, is far below rounding.
    let nodes: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    for k in 0..500 {
        let (start, end) = (k * 7_000_001, k * 7_000_001 + 10_000_000);
        let mean = Motion::Coning.mean_rate(start, end);
        for (axis, mean) in mean.into_iter().enumerate() {
            let quadrature: f64 = nodes
                .iter()
                .map(|(node, weight)| {
                    let nanos = start + 5_000_000 + (node * 5_000_000.0).round() as i64;
                    0.5 * weight * Motion::Coning.rate(nanos)[axis]
                })
                .sum();
            // Nodes are rounded to the nanosecond: half of one at 62 rad/s^2 is 3.1e-8 rad/s, and they differ in sign.
            assert!((mean - quadrature).abs() < 3e-8, "axis {axis} at {start}");
        }
    }
}

#[test]
fn the_mean_rates_of_the_coning_log_add_up_to_the_drift_that_summing_shows() {
    // Summed delta angles of coning over whole cycles: nothing in x and y, omega (1 - cos a) in z.
    let imu = messages("coning_average.mcap", "/imu/data_raw");
    let before_the_start = Motion::Coning.mean_rate(-10_000_000, 0);
    assert_eq!(vector_at(&imu[0].1, GYRO), before_the_start);
    let mut sum = [0.0; 3];
    for pair in imu.windows(2) {
        let seconds = (stamp_of(&pair[1].1) - stamp_of(&pair[0].1)) as f64 * 1e-9;
        for (sum, rate) in sum.iter_mut().zip(vector_at(&pair[1].1, GYRO)) {
            *sum += rate * seconds;
        }
    }
    let drift = -60.0 * std::f64::consts::TAU * (1.0 - 10_f64.to_radians().cos());
    // 2000 additions of numbers below 0.04 into a sum below 6: rounding under 2000 x 4.4e-16.
    assert!(sum[0].abs() < 1e-12 && sum[1].abs() < 1e-12, "{sum:?}");
    assert!((sum[2] - drift).abs() < 1e-12, "{sum:?}, {drift}");
    // The body came back: the truth's last attitude is its first, 20 s x 3 Hz being whole cycles.
    let truth = messages("coning_average.mcap", "/truth");
    assert_eq!(
        stamped_quaternion(&truth[2000].1),
        [1.0, 0.0, 0.0, 0.0].map(|c| c + 0.0)
    );
}

#[test]
fn the_jittered_log_has_uneven_stamps_and_exact_truth_at_each() {
    let imu = messages("coning_jitter.mcap", "/imu/data_raw");
    let truth = messages("coning_jitter.mcap", "/truth");
    let start = stamp_of(&imu[0].1);
    let steps: Vec<_> = imu
        .windows(2)
        .map(|p| stamp_of(&p[1].1) - stamp_of(&p[0].1))
        .collect();
    assert!(*steps.iter().min().unwrap() < 5_000_000 && *steps.iter().min().unwrap() > 0);
    assert!(*steps.iter().max().unwrap() > 15_000_000);
    for (k, ((_, sample), (_, reference))) in (0..).zip(imu.iter().zip(&truth)) {
        let nanos = stamp_of(sample) - start;
        assert!((nanos - k * 10_000_000).abs() <= 3_000_000);
        assert_eq!(stamp_of(reference), stamp_of(sample));
        assert_eq!(vector_at(sample, GYRO), Motion::Coning.rate(nanos));
        assert_eq!(
            stamped_quaternion(reference),
            Motion::Coning.attitude(nanos)
        );
    }
}

#[test]
fn the_same_motion_on_three_wires_carries_the_same_numbers() {
    let cdr = messages("constant_rate.mcap", "/imu/data_raw");
    let ros1 = messages("constant_rate_ros1.mcap", "/imu/data_raw");
    let json = messages("constant_rate_json.mcap", "/imu/data_raw");
    assert_eq!((cdr.len(), ros1.len(), json.len()), (251, 251, 251));
    for (((_, cdr), (_, ros1)), (_, json)) in cdr.iter().zip(&ros1).zip(&json) {
        // ROS 1: 16 bytes of numbers and length, 8 of `imu_link`, then the same 37 doubles.
        assert_eq!(ros1.len(), 320);
        assert_eq!(ros1[12..24], *b"\x08\0\0\0imu_link");
        assert_eq!(ros1[24..], cdr[ORIENTATION..]);
        assert_eq!(ros1[4..12], cdr[4..12]);
        let json: serde_json::Value = serde_json::from_slice(json).unwrap();
        for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
            assert_eq!(json["angular_velocity"][axis], vector_at(cdr, GYRO)[i]);
            assert_eq!(json["linear_acceleration"][axis], vector_at(cdr, ACCEL)[i]);
        }
        let stamp = &json["header"]["stamp"];
        let nanos = stamp["sec"].as_i64().unwrap() * SECOND + stamp["nanosec"].as_i64().unwrap();
        assert_eq!(nanos, stamp_of(cdr));
    }
}

#[test]
fn the_log_of_faults_holds_exactly_the_faults_it_declares() {
    let imu = messages("faults.mcap", "/imu/data_raw");
    let mut found: BTreeMap<&str, i64> = BTreeMap::new();
    let mut count = |what| *found.entry(what).or_insert(0) += 1;
    let mut seen: BTreeMap<i64, Vec<u8>> = BTreeMap::new();
    let mut newest = i64::MIN;
    for (_, payload) in &imu {
        let stamp = stamp_of(payload);
        if payload.len() != IMU_LENGTH {
            count("cut short");
        } else if stamp == 0 {
            count("no stamp");
        } else if let Some(first) = seen.get(&stamp) {
            count(if first == payload {
                "sent twice"
            } else {
                "stamp twice"
            });
        } else {
            let gyro = vector_at(payload, GYRO);
            if gyro.iter().any(|rate| !rate.is_finite()) {
                count("not finite");
            } else if gyro.iter().any(|rate| rate.abs() > 4e4) {
                count("huge");
            } else if f64_at(payload, GYRO + 24) == -1.0 {
                count("marked absent");
            } else if stamp < newest {
                count(if newest - stamp < SECOND / 2 {
                    "swapped"
                } else {
                    "late"
                });
            } else {
                assert_eq!(gyro, Motion::ConstantRate.rate(0), "an untouched sample");
            }
            seen.insert(stamp, payload.clone());
            newest = newest.max(stamp);
        }
    }
    let expected = [
        ("cut short", 1),
        ("huge", 1),
        ("late", 1),
        ("marked absent", 1),
        ("no stamp", 1),
        ("not finite", 2),
        ("sent twice", 1),
        ("stamp twice", 1),
        ("swapped", 1),
    ];
    assert_eq!(found, BTreeMap::from(expected));
    let missing = (0..SAMPLES)
        .filter(|&k| fault_of(k) == Fault::Missing)
        .count();
    assert_eq!((imu.len(), missing), (700 - 100 + 2, 100));
}
