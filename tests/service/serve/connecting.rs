//! Sources: the daemon connects out, and again and again.

use super::client::{Client, get, rate};
use super::daemon::{Daemon, PATIENCE, TCP, WS, eventually, listening, strapd};
use super::packed::object;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::Command;
use std::sync::mpsc::{Receiver, channel};
use strapd::serve::edge::source::Endpoint;
use tungstenite::Message;
use tungstenite::handshake::server::{Request, Response};

fn listen() -> (TcpListener, SocketAddr) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    (listener, address)
}

/// A daemon with these sources.
fn fed_by(sources: &[String]) -> Daemon {
    let mut settings = listening(&[TCP, WS]);
    settings.sources = sources
        .iter()
        .map(|s| Endpoint::parse(s).unwrap())
        .collect();
    Daemon::start(settings)
}

fn accept(listener: &TcpListener) -> TcpStream {
    let (stream, _) = listener.accept().unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

fn outgoing(daemon: &Daemon, n: usize) -> Value {
    daemon.status()["outgoing"][n].clone()
}

/// Serves one WebSocket connection: the path asked for comes first, then these messages are sent, and
/// it stays open until the daemon goes.
fn phone(listener: TcpListener, messages: Vec<String>) -> Receiver<String> {
    let (tell, told) = channel();
    std::thread::spawn(move || {
        let stream = accept(&listener);
        #[allow(clippy::result_large_err)]
        let callback = |request: &Request, response: Response| {
            tell.send(request.uri().to_string()).unwrap();
            Ok(response)
        };
        let mut socket = tungstenite::accept_hdr(stream, callback).unwrap();
        for message in messages {
            socket.send(Message::text(message)).unwrap();
        }
        while socket.read().is_ok() {}
    });
    told
}

#[test]
fn a_source_that_comes_goes_and_comes_again_is_one_sensor_with_a_gap() {
    // Nobody listens at first: the port is reserved and let go.
    let (listener, address) = listen();
    drop(listener);
    let daemon = fed_by(&[format!("tcp://{address}?id=mine")]);
    eventually("a refused attempt is told", || {
        let state = outgoing(&daemon, 0);
        assert_eq!(state["connected"], false);
        state["attempts"].as_u64().unwrap() >= 2
            && state["last_error"]
                .as_str()
                .unwrap_or("")
                .contains("refused")
    });
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let listener = TcpListener::bind(address).unwrap();
    let mut sender = accept(&listener);
    for n in 0..10 {
        writeln!(sender, "{}", rate("theirs", n, 1.0)).unwrap();
    }
    for n in 0..10 {
        let att = watcher.object("ATT");
        assert_eq!((&att["id"], &att["seq"]), (&json!("mine"), &json!(n)));
    }
    assert_eq!(outgoing(&daemon, 0)["connected"], true);
    drop(sender);
    let mut sender = accept(&listener);
    // Two seconds later, as the stamps say: too long to bridge.
    writeln!(sender, "{}", rate("theirs", 2010, 1.0)).unwrap();
    writeln!(sender, "{}", rate("theirs", 2011, 1.0)).unwrap();
    let att = watcher.object("ATT");
    assert_eq!(att["seq"], 10);
    assert_eq!(att["reset"], 1, "held across the gap: {att}");
    watcher.object("ATT");
    let status = daemon.status();
    let state = &status["outgoing"][0];
    assert_eq!(state["connections"], 2, "{state}");
    assert_eq!(state["uri"], format!("tcp://{address}?id=mine"));
    let sensor = &status["sources"][0];
    assert_eq!(
        (&sensor["id"], &sensor["gaps"]),
        (&json!("mine"), &json!(1))
    );
    let (code, metrics) = get(daemon.address(1), "/metrics", &[("Host", "localhost")]);
    assert_eq!(code, 200);
    let line = format!("strapd_outgoing_connections_total{{uri=\"tcp://{address}?id=mine\"}} 2");
    assert!(metrics.contains(&line), "{metrics}");
    assert!(daemon.stop());
}

#[test]
fn a_peer_that_says_nothing_stays_connected_beyond_every_limit_on_clients() {
    let (listener, address) = listen();
    let mut settings = listening(&[TCP]);
    settings.sources = vec![Endpoint::parse(&format!("tcp://{address}")).unwrap()];
    settings.hub.limits.first_line = std::time::Duration::from_millis(20);
    settings.hub.limits.no_progress = std::time::Duration::from_millis(20);
    let daemon = Daemon::start(settings);
    let mut sender = accept(&listener);
    // A client would have been closed by now, as this one is.
    let mut client = Client::tcp(daemon.address(0));
    assert_eq!(client.rest().last().unwrap()["code"], "first_line_timeout");
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    writeln!(sender, "{}", rate("late", 0, 1.0)).unwrap();
    assert_eq!(watcher.object("ATT")["id"], "late");
    assert_eq!(outgoing(&daemon, 0)["connections"], 1);
}

#[test]
fn a_phone_is_a_gyro_with_a_clock_of_its_own() {
    let (listener, address) = listen();
    // As SensorServer sends them: nanoseconds since the phone was started, no `type`.
    let messages = (0..5)
        .map(|n| {
            format!(
                "{{\"values\":[0.5,0.0,0.0],\"timestamp\":{},\"accuracy\":3}}",
                3_925_657_519_043_709_u64 + n * 10_000_000
            )
        })
        .collect();
    let asked = phone(listener, messages);
    let daemon = fed_by(&[format!(
        "ws://{address}/sensor/connect?type=android.sensor.gyroscope&id=phone"
    )]);
    assert_eq!(
        asked.recv_timeout(PATIENCE).unwrap(),
        "/sensor/connect?type=android.sensor.gyroscope"
    );
    eventually("five samples", || {
        daemon.status()["sources"][0]["samples"] == 5
    });
    let sensor = &daemon.status()["sources"][0];
    assert_eq!(sensor["id"], "phone");
    assert_eq!(sensor["lost"], 0, "{sensor}");
    assert_eq!(
        sensor["last_stamp"],
        json!({"sec": 3_925_657, "nsec": 559_043_709})
    );
    assert!(daemon.stop());
}

#[test]
fn of_several_sensors_of_a_phone_the_gyro_is_taken_and_no_two_are_mixed() {
    let (listener, address) = listen();
    let event = |sensor: &str, n: u64, values: &str| {
        format!(
            "{{\"type\":\"android.sensor.{sensor}\",\"values\":[{values}],\"timestamp\":{},\"accuracy\":3}}",
            1_000_000_000 + n * 10_000_000
        )
    };
    let mut messages = Vec::new();
    for n in 0..50 {
        // More of others in a row than bad lines are borne.
        messages.extend((0..30).map(|_| event("accelerometer", n, "0,0,9.8")));
        messages.push(event("gyroscope_uncalibrated", n, "0.5,0,0,0.01,0.01,0.01"));
        messages.push(event("gyroscope", n, "0.4,0,0"));
    }
    let asked = phone(listener, messages);
    let daemon = fed_by(&[format!(
        "ws://{address}/sensors/connect?types=[\"android.sensor.gyroscope\",\"android.sensor.accelerometer\"]"
    )]);
    assert_eq!(
        asked.recv_timeout(PATIENCE).unwrap(),
        "/sensors/connect?types=%5B%22android.sensor.gyroscope%22%2C%22android.sensor.accelerometer%22%5D"
    );
    eventually("all were taken or refused", || {
        let status = daemon.status();
        let counters = &status["counters"];
        counters["samples"] == 50 && counters["samples_refused"] == 50
    });
    let status = daemon.status();
    assert_eq!(status["sources"].as_array().unwrap().len(), 1);
    assert_eq!(status["sources"][0]["attitudes"], 50, "{status}");
    let state = &status["outgoing"][0];
    assert_eq!(
        (&state["connected"], &state["connections"]),
        (&json!(true), &json!(1))
    );
    let why = state["last_error"].as_str().unwrap();
    assert!(why.contains("several_sensors"), "{why}");
}

/// An attitude without the numbers that [`numbers`] gives.
fn without_rate(att: &Value) -> Value {
    let mut att = att.clone();
    for key in ["q", "rate", "sigma_deg"] {
        att[key] = Value::Null;
    }
    att
}

/// Quaternion and rate of an attitude.
fn numbers(att: &Value) -> Vec<f64> {
    let q = ["w", "x", "y", "z"].map(|name| &att["q"][name]);
    let rate = att["rate"].as_array().unwrap();
    q.into_iter()
        .chain(rate)
        .map(|v| v.as_f64().unwrap())
        .collect()
}

#[test]
fn a_daemon_behind_a_daemon_integrates_the_same_rates_to_the_same_attitude() {
    for scheme in ["tcp", "ws"] {
        let first = Daemon::start(listening(&[TCP, WS]));
        let address = first.address(usize::from(scheme == "ws"));
        let second = fed_by(&[format!("{scheme}://{address}")]);
        eventually("the second watches the first", || {
            first.status()["clients"]
                .as_array()
                .unwrap()
                .iter()
                .any(|c| c["watching"] == true)
        });
        let watch = "{\"class\":\"WATCH\"}";
        let mut near = Client::tcp(first.address(0)).watching(watch);
        let mut far = Client::tcp(second.address(0)).watching(watch);
        let mut sender = Client::tcp(first.address(0));
        for n in 0..100 {
            sender.send(&rate("imu0", n, (n as f64 * 0.1).sin()));
            let (a, b) = (near.object("ATT"), far.object("ATT"));
            assert_eq!(without_rate(&a), without_rate(&b));
            for (near, far) in numbers(&a).into_iter().zip(numbers(&b)) {
                // A mean rate is told by its angle and its interval, which rounds it once more at each daemon.
                assert!((near - far).abs() < 1e-14, "{a} {b}");
            }
        }
        assert!(second.stop());
    }
}

/// A simulation hands out its samples; what it says besides is neither a sample nor a bad line.
#[test]
fn of_a_simulation_the_samples_are_taken_and_not_its_truth() {
    let (listener, address) = listen();
    drop(listener);
    let mut simulation = Command::new(strapd())
        .args([
            "-q",
            "simulate",
            "top",
            "--rate-hz",
            "200",
            "--duration",
            "600",
            "--speed",
            "1",
        ])
        .args(["-o", &format!("tcp-listen://{address}")])
        .spawn()
        .unwrap();
    let daemon = fed_by(&[format!("tcp://{address}?id=top")]);
    eventually("two seconds of it", || {
        daemon.status()["sources"][0]["samples"].as_u64() >= Some(400)
    });
    let status = daemon.status();
    simulation.kill().unwrap();
    simulation.wait().unwrap();
    assert_eq!(status["sources"].as_array().unwrap().len(), 1, "{status}");
    let sensor = &status["sources"][0];
    assert_eq!(
        (&sensor["id"], &sensor["lost"]),
        (&json!("top"), &json!(0)),
        "{sensor}"
    );
    assert_eq!(sensor["rate_hz"], 200.0);
    assert_eq!(sensor["missing"], 0);
    assert_eq!(status["counters"]["faults"], 0);
    eventually("its end is told", || {
        let state = outgoing(&daemon, 0);
        state["connected"] == false && state["last_error"].is_string()
    });
}

#[test]
fn a_daemon_never_listens_to_itself() {
    let (listener, address) = listen();
    drop(listener);
    let mut settings = listening(&[&format!("tcp-listen://{address}")]);
    settings.sources = vec![Endpoint::parse(&format!("tcp://{address}")).unwrap()];
    let daemon = Daemon::start(settings);
    eventually("it has noticed", || {
        outgoing(&daemon, 0)["last_error"]
            .as_str()
            .is_some_and(|e| e.contains("this daemon itself"))
    });
}

#[test]
fn a_source_that_sends_nonsense_is_left_and_tried_again() {
    let (listener, address) = listen();
    let daemon = fed_by(&[format!("tcp://{address}")]);
    let mut sender = accept(&listener);
    let _ = sender.write_all("not json\n".repeat(300).as_bytes());
    // It may ask and command what it likes; nothing is said to it.
    let mut again = accept(&listener);
    again
        .write_all(
            b"{\"class\":\"POLL\"}\n{\"class\":\"WATCH\"}\n{\"class\":\"AUTH\",\"token\":\"x\"}\n",
        )
        .unwrap();
    writeln!(again, "{}", rate("good", 0, 1.0)).unwrap();
    eventually("it is heard again", || {
        daemon.status()["counters"]["samples"] == 1
    });
    let state = outgoing(&daemon, 0);
    assert_eq!(state["connections"], 2);
    let why = state["last_error"].as_str().unwrap();
    assert!(why.contains("neither objects nor rows"), "{why}");
    assert!(daemon.stop());
    let mut line = String::new();
    assert_eq!(
        BufReader::new(again).read_line(&mut line).unwrap(),
        0,
        "{line}"
    );
}

#[test]
fn a_token_is_shown_to_a_daemon_that_asks_for_one() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("token");
    std::fs::write(&path, "0123456789abcdef\n").unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
    let mut settings = listening(&[TCP, WS]);
    settings.hub.token = Some(strapd::serve::guard::admission::Token::new(
        "0123456789abcdef",
    ));
    let first = Daemon::start(settings);
    for uri in [
        format!("tcp://{}", first.address(0)),
        format!("ws://{}", first.address(1)),
    ] {
        let second = fed_by(&[format!("{uri}?token-file={}", path.display())]);
        eventually("it is let in and watches", || {
            first.status()["clients"]
                .as_array()
                .unwrap()
                .iter()
                .any(|c| c["watching"] == true)
        });
        assert!(second.stop());
    }
}

