//! Promise: a device's own orientation leans as its accelerometer says, and goes to a topic.

use super::*;

/// Direction of gravity's reaction, up, in the axes of a sensor of this orientation.
fn up_of(wxyz: [f64; 4]) -> [f64; 3] {
    let [w, x, y, z] = wxyz;
    let norm: f64 = wxyz.iter().map(|v| v * v).sum();
    [
        2.0 * (x * z - w * y) / norm,
        2.0 * (y * z + w * x) / norm,
        1.0 - 2.0 * (x * x + y * y) / norm,
    ]
}

/// Course of the x axis, deg from east to north.
fn course_of([w, x, y, z]: [f64; 4]) -> f64 {
    let east = 1.0 - 2.0 * (y * y + z * z);
    let north = 2.0 * (x * y + w * z);
    north.atan2(east).to_degrees()
}

#[test]
fn an_orientation_leans_as_gravity_does_in_the_same_message() {
    // As a VN-100 sent it: its accelerometer says how it lay, its yaw of -166 degrees from north over east where to.
    let line = b"$VNYMR,-165.981,-037.301,+001.245,+00.2901,+00.0720,+00.7482,-05.966,-00.150,-07.836,+00.001373,-00.001533,-00.001054*68\r\n";
    let (samples, _) = read("vectornav", line);
    let (q, force) = (samples[0].orientation.unwrap(), samples[0].force.unwrap());
    let length = force.iter().map(|v| v * v).sum::<f64>().sqrt();
    for (up, force) in up_of(q).into_iter().zip(force) {
        // The device's own estimate is not its last force: 0.3 degrees.
        assert!((up - force / length).abs() < 5e-3, "{up} {force}");
    }
    assert!((course_of(q) - (90.0 + 165.981 - 360.0)).abs() < 1e-3);
    // The same in its other forms.
    let f = |v: &[f32]| v.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let [yaw, pitch, roll] = [-165.981f64, -37.301, 1.245].map(|v| (v / 2.0).to_radians());
    let [(sy, cy), (sp, cp), (sr, cr)] = [yaw, pitch, roll].map(f64::sin_cos);
    let xyzw = [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ];
    let binary = f(&xyzw.map(|v| v as f32));
    let angles = f(&[-165.981, -37.301, 1.245]);
    let rate = (0, 1 << 5, f(&[0.0; 3]));
    let forms = [
        made::vectornav(&[(0, 1 << 4 | 1 << 5, [binary.clone(), f(&[0.0; 3])].concat())]),
        made::vectornav(&[rate.clone(), (4, 1 << 2, binary.clone())]),
        made::vectornav(&[rate, (4, 1 << 1 | 1 << 2, [angles, binary].concat())]),
    ];
    for bytes in forms {
        let (samples, _) = read("vectornav", &bytes);
        for (one, other) in samples[0].orientation.unwrap().into_iter().zip(q) {
            assert!((one - other).abs() < 1e-6, "{one} {other}");
        }
    }
    let be = |v: &[f64]| {
        v.iter()
            .flat_map(|v| (*v as f32).to_be_bytes())
            .collect::<Vec<u8>>()
    };
    let [x, y, z, w] = xyzw;
    let rate = (0x05, be(&[0.0; 3]));
    let time = (0xd5, 9u64.to_be_bytes().to_vec());
    let valid = |numbers: Vec<u8>, flags: u16| [numbers, flags.to_be_bytes().to_vec()].concat();
    let euler = be(&[2.0 * roll, 2.0 * pitch, 2.0 * yaw]);
    let wxyz = be(&[w, x, y, z]);
    for (bytes, has_rate) in [
        (made::mip(0x80, &[rate.clone(), (0x0a, wxyz.clone())]), true),
        (made::mip(0x80, &[rate, (0x0c, euler.clone())]), true),
        (
            made::mip(0x82, &[(0x03, valid(wxyz.clone(), 1)), time.clone()]),
            false,
        ),
        (
            made::mip(0x82, &[(0x05, valid(euler, 1)), time.clone()]),
            false,
        ),
    ] {
        let (samples, _) = read("mip", &bytes);
        assert_eq!(samples[0].rate.is_some(), has_rate);
        for (one, other) in samples[0].orientation.unwrap().into_iter().zip(q) {
            assert!((one - other).abs() < 1e-6, "{one} {other}");
        }
    }
    let invalid = made::mip(0x82, &[(0x03, valid(wxyz, 0)), time]);
    assert_eq!(read("mip", &invalid).0, []);
}

