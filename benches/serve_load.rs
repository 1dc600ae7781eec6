//! Speed and latency of `strapd serve`: a bounded load on a daemon of its own, over TCP on
//! loopback. The figures stand in `docs/performance.md`, "Serving".
//!
//! `cargo bench --bench serve_load -- [SECONDS] [CASE]...`; cases by name, default all. From a minute on the
//! paced cases also tell whether memory and open files grow: `-- 600 P1` is the soak. Latency is from
//! just before a line is written to just after its attitude was read, on the same machine, whose
//! cores the generator shares with the daemon.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::packed::{self, Form};

/// Name, publishers, samples a second of each, subscribers, subscribers that never read.
const PACED: [(&str, usize, u64, usize, usize); 5] = [
    ("P1", 8, 1000, 1, 0),
    ("P2", 16, 1000, 1, 0),
    ("P3", 4, 1000, 8, 0),
    ("M3", 8, 1000, 1, 1),
    ("M4", 8, 1000, 8, 50),
];

/// Seconds from which on a paced case is a soak.
const SOAK: u64 = 60;

struct Daemon {
    child: Child,
    address: SocketAddr,
}

impl Daemon {
    fn start() -> Daemon {
        let mut child = Command::new(env!("CARGO_BIN_EXE_strapd"))
            .args(["serve", "--listen", "tcp-listen://127.0.0.1:0"])
            .args(["--log-format", "json"])
            // The gyro alone, as ever: figures are compared with older ones.
            .env("STRAPD_AID", "none")
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stderr.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        let said: serde_json::Value = serde_json::from_str(&line).unwrap();
        let ready = said["fields"]["message"].as_str().unwrap();
        let address = ready.rsplit_once("//").unwrap().1.parse().unwrap();
        Daemon { child, address }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_nodelay(true).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(5)))
            .unwrap();
        stream
    }

    /// Resident KiB.
    fn rss(&self) -> u64 {
        let path = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(path).unwrap();
        let line = status.lines().find(|l| l.starts_with("VmRSS")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    }

    /// Open files.
    fn files(&self) -> usize {
        std::fs::read_dir(format!("/proc/{}/fd", self.child.id()))
            .unwrap()
            .count()
    }

    /// Seconds of both cores so far.
    fn cpu_secs(&self) -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).unwrap();
        let after: Vec<&str> = stat.rsplit_once(") ").unwrap().1.split(' ').collect();
        (after[11].parse::<f64>().unwrap() + after[12].parse::<f64>().unwrap()) / 100.0
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        // It has nothing to save.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn push_line(out: &mut Vec<u8>, publisher: usize, n: u64, step: u64) {
    let nanos = n * step;
    let x = (n as f64 * 1e-3).sin();
    writeln!(
        out,
        "{{\"class\":\"RATE\",\"id\":\"p{publisher}\",\"seq\":{n},\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"gyro\":[{x:.6},0.1,-0.2]}}",
        1_700_000_000 + nanos / 1_000_000_000,
        nanos % 1_000_000_000
    )
    .unwrap();
}

/// The sample of [`push_line`], packed.
fn push_packed(out: &mut Vec<u8>, publisher: usize, n: u64, step: u64) {
    let sample = RawSample {
        header: Some(Nanos((1_700_000_000_000_000_000 + n * step) as i64)),
        gyro: Some([(n as f64 * 1e-3).sin(), 0.1, -0.2]),
        ..RawSample::default()
    };
    packed::push_sample(out, publisher as u32, n, &sample);
}

/// Account of what a subscriber has seen.
#[derive(Default)]
struct Seen {
    attitudes: u64,
    dropped: u64,
    /// Nanoseconds.
    latencies: Vec<u64>,
}

/// The number after `key`, in a line whose keys stand in a fixed order.
fn number(line: &[u8], key: &[u8]) -> Option<u64> {
    let at = line.windows(key.len()).position(|w| w == key)? + key.len();
    let digits = line[at..].iter().take_while(|b| b.is_ascii_digit());
    Some(digits.fold(0, |n, b| n * 10 + u64::from(b - b'0')))
}

