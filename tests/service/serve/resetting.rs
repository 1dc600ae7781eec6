//! `RESET`: the attitude begins anew with the next sample, what was learned stays; and only who may send a
//! sensor's samples, or the daemon's own page, may ask for it.

use super::aiding::{aided, line, roll};
use super::client::{Client, ask, rate};
use super::daemon::{Daemon, Process, TCP, WS, eventually, listening};
use super::runs::{Fed, as_first};
use serde_json::{Value, json};
use std::net::{SocketAddr, TcpStream};
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::guard::admission::Token;
use strapd_attitude::estimate::{Bias, EstimationSettings, Initial};
use strapd_attitude::quaternion::Quaternion;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

const SECRET: &str = "correct horse battery";
const RESET: &str = "{\"class\":\"RESET\",\"id\":\"imu0\"}";

fn with(init: &str) -> String {
    format!("{{\"class\":\"RESET\",\"id\":\"imu0\",\"init\":\"{init}\"}}")
}

fn read(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn is_reset(attitude: &Value) -> bool {
    let status = attitude["status"].as_array().unwrap();
    status.iter().any(|s| s == "reset")
}

/// Heading of an attitude, degrees.
fn yaw(attitude: &str) -> f64 {
    let value = read(attitude);
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| value["q"][c].as_f64().unwrap());
    let (sin, cos) = (2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    sin.atan2(cos).to_degrees()
}

/// Status of the one sensor of a daemon without sockets.
fn source(daemon: &Fed) -> Value {
    let mut status: Value = serde_json::from_slice(&daemon.hub.status()).unwrap();
    status["sources"][0].take()
}

/// Lines of a gyro alone that turns about everything, at 100 Hz.
fn turning(n: u64) -> String {
    let t = n as f64 * 0.01;
    format!(
        "{{\"id\":\"imu0\",\"sample_kind\":\"rate\",\"stamp_ns\":{},\"gyro\":[{},{},0.5]}}",
        1_700_000_000_000_000_000 + n * 10_000_000,
        (3.0 * t).sin(),
        2.0 * (2.0 * t).cos()
    )
}

#[test]
fn after_a_reset_a_gyro_alone_is_one_that_begins_with_that_attitude() {
    let q = [0.5, -0.5, 0.5, 0.5];
    for (asked, initial) in [
        (RESET.to_owned(), Initial::Identity),
        (
            with("q=0.5,-0.5,0.5,0.5"),
            Initial::Given(Quaternion::assume_unit(q)),
        ),
    ] {
        let mut daemon = Fed::of(&EstimationSettings::default());
        daemon.lines((0..500).map(turning));
        // By who connects later, too, where nobody sends the sensor.
        let got = daemon.lines(std::iter::once(asked).chain((500..900).map(turning)));
        let expected = Fed::of(&EstimationSettings {
            initial,
            ..EstimationSettings::default()
        })
        .lines((500..900).map(turning));
        assert_eq!(got.attitudes.len(), 400);
        for (n, (got, expected)) in got.attitudes.iter().zip(&expected.attitudes).enumerate() {
            assert_eq!(as_first(got), as_first(expected), "{n}");
            let got = read(got);
            assert_eq!(got["reset"], 1, "{got}");
            assert_eq!(is_reset(&got), n == 0, "said once: {got}");
        }
        let said: Vec<_> = got.said.iter().map(|v| &v["class"]).collect();
        assert_eq!(said, ["RESET"], "{:?}", got.said);
        assert_eq!(source(&daemon)["resets"], 1);
        assert_eq!(source(&daemon)["new_runs"], 0);
    }
}

#[test]
fn levelled_anew_an_aided_attitude_is_level_at_once_and_what_was_learned_is_kept() {
    let mut daemon = Fed::of(&aided());
    // Its heading has become 90 degrees, which nothing but a reset takes away.
    let first = (0..5).map(line).chain([with("rpy=17.2,0,90")]);
    let before = daemon.lines(first.chain((5..2000).map(line)));
    let heading = yaw(before.attitudes.last().unwrap());
    assert!((heading - 90.0).abs() < 1.0, "{heading}");
    let learned = source(&daemon)["aid"].clone();
    let after = daemon.lines(std::iter::once(with("gravity")).chain((2000..2020).map(line)));
    let first = read(&after.attitudes[0]);
    assert_eq!((&first["reset"], is_reset(&first)), (&json!(2), true));
    let truth = |n: u64| (0.3 + 0.2 * (0.9 * n as f64 * 0.01).sin()).to_degrees();
    for (n, attitude) in (2000..).zip(&after.attitudes) {
        let (tilt, heading) = (roll(attitude) - truth(n), yaw(attitude));
        assert!(
            tilt.abs() < 0.2 && heading.abs() < 0.1,
            "{n} {tilt} {heading}"
        );
    }
    // The attitude is not known as well as it was, the sensor is.
    let sigma = |attitude: &Value| attitude["sigma_deg"][0].as_f64().unwrap();
    let last = read(before.attitudes.last().unwrap());
    assert!(sigma(&first) > 3.0 * sigma(&last), "{first} {last}");
    let now = source(&daemon)["aid"].clone();
    for (what, most) in [("learned", 1e-4), ("sigma", 1e-4)] {
        for axis in 0..3 {
            let of = |aid: &Value| aid[what]["gyro_bias_rad_s"][axis].as_f64().unwrap();
            let changed = of(&now) - of(&learned);
            assert!(changed.abs() < most, "{what} {axis}: {changed}");
        }
    }
    let bias = learned["learned"]["gyro_bias_rad_s"][0].as_f64().unwrap();
    assert!((bias.to_degrees() - 0.5).abs() < 0.1, "{bias}");
}

/// The same body, after three seconds shaken along its y by up to 4 m/s^2: one specific force levels it 20 degrees wrong.
fn shaken(n: u64) -> String {
    let mut sample = read(&line(n));
    let shakes = if n < 300 { 0.0 } else { 4.0 };
    let y = sample["accel"][1].as_f64().unwrap() + shakes * (9.0 * n as f64 * 0.01).cos();
    sample["accel"][1] = y.into();
    sample.to_string()
}

/// A `RESET` to a heading, degrees.
fn to(heading: &str) -> String {
    format!("{{\"class\":\"RESET\",\"id\":\"imu0\",\"heading\":{heading}}}")
}

#[test]
fn a_reset_turns_the_heading_of_a_moving_body_and_leaves_its_tilt_as_it_is() {
    let truth = |n: u64| (0.3 + 0.2 * (0.9 * n as f64 * 0.01).sin()).to_degrees();
    // Where one specific force would level it worst.
    let at = 2030;
    let without = {
        let mut daemon = Fed::of(&aided());
        daemon.lines((0..at + 100).map(shaken)).attitudes
    };
    for (asked, heading) in [
        (RESET.to_owned(), 0.0),
        (to("-120.5"), -120.5),
        (to("180"), 180.0),
    ] {
        let mut daemon = Fed::of(&aided());
        let before = daemon.lines((0..at).map(shaken));
        let after = daemon.lines(std::iter::once(asked).chain((at..at + 100).map(shaken)));
        assert_eq!(before.attitudes, without[..at as usize]);
        assert_eq!(after.codes("ERROR"), [] as [&str; 0]);
        assert_eq!(source(&daemon)["resets"], 1);
        for (n, (got, other)) in after
            .attitudes
            .iter()
            .zip(&without[at as usize..])
            .enumerate()
        {
            // Roll is about an axis of the body: the tilt of the one that was left alone.
            assert!((roll(got) - roll(other)).abs() < 1e-9, "{n}: {got} {other}");
            assert!((roll(got) - truth(at + n as u64)).abs() < 2.0, "{n}: {got}");
            let (got, other) = (read(got), read(other));
            assert_eq!(
                (&got["reset"], is_reset(&got)),
                (&json!(1), n == 0),
                "{got}"
            );
            for axis in 0..2 {
                let of = |one: &Value| one["sigma_deg"][axis].as_f64().unwrap();
                assert!(of(&got) <= 1.001 * of(&other), "{n}: {got} {other}");
            }
        }
        let off = (yaw(&after.attitudes[0]) - heading).rem_euclid(360.0);
        assert!(off.min(360.0 - off) < 1e-6, "{off}");
    }
    // By the next force, as it is asked for, it is not level.
    let mut daemon = Fed::of(&aided());
    daemon.lines((0..at).map(shaken));
    let after = daemon.lines(std::iter::once(with("gravity")).chain((at..at + 1).map(shaken)));
    let off = roll(&after.attitudes[0]) - truth(at);
    assert!(off.abs() > 5.0, "{off}");
}

#[test]
fn a_heading_is_refused_where_there_is_no_vertical_or_no_number() {
    let mut daemon = Fed::of(&EstimationSettings::default());
    let asked = [to("90")];
    let got = daemon.lines(
        (0..100)
            .map(turning)
            .chain(asked)
            .chain((100..101).map(turning)),
    );
    assert_eq!(got.codes("ERROR"), ["bad_reset"], "{:?}", got.said);
    let mut daemon = Fed::of(&aided());
    daemon.lines((0..100).map(line));
    let both = "{\"class\":\"RESET\",\"id\":\"imu0\",\"heading\":1,\"init\":\"gravity\"}";
    let asked = [to("1e999"), to("\"north\""), to("[0]"), both.to_owned()];
    let got = daemon.lines(asked.into_iter().chain((100..200).map(line)));
    assert_eq!(got.codes("ERROR"), ["bad_reset"; 4], "{:?}", got.said);
    assert_eq!(read(got.attitudes.last().unwrap())["reset"], 0);
}

#[test]
fn a_heading_that_was_set_is_saved_and_goes_on_to_the_bit() {
    let asked = [to("40")];
    let mut daemon = Fed::of(&aided());
    daemon.lines((0..300).map(line));
    let whole = daemon.lines(asked.iter().cloned().chain((300..700).map(line)));
    let mut daemon = Fed::of(&aided());
    daemon.lines((0..300).map(line));
    let mut parts = daemon.lines(asked.into_iter().chain((300..450).map(line)));
    let mut daemon = daemon.restarted(&aided());
    parts
        .attitudes
        .extend(daemon.lines((450..700).map(line)).attitudes);
    assert_eq!(parts.attitudes.len(), 400);
    assert!((yaw(&parts.attitudes[399]) - 40.0).abs() < 1.0);
    assert!(parts.attitudes == whole.attitudes);
}

#[test]
fn an_attitude_that_was_reset_is_saved_and_goes_on_to_the_bit() {
    let init = [with("rpy=10,20,30")];
    let mut daemon = Fed::of(&aided());
    daemon.lines((0..300).map(line));
    let whole = daemon.lines(init.iter().cloned().chain((300..700).map(line)));
    let mut daemon = Fed::of(&aided());
    daemon.lines((0..300).map(line));
    let mut parts = daemon.lines(init.into_iter().chain((300..450).map(line)));
    let mut daemon = daemon.restarted(&aided());
    parts
        .attitudes
        .extend(daemon.lines((450..700).map(line)).attitudes);
    assert_eq!(parts.attitudes.len(), 400);
    assert!(parts.attitudes == whole.attitudes);
}

#[test]
fn what_can_not_be_is_refused_with_words_counted_and_changes_nothing() {
    let refused = [
        (
            "{\"class\":\"RESET\",\"id\":\"imu1\"}".to_owned(),
            "unknown_sensor",
        ),
        ("{\"class\":\"RESET\"}".to_owned(), "unknown_sensor"),
        (with("gravity"), "bad_reset"),
        (with("first-orientation"), "bad_reset"),
        (with("q=1,1,0,0"), "bad_reset"),
        (with("q=NaN,0,0,0"), "bad_reset"),
        (with("rpy=1e999,0,0"), "bad_reset"),
        (with("upside\\u001b[31m down"), "bad_reset"),
        (with(&"9".repeat(60_000)), "bad_reset"),
        (
            "{\"class\":\"RESET\",\"id\":\"imu0\",\"init\":[1,0,0,0]}".to_owned(),
            "bad_reset",
        ),
    ];
    let mut daemon = Fed::of(&EstimationSettings::default());
    let expected = Fed::of(&EstimationSettings::default()).lines((0..200).map(turning));
    let asked = refused.iter().map(|(line, _)| line.clone());
    let got = daemon.lines(
        (0..100)
            .map(turning)
            .chain(asked)
            .chain((100..200).map(turning)),
    );
    let codes: Vec<&str> = refused.iter().map(|(_, code)| *code).collect();
    assert_eq!(got.codes("ERROR"), codes, "{:?}", got.said);
    for said in &got.said {
        let text = said["message"].as_str().unwrap();
        assert!(
            text.len() < 500 && !text.contains(char::is_control),
            "{text}"
        );
    }
    assert!(got.attitudes == expected.attitudes);
    assert_eq!(source(&daemon)["resets"], 0);
    let counted = daemon.hub.counters.named();
    let of = |name: &str| counted.iter().find(|c| c.name == name).unwrap().value;
    assert_eq!((of("resets"), of("resets_refused")), (0, 10));
    // None of them is ever held against who says them.
    let unknown = std::iter::repeat_n(refused[0].0.clone(), 100);
    let after = daemon.lines(unknown.chain((200..300).map(turning)));
    assert_eq!(after.attitudes.len(), 100);
}

#[test]
fn the_sensor_of_another_connection_is_not_reset_and_one_that_nobody_sends_is() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&turning(0));
    assert_eq!(watcher.object("ATT")["reset"], 0);
    for mut other in [
        Client::tcp(daemon.address(0)),
        Client::web(daemon.address(1)),
    ] {
        other.send(RESET);
        let error = other.next_of("ERROR");
        assert_eq!(
            (&error["code"], &error["id"]),
            (&json!("id_in_use"), &json!("imu0"))
        );
    }
    sender.send(&format!("{}\n{RESET}\n{}", turning(1), turning(2)));
    assert_eq!(sender.next_of("RESET")["from"], "identity");
    let resets: Vec<Value> = (0..2)
        .map(|_| watcher.object("ATT")["reset"].clone())
        .collect();
    assert_eq!(resets, [0, 1]);
    sender.shut();
    sender.rest();
    drop(sender);
    eventually("it has gone", || daemon.hub.connected() == 1);
    let mut other = Client::tcp(daemon.address(0));
    other.send(&format!("{RESET}\n{}", turning(3)));
    assert_eq!(other.next_of("RESET")["id"], "imu0");
    assert_eq!(watcher.object("ATT")["reset"], 2);
    let status = daemon.status();
    assert_eq!(status["counters"]["resets"], 2, "{status}");
    assert_eq!(status["counters"]["resets_refused"], 2, "{status}");
    assert_eq!(status["sources"][0]["resets"], 2, "{status}");
}

