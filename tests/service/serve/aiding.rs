//! `--aid gravity` in a daemon: the bytes of a replay, level after a restart, and what was learned in `STATUS`.

use super::bare_stamps::replayed_with;
use super::client::Client;
use super::daemon::{Daemon, TCP, listening};
use super::runs::Fed;
use serde_json::Value;
use strapd_attitude::estimate::{Aid, EstimationSettings};

/// A body that rolls slowly to and fro about 0.3 rad at 100 Hz, its gyro off by 0.5 deg/s.
pub(crate) fn line(n: u64) -> String {
    let t = n as f64 * 0.01;
    let roll = 0.3 + 0.2 * (0.9 * t).sin();
    let rate = 0.18 * (0.9 * t).cos() + 0.5_f64.to_radians();
    let (sin, cos) = roll.sin_cos();
    let stamp = 1_700_000_000_000_000_000 + n * 10_000_000;
    format!(
        "{{\"id\":\"imu0\",\"stamp_ns\":{stamp},\"gyro\":[{rate},0,0],\"accel\":[0,{},{}]}}",
        9.81 * sin,
        9.81 * cos
    )
}

pub(crate) fn aided() -> EstimationSettings {
    EstimationSettings {
        aid: Aid::Gravity,
        ..EstimationSettings::default()
    }
}

#[test]
fn a_daemon_gives_the_bytes_of_a_replay_and_says_what_it_learned() {
    let mut settings = listening(&[TCP]);
    settings.hub.plan = aided();
    let daemon = Daemon::start(settings);
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let lines: Vec<String> = (0..2000).map(line).collect();
    let mut served = String::new();
    for some in lines.chunks(100) {
        sender.send(&some.join("\n"));
        for _ in some {
            served += &watcher.line().unwrap();
            served.push('\n');
        }
    }
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    let expected = replayed_with(&text, &["--aid", "gravity"]);
    assert!(expected.status.success(), "{expected:?}");
    assert!(served.as_bytes() == expected.stdout);
    let status = daemon.status();
    let source = &status["sources"][0];
    assert_eq!(source["world"], "level");
    let bias = &source["aid"]["learned"]["gyro_bias_rad_s"][0];
    let bias = bias.as_f64().unwrap().to_degrees();
    assert!((bias - 0.5).abs() < 0.1, "{source}");
    assert!(
        source["aid"]["sigma"]["gyro_bias_rad_s"][0]
            .as_f64()
            .unwrap()
            > 0.0
    );
}

/// Roll of an attitude, degrees.
pub(crate) fn roll(attitude: &str) -> f64 {
    let value: Value = serde_json::from_str(attitude).unwrap();
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| value["q"][c].as_f64().unwrap());
    let (sin, cos) = (2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y));
    sin.atan2(cos).to_degrees()
}

#[test]
fn after_a_restart_it_goes_on_to_the_bit_with_all_that_was_learned() {
    let field = |plan: EstimationSettings| EstimationSettings {
        aid: Aid::GravityAndField,
        ..plan
    };
    for plan in [aided(), field(aided())] {
        let sent = |numbers: std::ops::Range<u64>| {
            numbers
                .map(|n| line(n).replace('}', &format!(",\"mag\":[{},20,-40]}}", n as f64 * 1e-3)))
        };
        let whole = Fed::of(&plan).lines(sent(0..1600)).attitudes;
        let mut daemon = Fed::of(&plan);
        let mut parts = daemon.lines(sent(0..1500)).attitudes;
        for cut in [1500..1501, 1501..1555, 1555..1600] {
            daemon = daemon.restarted(&plan);
            parts.extend(daemon.lines(sent(cut)).attitudes);
        }
        assert_eq!(parts.len(), 1600);
        assert!(parts == whole);
    }
}

#[test]
fn what_another_plan_had_learned_leaves_it_level_at_once() {
    let other = EstimationSettings {
        max_gap_secs: 0.25,
        ..aided()
    };
    let mut daemon = Fed::of(&aided());
    let before = daemon.lines((0..1500).map(line));
    let mut daemon = daemon.restarted(&other);
    let after = daemon.lines((1500..1600).map(line));
    let truth = |n: u64| (0.3 + 0.2 * (0.9 * n as f64 * 0.01).sin()).to_degrees();
    let at_the_end = roll(before.attitudes.last().unwrap());
    assert!((at_the_end - truth(1499)).abs() < 0.5, "{at_the_end}");
    for (n, attitude) in (1500..).zip(&after.attitudes) {
        let off = roll(attitude) - truth(n);
        assert!(off.abs() < 1.0, "{n} {off}");
    }
    assert_eq!(after.attitudes.len(), 100);
}
