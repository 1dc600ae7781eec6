//! Tables by their first rows: whose each row is, and when it was measured.

use super::*;
use strapd_attitude::record::Nanos;

type SensorAndStamp = (Option<String>, Option<i64>);
type Cell = fn(usize) -> String;

/// Sensor and stamp of each row, and what its reader is told.
fn rows(text: &str, columns: Option<&str>) -> (Vec<SensorAndStamp>, String) {
    let options = Options {
        columns: columns.map(|columns| columns.parse().unwrap()),
        ..Options::default()
    };
    let mut opening = Opening::new(&options, "log");
    for line in text.lines() {
        if !opening.take(line.as_bytes()) {
            break;
        }
    }
    let (mut table, held) = opening.finish().unwrap();
    let before = held.last().map_or(0, |held| held.number as usize);
    let mut found = Vec::new();
    let all = held.iter().map(|held| held.line.as_slice());
    for line in all.chain(text.lines().skip(before).map(str::as_bytes)) {
        let mut samples = Vec::new();
        let line = table.decode(line, &mut samples).unwrap();
        let stamp = samples.first().and_then(|sample| sample.header);
        found.push((line.id, stamp.map(|Nanos(nanos)| nanos)));
    }
    (found, table.notes().join("; "))
}

fn ids(text: &str, columns: Option<&str>) -> Vec<String> {
    let (rows, _) = rows(text, columns);
    rows.into_iter()
        .map(|(id, _)| id.unwrap_or_default())
        .collect()
}

fn table(head: &str, count: usize, cell: impl Fn(usize) -> String) -> String {
    let mut text = format!("time,{head},gyro_x,gyro_y,gyro_z\n");
    for n in 0..count {
        text.push_str(&format!("{}.02,{},0.1,0.2,0.3\n", n, cell(n)));
    }
    text
}

#[test]
fn a_column_called_as_a_unit_of_time_is_the_clock_where_there_is_no_other() {
    let text = |head: &str, step: usize| {
        let rows = (0..40).map(|n| format!("{},0.1,0.2,0.3\n", n * step));
        format!("{head},gyro_x,gyro_y,gyro_z\n{}", rows.collect::<String>())
    };
    for (head, nanos) in [("ms", 1_000_000), ("us", 1000), ("MS", 1_000_000)] {
        let (rows, _) = rows(&text(head, 5000), None);
        assert_eq!(rows[39].1, Some(39 * 5000 * nanos), "{head}");
    }
    // A step that stays is no clock, and a name of its own wins.
    assert_eq!(rows(&text("ms", 0), None).0[39].1, None);
    let beside = table("ms", 40, |n| n.to_string());
    assert_eq!(rows(&beside, None).0[1].1, Some(1_020_000_000));
}

#[test]
fn days_of_a_spreadsheet_and_of_matlab_are_dates() {
    // 2024-01-31 12:00, and 10 ms a row: 45,322.5 days since 1899-12-30, 739,282.5 since year 0.
    const NOON: i64 = 1_706_702_400_000_000_000;
    for days in [45_322, 739_282] {
        let rows_of = (0..40u64).map(|n| {
            let billionths = 500_000_000_000 + n * 115_741;
            format!("{days}.{billionths:012},0.1,0.2,0.3\n")
        });
        let text = format!("time,gyro_x,gyro_y,gyro_z\n{}", rows_of.collect::<String>());
        for columns in [None, Some("stamp=time:days")] {
            let (rows, notes) = rows(&text, columns);
            let stamp = |n: usize| rows[n].1.unwrap();
            assert_eq!(stamp(0), NOON, "{days} {columns:?}");
            assert!(
                (stamp(39) - NOON - 390_000_000).abs() < 2_000,
                "{}",
                stamp(39)
            );
            assert_eq!(
                notes.contains("a spreadsheet or MATLAB"),
                columns.is_none(),
                "{notes}"
            );
        }
    }
    // As numpy.savetxt writes them.
    let text = "time,gyro_x,gyro_y,gyro_z\n4.53225e+04,0,0,0\n4.532250000011574e+04,0,0,0\n4.532250000023148e+04,0,0,0\n";
    let (as_powers, _) = rows(text, None);
    assert_eq!(as_powers[0].1, Some(NOON));
    assert!((as_powers[2].1.unwrap() - NOON - 20_000_000).abs() < 2_000);
    // Seconds since a start are none, and days since a start have no date.
    let (rows, _) = rows(
        "time,gyro_x,gyro_y,gyro_z\n1.5,0,0,0\n1.6,0,0,0\n",
        Some("stamp=time:days"),
    );
    assert_eq!(rows[1].1, Some(138_240_000_000_000));
}

