//! Type of a channel -> its schema, with the fields that are wanted of it. Pure.
//!
//! Apart from the decoder because a schema comes from three places: the recording's own text, a descriptor, or, where a
//! recorder left it out, a type whose name means the same everywhere.

use super::schema::rosmsg::Dialect;
use super::schema::{Schema, builtin, descriptor, idl, ros_name, rosmsg};
use super::select::{Selection, select};
use super::{Channel, Options, Slot, Wanted, refusal};
use strapd_attitude::setting::{FIELD, TOPIC};

/// The definition of the type of this name as `ros2msg`, where it is the same in every ROS 2.
pub(crate) fn known_definition(type_name: &str) -> Option<String> {
    builtin::definition(&ros_name(type_name))
}

/// Schema of a type whose name means the same everywhere.
pub(super) fn well_known(channel: &Channel<'_>) -> Result<Schema, (String, String)> {
    let dialect = match channel.message_encoding {
        "cdr" => Dialect::Ros2,
        _ => Dialect::Ros1,
    };
    builtin::schema(&ros_name(channel.schema_name), dialect)
        .filter(|_| matches!(channel.message_encoding, "cdr" | "ros1"))
        .ok_or_else(|| (String::new(), String::new()))
}

/// The schema with the fields that are wanted of it.
pub(super) fn understand(
    channel: &Channel<'_>,
    schema: Result<Schema, (String, String)>,
    options: &Options,
) -> Result<(Schema, Selection), (String, String)> {
    let schema = schema?;
    let selection = select(&schema, channel.schema_name, options).map_err(|why| {
        (
            why,
            format!("paths are names between dots: {FIELD} gyro=imu.angular_velocity"),
        )
    })?;
    let (_, slot, numbers) = options.wanted.numbers();
    let is_reference = options.wanted == Wanted::Rates && selection.has(Slot::ORIENTATION, 4);
    if selection.has(slot, numbers) || is_reference {
        return Ok((schema, selection));
    }
    Err(nothing_wanted("type", options.wanted))
}

/// Why a type or message is of no use, and what helps.
pub(super) fn nothing_wanted(what: &str, wanted: Wanted) -> (String, String) {
    let (lacks, help) = match wanted {
        Wanted::Rates => (
            "body rate and no orientation",
            format!("name it: {FIELD} gyro=PATH"),
        ),
        Wanted::Forces => ("specific force", format!("name it: {FIELD} accel=PATH")),
        Wanted::Fields => ("magnetic field", format!("name it: {FIELD} mag=PATH")),
        Wanted::Temperatures => ("temperature", format!("name it: {FIELD} temperature=PATH")),
    };
    let why = format!("the {what} has no {lacks} under a name this program knows");
    (why, help)
}

pub(super) fn read_schema(channel: &Channel<'_>) -> Result<Schema, (String, String)> {
    let dialect = match channel.message_encoding {
        "cdr" => Dialect::Ros2,
        "ros1" => Dialect::Ros1,
        "protobuf" => {
            return descriptor::parse(channel.schema_data, channel.schema_name)
                .map_err(|why| (why, String::new()));
        }
        _ => {
            return Err((
                "its message encoding is not one this program reads (cdr, ros1, json, protobuf)"
                    .to_owned(),
                format!("choose another topic with {TOPIC}"),
            ));
        }
    };
    let text = std::str::from_utf8(channel.schema_data)
        .map_err(|_| ("its schema is not UTF-8 text".to_owned(), String::new()))?;
    if text.trim().is_empty() {
        // std_msgs/Empty has an empty definition, too, but nothing in it is wanted.
        return builtin::schema(&ros_name(channel.schema_name), dialect).ok_or((
            refusal::UNDEFINED.to_owned(),
            refusal::defining(channel.schema_name),
        ));
    }
    match channel.schema_encoding {
        "ros2idl" | "omgidl" => idl::parse(text, channel.schema_name),
        "ros2msg" | "ros1msg" => rosmsg::parse(text, channel.schema_name, dialect),
        _ => Err(
            "its schema encoding is not one this program reads (ros2msg, ros2idl, ros1msg)"
                .to_owned(),
        ),
    }
    .map_err(|why| (why, String::new()))
}
