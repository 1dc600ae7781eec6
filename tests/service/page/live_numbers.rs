//! The numbers of the live page are those of the command line.

use super::browser::Browser;
use crate::serve::client::Client;
use crate::serve::daemon::{Daemon, TCP, WS, listening, strapd};
use serde_json::{Value, json};
use std::io::Write as _;
use std::process::{Command, Stdio};

/// Samples at 100 Hz about all axes, with a repeated gap and a NaN.
fn samples(id: &str, scale: f64) -> Vec<String> {
    (0..300_u32)
        .filter(|n| !(120..150).contains(n))
        .map(|n| {
            let t = f64::from(n) * 0.01;
            let gyro = if n == 200 {
                "null".to_owned()
            } else {
                let w = [(1.3 * t).sin(), 0.7 * (2.1 * t).cos(), 0.4].map(|w| w * scale);
                json!(w).to_string()
            };
            format!(
                "{{\"class\":\"RATE\",\"id\":\"{id}\",\"seq\":{n},\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"gyro\":{gyro}}}",
                1_700_000_000 + n / 100,
                n % 100 * 10_000_000
            )
        })
        .collect()
}

/// The attitudes a replay of the same lines gives.
fn replayed(lines: &[String]) -> Vec<Value> {
    let mut child = Command::new(strapd())
        .args(["replay", "-", "-o", "-", "--method", "commit", "--quiet"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let text = lines.join("\n") + "\n";
    let mut stdin = child.stdin.take().unwrap();
    let writer = std::thread::spawn(move || stdin.write_all(text.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Roll, pitch, yaw in degrees (z-y'-x''), by the matrix.
fn roll_pitch_yaw(q: [f64; 4]) -> [f64; 3] {
    let [w, x, y, z] = q;
    let c21 = 2.0 * (x * y + w * z);
    let c11 = w * w + x * x - y * y - z * z;
    let c31 = 2.0 * (x * z - w * y);
    let c32 = 2.0 * (y * z + w * x);
    let c33 = w * w - x * x - y * y + z * z;
    [c32.atan2(c33), (-c31).asin(), c21.atan2(c11)].map(f64::to_degrees)
}

fn wxyz(att: &Value) -> [f64; 4] {
    ["w", "x", "y", "z"].map(|name| att["q"][name].as_f64().unwrap())
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_page_shows_what_the_command_line_says() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    assert_eq!(
        browser.eval("document.querySelectorAll('[data-testid=sensor]').length"),
        0
    );
    let lines = samples("imu0", 1.0);
    let expected = replayed(&lines);
    let last = expected.last().unwrap();
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&lines.join("\n"));
    browser.until(
        "everything has come",
        &format!(
            "__strapd.seq === {0} && document.querySelector('[data-testid=seq]').value === '{0}'",
            last["seq"]
        ),
    );
    let q = wxyz(last);
    // Digits that the sigma leaves: none after the point from 1 degree on. A quaternion moves by half the angle.
    let sigmas = last["sigma_deg"].as_array().unwrap().iter();
    let sigma = sigmas.filter_map(Value::as_f64).fold(0.0, f64::max);
    assert!(sigma > 0.0, "{last}");
    let left = |sigma: f64, most: usize| {
        let digits = -sigma.log10().floor();
        (digits.max(0.0) as usize).min(most)
    };
    let digits = left(sigma / 115.0, 6).max(3);
    for (name, expected) in ["q-w", "q-x", "q-y", "q-z"].into_iter().zip(q) {
        let shown = browser.shown(name);
        assert!(
            (shown - expected).abs() <= 1e-9,
            "{name}: {shown}, {expected}"
        );
        let text = browser.text(name).replace('−', "-");
        assert_eq!(
            text,
            format!("{expected:.digits$}"),
            "{name} as people read it"
        );
    }
    let digits = left(sigma, 4);
    for (name, expected) in ["roll", "pitch", "yaw"].into_iter().zip(roll_pitch_yaw(q)) {
        let shown = browser.shown(name);
        assert!(
            (shown - expected).abs() <= 1e-9,
            "{name}: {shown}, {expected}"
        );
        let text = browser.text(name).replace('−', "-");
        assert_eq!(
            text,
            format!("{expected:.digits$}"),
            "{name} as people read it"
        );
    }
    for (n, name) in ["rate-x", "rate-y", "rate-z"].into_iter().enumerate() {
        let expected = last["rate"][n].as_f64().unwrap().to_degrees();
        assert!((browser.shown(name) - expected).abs() <= 1e-9, "{name}");
    }
    // Every sample was drawn, and what was wrong with the input is told.
    assert_eq!(
        browser.number("__strapd.sensors.imu0.points"),
        expected.len() as f64
    );
    assert_eq!(browser.text("thinning"), "every sample");
    browser.until(
        "STATUS has come",
        "document.querySelector('[data-testid=nan]').textContent === '1'",
    );
    let source = &daemon.status()["sources"][0];
    for name in ["gaps", "lost"] {
        assert!(source[name].as_u64().unwrap() > 0, "{source}");
        assert_eq!(browser.text(name), source[name].to_string(), "{name}");
    }
    browser.is_unharmed();

    // Nothing was asked of anybody else.
    let origin = daemon.address(1).to_string();
    let requests = browser.requests();
    assert!(
        requests.iter().any(|url| url.ends_with("/ws")),
        "{requests:?}"
    );
    for url in requests.iter().filter(|url| *url != "about:blank") {
        let host = url
            .split("://")
            .nth(1)
            .and_then(|rest| rest.split('/').next());
        assert_eq!(host, Some(&*origin), "{url}");
    }
    // And the policy would have refused it, and told us: the tests above can fail.
    browser.eval("document.body.setAttribute('style', 'margin: 1px'); fetch('http://127.0.0.1:9/').catch(() => 0)");
    browser.until("refusals", "__violations.length >= 2");
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_error_is_the_angle_from_the_truth() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let (own, truth) = (samples("imu0", 1.02), samples("truth", 1.0));
    let (expected, exact) = (replayed(&own), replayed(&truth));
    let mixed: Vec<&str> = own
        .iter()
        .zip(&truth)
        .flat_map(|(a, b)| [&**a, &**b])
        .collect();
    // Kept to the end: who closes before he has read takes back what he said.
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&mixed.join("\n"));
    let (a, b) = (wxyz(expected.last().unwrap()), wxyz(exact.last().unwrap()));
    let d = {
        let [w, x, y, z] = a;
        let [bw, bx, by, bz] = b;
        // The vector part of conj(a) b, whose length is the sine of half the angle.
        [
            w * bx - x * bw - y * bz + z * by,
            w * by + x * bz - y * bw - z * bx,
            w * bz - x * by + y * bx - z * bw,
        ]
    };
    let sine = d.iter().map(|v| v * v).sum::<f64>().sqrt();
    let angle = (2.0 * sine.asin()).to_degrees();
    assert!(angle > 0.1, "{angle}");
    browser.until(
        "both have come",
        &format!("Math.abs(document.querySelector('[data-id=imu0] [data-testid=error]').value - {angle}) < 1e-9"),
    );
    let titles = browser
        .eval("[...document.querySelectorAll('[data-testid=sensor]')].map((e) => e.dataset.id)");
    assert_eq!(titles, json!(["imu0", "truth"]));
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_simulation_is_held_against_its_truth() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let to = format!("tcp://{}", daemon.address(0));
    let simulated = Command::new(strapd())
        .args([
            "simulate",
            "coning",
            "--speed",
            "1",
            "--duration",
            "3",
            "--rate-hz",
            "200",
        ])
        .args(["--quiet", "-o", &to])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&simulated.stderr);
    assert!(simulated.status.success() && said.is_empty(), "{said}");
    let imu = "__strapd.sensors.imu";
    browser.until(
        "all of both",
        &format!("{imu}?.seq === 600 && __strapd.sensors.truth?.seq === 600"),
    );
    browser.until("compared", &format!("{imu}.worst > 0"));
    let against =
        browser.eval("document.querySelector('[data-id=imu] [data-testid=against]').value");
    assert_eq!(against, "truth");
    // Exact samples of a gentle cone: what is left is the integration of rates, and where the worlds lie to each other
    // is no error.
    let worst = browser.number(&format!("{imu}.worst"));
    assert!(worst < 0.05, "{worst} deg");
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn several_simulations_at_once_are_each_held_against_their_own_truth() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let tcp = daemon.address(0);
    let named = [
        ["left leg", "--start-stamp=1700000000", "?id=left%20leg"],
        ["right", "--start-stamp=1700000007", "?id=right"],
    ];
    let simulations: Vec<_> = named
        .iter()
        .map(|[_, start, id]| {
            Command::new(strapd())
                .args(["simulate", "coning", "--speed", "1", "--duration", "3"])
                .args(["--quiet", start, "-o", &format!("tcp://{tcp}{id}")])
                .stderr(Stdio::piped())
                .spawn()
                .unwrap()
        })
        .collect();
    for simulation in simulations {
        let ran = simulation.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&ran.stderr);
        assert!(ran.status.success() && said.is_empty(), "{said}");
    }
    for [id, ..] in named {
        let sensor = format!("__strapd.sensors['{id}']");
        browser.until("compared", &format!("{sensor}?.worst > 0"));
        let against = browser.eval(&format!(
            "document.querySelector('[data-id=\"{id}\"] [data-testid=against]').value"
        ));
        assert_eq!(against, format!("{id} truth"));
        let worst = browser.number(&format!("{sensor}.worst"));
        assert!(worst < 0.05, "{id}: {worst} deg");
    }
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_table_holds_levelled_sensors_against_their_truth() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let names = ["foot", "knee", "hip"];
    let simulations: Vec<_> = names
        .iter()
        .map(|name| {
            Command::new(strapd())
                .args(["simulate", "hand", "--speed", "1", "--duration", "6"])
                .args(["--noise", "consumer_imu", "--rate-hz", "100", "--quiet"])
                .args(["-o", &format!("tcp://{}?id={name}", daemon.address(0))])
                .stderr(Stdio::piped())
                .spawn()
                .unwrap()
        })
        .collect();
    let rows = "[...document.querySelectorAll('[data-testid=fleet-table] tbody tr')]";
    let errors =
        format!("{rows}.map((e) => Number(e.querySelector('[data-cell=error]').textContent))");
    browser.until(
        "each has an error",
        &format!("{errors}.length === 3 && {errors}.every((e) => e > 0 && e < 20)"),
    );
    let shown = browser.eval(&format!(
        "{rows}.map((e) => e.dataset.sensor).sort().join()"
    ));
    assert_eq!(shown, "foot,hip,knee");
    let title = browser.eval("document.getElementById('fleet-title').textContent");
    assert_eq!(title, "3 sensors");
    for simulation in simulations {
        let ran = simulation.wait_with_output().unwrap();
        assert!(ran.status.success());
    }
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_live_sensors_acceleration_without_gravity_is_drawn_as_it_comes() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan.aid = strapd_attitude::estimate::Aid::Gravity;
    settings.hub.plan.linear_acceleration = true;
    let daemon = Daemon::start(settings);
    let mut browser = Browser::start();
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let mut sender = Client::tcp(daemon.address(0)).watching(r#"{"class":"WATCH"}"#);
    let line = |n: i64, accel: &str| {
        let stamp = 1_700_000_000_000_000_000 + n * 10_000_000;
        format!("{{\"id\":\"imu0\",\"stamp_ns\":{stamp},\"gyro\":[0,0,0]{accel}}}")
    };
    for n in 0..200 {
        sender.send(&line(n, ",\"accel\":[0,0,9.81]"));
    }
    // A jolt upwards, and a sample without a force.
    sender.send(&line(200, ",\"accel\":[0,0,12.31]"));
    let words = "document.querySelector('[data-testid=plot-acceleration]').ariaValueText";
    browser.until(
        "a jolt",
        &format!("/z 2\\.[45]/.test({words} ?? '') && !document.querySelector('[data-part=accelerationBox]').hidden"),
    );
    sender.send(&line(201, ""));
    browser.until("nothing known", &format!("/z –/.test({words})"));
    browser.is_unharmed();
}