/// Reads until `done` and nothing more comes.
fn subscribe(
    stream: TcpStream,
    start: Instant,
    sent: &[Vec<AtomicU64>],
    done: &AtomicBool,
) -> Seen {
    stream
        .set_read_timeout(Some(Duration::from_millis(500)))
        .unwrap();
    let mut seen = Seen::default();
    let mut reader = BufReader::with_capacity(256 << 10, stream);
    let mut line = Vec::new();
    loop {
        match reader.read_until(b'\n', &mut line) {
            Ok(0) => return seen,
            Ok(_) if line.starts_with(b"{\"class\":\"ATT\"") => {
                seen.attitudes += 1;
                if !sent.is_empty() {
                    let now = start.elapsed().as_nanos() as u64;
                    let publisher = number(&line, b"\"id\":\"p").unwrap() as usize;
                    let seq = number(&line, b"\"seq\":").unwrap() as usize;
                    let at = sent[publisher][seq].load(Ordering::Relaxed);
                    seen.latencies.push(now - at);
                }
            }
            Ok(_) => {
                if line.windows(5).any(|w| w == b"\"GAP\"") {
                    seen.dropped += number(&line, b"\"dropped\":").unwrap();
                }
            }
            Err(_) if done.load(Ordering::Relaxed) => return seen,
            // A timeout keeps what was read of a line.
            Err(_) => continue,
        }
        line.clear();
    }
}

/// The same of packed attitudes, of which only the heads are looked at.
fn subscribe_packed(mut stream: TcpStream, done: &AtomicBool) -> Seen {
    stream
        .set_read_timeout(Some(Duration::from_millis(500)))
        .unwrap();
    let mut seen = Seen::default();
    let mut buffer = vec![0; 256 << 10];
    let mut have = 0;
    loop {
        match stream.read(&mut buffer[have..]) {
            Ok(0) => return seen,
            Ok(n) => have += n,
            Err(_) if done.load(Ordering::Relaxed) => return seen,
            Err(_) => continue,
        }
        let mut rest = &buffer[..have];
        while !rest.is_empty() {
            let end = if packed::is_packed(rest) {
                packed::length(rest)
            } else {
                rest.iter().position(|b| *b == b'\n').map(|n| n + 1)
            };
            let Some((item, after)) = end.and_then(|n| rest.split_at_checked(n)) else {
                break;
            };
            if packed::is_packed(item) {
                seen.attitudes += 1;
            } else if item.windows(5).any(|w| w == b"\"GAP\"") {
                seen.dropped += number(item, b"\"dropped\":").unwrap();
            }
            rest = after;
        }
        let left = rest.len();
        buffer.copy_within(have - left..have, 0);
        have = left;
    }
}

fn watch(daemon: &Daemon) -> TcpStream {
    watch_as(daemon, Form::Lines)
}

fn watch_as(daemon: &Daemon, form: Form) -> TcpStream {
    let stream = daemon.connect();
    let request: &[u8] = match form {
        Form::Lines => b"{\"class\":\"WATCH\"}\n",
        Form::Packed => b"{\"class\":\"WATCH\",\"packed\":true}\n",
    };
    (&stream).write_all(request).unwrap();
    // One byte of the greeting: the daemon is there.
    let mut byte = [0];
    (&stream).read_exact(&mut byte).unwrap();
    stream
}

