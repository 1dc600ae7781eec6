//! `strapd cat URL`: what a daemon says, on standard output.

use super::client::{Client, rate};
use super::daemon::{Daemon, PATIENCE, TCP, WS, eventually, listening, strapd};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, UdpSocket};
use std::process::{Child, Command, Output, Stdio};
use std::time::Instant;

fn cat(args: &[&str]) -> Child {
    Command::new(strapd())
        .arg("cat")
        .args(args)
        .env_remove("STRAPD_LOG")
        .env_remove("STRAPD_TOKEN_FILE")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits for the output in bounded time.
fn ended(mut child: Child) -> Output {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn watchers(daemon: &Daemon) -> usize {
    let status = daemon.status();
    let clients = status["clients"].as_array().unwrap();
    clients.iter().filter(|c| c["watching"] == true).count()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn attitudes_come_as_they_were_sent_over_every_transport() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let daemon = Daemon::start(listening(&[
        TCP,
        WS,
        &format!("unix-listen://{}", path.display()),
    ]));
    let urls = [
        format!("tcp://{}", daemon.address(0)),
        format!("ws://{}", daemon.address(1)),
        format!("unix://{}", path.display()),
    ];
    let cats = urls.map(|url| cat(&[&url, "-n", "20", "--id", "b"]));
    eventually("all watch", || watchers(&daemon) == 3);
    let mut near = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\",\"id\":\"b\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let mut expected = String::new();
    for n in 0..25 {
        sender.send(&rate("a", n, 1.0));
        sender.send(&rate("b", n, 0.1 * n as f64));
        let line = near.line().unwrap();
        if n < 20 {
            expected.push_str(&format!("{line}\n"));
        }
    }
    for cat in cats {
        let output = ended(cat);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        assert_eq!(text(&output.stdout), expected);
        assert_eq!(text(&output.stderr), "");
    }
}

/// Rows are asked for packed, lines as lines: one says what the other does, each number.
#[test]
fn rows_say_the_same_as_lines() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let url = format!("tcp://{}", daemon.address(0));
    let rows = [url.clone(), format!("ws://{}", daemon.address(1))]
        .map(|url| cat(&[&url, "-n", "3", "--format", "csv"]));
    let table = cat(&[&url, "-n", "3", "--format", "table"]);
    let lines = cat(&[&url, "-n", "3"]);
    eventually("all watch", || watchers(&daemon) == 4);
    let mut sender = Client::tcp(daemon.address(0));
    for n in [0, 100, 10_000] {
        sender.send(&rate("i,0", n, std::f64::consts::PI));
    }
    let lines = text(&ended(lines).stdout);
    for rows in rows {
        let output = ended(rows);
        assert_eq!(text(&output.stderr), "");
        let mut reader = csv::Reader::from_reader(output.stdout.as_slice());
        let headers = reader.headers().unwrap().clone();
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 3);
        for (row, line) in rows.iter().zip(lines.lines()) {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            let cell = |name: &str| &row[headers.iter().position(|h| h == name).unwrap()];
            let number = |name: &str| match cell(name) {
                "nan" => serde_json::Value::Null,
                text => text.parse::<f64>().unwrap().into(),
            };
            for (name, part) in [("qw", "w"), ("qx", "x"), ("qy", "y"), ("qz", "z")] {
                assert_eq!(number(name), line["q"][part], "{name}");
            }
            for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                assert_eq!(number(&format!("w{name}")), line["rate"][axis]);
                let sigma = number(&format!("sigma_{name}_deg"));
                assert_eq!(sigma, line["sigma_deg"][axis]);
            }
            let status = line["status"].as_array().unwrap();
            let status: Vec<&str> = status.iter().map(|s| s.as_str().unwrap()).collect();
            assert_eq!(cell("status"), status.join("|"));
            assert_eq!((cell("id"), cell("world")), ("i,0", "start"));
            let stamp = &line["stamp"];
            assert_eq!(
                cell("stamp_ns"),
                format!("{}{:09}", stamp["sec"], stamp["nsec"].as_i64().unwrap())
            );
        }
        let column = headers.iter().position(|h| h == "roll_deg").unwrap();
        let roll: f64 = rows[1][column].parse().unwrap();
        // A tenth of a second at half a turn a second.
        assert!((roll - 18.0).abs() < 1e-9, "{roll}");
    }
    let output = text(&ended(table).stdout);
    let second = output.lines().nth(2).unwrap();
    assert!(
        second.contains("1700000000.100000000") && second.ends_with("i,0"),
        "{output}"
    );
}

