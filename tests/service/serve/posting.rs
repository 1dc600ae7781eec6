//! `POST /samples`: the lines of every other sender, from whoever speaks HTTP and no more; never from
//! a page.

use super::client::{Client, ask, rate};
use super::daemon::{Daemon, Process, TCP, WS, eventually, listening};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use strapd::serve::guard::admission::Token;

const JSON: (&str, &str) = ("Content-Type", "application/json");
const LINES: (&str, &str) = ("Content-Type", "application/x-ndjson");

/// Posts to the n-th listener and reads the answer.
fn post(daemon: &Daemon, n: usize, headers: &[(&str, &str)], body: &str) -> (u16, Value) {
    let host = daemon.address(n).to_string();
    let headers: Vec<_> = [("Host", &*host)]
        .into_iter()
        .chain(headers.iter().copied())
        .collect();
    let target = "POST /samples";
    let (status, answer) = ask(daemon.address(n), target, &headers, body.as_bytes());
    let object = serde_json::from_str(&answer).unwrap_or(Value::Null);
    (status, object)
}

/// Body that Sensor Logger pushes: its sensors together, one object of one line.
fn pushed(message: u64, first: u64, count: u64) -> String {
    let of = |name: &str, n: u64, x: f64| {
        json!({"name": name, "time": 1_700_000_000_000_000_000_u64 + n * 10_000_000,
               "values": {"x": x, "y": 0.0, "z": 0.5}})
    };
    let payload: Vec<Value> = (first..first + count)
        .flat_map(|n| [of("accelerometer", n, 9.8), of("gyroscope", n, 0.1)])
        .collect();
    json!({"messageId": message, "sessionId": "s", "deviceId": "d", "payload": payload}).to_string()
}

#[test]
fn one_object_an_array_and_lines_are_taken_and_counted() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let lines: Vec<String> = (0..30).map(|n| rate("a", n, 1.0)).collect();
    let pretty = |line: &String| {
        serde_json::to_string_pretty(&serde_json::from_str::<Value>(line).unwrap()).unwrap()
    };
    let utf8 = ("Content-Type", "Application/JSON; charset=utf-8");
    for (kind, body, count) in [
        (JSON, lines[0].clone(), 1),
        (utf8, pretty(&lines[1]), 1),
        (JSON, format!("[\n{},\n{}]", lines[2], pretty(&lines[3])), 2),
        (LINES, lines[4..10].join("\n"), 6),
        (
            LINES,
            format!("\r\n{}\r\n\r\n", lines[10..20].join("\r\n\r\n")),
            10,
        ),
        // Lines, though they are called JSON.
        (JSON, lines[20..30].join("\n"), 10),
    ] {
        let (status, said) = post(&daemon, 1, &[kind], &body);
        assert_eq!((status, &said["class"]), (200, &json!("SAMPLES")), "{said}");
        let counts = [&said["objects"], &said["samples"], &said["errors"]];
        assert_eq!(counts, [&json!(count), &json!(count), &json!(0)], "{said}");
    }
    for n in 0..30 {
        let att = watcher.object("ATT");
        assert_eq!((&att["id"], &att["seq"]), (&json!("a"), &json!(n)));
    }
    // Sensors in one body are told apart, and one without a name has that of the address.
    let host = daemon.address(1).to_string();
    let mixed = format!(
        "[{},{},{{\"gyro\":[1,0,0],\"stamp_ns\":7}}]",
        rate("b", 0, 1.0),
        rate("c", 0, 1.0)
    );
    let (status, said) = ask(
        daemon.address(1),
        "POST /samples?id=my%20phone",
        &[("Host", &host), JSON],
        mixed.as_bytes(),
    );
    assert_eq!(status, 200, "{said}");
    for id in ["b", "c", "my phone"] {
        assert_eq!(watcher.object("ATT")["id"], id);
    }
}

