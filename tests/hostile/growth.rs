//! Promise: the work of every parser grows as its input does. Twice the input costs at most twice the
//! instructions, whatever it is made of, as counted by valgrind: time would tell of the machine as well.
//!
//! ```text
//! cargo test --test hostile -- --ignored
//! ```

mod inputs;

use inputs::{CASES, Case};
use std::path::Path;
use std::process::Command;

/// Lengths of inputs, bytes.
const LENGTHS: [usize; 3] = [16_000, 32_000, 64_000];

/// Cost of a parser's setup beside its input: buffers, tables of names, the first use of a schema.
const CONSTANT: u64 = 300_000;

/// Twice, and what a search in a sorted table of twice the size takes longer (a part in 14 here), and the steps in
/// which memory grows.
const FACTOR: f64 = 2.3;

/// Parses what is counted: valgrind finds it by this name.
#[inline(never)]
fn counted_parse(parse: fn(&[u8]), input: &[u8]) {
    parse(std::hint::black_box(input));
    std::hint::black_box(());
}

/// Makes the input, whose making is counted apart.
#[inline(never)]
fn made_input(case: &Case, length: usize) -> Vec<u8> {
    std::hint::black_box((case.input)(length))
}

#[test]
#[ignore = "run by the other test, under valgrind"]
fn workload() {
    let asked = std::env::var("STRAPD_GROWTH").unwrap_or_default();
    for case in CASES
        .iter()
        .filter(|c| asked.is_empty() || c.name.contains(&asked))
    {
        // What is made once for the process is not the input's.
        (case.parse)(&(case.input)(200));
        for length in LENGTHS {
            let input = made_input(case, length);
            assert!(
                input.len() * 10 > length * 7 && input.len() < length * 13 / 10,
                "{}",
                case.name
            );
            counted_parse(case.parse, &input);
        }
    }
}

/// Instructions of each call of [`counted_parse`] in a run of [`workload`], in order.
fn instructions(dir: &Path) -> Vec<u64> {
    let ran = Command::new("valgrind")
        .arg("--tool=callgrind")
        .arg(format!(
            "--callgrind-out-file={}",
            dir.join("out").display()
        ))
        .args(["--dump-after=*made_input*", "--dump-after=*counted_parse*"])
        .arg(std::env::current_exe().unwrap())
        .args([
            "--exact",
            "growth::workload",
            "--ignored",
            "--nocapture",
            "--test-threads=1",
        ])
        .output()
        .expect("valgrind is absent: `apt-get install valgrind`");
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
    (1..)
        .map_while(|n| std::fs::read_to_string(dir.join(format!("out.{n}"))).ok())
        .filter(|dump| {
            let mut lines = dump
                .lines()
                .filter(|line| line.contains("Trigger: --dump-after="));
            lines.any(|line| line.contains("counted_parse"))
        })
        .map(|dump| {
            let total = dump.lines().find_map(|line| line.strip_prefix("totals: "));
            total.unwrap().trim().parse().unwrap()
        })
        .collect()
}

#[test]
#[ignore = "counts instructions under valgrind; .ci/run does it on its own"]
fn twice_the_input_is_at_most_twice_the_work() {
    let dir = tempfile::tempdir().unwrap();
    let counts = instructions(dir.path());
    let asked = std::env::var("STRAPD_GROWTH").unwrap_or_default();
    let cases: Vec<&Case> = CASES
        .iter()
        .filter(|c| asked.is_empty() || c.name.contains(&asked))
        .collect();
    assert_eq!(counts.len(), cases.len() * LENGTHS.len());
    let mut wrong = Vec::new();
    for (case, counts) in cases.iter().zip(counts.chunks(LENGTHS.len())) {
        let most = |before: u64| (FACTOR * before as f64) as u64 + CONSTANT;
        let grows = counts.windows(2).any(|pair| pair[1] > most(pair[0]));
        let per_byte = counts[2] as f64 / LENGTHS[2] as f64;
        eprintln!(
            "{:<44} {counts:?} {per_byte:.0} a byte{}",
            case.name,
            if grows { "  GROWS" } else { "" }
        );
        if grows {
            wrong.push(case.name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
