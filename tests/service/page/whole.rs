//! Promise: the page of a replay shows the whole recording at once, whenever the tab comes, and no seek clears it.

use super::browser::Browser;
use crate::serve::client::Client;
use crate::serve::daemon::{Process, strapd};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const LOG: &str = "fixtures/xsens_mti.mcap";

/// Seconds of its axis: 953 samples at 50 Hz.
const LENGTH: f64 = 19.04;

/// Account of the page about the whole of a sensor.
fn whole(browser: &mut Browser, id: &str) -> Value {
    browser.eval(&format!("__strapd.sensors['{id}'].whole"))
}

fn until_whole(browser: &mut Browser, id: &str) {
    browser.until(
        "the whole recording",
        &format!("__strapd.sensors['{id}']?.whole?.samples > 0"),
    );
}

/// Number of pixels that the curves of a plot cover in each tenth of its width.
fn ink(browser: &mut Browser, plot: &str) -> Vec<f64> {
    let tenths = browser.eval(&format!(
        "(() => {{ const canvas = document.querySelector('[data-id=\"/imu/data\"] [data-testid={plot}]'); const ratio = canvas.width / canvas.clientWidth; \
         const [from, to] = [54 * ratio, canvas.width - 10 * ratio]; const bins = new Array(10).fill(0); \
         const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data; \
         for (let x = Math.ceil(from); x < to; x++) for (let y = Math.ceil(8 * ratio); y < canvas.height - 20 * ratio; y++) {{ \
         const at = 4 * (y * canvas.width + x); const [r, g, b] = pixels.slice(at, at + 3); \
         if (pixels[at + 3] > 128 && Math.max(r, g, b) - Math.min(r, g, b) > 60) bins[Math.floor(10 * (x - from) / (to - from))]++; }} return bins; }})()"
    ));
    tenths
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

fn played(more: &[&str]) -> Process {
    let mut args = vec!["replay", LOG, "--page=127.0.0.1:0"];
    args.extend(more);
    Process::of(&args)
}

fn seek(to: f64) -> String {
    format!(
        "(() => {{ const slider = document.querySelector('[data-testid=seek]'); slider.value = '{to}'; slider.dispatchEvent(new Event('change')); }})()"
    )
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_rate_of_samples_is_that_of_the_sensor_without_its_reference() {
    let process = played(&["--speed", "1"]);
    let mut browser = Browser::start();
    browser.go(process.address(0), "/");
    browser.until_open();
    until_whole(&mut browser, "/imu/data");
    browser.eval("document.querySelector('[data-testid=play]').click()");
    // 50 Hz, and with the recorded orientation 100: a page that is drawn late sees some more or fewer of them.
    browser.until(
        "a rate of samples",
        "parseFloat(document.querySelector('[data-testid=health-rate]').textContent) > 20",
    );
    let rate = "parseFloat(document.querySelector('[data-testid=health-rate]').textContent)";
    let mut rates: Vec<f64> = (0..5)
        .map(|_| {
            std::thread::sleep(Duration::from_millis(1100));
            browser.eval(rate).as_f64().unwrap()
        })
        .collect();
    rates.sort_by(f64::total_cmp);
    assert!((rates[2] - 50.0).abs() < 20.0, "{rates:?}");
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_tab_that_comes_after_the_end_sees_curves_over_the_whole_axis() {
    let process = played(&["--speed", "100"]);
    let mut client = Client::web(process.address(0))
        .watching(r#"{"class":"WATCH","enable":true,"streams":["ATT"]}"#);
    client.play("\"play\"");
    while client.next_of("PLAYBACK")["state"] != "ended" {}
    let mut browser = Browser::start();
    browser.go(process.address(0), "/");
    browser.until_open();
    until_whole(&mut browser, "/imu/data");
    browser.until(
        "drawn",
        "__strapd.sensors['/imu/data'].plotted?.points > 100",
    );
    let span = browser.eval("__strapd.sensors['/imu/data'].span");
    let ends = [&span[0], &span[1]].map(|v| v.as_f64().unwrap());
    assert!(
        ends[0].abs() < 1e-6 && (ends[1] - LENGTH).abs() < 0.05,
        "{span}"
    );
    for plot in ["plot-rate", "plot-attitude", "plot-error"] {
        let ink = ink(&mut browser, plot);
        assert!(ink.iter().all(|pixels| *pixels > 10.0), "{plot}: {ink:?}");
    }
    // A second tab, at the same time, and the first in the background.
    browser.page();
    browser.go(process.address(0), "/");
    browser.until_open();
    until_whole(&mut browser, "/imu/data");
    assert_eq!(whole(&mut browser, "/imu/data")["samples"], 953);
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn acceleration_without_gravity_is_a_plot_where_it_was_asked_for() {
    let mut browser = Browser::start();
    let hidden =
        "document.querySelector('[data-testid=plot-acceleration]').closest('figure').hidden";
    for (flags, is_shown) in [(&[][..], false), (&["--linear-acceleration"][..], true)] {
        let process = played(&[&["--aid", "gravity"], flags].concat());
        browser.go(process.address(0), "/");
        browser.until_open();
        until_whole(&mut browser, "/imu/data");
        browser.until(
            "drawn",
            "__strapd.sensors['/imu/data'].plotted?.points > 100",
        );
        assert_eq!(browser.eval(hidden), json!(!is_shown));
        if is_shown {
            let ink = ink(&mut browser, "plot-acceleration");
            assert!(ink.iter().all(|pixels| *pixels > 10.0), "{ink:?}");
            // Also of what comes live, beside the whole.
            browser.eval(&seek(9.0));
            let spoken = "document.querySelector('[data-testid=plot-acceleration]').ariaValueText";
            browser.until("words", &format!("{spoken}.includes('metres')"));
        }
        browser.is_unharmed();
    }
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_replay_waits_for_who_looks_and_no_seek_clears_a_plot_or_a_figure() {
    let process = played(&[]);
    let mut browser = Browser::start();
    browser.go(process.address(0), "/");
    browser.until_open();
    until_whole(&mut browser, "/imu/data");
    // Nothing was played, and all of it is there, with the first attitude.
    assert_eq!(browser.text("play"), "Play");
    assert_eq!(browser.number("__strapd.sensors['/imu/data'].points"), 0.0);
    assert_eq!(browser.number("__strapd.sensors['/imu/data'].seq"), 0.0);
    let figures = |browser: &mut Browser| {
        browser.eval("[__strapd.sensors['/imu/data'].worst, __strapd.sensors['/imu/data'].rms, __strapd.sensors['/imu/data'].whole.samples]")
    };
    let before = figures(&mut browser);
    // The command line says the same of the whole.
    let folder = tempfile::tempdir().unwrap();
    let attitude = folder.path().join("a.mcap");
    let run = |args: &[&str]| {
        let mut command = std::process::Command::new(strapd());
        let output = command
            .args(args)
            .env("STRAPD_AID", "none")
            .output()
            .unwrap();
        output.stdout
    };
    let path = attitude.to_str().unwrap();
    run(&["replay", LOG, "-q", "-o", path]);
    let compared = run(&["compare", path, LOG, "--align", "first", "--json"]);
    let total = &serde_json::from_slice::<Value>(&compared).unwrap()["total"];
    for (shown, name) in [(&before[0], "max_deg"), (&before[1], "rms_deg")] {
        let (shown, said) = (shown.as_f64().unwrap(), total[name].as_f64().unwrap());
        assert!((shown - said).abs() < 1e-6, "{name}: {shown}, {said}");
    }
    for to in [15.0, 3.0, 12.0] {
        browser.eval(&seek(to));
        browser.until(
            "it is there",
            &format!("Math.abs(__strapd.sensors['/imu/data'].time - {to}) < 0.03"),
        );
        let ink = ink(&mut browser, "plot-attitude");
        assert!(ink.iter().all(|pixels| *pixels > 10.0), "{ink:?}");
        assert_eq!(figures(&mut browser), before);
    }
    browser.is_unharmed();
}

/// A gyro that turns about z, twice around in its time, with `samples` at 100 Hz.
fn turning(folder: &Path, samples: usize) -> PathBuf {
    let path = folder.join(format!("turning_{samples}.csv"));
    let step = 0.01;
    let mut text = "time,gyro_x,gyro_y,gyro_z\n".to_owned();
    let rate = 4.0 * std::f64::consts::PI / (samples.max(2) as f64 * step);
    for k in 0..samples {
        // One sample that no picture may lose.
        let peak = if k == 5 * samples / 8 { 1.0 } else { 0.0 };
        text += &format!("{:.3},{peak},0.0,{rate}\n", 1.0 + k as f64 * step);
    }
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_long_recording_is_there_at_once_keeps_its_peak_and_is_fine_where_it_is_zoomed() {
    let folder = tempfile::tempdir().unwrap();
    let log = turning(folder.path(), 100_000);
    let process = Process::of(&["replay", log.to_str().unwrap(), "--page=127.0.0.1:0"]);
    let mut browser = Browser::start();
    let began = Instant::now();
    browser.go(process.address(0), "/");
    browser.until_open();
    browser.until(
        "a sensor",
        "Object.values(__strapd.sensors)[0]?.whole?.samples === 100000",
    );
    println!("usable after {:?}", began.elapsed());
    let sensor = "Object.values(__strapd.sensors)[0]";
    let drawn = browser.number(&format!("{sensor}.whole.drawn"));
    assert!((100.0..=2100.0).contains(&drawn), "{drawn}");
    // Seen at once, before the run has come there; and then it has.
    for to in [800.0, 100.0, 990.0] {
        let shown = browser.number(&format!(
            "(async () => {{ const began = performance.now(); {}; await new Promise((done) => {{ const look = () => Math.abs({sensor}.time - {to}) < 1 ? done() : requestAnimationFrame(look); look(); }}); return performance.now() - began; }})()",
            seek(to)
        ));
        println!("seek to {to}: shown after {shown:.0} ms");
        assert!(shown < 1000.0, "{shown} ms");
    }
    // A part of it in detail: every sample.
    let canvas = "document.querySelector('[data-testid=plot-rate]')";
    browser.eval(&format!(
        "(() => {{ for (let k = 0; k < 40; k++) {canvas}.dispatchEvent(new WheelEvent('wheel', {{ deltaY: -400, ctrlKey: true, clientX: {canvas}.getBoundingClientRect().left + 200, cancelable: true }})); }})()"
    ));
    browser.until(
        "detail",
        &format!("{sensor}.whole.isDetail && {sensor}.whole.thinning === 1"),
    );
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn an_angle_ends_at_the_border_and_no_line_crosses_the_plot() {
    let folder = tempfile::tempdir().unwrap();
    let log = turning(folder.path(), 2000);
    let process = Process::of(&["replay", log.to_str().unwrap(), "--page=127.0.0.1:0"]);
    let mut browser = Browser::start();
    browser.go(process.address(0), "/");
    browser.until_open();
    browser.until(
        "drawn",
        "Object.values(__strapd.sensors)[0]?.plotted?.points > 100",
    );
    // Lowest and highest blue (yaw) pixel of each column: a line across would be as high as the plot.
    let tallest = browser.number(
        "(() => { const canvas = document.querySelector('[data-testid=plot-attitude]'); const ratio = canvas.width / canvas.clientWidth; const high = canvas.height - 24 * ratio; \
         const yaw = getComputedStyle(document.querySelector('.key .z')).color.match(/\\d+/g).map(Number); let most = 0; \
         const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data; \
         for (let x = Math.ceil(56 * ratio); x < canvas.width - 12 * ratio; x++) { let n = 0; for (let y = 0; y < canvas.height; y++) { const at = 4 * (y * canvas.width + x); \
         if (pixels[at + 3] > 200 && yaw.every((v, k) => Math.abs(v - pixels[at + k]) < 40)) n++; } most = Math.max(most, n / high); } return most; })()",
    );
    assert!(tallest > 0.0 && tallest < 0.3, "{tallest}");
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn one_sample_has_an_axis_and_an_attitude() {
    let folder = tempfile::tempdir().unwrap();
    let log = turning(folder.path(), 1);
    let process = Process::of(&["replay", log.to_str().unwrap(), "--page=127.0.0.1:0"]);
    let mut browser = Browser::start();
    browser.go(process.address(0), "/");
    browser.until_open();
    browser.until(
        "a sensor",
        "Object.values(__strapd.sensors)[0]?.whole?.samples === 1",
    );
    assert_eq!(
        browser.eval("Object.values(__strapd.sensors)[0].span"),
        json!([-0.5, 0.5])
    );
    browser.is_unharmed();
}

#[test]
fn a_run_that_writes_a_file_or_begins_again_waits_for_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.csv");
    let process = played(&["--speed", "100", "-o", out.to_str().unwrap()]);
    let began = Instant::now();
    while !out.exists() {
        assert!(began.elapsed() < Duration::from_secs(30), "no file");
        std::thread::sleep(Duration::from_millis(50));
    }
    drop(process);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_reference_on_a_topic_of_its_own_or_in_a_file_is_drawn_and_its_resets_cut_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut browser = Browser::start();
    let truth = folder.path().join("truth.csv");
    let mut rows = "stamp_ns,qw,qx,qy,qz\n".to_owned();
    for k in 0..2000_u64 {
        let half = std::f64::consts::PI * k as f64 / 1000.0;
        rows += &format!(
            "{},{},0,0,{}\n",
            1_000_000_000 + k * 10_000_000,
            half.cos(),
            half.sin()
        );
    }
    std::fs::write(&truth, rows).unwrap();
    let turning = turning(folder.path(), 2000);
    let file = format!("--reference={}", truth.display());
    for (log, more, most) in [
        ("fixtures/ximu3.mcap", "--aid=gravity", 30.0),
        // Its heading is set anew by 121 degrees at 10.6 s, which is no error.
        ("fixtures/px4_flight.ulg", "--aid=gravity", 40.0),
        (turning.to_str().unwrap(), file.as_str(), 2.0),
    ] {
        let process = Process::of(&["replay", log, "--page=127.0.0.1:0", more]);
        browser.go(process.address(0), "/");
        browser.until_open();
        browser.until(
            "a reference",
            "__strapd.sensors.recorded?.whole?.samples > 10",
        );
        let own = "Object.entries(__strapd.sensors).find(([id]) => id !== 'recorded')[1]";
        browser.until("compared", &format!("{own}.worst > 0 && {own}.rms > 0"));
        let worst = browser.number(&format!("{own}.worst"));
        assert!(worst < most, "{log}: {worst}");
        let marks = browser.eval(&format!("{own}.marks"));
        let resets = marks.as_array().unwrap().len();
        assert_eq!(resets, usize::from(log.ends_with(".ulg")), "{log}: {marks}");
        browser.until(
            "the plot",
            "!document.querySelector('[data-part=errorBox]').hidden",
        );
    }
    browser.is_unharmed();
}
