//! Playback controls, against a daemon that is made up: it speaks of a recording and notes what it is told.

use super::browser::Browser;
use crate::serve::daemon::{Daemon, PATIENCE, Process, WS, listening, strapd};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

/// Pages from a real daemon, the WebSocket made up. What the page says comes out at one end, what is
/// put in at the other is said to it.
fn made_up(real: SocketAddr) -> (SocketAddr, Receiver<Value>, Sender<Value>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let (tell, told) = channel();
    let (say, said) = channel::<Value>();
    let said = Arc::new(Mutex::new(Some(said)));
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let (stream, tell, said) = (stream.unwrap(), tell.clone(), said.clone());
            // A browser connects ahead of what it has to say.
            std::thread::spawn(move || {
                let mut head = [0; 2048];
                let n = stream.peek(&mut head).unwrap_or(0);
                let head = String::from_utf8_lossy(&head[..n]).to_lowercase();
                if !head.contains("upgrade: websocket") {
                    passed_on(stream, real);
                } else if let Some(said) = said.lock().unwrap().take() {
                    converse(stream, &tell, &said);
                }
            });
        }
    });
    (address, told, say)
}

fn passed_on(mut stream: TcpStream, real: SocketAddr) {
    let mut other = TcpStream::connect(real).unwrap();
    let (mut back, mut to) = (stream.try_clone().unwrap(), other.try_clone().unwrap());
    std::thread::spawn(move || {
        let _ = std::io::copy(&mut back, &mut to);
    });
    let mut bytes = [0; 4096];
    while let Ok(n) = other.read(&mut bytes) {
        if n == 0 || stream.write_all(&bytes[..n]).is_err() {
            return;
        }
    }
}

fn converse(stream: TcpStream, tell: &Sender<Value>, said: &Receiver<Value>) {
    let mut socket = tungstenite::accept(stream).unwrap();
    let version = json!({"class": "VERSION", "proto": 1, "release": "0", "session": "made-up", "max_line": 65536});
    socket.send(version.to_string().into()).unwrap();
    socket
        .get_ref()
        .set_read_timeout(Some(std::time::Duration::from_millis(20)))
        .unwrap();
    loop {
        match socket.read() {
            Ok(tungstenite::Message::Text(text)) => {
                let _ = tell.send(serde_json::from_str(text.as_str()).unwrap());
            }
            Ok(_) => {}
            Err(tungstenite::Error::Io(e))
                if matches!(
                    e.kind(),
                    std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut
                ) => {}
            Err(_) => return,
        }
        while let Ok(message) = said.try_recv() {
            socket.send(message.to_string().into()).unwrap();
        }
    }
}

