//! A sensor that connects again goes on, sends again or begins anew, and is told which; a daemon that is
//! restarted goes on to the bit.
//!
//! Daemons are fed without sockets but for the first test: what is between two of them is their file.

use super::client::Client;
use super::daemon::{Daemon, eventually};
use serde_json::{Value, json};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::core::session::{Scratch, Session};
use strapd::serve::core::state::{Saved, Sensors};
use strapd_attitude::estimate::Memory;
use strapd_attitude::estimate::{EstimationSettings, settings};
use strapd_attitude::record::{Nanos, SampleKind};

/// Number `n` of a lively motion at 200 Hz, in words of its own: jittered by up to 0.4 ms, one in 97 lost.
fn lively(n: u64) -> Option<String> {
    let t = n as f64 * 5e-3;
    let jitter = (n * 7919 % 800) * 1000;
    let nanos = n * 5_000_000 + jitter;
    (n % 97 != 96).then(|| {
        json!({
            "class": "RATE", "id": "imu0", "seq": n,
            "stamp": {"sec": 1_700_000_000 + nanos / 1_000_000_000, "nsec": nanos % 1_000_000_000},
            "gyro": [0.9 * (17.0 * t).sin(), 3.0 * (9.0 * t).cos(), 0.4 + 2.0 * (31.0 * t + 1.0).sin()],
            "accel": [0.1 * (20.0 * t).sin(), -0.0, 9.80665],
        })
        .to_string()
    })
}

/// A daemon without sockets.
pub(crate) struct Fed {
    pub(crate) hub: Arc<Hub>,
    watcher: Session,
    scratch: Scratch,
}

/// Outcome of some lines.
#[derive(Debug, Default)]
pub(crate) struct Got {
    pub(crate) attitudes: Vec<String>,
    /// Answers to who sent them.
    pub(crate) said: Vec<Value>,
}

impl Got {
    fn first(&self) -> Value {
        serde_json::from_str(&self.attitudes[0]).unwrap()
    }

    pub(crate) fn codes(&self, class: &str) -> Vec<&str> {
        let of = |v: &&Value| v["class"] == class;
        self.said
            .iter()
            .filter(of)
            .map(|v| v["code"].as_str().unwrap())
            .collect()
    }
}

impl Fed {
    pub(crate) fn new(settings: Settings) -> Fed {
        let hub = Arc::new(Hub::new(settings).unwrap());
        let mut watcher = Session::new(&hub, "watcher".to_owned(), true);
        let mut scratch = Scratch::default();
        watcher.bytes(b"{\"class\":\"WATCH\"}\n", Nanos(0), &mut scratch);
        watcher
            .client()
            .outbox
            .take(usize::MAX, &mut VecDeque::new());
        Fed {
            hub,
            watcher,
            scratch,
        }
    }

    pub(crate) fn of(plan: &EstimationSettings) -> Fed {
        Fed::new(Settings {
            plan: plan.clone(),
            ..Settings::default()
        })
    }

    /// Another daemon, after this one was ended: between the two there is text.
    pub(crate) fn restarted(self, plan: &EstimationSettings) -> Fed {
        let text = serde_json::to_string(&self.hub.saved()).unwrap();
        Fed::new(Settings {
            plan: plan.clone(),
            saved: serde_json::from_str(&text).unwrap(),
            ..Settings::default()
        })
    }

    /// The samples with these numbers, by a connection of their own.
    fn send(&mut self, numbers: impl IntoIterator<Item = u64>) -> Got {
        self.lines(numbers.into_iter().filter_map(lively))
    }

    pub(crate) fn lines(&mut self, lines: impl IntoIterator<Item = String>) -> Got {
        let mut sender = Session::new(&self.hub, "sender".to_owned(), true);
        let mut got = Got::default();
        let mut parts = VecDeque::new();
        for line in lines {
            sender.bytes(format!("{line}\n").as_bytes(), Nanos(0), &mut self.scratch);
            let outbox = &self.watcher.client().outbox;
            let taken = outbox.take(usize::MAX, &mut parts);
            outbox.written(taken);
            for part in parts.drain(..) {
                let text = String::from_utf8(part.to_vec()).unwrap();
                got.attitudes.extend(text.lines().map(str::to_owned));
            }
        }
        sender.client().outbox.take(usize::MAX, &mut parts);
        let said = parts
            .iter()
            .map(|part| serde_json::from_slice(part).unwrap());
        got.said = said.filter(|v: &Value| v["class"] != "VERSION").collect();
        got
    }
}