/// A head of eight bytes and zeros.
fn object(kind: u8, stream: u8, length: u8) -> Vec<u8> {
    let mut bytes = vec![0; usize::from(length).max(8)];
    bytes[..8].copy_from_slice(&[0xf8, kind, length, 0, stream, 0, 0, 0]);
    bytes
}

#[test]
fn packed_attitudes_that_say_nothing_are_told_and_those_that_do_are_taken() {
    let named = b"{\"class\":\"PACKED\",\"stream\":1,\"id\":\"a\\u001b\",\"world\":\"start\"}\n";
    let bytes = [
        object(2, 1, 112),
        named.to_vec(),
        object(2, 1, 112),
        object(2, 9, 112),
        object(1, 1, 48),
        object(2, 1, 40),
        object(7, 1, 20),
        b"{\"class\":\"PACKED\"}\n".to_vec(),
        object(2, 1, 112),
        object(2, 1, 7),
    ]
    .concat();
    let output = ended(cat(&[&impostor(bytes.clone()), "--format", "csv"]));
    let said = text(&output.stderr);
    assert_eq!(text(&output.stdout).lines().count(), 3, "two rows: {said}");
    assert!(
        text(&output.stdout).contains("a\\u{1b},0,0.0,"),
        "{output:?}"
    );
    for part in [
        "number 1, which no PACKED line has named",
        "number 9",
        "a packed sample",
        "40 bytes, need 112",
        "kind 7",
        "names no stream",
        "without a length",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // Who asked for lines prints no others.
    let output = ended(cat(&[&impostor(bytes)]));
    assert_eq!(text(&output.stdout), "");
    assert!(
        text(&output.stderr).contains("nobody asked for"),
        "{output:?}"
    );
}

#[test]
fn it_ends_after_a_time_and_at_a_signal_as_if_it_had_enough() {
    let daemon = Daemon::tcp();
    let url = format!("tcp://{}", daemon.address(0));
    let output = ended(cat(&[&url, "-x", "0.2"]));
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    for signal in ["INT", "TERM"] {
        // One that has gone is noticed when something is sent to it.
        let daemon = Daemon::tcp();
        let url = format!("tcp://{}", daemon.address(0));
        let mut child = cat(&[&url]);
        let mut sender = Client::tcp(daemon.address(0));
        eventually("it watches", || watchers(&daemon) >= 1);
        sender.send(&rate(signal, 0, 1.0));
        let mut line = String::new();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        out.read_line(&mut line).unwrap();
        assert!(line.contains("\"ATT\""), "a line is there at once: {line}");
        let done = Command::new("kill")
            .args([&format!("-{signal}"), &child.id().to_string()])
            .status()
            .unwrap();
        assert!(done.success());
        assert_eq!(ended(child).status.code(), Some(0));
    }
}

#[test]
fn a_daemon_that_is_not_there_or_goes_is_an_error_with_its_reason() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let urls = [0, 1].map(|n| {
        let scheme = ["tcp", "ws"][n];
        format!("{scheme}://{}", daemon.address(n))
    });
    let cats = urls.clone().map(|url| cat(&[&url]));
    eventually("both watch", || watchers(&daemon) == 2);
    assert!(daemon.stop());
    for cat in cats {
        let output = ended(cat);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("closed the connection"), "{said}");
    }
    for url in &urls {
        let output = ended(cat(&[url]));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.contains(url.trim_end_matches('/')) && said.contains("refused"),
            "{said}"
        );
    }
}

