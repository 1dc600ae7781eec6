//! Foxglove's protocol on every `ws-listen://`.

use super::lines::{LOG, lines_of};
use super::watched::paused;
use crate::serve::client::{Client, rate};
use crate::serve::daemon::{Daemon, PATIENCE, TCP, WS, listening};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::net::{SocketAddr, TcpStream};
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;
use strapd::pipeline::audience::Audience;
use strapd::serve::playback::controls::Playback;
use strapd::serve::playback::server::PlaybackServer;
use strapd::sink::Transforms;
use strapd::sink::address::Listen;
use strapd_attitude::record::Nanos;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// A viewer that speaks one of the sub-protocols.
struct Viewer {
    socket: WebSocket<TcpStream>,
    /// Messages that came while another was waited for: an answer overtakes data, or not.
    passed_over: VecDeque<Message>,
}

impl Viewer {
    fn connect(address: SocketAddr, protocols: &str) -> (Viewer, Option<String>) {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut request = format!("ws://{address}/").into_client_request().unwrap();
        let name = "Sec-WebSocket-Protocol";
        request
            .headers_mut()
            .insert(name, protocols.parse().unwrap());
        let (socket, response) = tungstenite::client(request, stream).unwrap();
        let spoken = response.headers().get(name);
        let spoken = spoken.map(|s| s.to_str().unwrap().to_owned());
        let viewer = Viewer {
            socket,
            passed_over: VecDeque::new(),
        };
        (viewer, spoken)
    }

    fn send(&mut self, value: &Value) {
        self.socket.send(Message::text(value.to_string())).unwrap();
    }

    fn next(&mut self) -> Message {
        let began = Instant::now();
        loop {
            match self.socket.read().unwrap() {
                Message::Ping(_) | Message::Pong(_) => {
                    assert!(began.elapsed() < PATIENCE, "it does not come");
                }
                message => return message,
            }
        }
    }

    /// The first message not yet found of which `find` makes something.
    fn first<T>(&mut self, find: impl Fn(&Message) -> Option<T>) -> T {
        let known = self.passed_over.iter().enumerate();
        if let Some((n, found)) = known.filter_map(|(n, m)| Some((n, find(m)?))).next() {
            self.passed_over.remove(n);
            return found;
        }
        loop {
            let message = self.next();
            if let Some(found) = find(&message) {
                return found;
            }
            self.passed_over.push_back(message);
            assert!(self.passed_over.len() < 50_000, "it does not come");
        }
    }

    /// The next text message with this `op`.
    fn text(&mut self, op: &str) -> Value {
        self.first(|message| {
            let value: Value = serde_json::from_str(message.to_text().ok()?).ok()?;
            (value["op"] == op).then_some(value)
        })
    }

    /// The next binary message that begins with this byte.
    fn binary(&mut self, op: u8) -> Vec<u8> {
        self.first(|message| match message {
            Message::Binary(bytes) if bytes[0] == op => Some(bytes.to_vec()),
            _ => None,
        })
    }

    /// Asks for playback; the state that answers.
    fn control(&mut self, command: u8, speed: f32, seek: Option<u64>) -> Vec<u8> {
        let mut message = vec![3, command];
        message.extend(speed.to_le_bytes());
        message.push(u8::from(seek.is_some()));
        message.extend(seek.unwrap_or_default().to_le_bytes());
        message.extend(3u32.to_le_bytes());
        message.extend(b"now");
        self.socket.send(Message::binary(message)).unwrap();
        self.first(|message| match message {
            Message::Binary(bytes) if bytes[0] == 5 && bytes.ends_with(b"now") => {
                Some(bytes.to_vec())
            }
            _ => None,
        })
    }
}

fn time_of(frame: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(frame[at..at + 8].try_into().unwrap())
}

