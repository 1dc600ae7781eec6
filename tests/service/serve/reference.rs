//! A simulation's truth is passed on as it came, and touches no estimate.

use super::client::{Client, rate};
use super::daemon::{Daemon, TCP, listening};
use serde_json::{Value, json};

fn truth(n: u32, q: &Value) -> String {
    json!({
        "class": "ATT", "id": "truth", "seq": n, "stamp": {"sec": 1_700_000_000, "nsec": n * 1_000_000}, "q": q,
        "rotates": "sensor_to_world", "world": "enu", "body": "flu", "rate": [0.5, 0.25, -1.0],
    })
    .to_string()
}

fn q() -> Value {
    json!({"w": 0.5, "x": 0.5, "y": -0.5, "z": 0.5})
}

/// The next `count` attitudes.
fn attitudes(watcher: &mut Client, count: usize) -> Vec<Value> {
    (0..count).map(|_| watcher.next_of("ATT")).collect()
}

#[test]
fn truth_comes_beside_the_estimates_and_changes_none() {
    let mut told = Vec::new();
    for has_truth in [false, true] {
        let daemon = Daemon::start(listening(&[TCP]));
        let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
        let mut sender = Client::tcp(daemon.address(0));
        for n in 0..20 {
            sender.send(&rate("imu0", n, 3.0));
            if has_truth {
                sender.send(&truth(n as u32, &q()));
            }
        }
        let all = attitudes(&mut watcher, if has_truth { 40 } else { 20 });
        let (own, passed): (Vec<_>, Vec<_>) = all.into_iter().partition(|att| att["id"] == "imu0");
        told.push(own);
        for (n, att) in passed.iter().enumerate() {
            assert_eq!(att["q"], q(), "as it came");
            assert_eq!(att["seq"], n, "counted here");
            assert_eq!(att["rate"], json!([0.5, 0.25, -1.0]));
            assert_eq!(
                att["sigma_deg"],
                json!([null, null, null]),
                "nothing is said of its error"
            );
            assert_eq!(
                (&att["world"], &att["body"]),
                (&json!("enu"), &json!("flu"))
            );
        }
    }
    assert_eq!(told[0], told[1], "the estimates are those without it");
}

#[test]
fn there_are_no_more_truths_than_there_may_be_sensors() {
    let mut settings = listening(&[TCP]);
    settings.hub.limits = strapd::serve::guard::limits::Limits::of_sensors(2);
    let daemon = Daemon::start(settings);
    let mut one = Client::tcp(daemon.address(0));
    for id in ["a truth", "b truth", "c truth", "a truth"] {
        one.send(&truth(0, &q()).replace("\"truth\"", &format!("\"{id}\"")));
    }
    let said = one.next_of("ERROR");
    assert_eq!(said["code"], "too_many_sensors");
    let what = said["error"].as_str().unwrap_or_default().to_owned() + &said.to_string();
    assert!(
        what.contains("c truth") && what.contains("2 that may be"),
        "{said}"
    );
}

#[test]
fn what_is_no_truth_is_refused() {
    let daemon = Daemon::start(listening(&[TCP]));
    let mut one = Client::tcp(daemon.address(0));
    let refused = |client: &mut Client, line: &str| {
        client.send(line);
        client.next_of("ERROR")["code"].as_str().unwrap().to_owned()
    };
    for q in [
        json!({"w": 0, "x": 0, "y": 0, "z": 0}),
        json!({"w": 3, "x": 0, "y": 0, "z": 0}),
        json!([1, 0, 0, 0]),
        json!(null),
    ] {
        assert_eq!(refused(&mut one, &truth(0, &q)), "bad_reference", "{q}");
    }
    for (from, to) in [
        ("\"enu\"", "\"<b>\""),
        ("\"flu\"", "\"xyz\""),
        ("1700000000", "9223372036854775807"),
    ] {
        assert_eq!(
            refused(&mut one, &truth(0, &q()).replace(from, to)),
            "bad_reference",
            "{to}"
        );
    }
    let other = truth(0, &q()).replace("\"truth\"", "\"another\"");
    assert_eq!(refused(&mut one, &other), "unknown_class");
    // One client at a time, and of one kind of axes.
    one.send(&truth(0, &q()));
    let mut two = Client::tcp(daemon.address(0));
    one.send("{\"class\":\"POLL\"}");
    one.next_of("STATUS");
    assert_eq!(refused(&mut two, &truth(1, &q())), "id_in_use");
    assert_eq!(
        refused(&mut one, &truth(1, &q()).replace("\"enu\"", "\"ned\"")),
        "bad_reference"
    );
    // Whose name no sensor can take.
    assert_eq!(refused(&mut two, &rate("truth", 0, 1.0)), "id_in_use");
    // That of a sensor has a name of its own, and axes of its own.
    let mut other = Client::tcp(daemon.address(0));
    let own = |n| truth(n, &q()).replace("\"truth\"", "\"imu0 truth\"");
    two.send(&own(1).replace("\"enu\"", "\"ned\""));
    two.send("{\"class\":\"POLL\"}");
    two.next_of("STATUS");
    assert_eq!(refused(&mut other, &own(2)), "id_in_use");
    assert_eq!(refused(&mut two, &own(2)), "bad_reference");
    assert_eq!(
        refused(&mut other, &rate("imu0 truth", 0, 1.0)),
        "id_in_use"
    );
    let nobodys = own(3).replace("imu0 truth", " truth");
    assert_eq!(refused(&mut other, &nobodys), "unknown_class");
    // After the first has gone.
    drop(one);
    let mut watcher =
        Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\",\"last\":false}");
    loop {
        let mut three = Client::tcp(daemon.address(0));
        three.send(&truth(2, &q()));
        three.send("{\"class\":\"POLL\"}");
        let said = std::iter::repeat_with(|| three.line().unwrap());
        let answer = said
            .into_iter()
            .find(|line| line.contains("STATUS") || line.contains("ERROR"));
        if !answer.unwrap().contains("\"class\":\"ERROR\"") {
            break;
        }
    }
    assert_eq!(watcher.next_of("ATT")["q"], q());
    // Nor beside a sensor of that name.
    let daemon = Daemon::start(listening(&[TCP]));
    let mut one = Client::tcp(daemon.address(0));
    one.send(&rate("truth", 0, 1.0));
    assert_eq!(refused(&mut one, &truth(1, &q())), "id_in_use");
}
