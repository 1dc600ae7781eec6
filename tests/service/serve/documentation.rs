//! The examples of `docs/protocol.md` do what they say.

use super::client::{Client, rate};
use super::daemon::{Daemon, PATIENCE, TCP, WS, eventually, listening};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;

const PAGE: &str = include_str!("../../../docs/protocol.md");

/// The code blocks of a language.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    PAGE.split(&fence)
        .skip(1)
        .map(|rest| rest.split("\n```").next().unwrap())
        .collect()
}

#[test]
#[cfg_attr(not(has_python), ignore = "needs python3")]
fn the_python_examples_as_lines_and_packed_turn_by_ninety_degrees() {
    let daemon = Daemon::tcp();
    let scripts = blocks("python");
    assert_eq!(scripts.len(), 2);
    let port = daemon.address(0).port().to_string();
    for script in scripts {
        assert!(script.lines().count() <= 20);
        let output = Command::new("python3")
            .args(["-c", &script.replace("4550", &port)])
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        assert_eq!(
            String::from_utf8(output.stdout).unwrap(),
            "yaw 90.000000 deg\n"
        );
    }
}

/// `nc` is played by this test: what would be sent to it is caught and sent over a socket.
#[test]
fn every_line_for_nc_is_answered_as_is_said_behind_it() {
    let daemon = Daemon::tcp();
    let lines: Vec<&str> = blocks("sh")
        .into_iter()
        .flat_map(str::lines)
        .filter(|l| l.contains("| nc "))
        .collect();
    assert!(lines.len() >= 6);
    for line in lines {
        let (command, expected) = line.split_once("  # ").unwrap_or_else(|| {
            unreachable!("nothing is said of {line}");
        });
        let caught = Command::new("sh")
            .args(["-c", &format!("nc() {{ cat; }}\n{command}")])
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert!(
            caught.status.success() && caught.stderr.is_empty(),
            "{caught:?}"
        );
        assert!(!caught.stdout.is_empty());
        let mut client = Client::tcp(daemon.address(0));
        client.send_bytes(&caught.stdout);
        client.shut();
        let watches = expected.contains("WATCH");
        for class in expected.split_whitespace() {
            client.object(class);
        }
        if !watches {
            assert_eq!(client.rest(), Vec::<serde_json::Value>::new(), "{line}");
        }
    }
}

/// `STRAPD_ORACLES_PYTHON` names a Python with the packages of `benches/peers/requirements.txt`.
#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn python_websockets_speaks_with_the_daemon() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let daemon = Daemon::start(listening(&[WS]));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/websockets_client.py");
    let output = Command::new(python)
        .arg(script)
        .arg(format!("ws://{}/ws", daemon.address(0)))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(said, "yaw 90.000000 deg after 1001 attitudes\n");
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_browser_example_shows_the_attitude() {
    let page = blocks("html");
    assert_eq!(page.len(), 1);
    assert!(page[0].lines().count() <= 20);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let origin = format!("http://{}", listener.local_addr().unwrap());
    let mut settings = listening(&[TCP, WS]);
    settings.web.origins = vec![origin.clone()];
    let daemon = Daemon::start(settings);
    // The page as it stands, and after it somebody who tells what it shows.
    let page = page[0].replace("127.0.0.1:8765", &daemon.address(1).to_string())
        + "<script>new MutationObserver(() => fetch('/shown?' + encodeURIComponent(shown.textContent))).observe(shown, { childList: true });</script>";
    let (tell, told) = channel();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = BufReader::new(stream.unwrap());
            let mut request = String::new();
            let mut line = String::new();
            while stream.read_line(&mut line).is_ok_and(|n| n > 2) {
                request.push_str(&std::mem::take(&mut line));
            }
            let path = request.split(' ').nth(1).unwrap_or("/");
            if let Some(shown) = path.strip_prefix("/shown?")
                && tell
                    .send(shown.replace("%20", " ").replace("%2C", ","))
                    .is_err()
            {
                return;
            }
            let _ = write!(
                stream.get_mut(),
                "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{page}",
                page.len()
            );
        }
    });
    let profile = tempfile::tempdir().unwrap();
    let mut chromium = Command::new("chromium")
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--remote-debugging-port=0",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(&origin)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    eventually("the page watches", || {
        let status = daemon.status();
        let clients = status["clients"].as_array().unwrap();
        clients.iter().any(|c| c["watching"] == true)
    });
    let mut sender = Client::tcp(daemon.address(0));
    for n in 0..=500 {
        sender.send(&rate("imu0", n, std::f64::consts::FRAC_PI_2));
    }
    // Later than a thirtieth of a second: it is not thinned out.
    sender.send(&rate("imu0", 540, std::f64::consts::FRAC_PI_2));
    let shown = std::iter::from_fn(|| told.recv_timeout(PATIENCE).ok())
        .find(|shown| shown.starts_with("imu0  48.60,"));
    chromium.kill().unwrap();
    chromium.wait().unwrap();
    let shown = shown.unwrap();
    let angles: Vec<f64> = shown["imu0  ".len()..]
        .split(',')
        .map(|a| a.parse().unwrap())
        .collect();
    assert_eq!(angles, [48.6, 0.0, 0.0]);
}