#[test]
fn the_first_sub_protocol_offered_that_is_known_is_spoken() {
    let daemon = Daemon::start(listening(&[WS]));
    for (offered, spoken) in [
        ("foxglove.sdk.v1", "foxglove.sdk.v1"),
        (
            "foxglove.websocket.v1, foxglove.sdk.v1",
            "foxglove.websocket.v1",
        ),
        ("x, foxglove.sdk.v1", "foxglove.sdk.v1"),
    ] {
        let (mut viewer, answer) = Viewer::connect(daemon.address(0), offered);
        assert_eq!(answer.as_deref(), Some(spoken));
        assert_eq!(viewer.text("serverInfo")["capabilities"], json!([]));
    }
    let (mut plain, answer) = Viewer::connect(daemon.address(0), "strapd.v1");
    assert_eq!(answer.as_deref(), Some("strapd.v1"));
    let Message::Text(greeting) = plain.next() else {
        unreachable!("a line")
    };
    assert!(greeting.contains("VERSION"));
}

#[test]
fn the_sensors_of_a_daemon_are_channels_as_they_come_and_what_is_not_offered_is_answered() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let (mut viewer, _) = Viewer::connect(daemon.address(1), "foxglove.sdk.v1");
    let first = viewer.text("advertise");
    assert_eq!(first["channels"][0]["topic"], "/tf");
    let mut sender = Client::tcp(daemon.address(0)).watching(r#"{"class":"WATCH"}"#);
    sender.send(&rate("imu0", 0, 0.5));
    sender.next_of("ATT");
    let channel = viewer.text("advertise")["channels"][0].clone();
    assert_eq!(channel["topic"], "imu0/data");
    assert_eq!(channel["schemaName"], "sensor_msgs/msg/Imu");
    let id = channel["id"].clone();
    for bad in [
        json!({"op": "publish"}),
        json!({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}),
        json!([]),
    ] {
        viewer.send(&bad);
        assert_eq!(viewer.text("status")["level"], 2, "{bad}");
    }
    viewer.send(&json!({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": id}]}));
    // Subscribed, once the next answer comes.
    viewer.send(&json!({"op": "x"}));
    viewer.text("status");
    viewer.binary(1);
    sender.send(&rate("imu0", 1, 0.5));
    let frame = viewer.binary(1);
    assert_eq!(frame[1..5], 7u32.to_le_bytes());
    assert_eq!(&frame[13..17], &[0, 1, 0, 0], "CDR, little endian");
    assert_eq!(frame[21..25], 1_000_000_u32.to_le_bytes());
    viewer.send(&json!({"op": "unsubscribe", "subscriptionIds": [7]}));
    viewer.send(&json!({"op": "x"}));
    viewer.text("status");
    // Nothing that can be done here moves it.
    viewer
        .socket
        .send(Message::binary([&[3u8, 0][..], &[0; 17]].concat()))
        .unwrap();
    assert!(
        viewer.text("status")["message"]
            .as_str()
            .unwrap()
            .contains("replay")
    );
    for _ in 0..30 {
        let _ = viewer.socket.send(Message::text("nonsense"));
    }
    let closed = std::iter::from_fn(|| viewer.socket.read().ok())
        .take(1000)
        .count();
    assert!(closed < 1000, "it is closed after too much nonsense");
}

/// The covariance of a `sensor_msgs/msg/Imu` in CDR, and its quaternion (w, x, y, z), as the definition lays them
/// out: a header of stamp and text, and then numbers at multiples of eight bytes from behind the encapsulation.
fn imu(cdr: &[u8]) -> ([f64; 9], [f64; 4]) {
    let number = numbers(cdr);
    let [x, y, z, w] = std::array::from_fn(|n| number[n]);
    (std::array::from_fn(|n| number[4 + n]), [w, x, y, z])
}

/// The numbers of a stamped message behind its header.
fn numbers(cdr: &[u8]) -> Vec<f64> {
    let body = &cdr[4..];
    let length = u32::from_le_bytes(body[8..12].try_into().unwrap()) as usize;
    let at = (12 + length).next_multiple_of(8);
    let each = body[at..].chunks_exact(8);
    each.map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()))
        .collect()
}

#[test]
fn an_aided_sensors_messages_have_the_filters_covariance_about_the_axes_of_the_world() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan.aid = strapd_attitude::estimate::Aid::Gravity;
    let daemon = Daemon::start(settings);
    let mut sender = Client::tcp(daemon.address(0)).watching(r#"{"class":"WATCH"}"#);
    // On its side, and turning about the vertical: which of its axes is which of the world's shows.
    let line = |n: u64| {
        format!(
            "{{\"id\":\"imu0\",\"stamp_ns\":{},\"gyro\":[0.02,0.9,0.1],\"accel\":[0.3,9.8,0.1]}}",
            1_700_000_000_000_000_000 + n * 10_000_000
        )
    };
    sender.send(&line(0));
    sender.next_of("ATT");
    let (mut viewer, _) = Viewer::connect(daemon.address(1), "foxglove.sdk.v1");
    let channel = viewer.text("advertise")["channels"][1].clone();
    assert_eq!(channel["topic"], "imu0/data");
    let subscription = json!({"id": 7, "channelId": channel["id"]});
    viewer.send(&json!({"op": "subscribe", "subscriptions": [subscription]}));
    viewer.send(&json!({"op": "x"}));
    viewer.text("status");
    viewer.binary(1);
    let mut last = None;
    for n in 1..3000 {
        sender.send(&line(n));
        let att = sender.next_of("ATT");
        let (p, q) = imu(&viewer.binary(1)[13..]);
        last = Some((p, q, att));
    }
    let (p, q, att) = last.unwrap();
    for (n, name) in ["w", "x", "y", "z"].into_iter().enumerate() {
        assert_eq!(att["q"][name], q[n]);
    }
    // To body axes by the quaternion's matrix, written out: its diagonal is what the line says.
    let [w, x, y, z] = q;
    let columns = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),
        ],
        [
            2.0 * (x * y - w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + w * x),
        ],
        [
            2.0 * (x * z + w * y),
            2.0 * (y * z - w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    for (axis, column) in columns.into_iter().enumerate() {
        let of = |i: usize, j: usize| column[i] * p[3 * i + j] * column[j];
        let variance: f64 = (0..9).map(|n| of(n / 3, n % 3)).sum();
        let said = att["sigma_deg"][axis].as_f64().unwrap();
        let sigma = variance.sqrt().to_degrees();
        assert!((sigma - said).abs() < 1e-9, "{axis}: {sigma} {said}");
    }
    // Gravity tells the tilt and not the heading.
    assert!(p[8] > 4.0 * p[0].max(p[4]), "{p:?}");
    let sigma = &daemon.status()["sources"][0]["attitude"]["sigma_deg"];
    let heading = p[8].sqrt().to_degrees();
    assert!(
        (sigma["heading"].as_f64().unwrap() - heading).abs() < 1e-9,
        "{sigma} {heading}"
    );
}

#[test]
fn the_frames_asked_for_and_the_acceleration_without_gravity_reach_viewers() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan.aid = strapd_attitude::estimate::Aid::Gravity;
    settings.hub.plan.linear_acceleration = true;
    settings.hub.frames.world = Some("odom".to_owned());
    settings.hub.frames.transforms = Transforms::Reverse;
    let daemon = Daemon::start(settings);
    let mut sender = Client::tcp(daemon.address(0)).watching(r#"{"class":"WATCH"}"#);
    let mut send = |id: &str, n: u64, accel: [f64; 3]| {
        sender.send(&format!(
            "{{\"id\":\"{id}\",\"stamp_ns\":{},\"gyro\":[0,0,0],\"accel\":{accel:?}}}",
            1_700_000_000_000_000_000 + n * 10_000_000
        ));
        sender.next_of("ATT")
    };
    for id in ["imu0", "imu1"] {
        (0..200).for_each(|n| drop(send(id, n, [0.0, 0.0, 9.81])));
    }
    let (mut viewer, _) = Viewer::connect(daemon.address(1), "foxglove.sdk.v1");
    let channels = viewer.text("advertise")["channels"].clone();
    let topics: Vec<_> = channels
        .as_array()
        .unwrap()
        .iter()
        .map(|c| {
            (
                c["topic"].as_str().unwrap(),
                c["schemaName"].as_str().unwrap(),
            )
        })
        .collect();
    let accel = "geometry_msgs/msg/AccelWithCovarianceStamped";
    let expected = [
        ("/tf", "tf2_msgs/msg/TFMessage"),
        ("imu0/data", "sensor_msgs/msg/Imu"),
        ("imu0/data/linear_acceleration", accel),
        ("imu1/data", "sensor_msgs/msg/Imu"),
        ("imu1/data/linear_acceleration", accel),
    ];
    assert_eq!(topics, expected);
    for (id, channel) in [(7, 0), (8, 2)] {
        let subscription = json!({"id": id, "channelId": channels[channel]["id"]});
        viewer.send(&json!({"op": "subscribe", "subscriptions": [subscription]}));
        // The last there is.
        assert_eq!(viewer.binary(1)[1], id);
    }
    let att = send("imu0", 200, [0.0, 0.0, 10.31]);
    let transform = viewer.binary(1);
    let acceleration = viewer.binary(1);
    let numbers = numbers(&acceleration[13..]);
    for (n, found) in numbers[..3].iter().enumerate() {
        assert_eq!(att["linear_acceleration"][n], *found);
    }
    assert!((numbers[2] - 0.5).abs() < 0.05 && numbers[5].is_nan());
    let sigma = att["sigma_linear_acceleration"][2].as_f64().unwrap();
    assert!((numbers[6 + 14].sqrt() - sigma).abs() < 1e-12);
    // The world has one parent, the first sensor.
    assert_eq!(transform[1], 7);
    let has = |text: &[u8]| transform.windows(text.len()).any(|part| part == text);
    assert!(has(b"odom\0") && has(b"imu0\0"));
    let parent = transform.windows(5).position(|part| part == b"imu0\0");
    assert!(parent < transform.windows(5).position(|part| part == b"odom\0"));
    // The other has none.
    send("imu1", 200, [0.0, 0.0, 9.81]);
    send("imu0", 201, [0.0, 0.0, 9.81]);
    for expected in [7, 8] {
        assert_eq!(viewer.binary(1)[1], expected);
    }
}

#[test]
fn without_transforms_there_is_no_channel_for_them() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.frames.transforms = Transforms::None;
    let daemon = Daemon::start(settings);
    let mut sender = Client::tcp(daemon.address(0)).watching(r#"{"class":"WATCH"}"#);
    sender.send(&rate("imu0", 0, 0.5));
    sender.next_of("ATT");
    let (mut viewer, _) = Viewer::connect(daemon.address(1), "foxglove.sdk.v1");
    let channels = viewer.text("advertise")["channels"].clone();
    assert_eq!(channels.as_array().unwrap().len(), 1, "{channels}");
    assert_eq!(channels[0]["topic"], "imu0/data");
}

#[test]
fn a_new_subscription_gets_the_last_message_of_its_channel_at_once() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut sender = Client::tcp(daemon.address(0)).watching(r#"{"class":"WATCH"}"#);
    for (id, until) in [("ended", 4), ("imu0", 7)] {
        for n in 0..until {
            sender.send(&rate(id, n, 0.5));
            sender.next_of("ATT");
        }
    }
    let (mut viewer, _) = Viewer::connect(daemon.address(1), "foxglove.sdk.v1");
    let channels = viewer.text("advertise")["channels"].clone();
    let of = |topic: &str| {
        let known = channels.as_array().unwrap().iter();
        let found = known.clone().find(|c| c["topic"] == topic);
        found.expect("no such topic")["id"].clone()
    };
    // The stamp in the header is the first of an Imu, behind the encapsulation.
    let second = |frame: &[u8]| i32::from_le_bytes(frame[17..21].try_into().unwrap());
    let nanos = |frame: &[u8]| u32::from_le_bytes(frame[21..25].try_into().unwrap());
    let subscribe = |viewer: &mut Viewer, id: u32, channel: &Value| {
        viewer
            .send(&json!({"op": "subscribe", "subscriptions": [{"id": id, "channelId": channel}]}));
    };
    subscribe(&mut viewer, 7, &of("ended/data"));
    let frame = viewer.binary(1);
    assert_eq!(frame[1..5], 7u32.to_le_bytes());
    assert_eq!((second(&frame), nanos(&frame)), (1_700_000_000, 3_000_000));
    // Of the transforms one of each sensor, and of what was subscribed to before nothing again.
    subscribe(&mut viewer, 8, &of("/tf"));
    for _ in 0..2 {
        assert_eq!(viewer.binary(1)[1..5], 8u32.to_le_bytes());
    }
    subscribe(&mut viewer, 9, &of("imu0/data"));
    let frame = viewer.binary(1);
    assert_eq!((frame[1], nanos(&frame)), (9, 6_000_000));
    sender.send(&rate("imu0", 7, 0.5));
    let frame = viewer.binary(1);
    assert_eq!((frame[1], nanos(&frame)), (9, 7_000_000));
    assert_eq!(viewer.binary(1)[1..5], 8u32.to_le_bytes());
}

#[test]
fn a_token_is_asked_for_before_anything_is_said() {
    let mut settings = listening(&[WS]);
    settings.hub.token = Some(strapd::serve::guard::admission::Token::new(
        "0123456789abcdef",
    ));
    let daemon = Daemon::start(settings);
    let stream = TcpStream::connect(daemon.address(0)).unwrap();
    let mut request = format!("ws://{}/", daemon.address(0))
        .into_client_request()
        .unwrap();
    let headers = request.headers_mut();
    headers.insert("Sec-WebSocket-Protocol", "foxglove.sdk.v1".parse().unwrap());
    let refused = tungstenite::client(request, stream)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("401"), "{refused}");
}

