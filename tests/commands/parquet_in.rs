//! Tables in Parquet as recordings: the bits of the same table as text, whoever wrote it, and of damaged ones what is
//! whole.

use crate::program::{Ran, strapd, strapd_fed};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Tables by pyarrow, polars and DuckDB (`tests/oracles/parquet_tables.py`), 60 rows each.
fn tables() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/parquet");
    let mut all: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    all.sort();
    all
}

fn seed(name: &str) -> Vec<u8> {
    let all = tables();
    let path = all.iter().find(|path| path.file_stem().unwrap() == name);
    std::fs::read(path.unwrap()).unwrap()
}

/// The same numbers as text, by the formula of that program.
fn as_text(has_gaps: bool) -> String {
    let mut text = "stamp [ns],gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n".to_owned();
    for n in 0..60i64 {
        let stamp = 1_700_000_000_000_000_000 + n * 5_000_000 + (n * 7919 % 1000) * 1000;
        write!(text, "{stamp}").unwrap();
        for column in 0..6i64 {
            let number = ((n * 7919 + column * 104_729) % 2001 - 1000) as f64 / 4096.0;
            let number = number + if column == 5 { 9.0 } else { 0.0 };
            match has_gaps && column >= 3 && n % 10 == 3 {
                true => text.push(','),
                false => write!(text, ",{number:?}").unwrap(),
            }
        }
        text.push('\n');
    }
    text
}

fn bench() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("whole.csv"), as_text(false)).unwrap();
    std::fs::write(dir.path().join("nulls.csv"), as_text(true)).unwrap();
    dir
}

fn samples(at: &Path, file: &str) -> String {
    let ran = strapd(at, &format!("cat {file} --format csv"));
    ran.done().out.clone()
}

#[test]
fn tables_of_pyarrow_polars_and_duckdb_have_the_bits_of_the_text() {
    let dir = bench();
    let at = dir.path();
    let (whole, gaps) = (samples(at, "whole.csv"), samples(at, "nulls.csv"));
    assert_eq!((whole.lines().count(), gaps.lines().count()), (61, 61));
    assert_ne!(whole, gaps);
    let all = tables();
    assert_eq!(all.len(), 23);
    for path in all {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let expected = if name.starts_with("nulls") {
            &gaps
        } else {
            &whole
        };
        assert_eq!(
            &samples(at, &path.display().to_string()),
            expected,
            "{name}"
        );
    }
}

#[test]
fn every_command_takes_one_from_a_file_and_from_a_pipe() {
    let dir = bench();
    let at = dir.path();
    std::fs::write(at.join("t.parquet"), seed("arrow_zstd_2")).unwrap();
    strapd(at, "replay whole.csv -o whole.att.csv -q").done();
    strapd(at, "replay t.parquet -o file.csv -q").done();
    strapd_fed(at, "replay - -o pipe.csv -q", seed("arrow_zstd_2")).done();
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    assert_eq!(read("file.csv"), read("whole.att.csv"));
    assert_eq!(read("pipe.csv"), read("whole.att.csv"));
    let info = strapd(at, "info t.parquet");
    assert!(
        info.done().out.contains("60 samples of 1 sensors; Parquet"),
        "{info:?}"
    );
    let read_as = "read as --columns '";
    let said = info
        .out
        .split_once(read_as)
        .unwrap()
        .1
        .split_once('\'')
        .unwrap()
        .0;
    // What it says can be pasted.
    let pasted = at.join("pasted.csv");
    let columns = said.replace(' ', "\\ ");
    let ran = std::process::Command::new(env!("CARGO_BIN_EXE_strapd"))
        .current_dir(at)
        .env("STRAPD_AID", "none")
        .args([
            "replay",
            "t.parquet",
            "-q",
            "-o",
            "pasted.csv",
            "--columns",
            said,
        ])
        .output()
        .unwrap();
    assert!(ran.status.success(), "{columns}: {ran:?}");
    assert_eq!(
        std::fs::read_to_string(pasted).unwrap(),
        read("whole.att.csv")
    );
    for command in [
        "check",
        "allan",
        "report -o r.html --force",
        "calibrate -o c.toml --force",
    ] {
        let (mut one, mut other) = (String::new(), String::new());
        for (file, out) in [("t.parquet", &mut one), ("whole.csv", &mut other)] {
            let ran = strapd(at, &format!("{command} {file}"));
            let text = format!("{:?} {}{}", ran.code, ran.out, ran.err).replace(file, "FILE");
            *out = text.replace("Parquet", "CSV");
        }
        let body = |text: &str| text.lines().next().unwrap_or_default().to_owned();
        assert_eq!(body(&one), body(&other), "{command}");
    }
    // The name of an index, a number of a column, and a column there is none of.
    std::fs::write(at.join("n.parquet"), seed("arrow_nested")).unwrap();
    let by_name = "--columns gyro=gyro.x:gyro.y:gyro.z,stamp=1:ns";
    let named = strapd(at, &format!("cat n.parquet --format csv {by_name}"));
    assert_eq!(named.done().out, samples(at, "n.parquet"));
    strapd(
        at,
        "replay n.parquet --columns gyro=a:b:c,stamp=1:ns -o null:",
    )
    .refused(1, &["n.parquet", "`a`"]);
    strapd(at, "replay n.parquet --field gyro=gyro -o null:").refused(1, &["--columns"]);
}

