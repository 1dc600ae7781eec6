//! A process, and the processor time that it may use -> its output, or why it was ended.
//!
//! Not time by the clock, which on a busy machine says nothing of the program: a bound by the clock is a last resort.

use std::io::{Read, Write};
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// Processor seconds of one process: what tests ask for takes up to ten, without optimisation.
pub const CPU_SECS: u64 = 60;

/// Bound by the clock, for what waits forever and uses none.
const LAST_RESORT: Duration = Duration::from_secs(10 * CPU_SECS);

/// Runs a command to its end, with this on its standard input.
///
/// # Panics
/// It was ended because it used too much processor time, or did not end at all.
#[track_caller]
pub fn ended(command: &Command, stdin: impl Into<Vec<u8>>) -> Output {
    match output(command, stdin.into(), CPU_SECS, LAST_RESORT) {
        Ok(output) => output,
        Err(why) => panic!("{command:?}: {why}"),
    }
}

/// The same command with a bound on the processor time of each of its processes.
fn bounded(command: &Command, cpu_secs: u64) -> Command {
    if cfg!(not(unix)) {
        let mut same = Command::new(command.get_program());
        same.args(command.get_args());
        return with_surroundings(same, command);
    }
    let mut shell = Command::new("/bin/sh");
    // Of the soft bound the process gets a signal of its own, SIGXCPU.
    shell.args(["-c", &format!("ulimit -S -t {cpu_secs}; exec \"$@\""), "sh"]);
    shell.arg(command.get_program()).args(command.get_args());
    with_surroundings(shell, command)
}

fn with_surroundings(mut to: Command, from: &Command) -> Command {
    for (name, value) in from.get_envs() {
        match value {
            Some(value) => to.env(name, value),
            None => to.env_remove(name),
        };
    }
    if let Some(dir) = from.get_current_dir() {
        to.current_dir(dir);
    }
    to
}

fn output(
    command: &Command,
    stdin: Vec<u8>,
    cpu_secs: u64,
    last_resort: Duration,
) -> Result<Output, String> {
    let mut child = bounded(command, cpu_secs)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|why| format!("not started: {why}"))?;
    let mut to = child.stdin.take().unwrap();
    // Whoever does not read it has said why.
    std::thread::spawn(move || drop(to.write_all(&stdin)));
    let pipes: [Box<dyn Read + Send>; 2] = [
        Box::new(child.stdout.take().unwrap()),
        Box::new(child.stderr.take().unwrap()),
    ];
    let [out, err] = pipes.map(|mut pipe| {
        let (all, read) = mpsc::channel();
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            let _ = pipe.read_to_end(&mut bytes);
            let _ = all.send(bytes);
        });
        read
    });
    // Its output ends when it does, at the latest.
    let Ok(stdout) = out.recv_timeout(last_resort) else {
        let used = cpu_secs_of(child.id());
        child.kill().unwrap();
        child.wait().unwrap();
        return Err(format!(
            "timed out: not at its end after {last_resort:?} by the clock, a last resort; used {used} CPU s of {cpu_secs}"
        ));
    };
    let status = child.wait().unwrap();
    let stderr = err.recv().unwrap();
    if is_out_of_time(status) {
        return Err(format!(
            "timed out: used {cpu_secs} CPU s of {cpu_secs} and was ended; on stderr: {}",
            String::from_utf8_lossy(&stderr)
        ));
    }
    Ok(Output {
        status,
        stdout,
        stderr,
    })
}

#[cfg(unix)]
fn is_out_of_time(status: ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    /// SIGXCPU, on Linux, macOS and the BSDs.
    const XCPU: i32 = 24;
    // A shell that waited for the one it hit says it with 128.
    status.signal() == Some(XCPU) || status.code() == Some(128 + XCPU)
}

#[cfg(not(unix))]
fn is_out_of_time(_: ExitStatus) -> bool {
    false
}

/// Processor seconds of a process so far, `?` where the system does not tell.
fn cpu_secs_of(id: u32) -> String {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    // User and system ticks of 10 ms, the twelfth and thirteenth behind the name.
    let behind = stat.rsplit_once(')').map_or("", |(_, behind)| behind);
    let ticks: Vec<u64> = behind
        .split_whitespace()
        .skip(11)
        .take(2)
        .filter_map(|field| field.parse().ok())
        .collect();
    match ticks[..] {
        [user, system] => format!("{:.1}", (user + system) as f64 / 100.0),
        _ => "?".to_owned(),
    }
}

/// A bound that is hit says so.
#[cfg(unix)]
#[test]
fn a_process_out_of_time_is_ended_and_that_is_said() {
    let sh = |script: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    };
    let minute = Duration::from_secs(60);
    let why = output(&sh("while :; do :; done"), Vec::new(), 1, minute).unwrap_err();
    assert!(why.contains("timed out: used 1 CPU s of 1"), "{why}");
    let why = output(&sh("exec sleep 60"), Vec::new(), 1, minute / 120).unwrap_err();
    assert!(
        why.contains(
            "timed out: not at its end after 500ms by the clock, a last resort; used 0.0 CPU s of 1"
        ),
        "{why}"
    );
    let fine = output(&sh("cat; echo err >&2; exit 3"), b"in".to_vec(), 1, minute).unwrap();
    assert_eq!(
        (fine.status.code(), &fine.stdout[..], &fine.stderr[..]),
        (Some(3), &b"in"[..], &b"err\n"[..])
    );
}
