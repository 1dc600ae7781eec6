//! Playback: stopped, moved, begun anew.

use super::lines::{LOG, lines_of, of_class};
use super::watched::paused;
use crate::serve::client::Client;
use crate::serve::daemon::{Daemon, Process, TCP, WS};
use serde_json::{Value, json};

/// A page is shown what was recorded as well, as a stream of its own.
const ESTIMATES: &str = r#"{"class":"WATCH","id":"/imu/data"}"#;

/// Numbers of the attitudes among lines.
fn seqs(lines: &[String]) -> Vec<u64> {
    let seq = |line: &String| serde_json::from_str::<Value>(line).unwrap()["seq"].as_u64();
    of_class(lines, "ATT").iter().filter_map(seq).collect()
}

/// Every line up to where the playback has ended.
fn to_the_end(client: &mut Client) -> Vec<String> {
    let mut lines = Vec::new();
    while let Some(line) = client.line() {
        let ended = line.contains("\"class\":\"PLAYBACK\"") && line.contains("\"ended\"");
        lines.push(line);
        if ended {
            return lines;
        }
    }
    unreachable!("closed before the end: {:?}", lines.last())
}

/// A stamp so many seconds after another.
fn later(stamp: &Value, secs: i64) -> Value {
    json!({"sec": stamp["sec"].as_i64().unwrap() + secs, "nsec": stamp["nsec"]})
}

fn is_tail_of(lines: &[String], all: &[String]) -> usize {
    let shown = of_class(lines, "ATT");
    let tail = &all[all.len() - shown.len()..];
    assert!(shown == tail, "other bytes than in an undisturbed run");
    shown.len()
}

#[test]
fn attitudes_after_a_seek_forward_or_backward_are_those_of_an_undisturbed_run() {
    let all = lines_of(&format!("replay {LOG}"));
    let mut process = Process::of(&[
        "replay",
        LOG,
        "--page=127.0.0.1:0",
        "--paused",
        "--speed",
        "10",
    ]);
    let mut client = Client::web(process.address(0)).watching(ESTIMATES);
    let mut place = client.next_of("PLAYBACK");
    while place["start"].is_null() {
        place = client.next_of("PLAYBACK");
    }
    let (start, session) = (place["start"].clone(), place["session"].clone());
    assert!(
        LOG.ends_with(&format!("/{}", place["file"].as_str().unwrap())),
        "{place}"
    );
    assert!(!place["file"].as_str().unwrap().contains('/'));
    // 12 of 19 s ahead, while it waits: one attitude shows where it is.
    let at = later(&start, 12);
    assert_eq!(client.play(&format!("\"seek\",\"at\":{at}"))["at"], at);
    let shown: Value = serde_json::from_str(&client.line().unwrap()).unwrap();
    let shown = if shown["class"] == "ATT" {
        shown
    } else {
        client.next_of("ATT")
    };
    assert_eq!(shown["stamp"], at);
    assert_eq!(client.play("\"play\"")["state"], "playing");
    let count = is_tail_of(&to_the_end(&mut client), &all);
    // At 50 Hz, the one that was shown already left out.
    assert_eq!(count, 953 - 600 - 1);

    // After the end, back to 5 s.
    let at = later(&start, 5);
    let answer = client.play(&format!("\"seek\",\"at\":{at}"));
    assert_eq!((&answer["at"], &answer["state"]), (&at, &json!("paused")));
    assert_eq!(client.next_of("ATT")["stamp"], at);
    assert_eq!(client.play("\"speed\",\"speed\":20.0")["speed"], 20.0);
    let place = client.play("\"play\"");
    assert_ne!(
        place["session"], session,
        "attitudes before and after do not belong together"
    );
    assert_eq!(is_tail_of(&to_the_end(&mut client), &all), 953 - 250 - 1);

    // And from the start.
    client.play("\"play\"");
    assert_eq!(is_tail_of(&to_the_end(&mut client), &all), 953);
    process.signal("INT");
    assert_eq!(client.line(), None);
    assert_eq!(process.exit(), Some(0));
}

#[test]
fn a_seek_in_the_middle_shows_what_an_undisturbed_run_shows_there() {
    let all = lines_of(&format!("replay {LOG}"));
    let process = paused(&format!("replay {LOG} --loop"), &[TCP]);
    let mut client = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH"}"#);
    client.play("\"play\"");
    let first = client.next_of("ATT");
    for (secs, from) in [(9, 450), (2, 100), (15, 750), (1, 50)] {
        client.play(&format!("\"seek\",\"at\":{}", later(&first["stamp"], secs)));
        // What was on its way when the seek was asked for has other stamps.
        let stamp = |line: &str| serde_json::from_str::<Value>(line).unwrap()["stamp"].clone();
        let wanted = stamp(&all[from]);
        let line = std::iter::from_fn(|| client.line()).find(|line| stamp(line) == wanted);
        let line = line.expect("it does not come");
        assert_eq!(line, all[from], "{secs} s");
    }
}

