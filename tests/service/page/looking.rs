//! Plots can be read: values under the pointer, zoom, one cursor for all, by hand and by keyboard.

use super::browser::Browser;
use super::drawing::{axes, projected};
use crate::serve::daemon::{Daemon, WS, listening};
use serde_json::{Value, json};

/// Pixels beside the lines: `src/web/plot.js`.
const LEFT: f64 = 52.0;
const RIGHT: f64 = 8.0;

const RATE: &str = "[data-id=imu0] [data-testid=plot-rate]";

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Pixel of an instant of a plot that shows `from` to `to`.
fn pixel([middle, y, width]: [f64; 3], time: f64, [from, to]: [f64; 2]) -> [f64; 2] {
    let within = (time - from) / (to - from);
    let x = middle - width / 2.0 + LEFT + within * (width - LEFT - RIGHT);
    [x, y]
}

fn held(browser: &mut Browser, id: &str) -> Value {
    browser.eval(&format!("__strapd.sensors[`{id}`].held"))
}

/// A page with 10 s of a known motion of two sensors, at 200 Hz.
fn page(browser: &mut Browser, daemon: &Daemon) {
    browser.go(daemon.address(0), "/?frozen=1");
    browser.until(
        "it is drawn",
        "__strapd.sensors.imu0?.plotted?.points > 100",
    );
    assert_eq!(browser.eval("__strapd.sensors.imu0.span"), json!([0, 10]));
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn where_one_points_all_plots_and_views_show_that_instant() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    page(&mut browser, &daemon);
    let live = browser.eval("__strapd.sensors.imu0.tips");
    let place = browser.place(RATE);
    let at = pixel(place, 4.0, [0.0, 10.0]);
    browser.mouse("mouseMoved", at, json!({}));
    browser.until(
        "a cursor",
        "__strapd.sensors.imu0.held && __strapd.sensors.truth.held",
    );
    for id in ["imu0", "truth"] {
        let held = held(&mut browser, id);
        let time = number(&held["at"]["time"]);
        // Half a pixel and half a sample.
        assert!((time - 4.0).abs() < 0.02, "{id}: {held}");
        assert_eq!(number(&held["at"]["seq"]), (time * 200.0).round(), "{id}");
    }
    let held = held(&mut browser, "imu0");
    let q = ["w", "x", "y", "z"].map(|name| number(&held["at"]["q"][name]));
    browser.until(
        "the numbers are those of that instant",
        &format!(
            "document.querySelector('[data-id=imu0] [data-testid=q-x]').value === '{}'",
            held["at"]["q"]["x"]
        ),
    );
    let shown =
        browser.eval("document.querySelector('[data-id=imu0] [data-testid=held]').textContent");
    assert!(shown.as_str().unwrap().starts_with("at 0:0"), "{shown}");
    // And the body is drawn in the attitude it had.
    let tips = browser.eval("__strapd.sensors.imu0.tips");
    assert_ne!(tips, live);
    let [width, height] = ["clientWidth", "clientHeight"].map(|side| {
        browser.number(&format!(
            "document.querySelector('[data-id=imu0] [data-testid=view3d]').{side}"
        ))
    });
    for (axis, direction) in axes(q).into_iter().enumerate() {
        let expected = projected(direction, width, height);
        let off =
            (number(&tips[axis][0]) - expected[0]).hypot(number(&tips[axis][1]) - expected[1]);
        assert!(off < 1e-6, "axis {axis}: {off} pixels");
    }
    // The error is that of the instant too: 0.002 t in the scalar of a turn.
    let error = number(&held["at"]["error"]);
    assert!(error > 0.5 && error < 1.5, "{error}");

    // Away from the plots all is as before.
    browser.mouse("mouseMoved", [2.0, 2.0], json!({}));
    browser.until("no cursor", "__strapd.sensors.imu0.held === null");
    assert_eq!(browser.eval("__strapd.sensors.imu0.tips"), live);
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_wheel_and_a_drag_zoom_and_a_double_click_goes_back() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    page(&mut browser, &daemon);
    let place = browser.place(RATE);
    // Some time after it was scrolled to, or the wheel would scroll on.
    std::thread::sleep(std::time::Duration::from_millis(400));
    let at = pixel(place, 6.0, [0.0, 10.0]);
    browser.mouse("mouseMoved", at, json!({}));
    browser.mouse("mouseWheel", at, json!({"deltaX": 0, "deltaY": -240}));
    browser.until("it is zoomed", "__strapd.sensors.imu0.span[0] > 0.5 && __strapd.sensors.truth.span[0] === __strapd.sensors.imu0.span[0]");
    let range = browser.eval("__strapd.sensors.imu0.span");
    let [from, to] = [0, 1].map(|n| number(&range[n]));
    assert!(to - from < 8.0 && to - from > 5.0, "{range}");
    // What was under the pointer is there still.
    assert!(
        (pixel(place, 6.0, [from, to])[0] - at[0]).abs() < 1.5,
        "{range}"
    );
    assert_eq!(
        browser.eval("__strapd.sensors.truth.span"),
        range,
        "one stretch for all"
    );
    let lines = browser.number("__strapd.sensors.imu0.plotted.points");

    let ends = [5.0, 5.5].map(|time| pixel(place, time, [from, to]));
    let button = json!({"button": "left", "buttons": 1, "clickCount": 1});
    browser.mouse("mousePressed", ends[0], button.clone());
    browser.mouse(
        "mouseMoved",
        [(ends[0][0] + ends[1][0]) / 2.0, ends[0][1]],
        json!({"buttons": 1}),
    );
    browser.mouse("mouseMoved", ends[1], json!({"buttons": 1}));
    browser.mouse("mouseReleased", ends[1], button.clone());
    browser.until(
        "what was dragged over",
        "__strapd.view.range?.[1] - __strapd.view.range?.[0] < 0.6",
    );
    let range = browser.eval("__strapd.view.range");
    assert!(
        (number(&range[0]) - 5.0).abs() < 0.02 && (number(&range[1]) - 5.5).abs() < 0.02,
        "{range}"
    );
    browser.until(
        "it is drawn",
        &format!("__strapd.sensors.imu0.plotted.points < {lines}"),
    );

    // With shift it is moved.
    browser.mouse(
        "mousePressed",
        ends[0],
        json!({"button": "left", "buttons": 1, "clickCount": 1, "modifiers": 8}),
    );
    browser.mouse("mouseMoved", ends[1], json!({"buttons": 1, "modifiers": 8}));
    browser.mouse(
        "mouseReleased",
        ends[1],
        json!({"button": "left", "modifiers": 8}),
    );
    browser.until("it has moved", "__strapd.view.range[0] < 4.99");
    let length = browser.number("__strapd.view.range[1] - __strapd.view.range[0]");
    assert!((length - 0.5).abs() < 0.02, "{length}");
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=live]').hidden"),
        false
    );

    for clicks in [1, 2] {
        let button = json!({"button": "left", "buttons": 1, "clickCount": clicks});
        browser.mouse("mousePressed", at, button.clone());
        browser.mouse("mouseReleased", at, button);
    }
    browser.until(
        "back to live",
        "__strapd.view.live && __strapd.sensors.imu0.span[0] === 0",
    );
    assert_eq!(browser.eval("__strapd.sensors.imu0.span"), json!([0, 10]));
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=live]').hidden"),
        true
    );
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_keyboard_does_what_a_mouse_does_and_a_screen_reader_hears_it() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    page(&mut browser, &daemon);
    let slider =
        |name: &str| format!("document.querySelector('{RATE}').getAttribute('aria-{name}')");
    assert_eq!(
        browser.eval(&format!(
            "document.querySelector('{RATE}').getAttribute('role')"
        )),
        "slider"
    );
    browser.eval(&format!("document.querySelector('{RATE}').focus()"));
    // Three steps of a hundredth back from the newest.
    for _ in 0..3 {
        browser.press("ArrowLeft");
    }
    browser.until(
        "the cursor",
        "Math.abs(__strapd.sensors.imu0.held?.cursor - 9.7) < 1e-6",
    );
    browser.until(
        "it is told",
        &format!("{}?.startsWith('0:09.700: x ')", slider("valuetext")),
    );
    let now = browser.eval(&slider("valuenow"));
    assert_eq!(now, "9.700");
    browser.press("Home");
    browser.until("the start", "__strapd.sensors.imu0.held?.at?.seq === 0");
    browser.press("+");
    browser.until(
        "it is zoomed",
        "__strapd.view.range[1] - __strapd.view.range[0] < 7.1",
    );
    browser.press("PageDown");
    browser.until("moved", "__strapd.view.range[0] > 5");
    browser.press("Escape");
    browser.until(
        "back to live",
        "__strapd.view.live && __strapd.sensors.imu0.held === null",
    );
    // The keys of a plot are not those of the page: + is a recording's speed there.
    browser.is_unharmed();
}

