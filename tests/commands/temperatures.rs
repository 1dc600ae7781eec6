//! Promise: a temperature beside the samples is kept in the outputs, shown against the bias, and changes no attitude.

use crate::program::strapd;
use crate::replays::fixture;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Change of the bias per kelvin, rad/s.
const SLOPE: [f64; 3] = [-0.8e-3, 1.6e-3, 0.4e-3];

/// Temperature of the row, degrees Celsius: warm after five minutes.
fn temperature(row: usize) -> f64 {
    let warmed = (row as f64 / 50.0 / 300.0).min(1.0);
    (2000.0 + 2000.0 * warmed).round() / 100.0
}

/// Rows of a thing in the hand at 50 Hz for six minutes, whose bias goes with its temperature.
fn rows(at: &Path) -> Vec<Vec<String>> {
    strapd(at, "simulate hand --duration 360 --rate-hz 50 -o made.csv").done();
    let text = std::fs::read_to_string(at.join("made.csv")).unwrap();
    let cells = |row: &str| row.split(',').map(str::to_owned).collect();
    let mut rows: Vec<Vec<String>> = text.lines().skip(1).map(cells).collect();
    for (n, row) in rows.iter_mut().enumerate() {
        for (axis, slope) in SLOPE.iter().enumerate() {
            let rate: f64 = row[2 + axis].parse().unwrap();
            row[2 + axis] = (rate + slope * (temperature(n) - 20.0)).to_string();
        }
    }
    rows
}

/// A table of these rows under the names, with what stands behind each.
fn table(at: &Path, name: &str, rows: &[Vec<String>], behind: (&str, impl Fn(usize) -> String)) {
    let stamp = if name == "in.csv" {
        "time_ns"
    } else {
        "stamp_ns"
    };
    let mut text = format!(
        "{stamp},gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z{}\n",
        behind.0
    );
    for (n, row) in rows.iter().enumerate() {
        let vectors = row[2..8].join(",");
        writeln!(text, "{},{vectors}{}", row[0], (behind.1)(n)).unwrap();
    }
    std::fs::write(at.join(name), text).unwrap();
}

/// A column of a table by its name.
fn column(at: &Path, table: &str, name: &str) -> Vec<String> {
    let mut reader = csv::Reader::from_path(at.join(table)).unwrap();
    let place = reader.headers().unwrap().iter().position(|n| n == name);
    let place = place.unwrap_or_else(|| panic!("{table} has no column {name}"));
    let rows = reader.records();
    rows.map(|row| row.unwrap()[place].to_owned()).collect()
}

#[test]
fn a_temperature_is_kept_beside_each_attitude_and_shown_against_the_bias() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let rows = rows(at);
    table(at, "plain.csv", &rows, ("", |_| String::new()));
    table(
        at,
        "warm.csv",
        &rows,
        (",temperature_c", |n| format!(",{}", temperature(n))),
    );
    let replay = |name: &str, flags: &str| -> Value {
        strapd(
            at,
            &format!("replay {name} {flags} --aid gravity --force --json"),
        )
        .json()
    };
    let plain = replay("plain.csv", "-o plain_out.csv");
    let warm = replay("warm.csv", "-o out.csv");
    assert_eq!(plain["topics"][0]["temperature"], Value::Null);

    // Of each attitude the temperature of its row, and the attitudes as without one.
    let told = column(at, "out.csv", "temperature_c");
    assert!(told.len() >= 17_990, "{}", told.len());
    let wanted: Vec<f64> = (0..told.len()).map(temperature).collect();
    let told: Vec<f64> = told.iter().map(|cell| cell.parse().unwrap()).collect();
    assert_eq!(told, wanted);
    for name in ["stamp_ns", "qw", "qx", "qy", "qz", "sigma_z_deg", "status"] {
        assert!(
            column(at, "out.csv", name) == column(at, "plain_out.csv", name),
            "{name}"
        );
    }

    let said = &warm["topics"][0]["temperature"];
    assert_eq!(said["range_degc"], serde_json::json!([20.0, 40.0]));
    let slope = &said["bias"]["slope_rad_s_k"];
    for (axis, expected) in SLOPE.iter().enumerate() {
        let found = slope[axis].as_f64().unwrap();
        assert!((found - expected).abs() < 0.15 * SLOPE[1], "{said}");
    }
    assert!(said["bias"]["explained"].as_f64().unwrap() > 0.9, "{said}");

    let words = strapd(at, "replay warm.csv -o null: --aid gravity -v");
    words.done();
    let all = format!("{}{}", words.out, words.err);
    assert!(
        all.contains("20.00 to 40.00 degC; the bias goes with it by"),
        "{all}"
    );
    strapd(at, "report warm.csv --aid gravity -o warm.html").done();
    let page = std::fs::read_to_string(at.join("warm.html")).unwrap();
    assert!(page.contains("Bias against temperature, deg/s"));
}

