//! Kill -9, SIGTERM, a power cut.

use super::child::{Task, assert_code, handed, wait_for_first};
use super::{assert_whole, attitude, linear, recovered, sample};
use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use strapd::serve::core::recorder::{Recorder, Settings};

/// Kills `children` recording processes, each at its own moment, `at_once` at a time. The samples each
/// one had handed over that are not in its file, in seconds, sorted.
fn seconds_lost(rate_hz: u64, flush_ms: u64, children: u64, at_once: u64) -> Vec<f64> {
    let dir = tempfile::tempdir().unwrap();
    let mut lost = Vec::new();
    let mut n = 0;
    while n < children {
        let batch: Vec<u64> = (n..children.min(n + at_once)).collect();
        n += batch.len() as u64;
        let done: Vec<f64> = std::thread::scope(|scope| {
            let threads: Vec<_> = batch
                .iter()
                .map(|n| {
                    // Spread over four flushes by a step that is no fraction of one.
                    let moment = Duration::from_micros(300_000 + n * 61_803 % 800_000);
                    let dir = dir.path();
                    scope.spawn(move || killed(dir, *n, rate_hz, flush_ms, moment))
                })
                .collect();
            threads.into_iter().map(|t| t.join().unwrap()).collect()
        });
        lost.extend(done);
    }
    lost.sort_by(f64::total_cmp);
    lost
}

fn killed(dir: &Path, n: u64, rate_hz: u64, flush_ms: u64, moment: Duration) -> f64 {
    let (path, counter) = (
        dir.join(format!("{n}.mcap")),
        dir.join(format!("{n}.count")),
    );
    let task = Task::Paced { rate_hz, flush_ms };
    let mut child = task.command(&path, &counter).spawn().unwrap();
    wait_for_first(&counter);
    std::thread::sleep(moment);
    child.kill().unwrap();
    child.wait().unwrap();
    let handed = handed(&counter);
    let (recovered, [samples, attitudes]) = recovered(&path);
    assert!(recovered.was_damaged(), "a killed recording has no footer");
    assert!(
        handed > 0 && samples > 0,
        "{handed} handed over, {samples} in the file"
    );
    assert_eq!(
        linear(&std::fs::read(&path).unwrap()),
        recovered.written.messages
    );
    // The counter is written behind the samples, so a few more than it says may be in the file.
    handed.saturating_sub(samples.min(attitudes)) as f64 / rate_hz as f64
}

/// Result of `work`, and by how much a thread that sleeps for a moment woke too late meanwhile, s: where the machine is
/// busy, nobody does anything in time.
fn with_lateness<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let watch = scope.spawn(|| {
            let (moment, mut latest) = (Duration::from_millis(5), 0.0_f64);
            while !done.load(Ordering::Relaxed) {
                let before = Instant::now();
                std::thread::sleep(moment);
                let late = before.elapsed().saturating_sub(moment);
                latest = latest.max(late.as_secs_f64());
            }
            latest
        });
        let result = work();
        done.store(true, Ordering::Relaxed);
        (result, watch.join().unwrap())
    })
}

#[test]
fn kill_9_at_twenty_moments_costs_a_quarter_of_a_second_at_most() {
    // At twice the default pace of flushing, so that the bound has room; the default is measured below. The thread that
    // flushes waits for the processor twice: to wake, and to write.
    for rate_hz in [200, 1000] {
        let (lost, late) = with_lateness(|| seconds_lost(rate_hz, 100, 10, 5));
        eprintln!("{rate_hz} Hz: lost {lost:.3?} s, the machine {late:.3} s late");
        assert!(
            *lost.last().unwrap() <= 0.25 + 2.0 * late,
            "{rate_hz} Hz: {lost:?} s, the machine {late} s late"
        );
    }
}

#[test]
#[ignore = "200 kills at the default settings; two minutes, and the bound wants a quiet machine"]
fn kill_9_at_two_hundred_moments_costs_a_quarter_of_a_second_at_most() {
    for rate_hz in [200, 1000] {
        let lost = seconds_lost(rate_hz, 200, 100, 2);
        let [median, worst] = [lost[lost.len() / 2], lost[lost.len() - 1]];
        eprintln!(
            "{rate_hz} Hz: {} kills, lost {median:.3} s median, {worst:.3} s at most",
            lost.len()
        );
        assert!(worst <= 0.25, "{rate_hz} Hz: {lost:?} s");
    }
}

