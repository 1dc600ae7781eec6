//! Admission to the page, and what a page of somebody else gets.

use super::browser::Browser;
use crate::serve::client::get;
use crate::serve::daemon::{Daemon, TCP, WS, listening};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener};
use strapd::serve::guard::admission::Token;

const SECRET: &str = "correct horse battery";

/// A page of somebody else, without a policy.
pub(super) fn elsewhere() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            // A browser connects ahead of what it has to say.
            std::thread::spawn(move || {
                let _ = stream.read(&mut [0; 4096]);
                let page = "<!doctype html><title>elsewhere</title>";
                let _ = write!(
                    stream,
                    "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{page}",
                    page.len()
                );
            });
        }
    });
    address
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_page_of_another_origin_gets_no_socket() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    let address = daemon.address(0);
    let opened = format!(
        "new Promise((done) => {{ const socket = new WebSocket('ws://{address}/ws'); socket.onopen = () => done('open'); socket.onerror = () => done('error'); }})"
    );
    browser.go(elsewhere(), "/");
    assert_eq!(browser.eval(&opened), "error");
    let refused = browser
        .events
        .iter()
        .filter(|e| e["method"] == "Network.webSocketFrameError" || e["method"] == "Log.entryAdded")
        .any(|e| e.to_string().contains("403"));
    assert!(refused, "{:?}", browser.events);
    for path in ["/metrics", "/model/top", "/page/live.js"] {
        let read =
            format!("fetch('http://{address}{path}').then((a) => a.text(), () => 'refused')");
        assert_eq!(browser.eval(&read), "refused", "{path}");
    }
    // The same from our own page is let in.
    browser.page();
    browser.go(address, "/top");
    assert_eq!(browser.eval(&opened), "open");
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_page_of_another_origin_writes_no_sample() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let (lines, web) = (daemon.address(0), daemon.address(1));
    browser.go(elsewhere(), "/");
    // Whatever a page may send without having asked: by fetch, by beacon and by a form, of each type.
    let tried = browser.eval(&format!(
        "(async () => {{
            const samples = Array.from({{ length: 40 }}, (_, n) => JSON.stringify({{ class: 'RATE', id: 'evil', stamp_ns: 1e18 + n * 1e7, gyro: [1, 0, 0] }})).join('\\n') + '\\n';
            let tried = 0;
            for (const url of ['http://{lines}/', 'http://{web}/samples', 'http://{web}/']) {{
                for (const type of ['text/plain', 'application/x-www-form-urlencoded', 'application/json', 'application/x-ndjson']) {{
                    for (const mode of ['no-cors', 'cors']) {{
                        const headers = {{ 'Content-Type': type }};
                        await fetch(url, {{ method: 'POST', mode, headers, body: samples }}).then((a) => a.text(), () => '');
                        tried += 1;
                    }}
                    navigator.sendBeacon(url, new Blob([samples], {{ type }}));
                }}
                const frame = document.body.appendChild(document.createElement('iframe'));
                frame.name = 'frame' + tried;
                const form = document.body.appendChild(document.createElement('form'));
                Object.assign(form, {{ method: 'POST', action: url, enctype: 'text/plain', target: frame.name }});
                const area = form.appendChild(document.createElement('textarea'));
                area.name = '\\n' + samples + '#';
                const loaded = new Promise((done) => {{ frame.onload = done; setTimeout(done, 3000); }});
                form.submit();
                await loaded;
            }}
            return tried;
        }})()"
    ));
    assert_eq!(tried, 24);
    // It has reached us, or this proves nothing.
    let status = daemon.status();
    assert!(
        status["counters"]["connections_closed"].as_u64().unwrap() >= 3,
        "{status}"
    );
    assert!(
        status["counters"]["connections_refused"].as_u64().unwrap() >= 3,
        "{status}"
    );
    assert_eq!(status["sources"], serde_json::json!([]), "{status}");
    // Nor does our own page post: it has a WebSocket.
    browser.go(web, "/top");
    let posted = browser.eval(
        "fetch('/samples', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: '{\"gyro\":[1,0,0],\"stamp_ns\":7}' }).then((a) => a.status)",
    );
    assert_eq!(posted, 403);
    assert_eq!(daemon.status()["sources"], serde_json::json!([]));
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn the_page_asks_for_the_token_and_goes_on_with_it() {
    let mut browser = Browser::start();
    let mut settings = listening(&[WS]);
    settings.hub.token = Some(Token::new(SECRET));
    let daemon = Daemon::start(settings);
    browser.go(daemon.address(0), "/");
    browser.until(
        "it asks",
        "__strapd.state === 'token' && !document.querySelector('[data-testid=token]').hidden",
    );
    let show = |token: &str| {
        format!(
            "(() => {{ const form = document.querySelector('[data-testid=token]'); form.querySelector('input').value = '{token}'; form.requestSubmit(); }})()"
        )
    };
    browser.eval(&show("wrong horse battery"));
    browser.until("it asks again", "__strapd.state === 'token'");
    browser.eval(&show(SECRET));
    browser.until_open();
    browser.until(
        "STATUS came",
        "document.querySelector('[data-testid=health-clients]').textContent === '1'",
    );
    assert_eq!(
        browser.eval("document.querySelector('[data-testid=token]').hidden"),
        true
    );
    browser.go(daemon.address(0), "/top");
    browser.until("the top, too", "__strapd.state === 'open'");
}

