//! A reader that does not read is nobody else's matter.

use super::client::{Client, rate};
use super::daemon::{Daemon, PATIENCE, TCP, WS, eventually, listening};
use std::io::{BufRead, Write};
use std::net::TcpStream;
use std::time::Duration;
use strapd::serve::guard::limits::Limits;

/// More than the buffers of two sockets on loopback and an outbox hold.
const ENOUGH: u64 = 200_000;

fn with_patience(no_progress: Duration) -> Daemon {
    let mut settings = listening(&[TCP]);
    settings.hub.limits = Limits {
        no_progress,
        ..Limits::default()
    };
    Daemon::start(settings)
}

/// Sends samples up to number `until`; the healthy watcher loses none of their attitudes.
fn send(sender: &mut Client, healthy: &mut Client, n: &mut u64, until: u64) {
    while *n < until {
        let some = (until - *n).min(500);
        let lines: Vec<String> = (*n..*n + some).map(|n| rate("a", n, 0.5)).collect();
        sender.send(&lines.join("\n"));
        for seq in *n..*n + some {
            assert_eq!(healthy.object("ATT")["seq"], seq);
        }
        *n += some;
    }
}

#[test]
fn a_stalled_reader_is_told_what_it_lost_while_others_lose_nothing() {
    let daemon = with_patience(PATIENCE);
    let mut stalled = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut healthy = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let dropped = || {
        let status = daemon.status();
        let clients = status["clients"].as_array().unwrap().clone();
        assert!(
            clients
                .iter()
                .all(|c| c["queued_bytes"].as_u64() <= Some(256 << 10))
        );
        clients.iter().filter_map(|c| c["dropped"].as_u64()).max()
    };
    let mut until = 0;
    while dropped() == Some(0) {
        assert!(until < ENOUGH, "it holds more than it should");
        let mut n = until;
        until += 2000;
        send(&mut sender, &mut healthy, &mut n, until);
    }
    let (mut next, mut lost) = (0, 0);
    while next < until {
        let value: serde_json::Value = serde_json::from_str(&stalled.line().unwrap()).unwrap();
        if value["class"] == "GAP" {
            assert_eq!(value["id"], "a");
            assert_eq!(value["first_seq"], next, "what came before is whole");
            next = value["last_seq"].as_u64().unwrap() + 1;
            lost += value["dropped"].as_u64().unwrap();
        } else {
            assert_eq!(value["seq"], next, "no loss without a notice");
            next += 1;
        }
    }
    assert_eq!(dropped(), Some(lost));
}

#[test]
#[cfg(target_os = "linux")]
fn of_what_a_reader_leaves_the_kernel_keeps_little() {
    let daemon = with_patience(PATIENCE);
    let mut stalled = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut healthy = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let stalls = || {
        let status = daemon.status();
        let clients = status["clients"].as_array().unwrap();
        let one = clients.iter().find(|c| c["dropped"].as_u64() > Some(0));
        one.map(|c| c["sent"].as_u64().unwrap())
    };
    let mut n = 0;
    let sent = loop {
        assert!(n < ENOUGH, "it holds more than it should");
        let until = n + 500;
        send(&mut sender, &mut healthy, &mut n, until);
        if let Some(sent) = stalls() {
            break sent;
        }
    };
    let line = stalled.line().unwrap().len() as u64;
    // Both ends together, where one alone had up to 4 MiB; an eighth is what the other end takes unread.
    assert!(sent * line < 1 << 20, "{sent} attitudes of {line} bytes");
}

#[test]
fn a_reader_that_takes_nothing_is_closed_and_others_never_notice() {
    // Long enough that a healthy reader on a busy machine is not taken for one that stalls.
    let daemon = with_patience(Duration::from_secs(3));
    let _stalled = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut healthy = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let mut n = 0;
    eventually("the stalled reader to be closed", || {
        let until = n + 2000;
        send(&mut sender, &mut healthy, &mut n, until);
        daemon.hub.connected() == 2
    });
    eventually("the close to be counted", || {
        daemon.status()["counters"]["connections_closed"] == 1
    });
}

