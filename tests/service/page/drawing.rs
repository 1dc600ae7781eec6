//! Promise: drawings are where they should be, and the same every time.

use super::browser::Browser;
use crate::serve::client::Client;
use crate::serve::daemon::{Daemon, TCP, WS, listening};
use serde_json::Value;

/// Place of the camera, and length of an axis: `src/web/body3d.js`.
const AZIMUTH_DEG: f64 = -125.0;
const ELEVATION_DEG: f64 = 24.0;
const SCALE: f64 = 0.4;

/// The three body axes in world axes, by the columns of C_nb.
pub(super) fn axes([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [
            w * w + x * x - y * y - z * z,
            2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),
        ],
        [
            2.0 * (x * y - w * z),
            w * w - x * x + y * y - z * z,
            2.0 * (y * z + w * x),
        ],
        [
            2.0 * (x * z + w * y),
            2.0 * (y * z - w * x),
            w * w - x * x - y * y + z * z,
        ],
    ]
}

/// Parallel projection onto a canvas of this size.
pub(super) fn projected(v: [f64; 3], width: f64, height: f64) -> [f64; 2] {
    let (sa, ca) = AZIMUTH_DEG.to_radians().sin_cos();
    let (se, ce) = ELEVATION_DEG.to_radians().sin_cos();
    let right = -sa * v[0] + ca * v[1];
    let up = -se * (ca * v[0] + sa * v[1]) + ce * v[2];
    let scale = SCALE * width.min(height);
    [width / 2.0 + scale * right, height / 2.0 - scale * up]
}

/// Finds the discs at the ends of the axes by the colour of their middle, and the colour around each.
const DISCS: &str = r"(() => {
  const canvas = document.querySelector('[data-testid=view3d]');
  const { width, height } = canvas;
  const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue('--' + name).trim().match(/\w\w/g).map((h) => parseInt(h, 16));
  const is = (at, c) => data[at] === c[0] && data[at + 1] === c[1] && data[at + 2] === c[2] && data[at + 3] === 255;
  const tip = colour('tip');
  const discs = [];
  for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
    if (!is(4 * (y * width + x), tip)) continue;
    const near = discs.find((d) => Math.hypot(d.x / d.n - x, d.y / d.n - y) < 8);
    if (near) { near.x += x; near.y += y; near.n++; } else discs.push({ x, y, n: 1 });
  }
  return { width, height, css: [canvas.clientWidth, canvas.clientHeight], discs: discs.map((d) => {
    const [cx, cy] = [d.x / d.n, d.y / d.n];
    const around = ['x', 'y', 'z'].map((name) => {
      const c = colour(name);
      let n = 0;
      for (let a = 0; a < 32; a++) {
        const [px, py] = [cx + 4.8 * Math.cos(a * Math.PI / 16), cy + 4.8 * Math.sin(a * Math.PI / 16)];
        if (is(4 * (Math.round(py) * width + Math.round(px)), c)) n++;
      }
      return n;
    });
    // The middle of a pixel is half a pixel from its corner.
    return { at: [cx + 0.5, cy + 0.5], n: d.n, axis: around.indexOf(Math.max(...around)), share: Math.max(...around) / 32 };
  }) };
})()";

