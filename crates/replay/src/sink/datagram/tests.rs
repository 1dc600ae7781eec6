//! Promise: what other programs get is the attitude it was, in their axes, signs, order and units; each is read here as its
//! own documents say, from the bytes alone.

#![allow(clippy::unwrap_used)]

use super::*;
use crate::sink::Stream;
use crate::sink::axes::tests::{close, rotate, telling};
use strapd_attitude::record::{AttitudeSample, Nanos};

fn recipient(text: &str) -> Recipient {
    let (scheme, rest) = text.split_once("://").unwrap();
    let (address, query) = match rest.split_once('?') {
        Some((address, query)) => (address, Some(query)),
        None => (rest, None),
    };
    Recipient::parse(scheme, address, query).unwrap().unwrap()
}

fn records(id: &str, samples: &[AttitudeSample]) -> Vec<u8> {
    let object = RecordObject::new(&Stream {
        id: id.to_owned(),
        ..Stream::new("/imu", "imu")
    });
    let mut out = Vec::new();
    for sample in samples {
        object.push(&mut out, sample);
    }
    out
}

fn all(datagrams: &mut Datagrams) -> Vec<Vec<u8>> {
    std::iter::from_fn(|| datagrams.ready()).collect()
}

/// Datagrams of the telling attitude.
fn sent(text: &str, id: &str) -> Vec<Vec<u8>> {
    let mut datagrams = Datagrams::new(&recipient(text));
    datagrams.take(&records(id, &[telling()]));
    all(&mut datagrams)
}

fn big(bytes: &[u8]) -> Vec<f64> {
    let floats = bytes.chunks_exact(4);
    floats
        .map(|four| f64::from(f32::from_be_bytes(four.try_into().unwrap())))
        .collect()
}

fn little(bytes: &[u8]) -> Vec<f64> {
    let floats = bytes.chunks_exact(4);
    floats
        .map(|four| f64::from(f32::from_le_bytes(four.try_into().unwrap())))
        .collect()
}

/// Roll, pitch, yaw of the telling attitude for z up: of `Rx(30) Ry(50)`, worked out from the matrix by hand.
fn angles() -> [f64; 3] {
    let [(sx, cx), (sy, cy)] = [30f64, 50.0].map(|angle| angle.to_radians().sin_cos());
    // Rx Ry = [[cy, 0, sy], [sx sy, cx, -sx cy], [-cx sy, sx, cx cy]]; of ZYX: r21 / r22, -r20, r10 / r00.
    [
        sx.atan2(cx * cy).to_degrees(),
        (cx * sy).asin().to_degrees(),
        (sx * sy).atan2(cy).to_degrees(),
    ]
}

#[test]
fn opentrack_gets_yaw_to_the_right_pitch_up_roll_to_the_right() {
    let sent = sent("opentrack://h:4242", "head");
    assert_eq!(sent.len(), 1);
    let numbers: Vec<f64> = sent[0]
        .chunks_exact(8)
        .map(|eight| f64::from_le_bytes(eight.try_into().unwrap()))
        .collect();
    let [roll, pitch, yaw] = angles();
    // Positive about z is to the left, about y (to the left) nose down, about x right side down.
    assert!(close(&numbers, &[0.0, 0.0, 0.0, -yaw, -pitch, roll], 1e-12));
    assert!(yaw > 20.0 && pitch > 40.0 && roll > 30.0);
}

#[test]
fn opentrack_has_one_head_and_the_address_may_choose_it() {
    let two = [
        records("left", &[telling()]),
        records("right", &[telling()]),
    ]
    .concat();
    for (text, count) in [
        ("opentrack://h:1", 1),
        ("opentrack://h:1?id=right", 1),
        ("opentrack://h:1?id=neither", 0),
        ("vmc://h:1", 2),
    ] {
        let mut datagrams = Datagrams::new(&recipient(text));
        datagrams.take(&two);
        assert_eq!(all(&mut datagrams).len(), count, "{text}");
    }
}

#[test]
fn osc_has_the_quaternion_w_first_and_the_angles_in_degrees() {
    let sent = sent("osc://h:1", "/imu/left arm");
    let [quaternion, euler] = &sent[..] else {
        panic!("{sent:?}")
    };
    let head = b"/strapd/imu/left_arm/quaternion\0,ffff\0\0\0";
    assert_eq!(&quaternion[..head.len()], head);
    let numbers = big(&quaternion[head.len()..]);
    assert!(close(&numbers, &telling().q_nb.wxyz(), 1e-7));
    let head = b"/strapd/imu/left_arm/euler\0\0,fff\0\0\0\0";
    assert_eq!(&euler[..head.len()], head);
    assert!(close(&big(&euler[head.len()..]), &angles(), 1e-5));
}