/// A WebSocket as a page of `origin` opens it; what the daemon says to that.
fn page(address: SocketAddr, origin: &str) -> Result<WebSocket<TcpStream>, u16> {
    let stream = TcpStream::connect(address).unwrap();
    stream
        .set_read_timeout(Some(super::daemon::PATIENCE))
        .unwrap();
    let mut request = format!("ws://{address}/ws").into_client_request().unwrap();
    let headers = request.headers_mut();
    headers.insert("Origin", origin.parse().unwrap());
    match tungstenite::client(request, stream) {
        Ok((socket, _)) => Ok(socket),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
            Err(answer.status().as_u16())
        }
        Err(other) => unreachable!("{other}"),
    }
}

/// Sends lines, and returns the code or class of the first answer but the greeting.
fn answered(socket: &mut WebSocket<TcpStream>, lines: &[&str]) -> String {
    for line in lines {
        socket.send(Message::text(*line)).unwrap();
    }
    loop {
        let Message::Text(text) = socket.read().unwrap() else {
            continue;
        };
        let said = read(text.as_str());
        match said["class"].as_str().unwrap() {
            "VERSION" => {}
            "ERROR" => return said["code"].as_str().unwrap().to_owned(),
            class => return class.to_owned(),
        }
    }
}

#[test]
fn of_pages_the_daemons_own_may_reset_and_with_a_token_only_once_it_was_shown() {
    const FRIEND: &str = "https://friend.example";
    for token in [None, Some(SECRET)] {
        let mut settings = listening(&[TCP, WS]);
        settings.hub.token = token.map(Token::new);
        settings.web.origins.push(FRIEND.to_owned());
        let daemon = Daemon::start(settings);
        let address = daemon.address(1);
        let auth = format!("{{\"class\":\"AUTH\",\"token\":\"{SECRET}\"}}");
        let shown: &[&str] = match token {
            Some(_) => &[&auth],
            None => &[],
        };
        let mut sender = Client::tcp(daemon.address(0));
        for line in shown {
            sender.send(line);
        }
        sender.send(&turning(0));
        eventually("it is there", || {
            daemon.status()["sources"][0]["samples"] == 1
        });
        for foreign in [
            "https://evil.example",
            "null",
            "http://localhost:1",
            &format!("http://{address}.evil.example"),
            &format!("ftp://{address}"),
        ] {
            assert_eq!(page(address, foreign).err(), Some(403), "{foreign}");
        }
        let asked: Vec<&str> = shown.iter().copied().chain([RESET]).collect();
        // One that is let in from elsewhere is a client as any other.
        let mut friend = page(address, FRIEND).unwrap();
        assert_eq!(answered(&mut friend, &asked), "id_in_use");
        let own = format!("http://{address}");
        if token.is_some() {
            let mut page = page(address, &own).unwrap();
            assert_eq!(answered(&mut page, &[RESET]), "unauthorised");
        }
        assert_eq!(daemon.status()["sources"][0]["resets"], 0);
        let mut page = page(address, &own).unwrap();
        assert_eq!(answered(&mut page, &asked), "RESET");
        assert_eq!(daemon.status()["sources"][0]["resets"], 1);
        // It may begin a sensor's attitude anew, and no more: its samples are another's still.
        assert_eq!(answered(&mut page, &[&turning(1)]), "id_in_use");
    }
}