/// Quarter turns about body axes that lead through all 24 attitudes of a cube.
fn quarter_turns() -> Vec<[f64; 3]> {
    const YAW: [f64; 3] = [0.0, 0.0, 1.0];
    const PITCH: [f64; 3] = [0.0, 1.0, 0.0];
    const ROLL: [f64; 3] = [1.0, 0.0, 0.0];
    let mut turns = Vec::new();
    for _ in 0..4 {
        turns.extend([YAW, YAW, YAW, YAW, PITCH]);
    }
    turns.push(ROLL);
    turns.extend([YAW, YAW, YAW, YAW, ROLL, ROLL, YAW, YAW, YAW]);
    turns
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_ends_of_the_axes_are_drawn_where_the_attitude_says() {
    let mut browser = Browser::start();
    let mut settings = listening(&[TCP, WS]);
    // One rotation a sample: a quarter turn is a quarter turn.
    settings.hub.plan.method = strapd_attitude::propagate::Method::DcmRight;
    let daemon = Daemon::start(settings);
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let mut poses = std::collections::BTreeSet::new();
    let still = [0.0; 3];
    for (n, turn) in std::iter::once(still).chain(quarter_turns()).enumerate() {
        let rate = turn.map(|t| t * std::f64::consts::FRAC_PI_2 * 10.0);
        sender.send(&format!(
            "{{\"class\":\"RATE\",\"id\":\"cube\",\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"gyro\":{rate:?}}}",
            1_700_000_000 + n / 10,
            n % 10 * 100_000_000
        ));
        let att = watcher.next_of("ATT");
        let q = ["w", "x", "y", "z"].map(|name| att["q"][name].as_f64().unwrap());
        let truth = axes(q);
        poses.insert(format!(
            "{:?}",
            truth.map(|axis| axis.map(|v| v.round() as i8))
        ));
        // As drawn, not as received.
        browser.until("it is drawn", &format!("__strapd.seq === {n}"));
        let found = browser.eval(DISCS);
        let [width, height] = [&found["css"][0], &found["css"][1]].map(|v| v.as_f64().unwrap());
        let discs = found["discs"].as_array().unwrap();
        assert_eq!(discs.len(), 3, "pose {n}: {found}");
        for (axis, direction) in truth.into_iter().enumerate() {
            let expected = projected(direction, width, height);
            let disc = discs
                .iter()
                .find(|d| d["axis"] == axis)
                .unwrap_or_else(|| unreachable!("pose {n}: no disc for axis {axis}: {found}"));
            let at = |k: usize| disc["at"][k].as_f64().unwrap();
            let off = (at(0) - expected[0]).hypot(at(1) - expected[1]);
            assert!(
                off <= 1.0,
                "pose {n}, axis {axis}: {off} pixels off: {expected:?}, {disc}"
            );
            assert!(disc["share"].as_f64().unwrap() > 0.5, "pose {n}: {disc}");
        }
    }
    assert_eq!(poses.len(), 24);
    browser.is_unharmed();
}

fn wavering(n: u32) -> String {
    let t = f64::from(n) * 0.01;
    let gyro = [1.4 * (3.0 * t).sin(), 0.8 * (1.1 * t).cos(), 0.5];
    format!(
        "{{\"class\":\"RATE\",\"id\":\"imu0\",\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"gyro\":{gyro:?}}}",
        1_700_000_000 + n / 100,
        n % 100 * 10_000_000
    )
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_frozen_picture_is_the_same_to_the_byte() {
    let mut browser = Browser::start();
    let mut pictures = Vec::new();
    for until in [150, 150, 149] {
        // Each a daemon of its own: nothing but the samples is the same.
        let daemon = Daemon::start(listening(&[TCP, WS]));
        browser.page();
        browser.go(daemon.address(1), &format!("/?frozen=1&seq={until}"));
        browser.until_open();
        let mut sender = Client::tcp(daemon.address(0));
        for part in (0..300).collect::<Vec<_>>().chunks(7) {
            let lines: Vec<String> = part.iter().map(|n| wavering(*n)).collect();
            sender.send(&lines.join("\n"));
        }
        browser.until("it has frozen", "__strapd.state === 'frozen'");
        assert_eq!(browser.eval("__strapd.seq"), Value::from(until));
        pictures.push(browser.screenshot());
        browser.is_unharmed();
    }
    assert!(
        pictures[0] == pictures[1],
        "two pictures of one attitude differ"
    );
    assert!(
        pictures[0] != pictures[2],
        "the picture of another attitude is the same"
    );
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_spike_of_one_sample_is_drawn() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let mut sender = Client::tcp(daemon.address(0));
    // Eight seconds at 1 kHz: about twenty samples a column.
    let lines: Vec<String> = (0..8000_u32)
        .map(|n| {
            let x = if n == 4321 { 8.0 } else { 0.2 * f64::from(n % 2) };
            format!(
                "{{\"class\":\"RATE\",\"id\":\"imu0\",\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"gyro\":[{x},0,0]}}",
                1_700_000_000 + n / 1000,
                n % 1000 * 1_000_000
            )
        })
        .collect();
    for (n, part) in (1..).zip(lines.chunks(400)) {
        sender.send(&part.join("\n"));
        // No faster than it is drawn: nothing is to be dropped.
        browser.until("all so far", &format!("__strapd.seq === {}", n * 400 - 1));
    }
    assert_eq!(browser.eval("__strapd.sensors.imu0.points"), 8000);
    // Rows of the plot, from the top, in which the colour of x is found.
    let highest = browser.number(
        r"(() => {
        const canvas = document.querySelector('[data-testid=plot-rate]');
        const { width, height } = canvas;
        const { data } = canvas.getContext('2d').getImageData(60, 0, width - 80, height);
        for (let at = 0; at < data.length; at += 4) {
          if (data[at + 3] > 60 && data[at] > 150 && data[at + 1] < 120 && data[at + 2] < 120) return Math.floor(at / 4 / (width - 80)) / height;
        }
        return 1;
      })()",
    );
    assert!(highest < 0.3, "the highest of x is {highest} down");
}
