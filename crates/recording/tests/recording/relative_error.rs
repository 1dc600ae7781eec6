//! The 1 s relative error, on recordings nobody here wrote, against figures nobody here computed:
//! the table of `../shared/logs/README.md`. The integrators are one line each and share nothing with
//! `propagate`, so what is tested is the metric (and exp).

#[allow(unreachable_pub)]
use nalgebra::Vector3;
use strapd_attitude::compare::{Align, Stamped, compare};
use strapd_attitude::quaternion::{Quaternion, RotationVector};
use strapd_attitude::record::Nanos;

struct Log {
    gyro: Vec<(Nanos, Vector3<f64>)>,
    reference: Vec<Stamped>,
}

enum Wire {
    Cdr,
    Ros1,
}

/// Stamp, and the doubles of the message from the first aligned one on.
fn fields(wire: &Wire, data: &[u8]) -> (Nanos, Vec<f64>) {
    let u32_at = |i: usize| u32::from_le_bytes(data[i..i + 4].try_into().unwrap());
    let (stamp_at, doubles_at) = match wire {
        Wire::Cdr => (4, 4 + (12 + u32_at(12) as usize).next_multiple_of(8)),
        Wire::Ros1 => (4, 16 + u32_at(12) as usize),
    };
    let stamp = Nanos::from_sec_nanosec(i64::from(u32_at(stamp_at)), u32_at(stamp_at + 4));
    let doubles = data[doubles_at..]
        .chunks_exact(8)
        .map(|c| f64::from_le_bytes(c.try_into().unwrap()))
        .collect();
    (stamp, doubles)
}

/// Any four numbers, NaN too: leaving bad rows out is the metric's business.
fn stamped(stamp: Nanos, d: &[f64]) -> Stamped {
    (stamp, Quaternion::assume_unit([d[3], d[0], d[1], d[2]]))
}

fn read(name: &str, imu: &str, reference: Option<&str>, wire: &Wire) -> Option<Log> {
    let path = crate::shared_data::shared(&format!("logs/real/{name}.mcap"))?;
    let bytes = std::fs::read(path).unwrap();
    let mut log = Log {
        gyro: vec![],
        reference: vec![],
    };
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let topic = message.channel.topic.as_str();
        if topic == imu {
            let (stamp, d) = fields(wire, &message.data);
            log.gyro.push((stamp, Vector3::new(d[13], d[14], d[15])));
            if reference.is_none() {
                log.reference.push(stamped(stamp, &d));
            }
        } else if Some(topic) == reference {
            let (stamp, d) = fields(wire, &message.data);
            log.reference.push(stamped(stamp, &d));
        }
    }
    Some(log)
}

/// `step(rate before, rate after, dt)` is the rotation vector over one interval.
fn integrate(
    gyro: &[(Nanos, Vector3<f64>)],
    step: impl Fn(&Vector3<f64>, &Vector3<f64>, f64) -> Vector3<f64>,
) -> Vec<Stamped> {
    let mut q = Quaternion::identity();
    let mut out = vec![(gyro[0].0, q)];
    for pair in gyro.windows(2) {
        let [(t0, a), (t1, b)] = pair else {
            unreachable!()
        };
        q = q
            .advanced(&RotationVector(step(a, b, t1.secs_since(*t0))))
            .normalised();
        out.push((*t1, q));
    }
    out
}

/// Median and p95 in degrees: held after the stamp, mean ending at the stamp, instantaneous.
fn three_meanings(log: &Log) -> [(f64, f64); 3] {
    let held = integrate(&log.gyro, |a, _, h| a * h);
    let average = integrate(&log.gyro, |_, b, h| b * h);
    let rate = integrate(&log.gyro, |a, b, h| {
        (a + b) * (h / 2.0) + a.cross(b) * (h * h / 12.0)
    });
    [held, average, rate].map(|estimate| {
        let e = compare(&estimate, &log.reference, Align::None)
            .relative_1s
            .unwrap();
        (e.median.to_degrees(), e.p95.to_degrees())
    })
}

/// Rounded as the table is, the figures are the same text.
fn agrees(log: Option<Log>, table: [&str; 3]) {
    let Some(log) = log else { return };
    for ((median, p95), want) in three_meanings(&log).into_iter().zip(table) {
        let digits = |text: &str| text.split_once('.').unwrap().1.len();
        let (want_median, want_p95) = want.split_once(" / ").unwrap();
        let (m, p) = (digits(want_median), digits(want_p95));
        assert_eq!(format!("{median:.m$} / {p95:.p$}"), want);
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn broad_07_against_optical_truth() {
    let log = read(
        "broad07_60s_ros2_zstd",
        "/imu",
        Some("/reference/orientation"),
        &Wire::Cdr,
    );
    agrees(log, ["2.031 / 6.88", "0.920 / 2.89", "1.469 / 4.86"]);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn x_imu3_against_its_on_board_orientation() {
    let log = read(
        "ximu3_ros2_zstd",
        "/imu",
        Some("/reference/orientation"),
        &Wire::Cdr,
    );
    agrees(log, ["5.70 / 14.8", "0.861 / 3.42", "3.30 / 7.54"]);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn xsens_against_its_own_orientation() {
    let log = read("xsens_mti_ros2_none", "/imu", None, &Wire::Cdr);
    agrees(log, ["1.828 / 4.21", "1.390 / 2.97", "1.501 / 3.36"]);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn husky_against_its_own_orientation() {
    let log = read("husky_ros1_lz4", "/imu/data", None, &Wire::Ros1);
    agrees(log, ["0.451 / 1.46", "0.438 / 1.36", "0.438 / 1.39"]);
}
