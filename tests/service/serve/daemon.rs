//! A daemon in this process, and the programme as a process of its own.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use strapd::serve::core::hub::Hub;
use strapd::serve::{Listening, Server, Settings};
use strapd::sink::address::Listen;

/// Longer than anything here takes on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// A daemon on a thread of its own.
pub(crate) struct Daemon {
    pub(crate) addresses: Vec<Listen>,
    pub(crate) hub: Arc<Hub>,
    stop: Option<tokio::sync::oneshot::Sender<()>>,
    thread: Option<JoinHandle<bool>>,
}

/// Settings that listen on these.
pub(crate) fn listening(uris: &[&str]) -> Settings {
    Settings {
        listen: uris.iter().map(|u| Listening::parse(u).unwrap()).collect(),
        ..Settings::default()
    }
}

pub(crate) const TCP: &str = "tcp-listen://127.0.0.1:0";
pub(crate) const UDP: &str = "udp-listen://127.0.0.1:0";
pub(crate) const WS: &str = "ws-listen://127.0.0.1:0";

impl Daemon {
    /// Starts one on TCP alone.
    pub(crate) fn tcp() -> Daemon {
        Daemon::start(listening(&[TCP]))
    }

    pub(crate) fn start(settings: Settings) -> Daemon {
        let (tell, told) = std::sync::mpsc::channel();
        let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_multi_thread()
                .worker_threads(2)
                .enable_all()
                .build()
                .unwrap();
            let drained = runtime.block_on(async move {
                let server = Server::bind(settings).await.unwrap();
                tell.send((server.addresses().to_vec(), server.hub().clone()))
                    .unwrap();
                server
                    .run(async {
                        let _ = stopped.await;
                    })
                    .await
            });
            runtime.shutdown_background();
            drained
        });
        let (addresses, hub) = told.recv_timeout(PATIENCE).unwrap();
        Daemon {
            addresses,
            hub,
            stop: Some(stop),
            thread: Some(thread),
        }
    }

    /// The address of the n-th listener.
    pub(crate) fn address(&self, n: usize) -> SocketAddr {
        match &self.addresses[n] {
            Listen::Tcp(a) | Listen::Udp(a) | Listen::WebSocket(a) => *a,
            Listen::Unix(_) | Listen::Passed(..) => unreachable!("a path"),
        }
    }

    /// Shuts down; whether it drained in time.
    pub(crate) fn stop(mut self) -> bool {
        self.stop.take().unwrap().send(()).unwrap();
        self.thread.take().unwrap().join().unwrap()
    }

    /// The `STATUS` as a client would see it.
    pub(crate) fn status(&self) -> serde_json::Value {
        serde_json::from_slice(&self.hub.status()).unwrap()
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        if let (Some(stop), Some(thread)) = (self.stop.take(), self.thread.take()) {
            let _ = stop.send(());
            let _ = thread.join();
        }
    }
}

/// Waits until `done`, with what it waits for in the message.
pub(crate) fn eventually(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < PATIENCE, "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// `strapd serve ARGS` as a process.
pub(crate) struct Process {
    pub(crate) child: Child,
    pub(crate) addresses: Vec<String>,
    /// Log up to the ready line.
    pub(crate) early: String,
    pub(crate) log: BufReader<ChildStderr>,
}

pub(crate) fn strapd() -> PathBuf {
    assert_cmd::cargo::cargo_bin("strapd")
}

impl Process {
    /// Starts it and waits for its ready line.
    pub(crate) fn start(args: &[&str]) -> Process {
        let mut command = Command::new(strapd());
        command.arg("serve");
        Process::spawn(command, args)
    }

    /// `strapd COMMAND ARGS`, another command that listens.
    #[allow(dead_code)]
    pub(crate) fn of(args: &[&str]) -> Process {
        Process::spawn(Command::new(strapd()), args)
    }

    /// The same after a command of the shell, such as a limit.
    pub(crate) fn start_limited(limit: &str, args: &[&str]) -> Process {
        let mut command = Command::new("sh");
        command
            .args(["-c", &format!("{limit} && exec \"$0\" serve \"$@\"")])
            .arg(strapd());
        Process::spawn(command, args)
    }

    /// The same by a command of the shell that ends in `exec "$0" serve "$@"`, with something as its
    /// standard input.
    pub(crate) fn start_by(script: &str, stdin: Stdio, args: &[&str]) -> Process {
        let mut command = Command::new("sh");
        command.args(["-c", script]).arg(strapd());
        Process::spawn_with(command, stdin, args)
    }

    fn spawn(command: Command, args: &[&str]) -> Process {
        Process::spawn_with(command, Stdio::piped(), args)
    }

    fn spawn_with(mut command: Command, stdin: Stdio, args: &[&str]) -> Process {
        let mut child = command
            .args(args)
            .args(["--log-format", "json"])
            .env_remove("STRAPD_LOG")
            .env_remove("STRAPD_LOG_FORMAT")
            // The gyro alone, unless a test asks for more by --aid.
            .env("STRAPD_AID", "none")
            .stdin(stdin)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut log = BufReader::new(child.stderr.take().unwrap());
        let mut early = String::new();
        let addresses = loop {
            let mut line = String::new();
            assert!(
                log.read_line(&mut line).unwrap() > 0,
                "no ready line: {early}"
            );
            let said: serde_json::Value = serde_json::from_str(&line).unwrap_or_else(|_| {
                unreachable!("no line of a log: {line}");
            });
            early.push_str(&line);
            let message = said["fields"]["message"].as_str().unwrap_or_default();
            if let Some(addresses) = message.strip_prefix("ready ") {
                break addresses.to_owned();
            }
            // More is said only where more was asked for.
            assert_ne!(said["level"], "INFO", "{line}");
        };
        Process {
            addresses: addresses.split(' ').map(str::to_owned).collect(),
            child,
            early,
            log,
        }
    }

    /// The socket address of the n-th listener.
    pub(crate) fn address(&self, n: usize) -> SocketAddr {
        let (_, address) = self.addresses[n].split_once("://").unwrap();
        address.parse().unwrap()
    }

    /// `strapd ARGS` of a second process, which is refused for a file that this one writes.
    pub(crate) fn assert_refuses(&self, args: &[&str]) {
        let mut second = Command::new(strapd())
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while second.try_wait().unwrap().is_none() && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(5));
        }
        // One that was not refused serves until it is ended.
        let _ = second.kill();
        let output = second.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{args:?}: {said}");
        let who = match cfg!(target_os = "linux") {
            true => format!("process {} is writing it", self.child.id()),
            false => "another process is writing it".to_owned(),
        };
        assert!(said.contains(&who), "{args:?}: {said}");
    }

    /// Sends a signal.
    pub(crate) fn signal(&self, name: &str) {
        let done = Command::new("kill")
            .args([&format!("-{name}"), &self.child.id().to_string()])
            .status()
            .unwrap();
        assert!(done.success());
    }

    /// Exit code, in bounded time.
    pub(crate) fn exit(&mut self) -> Option<i32> {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(start.elapsed() < PATIENCE, "it does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
