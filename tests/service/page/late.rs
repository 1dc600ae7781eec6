//! A page that comes late shows what there was, and no number where there is none.

use super::browser::Browser;
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