#[test]
fn a_token_is_shown_and_its_lack_is_told() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("token");
    std::fs::write(&path, "0123456789abcdef\n").unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
    let file = path.to_str().unwrap();
    let mut settings = listening(&[TCP, WS]);
    settings.hub.token = Some(strapd::serve::guard::admission::Token::new(
        "0123456789abcdef",
    ));
    let daemon = Daemon::start(settings);
    for (n, scheme) in ["tcp", "ws"].into_iter().enumerate() {
        let url = format!("{scheme}://{}", daemon.address(n));
        let output = ended(cat(&[&url]));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("unauthorised"), "{said}");
        let output = ended(cat(&[&url, "--token-file", file, "-x", "0.3"]));
        assert_eq!(output.status.code(), Some(0), "{output:?}");
    }
}

#[test]
fn datagrams_are_listened_for() {
    let mut child = cat(&["udp-listen://127.0.0.1:0", "-n", "2"]);
    let mut log = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    log.read_line(&mut line).unwrap();
    let address = line.trim().rsplit("udp-listen://").next().unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let att = r#"{"class":"ATT","id":"u","seq":1,"stamp":{"sec":1,"nsec":0},"q":{"w":1.0,"x":0.0,"y":0.0,"z":0.0}}"#;
    socket
        .send_to(format!("{att}\n{att}").as_bytes(), address)
        .unwrap();
    let output = ended(child);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(text(&output.stdout), format!("{att}\n{att}\n"));
}

/// Takes one connection, sends these bytes and closes.
fn impostor(bytes: Vec<u8>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.write_all(&bytes).unwrap();
        stream.shutdown(std::net::Shutdown::Write).unwrap();
        let _ = stream.read_to_end(&mut Vec::new());
    });
    format!("tcp://{address}")
}

#[test]
fn nothing_a_daemon_says_commands_the_terminal() {
    let hostile = "{\"class\":\"ATT\",\"id\":\"a\u{9b}31m\u{202e}\\u001b[2J\",\r\"q\":{\"w\":1,\"x\":0,\"y\":0,\"z\":0},\"status\":[\"\\u001b[31m\"]}\n{\"class\":\"ERROR\",\"code\":\"\\u001b[31m\",\"message\":\"\\u0007\"}\n\u{1b}]0;x\u{7}\n{\"class\":\"GAP\",\"id\":\"\\u001b\",\"dropped\":3}\n";
    for format in ["ndjson", "csv", "table"] {
        let output = ended(cat(&[&impostor(hostile.into()), "--format", format]));
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        for said in [text(&output.stdout), text(&output.stderr)] {
            let bad = said
                .chars()
                .find(|c| (c.is_control() && *c != '\n') || *c == '\u{202e}');
            assert_eq!(bad, None, "{format}: {said:?}");
        }
        if format == "ndjson" {
            let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            assert_eq!(value["id"], "a\u{9b}31m\u{202e}\u{1b}[2J", "the same JSON");
        }
        let said = text(&output.stderr);
        assert!(said.contains("3 attitudes came faster"), "{said}");
    }
}

/// Lines without end that are no attitudes: of no strapd, and of one that does nothing but complain.
#[test]
fn whoever_says_nothing_but_nonsense_is_left_with_few_words() {
    let nonsense: String = (0..200_000).map(|n| format!("nonsense {n}\n")).collect();
    let complaints = "{\"class\":\"ERROR\",\"code\":\"x\",\"message\":\"y\"}\n".repeat(200_000);
    for (bytes, said_once) in [(nonsense, "nonsense 7"), (complaints, "says x: y")] {
        let output = ended(cat(&[&impostor(bytes.into_bytes())]));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.len() < 4096, "{} bytes", said.len());
        assert!(said.contains(said_once), "{said}");
        assert!(said.contains("is this the port of a strapd?"), "{said}");
        assert!(said.contains("more lines were wrong"), "{said}");
    }
}

#[test]
fn flags_of_files_and_of_daemons_are_told_apart() {
    for (args, part) in [
        (vec!["tcp://127.0.0.1:1", "--topic", "a"], "--id NAME"),
        (vec!["tcp://127.0.0.1"], "a port is needed"),
        (vec!["wss://127.0.0.1:1"], "no encryption"),
        (vec!["a.mcap", "-x", "1"], "-x is for daemons"),
        (vec!["tcp://127.0.0.1:1", "-x", "0"], "above 0"),
    ] {
        let output = ended(cat(&args));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(part), "{args:?}: {said}");
    }
}
