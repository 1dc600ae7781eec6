//! Promise: a board on a serial port is read like a socket: lost and found again, its rate doubted when nothing can be
//! read, and nothing of it lost at full speed. The other end of a pseudo-terminal plays the board.

use super::client::Client;
use super::daemon::{Process, TCP, eventually, strapd};
use super::devices::mip;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const HEADER: &str = "ms,gx_dps,gy_dps,gz_dps";

/// A board: what is written to it comes out of its port.
struct Board {
    wire: File,
    port: PathBuf,
    /// Kept open, so that the port is there before somebody opens it.
    _kept: File,
}

impl Board {
    fn new() -> Board {
        let wire = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&wire).unwrap();
        unlockpt(&wire).unwrap();
        let port = PathBuf::from(ptsname(&wire, Vec::new()).unwrap().to_str().unwrap());
        let kept = File::options().read(true).write(true).open(&port).unwrap();
        let mut raw = tcgetattr(&kept).unwrap();
        raw.make_raw();
        tcsetattr(&kept, OptionalActions::Now, &raw).unwrap();
        Board {
            wire: wire.into(),
            port,
            _kept: kept,
        }
    }

    fn send(&mut self, text: &str) {
        self.wire.write_all(text.as_bytes()).unwrap();
    }

    fn row(n: u64) -> String {
        format!("{},{},0,1.5\n", 10 * n, n % 7)
    }
}

/// A daemon that reads a port.
fn serving(address: &str) -> Process {
    Process::start(&[address, "--listen", TCP])
}

fn status(process: &Process) -> serde_json::Value {
    let mut asking = Client::tcp(process.address(0));
    asking.send("{\"class\":\"POLL\"}");
    asking.next_of("STATUS")
}

fn attitudes(process: &Process) -> u64 {
    status(process)["sources"][0]["attitudes"]
        .as_u64()
        .unwrap_or(0)
}

fn end(mut process: Process) {
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}

#[test]
fn a_board_is_read_and_read_again_when_it_is_back_under_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let name = dir.path().join("ttyBOARD");
    let mut first = Board::new();
    symlink(&first.port, &name).unwrap();
    let process = serving(&format!("serial://{}?baud=115200", name.display()));
    eventually("the port to be open", || {
        status(&process)["outgoing"][0]["connected"] == true
    });
    first.send(&format!("3,0.2\nboot: MPU6050 found\n{HEADER}\n"));
    (0..50).for_each(|n| first.send(&Board::row(n)));
    eventually("50 attitudes", || attitudes(&process) == 50);
    let sources = status(&process);
    assert_eq!(sources["sources"][0]["id"], "ttyBOARD", "{sources}");
    assert_eq!(sources["sources"][0]["gyro_unit"], "deg", "{sources}");
    // Unplugged; back as another device under the same name.
    drop(first);
    std::fs::remove_file(&name).unwrap();
    eventually("the loss to be noticed", || {
        status(&process)["outgoing"][0]["connected"] == false
    });
    let mut second = Board::new();
    symlink(&second.port, &name).unwrap();
    eventually("the port to be open again", || {
        status(&process)["outgoing"][0]["connected"] == true
    });
    second.send(&format!("{HEADER}\n"));
    (100..150).for_each(|n| second.send(&Board::row(n)));
    eventually("100 attitudes", || attitudes(&process) == 100);
    end(process);
}

#[test]
fn a_wrong_rate_and_a_port_that_is_none_say_so_in_the_log() {
    let mut board = Board::new();
    let mut process = serving(&format!("serial://{}?baud=9600", board.port.display()));
    eventually("the port to be open", || {
        status(&process)["outgoing"][0]["connected"] == true
    });
    let noise: Vec<u8> = (0..3000u32)
        .map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    for some in noise.chunks(50) {
        board.wire.write_all(some).unwrap();
    }
    let error = |process: &Process| status(process)["outgoing"][0]["last_error"].to_string();
    eventually("the rate to be doubted", || {
        error(&process).contains("no line that can be read")
    });
    assert!(error(&process).contains("9600 baud"), "{}", error(&process));
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let missing = serving("serial:///dev/ttyNONE0");
    eventually("the port to be missed", || {
        error(&missing).contains("no such port")
    });
    end(missing);
    let none = serving("serial:///dev/null");
    eventually("what is no port to be named", || {
        error(&none).contains("no serial port")
    });
    end(none);
}

