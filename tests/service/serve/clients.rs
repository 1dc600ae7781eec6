//! `--max-clients`: how many may connect, and what becomes of one more.

use super::client::{Client, get};
use super::daemon::{PATIENCE, Process, TCP, WS, strapd};
use std::io::{BufRead, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

const SECRET: &str = "correct horse battery";
const AUTH: &str = "{\"class\":\"AUTH\",\"token\":\"correct horse battery\"}";

/// The answer to a request for a WebSocket with more headers, where it is refused.
fn upgrade(address: SocketAddr, more: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    write!(
        stream,
        "GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{more}\r\n"
    )
    .unwrap();
    let mut answer = Vec::new();
    while !answer.ends_with(b"}\n") {
        let mut some = [0; 1024];
        let n = stream.read(&mut some).unwrap();
        assert!(n > 0, "{}", answer.escape_ascii());
        answer.extend(&some[..n]);
    }
    String::from_utf8(answer).unwrap()
}

/// A counter of the metrics.
fn counted(process: &Process, name: &str, headers: &[(&str, &str)]) -> u64 {
    let (status, text) = get(process.address(1), "/metrics", headers);
    assert_eq!(status, 200, "{text}");
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix(&format!("strapd_{name} ")));
    line.unwrap().parse().unwrap()
}

/// Ends it, and returns the warnings of the log that speak of those who were turned away.
fn warnings(mut process: Process) -> Vec<String> {
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let log = process.log.by_ref().lines().map(Result::unwrap);
    log.filter(|line| line.contains("WARN") && line.contains("turned away"))
        .collect()
}

/// A client that was answered, and so is served.
fn served(mut client: Client) -> Client {
    client.send("{\"class\":\"POLL\"}");
    client.next_of("STATUS");
    client
}

#[test]
fn one_more_than_may_connect_is_told_counted_and_logged_once() {
    let process = Process::start(&["--listen", TCP, "--listen", WS, "--max-clients", "3"]);
    let _served: Vec<Client> = [
        Client::tcp(process.address(0)),
        Client::tcp(process.address(0)),
        Client::web(process.address(1)),
    ]
    .map(served)
    .into();
    for _ in 0..5 {
        let mut one_more = Client::tcp(process.address(0));
        let said = one_more.object("ERROR");
        assert_eq!(said["code"], "too_many_clients");
        assert!(said.to_string().contains("3 connections"), "{said}");
        assert!(said.to_string().contains("--max-clients"), "{said}");
        assert_eq!(one_more.line(), None);
    }
    let answer = upgrade(process.address(1), "");
    assert!(answer.starts_with("HTTP/1.1 503 "), "{answer}");
    assert!(answer.contains("\"too_many_clients\""), "{answer}");
    let host = [("Host", "localhost")];
    assert_eq!(counted(&process, "connections_refused_total", &host), 6);
    // Whoever wonders at the other end reads why.
    let cat = Command::new(strapd())
        .args(["cat", &format!("tcp://{}", process.address(0))])
        .output()
        .unwrap();
    let complaint = String::from_utf8_lossy(&cat.stderr).into_owned();
    assert!(!cat.status.success(), "{complaint}");
    assert!(complaint.contains("--max-clients"), "{complaint}");
    let warnings = warnings(process);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("--max-clients"), "{warnings:?}");
}

#[test]
fn so_it_is_of_those_who_have_shown_the_token() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("token");
    std::fs::write(&file, SECRET).unwrap();
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o600)).unwrap();
    let process = Process::start(&[
        "--listen",
        TCP,
        "--listen",
        WS,
        "--max-clients",
        "2",
        "--token-file",
        file.to_str().unwrap(),
    ]);
    let with_token = |mut client: Client| {
        client.send(AUTH);
        client
    };
    let tcp = || with_token(Client::tcp(process.address(0)));
    let web = || with_token(Client::web(process.address(1)));
    let _served = [served(tcp()), served(web())];
    for mut one_more in [tcp(), tcp(), web()] {
        let said = one_more.next_of("ERROR");
        assert_eq!(said["code"], "too_many_clients");
        assert_eq!(one_more.line(), None);
    }
    let bearer = format!("Bearer {SECRET}");
    let bearer = ("Authorization", &*bearer);
    let answer = upgrade(
        process.address(1),
        &format!("Authorization: {}\r\n", bearer.1),
    );
    assert!(answer.starts_with("HTTP/1.1 503 "), "{answer}");
    assert!(answer.contains("\"too_many_clients\""), "{answer}");
    let headers = [("Host", "localhost"), bearer];
    assert_eq!(counted(&process, "connections_refused_total", &headers), 4);
    let warnings = warnings(process);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
}

#[test]
fn how_many_may_connect_is_said_by_flag_environment_or_file() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("strapd.toml");
    std::fs::write(&file, "max-clients = 7\n").unwrap();
    let shown = |environment: Option<&str>| {
        let mut command = Command::new(strapd());
        command.args(["config", "show"]).arg(&file);
        match environment {
            Some(value) => command.env("STRAPD_MAX_CLIENTS", value),
            None => command.env_remove("STRAPD_MAX_CLIENTS"),
        };
        let output = command.output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let line = |text: String| {
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let line = text.lines().find(|line| line.starts_with("max-clients"));
        line.map(words).unwrap()
    };
    assert_eq!(line(shown(None)), "max-clients = \"7\" # file");
    assert_eq!(line(shown(Some("9"))), "max-clients = \"9\" # environment");
    for wrong in ["0", "-1", "many", "100001"] {
        let output = Command::new(strapd())
            .args(["serve", "--listen", TCP, "--max-clients", wrong])
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{wrong}");
    }
}
