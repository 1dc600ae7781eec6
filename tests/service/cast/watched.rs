//! `-o tcp-listen://`, `unix-listen://`, `ws-listen://`.

use super::lines::{LOG, SIMULATION, lines_of, of_class};
use crate::program::strapd;
use crate::serve::client::{Client, get};
use crate::serve::daemon::{Process, TCP, WS, eventually};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::core::session::{Scratch, Session};
use strapd::serve::playback::controls::Playback;
use strapd_attitude::record::Nanos;

/// Started, and waiting for a client to say `play`.
pub(crate) fn paused(arguments: &str, sinks: &[&str]) -> Process {
    let mut args: Vec<&str> = arguments.split(' ').collect();
    for sink in sinks {
        args.extend(["-o", sink]);
    }
    args.extend(["--speed", "10", "--paused"]);
    Process::of(&args)
}

#[test]
fn every_transport_of_a_replay_brings_the_bytes_of_standard_output_and_then_closes() {
    let dir = tempfile::tempdir().unwrap();
    let socket = dir.path().join("s.sock");
    let unix = format!("unix-listen://{}", socket.display());
    let file = dir.path().join("beside.ndjson");
    let mut process = paused(
        &format!("replay {LOG}"),
        &[TCP, WS, &unix, file.to_str().unwrap()],
    );
    let watch = r#"{"class":"WATCH"}"#;
    let mut clients = [
        Client::tcp(process.address(0)).watching(watch),
        Client::web(process.address(1)).watching(watch),
        Client::unix(&socket).watching(watch),
    ];
    assert_eq!(
        get(process.address(1), "/healthz", &[("Host", "localhost")]),
        (200, "ok\n".to_owned())
    );
    clients[0].send(r#"{"class":"PLAYBACK","action":"play"}"#);
    let expected = lines_of(&format!("replay {LOG}"));
    assert_eq!(expected.len(), 953);
    // All at once: a Unix socket holds less than the run.
    let readers = clients
        .into_iter()
        .map(|mut client| std::thread::spawn(move || client.lines()));
    for reader in readers.collect::<Vec<_>>() {
        let lines = reader.join().unwrap();
        assert_eq!(of_class(&lines, "GAP"), [""; 0]);
        assert!(of_class(&lines, "ATT") == expected, "other bytes");
        assert!(lines.last().unwrap().contains("\"state\":\"ended\""));
    }
    assert_eq!(process.exit(), Some(0));
    assert!(!socket.exists());
    let written = std::fs::read_to_string(file).unwrap();
    assert!(written.lines().eq(expected), "the file beside");
}

#[test]
fn of_a_run_that_is_paused_who_leaves_keeps_no_place_and_who_ends_its_side_gets_it_all() {
    let dir = tempfile::tempdir().unwrap();
    let socket = dir.path().join("s.sock");
    let unix = format!("unix-listen://{}", socket.display());
    let mut process = paused(&format!("replay {LOG}"), &[TCP, &unix]);
    let watch = r#"{"class":"WATCH"}"#;
    let mut staying = Client::tcp(process.address(0)).watching(watch);
    staying.shut();
    for _ in 0..20 {
        drop(Client::unix(&socket).watching(watch));
    }
    let mut asker = Client::tcp(process.address(0));
    eventually("those who left to be gone", || {
        asker.send(r#"{"class":"POLL"}"#);
        let status = asker.next_of("STATUS");
        status["clients"].as_array().unwrap().len() == 2
    });
    asker.send(r#"{"class":"PLAYBACK","action":"play"}"#);
    let expected = lines_of(&format!("replay {LOG}"));
    let reader = std::thread::spawn(move || staying.lines());
    asker.lines();
    assert!(
        of_class(&reader.join().unwrap(), "ATT") == expected,
        "other bytes"
    );
    assert_eq!(process.exit(), Some(0));
}

#[test]
fn whoever_watches_a_simulation_gets_samples_and_truth_or_one_of_them() {
    let process = paused(SIMULATION, &[TCP]);
    let mut all = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH"}"#);
    let watching = |request: &str, answer: &str| {
        let mut client = Client::tcp(process.address(0));
        client.send(request);
        assert_eq!(client.next_of("WATCH")["streams"].to_string(), answer);
        client
    };
    let mut rates = watching(r#"{"class":"WATCH","streams":["RATE"]}"#, r#"["RATE"]"#);
    let mut truth = watching(r#"{"class":"WATCH","id":"truth"}"#, r#"["ATT","RATE"]"#);
    all.send(r#"{"class":"PLAYBACK","action":"play"}"#);
    let expected = lines_of(SIMULATION);
    let of = |class| of_class(&expected, class);
    assert!(of("RATE").len() > 350 && of("ATT").len() == 401);
    let lines = all.lines();
    assert!(of_class(&lines, "RATE") == of("RATE") && of_class(&lines, "ATT") == of("ATT"));
    let lines = rates.lines();
    assert!(of_class(&lines, "RATE") == of("RATE") && of_class(&lines, "ATT").is_empty());
    let lines = truth.lines();
    assert!(of_class(&lines, "RATE").is_empty() && of_class(&lines, "ATT") == of("ATT"));
}

#[test]
fn samples_of_a_simulation_can_be_asked_for_before_it_has_begun() {
    for (brings_samples, answer) in [(true, "WATCH"), (false, "ERROR")] {
        let playback = Playback::new("simulate top", Some(1.0), true);
        let hub = Hub::new(Settings {
            timeline: Some(Arc::new(playback)),
            brings_samples,
            ..Settings::default()
        });
        let mut early = Session::new(&Arc::new(hub.unwrap()), "early".to_owned(), true);
        let asked = b"{\"class\":\"WATCH\",\"streams\":[\"RATE\"]}\n";
        early.bytes(asked, Nanos(0), &mut Scratch::default());
        let mut parts = VecDeque::new();
        early.client().outbox.take(usize::MAX, &mut parts);
        let last = parts.back().unwrap();
        let said: serde_json::Value = serde_json::from_slice(last).unwrap();
        assert_eq!(said["class"], answer, "{said}");
    }
}

#[test]
fn who_watches_late_is_told_where_a_paused_replay_is_now() {
    let playback = Arc::new(Playback::new("flight.mcap", Some(1.0), true));
    let hub = Hub::new(Settings {
        timeline: Some(playback.clone()),
        ..Settings::default()
    });
    let mut session = Session::new(&Arc::new(hub.unwrap()), "page".to_owned(), true);
    let places = |session: &mut Session, line: &[u8]| -> Vec<serde_json::Value> {
        session.bytes(line, Nanos(0), &mut Scratch::default());
        let mut parts = VecDeque::new();
        session.client().outbox.take(usize::MAX, &mut parts);
        parts
            .iter()
            .map(|part| serde_json::from_slice(part).unwrap())
            .filter(|said: &serde_json::Value| said["class"] == "PLAYBACK")
            .collect()
    };
    // Nothing was read when it was greeted, and nobody is told what is read before it watches.
    assert!(places(&mut session, b"")[0]["start"].is_null());
    let _ = playback.grant([Nanos(5_000_000_000)].into_iter());
    let told = places(&mut session, b"{\"class\":\"WATCH\"}\n");
    assert_eq!(told.len(), 1);
    assert_eq!(told[0]["start"]["sec"], 5);
    // Who knows it already is not told again.
    let stop = places(&mut session, b"{\"class\":\"WATCH\",\"enable\":false}\n");
    assert!(stop.is_empty(), "{stop:?}");
}

#[test]
fn a_replay_takes_no_samples_and_says_so() {
    let process = paused(&format!("replay {LOG}"), &[TCP]);
    let mut client = Client::tcp(process.address(0));
    assert_eq!(client.object("VERSION")["proto"], 1);
    assert_eq!(client.object("PLAYBACK")["state"], "paused");
    client.send(r#"{"class":"RATE","gyro":[1,0,0],"stamp":{"sec":1,"nsec":0}}"#);
    let error = client.object("ERROR");
    assert_eq!(error["code"], "samples_not_taken");
    assert!(error["message"].as_str().unwrap().contains("strapd serve"));
    client.send(r#"{"class":"WATCH","streams":["RATE"]}"#);
    assert_eq!(client.object("ERROR")["code"], "bad_watch");
    let mut status = serde_json::Value::Null;
    eventually("its stream", || {
        client.send(r#"{"class":"POLL"}"#);
        status = client.next_of("STATUS");
        status["sources"][0]["class"] == "ATT"
    });
    assert_eq!(status["counters"]["samples_refused"], 1);
    // More than a slip: the daemon's limit holds here too.
    for _ in 0..21 {
        client.send(r#"{"class":"RATE","gyro":[1,0,0],"stamp":{"sec":1,"nsec":0}}"#);
    }
    assert_eq!(client.rest().last().unwrap()["code"], "too_many_errors");
}

#[test]
fn a_watcher_that_takes_nothing_loses_the_oldest_and_is_told_and_the_others_lose_nothing() {
    let arguments = "simulate top --rate-hz 4000 --duration 10";
    let process = paused(arguments, &[TCP]);
    let mut slow = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH"}"#);
    let mut other = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH","id":"truth"}"#);
    // Until the end: what a socket and an outbox hold is a fraction of it.
    other.send(r#"{"class":"PLAYBACK","action":"play"}"#);
    let lines = other.lines();
    assert_eq!(
        of_class(&lines, "ATT").len() + dropped(&lines, "truth"),
        40_001
    );
    let lines = slow.lines();
    let lost = dropped(&lines, "truth") + dropped(&lines, "imu");
    assert!(lost > 0, "nothing was lost");
    let got = of_class(&lines, "ATT").len() + of_class(&lines, "RATE").len();
    assert!(got + lost <= 80_002 && got > 0);
}

fn dropped(lines: &[String], id: &str) -> usize {
    of_class(lines, "GAP")
        .iter()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
        .filter(|gap| gap["id"] == id)
        .map(|gap| gap["dropped"].as_u64().unwrap() as usize)
        .sum()
}

#[test]
fn a_signal_ends_a_run_in_order_and_no_part_of_a_file_is_left() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("out.mcap");
    for (sinks, code) in [(vec![TCP], 0), (vec![TCP, file.to_str().unwrap()], 1)] {
        let mut process = paused(&format!("replay {LOG}"), &sinks);
        let mut client = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH"}"#);
        process.signal("TERM");
        client.lines();
        assert_eq!(process.exit(), Some(code));
    }
    eventually("an empty directory", || {
        std::fs::read_dir(dir.path()).unwrap().next().is_none()
    });
}

#[test]
fn what_can_not_be_served_is_refused_with_the_way_out() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (arguments, words) in [
        (
            "-o tcp-listen://0.0.0.0:0",
            &["-o tcp-listen://0.0.0.0:0", "--token-file"][..],
        ),
        ("-o udp-listen://127.0.0.1:0", &["udp://HOST:PORT sends"]),
        ("-o ws://127.0.0.1:1", &["unknown scheme", "ws-listen://"]),
        ("--paused -o null:", &["--paused", "--page"]),
        ("--loop", &["--loop", "nobody is served"]),
        (
            "--paused --speed max -o tcp-listen://127.0.0.1:0",
            &["--speed 1"],
        ),
        ("--page=nowhere", &["--page ws-listen://nowhere", "known"]),
        ("--page 8080", &["8080: no such file", "--page=8080"]),
        (
            "--against-recorded /imu/data",
            &["/imu/data: no such file", "--against-recorded=/imu/data"],
        ),
        ("-o {stm}.csv", &["{stm} stands for nothing", "{stem}"]),
        (
            "fixtures/ximu3.mcap -o tcp-listen://127.0.0.1:0",
            &["each of the 2 logs"],
        ),
    ] {
        strapd(root, &format!("replay {LOG} {arguments}")).refused(2, words);
    }
}