/// The same attitudes, but for how often there was a reset, and their numbers.
pub(crate) fn as_first(line: &str) -> Value {
    let mut value: Value = serde_json::from_str(line).unwrap();
    for changed in ["seq", "reset", "status"] {
        value.as_object_mut().unwrap().remove(changed);
    }
    value
}

#[test]
fn the_same_stream_sent_twice_is_two_runs_and_the_second_is_said() {
    let daemon = Daemon::tcp();
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut runs = Vec::new();
    for run in 0..3 {
        let mut sender = Client::tcp(daemon.address(0));
        sender.object("VERSION");
        let lines: Vec<String> = (0..953).filter_map(lively).collect();
        let mut attitudes = Vec::new();
        for some in lines.chunks(100) {
            sender.send(&some.join("\n"));
            attitudes.extend(some.iter().map(|_| watcher.line().unwrap()));
        }
        let first: Value = serde_json::from_str(&attitudes[0]).unwrap();
        assert_eq!(
            (&first["class"], &first["reset"]),
            (&"ATT".into(), &run.into())
        );
        assert_eq!(
            first["status"].to_string().contains("\"reset\""),
            run > 0,
            "{first}"
        );
        sender.shut();
        let said = sender.rest();
        let codes: Vec<_> = said.iter().map(|v| (&v["class"], &v["code"])).collect();
        let expected = [(&Value::from("NOTE"), &Value::from("new_run"))];
        assert_eq!(codes, &expected[..usize::from(run > 0)], "{said:?}");
        runs.push(attitudes.iter().map(|a| as_first(a)).collect::<Vec<_>>());
        eventually("the sender's place is free", || daemon.hub.connected() == 1);
    }
    assert!(runs[0] == runs[1] && runs[1] == runs[2]);
    let status = daemon.status();
    assert_eq!(status["sources"][0]["new_runs"], 2);
    assert_eq!(status["sources"][0]["lost"], 0);
    assert_eq!(status["sources"][0]["samples"], 3 * runs[0].len());
}

#[test]
fn samples_sent_again_after_a_lost_connection_are_late_and_turn_nothing() {
    let plan = EstimationSettings::default();
    let expected = Fed::of(&plan).send(0..1500);
    let mut daemon = Fed::of(&plan);
    let mut got = daemon.send(0..800).attitudes;
    for (from, to) in [(700, 900), (899, 1000), (500, 1500)] {
        let again = daemon.send(from..to);
        assert_eq!(again.codes("ERROR"), ["late"], "{:?}", again.said);
        assert!(again.codes("NOTE").is_empty());
        got.extend(again.attitudes);
    }
    assert!(got == expected.attitudes);
    let status: Value = serde_json::from_slice(&daemon.hub.status()).unwrap();
    let again = (700..800).chain([899]).chain(500..1000);
    let late = again.filter_map(lively).count();
    assert_eq!(status["sources"][0]["counts"]["late"], late);
}

#[test]
fn who_begins_further_back_than_the_window_begins_a_run() {
    let mut settings = Settings::default();
    settings.limits.state_window = std::time::Duration::from_millis(100);
    let mut daemon = Fed::new(settings);
    daemon.send(0..400);
    assert_eq!(daemon.send([390, 400]).codes("ERROR"), ["late"]);
    let anew = daemon.send(300..400);
    assert_eq!(anew.codes("NOTE"), ["new_run"]);
    assert_eq!(anew.attitudes.len(), (300..400).filter_map(lively).count());
    assert_eq!(anew.first()["q"]["w"], 1.0);
    // The run began at 300 now.
    assert_eq!(daemon.send(301..305).codes("NOTE"), ["new_run"]);
}

fn put(plan: &mut EstimationSettings, setting: &str, text: &str) {
    let row = settings::row(setting).unwrap();
    row.apply(plan, &settings::Value::Text(text)).unwrap();
}

