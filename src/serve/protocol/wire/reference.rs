//! An attitude that truly was, as a simulation says it -> what is shown beside the estimates. Pure.

use super::{StampObject, object};
use crate::serve::guard::fault::Fault;
use crate::sink::{Content, Stream};
use serde::Deserialize;
use std::collections::BTreeMap;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};
use strapd_attitude::worlds::World;

/// The only `id` it may have.
pub const TRUTH: &str = "truth";

/// Example of what is expected.
const EXPECTED: &str = "{\"class\":\"ATT\",\"id\":\"truth\",\"stamp\":{\"sec\":1,\"nsec\":0},\"q\":{\"w\":1,\"x\":0,\"y\":0,\"z\":0},\"world\":\"enu\",\"body\":\"flu\"}";

/// One attitude, and what it is of.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// World from whose axes it comes.
    pub world: World,
    /// Body axes to which it leads.
    pub body: &'static str,
    /// The attitude.
    pub sample: AttitudeSample,
}

#[derive(Deserialize)]
struct ReferenceObject {
    stamp: StampObject,
    /// Components by name: a bare array does not state which is the scalar.
    q: BTreeMap<String, f64>,
    rate: Option<[f64; 3]>,
    #[serde(default)]
    world: String,
    #[serde(default)]
    body: String,
}

/// Reads the line of one.
///
/// # Errors
/// `bad_reference`, in words.
pub(super) fn read(line: &[u8]) -> Result<Reference, Fault> {
    const CODE: &str = "bad_reference";
    let said: ReferenceObject = object(line, CODE, EXPECTED)?;
    let wrong = |what: &str| Fault::new(CODE, format!("{what}; expected {EXPECTED}"));
    let nanos = said.stamp.sec.checked_mul(1_000_000_000);
    let stamp = nanos.and_then(|n| n.checked_add(i64::from(said.stamp.nsec)));
    let stamp = stamp.ok_or_else(|| wrong("the stamp is out of range"))?;
    let wxyz = ["w", "x", "y", "z"].map(|name| said.q.get(name).copied().unwrap_or(f64::NAN));
    let q_nb = Quaternion::try_from_wxyz(wxyz).map_err(|_| wrong("q is no rotation"))?;
    let world = said
        .world
        .parse()
        .map_err(|_| wrong("the world is none of enu, ned, nwu, level, start"))?;
    let body = match said.body.as_str() {
        "flu" => "flu",
        "frd" => "frd",
        _ => return Err(wrong("the body is neither flu nor frd")),
    };
    let nothing = [f64::NAN; 3];
    let rate = said.rate.filter(|rate| rate.iter().all(|v| v.is_finite()));
    Ok(Reference {
        world,
        body,
        sample: AttitudeSample {
            stamp: Nanos(stamp),
            q_nb,
            rate: BodyRate(rate.unwrap_or(nothing).into()),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::from_sigma(nothing.into()),
            status: Status::OK,
            reset_count: 0,
            log: Nanos(stamp),
        },
    })
}

/// The stream of all of them.
#[must_use]
pub fn stream(world: World, body: &str) -> Stream {
    Stream {
        content: Content::Truth,
        id: TRUTH.to_owned(),
        output_topic: "/truth".to_owned(),
        world_axes: world.to_string(),
        body_axes: body.to_owned(),
        ..Stream::new("/truth", TRUTH)
    }
}