fn lost(ran: &Ran) -> u64 {
    let text = &ran.out;
    let at = text
        .find(" undecodable")
        .unwrap_or_else(|| panic!("{text}"));
    let word = text[..at]
        .rsplit(|c: char| !c.is_ascii_digit())
        .next()
        .unwrap();
    word.parse().unwrap()
}

#[test]
fn a_damaged_page_costs_its_rows_which_are_counted() {
    let dir = bench();
    let at = dir.path();
    let whole = seed("arrow_checksums");
    std::fs::write(at.join("good.parquet"), &whole).unwrap();
    let unharmed = samples(at, "good.parquet");
    // Wherever a byte of the pages is another, rows are lost and said, or the checksum is of no page that is read.
    // The index itself has none.
    let size: [u8; 4] = whole[whole.len() - 8..][..4].try_into().unwrap();
    let pages = whole.len() - 8 - u32::from_le_bytes(size) as usize;
    let mut seen = 0;
    for place in (40..pages).step_by(97) {
        let mut bytes = whole.clone();
        bytes[place] ^= 0x40;
        std::fs::write(at.join("bad.parquet"), &bytes).unwrap();
        let ran = strapd(at, "replay bad.parquet -o null:");
        match ran.code {
            // It was of no page that is read.
            Some(0) => assert_eq!(samples(at, "bad.parquet"), unharmed, "{place}"),
            Some(3) => {
                assert!((1..60).contains(&lost(&ran)), "{place}: {}", ran.out);
                assert!(ran.out.contains("lost: column "), "{place}: {}", ran.out);
                seen += 1;
            }
            _ => panic!("{place}: {ran:?}"),
        }
    }
    assert!(seen > 10, "{seen}");
    // The index stands at the end.
    for cut in [whole.len() - 1, whole.len() / 2, 4] {
        std::fs::write(at.join("cut.parquet"), &whole[..cut]).unwrap();
        let words = ["cut.parquet", "its index stands at its end", "MCAP"];
        strapd(at, "replay cut.parquet -o null:").refused(1, &words);
    }
}

/// Thrift's compact protocol, as far as is needed: numbers and structures of fields whose ids rise by less than 16.
struct Thrift(Vec<u8>);

impl Thrift {
    fn varint(&mut self, mut n: u64) {
        while n > 127 {
            self.0.push(n as u8 | 128);
            n >>= 7;
        }
        self.0.push(n as u8);
    }

    fn number(mut self, step: u8, n: i64) -> Thrift {
        self.0.push(step << 4 | 6);
        self.varint((n << 1) as u64);
        self
    }

    fn text(mut self, step: u8, text: &str) -> Thrift {
        self.0.push(step << 4 | 8);
        self.varint(text.len() as u64);
        self.0.extend_from_slice(text.as_bytes());
        self
    }

    fn inside(mut self, step: u8, of: Thrift) -> Thrift {
        self.0.push(step << 4 | 12);
        self.0.extend(of.0);
        self.0.push(0);
        self
    }

    fn list(mut self, step: u8, all: Vec<Thrift>) -> Thrift {
        self.0.extend([step << 4 | 9, 0xfc]);
        self.varint(all.len() as u64);
        for one in all {
            self.0.extend(one.0);
            self.0.push(0);
        }
        self
    }
}

