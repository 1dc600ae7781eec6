//! Promises of `packaging/`: service manager, sockets passed, watchdog.

use super::client::Client;
use super::daemon::{PATIENCE, Process, TCP, strapd};
use std::os::fd::OwnedFd;
use std::os::unix::net::{UnixDatagram, UnixListener};
use std::path::PathBuf;
use std::process::{Command, Stdio};

fn packaged(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("packaging")
        .join(name)
}

/// Hands its standard input over as the first socket, as `sd_listen_fds(3)` has it.
const PASSED: &str = "exec 3<&0 </dev/null; export LISTEN_PID=$$ LISTEN_FDS=1 LISTEN_FDNAMES=lines; exec \"$0\" serve \"$@\"";

fn started(socket: impl Into<OwnedFd>, uri: &str) -> Process {
    Process::start_by(PASSED, Stdio::from(socket.into()), &["--listen", uri])
}

#[test]
fn a_socket_of_the_service_manager_is_served_by_name_or_number() {
    for uri in ["tcp-listen://fd:lines", "tcp-listen://fd:0"] {
        let socket = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = socket.local_addr().unwrap();
        // Who comes before the daemon has started waits.
        let mut early = Client::tcp(address);
        let mut process = started(socket, uri);
        assert_eq!(process.addresses, [format!("tcp-listen://{address}")]);
        early.object("VERSION");
        process.signal("TERM");
        assert_eq!(process.exit(), Some(0));
    }

    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let mut process = started(UnixListener::bind(&path).unwrap(), "unix-listen://fd:lines");
    Client::unix(&path).object("VERSION");
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    assert!(path.exists(), "the name is the service manager's");
}

#[test]
fn a_socket_that_was_not_passed_or_is_another_or_reaches_others_is_refused() {
    let run = |stdin: Stdio, uri: &str| {
        let output = Command::new("sh")
            .args(["-c", PASSED])
            .arg(strapd())
            .args(["--listen", uri])
            .stdin(stdin)
            .output()
            .unwrap();
        assert_ne!(output.status.code(), Some(0), "{uri}");
        String::from_utf8(output.stderr).unwrap()
    };
    let tcp = |at: &str| Stdio::from(OwnedFd::from(std::net::TcpListener::bind(at).unwrap()));
    let said = run(tcp("127.0.0.1:0"), "tcp-listen://fd:web");
    assert!(
        said.contains("named lines") && said.contains("FileDescriptorName"),
        "{said}"
    );
    let said = run(tcp("127.0.0.1:0"), "udp-listen://fd:lines");
    assert!(said.contains("udp-listen://fd:lines"), "{said}");
    let said = run(tcp("0.0.0.0:0"), "tcp-listen://fd:lines");
    assert!(said.contains("--token-file"), "{said}");
    let output = Command::new(strapd())
        .args(["serve", "--listen", "tcp-listen://fd:lines"])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("none was passed"), "{said}");
}

#[test]
fn the_service_manager_hears_ready_watchdog_and_stopping() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("notify");
    let socket = UnixDatagram::bind(&path).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let script = format!(
        "export NOTIFY_SOCKET={} WATCHDOG_USEC=100000 WATCHDOG_PID=$$; exec \"$0\" serve \"$@\"",
        path.display()
    );
    let mut process = Process::start_by(&script, Stdio::null(), &["--listen", TCP]);
    let hear = || {
        let mut text = [0; 512];
        let n = socket.recv(&mut text).unwrap();
        String::from_utf8_lossy(&text[..n]).trim().to_owned()
    };
    assert_eq!(hear(), "READY=1");
    for _ in 0..3 {
        assert_eq!(hear(), "WATCHDOG=1");
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let last = std::iter::from_fn(|| Some(hear())).find(|said| said != "WATCHDOG=1");
    assert_eq!(last.as_deref(), Some("STOPPING=1"));
}

#[test]
fn the_packaged_configuration_holds() {
    let output = Command::new(strapd())
        .args(["config", "check"])
        .arg(packaged("strapd.toml"))
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let unit = std::fs::read_to_string(packaged("strapd.service")).unwrap();
    assert!(unit.contains("Type=notify") && unit.contains("WatchdogSec="));
}

#[test]
#[cfg_attr(not(has_systemd), ignore = "needs systemd-analyze")]
fn the_unit_leaves_an_attacker_next_to_nothing() {
    let output = Command::new("systemd-analyze")
        .args(["security", "--offline=true", "--threshold=20", "--no-pager"])
        .arg(packaged("strapd.service"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    // Older ones know no --threshold or --offline.
    if said.contains("Overall exposure level") {
        assert!(
            output.status.success(),
            "exposure above 2.0: {}",
            said.trim_end()
        );
    } else {
        eprintln!(
            "SKIPPED: {}",
            String::from_utf8_lossy(&output.stderr).trim_end()
        );
    }
}
