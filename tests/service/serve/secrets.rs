//! Promise: secrets stand in nothing that is printed, logged, served or written.

use super::client::{Client, get, rate};
use super::daemon::{Process, TCP, WS, strapd};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

/// Secret in every token, password and value of a query.
const SECRET: &str = "s3cret";
/// Folder in paths, which the user's own terminal may show.
const FOLDER: &str = "h0me-of-ada";
const LOG: &str = "fixtures/xsens_mti.mcap";

fn assert_hidden(what: &str, said: &[u8], hidden: &str) {
    let at = said
        .windows(hidden.len())
        .position(|w| w == hidden.as_bytes());
    assert!(
        at.is_none(),
        "{what}: `{hidden}` in {}",
        String::from_utf8_lossy(said)
    );
}

/// Every file below a folder, but for those that are secrets.
fn assert_hidden_in_files(folder: &Path, hidden: &[&str]) -> usize {
    let mut files = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files += assert_hidden_in_files(&path, hidden);
        } else if !path.ends_with("token") && !path.ends_with("log.mcap") {
            let bytes = std::fs::read(&path).unwrap();
            for hidden in hidden {
                assert_hidden(&path.display().to_string(), &bytes, hidden);
            }
            files += 1;
        }
    }
    files
}

fn run(args: &[&str]) -> Output {
    Command::new(strapd())
        .args(args)
        .env_remove("STRAPD_LOG")
        .output()
        .unwrap()
}

#[test]
fn an_address_that_is_refused_is_shown_without_its_secrets() {
    let password = format!("ada:{SECRET}@127.0.0.1:9");
    let query = format!("127.0.0.1:9?key={SECRET}");
    let schemes = [
        "tcp",
        "ws",
        "udp",
        "wss",
        "unix",
        "tcp-listen",
        "ws-listen",
        "ftp",
    ];
    for address in schemes.iter().flat_map(|scheme| {
        [
            format!("{scheme}://{password}"),
            format!("{scheme}://{query}"),
        ]
    }) {
        let a = address.as_str();
        let mut commands = vec![
            vec!["replay", LOG, "-o", a],
            vec!["replay", LOG, "-o", "null:", "-o", a],
            vec!["serve", "--listen", a],
            vec!["serve", "--listen", TCP, "-o", a],
            vec!["send", LOG, a],
            vec!["cat", a, "-x", "0.1"],
            vec!["simulate", "coning", "-o", a],
        ];
        // A query of a WebSocket is its server's: that is no error, and waited for.
        if !a.starts_with("ws://127") {
            commands.push(vec!["serve", a, "--listen", TCP]);
            commands.push(vec!["watch", a]);
        }
        for command in commands {
            let ran = run(&command);
            let words = command.join(" ");
            let said = String::from_utf8_lossy(&ran.stderr).into_owned();
            assert!(!ran.status.success(), "{words}");
            assert!(
                said.contains("error: ") && !said.contains("unexpected"),
                "{words}: {said}"
            );
            assert_hidden(&words, &ran.stdout, SECRET);
            assert_hidden(&words, said.as_bytes(), SECRET);
        }
    }
}

#[test]
fn what_is_written_says_neither_folders_nor_secrets() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join(FOLDER);
    let out = home.join("out");
    std::fs::create_dir_all(&out).unwrap();
    let log = home.join("log.mcap");
    std::fs::copy(LOG, &log).unwrap();
    let log = log.to_str().unwrap();
    let name = |file: &str| out.join(file).to_str().unwrap().to_owned();
    for args in [
        &[
            "replay",
            log,
            "--compression",
            "none",
            "-o",
            &name("a.mcap"),
            "-o",
            &name("a.csv"),
        ][..],
        &[
            "replay",
            log,
            "-o",
            &name("b.ndjson"),
            "-o",
            &name("b.tum"),
            "--save-calibration",
            &name("c.toml"),
        ],
        &["report", log, "-o", &name("r.html")],
        &[
            "report",
            log,
            "-o",
            &name("s.html"),
            "--reference",
            log,
            "--ref-topic",
            "/imu/data",
        ],
        &[
            "simulate",
            "coning",
            "--duration",
            "2",
            "--compression",
            "none",
            "-o",
            &name("s.mcap"),
        ],
    ] {
        let ran = run(args);
        let said = String::from_utf8_lossy(&ran.stderr);
        assert!(matches!(ran.status.code(), Some(0 | 3)), "{args:?}: {said}");
    }
    assert!(assert_hidden_in_files(&out, &[FOLDER]) >= 8);
    // Who asks for them has them.
    let with = name("with.mcap");
    let ran = run(&[
        "replay",
        log,
        "-o",
        &with,
        "--record-paths",
        "--compression",
        "none",
    ]);
    assert!(ran.status.success(), "{ran:?}");
    let bytes = std::fs::read(&with).unwrap();
    assert!(bytes.windows(FOLDER.len()).any(|w| w == FOLDER.as_bytes()));
    let page = name("with.html");
    assert!(
        run(&["report", log, "-o", &page, "--record-paths"])
            .status
            .success()
    );
    assert!(std::fs::read_to_string(&page).unwrap().contains(FOLDER));
}