fn playing(state: &str, at: f64, speed: f64) -> Value {
    let whole = at.floor();
    json!({
        "class": "PLAYBACK", "state": state, "file": "flight.mcap", "speed": speed,
        "at": {"sec": 1_700_000_000_u64 + whole as u64, "nsec": ((at - whole) * 1e9).round() as u64},
        "start": {"sec": 1_700_000_000, "nsec": 0}, "end": {"sec": 1_700_000_060, "nsec": 500_000_000},
    })
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_recording_is_paused_sought_and_sped_up() {
    let mut browser = Browser::start();
    let daemon = Daemon::start(listening(&[WS]));
    let (address, told, say) = made_up(daemon.address(0));
    let next_of = |class: &str| loop {
        let message = told.recv_timeout(PATIENCE).unwrap();
        if message["class"] == class {
            return message;
        }
    };
    let next = || next_of("PLAYBACK");
    browser.go(address, "/");
    // Greeted is not yet watching: what comes before the answer could be lost.
    let mut watch = next_of("WATCH");
    assert_eq!(browser.eval("__strapd.state"), "connecting");
    watch["policy"] = json!("drop_oldest");
    say.send(watch).unwrap();
    browser.until_open();
    let hidden = "document.querySelector('[data-testid=playback]').hidden";
    assert_eq!(browser.eval(hidden), true);
    say.send(playing("playing", 12.25, 1.0)).unwrap();
    browser.until("the controls", &format!("!{hidden}"));
    assert_eq!(browser.text("place"), "0:12.3 / 1:00.5");
    assert_eq!(browser.text("play"), "Pause");

    let click = "document.querySelector('[data-testid=play]').click()";
    browser.eval(click);
    assert_eq!(next(), json!({"class": "PLAYBACK", "action": "pause"}));
    say.send(playing("paused", 12.5, 1.0)).unwrap();
    browser.until(
        "it is paused",
        "document.querySelector('[data-testid=play]').textContent === 'Play'",
    );
    browser.eval(click);
    assert_eq!(next(), json!({"class": "PLAYBACK", "action": "play"}));

    let drag = |to: f64, event: &str| {
        format!(
            "(() => {{ const slider = document.querySelector('[data-testid=seek]'); slider.value = '{to}'; slider.dispatchEvent(new Event('{event}')); }})()"
        )
    };
    browser.eval(&drag(30.25, "change"));
    assert_eq!(
        next(),
        json!({"class": "PLAYBACK", "action": "seek", "at": {"sec": 1_700_000_030, "nsec": 250_000_000}})
    );
    browser.eval("(() => { const speed = document.querySelector('[data-testid=speed]'); speed.value = '2'; speed.dispatchEvent(new Event('change')); })()");
    assert_eq!(
        next(),
        json!({"class": "PLAYBACK", "action": "speed", "speed": 2})
    );

    let key = |key: &str| {
        format!(
            "document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true }}))"
        )
    };
    say.send(playing("playing", 58.0, 2.0)).unwrap();
    browser.until(
        "it moves",
        "document.querySelector('[data-testid=place]').textContent.startsWith('0:58.0')",
    );
    browser.eval(&key("."));
    // Not beyond the end.
    assert_eq!(
        next()["at"],
        json!({"sec": 1_700_000_060, "nsec": 500_000_000})
    );
    browser.eval(&key("+"));
    assert_eq!(
        next(),
        json!({"class": "PLAYBACK", "action": "speed", "speed": 5})
    );
    say.send(playing("ended", 60.5, 2.0)).unwrap();
    browser.until(
        "it has ended",
        "document.querySelector('[data-testid=play]').textContent === 'Replay'",
    );
    browser.eval(&key("p"));
    assert_eq!(next(), json!({"class": "PLAYBACK", "action": "play"}));
    // A stream has no end to slide to.
    let mut endless = playing("playing", 3.0, 1.0);
    endless["end"] = Value::Null;
    say.send(endless).unwrap();
    browser.until(
        "no slider",
        "document.querySelector('[data-testid=seek]').hidden && document.querySelector('[data-testid=place]').textContent === '0:03.0'",
    );
    browser.is_unharmed();
}

const LOG: &str = "fixtures/xsens_mti.mcap";

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_replay_is_moved_from_the_page_and_ends_where_a_file_ends() {
    let mut browser = Browser::start();
    let output = std::process::Command::new(strapd())
        .args(["replay", LOG, "-o", "-", "--quiet"])
        .env("STRAPD_AID", "none")
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    let process = Process::of(&[
        "replay",
        LOG,
        "--page=127.0.0.1:0",
        "--paused",
        "--speed",
        "10",
    ]);
    browser.go(process.address(0), "/");
    browser.until_open();
    browser.until("it waits", "document.querySelector('[data-testid=play]').textContent === 'Play' && !document.querySelector('[data-testid=playback]').hidden");
    browser.eval("document.querySelector('[data-testid=play]').click()");
    browser.until("its end", &format!("document.querySelector('[data-testid=play]').textContent === 'Replay' && __strapd.seq === {}", last["seq"]));
    for name in ["w", "x", "y", "z"] {
        let shown = browser.eval(&format!("__strapd.q.{name}"));
        assert_eq!(shown, last["q"][name], "q.{name}");
    }
    // Back to 12 s: the attitude there, and nothing after it.
    browser.eval("(() => { const slider = document.querySelector('[data-testid=seek]'); slider.value = '12'; slider.dispatchEvent(new Event('change')); })()");
    browser.until("it is there", "document.querySelector('[data-testid=place]').textContent.startsWith('0:12.0') && __strapd.seq === 600");
    assert_eq!(browser.text("thinning"), "every sample");
    // One clock: the log's, in the bar, in the numbers and under the plots.
    browser.until(
        "the numbers say so",
        "document.querySelector('[data-testid=stamp]').textContent.startsWith('0:12.0')",
    );
    let time = browser.number("Object.values(__strapd.sensors)[0].time");
    assert!((time - 12.0).abs() < 0.03, "{time}");
    // What became of the samples up to there, and how they are integrated.
    let said = |name: &str| {
        format!("document.querySelector('[data-id=\"/imu/data\"] [data-part={name}]').textContent")
    };
    for (name, value) in [
        ("gaps", "0"),
        ("lost", "0"),
        ("missing", "0"),
        ("rateNominal", "of 50"),
    ] {
        browser.until(name, &format!("{} === '{value}'", said(name)));
    }
    assert_ne!(browser.eval(&said("method")), "–");
    // With the next STATUS, too: how regular the stamps were is known from before it went back.
    const UPTIME: &str = "document.querySelector('[data-page=uptime]').textContent";
    let before = browser.eval(UPTIME);
    browser.until("another STATUS", &format!("{UPTIME} !== {before}"));
    let health = browser.eval("[...document.querySelectorAll('[data-testid=sensor] .strip div')].filter((e) => e.offsetParent && /–$/.test(e.textContent.trim())).map((e) => e.textContent)");
    assert_eq!(health, json!([]));
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_recorded_orientation_is_what_a_replay_is_held_against() {
    let mut browser = Browser::start();
    // What the command line says of the same.
    let folder = tempfile::tempdir().unwrap();
    let estimated = folder.path().join("attitude.mcap");
    let run = |args: &[&std::ffi::OsStr]| {
        let output = std::process::Command::new(strapd())
            .args(args)
            .env("STRAPD_AID", "none")
            .output()
            .unwrap();
        assert!(output.status.success(), "{args:?}");
        output.stdout
    };
    run(&[
        "replay".as_ref(),
        LOG.as_ref(),
        "--quiet".as_ref(),
        "-o".as_ref(),
        estimated.as_ref(),
    ]);
    let compared = run(&[
        "compare".as_ref(),
        estimated.as_ref(),
        LOG.as_ref(),
        "--align".as_ref(),
        "first".as_ref(),
        "--json".as_ref(),
    ]);
    let compared: Value = serde_json::from_slice(&compared).unwrap();
    let worst = compared["total"]["max_deg"]
        .as_f64()
        .unwrap_or_else(|| unreachable!("{compared}"));

    let process = Process::of(&[
        "replay",
        LOG,
        "--page=127.0.0.1:0",
        "--paused",
        "--speed",
        "10",
    ]);
    browser.go(process.address(0), "/");
    browser.until_open();
    browser.until(
        "it waits",
        "!document.querySelector('[data-testid=playback]').hidden",
    );
    browser.eval("document.querySelector('[data-testid=play]').click()");
    browser.until("its end", "document.querySelector('[data-testid=play]').textContent === 'Replay' && __strapd.sensors.recorded?.points === 953");
    let shown = browser.number("__strapd.sensors['/imu/data'].worst");
    assert!(
        (shown - worst).abs() < 1e-6,
        "{shown} on the page, {worst} by the command"
    );
    let against = browser
        .eval("document.querySelector('[data-id=\"/imu/data\"] [data-testid=against]').value");
    assert_eq!(against, "recorded");
    // Nothing is said of what a recorded orientation does not know.
    let rate =
        browser.eval("document.querySelector('[data-id=recorded] [data-testid=rate-x]').value");
    assert_eq!(rate, "");
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_page_of_a_simulation_shows_what_would_be_estimated() {
    let mut browser = Browser::start();
    let process = Process::of(&[
        "simulate",
        "coning",
        "--duration",
        "3",
        "--rate-hz",
        "200",
        "--page=127.0.0.1:0",
        "--paused",
        "--speed",
        "3",
    ]);
    browser.go(process.address(0), "/");
    browser.until_open();
    let play = "document.querySelector('[data-testid=play]')";
    browser.until(
        "it waits",
        &format!("!document.querySelector('[data-testid=playback]').hidden && {play}.textContent === 'Play'"),
    );
    // The second run is the first again.
    let mut worst = Vec::new();
    for _ in 0..2 {
        browser.eval(&format!("{play}.click()"));
        browser.until("it goes", &format!("{play}.textContent === 'Pause'"));
        browser.until(
            "its end",
            &format!("{play}.textContent === 'Replay' && __strapd.sensors.imu?.seq === 600 && __strapd.sensors.truth?.seq === 600"),
        );
        browser.until("compared", "__strapd.sensors.imu.worst > 0");
        worst.push(browser.number("__strapd.sensors.imu.worst"));
    }
    assert!(worst[0] < 0.05, "{worst:?} deg");
    assert_eq!(browser.eval("__strapd.sensors.imu.points"), 601);
    browser.is_unharmed();
}