#[test]
fn a_post_resets_what_its_address_sends_and_no_page_posts_one() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let address = daemon.address(1);
    let host = address.to_string();
    let post = |extra: &[(&str, &str)], target: &str, body: &str| {
        let mut headers = vec![("Host", &*host), ("Content-Type", "application/x-ndjson")];
        headers.extend(extra);
        let (status, answer) = ask(address, target, &headers, body.as_bytes());
        (
            status,
            serde_json::from_str::<Value>(&answer).unwrap_or_default(),
        )
    };
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&rate("taken", 0, 1.0));
    eventually("it is there", || {
        daemon.status()["sources"][0]["samples"] == 1
    });
    let target = "POST /samples?id=imu0";
    let body = format!("{}\n{{\"class\":\"RESET\"}}\n{}", turning(0), turning(1));
    let (status, said) = post(&[], target, &body);
    assert_eq!((status, &said["resets"]), (200, &json!(1)), "{said}");
    assert_eq!(said["samples"], 2, "{said}");
    let (status, said) = post(&[], target, "{\"class\":\"RESET\",\"id\":\"taken\"}");
    assert_eq!(
        (status, &said["code"]),
        (400, &json!("id_in_use")),
        "{said}"
    );
    let own = format!("http://{host}");
    for origin in ["https://evil.example", "null", &own] {
        assert_eq!(
            post(&[("Origin", origin)], target, RESET).0,
            403,
            "{origin}"
        );
    }
    assert_eq!(
        post(&[("Sec-Fetch-Site", "cross-site")], target, RESET).0,
        403
    );
    let sources = daemon.status()["sources"].clone();
    let of = |id: &str| {
        sources
            .as_array()
            .unwrap()
            .iter()
            .find(|s| s["id"] == id)
            .unwrap()
    };
    assert_eq!(
        (&of("imu0")["resets"], &of("imu0")["reset"]),
        (&json!(1), &json!(1))
    );
    assert_eq!(
        (&of("taken")["resets"], &of("taken")["reset"]),
        (&json!(0), &json!(0))
    );
}