#[test]
fn a_viewer_that_comes_before_the_first_sample_can_control_once_it_is_there() {
    let settings = listening(&[WS]);
    let playback = Playback::new("flight.mcap", Some(1.0), true);
    let server = Arc::new(PlaybackServer::start(settings, playback, true, false).unwrap());
    let Some(Listen::WebSocket(address)) = server.addresses().first() else {
        unreachable!()
    };
    let (mut viewer, _) = Viewer::connect(*address, "foxglove.sdk.v1");
    assert_eq!(viewer.text("serverInfo")["capabilities"], json!(["time"]));
    let run = server.clone();
    let run = std::thread::spawn(move || {
        run.length(2.0);
        run.turn(1, &|_| Nanos(5_000_000_000)).is_none()
    });
    let info = viewer.text("serverInfo");
    assert_eq!(info["capabilities"], json!(["time", "playbackControl"]));
    assert_eq!(info["dataStartTime"], json!({"sec": 5, "nsec": 0}));
    assert_eq!(info["dataEndTime"], json!({"sec": 7, "nsec": 0}));
    server.playback().stop();
    assert!(run.join().unwrap(), "it was stopped");
}

#[test]
fn a_viewer_plays_pauses_and_seeks_and_a_seek_backward_is_another_session() {
    let process = paused(&format!("replay {LOG} --loop"), &[WS]);
    let mut plain = Client::web(process.address(0));
    while plain.next_of("PLAYBACK")["start"].is_null() {
        plain.send(r#"{"class":"PLAYBACK","action":"pause"}"#);
    }
    let (mut viewer, _) = Viewer::connect(process.address(0), "foxglove.sdk.v1");
    let info = viewer.text("serverInfo");
    assert_eq!(info["capabilities"], json!(["time", "playbackControl"]));
    let start = &info["dataStartTime"];
    let start = start["sec"].as_u64().unwrap() * 1_000_000_000 + start["nsec"].as_u64().unwrap();
    viewer.send(&json!({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": 2}, {"id": 6, "channelId": 1}]}));
    let state = viewer.control(1, 0.0, Some(start + 4_000_000_000));
    assert_eq!((state[1], state[14]), (1, 1), "paused, and it did seek");
    assert_eq!(time_of(&viewer.binary(1), 5), start + 4_000_000_000);
    let state = viewer.control(0, 5.0, None);
    assert_eq!((state[1], &state[10..14]), (0, &5f32.to_le_bytes()[..]));
    assert!(time_of(&viewer.binary(2), 1) >= start + 4_000_000_000);
    viewer.control(1, 5.0, Some(start + 1_000_000_000));
    assert_ne!(viewer.text("serverInfo")["sessionId"], info["sessionId"]);
    loop {
        if time_of(&viewer.binary(1), 5) == start + 1_000_000_000 {
            break;
        }
    }
}

/// The bits of a number: `1` is what `1.0` is called in JavaScript, and `0` is `-0` there too.
fn number(value: &Value) -> u64 {
    (value.as_f64().unwrap() + 0.0).to_bits()
}

#[test]
#[cfg_attr(
    not(has_foxglove),
    ignore = "needs node, and what .ci/run installs in target/foxglove"
)]
fn foxgloves_own_client_reads_every_attitude_as_it_stands_in_the_lines() {
    // The client Foxglove publishes, from npm.
    let modules = concat!(env!("CARGO_MANIFEST_DIR"), "/target/foxglove/node_modules");
    let expected = lines_of(&format!("replay {LOG}"));
    let process = paused(&format!("replay {LOG}"), &[WS]);
    let output = Command::new("node")
        .arg(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/tests/oracles/foxglove_client.mjs"
        ))
        .arg(format!("ws://{}/", process.address(0)))
        .arg(expected.len().to_string())
        .env("NODE_PATH", modules)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let said: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let info = &said[0];
    assert_eq!(info["protocol"], "foxglove.websocket.v1");
    assert_eq!(info["capabilities"], json!(["time"]));
    let status = said.iter().find(|v| v["op"] == "status");
    let status = status.unwrap_or_else(|| {
        let rest: Vec<_> = said.iter().filter(|v| !v["op"].is_null()).collect();
        unreachable!("no answer to getParameters: {rest:?}")
    });
    assert!(
        status["message"]
            .as_str()
            .unwrap()
            .contains("getParameters")
    );
    assert!(said.last().unwrap()["times"].as_u64().unwrap() > 100);

    let on = |topic: &str| -> Vec<&Value> { said.iter().filter(|v| v["topic"] == topic).collect() };
    let (imu, tf) = (on("/imu/data/attitude"), on("/tf"));
    assert_eq!(imu.len(), expected.len());
    // The last transform may come behind the last attitude.
    assert!(tf.len() + 1 >= imu.len());
    for (n, (found, line)) in imu.iter().zip(&expected).enumerate() {
        let line: Value = serde_json::from_str(line).unwrap();
        let message = &found["message"];
        for axis in ["w", "x", "y", "z"] {
            assert_eq!(
                number(&message["orientation"][axis]),
                number(&line["q"][axis]),
                "{n}"
            );
        }
        for (n, axis) in ["x", "y", "z"].iter().enumerate() {
            assert_eq!(
                number(&message["angular_velocity"][axis]),
                number(&line["rate"][n])
            );
        }
        let stamp = &message["header"]["stamp"];
        assert_eq!(stamp["sec"], line["stamp"]["sec"]);
        assert_eq!(
            stamp["nanosec"].as_u64().or(stamp["nsec"].as_u64()),
            line["stamp"]["nsec"].as_u64()
        );
        if let Some(tf) = tf.get(n) {
            let rotation = &tf["message"]["transforms"][0]["transform"]["rotation"];
            assert_eq!(rotation, &message["orientation"]);
        }
    }
}
