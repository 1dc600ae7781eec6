//! What may correct an attitude -> words, JSON. Pure.

use crate::cli::shell::flag;
use crate::report::summary::significant;
use serde_json::{Value, json};
use strapd_recording::recording::beside::TopicOfVectors;
use strapd_recording::text::printable;
use strapd_replay::inspection::Aids;

/// Units of a field by the length of the Earth's, 22 to 67 uT, with room for what iron does to it.
const FIELD_UNITS: [(&str, f64); 5] = [
    ("T", 1.0),
    ("G", 1e-4),
    ("mG", 1e-7),
    ("uT", 1e-6),
    ("nT", 1e-9),
];
const EARTHS_FIELD: std::ops::Range<f64> = 1.5e-5..1e-4;
/// Topics that are named.
const NAMED: usize = 6;

/// The unit in which a field of this length is the Earth's, where there is one.
fn field_unit(length: f64) -> Option<&'static str> {
    let fits = |(_, tesla): &&(&str, f64)| EARTHS_FIELD.contains(&(length * tesla));
    FIELD_UNITS.iter().find(fits).map(|(name, _)| *name)
}

/// Lines for people: the force, the field, what to say.
pub(super) fn lines(aids: &Aids) -> Vec<String> {
    let mut said = vec![force(aids)];
    said.extend(
        aids.forces
            .iter()
            .take(NAMED)
            .filter(|_| !aids.gravity)
            .map(|t| {
                format!(
                    "force: {} ({}{}): {} takes it",
                    printable(&t.topic),
                    t.described,
                    rate(t),
                    flag("--aid gravity --accel-topic", &t.topic)
                )
            }),
    );
    said.extend(field(aids));
    said
}

fn force(aids: &Aids) -> String {
    let Some(mean) = aids.mean_force.filter(|_| aids.has_force) else {
        return "aid: no specific force in these messages: --aid auto is the gyro alone".to_owned();
    };
    let unit = if aids.force_scale == 1.0 {
        "m/s^2"
    } else {
        "g"
    };
    let mean = significant(mean, 4);
    if aids.gravity {
        format!(
            "aid: specific force of mean length {mean} {unit}: --aid auto takes gravity (--aid none: the gyro alone)"
        )
    } else {
        format!(
            "aid: the accelerations have a mean length of {mean}, which is no gravity (force_implausible): --aid auto is the gyro alone"
        )
    }
}

fn rate(topic: &TopicOfVectors) -> String {
    topic
        .rate_hz
        .map_or_else(String::new, |hz| format!(", {} Hz", significant(hz, 3)))
}

fn strength(length: Option<f64>) -> String {
    let Some(length) = length else {
        return "its length is not known".to_owned();
    };
    match field_unit(length) {
        Some(unit) => format!("first of length {}, {unit} by that", significant(length, 3)),
        None => format!(
            "first of length {}, the Earth's in no unit: calibrated it is not",
            significant(length, 3)
        ),
    }
}

fn field(aids: &Aids) -> Vec<String> {
    if let Some(length) = aids.own_field {
        return vec![format!(
            "field: in these messages, {}: --aid gravity+mag takes the heading from it",
            strength(Some(length))
        )];
    }
    let (fields, taken) = &aids.fields;
    fields
        .iter()
        .take(NAMED)
        .map(|t| {
            let how = match taken {
                Some(name) if *name == t.topic => "--aid gravity+mag".to_owned(),
                _ => flag("--aid gravity+mag --mag-topic", &t.topic),
            };
            format!(
                "field: {} ({}{}), {}: {how} takes the heading from it",
                printable(&t.topic),
                t.described,
                rate(t),
                strength(t.first)
            )
        })
        .collect()
}

/// For machines.
pub(super) fn aids_json(aids: &Aids) -> Value {
    let topic = |t: &TopicOfVectors| {
        json!({ "topic": t.topic, "decoded_as": t.described, "rate_hz": t.rate_hz,
                "first_length": t.first })
    };
    let of_field = |t: &TopicOfVectors| {
        let mut value = topic(t);
        if let Some(object) = value.as_object_mut() {
            object.insert("unit".to_owned(), t.first.and_then(field_unit).into());
        }
        value
    };
    json!({
        "auto": if aids.gravity { "gravity" } else { "none" },
        "force": aids.has_force.then(|| json!({
            "mean_length": aids.mean_force,
            "unit": if aids.force_scale == 1.0 { "m/s^2" } else { "g" },
            "plausible": aids.gravity,
        })),
        "field": aids.own_field.map(|length| json!({
            "first_length": length, "unit": field_unit(length) })),
        "field_topics": aids.fields.0.iter().map(of_field).collect::<Vec<_>>(),
        "field_topic_taken": aids.fields.1,
        "force_topics": aids.forces.iter().map(topic).collect::<Vec<_>>(),
        "notes": aids.notes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earth_s_field_shows_its_unit() {
        for (length, unit) in [
            (4.9e-5, Some("T")),
            (0.49, Some("G")),
            (490.0, Some("mG")),
            (49.0, Some("uT")),
            (49_000.0, Some("nT")),
            (1.0, None),
            (5000.0, None),
            (f64::NAN, None),
        ] {
            assert_eq!(field_unit(length), unit, "{length}");
        }
    }
}
