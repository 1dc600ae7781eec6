//! A page that comes late shows what there was, and no number where there is none.

use super::browser::Browser;
use crate::serve::aiding::{aided, line};
use crate::serve::client::{Client, rate};
use crate::serve::daemon::{Daemon, TCP, WS, listening};
use serde_json::json;

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_sensor_that_has_ended_is_shown_as_it_was_last_and_one_without_an_attitude_without_a_number() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut early = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let mut last = json!(null);
    for n in 0..10 {
        sender.send(&rate("ended", n, 3.0));
        last = early.object("ATT");
    }
    drop(sender);
    let mut mute = Client::tcp(daemon.address(0));
    mute.send(&rate("mute", 0, 3.0).replace("[3,0,0]", "null"));
    mute.next_of("ERROR");

    browser.go(daemon.address(1), "/");
    browser.until_open();
    let of = |id: &str, what: &str| {
        format!("document.querySelector('[data-id={id}] [data-testid={what}]')")
    };
    browser.until(
        "its number",
        &format!("{}.value === '9'", of("ended", "seq")),
    );
    for (name, part) in [("q-w", "w"), ("q-x", "x")] {
        let shown = browser.eval(&format!("Number({}.value)", of("ended", name)));
        assert_eq!(shown, last["q"][part], "{name}");
    }
    assert_eq!(
        browser.eval(&format!("{}.textContent", of("ended", "flags"))),
        "last"
    );
    assert_eq!(browser.eval("__strapd.sensors.ended.points"), 1);

    browser.until("STATUS tells of the other", &of("mute", "seq").to_string());
    browser.until(
        "nothing is known of it",
        "!document.querySelector('[data-id=mute] [data-part=empty]').hidden",
    );
    let numbers = browser.eval(
        "[...document.querySelectorAll('[data-id=mute] data')].filter((e) => e.value !== '' || /[0-9]/.test(e.textContent)).map((e) => e.outerHTML)",
    );
    assert_eq!(numbers, json!([]));
    let drawn = browser.eval(
        "[...document.querySelectorAll('[data-id=mute] canvas:not([data-part=body])')].filter((c) => c.width && c.height && c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v)).map((c) => c.outerHTML)",
    );
    assert_eq!(drawn, json!([]), "scales without a line");
    let spoken = browser.eval(&format!(
        "{}.getAttribute('aria-label')",
        of("mute", "view3d")
    ));
    assert_eq!(spoken, "mute: no data yet");

    // It goes on, and is no longer the last.
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&rate("ended", 10, 3.0));
    browser.until(
        "it goes on",
        &format!(
            "__strapd.sensors.ended.seq === 10 && {}.textContent === ''",
            of("ended", "flags")
        ),
    );
    mute.send(&rate("mute", 1, 3.0));
    browser.until(
        "the other has begun",
        &format!(
            "__strapd.sensors.mute?.seq === 0 && {}.value === '0'",
            of("mute", "seq")
        ),
    );
    assert_eq!(
        browser.eval("document.querySelector('[data-id=mute] [data-part=empty]').hidden"),
        true
    );
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_stream_of_which_nothing_is_used_is_shown_with_what_helps() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let shown = "document.querySelector('[data-testid=refused]')";
    assert_eq!(browser.eval(&format!("{shown}.hidden")), true);
    let mut sender = Client::tcp(daemon.address(0));
    for _ in 0..200 {
        sender.send("{\"id\":\"mute\",\"gyro\":[0.1,0,0]}");
    }
    browser.until(
        "the loss on the page",
        &format!(
            "!{shown}.hidden && /^mute: 200 samples not used, first at line 1, .*--time log/.test({shown}.textContent)"
        ),
    );
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn who_ended_and_what_is_true_move_no_axis_no_edge_and_no_rate_of_a_sensor() {
    let mut browser = Browser::start();
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan = aided();
    let daemon = Daemon::start(settings);
    let of = |id: &str, n: u64| line(n).replace("imu0", id);
    // Its stamps are 400 s ahead of those of who comes later.
    let mut ended = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    ended.send(&of("ended", 40_000));
    ended.object("ATT");
    drop(ended);

    browser.size(390, 844);
    browser.go(daemon.address(1), "/");
    browser.until(
        "it was last",
        "document.querySelector('[data-id=ended] [data-testid=flags]')?.textContent === 'last'",
    );
    let part = |id: &str, name: &str| {
        format!("document.querySelector('[data-id={id}] [data-testid={name}]').textContent")
    };
    assert_eq!(browser.eval(&part("ended", "stamp")), "–");
    let mut sender = Client::tcp(daemon.address(0));
    for n in 0..350 {
        let truth = json!({"class": "ATT", "id": "truth", "seq": n, "stamp": {"sec": 1_700_000_000 + n / 100, "nsec": n % 100 * 10_000_000}, "q": {"w": 1, "x": 0, "y": 0, "z": 0}, "rotates": "sensor_to_world", "world": "level", "body": "flu"});
        sender.send(&format!("{}\n{truth}", of("forearm", n)));
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let span = browser.eval("__strapd.sensors.forearm.span");
    assert!(span[1].as_f64().unwrap() > 0.0, "{span}");
    assert_ne!(browser.text("health-rate"), "0 Hz");
    // Written at one moment, from one STATUS.
    let rates = browser.eval(&format!(
        "[{}, document.querySelector('[data-testid=health-rate]').textContent]",
        part("forearm", "sensor-rate")
    ));
    assert_eq!(rates[0], rates[1]);
    browser.until(
        "all that stands above the table",
        "['fleet-fold', 'yaw-zero-all', 'fleet-search'].every((name) => document.querySelector(`[data-testid=${name}]`).checkVisibility())",
    );
    assert_eq!(browser.text("fleet-fold"), "1 silent");
    let over = browser
        .number("document.documentElement.scrollWidth - document.documentElement.clientWidth");
    assert!(over <= 0.0, "{over} pixels too wide");
    let cell = |id: &str, name: &str| {
        format!("document.querySelector('[data-sensor={id}] [data-cell={name}]').textContent")
    };
    for name in ["sigma", "speed"] {
        assert_eq!(
            browser.eval(&cell("truth", name)),
            "–",
            "{name}: nobody knows"
        );
        assert_ne!(browser.eval(&cell("forearm", name)), "–");
    }
    assert_eq!(
        browser.eval("['frame', 'ellipse'].every((name) => document.querySelector(`[data-testid=${name}]`).title)"),
        true
    );
    assert!(browser.text("help-dialog").contains("flu → level"));
    browser.is_unharmed();
}