/// Range of the plots, once they no longer show what they did.
fn range(browser: &mut Browser, before: &Value) -> [f64; 2] {
    browser.until(
        "they show something else",
        &format!("__strapd.view.range && JSON.stringify(__strapd.view.range) !== `{before}`"),
    );
    let range = browser.eval("__strapd.view.range");
    [0, 1].map(|n| number(&range[n]))
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_tap_looks_a_finger_moves_and_two_zoom() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    browser.size(390, 844);
    browser.call(
        "Emulation.setTouchEmulationEnabled",
        json!({"enabled": true, "maxTouchPoints": 2}),
    );
    page(&mut browser, &daemon);
    let place = browser.place(RATE);
    let whole = [0.0, 10.0];
    // A tap: that instant, and it stays when the finger has gone.
    let at = |time: f64| pixel(place, time, whole);
    browser.fingers("touchStart", &[at(4.0)]);
    browser.fingers("touchEnd", &[]);
    browser.until(
        "a cursor",
        "Math.abs(__strapd.sensors.imu0.held?.cursor - 4) < 0.05",
    );
    // The whole of a finger's way is that of what lies below it.
    let before = json!(whole);
    browser.fingers("touchStart", &[at(6.0)]);
    for step in 1..=8 {
        browser.fingers("touchMove", &[at(6.0 - 0.25 * f64::from(step))]);
    }
    browser.fingers("touchEnd", &[]);
    browser.until("it was moved", "__strapd.view.range[0] > 1.9");
    let [from, to] = range(&mut browser, &before);
    assert!(
        (from - 2.0).abs() < 0.1 && (to - 12.0).abs() < 0.1,
        "{from} to {to}"
    );
    // What is below each of two fingers stays there.
    let [middle, y, width] = place;
    let inner = width - LEFT - RIGHT;
    let part = |part: f64| [middle - width / 2.0 + LEFT + part * inner, y];
    browser.fingers("touchStart", &[part(0.4)]);
    browser.fingers("touchStart", &[part(0.4), part(0.6)]);
    for step in 1..=10 {
        let by = 0.02 * f64::from(step);
        browser.fingers("touchMove", &[part(0.4 - by), part(0.6 + by)]);
    }
    browser.fingers("touchEnd", &[]);
    browser.until(
        "it was zoomed",
        "__strapd.view.range[1] - __strapd.view.range[0] < 3.4",
    );
    let [near, far] = range(&mut browser, &json!([from, to]));
    let length = to - from;
    for (before, now) in [(0.4, 0.2), (0.6, 0.8)] {
        let (was, is) = (from + before * length, near + now * (far - near));
        assert!((was - is).abs() < 0.005 * length, "{was} s is at {is} s");
    }
    // Along the page a finger scrolls it, and the plots stay as they are.
    let scrolled = browser.number("scrollY");
    browser.fingers("touchStart", &[[middle, y]]);
    for step in 1..=10 {
        browser.fingers("touchMove", &[[middle, y - 15.0 * f64::from(step)]]);
    }
    browser.fingers("touchEnd", &[]);
    browser.until(
        "the page was scrolled",
        &format!("scrollY > {scrolled} + 50"),
    );
    let after = browser.eval("__strapd.view.range");
    assert_eq!(after, json!([near, far]));
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn where_nothing_came_there_is_no_number() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    page(&mut browser, &daemon);
    browser.eval(&format!("document.querySelector('{RATE}').focus()"));
    browser.press("PageDown");
    browser.until("beyond the end", "__strapd.view.range[0] > 7");
    browser.press("PageDown");
    browser.press("ArrowLeft");
    browser.until(
        "a cursor where nothing is",
        "__strapd.sensors.imu0.held && __strapd.sensors.imu0.held.at === null",
    );
    browser.until("no number", "[...document.querySelectorAll('[data-id=imu0] .views data')].every((e) => e.value === '' && !/[0-9]/.test(e.textContent))");
    let words =
        browser.eval("document.querySelector('[data-id=imu0] [data-part=empty]').textContent");
    assert!(
        words.as_str().unwrap().starts_with("no data at 0:"),
        "{words}"
    );
    browser.is_unharmed();
}