/// Plans by which a sensor may be understood.
fn plans() -> Vec<(&'static str, EstimationSettings)> {
    let of = |change: &dyn Fn(&mut EstimationSettings)| {
        let mut plan = EstimationSettings::default();
        change(&mut plan);
        plan
    };
    let method = |text: &str| of(&|p| put(p, "method", text));
    vec![
        ("as it is", EstimationSettings::default()),
        ("averages", of(&|p| p.kind = Some(SampleKind::Average))),
        (
            "delta angles",
            of(&|p| p.kind = Some(SampleKind::DeltaAngle)),
        ),
        (
            "a turning Earth",
            of(&|p| {
                p.world = "ned".parse().unwrap();
                p.latitude_deg = Some(47.0);
            }),
        ),
        (
            "no noise",
            of(&|p| p.noise = strapd::config::parse_noise("arw=0").unwrap()),
        ),
        ("trapezoids", method("dcm-mean")),
        ("coning", method("coning3")),
        ("a sum of vectors", method("rotvec-sum")),
        ("with look-ahead", method("magnus")),
        (
            "a gap is a reset",
            of(&|p| p.on_gap = strapd_attitude::condition::OnGap::Reset),
        ),
    ]
}

#[test]
fn a_restart_in_a_stream_that_goes_on_changes_no_byte_of_it() {
    for (name, plan) in plans() {
        let expected = Fed::of(&plan).send(0..1400).attitudes;
        assert!(expected.len() > 1300, "{name}: {}", expected.len());
        let mut daemon = Fed::of(&plan);
        let mut got = Vec::new();
        let mut from = 0;
        // In the first window, beside a lost sample, where old samples were forgotten.
        for to in [2, 5, 13, 31, 95, 98, 99, 200, 1200, 1400] {
            let some = daemon.send(from..to);
            assert!(some.said.is_empty(), "{name}, {from}: {:?}", some.said);
            got.extend(some.attitudes);
            let saved = daemon.hub.saved();
            let text = serde_json::to_string(&saved["imu0"]).unwrap();
            assert!(text.len() <= 8 << 10, "{name}: {} bytes", text.len());
            daemon = daemon.restarted(&plan);
            from = to;
        }
        let differs = got.iter().zip(&expected).position(|(a, b)| a != b);
        assert_eq!(
            differs,
            None,
            "{name}: {:?} {:?}",
            differs.map(|n| &got[n]),
            differs.map(|n| &expected[n])
        );
        assert_eq!(got.len(), expected.len(), "{name}");
        assert!(!got.iter().any(|a| a.contains("restarted")));
    }
}

#[test]
fn after_a_restart_a_short_gap_is_bridged_a_long_one_held_and_both_say_so() {
    let plan = EstimationSettings::default();
    let mut daemon = Fed::of(&plan);
    let before = daemon.send(0..400);
    let mut daemon = daemon.restarted(&plan);
    let mut unbroken = Fed::of(&plan);
    unbroken.send(0..400);
    let short = daemon.send(420..500);
    assert_eq!(
        short.first()["status"].to_string(),
        r#"["bridged","provisional","restarted"]"#
    );
    assert_eq!(short.first()["reset"], 0);
    assert!(short.attitudes[1..] == unbroken.send(420..500).attitudes[1..]);

    let mut daemon = daemon.restarted(&plan);
    let long = daemon.send(900..1000);
    assert_eq!(
        long.first()["status"].to_string(),
        r#"["held","restarted"]"#
    );
    assert_eq!(long.first()["reset"], 1);
    let last: Value = serde_json::from_str(short.attitudes.last().unwrap()).unwrap();
    assert_eq!(long.first()["q"], last["q"]);
    let number = |v: &Value| v["seq"].as_u64().unwrap();
    assert_eq!(number(&long.first()), number(&last) + 1);

    // Sent again, from the middle and from the beginning.
    let mut daemon = daemon.restarted(&plan);
    let again = daemon.send(950..1001);
    assert_eq!(
        (again.codes("ERROR"), again.attitudes.len()),
        (vec!["late"], 1)
    );
    assert!(
        !again.attitudes[0].contains("restarted"),
        "{}",
        again.attitudes[0]
    );
    let mut daemon = daemon.restarted(&plan);
    let anew = daemon.send(0..400);
    assert_eq!(anew.codes("NOTE"), ["new_run"]);
    assert_eq!(
        (&anew.first()["reset"], &anew.first()["status"]),
        (&json!(2), &json!(["reset"]))
    );
    let values = |got: &Got| {
        got.attitudes
            .iter()
            .map(|a| as_first(a))
            .collect::<Vec<_>>()
    };
    assert!(values(&anew) == values(&before));
}

