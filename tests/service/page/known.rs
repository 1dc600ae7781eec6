//! Knowledge of an attitude and its sensor on the page, and the button that begins it anew.

use super::admission::elsewhere;
use super::browser::Browser;
use crate::serve::aiding::{aided, line, roll};
use crate::serve::client::Client;
use crate::serve::daemon::{Daemon, TCP, WS, eventually, listening};
use serde_json::{Value, json};
use strapd::serve::guard::admission::Token;
use strapd_attitude::estimate::EstimationSettings;

const SECRET: &str = "correct horse battery";

/// A daemon, and who has sent it 20 s of a body that rolls; its token was shown where there is one.
fn rolling(token: Option<&str>, plan: EstimationSettings) -> (Daemon, Client) {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan = plan;
    settings.hub.token = token.map(Token::new);
    let daemon = Daemon::start(settings);
    let mut sender = Client::tcp(daemon.address(0));
    if let Some(token) = token {
        sender.send(&format!("{{\"class\":\"AUTH\",\"token\":\"{token}\"}}"));
    }
    let lines: Vec<String> = (0..2000).map(line).collect();
    sender.send(&lines.join("\n"));
    eventually("all was taken", || {
        daemon.status()["sources"][0]["attitudes"] == 2000
    });
    (daemon, sender)
}