#[test]
fn a_file_names_sources_and_their_sensors() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("strapd.toml");
    let ask = |action: &str, text: &str| {
        std::fs::write(&path, text).unwrap();
        let output = Command::new(strapd())
            .args(["config", action])
            .arg(&path)
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned()
            + &String::from_utf8_lossy(&output.stderr);
        (output.status.code(), text)
    };
    let table = "[source.\"my phone\"]\nuri = \"ws://phone:8080/sensor/connect?type=android.sensor.gyroscope\"\n";
    let (code, shown) = ask("show", table);
    assert_eq!(code, Some(0), "{shown}");
    let uri = "ws://phone:8080/sensor/connect?type=android.sensor.gyroscope&id=my%20phone";
    assert!(shown.contains(&format!("source = [\"{uri}\"]")), "{shown}");
    assert_eq!(Endpoint::parse(uri).unwrap().id(), Some("my phone"));
    assert_eq!(ask("check", table).0, Some(0));
    assert_eq!(ask("check", "source = [\"tcp://a:1\", \"-\"]\n").0, Some(0));
    for (text, part) in [
        ("source = [\"tcp://a\"]\n", "a port is needed"),
        ("source = 5\n", "[source.ID]"),
        ("[source.a]\nurl = \"x\"\n", "uri is missing"),
        (
            "[source.a]\nuri = \"tcp://a:1\"\nrate = 5\n",
            "line 3: [source.a] unknown key `rate`",
        ),
    ] {
        let (code, said) = ask("check", text);
        assert_eq!(code, Some(2), "{text}: {said}");
        assert!(said.contains(part), "{text}: {said}");
    }
}

