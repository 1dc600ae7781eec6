//! Promise: a client that does not begin with an object is not listened to: what a browser can be made to send to the
//! port of lines never becomes a sample.

use super::client::{Client, rate};
use super::daemon::{Daemon, Process, TCP, WS, eventually, listening};
use serde_json::Value;
use std::io::{BufRead, Read, Write};
use std::net::TcpStream;

/// Request that a browser sends for a page that posts samples as text, to which no server has to agree.
fn post(body: &str) -> String {
    format!(
        "POST / HTTP/1.1\r\nHost: 127.0.0.1:4550\r\nConnection: keep-alive\r\nContent-Length: {}\r\n\
         sec-ch-ua: \"Chromium\";v=\"140\"\r\nsec-ch-ua-mobile: ?0\r\nsec-ch-ua-platform: \"Linux\"\r\n\
         User-Agent: Mozilla/5.0\r\nContent-Type: text/plain;charset=UTF-8\r\nAccept: */*\r\n\
         Origin: http://evil.example\r\nSec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: no-cors\r\n\
         Sec-Fetch-Dest: empty\r\nReferer: http://evil.example/\r\nAccept-Encoding: gzip, deflate\r\n\
         Accept-Language: en\r\n\r\n{body}",
        body.len()
    )
}

/// Ten samples of a sensor, one a line.
fn samples(id: &str) -> String {
    (0..10).map(|n| rate(id, n, 1.0) + "\n").collect()
}

/// Asserts that no sensor is known, and none of what was sent was taken.
fn is_untouched(daemon: &Daemon) {
    let status = daemon.status();
    assert_eq!(status["sources"], serde_json::json!([]), "{status}");
    assert_eq!(status["counters"]["samples"], 0, "{status}");
}

#[test]
fn samples_behind_anything_but_an_object_are_never_read() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let behind = samples("evil");
    let beginnings = [
        post(&behind),
        format!("GET / HTTP/1.1\n{behind}"),
        format!("\r\n \t\r\nPOST / HTTP/1.0\n\n{behind}"),
        format!("\u{16}\u{3}\u{1}\u{2}\n{behind}"),
        format!("[{}]\n{behind}", rate("evil", 0, 1.0)),
        format!("x\n{behind}"),
        format!("7\n{behind}"),
        format!("\"{{\"\n{behind}"),
        format!("{{\"class\":\"RATE\" 1}}\n{behind}"),
        format!("{{\n{behind}"),
        format!("{{{}\n{behind}", "x".repeat(70_000)),
        format!(" \u{f8}{behind}"),
    ];
    for text in &beginnings {
        let mut client = Client::tcp(daemon.address(0));
        // It may be closed while this is still being sent.
        client.try_send(text.as_bytes());
        let said = client.rest();
        assert_eq!(said.len(), 2, "a greeting and a reason: {said:?}");
        assert_eq!(said[1]["code"], "not_an_object", "{said:?}");
        let words = said[1]["message"].as_str().unwrap();
        assert!(words.contains("POST /samples"), "{words}");
        is_untouched(&daemon);
    }
    // A packed object that can be none, and samples behind it.
    let mut client = Client::tcp(daemon.address(0));
    client.try_send(&[&b"\xf8\x01\x02\x00\n"[..], behind.as_bytes()].concat());
    assert_eq!(client.rest()[1]["code"], "not_an_object");
    // Over a WebSocket, too.
    let mut client = Client::web(daemon.address(1));
    client.object("VERSION");
    client.send_bytes(beginnings[0].as_bytes());
    assert_eq!(client.object("ERROR")["code"], "not_an_object");
    assert_eq!(client.line(), None);
    is_untouched(&daemon);
    let closed = beginnings.len() + 2;
    eventually("each close to be counted", || {
        daemon.status()["counters"]["connections_closed"] == closed
    });
}

