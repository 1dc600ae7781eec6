//! Promise: rows and a picture of what is seen can be kept, made in the browser and sent nowhere.

use super::browser::Browser;
use crate::serve::daemon::{Daemon, PATIENCE, WS, listening};
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// The file once it is whole.
fn saved(folder: &Path, name: &str) -> Vec<u8> {
    let start = Instant::now();
    loop {
        if let Ok(bytes) = std::fs::read(folder.join(name)) {
            return bytes;
        }
        let there: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name())
            .collect();
        assert!(start.elapsed() < PATIENCE, "no {name}, but {there:?}");
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn rows_and_a_picture_of_what_is_shown_are_saved() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    let folder = tempfile::tempdir().unwrap();
    browser.call(
        "Page.setDownloadBehavior",
        json!({"behavior": "allow", "downloadPath": folder.path()}),
    );
    browser.go(daemon.address(0), "/?frozen=1");
    browser.until(
        "it is drawn",
        "__strapd.sensors.imu0?.plotted?.points > 100",
    );
    let asked = browser.requests().len();
    // The last second alone.
    browser.eval("document.querySelector('[data-id=imu0] [data-testid=plot-rate]').focus()");
    browser.press("End");
    while browser.number("(([from, to]) => to - from)(__strapd.view.range)") > 1.0 {
        let before = browser.eval("__strapd.view.range");
        browser.press("+");
        browser.until(
            "nearer",
            &format!("JSON.stringify(__strapd.view.range) !== '{before}'"),
        );
    }
    let range = browser.eval("__strapd.view.range");
    let from = range[0].as_f64().unwrap();
    browser.eval("document.querySelector('[data-id=imu0] [data-testid=save-csv]').click()");
    let text = String::from_utf8(saved(folder.path(), "strapd-imu0.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let head = rows.headers().unwrap().clone();
    let of = |name: &str| head.iter().position(|h| h == name).unwrap();
    let records: Vec<_> = rows.records().map(Result::unwrap).collect();
    let expected = 2000 - (from * 200.0 - 1e-6).ceil() as usize + 1;
    assert_eq!(records.len(), expected, "from {from}");
    let last = records.last().unwrap();
    assert_eq!(&last[of("stamp_s")], "1700000010.000000000");
    assert_eq!(&last[of("seq")], "2000");
    for (column, part) in [("q_w", "w"), ("q_z", "z")] {
        let shown = browser.number(&format!("__strapd.sensors.imu0.q.{part}"));
        assert_eq!(
            last[of(column)].parse::<f64>().unwrap(),
            shown,
            "{column}, every digit"
        );
    }
    let error: f64 = last[of("error_deg")].parse().unwrap();
    assert_eq!(error, browser.number("__strapd.sensors.imu0.error"));

    browser.eval("document.querySelector('[data-id=imu0] [data-testid=save-png]').click()");
    let picture = saved(folder.path(), "strapd-imu0.png");
    assert!(picture.starts_with(b"\x89PNG\r\n"), "not a picture");
    let width = u32::from_be_bytes(picture[16..20].try_into().unwrap());
    let card = browser.number(
        "Math.round(document.querySelector('[data-id=imu0]').getBoundingClientRect().width)",
    );
    assert_eq!(f64::from(width), card);
    assert!(picture.len() > 10_000, "{} bytes", picture.len());
    let asked = browser.requests().split_off(asked);
    assert!(
        asked
            .iter()
            .all(|url| url.starts_with("blob:") || url.ends_with("/page/icon.svg")),
        "nothing is asked of anybody: {asked:?}"
    );
    browser.is_unharmed();
}