#[test]
fn a_source_that_names_no_packed_stream_is_complained_of_and_left() {
    let (listener, address) = listen();
    let daemon = fed_by(&[format!("tcp://{address}")]);
    let mut stream = accept(&listener);
    let bytes = object(1, 1, &[0; 40]).repeat(30);
    // So that it is no stranger who begins with anything.
    stream
        .write_all(
            &[
                b"{\"class\":\"PACKED\",\"stream\":2,\"id\":\"b\"}\n",
                &bytes[..],
            ]
            .concat(),
        )
        .unwrap();
    eventually("the complaint", || {
        let said = daemon.status()["outgoing"][0]["last_error"].to_string();
        said.contains("too many bad lines") || said.contains("unknown_stream")
    });
    let mut again = accept(&listener);
    again.write_all(rate("a", 0, 1.0).as_bytes()).unwrap();
    again.write_all(b"\n").unwrap();
    eventually("the sample of the next", || {
        daemon.status()["sources"][0]["samples"] == 1
    });
}

/// Checks that what a `PACKED` line states of a source's samples holds, attitudes are the samples that their lines
/// would be, and of two sensors that would be one the second is refused.
#[test]
fn a_source_is_read_packed_as_its_lines_are() {
    let head = [
        r#"{"class":"PACKED","stream":1,"id":"a","gyro_unit":"deg"}"#,
        r#"{"class":"PACKED","stream":2,"id":"b","rotates":"sensor_to_world","world":"enu","body":"flu"}"#,
        r#"{"class":"PACKED","stream":3,"id":"c"}"#,
    ];
    let head = head.map(|line| format!("{line}\n")).concat().into_bytes();
    let packed = |stream: u32, n: u64| {
        let stamp = 1_700_000_000_000_000_000_u64 + n * 10_000_000;
        let [seq, stamp] = [n, stamp].map(u64::to_le_bytes);
        let floats = |values: &[f64]| {
            values
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect::<Vec<_>>()
        };
        let body = match stream {
            2 => [
                floats(&[1.0, 0.0, 0.0, 0.0, 0.5, 0.25, -0.125]),
                vec![0; 32],
            ]
            .concat(),
            _ => floats(&[10.0, -20.0, 30.0]),
        };
        object(
            if stream == 2 { 2 } else { 1 },
            stream,
            &[&seq[..], &stamp[..], &body[..]].concat(),
        )
    };
    let blocks = |streams: &[u32]| {
        let of_all =
            (0..50).flat_map(|n| streams.iter().flat_map(move |stream| packed(*stream, n)));
        [head.clone(), of_all.collect()].concat()
    };
    let (listener, address) = listen();
    let daemon = fed_by(&[format!("tcp://{address}")]);
    let mut stream = accept(&listener);
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    stream.write_all(&blocks(&[1, 2])).unwrap();
    for n in 0..50 {
        for (id, rate) in [
            (
                "a",
                [10.0, -20.0, 30.0].map(|v: f64| v * (std::f64::consts::PI / 180.0)),
            ),
            ("b", [0.5, 0.25, -0.125]),
        ] {
            let att = watcher.object("ATT");
            assert_eq!((&att["id"], &att["seq"]), (&json!(id), &json!(n)));
            if n > 0 {
                assert_eq!(att["rate"], json!(rate), "{att}");
            }
        }
    }
    assert_eq!(daemon.status()["counters"]["faults"], 0);

    let (listener, address) = listen();
    let daemon = fed_by(&[format!("tcp://{address}?id=mine")]);
    let mut stream = accept(&listener);
    stream.write_all(&blocks(&[1, 3])).unwrap();
    eventually("the samples of one", || {
        daemon.status()["sources"][0]["samples"] == 50
    });
    eventually("the other is told of", || {
        let said = daemon.status()["outgoing"][0]["last_error"].to_string();
        said.contains("several_sensors")
    });
    let status = daemon.status();
    assert_eq!(status["sources"].as_array().unwrap().len(), 1, "{status}");
    assert_eq!(status["sources"][0]["id"], "mine");
    assert_eq!(
        status["outgoing"][0]["connections"], 1,
        "it is not left for it: {status}"
    );
}

