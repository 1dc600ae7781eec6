//! `HEADING` -> a heading that something else than the sensor has measured. Pure.

use super::{Fault, StampObject, name, object};
use serde::Deserialize;
use strapd_attitude::aid::OutsideHeading;
use strapd_attitude::record::Nanos;

/// Measurement of a heading from outside.
#[derive(Clone, PartialEq, Debug)]
pub struct MeasuredHeading {
    /// Sensor whose heading it is; `None` = the one without a name.
    pub id: Option<String>,
    /// Stamp on the clock of the sensor's samples; without one it is of its next sample.
    pub stamp: Option<Nanos>,
    /// Heading and its sigma, rad.
    pub measured: OutsideHeading,
}

#[derive(Deserialize)]
struct HeadingObject {
    id: Option<String>,
    stamp: Option<StampObject>,
    heading: f64,
    sigma: f64,
}

/// Reads what such a line says.
pub(super) fn read(text: &[u8]) -> Result<MeasuredHeading, Fault> {
    let said: HeadingObject = object(
        text,
        "bad_heading",
        "degrees, like {\"class\":\"HEADING\",\"id\":\"imu0\",\"heading\":90,\"sigma\":3}",
    )?;
    checked(said)
}

/// Reads a line without a class that can be nothing else.
pub(super) fn bare(text: &[u8]) -> Option<Result<MeasuredHeading, Fault>> {
    serde_json::from_slice(text).ok().map(checked)
}

fn checked(said: HeadingObject) -> Result<MeasuredHeading, Fault> {
    let id = said.id.filter(|id| !id.is_empty());
    let id = id.as_deref().map(name).transpose()?;
    let measured = OutsideHeading {
        heading: said.heading.to_radians(),
        sigma: said.sigma.to_radians(),
    };
    if !measured.is_plausible() {
        return Err(Fault {
            id,
            ..Fault::new(
                "bad_heading",
                "`heading` is in degrees, ten turns at most; `sigma`, in degrees, above 0 and 360 at most",
            )
        });
    }
    Ok(MeasuredHeading {
        id,
        stamp: said.stamp.map(StampObject::nanos),
        measured,
    })
}