#[test]
fn sigterm_leaves_a_whole_file_with_everything_before_it() {
    let dir = tempfile::tempdir().unwrap();
    let (path, counter) = (dir.path().join("a.mcap"), dir.path().join("count"));
    let task = Task::Paced {
        rate_hz: 1000,
        flush_ms: 200,
    };
    let mut child = task.command(&path, &counter).spawn().unwrap();
    wait_for_first(&counter);
    std::thread::sleep(Duration::from_millis(500));
    let before = handed(&counter);
    let sent = Instant::now();
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-TERM", &id])
            .status()
            .unwrap()
            .success()
    );
    assert_code(child.wait().unwrap(), 0);
    let took = sent.elapsed();
    assert!(took <= Duration::from_secs(2), "{took:?}");
    let whole = assert_whole(&path);
    let (recovered, [samples, attitudes]) = recovered(&path);
    assert!(!recovered.was_damaged(), "{recovered:?}");
    // Attitude and transform beside each sample, and all of what was handed over, to the last one.
    assert_eq!((whole, attitudes), (3 * samples, samples));
    assert!(samples >= before);
    assert_eq!(samples, handed(&counter));
}

#[test]
fn what_is_synced_is_never_more_than_a_second_and_a_quarter_behind() {
    // The promise is one of the clock, and of the disk: only where the machine stood still meanwhile, it is tried again.
    for _ in 0..5 {
        let (lost, stall) = most_behind();
        if lost <= 1.25 {
            return;
        }
        // Two threads, one after the other, are each late by that: who writes, and who syncs.
        assert!(
            lost <= 1.25 + 2.0 * stall,
            "{lost} s, and the machine stood still for {stall} s at most"
        );
    }
    unreachable!("the machine stands still all the time: nothing can be said of it");
}

/// Seconds by which a thread that waits and syncs, as the recorder's do, is late at most, until it is told to end.
fn longest_stall(path: &Path, ends: &AtomicBool) -> f64 {
    let mut file = std::fs::File::create(path).unwrap();
    let (wait, mut longest) = (Duration::from_millis(100), 0.0_f64);
    while !ends.load(Ordering::Relaxed) {
        let begun = Instant::now();
        std::thread::sleep(wait);
        file.write_all(b"x").unwrap();
        file.sync_data().unwrap();
        longest = longest.max((begun.elapsed() - wait).as_secs_f64());
    }
    longest
}

/// Seconds of samples that the worst moment for a loss of power costs, of three and a half; and the longest stall of
/// the machine in that time.
fn most_behind() -> (f64, f64) {
    let ends = AtomicBool::new(false);
    let stalls = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        let stall = scope.spawn(|| longest_stall(&stalls.path().join("stall"), &ends));
        let lost = scope.spawn(seconds_behind).join();
        ends.store(true, Ordering::Relaxed);
        (lost.unwrap(), stall.join().unwrap())
    })
}

fn seconds_behind() -> f64 {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let mut settings = Settings::new(&path);
    settings.min_free = 0;
    let recorder = Recorder::start(settings).unwrap();
    let (handle, id) = (recorder.handle(), Arc::from("imu"));
    let (begun, rate_hz) = (Instant::now(), 200);
    // At each sync: bytes that are durable, and samples handed over by then.
    let mut points = vec![(handle.status().synced, 0)];
    let mut k = 0;
    while begun.elapsed() < Duration::from_millis(3500) {
        let due = (begun.elapsed().as_secs_f64() * rate_hz as f64) as u64;
        while k < due {
            let raw = sample(k, rate_hz);
            handle.input(&id, vec![raw]);
            handle.attitude(&id, k, vec![attitude(&raw)]);
            k += 1;
        }
        let status = handle.status();
        if points.last().unwrap().0 != status.synced {
            points.push((status.synced, k));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let status = recorder.finish();
    assert!(
        status.stopped.is_none() && status.unrecorded == 0,
        "{status:?}"
    );
    points.push((status.synced, k));
    assert!(points.len() >= 4, "too few syncs in 3.5 s: {points:?}");
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(status.synced, bytes.len() as u64);
    let mut most = 0.0_f64;
    for pair in points.windows(2) {
        let ((durable, _), (_, handed)) = (pair[0], pair[1]);
        // The power goes just before the next sync is done.
        let copy = dir.path().join("copy.mcap");
        std::fs::write(&copy, &bytes[..durable as usize]).unwrap();
        let (_, [samples, _]) = recovered(&copy);
        let lost = (handed - samples) as f64 / rate_hz as f64;
        eprintln!("cut at {durable}: {lost:.3} s lost");
        most = most.max(lost);
    }
    most
}