fn new() -> Thrift {
    Thrift(Vec::new())
}

/// A table of `stamp_ns`, `gyro_x`, `gyro_y`, `gyro_z`, whose columns all have the one page `body` behind `head`.
fn table(rows: i64, codec: i64, head: Thrift, body: &[u8]) -> Vec<u8> {
    let page = [&head.0[..], &[0], body].concat();
    table_of_groups(rows, codec, &[page])
}

/// The same of several groups of rows, each with its page.
fn table_of_groups(rows: i64, codec: i64, pages: &[Vec<u8>]) -> Vec<u8> {
    table_that_states(&vec![rows; pages.len()], rows, codec, pages)
}

/// The same of groups that state so many rows each, and of columns that state `rows`.
fn table_that_states(of_groups: &[i64], rows: i64, codec: i64, pages: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = b"PAR1".to_vec();
    let mut schema = vec![new().text(4, "schema").number(1, 4)];
    let names = ["stamp_ns", "gyro_x", "gyro_y", "gyro_z"];
    for name in names {
        let kind = if name == "stamp_ns" { 2 } else { 5 };
        schema.push(new().number(1, kind).number(2, 0).text(1, name));
    }
    let mut groups = Vec::new();
    for (page, stated) in pages.iter().zip(of_groups) {
        let about = || {
            new()
                .number(4, codec)
                .number(1, rows)
                .number(2, page.len() as i64)
                .number(2, bytes.len() as i64)
        };
        let chunks = names.map(|_| new().inside(3, about())).into();
        groups.push(new().list(1, chunks).number(2, *stated));
        bytes.extend(page);
    }
    let all = rows.saturating_mul(pages.len() as i64);
    let footer = new()
        .number(1, 1)
        .list(1, schema)
        .number(1, all)
        .list(1, groups);
    let size = footer.0.len() as u32 + 1;
    bytes.extend(footer.0);
    bytes.push(0);
    bytes.extend(size.to_le_bytes());
    bytes.extend(b"PAR1");
    bytes
}

fn page(unpacked: i64, packed: usize, rows: i64, encoding: i64) -> Thrift {
    let data = new()
        .number(1, rows)
        .number(1, encoding)
        .number(1, 3)
        .number(1, 3);
    new()
        .number(1, 0)
        .number(1, unpacked)
        .number(1, packed as i64)
        .inside(2, data)
}

/// Page of the group with this number: a hundred rows, 5 ms apart, that go on from the group before.
fn group(nth: i64) -> Vec<u8> {
    let stamps = (1..=100).flat_map(|n| ((nth * 100 + n) * 5_000_000).to_le_bytes());
    [page(800, 800, 100, 0).0, vec![0], stamps.collect()].concat()
}

#[test]
fn a_damaged_group_of_rows_costs_its_own_rows_whichever_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for damaged in 0..3 {
        let mut pages: Vec<Vec<u8>> = (0..3).map(group).collect();
        pages[damaged][..8].fill(0xff);
        std::fs::write(at.join("d.parquet"), table_of_groups(100, 0, &pages)).unwrap();
        let ran = strapd(at, "replay d.parquet -o null:");
        assert_eq!((ran.code, lost(&ran)), (Some(3), 100), "{damaged}: {ran:?}");
        let kept = strapd(at, "cat d.parquet --format csv");
        let rows = kept.out.lines().count();
        assert_eq!((kept.code, rows), (Some(3), 201), "{damaged}: {kept:?}");
        // Where the lines are is said of the file.
        assert!(
            ran.out.contains("header is damaged"),
            "{damaged}: {}",
            ran.out
        );
    }
    // Of none is anything known.
    let mut pages: Vec<Vec<u8>> = (0..2).map(group).collect();
    for page in &mut pages {
        page[..8].fill(0xff);
    }
    std::fs::write(at.join("d.parquet"), table_of_groups(100, 0, &pages)).unwrap();
    let words = ["none of its first rows could be read", "header is damaged"];
    strapd(at, "replay d.parquet -o null:").refused(1, &words);
}