/// A wire at 9600 baud hands on 960 bytes a second, however much the board would send.
#[test]
fn a_rate_that_carries_no_more_is_said_in_the_log() {
    let mut board = Board::new();
    let process = serving(&format!("serial://{}?baud=9600", board.port.display()));
    board.send(&format!("{HEADER}\n"));
    let begin = Instant::now();
    let (mut sent, mut n) = (0.0, 0);
    let error = |process: &Process| status(process)["outgoing"][0]["last_error"].to_string();
    while begin.elapsed() < Duration::from_secs(60) && !error(&process).contains("9600 baud carry")
    {
        while sent < 955.0 * begin.elapsed().as_secs_f64() {
            let row = Board::row(n);
            board.send(&row);
            (sent, n) = (sent + row.len() as f64, n + 1);
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(
        error(&process).contains("9600 baud carry"),
        "{}",
        error(&process)
    );
    end(process);
}

/// Runs a command on a board that sends 200 rows a second for as long as it runs.
fn output(args: &[&str], board: &mut Board) -> (Option<i32>, String) {
    let head = format!("5,0.1\n{HEADER}\n");
    let row = |n| Board::row(n).into_bytes();
    let (code, text, _) = output_of(args, board, head.as_bytes(), row);
    (code, text)
}

/// The same of a board that sends this, then so each sample; with what the command reports.
fn output_of(
    args: &[&str],
    board: &mut Board,
    head: &[u8],
    sample: impl Fn(u64) -> Vec<u8>,
) -> (Option<i32>, String, String) {
    let mut child = Command::new(strapd())
        .args(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    board.wire.write_all(head).unwrap();
    let mut n = 0;
    let status = loop {
        board.wire.write_all(&sample(n)).unwrap();
        n += 1;
        std::thread::sleep(Duration::from_millis(5));
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        assert!(n < 12_000, "a minute, and no end");
    };
    let (mut text, mut reported) = (String::new(), String::new());
    std::io::Read::read_to_string(&mut child.stdout.take().unwrap(), &mut text).unwrap();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut reported).unwrap();
    (status.code(), text, reported)
}

#[test]
fn a_port_is_a_recording_for_cat_info_and_check() {
    let mut board = Board::new();
    let address = format!("serial://{}?for=2", board.port.display());
    let (code, text) = output(&["cat", &address, "--format", "csv"], &mut board);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.lines().count() > 50, "{text}");
    let mut board = Board::new();
    let address = format!("serial://{}?for=2", board.port.display());
    let (code, text) = output(&["info", &address], &mut board);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("100.00 Hz") && text.contains("cat 'serial://"),
        "{text}"
    );
    let mut board = Board::new();
    let address = format!("serial://{}?for=2", board.port.display());
    let (code, text) = output(&["check", &address], &mut board);
    assert!(matches!(code, Some(0 | 3)), "{text}");
    let listed = Command::new(strapd())
        .args(["info", "serial:"])
        .output()
        .unwrap();
    assert!(
        listed.status.success() && !listed.stdout.is_empty(),
        "{listed:?}"
    );
}

#[test]
fn a_port_with_a_sensor_is_read_in_its_frames_or_named_for_what_it_is_not() {
    let mut board = Board::new();
    let port = board.port.display().to_string();
    let mut ran = |command: &str, protocol: &str| {
        let address = format!("serial://{port}?for=2&protocol={protocol}");
        output_of(&[command, &address], &mut board, b"boot\r\n\x65\x80", mip)
    };
    let (code, text, reported) = ran("info", "auto");
    assert!(matches!(code, Some(0 | 3)), "{text}{reported}");
    assert!(text.contains("sensor capture"), "{text}");
    assert!(text.contains("mip  sensor_msgs/msg/Imu"), "{text}");
    assert!(text.contains("100.00 Hz"), "{text}");
    let (code, _, reported) = ran("check", "xsens");
    assert_eq!(code, Some(1), "{reported}");
    assert!(reported.contains("no frame of Xsens MTData2"), "{reported}");
}

#[test]
fn the_lines_of_a_port_are_sent_to_a_daemon() {
    let daemon = Process::start(&["--listen", TCP]);
    let mut board = Board::new();
    let port = format!("serial://{}?for=3", board.port.display());
    let address = format!("tcp://{}", daemon.address(0));
    let (code, text) = output(&["send", &port, &address], &mut board);
    assert_eq!(code, Some(0), "{text}");
    eventually("attitudes", || attitudes(&daemon) > 50);
    end(daemon);
}

/// Rows of 8 sensors, 1000 times a second: a pseudo-terminal carries them at any rate, 921,600 baud would carry 11.5 bytes
/// of each.
#[test]
#[ignore = "measures"]
fn eight_sensors_at_a_kilohertz_lose_nothing_and_wait_for_no_more_than_two_milliseconds() {
    const SECONDS: u64 = 10;
    let mut board = Board::new();
    let process = serving(&format!("serial://{}?baud=921600", board.port.display()));
    eventually("the port to be open", || {
        status(&process)["outgoing"][0]["connected"] == true
    });
    let mut watcher =
        Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\",\"id\":\"s7\"}");
    let reader = std::thread::spawn(move || {
        let heard = |_| {
            let line = watcher.line().unwrap();
            (Instant::now(), line)
        };
        (0..SECONDS * 1000).map(heard).collect::<Vec<_>>()
    });
    board.send("id,time_us,gx,gy,gz\n");
    let began = Instant::now();
    let mut sent = Vec::new();
    for n in 0..SECONDS * 1000 {
        let rows: String = (0..8)
            .map(|s| format!("s{s},{},1,2,3\n", n * 1000))
            .collect();
        while began.elapsed() < Duration::from_micros(n * 1000) {
            std::thread::sleep(Duration::from_micros(50));
        }
        sent.push(Instant::now());
        board.send(&rows);
    }
    let heard = reader.join().unwrap();
    let mut waits: Vec<Duration> = heard
        .iter()
        .zip(&sent)
        .skip(100)
        .map(|((at, _), sent)| *at - *sent)
        .collect();
    waits.sort_unstable();
    let at = |part: f64| waits[(part * (waits.len() - 1) as f64) as usize];
    println!("p50 {:?}, p99 {:?}, most {:?}", at(0.5), at(0.99), at(1.0));
    let status = status(&process);
    for source in status["sources"].as_array().unwrap() {
        assert_eq!(source["attitudes"], SECONDS * 1000, "{source}");
    }
    assert!(at(0.99) <= Duration::from_millis(2), "{:?}", at(0.99));
    end(process);
}