#[test]
fn a_phones_pushes_go_through_and_no_attitude_of_them_is_lost() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    // The last is 700 kB in one object: longer than a line may be, and 3,000 attitudes at once are
    // more than may wait for a watcher.
    let mut first = 0;
    for (message, count) in [50, 50, 50, 3000].into_iter().enumerate() {
        let body = pushed(message as u64, first, count);
        let (status, said) = post(&daemon, 1, &[JSON], &body);
        assert_eq!(status, 200, "{said}");
        assert_eq!(
            (&said["objects"], &said["samples"]),
            (&json!(1), &json!(count))
        );
        // Read as they come: who does not read loses the oldest.
        for n in (first..first + count).filter(|_| count <= 100) {
            assert_eq!(watcher.object("ATT")["seq"], n);
        }
        first += count;
    }
    let mut next = first - 3000;
    while next < first {
        let line = watcher.line().unwrap();
        let said: Value = serde_json::from_str(&line).unwrap();
        // A machine under load may not read in time; then it is said, and nothing is passed over without.
        let begins = match said["class"].as_str() {
            Some("ATT") => &said["seq"],
            _ => &said["first_seq"],
        };
        assert_eq!(begins, next, "{line}");
        next = match said["class"].as_str() {
            Some("ATT") => said["seq"].as_u64().unwrap() + 1,
            Some("GAP") => said["last_seq"].as_u64().unwrap() + 1,
            _ => unreachable!("{line}"),
        };
    }
    let status = daemon.status();
    assert_eq!(status["counters"]["attitudes"], first, "{status}");
    assert_eq!(status["sources"].as_array().unwrap().len(), 1, "{status}");
}

#[test]
fn the_first_error_comes_back_and_the_rest_is_taken_all_the_same() {
    let daemon = Daemon::start(listening(&[WS]));
    let good = |n: u64| rate("a", n, 1.0);
    for (kind, body, code, line, column, samples) in [
        (
            LINES,
            format!("{}\n\n{{\"class\":\"RATE\" 1}}\n{}\n7", good(0), good(1)),
            "bad_json",
            3,
            json!(17),
            2,
        ),
        (
            JSON,
            format!("[{},{{\"a\":1}},{}]", good(2), good(3)),
            "no_rate",
            2,
            Value::Null,
            2,
        ),
        (
            JSON,
            format!("[{},{{\"a\" 1}}]", good(4)),
            "bad_json",
            2,
            json!(6),
            1,
        ),
        (JSON, "gyro=1".to_owned(), "bad_json", 1, json!(1), 0),
        (JSON, String::new(), "bad_json", 1, json!(1), 0),
        (
            JSON,
            "{\"class\":\"WATCH\"}".to_owned(),
            "unknown_class",
            1,
            Value::Null,
            0,
        ),
        (
            JSON,
            "{\"class\":\"AUTH\",\"token\":\"x\"}".to_owned(),
            "unknown_class",
            1,
            Value::Null,
            0,
        ),
    ] {
        let (status, said) = post(&daemon, 0, &[kind], &body);
        assert_eq!(status, 400, "{body}: {said}");
        assert_eq!(
            (&said["class"], &said["code"]),
            (&json!("ERROR"), &json!(code)),
            "{said}"
        );
        assert_eq!(
            (&said["line"], &said["column"]),
            (&json!(line), &column),
            "{said}"
        );
        assert_eq!(said["samples"], samples, "{said}");
    }
    // Twenty-one in a row, and no more of it is read.
    let (status, said) = post(
        &daemon,
        0,
        &[LINES],
        &format!("{}{}", "x\n".repeat(21), good(9)),
    );
    assert_eq!(
        (status, &said["errors"], &said["samples"]),
        (400, &json!(21), &json!(0))
    );
    // What is no line's fault is said as well.
    let (status, said) = post(
        &daemon,
        0,
        &[JSON],
        "{\"class\":\"RATE\",\"id\":\"n\",\"gyro\":[1,0,0]}",
    );
    assert_eq!(
        (status, &said["code"], &said["id"]),
        (400, &json!("no_stamp"), &json!("n"))
    );
}