#[test]
fn rows_that_no_column_has_are_not_lost() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let pages: Vec<Vec<u8>> = (0..2).map(group).collect();
    // One changed byte of the index made 16 million lost rows of sixty, and eight seconds of 260 kB.
    for stated in [1 << 20, 101, 99] {
        let bytes = table_that_states(&[100, stated], 100, 0, &pages);
        std::fs::write(at.join("m.parquet"), bytes).unwrap();
        let ran = strapd(at, "replay m.parquet -o null:");
        assert_eq!(
            (ran.code, lost(&ran)),
            (Some(3), stated.min(100) as u64),
            "{ran:?}"
        );
        assert!(
            ran.out.contains("more or fewer values than rows"),
            "{ran:?}"
        );
    }
}

#[test]
fn what_promises_the_world_is_refused_or_lost_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let plain: Vec<u8> = (1..=16i64)
        .flat_map(|n| (n * 5_000_000).to_le_bytes())
        .collect();
    let good = table(16, 0, page(128, 128, 16, 0), &plain);
    std::fs::write(at.join("t.parquet"), good).unwrap();
    assert_eq!(samples(at, "t.parquet").lines().count(), 17);
    let zeros = zstd::bulk::compress(&vec![0; 60 << 20], 1).unwrap();
    let claims: [(&str, Vec<u8>, &str); 7] = [
        (
            "rows",
            table(1 << 31, 0, page(128, 128, 1 << 31, 0), &plain),
            "2147483648 rows",
        ),
        (
            "values",
            table(1 << 20, 0, page(128, 128, 1 << 20, 0), &plain),
            "values end too early",
        ),
        (
            "longer",
            table(16, 0, page(128, 1 << 30, 16, 0), &plain),
            "longer than its column",
        ),
        (
            "bomb",
            table(16, 6, page(128, zeros.len(), 16, 0), &zeros),
            "zstd",
        ),
        (
            "room",
            table(16, 6, page(1 << 40, zeros.len(), 16, 0), &zeros),
            "over the limit",
        ),
        (
            "run",
            table(16, 0, page(6, 6, 16, 8), &[32, 255, 255, 255, 255, 15]),
            "dictionary",
        ),
        (
            "more",
            table(16, 0, page(128, 128, 17, 0), &plain),
            "more rows than there are",
        ),
    ];
    for (what, bytes, words) in claims {
        std::fs::write(at.join("t.parquet"), bytes).unwrap();
        let begun = std::time::Instant::now();
        let ran = strapd(at, "replay t.parquet -o null:");
        assert!(
            ran.code == Some(1) && ran.err.contains(words),
            "{what}: {ran:?}"
        );
        assert!(
            begun.elapsed().as_secs() < 20,
            "{what}: {:?}",
            begun.elapsed()
        );
    }
    std::fs::write(at.join("t.parquet"), b"PAR1xxxx\x08\0\0\0PARE").unwrap();
    strapd(at, "info t.parquet").refused(1, &["an encrypted Parquet file"]);
}

#[test]
fn what_strapd_wrote_is_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(
        at,
        "simulate coning --duration 2 -q -o s.parquet -o s.csv --sample-kind average",
    )
    .done();
    assert_eq!(samples(at, "s.parquet"), samples(at, "s.csv"));
    strapd(at, "replay s.parquet -q -o p.parquet -o p.csv").done();
    strapd(at, "replay s.csv -q -o c.csv").done();
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    assert_eq!(read("p.csv"), read("c.csv"));
    let compared = strapd(at, "compare p.parquet p.csv");
    let same = strapd(at, "compare p.csv p.csv");
    let first = |ran: &Ran| {
        ran.done()
            .out
            .lines()
            .take(4)
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_eq!(first(&compared).replace("p.parquet", "p.csv"), first(&same));
    // In another world, too.
    strapd(at, "replay s.csv -q --world ned -o n.parquet -o n.csv").done();
    let ned = strapd(at, "compare n.parquet n.csv");
    let same = strapd(at, "compare n.csv n.csv");
    assert_eq!(first(&ned).replace("n.parquet", "n.csv"), first(&same));
    let ran = strapd(at, "replay p.parquet -o null:");
    assert!(ran.done().out.contains("and no recording"), "{}", ran.out);
    let ran = strapd(at, "replay s.parquet p.parquet -o null:");
    assert!(ran.err.contains("p.parquet: left out"), "{ran:?}");
}