/// A daemon for a network: it listens on every address, with a token.
fn in_a_network() -> (Daemon, SocketAddr) {
    let mut settings = listening(&["ws-listen://0.0.0.0:0"]);
    settings.hub.token = Some(Token::new(SECRET));
    let daemon = Daemon::start(settings);
    // Loopback too, and no name of loopback that is admitted by itself.
    let address = SocketAddr::from(([127, 0, 0, 2], daemon.address(0).port()));
    (daemon, address)
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_link_brings_its_token_to_the_page_and_nowhere_else() {
    let mut browser = Browser::start();
    let (_daemon, address) = in_a_network();
    browser.go(address, "/?window=5#token=correct%20horse%20battery");
    browser.until_open();
    assert_eq!(browser.eval("location.search + location.hash"), "?window=5");
    assert_eq!(browser.eval("sessionStorage.token"), SECRET);
    assert_eq!(
        browser.eval("Object.keys(localStorage)"),
        serde_json::json!([])
    );
    let sent = browser.requests().join(" ");
    assert!(sent.contains("/ws") && !sent.contains("battery"), "{sent}");
    // A tab keeps it.
    browser.call("Page.reload", serde_json::json!({}));
    browser.until_open();

    // A token of another daemon is forgotten, and one that comes after it is taken.
    browser.page();
    browser.go(address, "/#token=wrong");
    let asks =
        "__strapd.state === 'token' && !document.querySelector('[data-testid=token]').hidden";
    browser.until("it asks", asks);
    assert!(browser.text("connection").contains("not the token"));
    assert_eq!(browser.eval("sessionStorage.length"), 0);
    browser.eval("location.hash = 'token=correct%20horse%20battery'");
    browser.until_open();
    assert_eq!(browser.eval("location.hash"), "");

    browser.page();
    browser.go(address, "/");
    browser.until("it asks", asks);
    let words = browser.text("token") + &browser.text("connection");
    assert!(
        words.contains("a token is needed") && words.contains("strapd serve --lan"),
        "{words}"
    );
    let body = browser.eval("document.body.innerText");
    assert!(!body.to_string().contains("AUTH"), "{body}");
    browser.is_unharmed();
}

#[test]
fn a_listener_on_every_address_knows_the_one_that_was_asked_and_no_other() {
    let (_daemon, address) = in_a_network();
    let asked = |host: &str| get(address, "/", &[("Host", host)]).0;
    let own = address.to_string();
    assert_eq!(asked(&own), 200);
    for host in [
        "127.0.0.3",
        "0.0.0.0",
        "192.0.2.7",
        "phone.example",
        "[::1]x",
    ] {
        assert_eq!(asked(host), 403, "{host}");
    }
}

#[test]
fn an_ordinary_request_gets_the_page_and_tops_within_bounds() {
    let daemon = Daemon::start(listening(&[WS]));
    let address = daemon.address(0);
    let host = address.to_string();
    let ask = |path: &str| get(address, path, &[("Host", &host)]);
    for (path, words) in [
        ("/", "/page/live.js"),
        ("/?frozen=1", "/page/live.js"),
        ("/top", "/page/top.js"),
        ("/page/style.css", "prefers-color-scheme"),
    ] {
        let (status, body) = ask(path);
        assert!(status == 200 && body.contains(words), "{path}: {status}");
    }
    for path in [
        "/page/",
        "/page/nothing.js",
        "/page/../Cargo.toml",
        "/page/live.html",
    ] {
        assert_eq!(ask(path).0, 404, "{path}");
    }
    for (query, reason) in [
        ("?duration=1e9", "duration"),
        ("?rate_hz=20000&duration=2", "40000 samples"),
        ("?rate_hz=NaN", "rate_hz"),
        ("?case=..%2Fetc", "unknown case"),
        ("?methods=auto,auto,auto,auto,auto", "at most 4"),
        ("?methods=magic", "unknown method"),
        ("?points=1000000", "points"),
        ("?colour=red", "unknown field"),
        ("?case=cusped&case=wavy", "duplicate field"),
        ("?spin_hz=fast", "invalid float"),
        ("?case=sleeping&methods=euler-angles", "singular"),
    ] {
        let (status, body) = ask(&format!("/model/top{query}"));
        assert!(
            status == 400 && body.contains(reason),
            "{query}: {status} {body}"
        );
    }
    let (status, body) = ask("/model/top?case=looping&points=50&methods=live-right");
    let found: serde_json::Value = serde_json::from_str(&body).unwrap();
    assert_eq!(status, 200);
    assert_eq!(found["truth"]["q"].as_array().unwrap().len(), 50);

    let mut settings = listening(&[WS]);
    settings.hub.token = Some(Token::new(SECRET));
    let guarded = Daemon::start(settings);
    let address = guarded.address(0);
    let host = address.to_string();
    let bearer = format!("Bearer {SECRET}");
    assert_eq!(get(address, "/", &[("Host", &host)]).0, 200);
    assert_eq!(get(address, "/model/top", &[("Host", &host)]).0, 401);
    assert_eq!(
        get(
            address,
            "/model/top",
            &[("Host", &host), ("Authorization", &bearer)]
        )
        .0,
        200
    );
}