#[test]
fn every_object_shown_is_one_the_daemon_sends_or_takes() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut client = Client::web(daemon.address(1));
    let mut seen = vec![client.object("VERSION")];
    let shown: Vec<serde_json::Value> = blocks("json")
        .iter()
        .map(|text| serde_json::from_str(text).unwrap())
        .collect();
    let of = |class: &str| shown.iter().find(|v| v["class"] == class).unwrap();
    let error_of = |code: &str| shown.iter().find(|v| v["code"] == code).unwrap();
    client.send(&of("WATCH").to_string());
    seen.push(client.object("WATCH"));
    client.send(&of("RATE").to_string());
    seen.push(client.object("ATT"));
    client.send("{\"class\":\"RATE\" \"gyro\":1}");
    seen.push(client.object("ERROR"));
    let mut packed = Client::web(daemon.address(1)).watching(r#"{"class":"WATCH","packed":true}"#);
    client.send(&of("PACKED").to_string());
    client.send(&rate("imu0", 100, 0.0));
    seen.push(packed.object("PACKED"));
    let error = seen[3].clone();
    for object in &seen {
        // The answer to WATCH, and what the daemon says of a number, are the second of their classes.
        let class = &object["class"];
        let example = shown.iter().rfind(|v| v["class"] == *class).unwrap();
        let keys = |v: &serde_json::Value| {
            let mut keys: Vec<String> = v.as_object().unwrap().keys().cloned().collect();
            keys.sort();
            keys
        };
        assert_eq!(keys(object), keys(example), "{class}");
    }
    assert_eq!(error["message"], error_of("bad_json")["message"]);
    assert_eq!(error["near"], error_of("bad_json")["near"]);
    let mut sender = Client::tcp(daemon.address(0));
    sender.object("VERSION");
    for n in 0..8 {
        let stamp = 1_700_000_000_000_u64 + n * 5;
        sender.send(&format!(
            "{{\"id\":\"imu1\",\"sample_kind\":\"average\",\"stamp_ms\":{stamp},\"gyro\":[0,0,0],\"dt\":5}}"
        ));
    }
    let mut mismatch = sender.object("ERROR");
    mismatch["id"] = "imu0".into();
    assert_eq!(mismatch, *error_of("interval_mismatch"));
}

#[test]
fn the_page_shows_the_heartbeat_that_is_sent() {
    let sent = strapd::serve::protocol::wire::heartbeat(
        strapd::serve::guard::limits::Limits::default().ping,
    );
    assert!(
        PAGE.contains(std::str::from_utf8(&sent).unwrap()),
        "{sent:?}"
    );
}

#[test]
fn the_page_names_the_addresses_it_listens_on_by_default() {
    for uri in strapd::sink::address::DEFAULTS {
        let listen = strapd::sink::address::Listen::parse(uri).unwrap();
        assert!(listen.ip().unwrap().is_loopback());
        assert!(PAGE.contains(uri.split_once("://").unwrap().1), "{uri}");
    }
}
