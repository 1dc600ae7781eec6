//! Numbers, names, stamps and status words -> the bytes of JSON, CSV and TUM. Pure.
//!
//! Floats are the shortest decimals that read back to the same bits. JSON has no NaN: what is not
//! finite is `null`.

use super::Transforms;
use serde_json::ser::{CompactFormatter, Formatter};
use strapd_attitude::record::{AttitudeSample, Nanos};

/// Appends the shortest decimal that reads back to the same bits, or `null`.
pub(super) fn push_f64(out: &mut Vec<u8>, value: f64) {
    if value.is_finite() {
        // A Vec takes every write.
        let _ = CompactFormatter.write_f64(out, value);
    } else {
        out.extend_from_slice(b"null");
    }
}

/// Appends an integer.
pub(super) fn push_i64(out: &mut Vec<u8>, value: i64) {
    let _ = CompactFormatter.write_i64(out, value);
}

pub(super) fn push_u64(out: &mut Vec<u8>, value: u64) {
    let _ = CompactFormatter.write_u64(out, value);
}

/// Appends `"text"` with what needs escaping escaped.
pub(super) fn push_string(out: &mut Vec<u8>, text: &str) {
    // Serialising a str into a Vec has no way to fail.
    let _ = serde_json::to_writer(out, text);
}

pub(super) fn push_array3(out: &mut Vec<u8>, v: [f64; 3]) {
    out.push(b'[');
    push_f64(out, v[0]);
    out.push(b',');
    push_f64(out, v[1]);
    out.push(b',');
    push_f64(out, v[2]);
    out.push(b']');
}

/// `{"sec":..,"nsec":..}`: exact in every JSON parser, which 19 digits in one number are not.
pub(super) fn push_stamp(out: &mut Vec<u8>, stamp: Nanos) {
    let (sec, nsec) = stamp.to_sec_nanosec();
    out.extend_from_slice(b"{\"sec\":");
    push_i64(out, sec);
    out.extend_from_slice(b",\"nsec\":");
    push_u64(out, u64::from(nsec));
    out.push(b'}');
}

/// Appends the names of the status bits, `ok` when there are none.
pub(super) fn push_status(
    out: &mut Vec<u8>,
    sample: &AttitudeSample,
    quote: &[u8],
    separator: &[u8],
) {
    let mut names = sample.status.names();
    let mut name = Some(names.next().unwrap_or("ok"));
    while let Some(text) = name {
        out.extend_from_slice(quote);
        out.extend_from_slice(text.as_bytes());
        out.extend_from_slice(quote);
        name = names.next();
        if name.is_some() {
            out.extend_from_slice(separator);
        }
    }
}
/// Column, and key of an object, of the sensor's temperature, degrees Celsius.
pub(super) const TEMPERATURE: &str = "temperature_c";

/// Appends a temperature; nothing where there is none.
pub(super) fn push_temperature(out: &mut Vec<u8>, temperature: Option<f32>) {
    if let Some(value) = temperature {
        let _ = CompactFormatter.write_f32(out, value);
    }
}

/// Columns of the acceleration without gravity, m/s^2, behind the others of a table whose attitudes carry it: along the
/// body's axes, along the world's, one standard deviation along the body's.
pub(super) const ACCELERATIONS: [&str; 9] = [
    "linear_acceleration_x",
    "linear_acceleration_y",
    "linear_acceleration_z",
    "world_linear_acceleration_x",
    "world_linear_acceleration_y",
    "world_linear_acceleration_z",
    "sigma_linear_acceleration_x",
    "sigma_linear_acceleration_y",
    "sigma_linear_acceleration_z",
];

/// Numbers of the [columns](ACCELERATIONS); `None` of a sample without a specific force.
pub(super) fn accelerations(sample: &AttitudeSample) -> Option<[f64; 9]> {
    let of = sample.linear_acceleration?;
    let world = of.in_world(&sample.q_nb);
    let vectors = [of.body.as_vector(), world.as_vector(), &of.sigma()];
    Some(std::array::from_fn(|i| vectors[i / 3][i % 3]))
}

/// Parent and child of the transform between a world and a sensor.
pub(super) fn parent_and_child<'s>(
    way: Transforms,
    world: &'s str,
    sensor: &'s str,
) -> [&'s str; 2] {
    match way {
        Transforms::Reverse => [sensor, world],
        Transforms::Forward | Transforms::None => [world, sensor],
    }
}

/// Rotation of a transform, w, x, y, z: vectors of the child to the parent's.
pub(super) fn of_transform(way: Transforms, sample: &AttitudeSample) -> [f64; 4] {
    match way {
        Transforms::Reverse => sample.q_nb.inverse().wxyz(),
        Transforms::Forward | Transforms::None => sample.q_nb.wxyz(),
    }
}
