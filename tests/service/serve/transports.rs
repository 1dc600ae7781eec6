//! Publishing and subscribing over every transport.

use super::client::{Client, rate};
use super::daemon::{Daemon, TCP, UDP, WS, listening};

fn everything(path: &std::path::Path) -> Daemon {
    Daemon::start(listening(&[
        TCP,
        UDP,
        WS,
        &format!("unix-listen://{}", path.display()),
    ]))
}

#[test]
fn what_is_sent_over_any_transport_reaches_whoever_watches_over_any() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let daemon = everything(&path);
    let mut watchers = [
        Client::tcp(daemon.address(0)),
        Client::unix(&path),
        Client::web(daemon.address(2)),
    ]
    .map(|c| c.watching("{\"class\":\"WATCH\"}"));
    let senders = [
        ("tcp", Client::tcp(daemon.address(0))),
        ("udp", Client::udp(daemon.address(1))),
        ("web", Client::web(daemon.address(2))),
        ("unix", Client::unix(&path)),
    ];
    for (id, mut sender) in senders {
        for n in 0..3 {
            sender.send(&rate(id, n, 0.5));
            for watcher in &mut watchers {
                let att = watcher.object("ATT");
                assert_eq!(att["id"], id);
                assert_eq!(att["seq"], n);
                assert_eq!(att["stamp"]["nsec"], n * 1_000_000);
                // Half a radian a second about x for n milliseconds.
                let x = att["q"]["x"].as_f64().unwrap();
                assert!((x - (0.25e-3 * n as f64).sin()).abs() < 1e-15, "{att}");
            }
        }
    }
    assert!(daemon.stop());
    assert!(!path.exists(), "the socket's name goes with the daemon");
}

#[test]
fn the_first_sample_gives_the_first_attitude() {
    let daemon = Daemon::tcp();
    let mut both = Client::tcp(daemon.address(0));
    let greeting = both.object("VERSION");
    assert_eq!(greeting["proto"], 1);
    assert_eq!(greeting["max_line"], 65536);
    both.send("{\"class\":\"WATCH\",\"enable\":true,\"streams\":[\"ATT\"]}");
    let answer = both.object("WATCH");
    assert_eq!(answer["policy"], "drop_oldest");
    // No class, no id, no seq, no line end but the close of our side.
    both.send_bytes(b"{\"gyro\":[1,2,3],\"stamp\":{\"sec\":5,\"nsec\":6}}");
    both.shut();
    let att = both.object("ATT");
    assert_eq!((&att["id"], &att["seq"]), (&"imu".into(), &0.into()));
    assert_eq!(att["rate"], serde_json::json!([1.0, 2.0, 3.0]));
}