fn paced(name: &str, publishers: usize, hz: u64, subscribers: usize, stalled: usize, secs: u64) {
    let daemon = Daemon::start();
    let start = Instant::now();
    let total = hz * secs;
    let sent: Arc<Vec<Vec<AtomicU64>>> = Arc::new(
        (0..publishers)
            .map(|_| (0..total).map(|_| AtomicU64::new(0)).collect())
            .collect(),
    );
    let done = Arc::new(AtomicBool::new(false));
    let _stalled: Vec<TcpStream> = (0..stalled).map(|_| watch(&daemon)).collect();
    let readers: Vec<_> = (0..subscribers)
        .map(|_| {
            let (stream, sent, done) = (watch(&daemon), sent.clone(), done.clone());
            std::thread::spawn(move || subscribe(stream, start, &sent, &done))
        })
        .collect();
    std::thread::sleep(Duration::from_millis(200));
    let before = daemon.cpu_secs();
    let begin = Instant::now() + Duration::from_millis(50);
    let writers: Vec<_> = (0..publishers)
        .map(|publisher| {
            let (stream, sent) = (daemon.connect(), sent.clone());
            std::thread::spawn(move || {
                let mut line = Vec::new();
                for n in 0..total {
                    // Spread over the period, as sensors are that know nothing of each other.
                    let due = begin
                        + Duration::from_nanos(
                            (n * publishers as u64 + publisher as u64) * 1_000_000_000
                                / (hz * publishers as u64),
                        );
                    if let Some(wait) = due.checked_duration_since(Instant::now()) {
                        std::thread::sleep(wait);
                    }
                    line.clear();
                    push_line(&mut line, publisher, n, 1_000_000_000 / hz);
                    sent[publisher][n as usize]
                        .store(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
                    (&stream).write_all(&line).unwrap();
                }
            })
        })
        .collect();
    // Memory and files every second, the first fifth left out: buffers are made there.
    let mut levels: Vec<(f64, f64, usize)> = Vec::new();
    while writers.iter().any(|w| !w.is_finished()) {
        std::thread::sleep(Duration::from_millis(10));
        let now = begin.elapsed().as_secs_f64();
        let last = levels.last().map_or(secs as f64 / 5.0, |(t, ..)| t + 1.0);
        if secs >= SOAK && now >= last {
            levels.push((now, daemon.rss() as f64, daemon.files()));
        }
    }
    let took = begin.elapsed().as_secs_f64();
    for writer in writers {
        writer.join().unwrap();
    }
    done.store(true, Ordering::Relaxed);
    let seen: Vec<Seen> = readers.into_iter().map(|r| r.join().unwrap()).collect();
    let cpu = daemon.cpu_secs() - before;
    let expected = publishers as u64 * total * subscribers as u64;
    let got: u64 = seen.iter().map(|s| s.attitudes).sum();
    let mut all: Vec<u64> = seen.into_iter().flat_map(|s| s.latencies).collect();
    all.sort_unstable();
    let at = |share: f64| {
        let index = ((all.len() as f64 * share) as usize).min(all.len().saturating_sub(1));
        all.get(index).map_or(f64::NAN, |n| *n as f64 * 1e-6)
    };
    println!(
        "| {name}: {publishers} x {hz} Hz -> {subscribers}{} | {:.0} | {} | {:.3} | {:.2} | {:.2} | {:.2} | {:.1} | {} |",
        if stalled > 0 {
            format!(" + {stalled} stalled")
        } else {
            String::new()
        },
        got as f64 / took,
        expected - got,
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0),
        cpu / took * 100.0,
        daemon.rss(),
    );
    soaked(&levels);
}

/// Prints how memory and open files went: the slope of a straight line through all.
fn soaked(levels: &[(f64, f64, usize)]) {
    let (Some(first), Some(last)) = (levels.first(), levels.last()) else {
        return;
    };
    let n = levels.len() as f64;
    let mean = |f: fn(&(f64, f64, usize)) -> f64| levels.iter().map(f).sum::<f64>() / n;
    let (t, rss) = (mean(|l| l.0), mean(|l| l.1));
    let above: f64 = levels.iter().map(|l| (l.0 - t) * (l.1 - rss)).sum();
    let below: f64 = levels.iter().map(|l| (l.0 - t) * (l.0 - t)).sum();
    let most = levels.iter().map(|l| l.1).fold(0.0, f64::max);
    println!(
        "  from {:.0} s to {:.0} s: {:.0} to {:.0} KiB resident, at most {most:.0}, {:+.2} KiB a minute; {} to {} files open",
        first.0,
        last.0,
        first.1,
        last.1,
        above / below * 60.0,
        first.2,
        last.2
    );
}

