//! Keys, buttons, small screens.

use super::browser::Browser;
use crate::serve::client::{Client, rate};
use crate::serve::daemon::{Daemon, TCP, WS, listening};

fn key(browser: &mut Browser, key: &str) {
    browser.eval(&format!(
        "document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true }}))"
    ));
}

/// Samples `from..until` at 1 kHz, turning about z by 1 rad/s.
fn turn(sender: &mut Client, from: u64, until: u64) {
    let lines: Vec<String> = (from..until)
        .map(|n| rate("imu0", n, 1.0).replace("[1,0,0]", "[0,0,1]"))
        .collect();
    sender.send(&lines.join("\n"));
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn keys_change_the_view_and_nothing_else() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut sender = Client::tcp(daemon.address(0));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    turn(&mut sender, 0, 500);
    browser.until(
        "half a second",
        "__strapd.seq === 499 && document.querySelector('[data-testid=seq]').value === '499'",
    );
    let yaw = browser.shown("yaw");
    assert!((yaw - 0.499_f64.to_degrees()).abs() < 1e-6, "{yaw}");
    let q = browser.shown("q-z");
    assert_eq!(browser.text("zero-yaw"), "Yaw zero, this view z");
    key(&mut browser, "z");
    browser.until(
        "yaw is zeroed",
        "Math.abs(document.querySelector('[data-testid=yaw]').value) < 1e-9",
    );
    assert_eq!(browser.shown("q-z"), q, "the attitude is not touched");
    assert_eq!(
        browser
            .eval("document.querySelector('[data-testid=zero-yaw]').getAttribute('aria-pressed')"),
        "true"
    );
    key(&mut browser, "z");
    browser.until(
        "and back",
        &format!("Math.abs(document.querySelector('[data-testid=yaw]').value - {yaw}) < 1e-9"),
    );

    // Nothing on the page says how far a paused one was told.
    browser.eval(
        "{ const parse = JSON.parse; JSON.parse = (...text) => { const message = parse(...text); \
         if (message?.class === 'ATT') window.arrived = message.seq; return message; } }",
    );
    key(&mut browser, " ");
    assert_eq!(browser.text("pause"), "Go on space");
    turn(&mut sender, 500, 600);
    browser.until(
        "the daemon goes on",
        "window.arrived === 599 && document.querySelector('[data-testid=sensor-rate]').textContent !== '–'",
    );
    assert_eq!(browser.eval("__strapd.seq"), 499);
    key(&mut browser, " ");
    turn(&mut sender, 600, 700);
    browser.until(
        "the view goes on",
        "__strapd.seq === 699 && __strapd.sensors.imu0.points === 600",
    );
    // What was not looked at was not thinned.
    browser.until(
        "every sample",
        "document.querySelector('[data-testid=thinning]').textContent === 'every sample'",
    );

    key(&mut browser, "]");
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=window]').value"),
        "30"
    );
    key(&mut browser, "?");
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=help-dialog]').open"),
        true
    );
    key(&mut browser, "?");
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=help-dialog]').open"),
        false
    );
    key(&mut browser, "r");
    turn(&mut sender, 700, 701);
    browser.until("begun anew", "__strapd.sensors.imu0.points === 1");
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn pages_fit_a_phone_and_name_their_parts() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    for path in ["/?frozen=1", "/", "/top"] {
        for width in [360, 760, 1600] {
            browser.size(width, 800);
            browser.go(daemon.address(0), path);
            browser.until(
                "something is there",
                "document.querySelector('canvas, [data-testid=waiting]')",
            );
            let over = browser.number(
                "document.documentElement.scrollWidth - document.documentElement.clientWidth",
            );
            assert!(over <= 0.0, "{path} at {width}: {over} pixels too wide");
        }
        let nameless = browser.eval(
            "[...document.querySelectorAll('canvas:not([aria-hidden]), button, select, input')].filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.labels?.[0]?.textContent.trim())).map((e) => e.outerHTML)",
        );
        assert_eq!(nameless, serde_json::json!([]), "{path}");
        browser.is_unharmed();
    }
}