/// Answers everybody with a refusal, and gives back what was asked for first.
fn refusing() -> (u16, std::thread::JoinHandle<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let asked = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut request = [0; 4096];
        let n = stream.read(&mut request).unwrap();
        let no = b"HTTP/1.1 403 Forbidden\r\ncontent-length: 0\r\n\r\n";
        stream.write_all(no).unwrap();
        String::from_utf8_lossy(&request[..n]).into_owned()
    });
    (port, asked)
}

#[test]
fn a_daemon_keeps_the_secrets_it_is_given() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join(FOLDER);
    std::fs::create_dir(&home).unwrap();
    let token = home.join("token");
    let words = format!("{SECRET}-correct-horse-battery");
    std::fs::write(&token, format!("{words}\n")).unwrap();
    std::fs::set_permissions(&token, std::fs::Permissions::from_mode(0o600)).unwrap();
    let name = |file: &str| home.join(file).to_str().unwrap().to_owned();
    let (port, asked) = refusing();
    let phone =
        format!("ws://127.0.0.1:{port}/sensor/connect?type=android.sensor.gyroscope&key={SECRET}");
    let nobody = format!("tcp://127.0.0.1:9?token-file={}&id=arm", token.display());
    let mut daemon = Process::start(&[
        "--listen",
        TCP,
        "--listen",
        WS,
        &phone,
        &nobody,
        "--token-file",
        token.to_str().unwrap(),
        "--record",
        &name("r.mcap"),
        "--state",
        &name("state.json"),
        "-vv",
    ]);
    // The key goes to whom it is for.
    assert!(asked.join().unwrap().contains(&format!("key={SECRET}")));

    let mut client = Client::tcp(daemon.address(0));
    client.send(&format!("{{\"class\":\"AUTH\",\"token\":\"{words}\"}}"));
    for n in 0..50 {
        client.send(&rate("imu", n, 10.0));
    }
    client.send("{\"class\":\"POLL\"}");
    let status = std::iter::from_fn(|| client.line())
        .map(|line| serde_json::from_str::<Value>(&line).unwrap())
        .find(|said| said["class"] == "STATUS")
        .unwrap();
    let uris: Vec<&str> = status["outgoing"]
        .as_array()
        .unwrap()
        .iter()
        .map(|o| o["uri"].as_str().unwrap())
        .collect();
    assert_eq!(
        uris,
        [
            format!("ws://127.0.0.1:{port}/sensor/connect?type=...&key=..."),
            "tcp://127.0.0.1:9?id=arm".to_owned()
        ]
    );
    for hidden in [SECRET, FOLDER] {
        assert_hidden("STATUS", status.to_string().as_bytes(), hidden);
    }
    let web = daemon.address(1);
    let host = web.to_string();
    let bearer = format!("Bearer {words}");
    let (code, metrics) = get(
        web,
        "/metrics",
        &[("host", &host), ("authorization", &bearer)],
    );
    assert_eq!(code, 200, "{metrics}");
    assert!(metrics.contains("outgoing_attempts_total"), "{metrics}");
    for hidden in [SECRET, FOLDER] {
        assert_hidden("/metrics", metrics.as_bytes(), hidden);
    }
    daemon.signal("TERM");
    assert!(daemon.exit().is_some());
    let mut log = std::mem::take(&mut daemon.early);
    daemon.log.read_to_string(&mut log).unwrap();
    assert!(log.contains("403"), "{log}");
    assert_hidden("the log", log.as_bytes(), SECRET);
    // The recording, the state, and the lock beside it.
    assert_eq!(assert_hidden_in_files(&home, &[SECRET, FOLDER]), 3);
}