#[test]
fn a_pause_stops_it_and_play_goes_on_where_it_was() {
    let process = paused(&format!("replay {LOG}"), &[TCP]);
    let mut client = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH"}"#);
    let mut other = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH","ids":[]}"#);
    client.play("\"play\"");
    client.next_of("ATT");
    let paused = client.play("\"pause\"");
    assert_eq!(paused["state"], "paused");
    // The others are told.
    while other.next_of("PLAYBACK")["state"] != "paused" {}
    client.play("\"play\"");
    let lines = to_the_end(&mut client);
    let seqs = seqs(&lines);
    assert!(
        seqs.windows(2).all(|pair| pair[1] == pair[0] + 1),
        "{seqs:?}"
    );
    assert_eq!(seqs.last(), Some(&952));
}

#[test]
fn a_loop_begins_again_as_another_session_with_another_reset_count() {
    let mut process = paused(&format!("replay {LOG} --loop"), &[TCP]);
    let mut client = Client::tcp(process.address(0)).watching(r#"{"class":"WATCH"}"#);
    client.play("\"speed\",\"speed\":200");
    let first = client.play("\"play\"")["session"].clone();
    let mut last = client.next_of("ATT");
    loop {
        let next = client.next_of("ATT");
        if next["seq"] == 0 {
            break assert_eq!(
                (&last["seq"], &last["reset"], &next["reset"]),
                (&json!(952), &json!(0), &json!(1))
            );
        }
        last = next;
    }
    while client.next_of("PLAYBACK")["session"] == first {}
    process.signal("TERM");
    client.lines();
    assert_eq!(process.exit(), Some(0));
}

#[test]
fn who_comes_after_the_end_or_while_it_waits_sees_what_was_shown_last() {
    let all = lines_of(&format!("replay {LOG}"));
    let process = Process::of(&[
        "replay",
        LOG,
        "--page=127.0.0.1:0",
        "--paused",
        "--speed",
        "100",
    ]);
    let watch = ESTIMATES;
    let last_of_another = |expected: &str| {
        let mut late = Client::web(process.address(0)).watching(watch);
        let mut att = late.next_of("ATT");
        let status = att["status"].as_array_mut().unwrap();
        let at = status.iter().position(|s| s == "last").expect("not marked");
        status.remove(at);
        if status.is_empty() {
            status.push(json!("ok"));
        }
        assert_eq!(att, serde_json::from_str::<Value>(expected).unwrap());
        // And nothing else: the next it is told is an answer.
        late.send(r#"{"class":"POLL"}"#);
        let next = late.line().unwrap();
        assert!(next.contains("\"class\":\"STATUS\""), "{next}");
    };
    let mut client = Client::web(process.address(0)).watching(watch);
    client.play("\"play\"");
    to_the_end(&mut client);
    last_of_another(&all[952]);
    let first: Value = serde_json::from_str(&all[0]).unwrap();
    let at = later(&first["stamp"], 5);
    client.play(&format!("\"seek\",\"at\":{at}"));
    assert_eq!(client.next_of("ATT")["stamp"], at);
    last_of_another(&all[250]);
}

#[test]
fn what_can_not_be_done_is_answered_with_an_error() {
    let code = |client: &mut Client, action: &str| {
        client.send(&format!("{{\"class\":\"PLAYBACK\",\"action\":{action}}}"));
        client.next_of("ERROR")["code"].as_str().unwrap().to_owned()
    };
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0));
    assert_eq!(code(&mut client, "\"play\""), "nothing_to_play");

    let process = paused(&format!("replay {LOG}"), &[WS, "null:"]);
    let mut client = Client::web(process.address(0)).watching(r#"{"class":"WATCH"}"#);
    client.play("\"play\"");
    let first = client.next_of("ATT");
    for (action, expected) in [
        ("\"speed\",\"speed\":0", "bad_playback"),
        ("\"speed\",\"speed\":1e300", "bad_playback"),
        ("\"stop\"", "bad_playback"),
        ("7", "bad_playback"),
    ] {
        assert_eq!(code(&mut client, action), expected, "{action}");
    }
    let back = format!("\"seek\",\"at\":{}", first["stamp"]);
    assert_eq!(code(&mut client, &back), "forward_only");
}
