//! `HEADING`: a heading that something else than the sensor measures corrects it, from whatever connection.

use super::aiding::aided;
use super::client::Client;
use super::daemon::{Daemon, TCP, eventually, listening};
use super::runs::Fed;
use serde_json::Value;
use strapd_attitude::estimate::{Aid, EstimationSettings};

const START: u64 = 1_700_000_000_000_000_000;

/// A level body that turns at 10 deg/s, at 100 Hz, and its gyro at 0.4 deg/s by itself.
fn line(n: u64) -> String {
    let stamp = START + n * 10_000_000;
    let rate = 10.4_f64.to_radians();
    format!(
        "{{\"id\":\"imu0\",\"stamp_ns\":{stamp},\"gyro\":[0,0,{rate}],\"accel\":[0,0,9.80665]}}"
    )
}

/// Measurement of the true heading after so many samples, which was 30 degrees at the first.
fn heading(n: u64, class: &str) -> String {
    let (sec, nsec) = (1_700_000_000 + n / 100, n % 100 * 10_000_000);
    let degrees = 30.0 + 0.1 * n as f64;
    format!(
        "{{{class}\"id\":\"imu0\",\"stamp\":{{\"sec\":{sec},\"nsec\":{nsec}}},\"heading\":{degrees},\"sigma\":2}}"
    )
}

fn yaw(attitude: &str) -> f64 {
    let value: Value = serde_json::from_str(attitude).unwrap();
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| value["q"][c].as_f64().unwrap());
    let (sin, cos) = (2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    sin.atan2(cos).to_degrees()
}

/// Lines of so many seconds; a second's heading comes 300 ms late.
fn with_headings(secs: u64, class: &str) -> Vec<String> {
    let each = |n: u64| {
        let late = (n >= 130 && n % 100 == 30).then(|| heading(n - 30, class));
        late.into_iter().chain([line(n)])
    };
    (0..100 * secs).flat_map(each).collect()
}

#[test]
fn lines_of_a_heading_hold_the_attitude_to_it_with_a_class_or_without() {
    let alone = Fed::of(&aided()).lines((0..12_000).map(line));
    let off = (yaw(alone.attitudes.last().unwrap()) - (30.0 + 0.1 * 11_999.0)).rem_euclid(360.0);
    assert!((10.0..350.0).contains(&off), "{off}");
    let mut kept = None;
    for class in ["\"class\":\"HEADING\",", ""] {
        let mut daemon = Fed::of(&aided());
        let got = daemon.lines(with_headings(120, class));
        assert!(got.said.is_empty(), "{:?}", got.said);
        for n in (3_000..12_000).step_by(100) {
            let off = yaw(&got.attitudes[n]) - (30.0 + 0.1 * n as f64);
            let off = (off + 180.0).rem_euclid(360.0) - 180.0;
            assert!(off.abs() < 1.0, "{class}{n}: {off}");
        }
        let status: Value = serde_json::from_slice(&daemon.hub.status()).unwrap();
        let headings = &status["sources"][0]["headings"];
        // Nothing is remembered to compare the first with, which comes late.
        assert_eq!(
            headings["used"].as_u64().unwrap() + headings["unpaired"].as_u64().unwrap(),
            119
        );
        assert_eq!(
            (&headings["turns"], &headings["doubted"]),
            (&1.into(), &0.into())
        );
        assert_eq!(status["counters"]["headings"], 119);
        assert_eq!(kept.get_or_insert(got.attitudes.clone()), &got.attitudes);
    }
    // The heading of a body in NED is clockwise from north.
    let mut daemon = Fed::of(&EstimationSettings {
        world: strapd_attitude::worlds::World::Ned,
        ..aided()
    });
    let mirrored = |n: u64| heading(n, "").replace("\"heading\":", "\"heading\":-");
    let got = daemon.lines((0..1_000).flat_map(|n| {
        (n % 100 == 50)
            .then(|| mirrored(n))
            .into_iter()
            .chain([line(n)])
    }));
    let off = yaw(got.attitudes.last().unwrap()) + 30.0 + 99.9;
    assert!(off.abs() < 1.0, "{off}");
}

#[test]
fn another_connection_may_measure_it_and_only_one() {
    let mut settings = listening(&[TCP]);
    settings.hub.plan = aided();
    let daemon = Daemon::start(settings);
    let mut sender = Client::tcp(daemon.address(0));
    let lines: Vec<String> = (0..300).map(line).collect();
    sender.send(&lines.join("\n"));
    let source = || daemon.status()["sources"][0].clone();
    eventually("the samples are taken", || source()["attitudes"] == 300);
    let mut compass = Client::tcp(daemon.address(0));
    compass.send("{\"class\":\"HEADING\",\"id\":\"imu0\",\"heading\":75,\"sigma\":1}");
    eventually("the heading is taken", || {
        daemon.status()["counters"]["headings"] == 1
    });
    let mut other = Client::tcp(daemon.address(0));
    other.object("VERSION");
    other.send("{\"class\":\"HEADING\",\"id\":\"imu0\",\"heading\":10,\"sigma\":1}");
    assert_eq!(other.object("ERROR")["code"], "heading_in_use");
    let mut watcher =
        Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\",\"last\":false}");
    sender.send(&line(300));
    let told = watcher.line().unwrap();
    assert!((yaw(&told) - 75.0).abs() < 0.2, "{told}");
    assert!(told.contains("\"reset\""), "{told}");
    // Who has gone leaves it to another.
    drop(compass);
    eventually("another is heard", || {
        other.send("{\"class\":\"HEADING\",\"id\":\"imu0\",\"heading\":10,\"sigma\":1}");
        daemon.status()["counters"]["headings"].as_u64() >= Some(2)
    });
}

#[test]
fn what_no_heading_can_be_made_of_is_said_and_ends_nothing() {
    let alone = EstimationSettings {
        aid: Aid::None,
        ..EstimationSettings::default()
    };
    for (plan, id, said, code) in [
        (
            &aided(),
            "imu9",
            "\"heading\":1,\"sigma\":1",
            "unknown_sensor",
        ),
        (&aided(), "imu0", "\"heading\":1", "bad_heading"),
        (&aided(), "imu0", "\"heading\":1,\"sigma\":0", "bad_heading"),
        (
            &aided(),
            "imu0",
            "\"heading\":1e9,\"sigma\":1",
            "bad_heading",
        ),
        (
            &aided(),
            "imu0",
            "\"heading\":\"north\",\"sigma\":1",
            "bad_heading",
        ),
        (
            &aided(),
            "imu0",
            "\"heading\":1,\"sigma\":1,\"stamp\":3",
            "bad_heading",
        ),
        (
            &alone,
            "imu0",
            "\"heading\":1,\"sigma\":1",
            "heading_not_taken",
        ),
    ] {
        let mut daemon = Fed::of(plan);
        let asked = format!("{{\"class\":\"HEADING\",\"id\":\"{id}\",{said}}}");
        // As often as nobody bears bad lines.
        let asked = std::iter::repeat_n(asked, 500);
        let got = daemon.lines((0..5).map(line).chain(asked).chain((5..10).map(line)));
        assert_eq!(got.said[0]["code"], code, "{:?}", got.said[0]);
        assert_eq!(got.attitudes.len(), 10);
    }
}
