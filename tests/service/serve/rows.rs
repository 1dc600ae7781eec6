//! Promise: rows of a table over any way in give the attitudes of the file; what is no table ends in one clear error.

use super::client::Client;
use super::daemon::{Daemon, Process, TCP, UDP, WS, eventually, listening, strapd};
use std::io::Write;
use std::process::Command;
use strapd_attitude::estimate::Aid;

const HEADER: &str = "time_ms,acc_x_g,acc_y_g,acc_z_g,gyro_x_dps,gyro_y_dps,gyro_z_dps";
const COLUMNS: &str = "gyro=5:6:7:deg/s,accel=2:3:4:g,stamp=1:ms";
/// Fewer bytes of attitudes than an outbox holds: nothing is dropped.
const ROWS: usize = 300;

fn rows() -> String {
    let row = |n: usize| {
        let t = n as f64 * 0.01;
        let (x, y) = (90.0 * (1.7 * t).sin(), 40.0 * (0.9 * t).cos());
        format!(
            "{},{:.4},0.0312,{:.4},{x:.3},{y:.3},-12.5\n",
            10 * n,
            0.1 * t.sin(),
            t.cos()
        )
    };
    (0..ROWS).map(row).collect()
}

/// The attitudes that `replay` makes of a file with this text.
fn of_file(text: &str, flags: &[&str]) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("board.csv");
    std::fs::write(&path, text).unwrap();
    let output = Command::new(strapd())
        .arg("replay")
        .arg(&path)
        .args(["--method", "commit", "--aid", "auto", "-o", "-"])
        .args(flags)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

fn daemon(uris: &[&str]) -> Daemon {
    let mut settings = listening(uris);
    settings.hub.plan.aid = Aid::Auto;
    Daemon::start(settings)
}

/// Sends text in pieces, ends, and reads as many attitudes as there are rows.
fn attitudes(watcher: &mut Client, sender: &mut Client, text: &str, piece: usize) -> String {
    for some in text.as_bytes().chunks(piece) {
        sender.send_bytes(some);
    }
    (0..ROWS).map(|_| watcher.line().unwrap() + "\n").collect()
}

#[test]
fn rows_give_the_bits_of_the_file_over_any_way_in_cut_anywhere() {
    let table = format!("{HEADER}\n{}", rows());
    let expected = of_file(&table, &[]);
    assert_eq!(expected.lines().count(), ROWS);
    let boot = "rst:0x1 (POWERON_RESET)\r\nets Jun  8 2016 00:22:57\r\n0.02,-12.5\r\n";
    for (way, piece, before) in [
        (0, 13, boot),
        (0, usize::MAX, ""),
        (1, 1000, boot),
        (2, 64, boot),
    ] {
        let daemon = daemon(&[TCP, UDP, WS]);
        let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
        let mut sender = match way {
            0 => Client::tcp(daemon.address(0)),
            1 => Client::udp(daemon.address(1)),
            _ => Client::web(daemon.address(2)),
        };
        let text = format!("{before}{table}");
        // A datagram and a message end their last line.
        let got = if way == 0 {
            attitudes(&mut watcher, &mut sender, &text, piece)
        } else {
            let lines: Vec<&str> = text.split_inclusive('\n').collect();
            lines
                .chunks(7)
                .for_each(|some| sender.send_bytes(some.concat().as_bytes()));
            (0..ROWS).map(|_| watcher.line().unwrap() + "\n").collect()
        };
        assert!(got == expected, "way {way}, {piece} at once");
        let status = daemon.status();
        let skipped = before.lines().count();
        assert_eq!(status["counters"]["lines_skipped"], skipped, "{status}");
        assert_eq!(
            status["sources"][0]["counts"]["undecodable"],
            serde_json::Value::Null
        );
    }
}

#[test]
fn columns_of_an_address_or_of_the_daemon_need_no_header() {
    let expected = of_file(&rows(), &["--columns", COLUMNS]);
    let of_address = format!("{TCP}?columns={COLUMNS}&id=left");
    let served = daemon(&[TCP, &of_address]);
    let mut watcher = Client::tcp(served.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(served.address(1));
    let got = attitudes(&mut watcher, &mut sender, &rows(), 100);
    assert!(got.replace("\"id\":\"left\"", "\"id\":\"imu\"") == expected);
    let mut process =
        Process::start(&["-", "--listen", TCP, "--aid", "auto", "--columns", COLUMNS]);
    let mut watcher = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut stdin = process.child.stdin.take().unwrap();
    stdin.write_all(rows().as_bytes()).unwrap();
    let got: String = (0..ROWS).map(|_| watcher.line().unwrap() + "\n").collect();
    assert!(got == expected, "on standard input");
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}

#[test]
fn bad_rows_are_counted_and_the_others_used() {
    let daemon = daemon(&[TCP]);
    let mut sender = Client::tcp(daemon.address(0));
    let rows = rows();
    let mut lines: Vec<&str> = rows.lines().collect();
    lines.insert(40, "410,0.1");
    lines.insert(90, "900,0,0,1,0,x,0");
    lines.insert(150, HEADER);
    sender.send_bytes(format!("{HEADER}\n{}\n", lines.join("\n")).as_bytes());
    sender.object("VERSION");
    assert_eq!(sender.object("ERROR")["line"], 42);
    let second = sender.object("ERROR");
    assert_eq!(second["line"], 92);
    assert!(
        second["message"].as_str().unwrap().contains("gyro_y_dps"),
        "{second}"
    );
    eventually("all rows", || {
        daemon.status()["sources"][0]["attitudes"] == ROWS
    });
    let counts = &daemon.status()["sources"][0]["counts"];
    assert_eq!(counts["undecodable"], 2, "{counts}");
}

#[test]
fn a_flood_of_garbage_ends_in_one_clear_error() {
    let daemon = daemon(&[TCP]);
    for (line, words) in [
        (
            "hello, this, is no sensor",
            "none of its columns names a rate",
        ),
        ("garbage", "`garbage"),
        ("0.1,0.2,0.3,0.4", "4 numbers without a header"),
    ] {
        let mut sender = Client::tcp(daemon.address(0));
        let flood: String = (0..100_000).map(|n| format!("{line}{n}\n")).collect();
        sender.try_send(flood.as_bytes());
        let said = sender.rest();
        assert_eq!(said.len(), 2, "a greeting and one reason: {said:?}");
        assert_eq!(said[1]["code"], "no_table", "{said:?}");
        let message = said[1]["message"].as_str().unwrap();
        assert!(
            message.contains(words) && message.contains("?columns="),
            "{message}"
        );
    }
    let status = daemon.status();
    assert_eq!(status["sources"], serde_json::json!([]), "{status}");
    eventually("each close to be counted", || {
        daemon.status()["counters"]["connections_closed"] == 3
    });
}
