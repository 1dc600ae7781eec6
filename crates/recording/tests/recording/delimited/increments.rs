//! Turns, changes of the velocity and steps of time, as sensors write them that integrate themselves.

use super::{Given, motion, options, read};
use strapd_attitude::frames::Sensor;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_recording::format::Format;
use strapd_recording::lines::Lines;

/// The turn of a row, by the exponential of its vector.
pub fn quaternion(k: usize) -> [f64; 4] {
    let vector = motion(k)[0].map(|rate| rate / 60.0);
    let angle = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
    let by = (angle / 2.0).sin() / angle;
    let [x, y, z] = vector.map(|v| v * by);
    [(angle / 2.0).cos(), x, y, z]
}

/// Rotation vector by our own logarithm: `a_turn_is_its_rotation_vector` holds it against the one it was made of.
pub fn turned(k: usize) -> [f64; 3] {
    let turn = Quaternion::<Sensor, Sensor>::try_from_wxyz(quaternion(k)).unwrap();
    turn.rotation_vector().0.into()
}

pub fn velocity(k: usize) -> [f64; 3] {
    motion(k)[1].map(|force| force / 60.0)
}

/// A velocity over the period of 60 Hz in whole nanoseconds.
pub fn pushed(k: usize) -> [f64; 3] {
    velocity(k).map(|v| v * (1e9 / 16_666_667.0))
}

fn given(text: &str) -> Given {
    read("x.csv", text.as_bytes(), &options("")).unwrap()
}

#[track_caller]
fn refused(text: &str, words: &[&str]) {
    let why = read("x.csv", text.as_bytes(), &options("")).unwrap_err();
    for word in words {
        assert!(why.contains(word), "`{word}` is missing: {why}");
    }
}

fn rows(head: &str, row: impl Fn(usize) -> String) -> String {
    let rows: Vec<String> = (0..40).map(row).collect();
    format!("{head}\n{}\n", rows.join("\n"))
}

#[test]
fn a_turn_is_its_rotation_vector_and_a_change_of_velocity_a_force() {
    // As the MT Manager calls them, and without a head that says a rate.
    for head in [
        "SampleTimeFine,OriInc_q0,OriInc_q1,OriInc_q2,OriInc_q3,VelInc_X,VelInc_Y,VelInc_Z",
        "SampleTimeFine,dq_W,dq_X,dq_Y,dq_Z,dv[1],dv[2],dv[3]",
    ] {
        let text = rows(head, |k| {
            let numbers = quaternion(k).into_iter().chain(velocity(k));
            format!("{},{}", k * 16_667, super::joined(",", numbers))
        });
        let given = given(&text);
        assert_eq!((given.samples.len(), &given.bad), (40, &Vec::new()));
        for (k, sample) in given.samples.iter().enumerate() {
            let (gyro, accel) = (sample.gyro.unwrap(), sample.accel.unwrap());
            for axis in 0..3 {
                // Rounding of the quaternion's printed sixteen digits.
                assert!((gyro[axis] - motion(k)[0][axis] / 60.0).abs() < 1e-15);
                let force = motion(k)[1][axis] / 60.0 / 0.016_667;
                assert!((accel[axis] - force).abs() < 1e-12, "{accel:?}");
            }
            assert_eq!(sample.interval_nanos, Some(16_667_000));
        }
        let name = std::path::Path::new("x.csv");
        let lines = Lines::new(name, Format::Table, text.as_bytes(), &options("")).unwrap();
        let declared = lines.declared();
        assert_eq!(declared.sample_kind, Some(SampleKind::Rotation));
    }
}

#[test]
fn rates_and_forces_are_preferred_and_what_is_no_turn_is_not_finite() {
    let head = "t_us,Gyr_X,Gyr_Y,Gyr_Z,dq_W,dq_X,dq_Y,dq_Z,Acc_X,Acc_Y,Acc_Z,dv[1],dv[2],dv[3]";
    let text = rows(head, |k| {
        format!("{},1,2,3,1,0,0,0,0,0,9.8,0,0,1", k * 10_000)
    });
    let read = given(&text);
    assert_eq!(read.samples[0].gyro, Some([1.0, 2.0, 3.0]));
    assert_eq!(read.samples[0].accel, Some([0.0, 0.0, 9.8]));
    assert_eq!(read.samples[0].interval_nanos, None);
    let none = rows("t_us,dq_W,dq_X,dq_Y,dq_Z", |k| {
        format!("{},{},0,0,0", k * 10_000, if k == 7 { 0 } else { 1 })
    });
    let read = given(&none);
    assert_eq!(read.samples[6].gyro, Some([0.0; 3]));
    assert!(read.samples[7].gyro.unwrap().iter().all(|v| v.is_nan()));
}