fn saturated(name: &str, form: Form, publishers: usize, subscribers: usize, secs: u64) {
    let daemon = Daemon::start();
    let start = Instant::now();
    let done = Arc::new(AtomicBool::new(false));
    let readers: Vec<_> = (0..subscribers)
        .map(|_| {
            let (stream, done) = (watch_as(&daemon, form), done.clone());
            std::thread::spawn(move || match form {
                Form::Lines => subscribe(stream, start, &[], &done),
                Form::Packed => subscribe_packed(stream, &done),
            })
        })
        .collect();
    // Samples made beforehand: the generator must not be what is measured.
    let per_block = 50_000;
    let begin = Instant::now();
    let writers: Vec<_> = (0..publishers)
        .map(|publisher| {
            let stream = daemon.connect();
            std::thread::spawn(move || {
                let mut block = Vec::new();
                let mut n = 0;
                if form == Form::Packed {
                    let binding = format!(
                        "{{\"class\":\"PACKED\",\"stream\":{publisher},\"id\":\"p{publisher}\"}}\n"
                    );
                    (&stream).write_all(binding.as_bytes()).unwrap();
                }
                let mut busy = Duration::ZERO;
                while busy.as_secs() < secs {
                    block.clear();
                    for k in n..n + per_block {
                        match form {
                            Form::Lines => push_line(&mut block, publisher, k, 1_000_000),
                            Form::Packed => push_packed(&mut block, publisher, k, 1_000_000),
                        }
                    }
                    n += per_block;
                    let from = Instant::now();
                    (&stream).write_all(&block).unwrap();
                    busy += from.elapsed();
                }
                // An answer to a question that comes after them: all were taken.
                (&stream).write_all(b"{\"class\":\"POLL\"}\n").unwrap();
                let mut answer = BufReader::new(&stream);
                let mut line = String::new();
                while !line.contains("\"STATUS\"") {
                    line.clear();
                    answer.read_line(&mut line).unwrap();
                }
                (n, busy.as_secs_f64())
            })
        })
        .collect();
    let sent: Vec<(u64, f64)> = writers.into_iter().map(|w| w.join().unwrap()).collect();
    let took = begin.elapsed().as_secs_f64();
    done.store(true, Ordering::Relaxed);
    let seen: Vec<Seen> = readers.into_iter().map(|r| r.join().unwrap()).collect();
    let samples: u64 = sent.iter().map(|(n, _)| n).sum();
    let while_writing: f64 = sent.iter().map(|(n, busy)| *n as f64 / busy).sum();
    let got: u64 = seen.iter().map(|s| s.attitudes).sum();
    let dropped: u64 = seen.iter().map(|s| s.dropped).sum();
    println!(
        "| {name}: {publishers} as fast as they can -> {subscribers} | {:.0} | {while_writing:.0} | {:.0} | {dropped} | {} | {:.2} | {} |",
        samples as f64 / took,
        got as f64 / took,
        samples * subscribers as u64 - got - dropped,
        daemon.cpu_secs() / samples as f64 * 1e6,
        daemon.rss(),
    );
}

fn idle() {
    let daemon = Daemon::start();
    let before = daemon.rss();
    let connections: Vec<TcpStream> = (0..250).map(|_| watch(&daemon)).collect();
    std::thread::sleep(Duration::from_millis(300));
    let after = daemon.rss();
    println!(
        "M1: {before} KiB at start, {after} KiB with {} watching and idle: {:.1} KiB each",
        connections.len(),
        (after - before) as f64 / connections.len() as f64
    );
}

fn main() {
    let args: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let secs = args.iter().find_map(|a| a.parse().ok()).unwrap_or(5);
    let names: Vec<&String> = args.iter().filter(|a| a.parse::<u64>().is_err()).collect();
    let wanted = |name: &str| names.is_empty() || names.iter().any(|n| *n == name);
    if wanted("M1") {
        idle();
    }
    println!(
        "\n| publishers x rate -> subscribers | attitudes/s | lost | p50 ms | p99 | p99.9 | max | % of a core | RSS KiB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, publishers, hz, subscribers, stalled) in PACED {
        if wanted(name) {
            paced(name, publishers, hz, subscribers, stalled, secs);
        }
    }
    println!(
        "\n| saturation | samples/s in | while writing | attitudes/s out | in GAP | unexplained | us of CPU a sample | RSS KiB |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (publishers, subscribers) in [(4, 0), (4, 1), (1, 1)] {
        if wanted("P4") {
            saturated("P4", Form::Lines, publishers, subscribers, secs);
        }
    }
    for (publishers, subscribers) in [(4, 0), (4, 1)] {
        if wanted("P4P") {
            saturated("P4P", Form::Packed, publishers, subscribers, secs);
        }
    }
}