#[test]
fn a_temperature_of_any_maker_is_converted_and_what_is_none_loses_no_row() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let rows = &rows(at)[..500];
    // Beside the gyro's own, those of other things, in kelvin, with cells that hold none.
    let cells = |n: usize| match n % 50 {
        7 => ",99,".to_owned(),
        8 => ",99,hot".to_owned(),
        _ => format!(",99,{}", temperature(n) + 273.15),
    };
    table(
        at,
        "in.csv",
        rows,
        (",Baro_temp,Gyro_temperature[K]", cells),
    );
    let ran = strapd(at, "replay in.csv -o out.csv --force -v");
    ran.done();
    let said = format!("{}{}", ran.out, ran.err);
    assert!(said.contains("temperature=Gyro_temperature[K]:k"), "{said}");
    let told = column(at, "out.csv", "temperature_c");
    assert_eq!(told.len(), 500, "{said}");
    for (n, cell) in told.iter().enumerate() {
        // Where a cell holds none, the last.
        let row = match n % 50 {
            8 => n - 2,
            7 => n - 1,
            _ => n,
        };
        let off: f64 = cell.parse::<f64>().unwrap() - temperature(row);
        assert!(off.abs() < 1e-4, "row {n}: {cell}");
    }
    // Another column by name, or none.
    for (columns, wanted) in [
        ("temperature=Baro_temp", Some("99")),
        ("temperature=none", None),
    ] {
        let ran = strapd(
            at,
            &format!("replay in.csv -o out.csv --force --columns {columns}"),
        );
        ran.done();
        let header = std::fs::read_to_string(at.join("out.csv")).unwrap();
        assert_eq!(
            header.lines().next().unwrap().ends_with("temperature_c"),
            wanted.is_some()
        );
        if let Some(wanted) = wanted {
            let told = column(at, "out.csv", "temperature_c");
            assert!(
                told.iter()
                    .all(|cell| cell.parse::<f64>().unwrap().to_string() == wanted)
            );
        }
    }
}

#[test]
fn lines_and_attitudes_as_lines_carry_it_under_the_same_key() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let rows = &rows(at)[..500];
    let mut lines = String::new();
    for (n, row) in rows.iter().enumerate() {
        let (gyro, accel) = (row[2..5].join(","), row[5..8].join(","));
        writeln!(
            lines,
            r#"{{"class":"RATE","stamp_ns":{},"gyro":[{gyro}],"accel":[{accel}],"temperature":{},"battery":{{"temperature":90}}}}"#,
            row[0],
            temperature(n)
        )
        .unwrap();
    }
    std::fs::write(at.join("in.ndjson"), lines).unwrap();
    for flags in ["", "--method commit"] {
        strapd(
            at,
            &format!("replay in.ndjson {flags} -o out.ndjson --force"),
        )
        .done();
        let text = std::fs::read_to_string(at.join("out.ndjson")).unwrap();
        let told = text.lines().map(|line| {
            let line: Value = serde_json::from_str(line).unwrap();
            line["temperature_c"].as_f64().unwrap()
        });
        let wanted: Vec<f64> = (0..500).map(temperature).collect();
        let told: Vec<f64> = told.map(|value| (value * 100.0).round() / 100.0).collect();
        assert_eq!(told, wanted, "{flags}");
    }
    // The samples, too.
    let cat = strapd(at, "cat in.ndjson");
    cat.done();
    let first: Value = serde_json::from_str(cat.out.lines().next().unwrap()).unwrap();
    assert_eq!(first["temperature_c"], 20.0);
}

/// The fixture with messages of `sensor_msgs/msg/Temperature` on a topic, one a second.
fn beside(at: &Path, topic: &str) {
    let bytes = std::fs::read(fixture("xsens_mti.mcap")).unwrap();
    let mut out = mcap::Writer::new(std::fs::File::create(at.join("a.mcap")).unwrap()).unwrap();
    let text = "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n\
        ===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
        ===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let text = text.replace("===", &"=".repeat(80));
    let schema = "sensor_msgs/msg/Temperature";
    let schema = out.add_schema(schema, "ros2msg", text.as_bytes()).unwrap();
    let channel = out
        .add_channel(schema, topic, "cdr", &BTreeMap::new())
        .unwrap();
    let mut known: BTreeMap<u16, u16> = BTreeMap::new();
    let (mut next, mut count) = (0, 0);
    for message in mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
    {
        if message.log_time >= next {
            next = message.log_time + 1_000_000_000;
            let mut data = vec![0, 1, 0, 0];
            data.extend(((message.log_time / 1_000_000_000) as i32).to_le_bytes());
            data.extend([0; 4]);
            // A frame without a name, and what aligns the numbers.
            data.extend(1_u32.to_le_bytes());
            data.extend([0; 4]);
            data.extend((30.0 + 0.5 * f64::from(count)).to_le_bytes());
            data.extend(0.0_f64.to_le_bytes());
            let header = mcap::records::MessageHeader {
                channel_id: channel,
                sequence: 0,
                log_time: message.log_time,
                publish_time: message.log_time,
            };
            out.write_to_known_channel(&header, &data).unwrap();
            count += 1;
        }
        let of = &message.channel;
        let id = match known.get(&of.id) {
            Some(id) => *id,
            None => {
                let schema = of.schema.as_ref().unwrap();
                let schema = out
                    .add_schema(&schema.name, &schema.encoding, &schema.data)
                    .unwrap();
                let encoding = &of.message_encoding;
                let id = out
                    .add_channel(schema, &of.topic, encoding, &of.metadata)
                    .unwrap();
                known.insert(of.id, id);
                id
            }
        };
        let header = mcap::records::MessageHeader {
            channel_id: id,
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        out.write_to_known_channel(&header, &message.data).unwrap();
    }
    out.finish().unwrap();
}

#[test]
fn a_topic_of_its_own_tells_the_temperature_where_it_is_the_sensors() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (topic, is_its) in [("/imu/temperature", true), ("/battery/temperature", false)] {
        beside(at, topic);
        let ran = strapd(at, "replay a.mcap --topic /imu/data -o out.csv --force");
        ran.done();
        let header = std::fs::read_to_string(at.join("out.csv")).unwrap();
        let header = header.lines().next().unwrap();
        assert_eq!(
            header.ends_with(",temperature_c"),
            is_its,
            "{topic}: {ran:?}"
        );
        if is_its {
            let told = column(at, "out.csv", "temperature_c");
            assert_eq!((told[0].as_str(), told.len()), ("30.0", 953));
            let last: f64 = told[952].parse().unwrap();
            assert!((39.0..=39.5).contains(&last), "{last}");
        }
    }
}
