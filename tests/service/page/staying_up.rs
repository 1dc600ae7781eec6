//! A fast sensor, a long time, a daemon that goes and comes.

use super::browser::Browser;
use crate::serve::client::{Client, rate};
use crate::serve::daemon::{Daemon, TCP, WS, eventually, listening};
use serde_json::json;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Sends 8,000 samples a second until told to stop.
struct Feeder {
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<u64>>,
}

impl Feeder {
    fn start(mut sender: Client) -> Feeder {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let thread = std::thread::spawn(move || {
            let start = Instant::now();
            let mut n = 0_u64;
            while !stopped.load(Ordering::Relaxed) {
                let due = (start.elapsed().as_secs_f64() * 8000.0) as u64;
                // After a pause of the machine no flood.
                let until = due.min(n + 400);
                let mut lines = String::new();
                while n < until {
                    let t = n as f64 / 8000.0;
                    lines += &format!(
                        "{{\"class\":\"RATE\",\"id\":\"fast\",\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"gyro\":[{},{},0.3]}}\n",
                        1_700_000_000 + n / 8000,
                        n % 8000 * 125_000,
                        (6.0 * t).sin(),
                        (5.0 * t).cos()
                    );
                    n += 1;
                }
                sender.send_bytes(lines.as_bytes());
                std::thread::sleep(Duration::from_millis(5));
            }
            n
        });
        Feeder {
            stop,
            thread: Some(thread),
        }
    }

