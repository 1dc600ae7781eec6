//! Rows of strapd's own table; those of others are in `tests/recording/delimited.rs`.

use super::*;
use strapd_attitude::record::{Nanos, SampleKind};

const OURS: &[u8] = b"stamp_ns,log_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,qw,qx,qy,qz,interval_ns,sample_kind\r\n";

fn row(table: &Table, row: &str) -> Result<(Line, RawSample), Undecodable> {
    let mut samples = Vec::new();
    let line = table.clone().decode(row.as_bytes(), &mut samples)?;
    Ok((line, samples.first().copied().unwrap_or_default()))
}

#[test]
fn a_row_is_read_to_the_last_bit_and_what_is_empty_is_absent() {
    let table = Table::own(OURS).unwrap();
    let (line, sample) = row(&table, "5,7,0.1,-2e-300,nan,,,,1,0,0,0,4000000,average\r\n").unwrap();
    assert_eq!(
        (line.class, line.sample_kind),
        (Class::Rate, Some(SampleKind::Average))
    );
    assert_eq!((sample.header, sample.log), (Some(Nanos(5)), Nanos(7)));
    let gyro = sample.gyro.unwrap();
    assert_eq!(
        [gyro[0].to_bits(), gyro[1].to_bits()],
        [0.1f64.to_bits(), (-2e-300f64).to_bits()]
    );
    assert!(gyro[2].is_nan());
    assert_eq!(
        (sample.accel, sample.interval_nanos),
        (None, Some(4_000_000))
    );
    assert_eq!(sample.orientation, Some([1.0, 0.0, 0.0, 0.0]));
}

#[test]
fn what_is_no_row_of_the_table_says_which_cell() {
    let table = Table::own(b"stamp_ns,gyro_x,gyro_y,gyro_z").unwrap();
    for (bad, words) in [
        ("1,2,3", "3 cells, but 4 columns"),
        ("1,2,3,4,5", "5 cells, but 4 columns"),
        ("1,2,,4", "`gyro_y`"),
        ("1,2,x\u{1b}[2J,4", "`gyro_y`"),
        ("1.5,2,3,4", "`stamp_ns`"),
    ] {
        let why = row(&table, bad).unwrap_err().to_string();
        assert!(
            why.contains(words) && !why.contains('\u{1b}'),
            "{bad}: {why}"
        );
    }
    let long = "7".repeat(MAX_LINE + 1);
    assert!(matches!(
        row(&table, &long),
        Err(Undecodable::LongLine { .. })
    ));
}

#[test]
fn a_name_in_quotes_may_hold_commas_and_the_first_row_may_come_again() {
    let table = Table::own(b"\xef\xbb\xbfid,stamp_ns,w,x,y,z,wx,wy,wz,status").unwrap();
    let (line, sample) = row(
        &table,
        "\"a \"\"b\"\", c\",9,1,0,0,0,0.1,0.2,0.3,\"held,x\"",
    )
    .unwrap();
    assert_eq!(line.id.as_deref(), Some("a \"b\", c"));
    assert_eq!(
        (line.class, sample.gyro),
        (Class::Att, Some([0.1, 0.2, 0.3]))
    );
    let (again, _) = row(&table, "id,stamp_ns,w,x,y,z,wx,wy,wz,status\n").unwrap();
    assert_eq!(again.decoded.samples, 0);
}

#[test]
fn a_table_of_somebody_else_is_none_of_ours() {
    for other in [
        "timestamp,x,y,z",
        "stamp_ns,temperature",
        "stamp_ns,gyro_x,gyro_y",
        "time,gyro_x,gyro_y,gyro_z",
        "",
    ] {
        assert!(!Table::is_own_header(other.as_bytes()), "{other}");
    }
}
