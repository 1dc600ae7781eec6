//! A report on paper: rendered to PDF, and looked at as it is laid out for print.

use super::browser::Browser;
use crate::serve::daemon::strapd;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// A4 without Chromium's margins, in pixels.
const PAPER: (u32, u32) = (718, 1047);

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_report_is_printed_whole_and_dark_on_white() {
    let mut browser = Browser::start();
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("r.html");
    let output = std::process::Command::new(strapd())
        .args(["report", "fixtures/xsens_mti.mcap", "fixtures/ximu3.mcap"])
        .arg("-o")
        .arg(&page)
        .output()
        .unwrap();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{output:?}");
    let (width, height) = PAPER;
    browser.size(width, height);
    let dark = json!([{"name": "prefers-color-scheme", "value": "dark"}]);
    browser.call(
        "Emulation.setEmulatedMedia",
        json!({"media": "print", "features": dark}),
    );
    let url = format!("file://{}", page.display());
    browser.call("Page.navigate", json!({"url": url}));
    browser.until(
        "its script has run",
        "document.readyState === 'complete' && __report.pictures.length > 8",
    );
    // Nothing is wider than the paper, and nothing would have to be scrolled.
    let cut = browser.eval(
        "[...document.querySelectorAll('main *')].filter((e) => !e.closest('svg') && e.getClientRects().length && (e.getBoundingClientRect().right > innerWidth + 0.5 || (getComputedStyle(e).overflowX !== 'visible' && e.scrollWidth > e.clientWidth + 1))).map((e) => e.outerHTML.slice(0, 160))",
    );
    assert_eq!(cut, json!([]));
    // The pictures stand in place of what has to be pointed at, each on one page.
    let shown = |what: &str| {
        format!(
            "[...document.querySelectorAll('{what}')].filter((e) => e.getClientRects().length).length"
        )
    };
    assert_eq!(browser.eval(&shown("canvas, figcaption")), 0);
    assert!(browser.number(&shown("figure svg")) >= 10.0);
    let split = browser.eval(&format!(
        "[...document.querySelectorAll('figure')].filter((e) => getComputedStyle(e).breakInside !== 'avoid' || e.getBoundingClientRect().height > {height}).length"
    ));
    assert_eq!(split, 0);
    let colour =
        |of: &str, name: &str| format!("getComputedStyle(document.querySelector('{of}')).{name}");
    assert_eq!(
        browser.eval(&colour("body", "backgroundColor")),
        "rgb(255, 255, 255)"
    );
    assert_eq!(browser.eval(&colour("h1", "color")), "rgb(27, 27, 27)");
    let pdf = browser.call(
        "Page.printToPDF",
        json!({"paperWidth": 8.27, "paperHeight": 11.69, "printBackground": true}),
    );
    let pdf = STANDARD.decode(pdf["data"].as_str().unwrap()).unwrap();
    let text = String::from_utf8_lossy(&pdf);
    assert!(text.starts_with("%PDF-"));
    // The table, and some pages for each log.
    let pages = text.matches("/Type /Page\n").count() + text.matches("/Type /Page ").count();
    assert!((9..=18).contains(&pages), "{pages} pages");
    let named: Value =
        browser.eval("[...document.querySelectorAll('article > h1')].map((e) => e.textContent)");
    assert_eq!(named, json!(["xsens_mti.mcap", "ximu3.mcap"]));
}
