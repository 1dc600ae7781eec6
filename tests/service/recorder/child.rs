//! A process that records, for the tests to kill, stop, or starve: this test binary, run once more.

use super::{attitude, sample};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use strapd::serve::core::recorder::{Recorder, Settings};

const TASK: &str = "STRAPD_RECORDER_CHILD";

/// Task of the child.
#[derive(Clone, Copy)]
pub(super) enum Task {
    /// Sends so many samples a second until it is killed or gets SIGTERM.
    Paced { rate_hz: u64, flush_ms: u64 },
    /// Sends as fast as the recorder takes them until the recording stops, then a little more.
    Flood { min_free: u64 },
}

impl Task {
    /// A command that does it, recording to `path` and counting what it has handed over in `counter`.
    pub(super) fn command(self, path: &Path, counter: &Path) -> Command {
        let words = match self {
            Task::Paced { rate_hz, flush_ms } => format!("paced {rate_hz} {flush_ms}"),
            Task::Flood { min_free } => format!("flood {min_free} 0"),
        };
        let mut command = Command::new(std::env::current_exe().unwrap());
        command
            .args([
                "--exact",
                "recorder::child::this_binary_as_the_recording_process",
                "--nocapture",
            ])
            .env(
                TASK,
                format!("{words} {} {}", path.display(), counter.display()),
            )
            .stdout(Stdio::null());
        command
    }
}

/// Samples the child had handed over.
pub(super) fn handed(counter: &Path) -> u64 {
    std::fs::read(counter)
        .ok()
        .and_then(|bytes| Some(u64::from_le_bytes(bytes.try_into().ok()?)))
        .unwrap_or(0)
}

/// Waits until the child has handed over something.
pub(super) fn wait_for_first(counter: &Path) {
    let begun = Instant::now();
    while handed(counter) == 0 {
        assert!(
            begun.elapsed() < Duration::from_secs(600),
            "timed out: the child has recorded nothing for 600 s by the clock, a last resort"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[track_caller]
pub(super) fn assert_code(status: ExitStatus, code: i32) {
    assert_eq!(status.code(), Some(code), "{status:?}");
}

/// Not a test but for the one thing that it does nothing unless asked: what the tests start.
#[test]
fn this_binary_as_the_recording_process() {
    let Ok(task) = std::env::var(TASK) else {
        return;
    };
    let words: Vec<&str> = task.split(' ').collect();
    let [kind, first, second, path, counter] = words[..] else {
        panic!("{task}")
    };
    let (first, second) = (first.parse().unwrap(), second.parse().unwrap());
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_ansi(false)
        .init();
    strapd::size_limit::make_size_limit_an_error();
    let counter = std::fs::File::create(counter).unwrap();
    let code = match kind {
        "paced" => paced(first, second, PathBuf::from(path), &counter),
        _ => flood(first, PathBuf::from(path), &counter),
    };
    std::process::exit(code);
}

fn paced(rate_hz: u64, flush_ms: u64, path: PathBuf, counter: &std::fs::File) -> i32 {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        signal_hook::flag::register(signal, stop.clone()).unwrap();
    }
    let mut settings = Settings::new(path);
    settings.min_free = 0;
    settings.flush_every = Duration::from_millis(flush_ms);
    let recorder = Recorder::start(settings).unwrap();
    let (handle, id) = (recorder.handle(), Arc::from("imu"));
    let begun = Instant::now();
    let mut k = 0;
    while !stop.load(Ordering::Relaxed) {
        let due = (begun.elapsed().as_secs_f64() * rate_hz as f64) as u64;
        while k < due {
            let raw = sample(k, rate_hz);
            handle.input(&id, vec![raw]);
            handle.attitude(&id, k, vec![attitude(&raw)]);
            k += 1;
        }
        counter.write_all_at(&k.to_le_bytes(), 0).unwrap();
        std::thread::sleep(Duration::from_micros(500_000 / rate_hz));
    }
    let status = recorder.finish();
    assert_eq!((status.samples, status.attitudes), (k, k), "{status:?}");
    i32::from(status.is_lossy()) * 3
}

fn flood(min_free: u64, path: PathBuf, counter: &std::fs::File) -> i32 {
    let mut settings = Settings::new(path);
    settings.min_free = min_free;
    settings.flush_every = Duration::from_millis(20);
    let recorder = Recorder::start(settings).unwrap();
    let (handle, id) = (recorder.handle(), Arc::from("imu"));
    let mut k = 0;
    let mut after_stop = 0;
    while after_stop < 100 {
        let batch: Vec<_> = (k..k + 100).map(|k| sample(k, 1000)).collect();
        handle.input(&id, batch);
        k += 100;
        counter.write_all_at(&k.to_le_bytes(), 0).unwrap();
        if handle.status().stopped.is_some() {
            after_stop += 1;
        }
        std::thread::sleep(Duration::from_micros(500));
        assert!(k < 10_000_000, "the recording never stopped");
    }
    let status = recorder.finish();
    assert_eq!(status.samples + status.unrecorded, k, "{status:?}");
    eprintln!("recorded {} of {k}", status.samples);
    i32::from(status.is_lossy()) * 3
}