    fn stop(mut self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

/// Counts the pictures the browser was ready for, beside those the page drew.
const COUNT: &str = r"new Promise((done) => {
  const [from, drawn, points] = [performance.now(), __strapd.frames, __strapd.sensors.fast.points];
  let ready = 0;
  const tick = () => {
    ready++;
    const seconds = (performance.now() - from) / 1000;
    if (seconds < 3) return requestAnimationFrame(tick);
    done({ fps: (__strapd.frames - drawn) / seconds, ready: ready / seconds,
      came: (__strapd.sensors.fast.points - points) / seconds });
  };
  requestAnimationFrame(tick);
})";

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn a_sensor_at_8_khz_is_drawn_smoothly_in_bounded_memory() {
    let mut browser = Browser::start_alone();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/");
    browser.until_open();
    let feeder = Feeder::start(Client::tcp(daemon.address(0)));
    browser.until("attitudes come", "__strapd.sensors.fast?.points > 1000");
    let mut tries = Vec::new();
    let smooth = (0..3).any(|_| {
        let found = browser.eval(COUNT);
        let of = |name: &str| found[name].as_f64().unwrap();
        // The page draws every other of 60; a machine with no time for 40 draws what it can.
        let goal = 20.0_f64.min(0.4 * of("ready"));
        let good = of("fps") >= goal && of("fps") <= 35.0 && of("came") > 0.0;
        tries.push(found);
        good
    });
    assert!(smooth, "{tries:?}");

    // After a collection the heap still goes up and down by a megabyte, by what was compiled and what
    // is on its way. Growth is what no later reading comes back from.
    let from = Instant::now();
    let reading = |browser: &mut Browser| {
        std::thread::sleep(Duration::from_millis(400));
        browser.call("HeapProfiler.collectGarbage", json!({}));
        let usage = browser.call("Runtime.getHeapUsage", json!({}));
        let minutes = from.elapsed().as_secs_f64() / 60.0;
        (minutes, usage["usedSize"].as_f64().unwrap() / 1e6)
    };
    let first = (0..6)
        .map(|_| reading(&mut browser))
        .fold((0.0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
    let is_bounded = |(at, used): (f64, f64)| used - first.1 <= 1.0 * (at - first.0);
    std::thread::sleep(Duration::from_secs(6));
    let mut later = Vec::new();
    while !later.last().copied().is_some_and(is_bounded) {
        assert!(
            later.len() < 100,
            "more than 1 MB a minute: {first:?}, then {later:?}"
        );
        later.push(reading(&mut browser));
    }
    browser.eval("(() => { window.leak = Array.from({ length: 100000 }, () => ({ a: 1 })); })()");
    assert!(
        !is_bounded(reading(&mut browser)),
        "a leak would not have been seen"
    );

    // No line has more than two points a column, though ten times as many samples came. A page that had
    // no time for a while is thinned for, and its lines fill again.
    const PLOTTED: &str = "__strapd.sensors.fast.plotted";
    browser.until(
        "the columns are filled",
        &format!("{PLOTTED}.points > {PLOTTED}.width"),
    );
    let plotted = browser.eval(PLOTTED);
    let of = |name: &str| plotted[name].as_f64().unwrap();
    assert!(of("points") <= 6.0 * of("width") + 6.0, "{plotted}");

    let sent = feeder.stop();
    let points = browser.number("__strapd.sensors.fast.points");
    eprintln!("pictures {tries:?}; heap in MB {first:?}, then {later:?}; {sent} samples");
    assert!(
        points < 0.2 * sent as f64,
        "{points} of {sent}: it was to be thinned"
    );
    // What a page with no time to read has lost counts as thinned, too, and is said beside it.
    let (thinning, dropped) = (browser.text("thinning"), browser.text("dropped"));
    let part = thinning.split(' ').nth(2).and_then(|n| n.parse().ok());
    let part: f64 = part.unwrap_or(0.0);
    assert!(
        (7.95..8.95).contains(&part) || (part > 8.0 && !dropped.is_empty()),
        "{thinning}; {dropped}"
    );
    browser.is_unharmed();
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn it_connects_again_soon_after_the_daemon_is_back() {
    let mut browser = Browser::start_alone();
    let mut daemon = Daemon::start(listening(&[WS, TCP]));
    let [web, tcp] = [0, 1].map(|n| daemon.address(n));
    browser.go(web, "/");
    browser.until_open();
    let uris = [format!("ws-listen://{web}"), format!("tcp-listen://{tcp}")];
    let mut took = Vec::new();
    // A machine that is busy for a moment is no reason: one of three must be in time.
    for gone in [1500, 700, 100] {
        // Kept: who closes before he has read takes back what he said.
        let mut sender = Client::tcp(tcp);
        sender.send(&rate("imu0", 0, 0.1));
        browser.until("an attitude", "__strapd.seq === 0");
        let uptime = "document.querySelector('[data-page=uptime]').textContent";
        browser.until("its uptime", &format!("{uptime} !== '–'"));
        assert!(daemon.stop());
        browser.until("it says so", "__strapd.state !== 'open' && document.querySelector('[data-testid=connection]').textContent.includes('connection lost')");
        // And nothing of what held before.
        assert_eq!(browser.eval(uptime), "–");
        std::thread::sleep(Duration::from_millis(gone));
        let session = browser.eval("__strapd.session");
        daemon = Daemon::start(listening(&[&uris[0], &uris[1]]));
        let since = Instant::now();
        browser.until(
            "it is back",
            &format!("__strapd.state === 'open' && __strapd.session !== {session}"),
        );
        took.push(since.elapsed());
        assert!(browser.text("notice").contains("started again"));
    }
    assert!(
        took.iter().any(|t| *t <= Duration::from_secs(3)),
        "{took:?}"
    );
    eprintln!("connected again after {took:?}");
    // What was said before holds no longer.
    assert_eq!(
        browser.number("document.querySelectorAll('[data-testid=sensor]').length"),
        1.0
    );
    let mut sender = Client::tcp(tcp);
    sender.send(&rate("imu0", 5, 0.1));
    browser.until(
        "the new one's attitudes",
        "__strapd.seq === 0 && __strapd.sensors.imu0.points === 1",
    );
}

#[test]
#[cfg_attr(not(has_chromium), ignore = "needs chromium")]
fn what_the_page_was_too_slow_for_is_said() {
    let mut browser = Browser::start_alone();
    let daemon = Daemon::start(listening(&[TCP, WS]));
    browser.go(daemon.address(1), "/?rate_hz=100000");
    browser.until_open();
    let is_too_slow = || {
        let status = daemon.status();
        let mut clients = status["clients"].as_array().unwrap().iter();
        clients.any(|client| client["dropped"].as_u64() > Some(0))
    };
    let mut sender = Client::tcp(daemon.address(0));
    let mut n = 0;
    eventually("the page to be too slow", || {
        // Nobody reads while this runs.
        browser.eval(
            "setTimeout(() => { const until = Date.now() + 4000; while (Date.now() < until); }, 0)",
        );
        let since = Instant::now();
        while !is_too_slow() && since.elapsed() < Duration::from_secs(4) {
            let lines: Vec<String> = (n..n + 2000).map(|n| rate("imu0", n, 0.1)).collect();
            sender.send(&lines.join("\n"));
            n += 2000;
        }
        is_too_slow()
    });
    browser.until("it is said", "__strapd.dropped > 0 && /dropped/.test(document.querySelector('[data-testid=notice]').textContent)");
    browser.is_unharmed();
}