#[test]
fn a_column_that_names_the_sensor_keeps_bodies_apart() {
    let two = |n: usize| ["left", "right"][n % 2].to_owned();
    for head in ["device", "sensor", "imu_id", "MAC", "id", "Device ID"] {
        let found = ids(&table(head, 60, two), None);
        assert_eq!(found[..3], ["left", "right", "left"], "{head}");
        assert_eq!(found[59], "right", "{head}");
    }
    let numbers = ids(&table("id", 60, |n| (n % 3).to_string()), None);
    assert_eq!(numbers[..4], ["0", "1", "2", "0"]);
    let both = ids(
        &table("device,instance", 60, |n| format!("hub,{}", n % 2)),
        None,
    );
    assert_eq!(both[..2], ["hub/0", "hub/1"]);
    // One that comes when the first rows have long been read, and the name of those before it.
    let late = ids(
        &table("device", 60, |n| ["left", "right"][n / 50].to_owned()),
        None,
    );
    assert_eq!((late[0].as_str(), late[55].as_str()), ("", "right"));
}

#[test]
fn a_running_number_and_a_measurement_name_no_sensor() {
    let one = vec![String::new(); 60];
    let cases: [(&str, Cell); 7] = [
        ("id", |n| n.to_string()),
        ("id", |n| (n / 10).to_string()),
        ("device", |n| n.to_string()),
        ("sensor", |n| format!("0.{}", n % 3)),
        ("device", |_| "left".to_owned()),
        ("device", |_| String::new()),
        ("mode", |n| ["a", "b"][n % 2].to_owned()),
    ];
    for (head, cell) in cases {
        assert_eq!(ids(&table(head, 60, cell), None), one, "{head}");
    }
}

#[test]
fn the_sensor_is_the_column_that_is_given_or_none() {
    let two = table("mode", 40, |n| ["a", "b"][n % 2].to_owned());
    assert_eq!(ids(&two, Some("sensor=mode"))[..2], ["a", "b"]);
    let two = table("device", 40, |n| ["a", "b"][n % 2].to_owned());
    assert_eq!(ids(&two, Some("sensor=none"))[..2], ["", ""]);
}

/// Milliseconds since the first row, of rows with these cells of time.
fn millis(head: &str, cells: &[&str]) -> (Vec<i64>, String) {
    let mut text = format!("{head},gyro_x,gyro_y,gyro_z\n");
    for cell in cells {
        text.push_str(&format!("{cell},0.1,0.2,0.3\n"));
    }
    let (rows, notes) = rows(&text, None);
    let stamps: Vec<i64> = rows.into_iter().filter_map(|(_, stamp)| stamp).collect();
    let since = |stamp: &i64| (stamp - stamps[0]) / 1_000_000;
    (stamps.iter().map(since).collect(), notes)
}

#[test]
fn times_of_day_are_stamps_and_go_on_at_midnight() {
    let times = ["23:59:59.50", "23:59:59.75", "00:00:00.00", "00:00:00.25"];
    assert_eq!(millis("time", &times).0, [0, 250, 500, 750]);
    assert_eq!(millis("rtcTime", &times).0, [0, 250, 500, 750]);
    let dated = [
        "03/30/2025,23:59:59.50",
        "03/30/2025,23:59:59.75",
        "03/31/2025,00:00:00.00",
        "03/31/2025,00:00:00.25",
    ];
    let (found, notes) = millis("rtcDate,rtcTime", &dated);
    assert_eq!((found, notes.as_str()), (vec![0, 250, 500, 750], ""));
    // A night lies between them, which the date alone tells.
    let days = ["2025-03-30,10:00:00", "2025-03-31,10:00:00"];
    assert_eq!(millis("Date,Time", &days).0, [0, 86_400_000]);
    let (found, notes) = millis("date,time", &["03/04/2025,23:59:59", "03/05/2025,00:00:00"]);
    assert_eq!(found, [0, 1000]);
    assert!(notes.contains("03/04/2025"), "{notes}");
    let one_cell = ["30.03.2025 23:59:59.5", "31.03.2025 00:00:00.5"];
    assert_eq!(millis("time", &one_cell).0, [0, 1000]);
}

