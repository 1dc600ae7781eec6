//! Tables that nobody well-meaning, and many a well-meaning program, writes: a clear error or a counted row each.

use super::{Dribble, Given, all, options, read};
use std::io::Read;
use strapd_attitude::record::Nanos;

#[track_caller]
fn refused(name: &str, text: &str, words: &[&str]) {
    let why = read(name, text.as_bytes(), &options("")).unwrap_err();
    for word in words {
        assert!(why.contains(word), "`{word}` is missing: {why}");
    }
    assert!(!why.contains('\u{1b}'), "{why}");
}

fn given(text: &str) -> Given {
    read("x.csv", text.as_bytes(), &options("")).unwrap()
}

/// Rows of stamps `step` apart, and three numbers.
fn rows(step: f64) -> String {
    (0..30)
        .map(|k| format!("{},1,2,3\n", f64::from(k) * step))
        .collect()
}

#[test]
fn what_can_not_be_told_is_refused_with_the_flag_that_tells_it() {
    for (header, words) in [
        (
            "time_s,gyro_x (deg/s),gyro_y (rad/s),gyro_z (deg/s)",
            &[
                "several units",
                "`gyro_x (deg/s)` and `gyro_y (rad/s)`",
                "columns gyro=",
            ][..],
        ),
        (
            "time_s,gyro_x [LSB],gyro_y [LSB],gyro_z [LSB]",
            &[
                "unit `LSB` of its rates is not known",
                "columns gyro=gyro_x [LSB]:gyro_y [LSB]:gyro_z [LSB]:deg/s",
            ],
        ),
        (
            "time_s,wx,wy,wz,left_gyro_x,left_gyro_y,left_gyro_z",
            &[
                "its gyro may be",
                "`wx`, `wy`, `wz`",
                "`left_gyro_x`",
                "columns gyro=wx:wy:wz",
            ],
        ),
        (
            "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,accel_hi_x,accel_hi_y,accel_hi_z",
            &[
                "its accel may be",
                "columns accel=acc_x:acc_y:acc_z",
                "columns accel=none",
            ],
        ),
        (
            "time_s,timestamp_ms,gyro_x,gyro_y,gyro_z",
            &[
                "its stamp may be `time_s`, `timestamp_ms`",
                "columns stamp=time_s",
            ],
        ),
        (
            "time_s,gyro_x,gyro_x,gyro_y,gyro_z",
            &[
                "there twice, as columns 2 and 3",
                "columns gyro=2:gyro_y:gyro_z",
            ],
        ),
        (
            "time_s,gyro_x,gyro_y,temperature",
            &[
                "none of its columns names a rate",
                "`temperature`",
                "columns gyro=",
            ],
        ),
        (
            "time_s,gyro_raw_x,gyro_raw_y,gyro_raw_z",
            &["is not calibrated by its name", "columns gyro="],
        ),
        (
            "timestamp,x,y,z",
            &["of which sensor", "columns gyro=x:y:z"],
        ),
        (
            "when,\u{1b}[2J,that,what",
            &["begins with `when", "\\u{1b}"],
        ),
    ] {
        let cells = header.split(',').count() - 1;
        let rows: String = (0..30)
            .map(|k| format!("{}{}\n", f64::from(k) * 0.01, ",1".repeat(cells)))
            .collect();
        refused("x.csv", &format!("{header}\n{rows}"), words);
    }
}