const BUTTON: &str = "document.querySelector('[data-testid=anew]')";

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_page_shows_what_is_known_and_begins_a_sensor_anew_at_the_second_click() {
    for token in [None, Some(SECRET)] {
        let mut browser = Browser::start();
        let (daemon, mut sender) = rolling(token, aided());
        browser.go(daemon.address(1), "/");
        if let Some(token) = token {
            browser.until("it asks", "__strapd.state === 'token'");
            browser.eval(&format!(
                "(() => {{ const form = document.querySelector('[data-testid=token]'); form.querySelector('input').value = '{token}'; form.requestSubmit(); }})()"
            ));
        }
        browser.until_open();
        browser.until(
            "what is known",
            "!document.querySelector('[data-testid=known]').hidden && document.querySelector('[data-testid=tilt-sigma]').value",
        );
        let source = daemon.status()["sources"][0].clone();
        let near = |shown: f64, said: &Value| {
            let said = said.as_f64().unwrap();
            assert!(
                (shown - said).abs() < 1e-9 * said.abs().max(1.0),
                "{shown} {said}"
            );
        };
        near(
            browser.shown("tilt-sigma"),
            &source["attitude"]["sigma_deg"]["tilt"],
        );
        near(
            browser.shown("heading-sigma"),
            &source["attitude"]["sigma_deg"]["heading"],
        );
        let bias = source["aid"]["learned"]["gyro_bias_rad_s"][0]
            .as_f64()
            .unwrap();
        near(
            browser.shown("gyro_bias_rad_s-0"),
            &json!(bias.to_degrees()),
        );
        assert_eq!(browser.text("aided"), "level by gravity");
        assert_eq!(browser.text("rest"), "moving");
        assert_eq!(
            browser.text("flags"),
            "last",
            "aided is nothing that must be looked at"
        );
        // One click asks whether it is meant.
        assert_eq!(
            browser.eval(&format!("({BUTTON}.click(), {BUTTON}.textContent)")),
            "Level here: sure?"
        );
        assert_eq!(daemon.status()["sources"][0]["resets"], 0);
        browser.eval(&format!("{BUTTON}.click()"));
        eventually("it is asked", || {
            daemon.status()["sources"][0]["resets"] == 1
        });
        let mut watcher = Client::tcp(daemon.address(0));
        if let Some(token) = token {
            watcher.send(&format!("{{\"class\":\"AUTH\",\"token\":\"{token}\"}}"));
        }
        let mut watcher = watcher.watching("{\"class\":\"WATCH\",\"last\":false}");
        sender.send(&line(2000));
        let att = watcher.next_of("ATT");
        assert_eq!(att["reset"], 1, "{att}");
        let truth = (0.3 + 0.2 * (0.9 * 20.0_f64).sin()).to_degrees();
        assert!((roll(&att.to_string()) - truth).abs() < 0.2, "{att}");
        browser.until(
            "the page has it",
            "document.querySelector('[data-testid=flags]').textContent === 'reset'",
        );
        const YAW: &str = "document.querySelector('[data-testid=yaw-zero]')";
        assert_eq!(browser.eval(&format!("{YAW}.hidden")), false);
        browser.eval(&format!("({YAW}.click(), {YAW}.click())"));
        eventually("it is asked", || {
            daemon.status()["sources"][0]["resets"] == 2
        });
        sender.send(&line(2001));
        let att = watcher.next_of("ATT");
        assert_eq!(att["reset"], 2, "{att}");
        assert_eq!(
            daemon.status()["sources"][0]["initial"],
            "heading alone (RESET)"
        );
        browser.is_unharmed();
    }
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_page_of_another_origin_begins_nothing_anew() {
    let mut browser = Browser::start();
    let (daemon, mut sender) = rolling(None, aided());
    let (lines, web) = (daemon.address(0), daemon.address(1));
    browser.go(elsewhere(), "/");
    let tried = browser.eval(&format!(
        "(async () => {{
            const reset = JSON.stringify({{ class: 'RESET', id: 'imu0' }}) + '\\n';
            let tried = 0;
            for (const url of ['http://{lines}/', 'http://{web}/samples', 'http://{web}/ws']) {{
                for (const type of ['text/plain', 'application/json', 'application/x-ndjson']) {{
                    await fetch(url, {{ method: 'POST', mode: 'no-cors', headers: {{ 'Content-Type': type }}, body: reset }}).then((a) => a.text(), () => '');
                    navigator.sendBeacon(url, new Blob([reset], {{ type }}));
                    tried += 1;
                }}
            }}
            for (const url of ['ws://{web}/ws', 'ws://{web}/', 'ws://localhost:{port}/ws']) {{
                await new Promise((done) => {{
                    const socket = new WebSocket(url);
                    socket.onopen = () => {{ socket.send(reset); tried += 100; }};
                    socket.onmessage = done;
                    socket.onerror = done;
                }});
                tried += 1;
            }}
            // Our page in a frame would be one to be clicked on unseen.
            const frame = document.body.appendChild(document.createElement('iframe'));
            const loaded = new Promise((done) => {{ frame.onload = done; setTimeout(done, 5000); }});
            frame.src = 'http://{web}/';
            await loaded;
            return tried;
        }})()",
        port = web.port()
    ));
    assert_eq!(tried, 12, "no socket was opened");
    sender.send(&line(2000));
    eventually("the sample is taken", || {
        daemon.status()["sources"][0]["attitudes"] == 2001
    });
    let status = daemon.status();
    let source = &status["sources"][0];
    assert_eq!(
        (&source["resets"], &source["reset"]),
        (&json!(0), &json!(0))
    );
    assert_eq!(status["counters"]["resets"], 0, "{status}");
    // Each was seen and turned away, or this proves nothing; and no page of ours talks to it from the frame.
    let turned_away = status["counters"]["connections_refused"].as_u64().unwrap();
    assert!(turned_away >= 6, "{status}");
    eventually("only the sender is left", || daemon.hub.connected() == 1);
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn of_a_gyro_alone_nothing_more_is_shown_and_zero_is_where_it_is() {
    let mut browser = Browser::start();
    let (daemon, mut sender) = rolling(None, EstimationSettings::default());
    browser.go(daemon.address(1), "/");
    browser.until_open();
    browser.until("the button", &format!("{BUTTON} && !{BUTTON}.hidden"));
    assert_eq!(browser.eval(&format!("{BUTTON}.textContent")), "Zero here");
    // It has no vertical to turn about.
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=yaw-zero]').hidden"),
        true
    );
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=known]').hidden"),
        true
    );
    browser.eval(&format!("({BUTTON}.click(), {BUTTON}.click())"));
    eventually("it is asked", || {
        daemon.status()["sources"][0]["resets"] == 1
    });
    sender.send(&line(2000));
    browser.until(
        "it is zero",
        "__strapd.seq === 2000 && Math.abs(__strapd.rpy[0]) < 1e-9",
    );
}