#[test]
fn vmc_has_the_quaternion_of_unity_with_w_last() {
    let sent = sent("vmc://h:39539", "head");
    let head = b"/VMC/Ext/Tra/Pos\0\0\0\0,sfffffff\0\0\0head\0\0\0\0";
    assert_eq!(&sent[0][..head.len()], head);
    let numbers = big(&sent[0][head.len()..]);
    assert_eq!(numbers[..3], [0.0; 3]);
    let [x, y, z, w] = numbers[3..] else {
        panic!("{numbers:?}")
    };
    // Forward is z there, left is -x, up is y.
    let nose = rotate([w, x, y, z], [0.0, 0.0, 1.0]);
    let [forward, left, up] = rotate(telling().q_nb.wxyz(), [1.0, 0.0, 0.0]);
    assert!(close(&nose, &[-left, up, forward], 1e-6));
    let crown = rotate([w, x, y, z], [0.0, 1.0, 0.0]);
    let [forward, left, up] = rotate(telling().q_nb.wxyz(), [0.0, 0.0, 1.0]);
    assert!(close(&crown, &[-left, up, forward], 1e-6));
}

#[test]
fn mavlink_has_forward_right_down_and_counts_each_component() {
    let mut datagrams = Datagrams::new(&recipient("mavlink://h:14550?system=7"));
    let later = AttitudeSample {
        stamp: Nanos(telling().stamp.0 + 1_234_567_890),
        ..telling()
    };
    datagrams.tick(Instant::now());
    datagrams.take(&records("one", &[telling(), later]));
    datagrams.take(&records("two", &[telling()]));
    let frames = all(&mut datagrams);
    let heads: Vec<_> = frames.iter().map(|f| (f[4], f[5], f[6], f[7])).collect();
    assert_eq!(
        heads,
        [
            (0, 7, 1, 0),
            (1, 7, 1, 31),
            (2, 7, 1, 30),
            (3, 7, 1, 31),
            (4, 7, 1, 30),
            (0, 7, 25, 31),
            (1, 7, 25, 30)
        ]
    );
    for frame in &frames {
        assert_eq!((frame[0], frame[1] as usize + 12), (0xfd, frame.len()));
    }
    let payload = |frame: &[u8]| {
        let mut payload = frame[10..frame.len() - 2].to_vec();
        payload.resize(32, 0);
        payload
    };
    let quaternion = payload(&frames[3]);
    assert_eq!(quaternion[..4], 1234u32.to_le_bytes());
    let [w, x, y, z] = telling().q_nb.wxyz();
    let rates = [0.1, 0.2, -0.3];
    let numbers = little(&quaternion[4..]);
    assert!(close(&numbers[..4], &[w, x, -y, -z], 1e-7));
    assert!(close(&numbers[4..], &rates, 1e-7));
    let [roll, pitch, yaw] = angles().map(f64::to_radians);
    let numbers = little(&payload(&frames[4])[4..28]);
    assert!(close(&numbers, &[roll, -pitch, -yaw, 0.1, 0.2, -0.3], 1e-6));
}

/// The server, as far as its sources say what it does with a packet: number of the last, and who is known.
#[derive(Default)]
struct Server {
    is_greeted: bool,
    last: u64,
    known: std::collections::BTreeSet<u8>,
    rotations: Vec<(u8, [f64; 4])>,
    version: u32,
    firmware: String,
}

impl Server {
    fn hear(&mut self, packet: &[u8]) -> Vec<Vec<u8>> {
        let kind = u32::from_be_bytes(packet[..4].try_into().unwrap());
        let number = u64::from_be_bytes(packet[4..12].try_into().unwrap());
        let rest = &packet[12..];
        if kind == 3 {
            self.version = u32::from_be_bytes(rest[24..28].try_into().unwrap());
            let length = usize::from(rest[28]);
            self.firmware = String::from_utf8(rest[29..29 + length].to_vec()).unwrap();
            assert_eq!(rest[29 + length..], [0; 6]);
            (self.is_greeted, self.last) = (true, 0);
            let mut welcome = b"\x03Hey OVR =D 5".to_vec();
            welcome.resize(64, 0);
            return vec![welcome];
        }
        // What is not the next is thrown away, and of whom it does not know everything.
        if !self.is_greeted || number <= self.last {
            return vec![];
        }
        self.last = number;
        match kind {
            15 => {
                self.known.insert(rest[0]);
                vec![[&15u32.to_be_bytes()[..], &[rest[0], rest[1]]].concat()]
            }
            17 => {
                assert_eq!((rest[1], rest.len()), (1, 19));
                let q: [f64; 4] = big(&rest[2..18]).try_into().unwrap();
                if self.known.contains(&rest[0]) {
                    self.rotations.push((rest[0], q));
                }
                vec![]
            }
            _ => vec![],
        }
    }
}