#[test]
fn ten_thousand_resets_are_answered_each_and_turn_nobody_elses_attitude() {
    let daemon = Daemon::tcp();
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\",\"id\":\"b\"}");
    let stormy = {
        let mut client = Client::tcp(daemon.address(0));
        client.send(&turning(0));
        std::thread::spawn(move || {
            let mut refused = 0;
            for _ in 0..200 {
                let others = "{\"class\":\"RESET\",\"id\":\"b\"}";
                client.send(&[RESET, others].join("\n"));
                client.send(&vec![RESET; 49].join("\n"));
                for _ in 0..50 {
                    client.next_of("RESET");
                }
                refused += 1;
            }
            client.send(&turning(1));
            (client, refused)
        })
    };
    let mut sender = Client::tcp(daemon.address(0));
    for n in 0..200 {
        sender.send(&rate("b", n, 1.0));
        let att = watcher.object("ATT");
        assert_eq!((&att["seq"], &att["reset"]), (&json!(n), &json!(0)));
    }
    let (_client, refused) = stormy.join().unwrap();
    eventually("all was worked on", || {
        daemon.status()["sources"][1]["samples"] == 2
    });
    let status = daemon.status();
    let (b, imu0) = (&status["sources"][0], &status["sources"][1]);
    assert_eq!((&b["reset"], &b["resets"]), (&json!(0), &json!(0)));
    assert_eq!(
        (&imu0["reset"], &imu0["resets"]),
        (&json!(1), &json!(10_000)),
        "one sample, one reset"
    );
    // Before its first sample the other was not there, and later another's: refused all the same.
    assert_eq!(status["counters"]["resets_refused"], refused);
}

