//! An attitude -> messages of Open Sound Control. Pure.
//!
//! Written here rather than by a crate: an address, the types, and big-endian floats, each text filled up with zeros to
//! four bytes, are all there is to it.
//!
//! # Source
//! Open Sound Control 1.0 (opensoundcontrol.stanford.edu/spec-1_0.html); the VMC protocol, performer to marionette
//! (protocol.vmc.info): `/VMC/Ext/Tra/Pos` with a name, a position in m and a quaternion x, y, z, w in Unity's axes.

use crate::sink::axes::{roll_pitch_yaw, unity};

/// Appends a text with its zeros.
fn push_text(out: &mut Vec<u8>, text: &str) {
    out.extend(text.bytes().filter(|b| *b != 0));
    out.push(0);
    while !out.len().is_multiple_of(4) {
        out.push(0);
    }
}

fn push_floats(out: &mut Vec<u8>, numbers: &[f64]) {
    for number in numbers {
        out.extend_from_slice(&(*number as f32).to_be_bytes());
    }
}

/// The name of a sensor as part of an address: what has a meaning there, or is no ASCII, is an underscore.
fn as_address(id: &str) -> String {
    let letter = |c: char| match c {
        ' ' | '#' | '*' | ',' | '?' | '[' | ']' | '{' | '}' => '_',
        c if c.is_ascii_graphic() => c,
        _ => '_',
    };
    id.trim_matches('/').chars().map(letter).collect()
}

/// Makes `/strapd/ID/quaternion` (w, x, y, z) and `/strapd/ID/euler` (roll, pitch, yaw in degrees) of an attitude in its own
/// world.
pub(super) fn messages(id: &str, q: [f64; 4]) -> [Vec<u8>; 2] {
    let id = as_address(id);
    let angles = roll_pitch_yaw(q).map(f64::to_degrees);
    [("quaternion", ",ffff", &q[..]), ("euler", ",fff", &angles)].map(|(what, types, numbers)| {
        let mut out = Vec::with_capacity(64);
        push_text(&mut out, &format!("/strapd/{id}/{what}"));
        push_text(&mut out, types);
        push_floats(&mut out, numbers);
        out
    })
}

/// Appends the message of a tracker of the VMC protocol; `q` of [`north_west_up`](crate::sink::axes::north_west_up).
pub(super) fn push_tracker(out: &mut Vec<u8>, id: &str, q: [f64; 4]) {
    push_text(out, "/VMC/Ext/Tra/Pos");
    push_text(out, ",sfffffff");
    push_text(out, id);
    push_floats(out, &[0.0; 3]);
    push_floats(out, &unity(q));
}
