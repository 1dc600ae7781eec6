//! Specific forces and fields that come in messages of their own, as phones send them: they correct the attitude
//! of the gyro they belong to, whichever comes first, and are no samples that lack a rate.

use super::aiding::{aided, roll};
use super::runs::{Fed, Got};
use serde_json::{Value, json};
use strapd_attitude::estimate::{Aid, EstimationSettings};

/// Plan with which `serve` begins.
fn auto() -> EstimationSettings {
    EstimationSettings {
        aid: Aid::Auto,
        ..EstimationSettings::default()
    }
}

const START: u64 = 1_700_000_000_000_000_000;

/// The body of `aiding::line` as a phone has it: its sensors apart, the accelerometer at a quarter of the rate.
fn event(sensor: &str, n: u64, values: [f64; 3]) -> String {
    json!({
        "id": "phone", "type": format!("android.sensor.{sensor}"),
        "values": values, "timestamp": START + n * 10_000_000, "accuracy": 3,
    })
    .to_string()
}

fn true_roll(n: u64) -> f64 {
    0.3 + 0.2 * (0.9 * n as f64 * 0.01).sin()
}

fn gyro(n: u64) -> String {
    let rate = 0.18 * (0.9 * n as f64 * 0.01).cos() + 0.5_f64.to_radians();
    event("gyroscope", n, [rate, 0.0, 0.0])
}

fn force(n: u64) -> String {
    let (sin, cos) = true_roll(n).sin_cos();
    event("accelerometer", n, [0.0, 9.81 * sin, 9.81 * cos])
}

/// Both, where the force of an instant comes before its rate, or behind it.
pub(super) fn phone(numbers: std::ops::Range<u64>, forces_first: bool) -> Vec<String> {
    let both = |n: u64| match (n % 4, forces_first) {
        (0, true) => vec![force(n), gyro(n)],
        (0, false) => vec![gyro(n), force(n)],
        _ => vec![gyro(n)],
    };
    numbers.flat_map(both).collect()
}

fn off(got: &Got, n: u64) -> f64 {
    (roll(got.attitudes.last().unwrap()) - true_roll(n).to_degrees()).abs()
}

fn source(fed: &Fed) -> Value {
    let status: Value = serde_json::from_slice(&fed.hub.status()).unwrap();
    status["sources"][0].clone()
}

#[test]
fn a_force_that_comes_first_levels_what_follows() {
    let mut fed = Fed::of(&auto());
    let got = fed.lines(phone(0..3000, true));
    assert_eq!(got.attitudes.len(), 3000);
    assert_eq!(got.said, [] as [Value; 0]);
    assert!(off(&got, 2999) < 0.3, "{}", off(&got, 2999));
    let source = source(&fed);
    assert_eq!(source["world"], "level");
    assert_eq!(
        (&source["samples"], &source["lost"]),
        (&json!(3000), &json!(0)),
        "{source}"
    );
    let bias = source["aid"]["learned"]["gyro_bias_rad_s"][0].as_f64();
    assert!((bias.unwrap().to_degrees() - 0.5).abs() < 0.1, "{source}");
}

#[test]
fn where_a_rate_comes_first_it_is_said_and_a_flag_levels() {
    let lines = || phone(0..3000, false);
    let mut fed = Fed::of(&auto());
    let got = fed.lines(lines());
    assert_eq!(got.attitudes.len(), 3000);
    assert_eq!(got.codes("ERROR"), ["forces_unused"]);
    // Neither level at first nor without its bias.
    assert!(off(&got, 2999) > 1.0);
    assert_ne!(source(&fed)["world"], "level");
    let got = Fed::of(&aided()).lines(lines());
    assert_eq!((got.attitudes.len(), got.said.len()), (3000, 0));
    assert!(off(&got, 2999) < 0.3, "{}", off(&got, 2999));
    // Who asked for the gyro alone is told nothing.
    let alone = EstimationSettings {
        aid: Aid::None,
        ..EstimationSettings::default()
    };
    assert_eq!(Fed::of(&alone).lines(lines()).said, [] as [Value; 0]);
}

