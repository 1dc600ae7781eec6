//! The interactive top says what `strapd model top` says.

use super::browser::Browser;
use crate::serve::daemon::{Daemon, WS, listening, strapd};
use serde_json::Value;
use std::process::Command;

fn by_command(case: &str, method: &str, rate_hz: &str) -> Value {
    let output = Command::new(strapd())
        .args([
            "model",
            "top",
            "--json",
            "--case",
            case,
            "--rate-hz",
            rate_hz,
            "--methods",
        ])
        .arg(format!("{method},euler-angles,auto"))
        .output()
        .unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_case_and_a_method_are_chosen_and_the_error_is_that_of_the_command() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    browser.go(daemon.address(0), "/top");
    browser.until("the first", "__strapd.asked >= 1");
    for (case, method, rate) in [
        ("looping", "live-left", "2000"),
        ("wavy", "gyro-mean", "700"),
    ] {
        browser.eval(&format!(
            "(() => {{ const form = document.querySelector('[data-testid=form]'); form.elements.case.value = '{case}'; form.elements.method.value = '{method}'; form.elements.rate_hz.value = '{rate}'; form.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()"
        ));
        browser.until(
            "it is computed",
            &format!("__strapd.state === 'open' && __strapd.run.case === '{case}' && __strapd.run.methods[0].name === '{method}' && __strapd.run.rate_hz === {rate}"),
        );
        let expected = by_command(case, method, rate);
        for name in [method, "euler-angles", "auto"] {
            for part in ["axis_max", "attitude_max"] {
                let shown = browser.shown(&format!("{part}-{name}"));
                let said = expected["errors_deg"][name][part].as_f64().unwrap();
                assert_eq!(shown, said, "{case}, {name}, {part}");
            }
        }
        let drawn = browser.number("Math.max(...__strapd.run.methods[0].error_deg)");
        let said = expected["errors_deg"][method]["attitude_max"]
            .as_f64()
            .unwrap();
        assert!((drawn - said).abs() <= 0.001 * said, "{drawn}, {said}");
    }
    // Something is drawn on every canvas.
    let blank = browser.eval("[...document.querySelectorAll('canvas')].filter((c) => !c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v)).length");
    assert_eq!(blank, 0);
    // What cannot be is said, and the page lives on.
    browser.eval("(() => { const form = document.querySelector('[data-testid=form]'); form.elements.case.value = 'steady-slow'; form.elements.spin_hz.value = '1'; form.dispatchEvent(new Event('input', { bubbles: true })); })()");
    browser.until(
        "the reason",
        "/no steady precession/.test(document.querySelector('[data-testid=problem]').textContent)",
    );
    browser.eval("(() => { const form = document.querySelector('[data-testid=form]'); form.elements.case.value = 'sleeping'; form.elements.method.value = 'live-right'; form.elements.spin_hz.value = '20'; form.dispatchEvent(new Event('input', { bubbles: true })); })()");
    browser.until(
        "the next",
        "__strapd.state === 'open' && __strapd.run.case === 'sleeping'",
    );
    assert_eq!(browser.eval("window.__violations.length"), 0);
}