#[test]
fn a_turn_that_is_written_with_the_other_sign_is_the_same() {
    let row = |sign: f64| {
        rows("t_us,dq_W,dq_X,dq_Y,dq_Z", |k| {
            let numbers = quaternion(k).map(|v| v * sign);
            format!("{},{}", k * 10_000, super::joined(",", numbers))
        })
    };
    assert_eq!(given(&row(1.0)).samples, given(&row(-1.0)).samples);
}

#[test]
fn steps_are_summed_in_the_unit_that_is_named_or_that_fits() {
    for (head, step, nanos) in [
        ("dt,gx,gy,gz", "0.01", 10_000_000),
        ("dt,gx,gy,gz", "4", 4_000_000),
        ("dt,gx,gy,gz", "2500", 2_500_000),
        ("dt_us,gx,gy,gz", "250", 250_000),
        ("dt (ms),gx,gy,gz", "12.5", 12_500_000),
        ("delta_t [s],gx,gy,gz", "0.016666667", 16_666_667),
    ] {
        let text = rows(head, |_| format!("{step},1,2,3"));
        let given = given(&text);
        for (k, sample) in given.samples.iter().enumerate() {
            let stamp = Some(Nanos((k as i64 + 1) * nanos));
            assert_eq!(sample.header, stamp, "{head}, {step}");
        }
        let [note] = given.notes.as_slice() else {
            panic!("{:?}", given.notes);
        };
        assert!(note.contains("sums of `d"), "{note}");
        let again = read("x.csv", text.as_bytes(), &options(&given.assumed)).unwrap();
        assert_eq!(again.samples, given.samples, "{}", given.assumed);
    }
    // A stamp is preferred.
    let given = given(&rows("dt,t_ms,gx,gy,gz", |k| {
        format!("0.01,{},1,2,3", k * 5)
    }));
    assert_eq!(given.samples[3].header, Some(Nanos(15_000_000)));
}

#[test]
fn a_row_that_is_lost_keeps_its_step_and_those_behind_it_their_places() {
    let text = rows("gx,dt_ms,gy,gz", |k| match k {
        5 => "oops,10,2,3".to_owned(),
        9 => "1,10,oops,3".to_owned(),
        12 => "1,-10,2,3".to_owned(),
        15 => "1,10,2,3,4".to_owned(),
        _ => "1,10,2,3".to_owned(),
    });
    let given = given(&text);
    let bad: Vec<u64> = given.bad.iter().map(|(line, _)| *line).collect();
    assert_eq!(bad, [7, 11, 14, 17]);
    assert!(given.bad[2].1.contains("step back"), "{:?}", given.bad);
    let stamps: Vec<i64> = given.samples.iter().map(|s| s.header.unwrap().0).collect();
    // The third says no step that can be, the fourth may not have it where it should be.
    let known = (0..40_i64).filter(|k| ![5, 9, 12, 15].contains(k));
    let lost = |k: i64| i64::from(k > 12) + i64::from(k > 15);
    let expected: Vec<i64> = known.map(|k| (k + 1 - lost(k)) * 10_000_000).collect();
    assert_eq!(stamps, expected);
}

#[test]
fn steps_whose_unit_can_not_be_told_are_refused_with_what_tells_it() {
    for (head, step, words) in [
        ("dt,gx,gy,gz", "0.5", &["may be ms or s", "dt=dt:ms"][..]),
        ("dt,gx,gy,gz", "0", &["none of the first rows", "dt=none"]),
        (
            "dt_s,gx,gy,gz",
            "10",
            &["`dt_s` says its unit", "only in ms", "dt=dt_s:ms"],
        ),
        (
            "dt (furlong),gx,gy,gz",
            "10",
            &["`furlong`", "not known", "columns dt="],
        ),
        (
            "dt,delta_t,gx,gy,gz",
            "10,10",
            &["may be `dt`, `delta_t`", "columns dt=dt"],
        ),
    ] {
        refused(&rows(head, |_| format!("{step},1,2,3")), words);
    }
}