#[test]
fn a_unit_of_stamps_that_the_steps_deny_is_not_believed_and_one_that_is_not_said_is_told() {
    let named = |name: &str, step| format!("{name},gyro_x,gyro_y,gyro_z\n{}", rows(step));
    refused(
        "x.csv",
        &named("time (s)", 10.0),
        &[
            "`time (s)` is in s by its name",
            "steps of 10 are those of a gyro only in ms",
            "columns stamp=time (s):ms",
            ":s as",
        ],
    );
    refused(
        "x.csv",
        &named("time_ms", 0.01),
        &["is in ms by its name", "only in s"],
    );
    // Said by hand, it is believed.
    let by_hand = read(
        "-",
        named("time (s)", 10.0).as_bytes(),
        &options("stamp=time (s):s"),
    );
    assert_eq!(
        by_hand.unwrap().samples[1].header,
        Some(Nanos(10_000_000_000))
    );
    for (step, nanos, is_said) in [
        (0.01, 10_000_000, false),
        (10.0, 10_000_000, false),
        (0.02, 20_000_000, true),
    ] {
        let given = given(&named("time", step));
        assert_eq!(given.samples[1].header, Some(Nanos(nanos)), "{step}");
        let said = given
            .notes
            .iter()
            .any(|note| note.contains("by their size they are taken for s"));
        assert_eq!(said, is_said, "{step}: {:?}", given.notes);
    }
    refused(
        "x.csv",
        &named("time", 20.0),
        &["cannot be told", "columns stamp=time:UNIT"],
    );
    // One text among them is a bad row, all of them are no stamps.
    refused(
        "x.csv",
        "time,gyro_x,gyro_y,gyro_z\nnoon,1,2,3\nlater,1,2,3\n",
        &["`noon` of column `time`"],
    );
}

#[test]
fn words_for_no_number_are_as_empty_cells_where_another_sensor_has_numbers() {
    let read = |gyro: &str| {
        let rows = (0..20).map(|k| format!("0.{k:02}1,1,2,3,,,\n0.{k:02}5,{gyro},0,0,9.8\n"));
        let rows: String = rows.collect();
        let head = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n";
        let given = given(&format!("{head}{rows}"));
        assert_eq!(given.bad, []);
        given.samples
    };
    let empty = read(",,");
    assert_eq!(empty.iter().filter(|sample| sample.is_beside).count(), 20);
    for words in ["null,null,null", "NA,NA,NA", "-,-,-"] {
        assert_eq!(read(words), empty, "{words}");
    }
    // What is not finite is a sample that is lost, and counted.
    assert!(read("NaN,NaN,NaN").iter().all(|sample| !sample.is_beside));
}

#[test]
fn rows_that_are_none_are_counted_with_their_lines_and_the_others_are_read() {
    let given = given(
        "time_s,gyro_x,gyro_y,gyro_z\n0.00,x,2,3\n0.01,1,2,3\n0.02,1,2\n0.03,1,2,3,4\n0.04,1,2,three\n0.05,,2,3\n,1,2,3\n0.07,nan,-,null\n0.08,1,2,3,\n0.09,1,\u{1b}[2J,3\n",
    );
    let lines: Vec<u64> = given.bad.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [2, 4, 5, 6, 7, 11]);
    for (nth, words) in [
        (0, "column `gyro_x`: `x` is no number"),
        (1, "3 cells, but 4 columns"),
        (2, "5 cells, but 4 columns"),
        (3, "`three`"),
        (4, "is empty, but those beside"),
        (5, "\\u{1b}"),
    ] {
        assert!(
            given.bad[nth].1.contains(words),
            "{words}: {:?}",
            given.bad[nth]
        );
    }
    let [first, unstamped, absent, last] = given.samples.as_slice() else {
        panic!("{:?}", given.samples);
    };
    assert_eq!(first.gyro, Some([1.0, 2.0, 3.0]));
    assert_eq!(unstamped.header, None, "an empty stamp is none");
    assert!(
        absent.gyro.unwrap().iter().all(|w| w.is_nan()),
        "counted as not finite"
    );
    assert_eq!(last.header, Some(Nanos(80_000_000)));
}