#[test]
fn nothing_a_page_can_send_is_taken() {
    let daemon = Daemon::start({
        let mut settings = listening(&[WS]);
        settings.web.origins = vec!["https://friend.example".to_owned()];
        settings
    });
    let own = format!("http://{}", daemon.address(0));
    let body = rate("evil", 0, 1.0);
    for headers in [
        vec![JSON, ("Origin", "https://evil.example")],
        vec![JSON, ("Origin", "null")],
        // Neither our own page nor one that may watch.
        vec![JSON, ("Origin", &own)],
        vec![JSON, ("Origin", "https://friend.example")],
        vec![JSON, ("Sec-Fetch-Site", "cross-site")],
        vec![JSON, ("Sec-Fetch-Site", "same-site")],
        vec![JSON, ("Sec-Fetch-Site", "same-origin")],
        vec![
            JSON,
            ("Sec-Fetch-Site", "none"),
            ("Sec-Fetch-Site", "cross-site"),
        ],
        vec![JSON, ("Sec-Fetch-Site", "")],
    ] {
        let (status, said) = post(&daemon, 0, &headers, &body);
        assert_eq!(
            (status, &said["code"]),
            (403, &json!("forbidden")),
            "{headers:?}: {said}"
        );
    }
    for kind in [
        "text/plain",
        "text/plain;charset=UTF-8",
        "application/x-www-form-urlencoded",
        "multipart/form-data; boundary=x",
        "application/jsonp",
        "text/plain; application/json",
        "",
    ] {
        let (status, said) = post(&daemon, 0, &[("Content-Type", kind)], &body);
        assert_eq!(
            (status, &said["code"]),
            (415, &json!("body_type")),
            "{kind}"
        );
        assert!(
            said["message"]
                .as_str()
                .unwrap()
                .contains("application/x-ndjson")
        );
    }
    assert_eq!(post(&daemon, 0, &[], &body).0, 415);
    assert_eq!(
        post(&daemon, 0, &[JSON, ("Content-Type", "text/plain")], &body).0,
        415
    );
    // Another's name that leads here, in either place.
    let address = daemon.address(0);
    let host = address.to_string();
    for (target, name) in [
        ("POST /samples", "evil.example"),
        ("POST http://evil.example/samples", &*host),
    ] {
        let (status, _) = ask(address, target, &[("Host", name), JSON], body.as_bytes());
        assert_eq!(status, 403, "{target}");
    }
    for method in ["GET", "PUT", "DELETE", "OPTIONS"] {
        let what = format!("{method} /samples");
        assert_eq!(ask(address, &what, &[("Host", &host), JSON], b"").0, 405);
    }
    let status = daemon.status();
    assert_eq!(status["sources"], json!([]), "{status}");
    // A tool that says it is no page, as a browser's address bar would.
    assert_eq!(
        post(&daemon, 0, &[JSON, ("Sec-Fetch-Site", "none")], &body).0,
        200
    );
}

#[test]
fn with_a_token_only_who_shows_it_posts() {
    let mut settings = listening(&[WS]);
    settings.hub.token = Some(Token::new("correct horse battery"));
    let daemon = Daemon::start(settings);
    let body = rate("a", 0, 1.0);
    let with = |shown: &'static str| [JSON, ("Authorization", shown)];
    assert_eq!(post(&daemon, 0, &[JSON], &body).0, 401);
    assert_eq!(post(&daemon, 0, &with("Bearer wrong horse"), &body).0, 401);
    assert_eq!(daemon.status()["sources"], json!([]));
    assert_eq!(
        post(&daemon, 0, &with("Bearer correct horse battery"), &body).0,
        200
    );
}