#[test]
fn after_a_restart_it_goes_on_to_the_bit() {
    for plan in [auto(), aided()] {
        let whole = Fed::of(&plan).lines(phone(0..1600, true)).attitudes;
        let mut fed = Fed::of(&plan);
        let mut parts = fed.lines(phone(0..1501, true)).attitudes;
        for cut in [1501..1555, 1555..1600] {
            fed = fed.restarted(&plan);
            parts.extend(fed.lines(phone(cut, true)).attitudes);
        }
        assert_eq!(parts.len(), 1600);
        assert!(parts == whole);
    }
}

#[test]
fn a_field_of_its_own_gives_north() {
    let plan = EstimationSettings {
        aid: Aid::GravityAndField,
        ..EstimationSettings::default()
    };
    // The body's x axis points 30 degrees north of east.
    let field = |n: u64| {
        let (sin, cos) = true_roll(n).sin_cos();
        let (east, north, up) = (0.0, 20.0, -40.0);
        let (s, c) = 30.0_f64.to_radians().sin_cos();
        let (x, y) = (c * east + s * north, c * north - s * east);
        event(
            "magnetic_field",
            n,
            [x, cos * y + sin * up, cos * up - sin * y],
        )
    };
    let lines = phone(0..3000, true).into_iter().enumerate();
    let mut n = 0;
    let with_fields = lines.flat_map(|(k, line)| {
        n += u64::from(line.contains("gyroscope"));
        let own = (k % 20 == 0).then(|| field(n));
        own.into_iter().chain([line])
    });
    let got = Fed::of(&plan).lines(with_fields.collect::<Vec<_>>());
    assert_eq!(got.attitudes.len(), 3000);
    let last: Value = serde_json::from_str(got.attitudes.last().unwrap()).unwrap();
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| last["q"][c].as_f64().unwrap());
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    assert!(
        (yaw.to_degrees() - 30.0).abs() < 1.0,
        "{}",
        yaw.to_degrees()
    );
}

#[test]
fn a_push_with_gravity_in_it_levels_and_one_without_does_not() {
    let pushed = |name: &str, first: u64| {
        let of = |name: &str, n: u64, [x, y, z]: [f64; 3]| json!({"name": name, "time": START + n * 10_000_000, "values": {"x": x, "y": y, "z": z}});
        let payload: Vec<Value> = (first..first + 100)
            .flat_map(|n| {
                let (sin, cos) = true_roll(n).sin_cos();
                let gravity = if name == "totalacceleration" {
                    9.81
                } else {
                    0.0
                };
                [
                    of(name, n, [0.0, gravity * sin, gravity * cos]),
                    of(
                        "gyroscope",
                        n,
                        [0.18 * (0.9 * n as f64 * 0.01).cos(), 0.0, 0.0],
                    ),
                    of("barometer", n, [1.0, 2.0, 3.0]),
                ]
            })
            .collect();
        json!({"messageId": 1, "deviceId": "d", "payload": payload}).to_string()
    };
    for (name, world, off_by) in [
        ("totalacceleration", "level", 0.0),
        ("accelerometer", "start", 0.3),
    ] {
        let mut fed = Fed::of(&auto());
        let got = fed.lines((0..10).map(|part| pushed(name, part * 100)));
        let source = source(&fed);
        assert_eq!(
            (&source["samples"], &source["world"], &source["lost"]),
            (&json!(1000), &json!(world), &json!(0)),
            "{source}"
        );
        let off = roll(got.attitudes.last().unwrap()) - (true_roll(999) - off_by).to_degrees();
        assert!(off.abs() < 0.3, "{name}: {off}");
    }
}

#[test]
fn a_rate_that_is_null_is_still_one_that_is_missing() {
    let mut fed = Fed::of(&auto());
    fed.lines(phone(0..10, true));
    let null = format!(
        "{{\"class\":\"RATE\",\"id\":\"phone\",\"stamp_ns\":{},\"gyro\":null,\"accel\":[0,0,9.8]}}",
        START + 200_000_000
    );
    let absent = null
        .replace("\"gyro\":null,", "")
        .replace("000000,", "000001,");
    assert_ne!(null, absent);
    fed.lines([null, absent]);
    assert_eq!(source(&fed)["counts"]["no_gyro"], 2);
}
