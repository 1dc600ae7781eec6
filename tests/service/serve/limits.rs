//! Whoever takes a place and does nothing with it loses it.

use super::client::{Client, get, rate};
use super::daemon::{Daemon, PATIENCE, TCP, WS, eventually, listening};
use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};
use strapd::serve::guard::limits::Limits;

fn with(limits: Limits) -> Daemon {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.limits = limits;
    Daemon::start(settings)
}

#[test]
fn number_257_is_told_and_closed_at_once_and_a_place_that_is_left_is_free() {
    let daemon = with(Limits::default());
    let mut clients: Vec<Client> = (0..256).map(|_| Client::tcp(daemon.address(0))).collect();
    for client in &mut clients {
        client.object("VERSION");
    }
    let before = Instant::now();
    let said = Client::tcp(daemon.address(0)).rest();
    assert_eq!(said.len(), 1);
    assert_eq!(said[0]["class"], "ERROR");
    assert_eq!(said[0]["code"], "too_many_clients");
    // 100 ms is the promise; this machine may be busy.
    assert!(before.elapsed() < PATIENCE / 4, "{:?}", before.elapsed());
    // Plain HTTP has places of its own; who would converse over it finds none either.
    let (status, _) = get(daemon.address(1), "/healthz", &[("Host", "localhost")]);
    assert_eq!(status, 200);
    let stream = TcpStream::connect(daemon.address(1)).unwrap();
    let url = format!("ws://{}/ws", daemon.address(1));
    let refused = tungstenite::client(url, stream)
        .err()
        .map(|e| e.to_string());
    assert!(
        refused.as_ref().is_some_and(|e| e.contains("503")),
        "{refused:?}"
    );
    clients.pop();
    eventually("a place", || daemon.hub.connected() == 255);
    let mut again = Client::tcp(daemon.address(0));
    assert_eq!(again.object("VERSION")["proto"], 1);
    // Those who have a place are served as ever.
    let mut watcher = clients.remove(0).watching("{\"class\":\"WATCH\"}");
    again.send(&rate("a", 0, 1.0));
    watcher.object("ATT");
}

#[test]
fn whoever_sends_a_byte_now_and_then_is_closed_and_others_never_notice() {
    let daemon = with(Limits {
        first_line: Duration::from_millis(700),
        ..Limits::default()
    });
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&rate("a", 0, 1.0));
    watcher.object("ATT");
    let slow: Vec<TcpStream> = (0..100)
        .map(|n| TcpStream::connect(daemon.address(n % 2)).unwrap())
        .collect();
    eventually("the slow ones", || {
        daemon.status()["counters"]["connections_accepted"] == 102
    });
    let mut n = 0;
    eventually("the slow ones to be closed", || {
        for mut one in &slow {
            // Closed ones refuse it.
            let _ = one.write(b"{");
        }
        n += 1;
        sender.send(&rate("a", n, 1.0));
        assert_eq!(watcher.object("ATT")["seq"], n);
        daemon.status()["counters"]["connections_closed"] == 50 && daemon.hub.connected() == 2
    });
    // The first fifty, on TCP, are told why.
    let mut late = Client::tcp(daemon.address(0));
    late.object("VERSION");
    assert_eq!(late.object("ERROR")["code"], "first_line_timeout");
    assert!(late.rest().is_empty());
    // Those who have spoken may be silent for as long as they like.
    n += 1;
    sender.send(&rate("a", n, 1.0));
    watcher.object("ATT");
}

#[test]
fn a_web_client_that_answers_no_ping_is_closed() {
    let daemon = with(Limits {
        ping: Duration::from_millis(300),
        ..Limits::default()
    });
    let mut alive = Client::web(daemon.address(1)).watching("{\"class\":\"WATCH\"}");
    // This one does not read, and so does not answer.
    let _dead = Client::web(daemon.address(1)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let mut n = 0;
    eventually("the dead one to be closed", || {
        sender.send(&rate("a", n, 1.0));
        assert_eq!(alive.object("ATT")["seq"], n);
        n += 1;
        daemon.hub.connected() == 2
    });
}

#[test]
#[cfg(target_os = "linux")]
fn clients_that_come_and_go_leave_nothing_behind() {
    // A process of its own: other tests open files in this one.
    let mut process = super::daemon::Process::start(&["--listen", TCP]);
    let address = process.address(0);
    let count = |pid: u32| {
        std::fs::read_dir(format!("/proc/{pid}/fd"))
            .unwrap()
            .count()
    };
    let pid = process.child.id();
    drop(Client::tcp(address));
    let mut asker = Client::tcp(address);
    let mut connected = |n: usize| {
        eventually("the others to be gone", || {
            asker.send("{\"class\":\"POLL\"}");
            asker.next_of("STATUS")["clients"].as_array().unwrap().len() == n
        });
    };
    connected(1);
    let before = count(pid);
    for n in 0..10_000 {
        let mut stream = TcpStream::connect(address).unwrap();
        if n % 3 == 0 {
            // Unread bytes at the close make it a reset.
            stream
                .write_all(&rate("a", n, 1.0).as_bytes()[..20])
                .unwrap();
        }
    }
    connected(1);
    eventually("the files to be closed", || count(pid) <= before);
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}

#[test]
#[cfg(target_os = "linux")]
fn without_files_to_open_it_waits_without_haste_and_serves_those_it_has() {
    // 40 files: about a dozen are its own.
    let mut process =
        super::daemon::Process::start_limited("ulimit -n 40", &["--listen", TCP, "--threads", "2"]);
    let address = process.address(0);
    let mut watcher = Client::tcp(address).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(address);
    let crowd: Vec<TcpStream> = (0..60)
        .map(|_| TcpStream::connect(address).unwrap())
        .collect();
    let mut failures = 0;
    eventually("accepts to fail", || {
        sender.send("{\"class\":\"POLL\"}");
        failures = sender.next_of("STATUS")["counters"]["accept_failures"]
            .as_u64()
            .unwrap();
        failures > 2
    });
    let ticks = |pid: u32| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
        let after = stat.rsplit_once(") ").unwrap().1;
        let of = |n: usize| after.split(' ').nth(n).unwrap().parse::<u64>().unwrap();
        of(11) + of(12)
    };
    let pid = process.child.id();
    let (before, start) = (ticks(pid), Instant::now());
    std::thread::sleep(Duration::from_millis(1500));
    // A busy loop would take 150 ticks of 10 ms.
    let busy = (ticks(pid) - before) as f64 / start.elapsed().as_secs_f64();
    assert!(busy < 30.0, "{busy} % of a core");
    for n in 0..10 {
        sender.send(&rate("a", n, 1.0));
        assert_eq!(watcher.object("ATT")["seq"], n);
    }
    drop(crowd);
    eventually("a place to be free again", || {
        sender.send("{\"class\":\"POLL\"}");
        let status = sender.next_of("STATUS");
        status["clients"].as_array().unwrap().len() == 2
    });
    let mut again = Client::tcp(address);
    again.object("VERSION");
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}