#[test]
fn other_settings_after_a_restart_hold_the_attitude() {
    let plan = EstimationSettings::default();
    let mut daemon = Fed::of(&plan);
    daemon.send(0..400);
    let other = EstimationSettings {
        gyro_range: Some(20.0),
        ..EstimationSettings::default()
    };
    let first = daemon.restarted(&other).send(400..401).first();
    assert_eq!(first["status"].to_string(), r#"["held","restarted"]"#);
}

#[test]
fn a_file_of_the_release_before_is_read() {
    let file = r#"{"strapd_state":1,"sensors":{"imu0":{"stamp_ns":1700000001000000000,"q":[0.6,0.0,0.8,0.0],"rate":[0.1,0.2,0.3],"covariance":[0.01,0.0,0.0,0.01,0.0,0.01],"reset":3,"world":"start","body":"flu"}}}"#;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    std::fs::write(&path, file).unwrap();
    let (_, saved) = strapd::serve::core::state::StateFile::open(&path).unwrap();
    let mut daemon = Fed::new(Settings {
        saved,
        ..Settings::default()
    });
    let first = daemon.send(300..301).first();
    assert_eq!(
        (&first["q"]["y"], &first["reset"]),
        (&json!(0.8), &json!(4))
    );
}

/// Every number, list and text of a document, one after the other, is made another.
#[test]
fn whatever_stands_in_the_file_nothing_panics_and_every_attitude_is_one() {
    // Rates, delta angles, and samples that wait for their successors.
    for (name, plan) in plans().into_iter().step_by(2) {
        let mut daemon = Fed::of(&plan);
        daemon.send(0..60);
        let whole = serde_json::to_value(daemon.hub.saved()).unwrap();
        let mut places = Vec::new();
        paths(&whole, String::new(), &mut places);
        let mut tried = BTreeMap::new();
        for (n, place) in places.iter().enumerate() {
            for evil in [
                json!(0),
                json!(-1),
                json!(1),
                json!(3),
                json!(0.5),
                json!(1e300),
                json!(i64::MAX),
                json!(i64::MIN),
                json!(u64::MAX),
                json!([]),
                Value::Null,
                json!(true),
            ] {
                // Of the many samples a few stand for all.
                if (place.contains("/samples/") || place.contains("/steps/")) && n % 17 != 0 {
                    continue;
                }
                let mut document = whole.clone();
                *document.pointer_mut(place).unwrap() = evil;
                let Ok(saved) = serde_json::from_value::<Sensors>(document) else {
                    continue;
                };
                let mut daemon = Fed::new(Settings {
                    plan: plan.clone(),
                    saved,
                    ..Settings::default()
                });
                let got = daemon.send(60..68);
                for line in &got.attitudes {
                    let q = &serde_json::from_str::<Value>(line).unwrap()["q"];
                    let norm: f64 = ["w", "x", "y", "z"]
                        .iter()
                        .map(|c| q[c].as_f64().unwrap().powi(2))
                        .sum();
                    assert!((norm - 1.0).abs() < 1e-5, "{name} {place}: {line}");
                }
                *tried.entry(got.attitudes.len()).or_insert(0) += 1;
            }
        }
        assert!(tried.values().sum::<i32>() > 300, "{name}: {tried:?}");
    }
}

fn paths(value: &Value, at: String, out: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            for (key, inner) in fields {
                paths(inner, format!("{at}/{key}"), out);
            }
        }
        Value::Array(items) => {
            out.push(at.clone());
            for (n, inner) in items.iter().enumerate() {
                paths(inner, format!("{at}/{n}"), out);
            }
        }
        _ => out.push(at),
    }
}

#[test]
fn what_is_saved_is_text_that_can_be_read() {
    let mut daemon = Fed::of(&EstimationSettings::default());
    daemon.send(0..100);
    let saved: Saved = daemon.hub.saved().remove("imu0").unwrap();
    let value = serde_json::to_value(&saved).unwrap();
    assert_eq!(value["first_ns"], 1_700_000_000_000_000_000_i64);
    assert_eq!(value["seq"], (0..100).filter_map(lively).count());
    let memory: Memory = serde_json::from_value(value["memory"].clone()).unwrap();
    assert_eq!(Some(&memory), saved.memory());
}
