//! Tests of packed objects: their bytes, and what is read of those that are cut, longer or none.

use super::*;
use nalgebra::Vector3;
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, LinearAcceleration, Status};

/// An attitude with nothing special about it.
fn sample(stamp: Nanos) -> AttitudeSample {
    AttitudeSample {
        stamp,
        q_nb: Quaternion::assume_unit([0.5, -0.5, 0.5, 0.5]),
        rate: BodyRate(Vector3::new(0.1, -0.2, 0.3)),
        accel: None,
        linear_acceleration: None,
        covariance: AttitudeCovariance::from_sigma(Vector3::new(1e-3, 2e-3, 3e-3)),
        status: Status::OK,
        reset_count: 0,
        log: stamp,
        temperature: None,
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[test]
fn a_packed_sample_is_these_bytes() {
    let mut bytes = Vec::new();
    let mut raw = RawSample {
        header: Some(Nanos(0x0102_0304_0506_0708)),
        gyro: Some([1.0, -2.0, 0.5]),
        ..RawSample::default()
    };
    push_sample(&mut bytes, 0x0a0b_0c0d, 17, &raw);
    let after_head = concat!(
        "0d0c0b0a",
        "1100000000000000",
        "0807060504030201",
        "000000000000f03f",
        "00000000000000c0",
        "000000000000e03f"
    );
    assert_eq!(hex(&bytes), format!("f8013000{after_head}"));
    let accel = "000000000000000000000000000000000000000000002440";
    raw.accel = Some([0.0, 0.0, 10.0]);
    bytes.clear();
    push_sample(&mut bytes, 0x0a0b_0c0d, 17, &raw);
    assert_eq!(hex(&bytes), format!("f8014800{after_head}{accel}"));
    raw.interval_nanos = Some(1_000_000);
    bytes.clear();
    push_sample(&mut bytes, 0x0a0b_0c0d, 17, &raw);
    assert_eq!(
        hex(&bytes),
        format!("f8015000{after_head}{accel}40420f0000000000")
    );
}

#[test]
fn a_packed_attitude_is_these_bytes() {
    let mut s = sample(Nanos(-1));
    s.q_nb = Quaternion::assume_unit([1.0, 0.0, -0.0, 0.0]);
    s.rate = BodyRate(Vector3::new(0.5, f64::INFINITY, -2.0));
    s.covariance = AttitudeCovariance::default();
    s.status = Status::HELD.with(Status::RESTARTED);
    s.reset_count = 3;
    let mut bytes = Vec::new();
    push_attitude(&mut bytes, 2, 1, &s);
    let expected = concat!(
        "f8027000",
        "02000000",
        "0100000000000000",
        "ffffffffffffffff",
        "000000000000f03f",
        "0000000000000000",
        "0000000000000080",
        "0000000000000000",
        "000000000000e03f",
        "000000000000f87f",
        "00000000000000c0",
        "000000000000000000000000000000000000000000000000",
        "02020000",
        "03000000"
    );
    assert_eq!(hex(&bytes), expected);
}

#[test]
fn status_bits_mean_what_the_protocol_says() {
    let page = include_str!("../../../../../docs/protocol.md");
    let row = |bit: u32, name: &str| format!("| {bit} | `{name}` |");
    for bit in 0..16 {
        let names: Vec<_> = Status(1 << bit).names().collect();
        assert_eq!(names.len(), usize::from(bit < 15), "bit {bit}: {names:?}");
        for name in names {
            assert!(page.contains(&row(bit, name)), "bit {bit} is {name}");
        }
    }
}

#[test]
fn what_is_packed_is_read_back_to_the_bit() {
    let received = Nanos(5);
    for gyro in [None, Some([0.1, -0.2, 5e-324])] {
        for accel in [None, Some([0.0, -0.0, 9.81])] {
            for (interval_nanos, mag) in [
                (None, None),
                (Some(0), None),
                (Some(-7), Some([2e-5, -0.0, 4.5e-5])),
                (None, Some([1.0, 2.0, 3.0])),
            ] {
                let raw = RawSample {
                    header: Some(Nanos(-3)),
                    log: received,
                    publish: received,
                    gyro,
                    accel,
                    mag,
                    interval_nanos,
                    ..RawSample::default()
                };
                let mut bytes = Vec::new();
                push_sample(&mut bytes, 9, 4, &raw);
                assert_eq!(length(&bytes), Some(bytes.len()));
                let object = Object::Rate {
                    stream: 9,
                    seq: Some(4),
                    sample: raw,
                };
                assert_eq!(read(&bytes, received), Ok(object));
            }
        }
    }
    let s = sample(Nanos(1_700_000_000_000_000_001));
    let mut bytes = Vec::new();
    push_attitude(&mut bytes, 7, u64::MAX, &s);
    let Ok(Object::Att { stream, attitude }) = read(&bytes, received) else {
        unreachable!("an attitude");
    };
    assert_eq!(
        (stream, attitude.seq, attitude.stamp),
        (7, u64::MAX, s.stamp)
    );
    assert_eq!(attitude.q, s.q_nb.wxyz());
    assert_eq!(attitude.rate, <[f64; 3]>::from(s.rate));
    let sigma = s.covariance.sigma().map(f64::to_degrees);
    assert_eq!(attitude.sigma_deg, <[f64; 3]>::from(sigma));
}

#[test]
fn what_is_absent_is_absent_and_one_nan_takes_its_vector_with_it() {
    let mut bytes = Vec::new();
    let raw = RawSample {
        gyro: Some([1.0, f64::NAN, 1.0]),
        accel: Some([f64::NAN, 1.0, 1.0]),
        ..RawSample::default()
    };
    push_sample(&mut bytes, 1, NO_SEQ, &raw);
    bytes[16..24].copy_from_slice(&NO_TIME.to_le_bytes());
    let Ok(Object::Rate { seq, sample, .. }) = read(&bytes, Nanos(0)) else {
        unreachable!("a sample");
    };
    assert_eq!(
        (seq, sample.header, sample.gyro, sample.accel),
        (None, None, None, None)
    );
    // Infinity is no absence: it is counted as what it is.
    bytes[32..40].copy_from_slice(&f64::INFINITY.to_le_bytes());
    let Ok(Object::Rate { sample, .. }) = read(&bytes, Nanos(0)) else {
        unreachable!("a sample");
    };
    assert_eq!(sample.gyro, Some([1.0, f64::INFINITY, 1.0]));
}

#[test]
fn an_attitude_is_a_sample_of_what_it_has() {
    let attitude = Attitude {
        stamp: Nanos(7),
        q: [1.0, 0.0, 0.0, 0.0],
        rate: [0.1, 0.2, 0.3],
        ..Attitude::default()
    };
    let sample = attitude.as_sample(Nanos(9));
    assert_eq!((sample.header, sample.log), (Some(Nanos(7)), Nanos(9)));
    assert_eq!(sample.gyro, Some(attitude.rate));
    assert_eq!(sample.orientation, Some(attitude.q));
    let nothing = Attitude {
        q: [1.0, f64::INFINITY, 0.0, 0.0],
        rate: [0.1, f64::NAN, 0.3],
        ..attitude
    };
    let sample = nothing.as_sample(Nanos(9));
    assert_eq!((sample.gyro, sample.orientation), (None, None));
}

fn sized(kind: u8, length: usize) -> Vec<u8> {
    let mut bytes = vec![0; length];
    let [low, high] = (length as u16).to_le_bytes();
    bytes[..4].copy_from_slice(&[MARK, kind, low, high]);
    bytes
}

#[test]
fn longer_objects_are_read_by_their_known_part_and_shorter_ones_are_refused() {
    for have in [8, 40, 47] {
        let need = 48;
        assert_eq!(
            read(&sized(1, have), Nanos(0)),
            Err(Unreadable::Short { have, need })
        );
    }
    for have in [8, 48, 111] {
        let need = 112;
        assert_eq!(
            read(&sized(2, have), Nanos(0)),
            Err(Unreadable::Short { have, need })
        );
    }
    for (length, accel, interval) in [
        (48, false, false),
        (71, false, false),
        (72, true, false),
        (79, true, false),
        (80, true, true),
        (65_535, true, true),
    ] {
        let Ok(Object::Rate { sample, .. }) = read(&sized(1, length), Nanos(0)) else {
            unreachable!("{length} bytes");
        };
        assert_eq!(sample.gyro, Some([0.0; 3]));
        assert_eq!(
            (sample.accel.is_some(), sample.interval_nanos.is_some()),
            (accel, interval),
            "{length}"
        );
    }
    assert!(matches!(
        read(&sized(2, 200), Nanos(0)),
        Ok(Object::Att { .. })
    ));
    assert_eq!(read(&sized(3, 200), Nanos(0)), Err(Unreadable::Kind(3)));
    assert_eq!(read(&[], Nanos(0)), Err(Unreadable::NoObject));
    assert_eq!(
        read(&sized(1, 48)[..47], Nanos(0)),
        Err(Unreadable::NoObject)
    );
}

#[test]
fn a_stretch_is_taken_apart_and_a_rest_left_out() {
    let stretch = [sized(1, 48), sized(9, 8), sized(2, 112), sized(1, 7)].concat();
    let lengths: Vec<_> = objects(&stretch).map(<[u8]>::len).collect();
    assert_eq!(lengths, [48, 8, 112]);
    assert!(is_packed(&stretch) && !is_packed(b"{}\n") && !is_packed(b""));
}

#[test]
fn an_attitude_carries_its_acceleration_where_there_is_one_and_old_readers_read_the_rest() {
    let mut s = sample(Nanos(7));
    let mut plain = Vec::new();
    push_attitude(&mut plain, 2, 1, &s);
    s.linear_acceleration = Some(LinearAcceleration {
        body: In::assume(Vector3::new(0.5, -0.25, 2.0)),
        covariance: [0.01, 0.0, 0.0, 0.04, 0.0, 0.09],
    });
    let mut bytes = Vec::new();
    push_attitude(&mut bytes, 2, 1, &s);
    assert_eq!((plain.len(), bytes.len()), (112, 160));
    // But for its length it begins as the shorter one.
    assert_eq!(bytes[4..112], plain[4..]);
    let read = |bytes: &[u8]| match read(bytes, Nanos(0)).unwrap() {
        Object::Att { attitude, .. } => attitude.linear_acceleration,
        Object::Rate { .. } => panic!("no attitude"),
    };
    let (acceleration, sigma) = read(&bytes).unwrap();
    assert_eq!(acceleration, [0.5, -0.25, 2.0]);
    for (found, expected) in sigma.into_iter().zip([0.1, 0.2, 0.3]) {
        assert!((found - expected).abs() < 1e-15);
    }
    assert_eq!(read(&plain), None);
}