#[test]
fn an_orientation_of_its_own_messages_is_a_topic_and_no_line() {
    // A quarter turn to the left of north, nose down by 30 degrees.
    let (s, c) = 15f64.to_radians().sin_cos();
    let h = std::f64::consts::FRAC_1_SQRT_2;
    let q = [c * h, -s * h, s * h, c * h].map(|v| v as f32);
    let text = format!("Q,5000,{},{},{},{}\r\n", q[0], q[1], q[2], q[3]);
    let angles = made::ximu3(b'A', 5000, &[0.0, 30.0, 90.0]);
    let linear = made::ximu3(b'L', 5000, &[q[0], q[1], q[2], q[3], 1.0, 2.0, 3.0]);
    for bytes in [
        made::ximu3(b'Q', 5000, &q),
        text.into_bytes(),
        angles,
        linear,
    ] {
        let (samples, _) = read("ximu3", &bytes);
        let orientation = samples[0].orientation.unwrap();
        assert_eq!((samples[0].rate, samples[0].time), (None, Some(5_000_000)));
        close(up_of(orientation), [-0.5, 0.0, 0.75f64.sqrt()]);
        assert!((course_of(orientation).abs() - 180.0).abs() < 1e-3, "west");
        let mut link = Link::of(Asked::Named(named("ximu3"))).unwrap();
        let mut lines = Vec::new();
        link.push(&bytes, Nanos(0), None, &mut lines);
        assert!(lines.is_empty());
    }
    // An orientation that is none costs no rate.
    let items = [
        (0x8020, made::numbers(0, &[1.0, 2.0, 3.0])),
        (0x2010, made::numbers(0, &[f64::NAN; 4])),
    ];
    let (samples, _) = read("xsens", &made::xsens(&items, None, None));
    assert_eq!(
        (samples[0].rate, samples[0].orientation),
        (Some([1.0, 2.0, 3.0]), None)
    );
    // WitMotion: east-north-up; the first of its two forms is taken, and what has no time is left out.
    let time = made::witmotion(0x50, [24 | 5 << 8, 17 | 8 << 8, 0, 20]);
    let rate = made::witmotion(0x52, [0; 4]);
    let wit = |half_turns: f64| (half_turns * 32_768.0).round() as i32;
    let angles = made::witmotion(0x53, [0, wit(1.0 / 6.0), wit(0.5), 0]);
    let turned = made::witmotion(0x59, q.map(|v| wit(f64::from(v))));
    for (parts, count) in [
        (vec![&time, &rate, &angles, &turned], 2),
        (vec![&time, &rate, &turned, &angles], 2),
        (vec![&rate, &angles], 1),
    ] {
        let bytes: Vec<u8> = parts.into_iter().flatten().copied().collect();
        let (samples, _) = read("witmotion", &bytes);
        assert_eq!(samples.len(), count);
        for orientation in samples.iter().filter_map(|sample| sample.orientation) {
            let up = up_of(orientation);
            assert!((up[0] + 0.5).abs() < 1e-4 && up[1].abs() < 1e-4, "{up:?}");
            assert!((course_of(orientation) - 90.0).abs() < 0.02, "north");
        }
        assert_eq!(samples.last().unwrap().orientation.is_some(), count == 2);
    }
    // In a capture each has a topic of its own.
    let both = [stream("ximu3", 9), made::ximu3(b'Q', 5000, &q)].concat();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("capture.bin");
    std::fs::write(&path, &both).unwrap();
    let survey = survey(&Log::open(&path).unwrap(), &WalkOptions::default()).unwrap();
    let topics: Vec<_> = survey
        .channels
        .iter()
        .map(|one| one.channel.topic.as_str())
        .collect();
    assert_eq!(topics, ["ximu3", "ximu3/orientation"]);
}
