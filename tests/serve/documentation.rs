//! The examples of `docs/protocol.md` do what they say.

use super::client::Client;
use super::daemon::{Daemon, TCP, WS, listening};
use std::process::Command;

const PAGE: &str = include_str!("../../docs/protocol.md");

/// The code blocks of a language.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    PAGE.split(&fence)
        .skip(1)
        .map(|rest| rest.split("\n```").next().unwrap())
        .collect()
}

#[test]
fn the_python_example_turns_by_ninety_degrees() {
    let daemon = Daemon::tcp();
    let script = blocks("python");
    assert_eq!(script.len(), 1);
    let port = daemon.address(0).port().to_string();
    let output = Command::new("python3")
        .args(["-c", &script[0].replace("4550", &port)])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(
        String::from_utf8(output.stdout).unwrap(),
        "yaw 90.000000 deg\n"
    );
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
    client.send(&of("WATCH").to_string());
    seen.push(client.object("WATCH"));
    client.send(&of("RATE").to_string());
    seen.push(client.object("ATT"));
    client.send("{\"class\":\"RATE\" \"gyro\":1}");
    seen.push(client.object("ERROR"));
    for object in &seen {
        // The answer to WATCH is the second of its class.
        let class = &object["class"];
        let example = shown.iter().rfind(|v| v["class"] == *class).unwrap();
        let keys = |v: &serde_json::Value| {
            let mut keys: Vec<String> = v.as_object().unwrap().keys().cloned().collect();
            keys.sort();
            keys
        };
        assert_eq!(keys(object), keys(example), "{class}");
    }
    let error = seen.last().unwrap();
    assert_eq!(error["message"], of("ERROR")["message"]);
    assert_eq!(error["near"], of("ERROR")["near"]);
}

#[test]
fn the_page_names_the_addresses_it_listens_on_by_default() {
    for uri in strapd::serve::address::DEFAULTS {
        let listen = strapd::serve::address::Listen::parse(uri).unwrap();
        assert!(listen.ip().unwrap().is_loopback());
        assert!(PAGE.contains(uri.split_once("://").unwrap().1), "{uri}");
    }
}