#[test]
fn a_slimevr_server_knows_each_sensor_before_its_first_rotation() {
    let mut datagrams = Datagrams::new(&recipient("slimevr://h:6969"));
    let (mut server, now) = (Server::default(), Instant::now());
    datagrams.tick(now);
    datagrams.take(&records("hip", &[telling()]));
    datagrams.take(&records("knee", &[telling(), telling()]));
    for packet in all(&mut datagrams) {
        for answer in server.hear(&packet) {
            datagrams.hear(&answer, now);
        }
    }
    assert!(server.version >= 9 && server.firmware.starts_with("strapd "));
    let [w, x, y, z] = telling().q_nb.wxyz();
    assert_eq!(server.rotations.len(), 3);
    assert_eq!(
        server.rotations.iter().map(|r| r.0).collect::<Vec<_>>(),
        [0, 1, 1]
    );
    assert!(close(&server.rotations[2].1, &[x, y, z, w], 1e-7));
    // The server turns it by -90 degrees about x: what was up (z) is up (y) there.
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let up = rotate([s, -s, 0.0, 0.0], rotate([w, x, y, z], [0.0, 0.0, 1.0]));
    let [north, west, above] = rotate([w, x, y, z], [0.0, 0.0, 1.0]);
    assert!(close(&up, &[north, above, -west], 1e-14));

    // A sign of life each second, an answer to its ping; one that went silent is greeted again and told everything again.
    datagrams.tick(now + Duration::from_millis(400));
    assert!(all(&mut datagrams).is_empty());
    datagrams.tick(now + TICK);
    let beats = all(&mut datagrams);
    assert_eq!((beats.len(), beats[0].len()), (1, 12));
    let ping = [&10u32.to_be_bytes()[..], &[0; 8], &[1, 2, 3, 4]].concat();
    datagrams.hear(&ping, now + TICK);
    let answer = all(&mut datagrams);
    assert_eq!((answer.len(), &answer[0][12..]), (1, &[1, 2, 3, 4][..]));
    datagrams.tick(now + 5 * TICK);
    let mut server = Server::default();
    for packet in all(&mut datagrams) {
        server.hear(&packet);
    }
    assert_eq!(server.known.len(), 2);
    assert!(datagrams.unanswered().is_none());
}

#[test]
fn what_a_server_may_say_breaks_nothing() {
    let mut datagrams = Datagrams::new(&recipient("slimevr://h:6969"));
    for said in [&b""[..], &[0], &[0, 0, 0, 10], &[0, 0, 0, 15], &[0xff; 70]] {
        datagrams.hear(said, Instant::now());
    }
    assert!(all(&mut datagrams).is_empty());
    // Records that are cut are none.
    let whole = records("hip", &[telling()]);
    for cut in 0..whole.len() {
        datagrams.take(&whole[..cut]);
    }
    assert!(all(&mut datagrams).is_empty());
}

#[test]
fn a_rate_thins_each_sensor_by_its_stamps_and_an_attitude_that_is_none_is_left_out() {
    let mut datagrams = Datagrams::new(&recipient("osc://h:1?rate=50"));
    let samples: Vec<_> = (0..1000)
        .map(|n| AttitudeSample {
            stamp: Nanos(n * 1_000_000),
            ..telling()
        })
        .collect();
    datagrams.take(&records("a", &samples));
    assert_eq!(all(&mut datagrams).len(), 2 * 50);
    let lost = AttitudeSample {
        q_nb: strapd_attitude::quaternion::Quaternion::assume_unit([f64::NAN, 0.0, 0.0, 1.0]),
        ..telling()
    };
    for text in ["opentrack://h:1", "osc://h:1", "vmc://h:1", "slimevr://h:1"] {
        let mut datagrams = Datagrams::new(&recipient(text));
        datagrams.take(&records("a", &[lost]));
        let rotations = all(&mut datagrams).into_iter().filter(|d| d.len() != 15);
        assert_eq!(rotations.count(), 0, "{text}");
    }
}

#[test]
fn an_address_says_what_it_takes() {
    for (text, words) in [
        ("opentrack://h:1?profile=x", "id=NAME, rate=HZ"),
        ("osc://h:1?rate=0", "a rate above 0 Hz"),
        ("osc://h:1?rate=nan", "a rate above 0 Hz"),
        ("mavlink://h:1?system=0", "1 to 255"),
        ("vmc://h:1?system=3", "id=NAME, rate=HZ"),
    ] {
        let said = crate::sink::Target::parse(text).unwrap_err().to_string();
        assert!(said.contains(words), "{text}: {said}");
    }
    let target = crate::sink::Target::parse("MAVLINK://h:1?system=9&rate=20&id=a").unwrap();
    assert!(matches!(target, crate::sink::Target::Protocol(_)));
    assert!(Recipient::parse("gopher", "h:1", None).is_none());
}
