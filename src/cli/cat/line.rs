//! A sample -> the `RATE` object that `replay` and the service read. Pure.

use serde_json::{Value, json};
use strapd_attitude::record::{RawSample, SampleKind};

/// The object of sample number `seq` of the sensor `id`, in the units and axes it has here: what is absent is left
/// out, NaN becomes null. `kind` is what the format says the sample means. What is of another sensor than the gyro is no
/// `RATE`, and has no number.
pub(in crate::cli) fn rate(id: &str, seq: u64, raw: &RawSample, kind: Option<SampleKind>) -> Value {
    let (sec, nsec) = raw.header.unwrap_or(raw.log).to_sec_nanosec();
    let stamp = json!({ "sec": sec, "nsec": nsec });
    let mut object = match raw.is_beside {
        true => json!({ "id": id, "stamp": stamp }),
        false => json!({ "class": "RATE", "id": id, "seq": seq, "stamp": stamp }),
    };
    if let Some(map) = object.as_object_mut() {
        let mut put = |key: &str, value: Value| map.insert(key.to_owned(), value);
        // The clock that is used where the stamps are of none.
        if raw.header.is_some_and(|header| header != raw.log) {
            put("log_ns", json!(raw.log.0));
        }
        for (key, vector) in [("gyro", raw.gyro), ("accel", raw.accel), ("mag", raw.mag)] {
            if let Some(vector) = vector {
                put(key, json!(vector));
            }
        }
        if let Some([w, x, y, z]) = raw.orientation {
            put("q", json!({ "w": w, "x": x, "y": y, "z": z }));
        }
        if let Some(interval) = raw.interval_nanos {
            put("dt_ns", json!(interval));
        }
        // With its own digits: as the nearest double it would have more.
        let digits = |temperature: f32| temperature.to_string().parse::<f64>().ok();
        let stated = raw
            .temperature
            .filter(|temperature| temperature.is_finite());
        if let Some(temperature) = stated.and_then(digits) {
            put("temperature_c", json!(temperature));
        }
        if let Some(kind) = kind {
            put("sample_kind", json!(kind.name()));
        }
    }
    object
}
