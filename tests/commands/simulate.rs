//! Promise: a synthetic log has the truth in it, replay finds it to rounding, and what a sensor's
//! errors make of it stays within what replay says of itself.

mod carried;
mod errors;
mod layout;
mod magnetometer;
mod refused;
mod truth;

use std::path::Path;

/// Largest error in degrees of `estimate` against `reference`, and how many attitudes were compared.
fn largest_error(dir: &Path, estimate: &str, reference: &str) -> (f64, u64) {
    let result =
        crate::program::strapd(dir, &format!("compare {estimate} {reference} --json")).json();
    (
        result["total"]["max_deg"].as_f64().unwrap(),
        result["samples"].as_u64().unwrap(),
    )
}
