//! Changed logs through the commands that read one: each ends, in bounded time and memory, without a panic.
//!
//! In a process of its own, whose standard output nobody reads; one thread, so that its time is all there is.

use super::structured::{Changed, Formats};
use super::{asked, mutate, seeds};
use crate::made_databases::database;
use crate::made_logs::{bytes, logged, motion};
use crate::meter::spent;
use clap::Parser;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use strapd_recording::mcap::{MAGIC, op};

/// Bounds of one command for one log of some 10 kB, in a debug build on any machine: processor time, s, and
/// bytes read; they take 5 ms, and read the log a few times.
const SECS: f64 = if cfg!(debug_assertions) { 4.0 } else { 2.0 };
const READ: u64 = 64 << 20;
/// Most memory of the process, MiB: what the largest chunk takes, twice, and the process itself.
const MEMORY: u64 = 400;

/// Every command that reads a log. `out` is where they may write.
const COMMANDS: [&str; 12] = [
    "info LOG",
    "info LOG --json",
    "replay LOG -o OUT.csv --force --topic all",
    "replay LOG -o OUT.mcap --force --copy-input --bias auto --init gravity",
    "replay LOG -o OUT.ndjson --force --regularise-stamps --against-recorded",
    "check LOG",
    "report LOG -o OUT.html --force",
    "cat LOG",
    "compare LOG LOG",
    "allan LOG",
    "recover LOG -o OUT.mcap --force",
    "recover LOG -o OUT.mcap --force --compression none",
];

/// Logs whose every byte counts: without checksums, small, of several kinds.
fn logs() -> Vec<Vec<u8>> {
    let mut samples = motion(40);
    for sample in &mut samples[20..] {
        sample.orientation = Some([1.0, 0.0, 0.0, 0.0]);
    }
    let mut two = logged("/imu/data_raw", &samples);
    two.extend(logged("/other", &samples[..10]));
    let mut logs = seeds("mcap");
    logs.push(bytes(None, 0, &logged("/imu", &samples)));
    logs.push(bytes(None, 0, &two));
    // Its pages are as small as SQLite has them, and one page is above all others.
    let imu = logged("/imu", &samples);
    let rows: Vec<_> = imu
        .iter()
        .map(|m| (0, m.log_time, m.payload.as_slice()))
        .collect();
    logs.push(database(1024, &[("/imu", "sensor_msgs/msg/Imu")], &rows));
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    logs.push(std::fs::read(fixtures.join("gopro_hero6.raw")).unwrap());
    let mut link = std::fs::read(fixtures.join("ardupilot.tlog")).unwrap();
    link.truncate(6000);
    logs.push(link);
    // Tables by columns: of another program each, and one whose checksums do not hide what is behind them.
    let tables = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/parquet");
    for name in ["duckdb_2", "polars", "nulls_2"] {
        logs.push(std::fs::read(tables.join(name).with_extension("parquet")).unwrap());
    }
    // Packed objects between lines.
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/lines/packed");
    logs.push(std::fs::read(kept).unwrap());
    logs
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// Records packed in turn not at all, with zstd and with LZ4: how, and what came of it.
pub(super) fn packed(records: &[u8], packing: usize) -> (&'static str, Vec<u8>) {
    match packing % 3 {
        0 => ("", records.to_vec()),
        1 => ("zstd", zstd::bulk::compress(records, 1).unwrap()),
        _ => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            std::io::Write::write_all(&mut encoder, records).unwrap();
            ("lz4", encoder.finish().unwrap())
        }
    }
}

/// Changed records in a chunk whose checksum is right: what a broken writer makes.
fn in_a_chunk(records: &[u8], packing: usize) -> Vec<u8> {
    let (name, packed) = packed(records, packing);
    let mut body = vec![0; 16];
    body.extend((records.len() as u64).to_le_bytes());
    body.extend(crc32fast::hash(records).to_le_bytes());
    body.extend((name.len() as u32).to_le_bytes());
    body.extend(name.as_bytes());
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(&packed);
    let header = record(op::HEADER, &[0; 8]);
    [&MAGIC[..], &header, &record(op::CHUNK, &body)].concat()
}

/// The records between the header and the end of the data of an unchunked log.
fn data_of(log: &[u8]) -> &[u8] {
    let (mut at, mut from) = (MAGIC.len(), MAGIC.len());
    while let Some(head) = log.get(at..at + 9) {
        let length = u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
        match head[0] {
            op::HEADER => from = at + 9 + length,
            op::DATA_END => break,
            _ => {}
        }
        at = at.saturating_add(9).saturating_add(length);
    }
    log.get(from..at.min(log.len())).unwrap_or(log)
}

/// A number of a file of `/proc`, behind its name.
fn number(file: &str, name: &str) -> u64 {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(name));
    let words = line.and_then(|rest| rest.split_whitespace().next());
    words.and_then(|n| n.parse().ok()).unwrap_or(0)
}

