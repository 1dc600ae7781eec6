//! Layout of the live page at the widths of a phone and of screens: what is read most is largest, and nothing lies on
//! anything else.

use super::browser::Browser;
use crate::serve::aiding::{aided, line};
use crate::serve::client::Client;
use crate::serve::daemon::{Daemon, TCP, WS, eventually, listening};
use serde_json::{Value, json};

/// Pairs of texts that share pixels, and texts that leave the window. What scrolls in a box of its own may.
const TEXTS: &str = "(() => {
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const boxes = [];
    while (walk.nextNode()) {
        const [text, parent] = [walk.currentNode.data.trim(), walk.currentNode.parentElement];
        if (!text || !parent.checkVisibility({ visibilityProperty: true }) || parent.closest('.unseen, option, .wide, [data-testid=notice]')) continue;
        const range = document.createRange();
        range.selectNodeContents(walk.currentNode);
        for (const box of range.getClientRects()) if (box.width > 1 && box.height > 1) boxes.push({ text, box });
    }
    const shared = (a, b, from, to) => Math.min(a[to], b[to]) - Math.max(a[from], b[from]);
    const found = boxes.filter(({ box }) => box.right > innerWidth + 1 || box.left < -1).map(({ text }) => `outside: ${text}`);
    boxes.forEach((one, n) => boxes.slice(n + 1).forEach((other) => {
        if (shared(one.box, other.box, 'left', 'right') > 1.5 && shared(one.box, other.box, 'top', 'bottom') > 4) found.push(`${one.text} | ${other.text}`);
    }));
    return boxes.length > 30 ? found : ['too few texts'];
})()";

/// Controls that a finger would miss.
const SMALL: &str = "[...document.querySelectorAll('button, a, select, input, summary')]
    .filter((e) => e.checkVisibility({ visibilityProperty: true }) && !e.closest('dialog:not([open])'))
    .map((e) => [e, (e.type === 'checkbox' ? e.closest('label') : e).getBoundingClientRect()])
    .filter(([, box]) => box.width < 43.5 || box.height < 43.5)
    .map(([e, box]) => `${e.dataset.testid ?? e.outerHTML.slice(0, 80)} ${box.width} x ${box.height}`)";

/// Place of a part of the first card: left, top, width, height.
fn place(browser: &mut Browser, part: &str) -> [f64; 4] {
    let found = browser.eval(&format!(
        "(() => {{ const b = document.querySelector('[data-id=imu] {part}').getBoundingClientRect(); return [b.left, b.top + scrollY, b.width, b.height]; }})()"
    ));
    [0, 1, 2, 3].map(|n| found[n].as_f64().unwrap())
}