/// Heading of the newest attitude of each sensor after a second sample of all, degrees.
fn headings(daemon: &Daemon, sender: &mut Client, ids: &[&str]) -> Vec<f64> {
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let lines: Vec<String> = (500..502)
        .flat_map(|n| ids.iter().map(move |id| line(n).replace("imu0", id)))
        .collect();
    sender.send(&lines.join("\n"));
    let mut found = std::collections::BTreeMap::new();
    while found.len() < ids.len() {
        let att = watcher.next_of("ATT");
        if is_reset(&att) {
            found.insert(
                att["id"].as_str().unwrap().to_owned(),
                yaw(&att.to_string()),
            );
        }
    }
    ids.iter().map(|id| found[*id]).collect()
}

#[test]
fn several_sensors_begin_anew_at_one_instant_or_none_of_them_does() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan = aided();
    let alone = EstimationSettings::default();
    settings.hub.plans.insert("alone".to_owned(), alone);
    let daemon = Daemon::start(settings);
    let ids = ["hip", "knee", "ankle"];
    let mut sender = Client::tcp(daemon.address(0));
    let lines: Vec<String> = (0..500)
        .flat_map(|n| ids.iter().map(move |id| line(n).replace("imu0", id)))
        .collect();
    sender.send(&lines.join("\n"));
    // A gyro alone, which has no heading to be set.
    sender.send(&rate("alone", 0, 1.0));
    eventually("all was taken", || {
        daemon.status()["counters"]["attitudes"] == 1501
    });
    let address = daemon.address(1);
    let host = address.to_string();
    let post = |body: Value, extra: &[(&str, &str)]| {
        let mut headers = vec![("Host", &*host), ("Content-Type", "application/json")];
        headers.extend(extra);
        let body = body.to_string();
        let (status, answer) = ask(address, "POST /reset", &headers, body.as_bytes());
        (status, serde_json::from_str::<Value>(&answer).unwrap())
    };
    let taken = || daemon.status()["counters"]["resets"].clone();
    for (body, status, code) in [
        (
            json!({"ids": ["hip", "nobody"], "heading": 40}),
            404,
            "unknown_sensor",
        ),
        (
            json!({"ids": ["hip", "alone"], "heading": 40}),
            400,
            "bad_reset",
        ),
        (json!({"ids": [], "heading": 40}), 400, "bad_reset"),
        (json!({"id": "hip", "all": true}), 400, "bad_reset"),
        (
            json!({"id": "hip", "tare": true, "heading": 1}),
            400,
            "bad_reset",
        ),
        (json!({"ids": "hip"}), 400, "bad_reset"),
    ] {
        let (got, said) = post(body.clone(), &[]);
        assert_eq!(
            (got, &said["code"]),
            (status, &json!(code)),
            "{body}: {said}"
        );
    }
    assert_eq!(
        post(json!({"all": true}), &[("Origin", "https://evil.example")]).0,
        403
    );
    let own = format!("http://{host}");
    assert_eq!(
        post(json!({"all": true}), &[("Origin", &own)]).0,
        403,
        "no page posts"
    );
    assert_eq!(taken(), 0, "none of them has changed anything");

    // Of all, who cannot is left out.
    let (status, said) = post(json!({"all": true, "heading": 40}), &[]);
    let names = json!(["ankle", "hip", "knee"]);
    let of = |said: &Value| -> Value {
        let each = said["sensors"].as_array().unwrap().iter();
        each.map(|s| s["id"].clone()).collect()
    };
    assert_eq!((status, of(&said)), (200, names), "{said}");
    assert_eq!(taken(), 3);
    // A list, over the connection that sends them; the last that is asked counts.
    sender.send("{\"class\":\"RESET\",\"ids\":[\"knee\",\"hip\"],\"tare\":true}");
    let answer = sender.next_of("RESET");
    assert_eq!(of(&answer), json!(["hip", "knee"]), "{answer}");
    let [hip, knee, ankle] = headings(&daemon, &mut sender, &ids)[..] else {
        unreachable!()
    };
    for (name, heading, wanted) in [
        ("hip", hip, 0.0),
        ("knee", knee, 0.0),
        ("ankle", ankle, 40.0),
    ] {
        assert!((heading - wanted).abs() < 1.0, "{name}: {heading}");
    }
}