/// Runs `command` as the binary would.
fn run(command: &str, log: &Path, out: &Path) {
    let words = command.split(' ').map(|word| {
        let word = word.replace("LOG", log.to_str().unwrap());
        word.replace("OUT", out.to_str().unwrap())
    });
    let arguments = ["strapd".to_owned(), "--threads".to_owned(), "1".to_owned()];
    let cli = strapd::cli::Cli::try_parse_from(arguments.into_iter().chain(words)).unwrap();
    if let Err(why) = strapd::cli::run(cli) {
        assert!(!why.to_string().is_empty());
    }
}

/// Writes a changed recording, and what is beside it.
fn write(log: &Path, changed: &Changed) {
    std::fs::write(log, &changed.bytes).unwrap();
    let beside = Path::new(&format!("{}-wal", log.display())).to_owned();
    match &changed.wal {
        Some(wal) => std::fs::write(beside, wal).unwrap(),
        None => drop(std::fs::remove_file(beside)),
    }
}

/// Runs as many changed logs as asked for, from the first asked for.
fn work(from: usize, cases: usize) {
    let dir = tempfile::tempdir().unwrap();
    let (log, out) = (dir.path().join("log.mcap"), dir.path().join("out"));
    let (logs, formats) = (logs(), Formats::new());
    let is_one_format = std::env::var("STRAPD_MUTANTS_OF").is_ok();
    let (start, mut slowest, mut reads) = (Instant::now(), 0.0_f64, 0);
    for case in from..from + cases {
        // Each case by itself, so that one can be run again.
        let mut rng = ChaCha8Rng::seed_from_u64(case as u64);
        let whole = &logs[case % logs.len()];
        let other = &logs[rng.random_range(0..logs.len())];
        let changed = match rng.random_range(0..4) {
            _ if is_one_format => formats.change(case, &mut rng),
            0 => {
                let mut records = data_of(whole).to_vec();
                mutate(&mut records, other, &mut rng);
                in_a_chunk(&records, case).into()
            }
            1 => {
                let mut changed = whole.clone();
                mutate(&mut changed, other, &mut rng);
                changed.into()
            }
            _ => formats.change(case, &mut rng),
        };
        write(&log, &changed);
        let command = COMMANDS[rng.random_range(0..COMMANDS.len())];
        let before = (spent().unwrap(), number("/proc/self/io", "rchar: "));
        let outcome = catch_unwind(AssertUnwindSafe(|| run(command, &log, &out)));
        let secs = (spent().unwrap() - before.0).as_secs_f64();
        let read = number("/proc/self/io", "rchar: ") - before.1;
        let memory = number("/proc/self/status", "VmHWM:") >> 10;
        slowest = slowest.max(secs);
        reads = reads.max(read);
        if outcome.is_err() || secs > SECS || read > READ || memory > MEMORY {
            let kept = std::env::temp_dir().join(format!("strapd-mutant-{case}.mcap"));
            write(&kept, &changed);
            panic!(
                "case {case}, strapd {command}: {secs:.2} s, {read} bytes read, {memory} MiB; kept as {}",
                kept.display()
            );
        }
        if (case + 1).is_multiple_of(10_000) {
            eprintln!(
                "{} cases, {:.0} s",
                case + 1 - from,
                start.elapsed().as_secs_f64()
            );
        }
    }
    eprintln!(
        "{cases} changed logs, each through one of {} commands: {:.0} s, the slowest {slowest:.3} s, most read {reads} bytes, {} MiB",
        COMMANDS.len(),
        start.elapsed().as_secs_f64(),
        number("/proc/self/status", "VmHWM:") >> 10
    );
}

const FROM: &str = "STRAPD_MUTANTS_FROM";
const COUNT: &str = "STRAPD_MUTANTS";

#[test]
#[ignore = "run by the other two, in a process whose output nobody reads"]
fn worker() {
    if let Some(cases) = asked(COUNT) {
        work(asked(FROM).unwrap_or(0), cases);
    }
}

/// Runs so many processes, each with its share of the cases from the first asked for.
fn survive(cases: usize, workers: usize) {
    let (first, each) = (asked(FROM).unwrap_or(0), cases.div_ceil(workers));
    let running: Vec<Child> = (0..workers)
        .map(|worker| {
            Command::new(std::env::current_exe().unwrap())
                .args([
                    "--exact",
                    "mutations::commands::worker",
                    "--ignored",
                    "--nocapture",
                ])
                .env(FROM, (first + worker * each).to_string())
                .env(COUNT, each.to_string())
                .stdout(Stdio::null())
                .spawn()
                .unwrap()
        })
        .collect();
    for mut worker in running {
        let ran = worker.wait().unwrap();
        assert!(ran.success(), "{ran}");
    }
}

/// 3 ms each, of a debug build; `.ci/run` and `.ci/full` ask for more.
#[test]
fn changed_logs_harm_no_command() {
    survive(asked(COUNT).unwrap_or(1_500), 1);
}

#[test]
#[ignore = "long: a million changed logs, an hour of two cores when optimised"]
fn a_million_changed_logs_harm_no_command() {
    survive(asked(COUNT).unwrap_or(1_000_000), 2);
}
