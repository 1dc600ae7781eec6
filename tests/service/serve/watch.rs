//! `strapd watch` in a terminal, as somebody would see it, and where there is none.

use super::client::{Client, rate};
use super::daemon::{Daemon, PATIENCE, eventually, listening, strapd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Termios, Winsize, tcgetattr, tcsetwinsize};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::num::NonZero;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Instant;
use strapd::sink::address::Listen;

/// A terminal with `strapd watch` in it.
struct Terminal {
    child: Child,
    keys: File,
    slave: File,
    before: Termios,
    shown: Arc<Mutex<(vt100::Parser, Vec<u8>)>>,
}

impl Terminal {
    fn watching(url: &str, no_color: bool) -> Terminal {
        let master =
            openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let name = ptsname(&master, Vec::new()).unwrap();
        let slave = || {
            File::options()
                .read(true)
                .write(true)
                .open(name.to_str().unwrap())
                .unwrap()
        };
        let kept = slave();
        let size = Winsize {
            ws_row: 24,
            ws_col: 100,
            ws_xpixel: 0,
            ws_ypixel: 0,
        };
        tcsetwinsize(&kept, size).unwrap();
        let before = tcgetattr(&kept).unwrap();
        // The terminal is its own, not that of whoever runs the tests.
        let mut command = Command::new("setsid");
        command
            .arg("--ctty")
            .arg(strapd())
            .args(["watch", url])
            .env_remove("STRAPD_TOKEN_FILE")
            .env_remove("NO_COLOR")
            .env("TERM", "xterm-256color")
            .stdin(slave())
            .stdout(slave())
            .stderr(slave());
        if no_color {
            command.env("NO_COLOR", "1");
        }
        let child = command.spawn().unwrap();
        let mut master = File::from(master);
        let keys = master.try_clone().unwrap();
        let shown = Arc::new(Mutex::new((
            vt100::Parser::new(NonZero::new(24).unwrap(), NonZero::new(100).unwrap(), 0),
            Vec::new(),
        )));
        let screen = shown.clone();
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(n @ 1..) = master.read(&mut buffer) {
                let mut shown = screen.lock().unwrap();
                shown.0.process(&buffer[..n]);
                shown.1.extend_from_slice(&buffer[..n]);
            }
        });
        Terminal {
            child,
            keys,
            slave: kept,
            before,
            shown,
        }
    }

    fn text(&self) -> String {
        self.shown.lock().unwrap().0.screen().contents()
    }

    fn until(&self, what: &str) -> String {
        let start = Instant::now();
        loop {
            let text = self.text();
            if text.contains(what) {
                return text;
            }
            assert!(start.elapsed() < PATIENCE, "no `{what}` in\n{text}");
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
    }

    /// Ended with 0, and the terminal is as it was.
    fn left(mut self) {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(
                start.elapsed() < PATIENCE,
                "it does not end\n{}",
                self.text()
            );
            std::thread::sleep(std::time::Duration::from_millis(5));
        };
        assert_eq!(status.code(), Some(0), "{}", self.text());
        eventually("the screen is given back", || {
            let shown = self.shown.lock().unwrap();
            let screen = shown.0.screen();
            !screen.alternate_screen() && !screen.hide_cursor()
        });
        let after = tcgetattr(&self.slave).unwrap();
        assert_eq!(after.local_modes, self.before.local_modes);
        assert_eq!(after.input_modes, self.before.input_modes);
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A sensor turning about x, level at its first sample.
fn turning(daemon: &Daemon, id: &str) -> Client {
    // Connected is not yet watching.
    eventually("somebody to watch", || {
        let status = daemon.status();
        let mut clients = status["clients"].as_array().unwrap().iter();
        clients.any(|client| client["watching"] == true)
    });
    let mut sender = Client::tcp(daemon.address(0));
    for n in 0..=500 {
        sender.send(&rate(id, n, std::f64::consts::FRAC_PI_2));
    }
    sender
}

#[test]
fn a_sensor_is_seen_and_a_daemon_that_comes_back_too() {
    let daemon = Daemon::tcp();
    let address = daemon.address(0);
    let mut terminal = Terminal::watching(&format!("tcp://{address}"), true);
    terminal.until("nothing has come yet");
    let _sender = turning(&daemon, "imu\\\\u{1b}[31m0");
    // Half a second at 90 degrees a second.
    let text = terminal.until("samples 501");
    let text = match text.contains("roll   +45.000") {
        true => text,
        false => terminal.until("roll   +4"),
    };
    for part in [
        "1 sensor  connected",
        "imu\\u{1b}[31m0  flu in start\n",
        "rate x  +90.000",
        "gaps 0",
        "///:::|  roll",
    ] {
        assert!(text.contains(part), "no `{part}` in\n{text}");
    }
    let raw = tcgetattr(&terminal.slave).unwrap();
    assert!(
        !raw.local_modes.contains(LocalModes::ECHO),
        "keys are not echoed"
    );
    {
        let shown = terminal.shown.lock().unwrap();
        assert!(shown.0.screen().alternate_screen() && shown.0.screen().hide_cursor());
    }
    assert!(daemon.stop());
    terminal.until("NOT CONNECTED");
    let mut settings = listening(&[]);
    settings.listen = vec![Listen::Tcp(address).into()];
    let daemon = Daemon::start(settings);
    terminal.until("1 sensor  connected");
    let _sender = turning(&daemon, "second");
    terminal.until("second  flu in start");
    {
        // Attributes, but no colours: 30-37, 38, 90-97.
        let bytes = terminal.shown.lock().unwrap().1.clone();
        let text = String::from_utf8(bytes).unwrap();
        for part in text.split("\u{1b}[").skip(1) {
            let code = part
                .split(|c: char| c.is_ascii_alphabetic())
                .next()
                .unwrap();
            let is_style = part[code.len()..].starts_with('m');
            assert!(
                !is_style || !(code.starts_with('3') || code.starts_with('9')),
                "{code}"
            );
        }
    }
    terminal.keys.write_all(b"q").unwrap();
    terminal.left();
}

#[test]
fn control_c_and_signals_give_the_terminal_back() {
    let daemon = Daemon::tcp();
    let url = format!("tcp://{}", daemon.address(0));
    for how in ["\u{3}", "TERM", "HUP", "INT"] {
        let mut terminal = Terminal::watching(&url, false);
        terminal.until("nothing has come yet");
        if how == "\u{3}" {
            terminal.keys.write_all(how.as_bytes()).unwrap();
        } else {
            let done = Command::new("kill")
                .args([&format!("-{how}"), &terminal.child.id().to_string()])
                .status()
                .unwrap();
            assert!(done.success());
        }
        terminal.left();
    }
}

#[test]
fn many_sensors_are_scrolled_and_thinned() {
    let daemon = Daemon::tcp();
    let mut terminal = Terminal::watching(&format!("tcp://{}", daemon.address(0)), false);
    terminal.until("nothing has come yet");
    let senders: Vec<Client> = (0..5)
        .map(|n| turning(&daemon, &format!("gyro{n}")))
        .collect();
    terminal.until("5 sensors");
    assert!(terminal.text().contains("gyro0") && !terminal.text().contains("gyro4"));
    for _ in 0..3 {
        terminal.keys.write_all(b"\x1b[6~").unwrap();
    }
    terminal.until("gyro4  flu");
    assert!(!terminal.text().contains("gyro0  flu"));
    // Ten a second as the stamps say, of the thousand that were made.
    let status = daemon.status();
    let client = &status["clients"][0];
    assert!(client["sent"].as_u64().unwrap() <= 5 * 12, "{client}");
    drop(senders);
    terminal.keys.write_all(b"q").unwrap();
    terminal.left();
}

#[test]
fn without_a_terminal_there_is_a_line_a_second() {
    let daemon = Daemon::tcp();
    let mut child = Command::new(strapd())
        .args(["watch", &format!("tcp://{}", daemon.address(0))])
        .env_remove("STRAPD_TOKEN_FILE")
        .stdout(Stdio::piped())
        .stdin(Stdio::null())
        .spawn()
        .unwrap();
    eventually("it watches", || {
        daemon.status()["clients"]
            .as_array()
            .unwrap()
            .iter()
            .any(|c| c["watching"] == true)
    });
    let _sender = turning(&daemon, "imu0");
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let line = lines.next().unwrap().unwrap();
    assert!(line.starts_with("imu0  seq "), "{line}");
    assert!(
        line.contains("pitch    +0.000") && line.contains("dropped 0"),
        "{line}"
    );
    assert!(daemon.stop());
    let lost = lines.map(Result::unwrap).find(|l| !l.starts_with("imu0"));
    assert!(lost.unwrap().contains("NOT CONNECTED"));
    // Its reader has gone: a quiet end.
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < PATIENCE);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert_eq!(child.wait().unwrap().code(), Some(0));
}