#[test]
fn a_replay_refuses_a_reset_with_words() {
    let log = "fixtures/xsens_mti.mcap";
    let process = Process::of(&["replay", log, "--page=127.0.0.1:0", "--paused"]);
    let address = process.address(0);
    let mut client = Client::web(address);
    client.send(RESET);
    let error = client.next_of("ERROR");
    assert_eq!(error["code"], "reset_not_taken", "{error}");
    let mut page = page(address, &format!("http://{address}")).unwrap();
    page.send(Message::text(RESET)).unwrap();
    loop {
        let said = read(page.read().unwrap().to_text().unwrap());
        if said["class"] == "ERROR" {
            break assert_eq!(said["code"], "reset_not_taken");
        }
    }
}

#[test]
fn gravity_and_bias_begin_what_a_daemon_learns_and_are_refused_of_a_gyro_alone() {
    let asked = EstimationSettings {
        initial: Initial::Gravity,
        bias: Bias::Auto,
        ..aided()
    };
    let expected = Fed::of(&aided()).lines((0..1500).map(line));
    let mut daemon = Fed::of(&asked);
    let got = daemon.lines((0..1500).map(line));
    // Of a stream nothing is known beforehand: it begins as with neither, and learns the same.
    assert!(got.attitudes == expected.attitudes && got.attitudes.len() == 1500);
    let source = source(&daemon);
    assert_eq!(source["bias"], "none to begin with, learned on the way");
    let bias = source["aid"]["learned"]["gyro_bias_rad_s"][0]
        .as_f64()
        .unwrap();
    assert!((bias.to_degrees() - 0.5).abs() < 0.1, "{bias}");
    // A gyro alone has nothing to learn from: at the start where that is known, else by its first sample.
    for plan in [
        EstimationSettings {
            initial: Initial::Gravity,
            ..EstimationSettings::default()
        },
        EstimationSettings {
            bias: Bias::Auto,
            ..EstimationSettings::default()
        },
    ] {
        let why = Hub::new(Settings {
            plan: plan.clone(),
            ..Settings::default()
        });
        let why = why.unwrap_err().to_string();
        assert!(why.contains("aid gravity"), "{why}");
        let mut daemon = Fed::of(&EstimationSettings {
            aid: strapd_attitude::estimate::Aid::Auto,
            ..plan
        });
        let got = daemon.lines((0..3).map(turning));
        assert_eq!(got.codes("ERROR")[0], "not_ready", "{:?}", got.said);
    }
}
