//! Tests of what is kept over a restart, and of what is refused.

use super::*;
use crate::serve::core::hub::{Hub, Settings};
use crate::serve::core::session::{Scratch, Session};
use nalgebra::Vector3;
use serde_json::Value;
use std::sync::Arc;
use strapd_attitude::estimate::{Aid, EstimationSettings};

fn sample() -> AttitudeSample {
    AttitudeSample {
        stamp: Nanos(1_700_000_000_123_456_789),
        q_nb: Quaternion::assume_unit([0.6, 0.0, 0.8, 0.0]),
        rate: BodyRate(Vector3::new(0.1, 0.2, 1.0 / 3.0)),
        accel: None,
        linear_acceleration: None,
        covariance: AttitudeCovariance::from_sigma(Vector3::new(0.1, 0.2, 0.3)),
        status: Status::OK,
        reset_count: 3,
        log: Nanos(1_700_000_000_123_456_789),
        temperature: None,
    }
}

/// A daemon that goes on from these with samples at these hundredths of a second; how uncertain the last attitude is, as a client
/// is told.
fn gone_on(saved: Sensors, samples: impl Iterator<Item = u64>) -> (Sensors, Value) {
    let settings = Settings {
        saved,
        plan: EstimationSettings {
            aid: Aid::Gravity,
            ..EstimationSettings::default()
        },
        ..Settings::default()
    };
    let hub = Arc::new(Hub::new(settings).unwrap());
    let mut session = Session::new(&hub, "sender".to_owned(), true);
    let mut scratch = Scratch::default();
    for n in samples {
        let (secs, nanos) = (1_700_000_000 + n / 100, n % 100 * 10_000_000);
        let line = format!(
            "{{\"id\":\"imu\",\"stamp\":{{\"sec\":{secs},\"nsec\":{nanos}}},\"gyro\":[0.01,-0.02,0.{n:03}],\"accel\":[0.1,0.2,9.8],\"mag\":[20,5,-40]}}\n",
            n = n % 7
        );
        session.bytes(line.as_bytes(), Nanos(0), &mut scratch);
        while session.is_held() {
            session.go_on(&mut scratch);
        }
    }
    let status: Value = serde_json::from_slice(&hub.status()).unwrap();
    (
        hub.saved(),
        status["sources"][0]["attitude"]["sigma_deg"].clone(),
    )
}

/// Calls with every number of a value changed in turn.
fn changed(value: &Value, to: &[f64], call: &mut impl FnMut(String, Value)) {
    let pointers = {
        let mut all = Vec::new();
        let mut open = vec![(String::new(), value)];
        while let Some((at, value)) = open.pop() {
            match value {
                Value::Number(_) => all.push(at),
                Value::Array(some) => {
                    open.extend(
                        some.iter()
                            .enumerate()
                            .map(|(n, v)| (format!("{at}/{n}"), v)),
                    );
                }
                Value::Object(some) => {
                    open.extend(some.iter().map(|(name, v)| (format!("{at}/{name}"), v)));
                }
                _ => {}
            }
        }
        all
    };
    for at in pointers {
        for number in to {
            let mut other = value.clone();
            if let Some(place) = other.pointer_mut(&at) {
                *place = (*number).into();
            }
            call(format!("{at} = {number:e}"), other);
        }
    }
}

#[test]
fn a_number_that_cannot_be_is_refused_or_does_no_lasting_harm() {
    let (sensors, sigma) = gone_on(Sensors::new(), 0..500);
    assert!(sigma["tilt"].is_f64(), "{sigma}");
    let text = serde_json::to_value(&sensors).unwrap();
    let (mut refused, mut taken, mut harmed) = (0, 0, Vec::new());
    changed(&text, &[-1e308, 1e308, -1.0], &mut |what, other| {
        let Ok(sensors) = serde_json::from_value::<Sensors>(other) else {
            refused += 1;
            return;
        };
        if check(&sensors).is_err() {
            refused += 1;
            return;
        }
        taken += 1;
        let (after, sigma) = gone_on(sensors, 500..1000);
        let is_known = |name: &str| {
            let sigma = sigma[name].as_f64();
            sigma.is_some_and(|s| (0.0..1e3).contains(&s))
        };
        // What it leaves is taken again.
        if !is_known("tilt") || !is_known("heading") || check(&after).is_err() {
            harmed.push(format!("{what}: {sigma} {:?}", check(&after)));
        }
    });
    assert!(harmed.is_empty(), "{harmed:#?}");
    assert!(refused > taken && taken > 0, "{refused} {taken}");
    // The one that was found, and the words.
    let mut other = text.clone();
    other["imu"]["covariance"][0] = (-1e308).into();
    let why = check(&serde_json::from_value(other).unwrap()).unwrap_err();
    assert_eq!(why, "sensor imu: `covariance` is none");
}

/// Each pause of half a minute adds 3 rad^2 to what is unknown of the heading.
#[test]
fn a_sensor_that_was_away_often_is_saved_all_the_same() {
    let paused = (0..4000).map(|n| n + n / 20 * 3000);
    let (sensors, _) = gone_on(Sensors::new(), paused);
    let heading = sensors["imu"].covariance[5];
    assert!(heading > 1000.0, "{heading}");
    assert_eq!(check(&sensors), Ok(()));
}

#[test]
fn what_was_saved_comes_back_to_the_bit_and_only_between_the_same_axes() -> Result<()> {
    let dir = std::env::temp_dir().join(format!("strapd-state-{}", std::process::id()));
    std::fs::create_dir_all(&dir).map_err(|e| Error::usage(e.to_string()))?;
    let path = dir.join("s.json");
    let labels = sink::Stream::new("imu", "");
    let (mut file, found) = StateFile::open(&path)?;
    assert!(found.is_empty());
    let sensors = Sensors::from([("imu".to_owned(), Saved::new(&sample(), &labels))]);
    file.write(&sensors)?;
    // One daemon at a time.
    let said = StateFile::open(&path).err().map(|e| e.to_string());
    assert!(said.is_some_and(|s| s.contains("is writing it")));
    drop(file);
    let (_, found) = StateFile::open(&path)?;
    assert_eq!(found, sensors);
    assert_eq!(
        found.get("imu").map(|s| s.attitude(&labels)),
        Some(Ok(sample()))
    );
    let other = sink::Stream {
        world_axes: "ned".to_owned(),
        ..labels
    };
    assert!(found.values().all(|s| s.attitude(&other).is_err()));

    for damaged in [
        "",
        "{}",
        "{\"strapd_state\":3,\"sensors\":{}}",
        "\u{0}\u{0}",
    ] {
        std::fs::write(&path, damaged).map_err(|e| Error::usage(e.to_string()))?;
        let said = StateFile::open(&path).err().map(|e| e.to_string());
        assert!(
            said.is_some_and(|s| s.contains("move it away")),
            "{damaged}"
        );
    }
    std::fs::remove_dir_all(&dir).map_err(|e| Error::usage(e.to_string()))
}