#[test]
fn a_body_of_more_than_a_mebibyte_is_refused_by_what_it_says_and_by_what_comes() {
    let daemon = Daemon::start(listening(&[WS]));
    let padded = |bytes: usize| {
        let line = rate("a", 0, 1.0);
        format!("{line}{}", " ".repeat(bytes - line.len()))
    };
    assert_eq!(post(&daemon, 0, &[JSON], &padded(1 << 20)).0, 200);
    assert_eq!(post(&daemon, 0, &[JSON], &padded((1 << 20) + 1)).0, 413);
    // In pieces, whose sum nobody has said.
    let mut stream = TcpStream::connect(daemon.address(0)).unwrap();
    let head = format!(
        "POST /samples HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{}: {}\r\nTransfer-Encoding: chunked\r\n\r\n",
        LINES.0, LINES.1
    );
    stream.write_all(head.as_bytes()).unwrap();
    let piece = format!("10000\r\n{}\r\n", "\n".repeat(1 << 16));
    for _ in 0..17 {
        let _ = stream.write_all(piece.as_bytes());
    }
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let answer = String::from_utf8(answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 413 "), "{answer}");
    assert_eq!(daemon.status()["sources"][0]["samples"], 1);
}

#[test]
fn a_body_that_stops_coming_is_given_up() {
    let mut settings = listening(&[WS]);
    settings.hub.limits.no_progress = Duration::from_millis(300);
    let daemon = Daemon::start(settings);
    let mut stream = TcpStream::connect(daemon.address(0)).unwrap();
    let head = "POST /samples HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{";
    stream.write_all(head.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 408 "), "{answer}");
}

#[test]
fn a_posted_sensor_is_its_posters_for_a_while() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.limits.sender_silence = Duration::from_secs(2);
    let daemon = Daemon::start(settings);
    assert_eq!(post(&daemon, 1, &[JSON], &rate("a", 0, 1.0)).0, 200);
    let mut other = Client::tcp(daemon.address(0));
    other.object("VERSION");
    other.send(&rate("a", 1, 1.0));
    assert_eq!(other.object("ERROR")["code"], "id_in_use");
    // The poster goes on, and the other has it once the poster has been silent.
    assert_eq!(post(&daemon, 1, &[JSON], &rate("a", 2, 1.0)).0, 200);
    eventually("the poster is forgotten", || {
        let status = daemon.status();
        let clients = status["clients"].as_array().unwrap();
        clients.len() == 1 && clients[0]["peer"].as_str().unwrap().starts_with("tcp://")
    });
    let mut other = other.watching("{\"class\":\"WATCH\"}");
    other.send(&rate("a", 3, 1.0));
    // After the last one of before, which comes at once.
    while other.object("ATT")["seq"] != 2 {}
    let (status, said) = post(&daemon, 1, &[JSON], &rate("a", 4, 1.0));
    assert_eq!((status, &said["code"]), (400, &json!("id_in_use")));
}

#[test]
fn a_replay_takes_no_posts() {
    let process = Process::of(&["simulate", "top", "--speed", "1", "--page", "-o", WS]);
    let (status, said) = ask(
        process.address(0),
        "POST /samples",
        &[("Host", "localhost"), JSON],
        rate("a", 0, 1.0).as_bytes(),
    );
    assert_eq!(status, 400);
    assert!(said.contains("samples_not_taken"), "{said}");
}

#[test]
fn names_that_are_no_text_are_refused_and_errors_count_objects() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let host = daemon.address(1).to_string();
    let headers = [("Host", &*host), JSON];
    let body = rate("", 0, 1.0).replace("\"id\":\"\",", "");
    for (name, expected) in [
        ("%ff", 400),
        ("%fe", 400),
        ("a%C3", 400),
        ("%ed%a0%80", 400),
        ("%C3%A9", 200),
        ("100%25", 200),
    ] {
        let target = format!("POST /samples?id={name}");
        let (status, answer) = ask(daemon.address(1), &target, &headers, body.as_bytes());
        assert_eq!(status, expected, "{name}: {answer}");
    }
    assert_eq!(daemon.status()["sources"].as_array().unwrap().len(), 2);

    // Another sends it: each object of the array is an error.
    // A watcher of all would first get the last attitudes of the two above.
    let watch = "{\"class\":\"WATCH\",\"id\":\"taken\"}";
    let mut owner = Client::tcp(daemon.address(0)).watching(watch);
    owner.send(&rate("taken", 0, 1.0));
    assert_eq!(owner.object("ATT")["id"], "taken");
    let lines: Vec<String> = (1..31).map(|n| rate("taken", n, 1.0)).collect();
    let (status, said) = post(&daemon, 1, &[JSON], &format!("[{}]", lines.join(",")));
    assert_eq!(
        (status, &said["code"]),
        (400, &json!("id_in_use")),
        "{said}"
    );
    assert_eq!(
        (&said["objects"], &said["errors"]),
        (&json!(30), &json!(30)),
        "{said}"
    );
    // So are those that no estimator can use, in every post.
    for _ in 0..2 {
        let unstamped = vec!["{\"id\":\"b\",\"gyro\":[1,0,0]}"; 300].join("\n");
        let (status, said) = post(&daemon, 1, &[LINES], &unstamped);
        assert_eq!((status, &said["code"]), (400, &json!("no_stamp")), "{said}");
        assert_eq!(
            (&said["objects"], &said["errors"]),
            (&json!(300), &json!(300)),
            "{said}"
        );
    }
}