#[test]
fn whoever_asks_without_reading_is_read_no_further_and_gets_every_answer_when_it_reads() {
    let daemon = with_patience(PATIENCE);
    let mut rude = TcpStream::connect(daemon.address(0)).unwrap();
    // Small, so that little is on the way.
    let socket = socket2::SockRef::from(&rude);
    socket.set_send_buffer_size(16 << 10).unwrap();
    socket.set_recv_buffer_size(16 << 10).unwrap();
    // Longer than a busy machine makes it wait that reads.
    rude.set_write_timeout(Some(Duration::from_secs(3)))
        .unwrap();
    rude.set_read_timeout(Some(PATIENCE)).unwrap();
    let request = "{\"class\":\"WATCH\",\"enable\":false}\n";
    let text = request.repeat(1000);
    let mut sent = 0;
    loop {
        assert!(sent < 64 << 20, "it is read, though it does not");
        match rude.write(&text.as_bytes()[sent % request.len()..]) {
            Ok(n) => sent += n,
            Err(_) => break,
        }
    }
    let taken = daemon.status()["counters"]["lines"].as_u64().unwrap() as usize;
    assert!(taken > 0 && taken < sent / request.len(), "{taken} {sent}");
    // Others are served.
    let mut asker = Client::tcp(daemon.address(0));
    asker.object("VERSION");
    for _ in 0..3 {
        asker.send("{\"class\":\"POLL\"}");
        asker.object("STATUS");
    }
    rude.shutdown(std::net::Shutdown::Write).unwrap();
    let (mut answers, mut errors) = (0, 0);
    for line in std::io::BufReader::new(rude).lines().skip(1) {
        let value: serde_json::Value = serde_json::from_str(&line.unwrap()).unwrap();
        match value["class"].as_str() {
            Some("WATCH") => answers += 1,
            // What was cut off where it stuck.
            _ => errors += 1,
        }
    }
    assert_eq!(answers, sent / request.len());
    assert_eq!(errors, usize::from(sent % request.len() > 0));
}

#[test]
fn a_watcher_gets_the_sensors_and_the_rate_it_asked_for() {
    let daemon = Daemon::tcp();
    let mut all = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut some = Client::tcp(daemon.address(0))
        .watching("{\"class\":\"WATCH\",\"ids\":[\"a\"],\"rate_hz\":100}");
    let mut sender = Client::tcp(daemon.address(0));
    let lines: Vec<String> = (0..200)
        .flat_map(|n| ["a", "b"].map(|id| rate(id, n, 0.5)))
        .collect();
    sender.send(&lines.join("\n"));
    for _ in 0..400 {
        all.object("ATT");
    }
    for n in 0..20 {
        let att = some.object("ATT");
        assert_eq!((&att["id"], &att["seq"]), (&"a".into(), &(10 * n).into()));
    }
    // Ended, it hears no more but its answer.
    some.send("{\"class\":\"WATCH\",\"enable\":false}");
    assert_eq!(some.object("WATCH")["enable"], false);
    sender.send(&rate("a", 210, 0.5));
    all.object("ATT");
    some.send("{\"class\":\"POLL\"}");
    some.object("STATUS");
}

/// Sends as fast as the transport takes it, to one that reads as fast as it can.
fn flood(daemon: &Daemon, id: &'static str, mut sender: Client) {
    let request = format!("{{\"class\":\"WATCH\",\"id\":\"{id}\"}}");
    let mut watcher = Client::tcp(daemon.address(0)).watching(&request);
    let samples = 100_000;
    let sending = std::thread::spawn(move || {
        for from in (0..samples).step_by(100) {
            let lines: Vec<String> = (from..from + 100).map(|n| rate(id, n, 0.5)).collect();
            sender.send(&lines.join("\n"));
        }
        sender
    });
    let (mut next, mut got) = (0, 0);
    while next < samples {
        let value: serde_json::Value = serde_json::from_str(&watcher.line().unwrap()).unwrap();
        if value["class"] == "GAP" {
            next = value["last_seq"].as_u64().unwrap() + 1;
        } else {
            assert_eq!(value["seq"], next);
            next += 1;
            got += 1;
        }
    }
    drop(sending.join().unwrap());
    // All, where the watcher has its share of the machine, which it need not have here; before senders
    // waited, one in a thousand.
    assert!(got > samples / 4, "{id}: {got} of {samples}");
    eprintln!("{id}: {got} of {samples}");
}

#[test]
fn a_flood_waits_for_whoever_reads_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let unix = format!("unix-listen://{}", path.display());
    let daemon = Daemon::start(listening(&[TCP, WS, &unix]));
    flood(&daemon, "tcp", Client::tcp(daemon.address(0)));
    flood(&daemon, "web", Client::web(daemon.address(1)));
    flood(&daemon, "unix", Client::unix(&path));
}
