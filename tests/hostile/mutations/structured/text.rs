//! Tables and NDJSON: other numbers, names, cells and lines.

use super::{Changed, rearrange};
use crate::mutations::seeds;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Numbers that are hard to take, and what is none.
const CELLS: [&str; 24] = [
    "0",
    "-0.0",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "18446744073709551616",
    "-9223372036854775808",
    "1700000000",
    "1700000000000000000",
    "1e18",
    "0x7f",
    "",
    "null",
    "1,5",
    "\"1\"",
    "1970-01-01T00:00:00Z",
    "9999-12-31T23:59:59.999999999Z",
    "2024-02-30 25:61:61",
    "00000000000000000001",
];
const NAMES: [&str; 16] = [
    "time",
    "timestamp",
    "stamp_ns",
    "t [ms]",
    "gyro_x",
    "gyro_y [deg/s]",
    "wx",
    "qw",
    "qx",
    "accel_z [g]",
    "mag_x",
    "dt",
    "id",
    "class",
    "stamp",
    "gyro",
];

/// The cells of a line, and the letters between them.
fn pieces(line: &str) -> Vec<String> {
    let parts = |c: char| ",;\t:[]{} ".contains(c);
    let mut found = vec![String::new()];
    for letter in line.chars() {
        if parts(letter) {
            found.push(letter.to_string());
            found.push(String::new());
        } else if let Some(last) = found.last_mut() {
            last.push(letter);
        }
    }
    found
}

fn change(lines: &mut Vec<String>, rng: &mut ChaCha8Rng) {
    if lines.is_empty() {
        return;
    }
    // The first lines say what all are.
    let at = match rng.random_range(0..3) {
        0 => rng.random_range(0..lines.len().min(3)),
        _ => rng.random_range(0..lines.len()),
    };
    let mut cells = pieces(&lines[at]);
    let place = rng.random_range(0..cells.len());
    match rng.random_range(0..9) {
        0 => return rearrange(lines, rng),
        1 => rearrange(&mut cells, rng),
        2 => cells[place] = NAMES[rng.random_range(0..NAMES.len())].to_owned(),
        3 => {
            // The same cell in every line: a column of it.
            let word = CELLS[rng.random_range(0..CELLS.len())];
            for line in lines.iter_mut().skip(1) {
                let mut cells = pieces(line);
                if let Some(cell) = cells.get_mut(place) {
                    word.clone_into(cell);
                }
                *line = cells.concat();
            }
            return;
        }
        4 => {
            // Another power of ten.
            let zeros = "0".repeat(rng.random_range(1..20));
            cells[place].push_str(&zeros);
        }
        _ => cells[place] = CELLS[rng.random_range(0..CELLS.len())].to_owned(),
    }
    lines[at] = cells.concat();
}

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let all = [seeds("delimited"), seeds("lines")].concat();
    let texts: Vec<String> = all
        .into_iter()
        .filter_map(|bytes| String::from_utf8(bytes).ok())
        .collect();
    assert!(texts.len() > 8);
    Box::new(move |rng| {
        let text = &texts[rng.random_range(0..texts.len())];
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        for _ in 0..rng.random_range(1..6) {
            change(&mut lines, rng);
        }
        lines
            .iter()
            .for_each(|line| debug_assert!(!line.contains('\n')));
        (lines.join("\n") + "\n").into_bytes().into()
    })
}
