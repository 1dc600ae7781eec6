//! `-o NAME.tum`: the rows that `evo` reads.

use crate::program::strapd;
use std::path::Path;

fn fixture(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name);
    path.display().to_string()
}

/// Stamp in ns, and w, x, y, z, of every row; the translation is nought.
fn rows(file: &Path) -> Vec<(i64, [f64; 4])> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("# timestamp tx ty tz qx qy qz qw"));
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(' ').collect();
            assert_eq!(cells.len(), 8, "{line}");
            assert_eq!(cells[1..4], ["0", "0", "0"]);
            let (sec, nsec) = cells[0].split_once('.').unwrap();
            assert_eq!(nsec.len(), 9, "{line}");
            let stamp = sec.parse::<i64>().unwrap() * 1_000_000_000 + nsec.parse::<i64>().unwrap();
            let [x, y, z, w] = [4, 5, 6, 7].map(|i| cells[i].parse().unwrap());
            (stamp, [w, x, y, z])
        })
        .collect()
}

fn numbers(of: &serde_json::Value) -> (i64, [f64; 4]) {
    let stamp = of["stamp"]["sec"].as_i64().unwrap() * 1_000_000_000
        + of["stamp"]["nsec"].as_i64().unwrap();
    (
        stamp,
        ["w", "x", "y", "z"].map(|c| of["q"][c].as_f64().unwrap()),
    )
}

#[test]
fn a_trajectory_has_the_bits_of_the_lines() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("xsens_mti.mcap");
    let ran = strapd(dir.path(), &format!("replay {log} -o run.tum -o -"));
    let lines: Vec<_> = ran.done().lines().iter().map(numbers).collect();
    assert_eq!(lines.len(), 953);
    assert_eq!(rows(&dir.path().join("run.tum")), lines);
}

#[test]
fn the_trajectory_of_a_simulation_is_the_truth() {
    let dir = tempfile::tempdir().unwrap();
    let ran = strapd(dir.path(), "simulate coning --duration 2 -o truth.tum -o -");
    let all = ran.done().lines();
    let truth: Vec<_> = all
        .iter()
        .filter(|l| l["class"] == "ATT")
        .map(numbers)
        .collect();
    assert!(truth.len() > 100 && truth.len() < all.len());
    assert_eq!(rows(&dir.path().join("truth.tum")), truth);
}