#[test]
fn tables_one_behind_the_other_are_one_where_their_headers_are_and_counted_where_not() {
    let head = "time_s,gyro_x,gyro_y,gyro_z\n";
    let same = given(&format!("{head}0.00,1,2,3\n{head}0.01,1,2,3\n"));
    assert_eq!((same.samples.len(), same.bad.len()), (2, 0));
    // Of as many columns in another order: read on, it would be another motion.
    let other = "time_s,gyro_z,gyro_y,gyro_x\n";
    let given = given(&format!(
        "{head}0.00,1,2,3\n{other}0.01,3,2,1\n0.02,3,2,1\n{head}0.03,1,2,3\n"
    ));
    assert_eq!(given.samples.len(), 2);
    let lines: Vec<u64> = given.bad.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [3, 4, 5]);
    assert!(
        given
            .bad
            .iter()
            .all(|(_, why)| why.contains("another table begins here"))
    );
    // Comments between rows say nothing; those of a head with another rate, that it is another table.
    let xsens = |hz: &str| {
        format!(
            "// Update Rate: {hz}Hz\nPacketCounter\tGyr_X\tGyr_Y\tGyr_Z\n1\t1\t2\t3\n2\t1\t2\t3\n"
        )
    };
    let alike = read(
        "-",
        [xsens("50.0"), xsens("50.0")].concat().as_bytes(),
        &options(""),
    )
    .unwrap();
    assert_eq!((alike.samples.len(), alike.bad.len()), (4, 0));
}

#[test]
fn what_is_no_table_of_text_is_called_so() {
    refused(
        "x.csv",
        "\0\u{1}\u{2},gyro_x,gyro_y,gyro_z\n",
        &["bytes of zero", "binary, or UTF-16"],
    );
    refused(
        "x.csv",
        "1,2,3\n4,5,6\n",
        &["name columns", "columns gyro=2:3:4"],
    );
    refused("x.csv", "hello\nworld\n", &["begins with `hello"]);
    refused(
        "x.csv",
        "time (s),gyro_x,gyro_y,gyro_z\n0,00,1,0,2,0,3,0\n0,01,1,0,2,0,3,0\n",
        &["8 cells under 4 names", "decimal commas", "semicolons"],
    );
    for noise in [
        &b"\xff\xd8\xff\xe0\x10JFIF,,,\n,,,"[..],
        b"\xff,\xfe,\xfd\n",
        b"",
    ] {
        assert!(read("x.csv", noise, &options("")).is_err());
    }
}

/// Reader of as many bytes, none of them kept.
struct Long(u64, u8);

impl Read for Long {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let n = into
            .len()
            .min(usize::try_from(self.0).unwrap_or(usize::MAX));
        into[..n].fill(self.1);
        self.0 -= n as u64;
        Ok(n)
    }
}

#[test]
fn a_line_of_100_mb_is_one_bad_row_and_before_the_header_no_table() {
    let head = &b"time_s,gyro_x,gyro_y,gyro_z\n0,1,2,3\n"[..];
    let tail = &b"\n0.01,1,2,3\n"[..];
    for byte in [b'7', b',', b'"', b'\t'] {
        let input = head.chain(Long(100_000_000, byte)).chain(tail);
        let given = read("x.csv", input, &options("")).unwrap();
        assert_eq!(given.samples.len(), 2);
        let [(3, why)] = given.bad.as_slice() else {
            panic!("{:?}", given.bad);
        };
        assert!(why.contains("over the limit"), "{why}");
        let input = Long(100_000_000, byte).chain(head);
        assert!(read("x.csv", input, &options("")).is_err());
    }
}

#[test]
fn no_flag_makes_a_table_of_nothing() {
    let made = &all()[7];
    for (columns, words) in [
        ("gyro=a:b:c", "there is no column `a`"),
        ("gyro=2:3:9", "there is no column 9 of 7"),
        ("gyro=2:3:4,stamp=nowhere", "there is no column `nowhere`"),
        ("gyro=2:3:3", "has two roles"),
        ("gyro=none", "none of its columns is a rate"),
    ] {
        let why = read("-", Dribble(made.text.as_bytes(), 11), &options(columns)).unwrap_err();
        assert!(why.contains(words), "{columns}: {why}");
    }
}
