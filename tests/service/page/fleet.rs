//! A hundred sensors: a table that can be sorted, and who is silent stands last.

use super::browser::Browser;
use crate::serve::client::Client;
use crate::serve::daemon::{Daemon, TCP, WS, listening};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

fn line(id: &str, n: u64, yaw_rate: f64) -> String {
    json!({"class": "RATE", "id": id, "stamp_ns": 1_700_000_000_000_000_000 + n * 100_000_000, "gyro": [0.0, 0.0, yaw_rate]}).to_string()
}

/// Ids by the rows of the table, those that are folded away not.
fn ids(browser: &mut Browser) -> Vec<String> {
    let rows = browser.eval("[...document.querySelectorAll('[data-testid=fleet-table] tbody tr:not([hidden])')].map((e) => e.dataset.sensor)");
    let rows = rows.as_array().unwrap().iter();
    rows.map(|id| id.as_str().unwrap().to_owned()).collect()
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_hundred_sensors_are_a_table_and_who_is_silent_is_last() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut sender = Client::tcp(daemon.address(0));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    // s4 falls silent after a second; the others go on to the end.
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = stop.clone();
    let sending = std::thread::spawn(move || {
        for n in 0.. {
            let some = (0..100_u32).filter(|id| n < 10 || *id != 4);
            let lines: Vec<String> = some
                .map(|id| line(&format!("s{id}"), n, f64::from((id * 37) % 100) * 0.001))
                .collect();
            sender.send(&lines.join("\n"));
            std::thread::sleep(std::time::Duration::from_millis(100));
            if stopped.load(Ordering::Relaxed) {
                return;
            }
        }
    });
    browser.until(
        "all are there",
        "document.querySelectorAll('[data-testid=fleet-table] tbody tr').length === 100",
    );
    assert_eq!(
        browser.eval("document.querySelectorAll('[data-testid=sensor]').length"),
        8,
        "drawn are as many as can be looked at"
    );
    browser.until("s4 is last", "document.querySelector('[data-testid=fleet-table] tbody').lastElementChild.dataset.sensor === 's4'");
    assert_eq!(
        ids(&mut browser)[..5],
        ["s0", "s1", "s2", "s3", "s5"],
        "by name, numbers as numbers"
    );
    let sort = "document.querySelector('[data-sort=yaw]').click()";
    let sorted = "document.querySelector('[data-column=yaw]').getAttribute('aria-sort')";
    for (word, sense) in [("ascending", 1.0), ("descending", -1.0)] {
        browser.eval(sort);
        assert_eq!(browser.eval(sorted), word);
        let yaws = browser.eval("[...document.querySelectorAll('[data-testid=fleet-table] tbody tr')].map((e) => Number(e.querySelector('[data-cell=yaw]').textContent.replace('−', '-')))");
        let yaws: Vec<f64> = yaws
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap_or(f64::NAN))
            .collect();
        let awry = yaws[..99]
            .windows(2)
            .filter(|two| two.iter().any(|yaw| yaw.is_nan()) || sense * two[0] > sense * two[1])
            .count();
        assert_eq!(awry, 0, "{word}: {yaws:?}");
        assert_eq!(
            ids(&mut browser).last().unwrap(),
            "s4",
            "the silent one is last in every order"
        );
    }

    // Its card is the last, and folded; it can be unfolded, and the row folded away.
    browser.until(
        "it is",
        "(() => { const e = [...document.querySelectorAll('[data-testid=sensor]')].at(-1); return e.dataset.id === 's4' && e.classList.contains('folded') && e.querySelector('[data-testid=fold]').getAttribute('aria-expanded') === 'false'; })()",
    );
    browser.eval("document.querySelector('[data-id=s4] [data-testid=fold]').click()");
    assert_eq!(
        browser.eval(
            "document.querySelector('[data-id=s4] [data-testid=plot-rate]').offsetParent !== null"
        ),
        true
    );
    assert_eq!(browser.text("fleet-fold"), "1 silent");
    browser.eval("document.querySelector('[data-testid=fleet-fold]').click()");
    assert_eq!(ids(&mut browser).len(), 99);

    // One of the others, alone; and one beside it, in one view.
    browser.eval("document.querySelector('[data-sensor=s77] button').click()");
    let shown = "[...document.querySelectorAll('[data-testid=sensor]')].map((e) => e.dataset.id)";
    browser.until(
        "it alone",
        &format!("JSON.stringify({shown}) === '[\"s77\"]'"),
    );
    browser.eval("document.querySelector('[data-sensor=s9] input').click()");
    browser.until("both in one view", "JSON.stringify(__strapd.together) === '[\"s77\",\"s9\"]' && __strapd.sensors.s77.points > 0 && __strapd.sensors.s9.points > 0");
    stop.store(true, Ordering::Relaxed);
    sending.join().unwrap();
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_name_is_text_in_every_script() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut sender = Client::tcp(daemon.address(0));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let names = [
        "<img src=x onerror=alert(1)>",
        "\"'`</script>&amp;",
        "مستشعر",
        "傾き",
        "датчик",
        "z\u{301}\u{302}",
    ];
    for n in 0..3 {
        for name in names {
            sender.send(&line(name, n, 0.1));
        }
    }
    browser.until(
        "all are there",
        "Object.keys(__strapd.sensors).length === 6 && document.querySelectorAll('[data-testid=fleet-table] tbody tr').length === 6 && [...document.querySelectorAll('[data-testid=fleet-table] [data-cell=sensor]')].every((e) => e.textContent)",
    );
    let heads = browser.eval(
        "[...document.querySelectorAll('[data-testid=sensor] h2')].map((e) => e.textContent)",
    );
    let rows = browser.eval("[...document.querySelectorAll('[data-testid=fleet-table] [data-cell=sensor]')].map((e) => e.textContent)");
    for name in names {
        for shown in [&heads, &rows] {
            assert!(
                shown.as_array().unwrap().contains(&Value::from(name)),
                "{name}: {shown}"
            );
        }
    }
    assert_eq!(browser.eval("document.images.length"), 1, "our own");
    let over = browser
        .number("document.documentElement.scrollWidth - document.documentElement.clientWidth");
    assert!(over <= 0.0, "{over} pixels too wide");
    // What the daemon refuses in an id, and a recording may hold in a topic.
    let plain = browser
        .eval("import('/page/numbers.js').then((m) => m.plain('a\\u0000\\u202eb\\u2028\\u200d'))");
    assert_eq!(plain, "a\\u{0}\\u{202e}b\\u{2028}\\u{200d}");
    browser.is_unharmed();
}
