//! The magnetic field: a message of its own in an MCAP, a part of the line elsewhere.

use crate::program::strapd;

fn f64_at(data: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(data[at..at + 8].try_into().unwrap())
}

#[test]
fn the_field_is_in_the_log_and_in_the_lines_at_its_own_rate() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let made = "simulate hand --duration 2 --rate-hz 100 --mag 25 --field 50,60,10";
    let summary = strapd(at, &format!("{made} -o h.mcap -o h.ndjson --json")).json();
    assert_eq!(summary["fields"], 51, "{summary}");
    let bytes = std::fs::read(at.join("h.mcap")).unwrap();
    let mut fields = Vec::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let m = message.unwrap();
        if m.channel.topic != "/imu/mag" {
            continue;
        }
        let schema = m.channel.schema.as_ref().unwrap();
        assert_eq!(schema.name, "sensor_msgs/msg/MagneticField");
        assert!(String::from_utf8_lossy(&schema.data).contains("magnetic_field_covariance"));
        // Header and imu_link end at 28; three numbers and nine covariances, unknown.
        assert_eq!(m.data.len(), 28 + 96);
        assert!(m.data[28 + 24..].iter().all(|b| *b == 0));
        fields.push([0, 8, 16].map(|i| f64_at(&m.data, 28 + i)));
    }
    assert_eq!(fields.len(), 51);
    // At rest at the start, x ahead is east: 25 uT level, 10 degrees east of north.
    let (s, c) = 10_f64.to_radians().sin_cos();
    for (found, expected) in fields[0]
        .iter()
        .zip([25e-6 * s, 25e-6 * c, -50e-6 * 0.75_f64.sqrt()])
    {
        assert!((found - expected).abs() < 1e-19, "{:?}", fields[0]);
    }
    let text = std::fs::read_to_string(at.join("h.ndjson")).unwrap();
    let lines: Vec<serde_json::Value> = text
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    let in_lines: Vec<[f64; 3]> = lines
        .iter()
        .filter(|l| !l["mag"].is_null())
        .map(|l| [0, 1, 2].map(|i| l["mag"][i].as_f64().unwrap()))
        .collect();
    assert_eq!(in_lines, fields);
    // What reads samples reads them as ever.
    strapd(at, "replay h.mcap -o from_log.csv").done();
    strapd(at, "replay h.ndjson -o from_lines.csv").done();
}

#[test]
fn a_field_that_can_not_be_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for (flags, words) in [
        ("--mag 200", &["magnetometer", "200"] as &[&str]),
        ("--mag=-1", &["magnetometer", "-1"]),
        ("--mag --field 48,100,0", &["--field", "90"]),
        ("--mag --field 48", &["--field", "3"]),
        (
            "--mag --field-disturbance 20,10,1,0,0",
            &["--field-disturbance", "FROM"],
        ),
        ("--field-disturbance 10,20,1,0,0", &["--mag"]),
        ("--noise rough_imu,lsb=1", &["truncation", "lsb"]),
    ] {
        strapd(
            dir.path(),
            &format!("simulate car --rate-hz 100 {flags} -o x.mcap"),
        )
        .refused(2, words);
        assert!(!dir.path().join("x.mcap").exists());
    }
}