#[test]
fn rates_of_a_gcsv_are_known_by_its_first_line_alone() {
    let rows = "t,rx,ry,rz,ax,ay,az\n0,1,2,3,0,0,4096\n1,1,2,3,0,0,4096\n";
    let head = "GYROFLOW IMU LOG\nversion,1.1\norientation,XYZ\ntscale,0.001\ngscale,0.0005\n";
    let opened = |text: &str| {
        let mut opening = Opening::new(&Options::default(), "in");
        for line in text.lines() {
            opening.take(line.as_bytes());
        }
        opening.finish()
    };
    let (mut table, held) = opened(&format!("{head}{rows}")).unwrap();
    let mut samples = Vec::new();
    table.decode(&held[0].line, &mut samples).unwrap();
    let gyro = samples.first().and_then(|sample| sample.gyro);
    assert_eq!(gyro, Some([0.0005, 0.001, 0.0015]));
    assert!(opened(rows).is_err(), "angles, elsewhere");
    // Axes that no body has are one line of words, for it becomes the text of a warning.
    let (table, _) = opened(&format!("{head}{rows}").replace(",XYZ", ",0YxZ")).unwrap();
    let notes = table.notes().join("; ");
    assert!(
        notes.contains("0YxZ, which no body has") && !notes.contains('\n'),
        "{notes}"
    );
}

#[test]
fn whole_seconds_and_parts_of_a_second_are_one_stamp() {
    let row = |n: i64, split: i64, unit: i64| {
        let at = 1_743_379_190_000_000_000 + n * 20_000_000;
        format!("{},{},0.1,0.2,0.3\n", at / split, at % split / unit)
    };
    let text = |head: &str, unit: i64| {
        let rows = (0..120).map(|n| row(n, 1_000_000_000, unit));
        format!("{head},gyro_x,gyro_y,gyro_z\n{}", rows.collect::<String>())
    };
    for (head, unit) in [
        ("sec,nanosec", 1),
        ("secs,nsecs", 1),
        ("header.stamp.sec,header.stamp.nanosec", 1),
        ("timestamp_s,timestamp_ns", 1),
        ("tv_sec,tv_usec", 1000),
    ] {
        let (rows, _) = rows(&text(head, unit), None);
        for (n, (_, stamp)) in rows.iter().enumerate() {
            let expected = 1_743_379_190_000_000_000 + n as i64 * 20_000_000;
            assert_eq!(*stamp, Some(expected), "{head}");
        }
        // Either column says it, and a unit that is given is believed.
        let (_, part) = head.split_once(',').unwrap();
        let given = format!("stamp={part}");
        assert_eq!(
            self::rows(&text(head, unit), Some(&given)).0[70].1,
            rows[70].1
        );
    }
    // A total in two units is two stamps, of which none is a part.
    let total = |n: i64| format!("{},{},0.1,0.2,0.3\n", n, n * 1_000_000_000);
    let twice: String = (1..120).map(total).collect();
    let (rows, _) = rows(
        &format!("time_s,time_ns,gyro_x,gyro_y,gyro_z\n{twice}"),
        None,
    );
    assert_eq!(rows[70].1, Some(71_000_000_000));
}

#[test]
fn a_date_and_a_time_in_one_column_are_a_stamp_by_their_name() {
    for (head, cell, nanos) in [
        (
            "DateTime",
            "03/30/2025 01:02:03.500",
            1_743_296_523_500_000_000,
        ),
        (
            "datetime",
            "30.03.2025 01:02:03.500",
            1_743_296_523_500_000_000,
        ),
        (
            "Date and Time",
            "2025-03-30T01:02:03.5Z",
            1_743_296_523_500_000_000,
        ),
        (
            "time",
            "01:02:03:500",
            86_400_000_000_000 + 3_723_500_000_000,
        ),
    ] {
        let line = format!("{cell},0.1,0.2,0.3\n");
        let text = format!("{head},gyro_x,gyro_y,gyro_z\n{}", line.repeat(30));
        let (rows, _) = rows(&text, None);
        assert_eq!(rows[5].1, Some(nanos), "{head} {cell}");
    }
}