/// A daemon with a sensor that gravity corrects, and the truth beside it.
fn two_cards() -> (Daemon, Client) {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan = aided();
    let daemon = Daemon::start(settings);
    let mut sender = Client::tcp(daemon.address(0));
    let as_said = |id: &str, n: u64| {
        let mut sample: Value = serde_json::from_str(&line(n)).unwrap();
        sample["id"] = json!(id);
        sample.to_string()
    };
    let lines: Vec<String> = (0..1000)
        .flat_map(|n| [as_said("imu", n), as_said("truth", n)])
        .collect();
    sender.send(&lines.join("\n"));
    eventually("all was taken", || {
        daemon.status()["counters"]["attitudes"] == 2000
    });
    (daemon, sender)
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn curves_are_first_and_large_and_no_text_lies_on_another_at_any_width() {
    let mut browser = Browser::start();
    let (daemon, _sender) = two_cards();
    for theme in ["light", "dark"] {
        browser.call(
            "Emulation.setEmulatedMedia",
            json!({"features": [{"name": "prefers-color-scheme", "value": theme}]}),
        );
        for width in [390, 760, 1280, 1440, 1920] {
            browser.size(width, if width < 500 { 844 } else { 900 });
            browser.go(daemon.address(1), "/");
            browser.until(
                "everything is there",
                "__strapd.sensors.imu.error !== undefined && document.querySelector('[data-id=imu] [data-testid=tilt-sigma]').value && !document.querySelector('[data-id=imu] [data-part=errorBox]').hidden",
            );
            assert_eq!(browser.eval(TEXTS), json!([]), "{theme}, {width}");
            let plots = ["plot-error", "plot-attitude", "plot-rate"]
                .map(|name| place(&mut browser, &format!("[data-testid={name}]")));
            let body = place(&mut browser, "[data-testid=view3d]");
            let inside = place(&mut browser, ".inside");
            assert!(plots.is_sorted_by(|a, b| a[1] + a[3] <= b[1]), "{plots:?}");
            // One axis of time: each begins and ends where the others do.
            assert!(
                plots
                    .iter()
                    .all(|p| p[0] == plots[0][0] && p[2] == plots[0][2])
            );
            if width < 800 {
                assert!(body[1] + body[3] <= plots[0][1], "{width}: the body first");
                assert!(
                    plots[0][2] > 0.95 * inside[2],
                    "{width}: {plots:?} {inside:?}"
                );
            } else {
                assert!(
                    plots[0][2] > 0.58 * inside[2],
                    "{width}: {plots:?} {inside:?}"
                );
                assert!(body[0] > plots[0][0] + plots[0][2], "{width}: beside them");
                assert!(plots[0][1] < 450.0 && plots[0][3] >= 170.0, "{plots:?}");
            }
        }
    }
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_phone_shows_the_body_first_and_every_control_fits_a_finger() {
    let mut browser = Browser::start();
    let (daemon, mut sender) = two_cards();
    browser.size(390, 844);
    browser.go(daemon.address(1), "/");
    browser.until(
        "a body",
        "document.querySelector('[data-id=imu] [data-testid=tilt-sigma]').value",
    );
    let body = place(&mut browser, "[data-testid=view3d]");
    assert!(body[1] < 250.0 && body[1] + body[3] < 844.0, "{body:?}");
    let shown = "document.querySelector('[data-testid=pause]').checkVisibility()";
    assert_eq!(browser.eval(shown), false, "controls are folded");
    assert_eq!(browser.eval(SMALL), json!([]));
    browser.eval("document.querySelector('[data-testid=menu]').click()");
    assert_eq!(browser.eval(shown), true);
    assert_eq!(browser.eval(SMALL), json!([]), "unfolded");
    assert_eq!(browser.eval(TEXTS), json!([]), "unfolded");
    browser.eval("document.querySelector('[data-testid=help]').click()");
    let cut = "(() => { const e = document.querySelector('dialog'); return [e.scrollWidth - e.clientWidth, e.getBoundingClientRect().right > innerWidth]; })()";
    assert_eq!(browser.eval(cut), json!([0, false]), "the help is whole");
    browser.eval("document.querySelector('dialog').close()");

    // A table, too.
    let some: Vec<String> = (0..4)
        .map(|n| line(0).replace("imu0", &format!("left forearm {n}")))
        .collect();
    sender.send(&some.join("\n"));
    browser.until(
        "a table",
        "!document.querySelector('[data-testid=fleet]').hidden",
    );
    assert_eq!(browser.eval(SMALL), json!([]), "with a table");
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn forty_sensors_are_found_by_name_and_sorted_by_age() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut sender = Client::tcp(daemon.address(0));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let of = |ids: std::ops::Range<u64>, n: u64| {
        let lines = ids.map(|id| {
            json!({"class": "RATE", "id": format!("node {id}"), "stamp_ns": 1_700_000_000_000_000_000 + n * 10_000_000, "gyro": [0.0, 0.0, 1.0]}).to_string()
        });
        lines.collect::<Vec<_>>().join("\n")
    };
    sender.send(&of(0..1, 0));
    browser.until("the first", "Object.keys(__strapd.sensors).length === 1");
    std::thread::sleep(std::time::Duration::from_millis(1500));
    sender.send(&of(1..40, 0));
    let rows = "[...document.querySelectorAll('[data-testid=fleet-table] tbody tr:not([hidden])')]";
    browser.until("all", &format!("{rows}.length === 40"));
    browser.eval("document.querySelector('[data-sort=age]').click(); document.querySelector('[data-sort=age]').click()");
    // Who is silent is last: on a slow machine five seconds have gone by, and it heads those who are silent as it is.
    let oldest = format!("{rows}.find((row) => row.dataset.sensor === 'node 0')");
    let is_silent = |row: &str| format!("{row}.classList.contains('silent')");
    let first = browser.eval(&format!(
        "{rows}.find((row) => {} === {}).dataset.sensor",
        is_silent("row"),
        is_silent(&oldest)
    ));
    assert_eq!(first, "node 0");
    let age = browser.eval(&format!(
        "{oldest}.querySelector('[data-cell=age]').textContent"
    ));
    let age: f64 = age.as_str().unwrap().parse().unwrap();
    assert!((1.4..60.0).contains(&age), "{age}");
    browser.eval(
        "(() => { const search = document.querySelector('[data-testid=fleet-search]'); search.value = ' NODE 3'; search.dispatchEvent(new Event('input')); })()",
    );
    // 3, and 30 to 39.
    assert_eq!(browser.eval(&format!("{rows}.length")), 11);
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_number_has_no_more_digits_than_its_sigma_leaves() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    browser.go(daemon.address(0), "/?frozen=1");
    let said = browser.eval(
        "import('/page/numbers.js').then(({ meaning, error }) => [[20, 2, 0.7, 0.05, 1e-9, NaN].map((sigma) => meaning(sigma)), [12.3456, 0.0123456, 3.1e-12, 0].map(error)])",
    );
    assert_eq!(
        said,
        json!([[0, 0, 1, 2, 4, 2], ["12.35", "0.0123", "3.1e−12", "0.00"]])
    );
}