/// More of them than one connection may send: those there is a place for go on, of the others it is said, and the
/// source is not left for it.
#[test]
fn a_source_of_more_sensors_than_have_a_place_is_kept_for_those_that_have_one() {
    let (listener, address) = listen();
    let daemon = fed_by(&[format!("tcp://{address}")]);
    let mut stream = accept(&listener);
    for round in 0..3_u64 {
        let mut block = Vec::new();
        for number in 0..300_u32 {
            if round == 0 {
                let line =
                    format!("{{\"class\":\"PACKED\",\"stream\":{number},\"id\":\"s{number}\"}}\n");
                block.extend(line.into_bytes());
            }
            let stamp = 1_700_000_000_000_000_000 + round * 10_000_000;
            let body = [
                round.to_le_bytes(),
                stamp.to_le_bytes(),
                [0; 8],
                [0; 8],
                [0; 8],
            ];
            block.extend(object(1, number, &body.concat()));
        }
        stream.write_all(&block).unwrap();
    }
    eventually("the samples of 256", || {
        daemon.status()["counters"]["samples"] == 3 * 256
    });
    let status = daemon.status();
    assert_eq!(status["sources"].as_array().unwrap().len(), 256);
    assert_eq!(status["counters"]["samples_refused"], 3 * 44);
    let state = &status["outgoing"][0];
    assert_eq!(
        (&state["connected"], &state["connections"]),
        (&json!(true), &json!(1))
    );
    let why = state["last_error"].as_str().unwrap();
    assert!(why.contains("too_many_sensors"), "{why}");
}