#[test]
fn the_first_byte_decides_wherever_it_comes_and_at_once() {
    let daemon = Daemon::tcp();
    // No line end comes, and none is waited for.
    for first in ["\u{1}", "\r\n\r\n \n[", "\u{16}"] {
        let mut client = Client::tcp(daemon.address(0));
        client.object("VERSION");
        client.send_bytes(&first.as_bytes()[..first.len() - 1]);
        client.send_bytes(&first.as_bytes()[first.len() - 1..]);
        let error = client.object("ERROR");
        assert_eq!(error["code"], "not_an_object");
        let lines = 1 + first.matches('\n').count();
        assert_eq!(error["line"], lines, "{error}");
        assert_eq!(client.line(), None);
    }
    // Text may be of a table: its first line decides.
    let mut client = Client::tcp(daemon.address(0));
    client.object("VERSION");
    for byte in b"GET / HTTP/1.1\r\n" {
        client.send_bytes(&[*byte]);
    }
    assert_eq!(client.object("ERROR")["code"], "not_an_object");
    assert_eq!(client.line(), None);
    // Blank lines before an object, an object of which nobody knows the use, and one byte after the
    // other: all this may be.
    let mut client = Client::tcp(daemon.address(0));
    for byte in b"\r\n \n {\"hello\":1}\n" {
        client.send_bytes(&[*byte]);
    }
    client.object("VERSION");
    assert_eq!(client.object("ERROR")["code"], "no_rate");
    client.send("[{\"gyro\":[1,0,0],\"stamp_ns\":1000000000}]");
    client.send("no object, but later");
    assert_eq!(client.object("ERROR")["code"], "bad_json");
    client.send("{\"class\":\"POLL\"}");
    let status = client.object("STATUS");
    assert_eq!(status["sources"][0]["samples"], 2, "{status}");
}

#[test]
fn who_must_show_a_token_hears_of_both() {
    let mut settings = listening(&[TCP]);
    settings.hub.token = Some(strapd::serve::guard::admission::Token::new(
        "correct horse battery",
    ));
    let daemon = Daemon::start(settings);
    let mut client = Client::tcp(daemon.address(0));
    client.try_send(post(&samples("evil")).as_bytes());
    let said = client.rest();
    assert_eq!(said[1]["code"], "unauthorised");
    let words = said[1]["message"].as_str().unwrap();
    assert!(
        words.contains("AUTH") && words.contains("POST /samples"),
        "{words}"
    );
    is_untouched(&daemon);
}

#[test]
fn a_replay_is_not_moved_by_what_follows_a_request() {
    let mut process = Process::of(&[
        "simulate",
        "top",
        "--speed",
        "1",
        "--paused",
        "-o",
        "tcp-listen://127.0.0.1:0",
    ]);
    let mut client = Client::tcp(process.address(0));
    client.try_send(post("{\"class\":\"PLAYBACK\",\"action\":\"play\"}\n").as_bytes());
    let said = client.rest();
    assert_eq!(said.last().unwrap()["code"], "not_an_object", "{said:?}");
    let mut other = Client::tcp(process.address(0));
    other.send("{\"class\":\"WATCH\"}");
    let mut place = Value::Null;
    while place["class"] != "PLAYBACK" {
        place = serde_json::from_str(&other.line().unwrap()).unwrap();
    }
    assert_eq!(place["state"], "paused");
    process.signal("TERM");
    process.exit();
}

#[test]
fn the_log_says_once_that_somebody_spoke_something_else() {
    let mut process = Process::start(&["--listen", TCP]);
    for _ in 0..5 {
        let mut stream = TcpStream::connect(process.address(0)).unwrap();
        stream.write_all(post("").as_bytes()).unwrap();
        // Until it is closed.
        let _ = std::io::copy(&mut stream, &mut std::io::sink());
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let said: Vec<String> = process
        .log
        .by_ref()
        .lines()
        .map(Result::unwrap)
        .filter(|line| line.contains("POST /samples"))
        .collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("WARN"), "{said:?}");
}
