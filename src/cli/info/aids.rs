//! Measurements that may correct an attitude -> words. Pure.

use crate::report::summary::significant;
use strapd_recording::recording::beside::TopicOfVectors;
use strapd_recording::text::printable;
use strapd_replay::info::field_unit;
use strapd_replay::inspection::Aids;
use strapd_replay::shell::flag;

/// Topics that are named.
const NAMED: usize = 6;

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
            "first of length {}: uncalibrated; magnitude does not match the Earth's field",
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
