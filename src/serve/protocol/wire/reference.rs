//! An attitude that truly was, as a simulation says it -> what is shown beside the estimates. Pure.

use super::{StampObject, object};
use crate::serve::guard::fault::Fault;
use crate::sink::{Content, Stream};
use serde::Deserialize;
use std::collections::BTreeMap;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};
use strapd_attitude::worlds::World;
use strapd_recording::attitude_line::sensor_of_truth;

/// Example of what is expected.
const EXPECTED: &str = "{\"class\":\"ATT\",\"id\":\"truth\",\"stamp\":{\"sec\":1,\"nsec\":0},\"q\":{\"w\":1,\"x\":0,\"y\":0,\"z\":0},\"world\":\"enu\",\"body\":\"flu\"}";

/// One attitude, and what it is of.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Id: `truth`, or that of a sensor and `truth` behind it.
    pub id: String,
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
pub(super) fn read(id: &str, line: &[u8]) -> Result<Reference, Fault> {
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
        id: id.to_owned(),
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
            temperature: None,
        },
    })
}

/// The stream of those with its `id`.
#[must_use]
pub fn stream(of: &Reference) -> Stream {
    let topic = match sensor_of_truth(&of.id) {
        None | Some("") => "/truth".to_owned(),
        Some(sensor) => format!("{}/truth", sensor.trim_end_matches('/')),
    };
    Stream {
        content: Content::Truth,
        id: of.id.clone(),
        output_topic: topic.clone(),
        world_axes: of.world.to_string(),
        body_axes: of.body.to_owned(),
        ..Stream::new(&topic, &of.id)
    }
}
