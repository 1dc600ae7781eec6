//! Lines that say what packed objects are, and what is wrong with them. Pure.

use super::Fault;
use crate::sink::{Content, Stream};
use bytes::Bytes;
use serde_json::Value;
use strapd_recording::decode::Line;
use strapd_recording::decode::packed::{Unbound, Unreadable, binding};

/// The number of a stream of packed samples, and what each of them says as a line would.
pub(super) fn read(line: &[u8]) -> Result<(u32, Line), Fault> {
    binding(line).map_err(|why| match why {
        Unbound::Name(why) => super::undecodable(&why),
        Unbound::Object { column, .. } => Fault {
            column: Some(column),
            ..Fault::new("bad_packed", why.to_string())
        },
        Unbound::Word { .. } => Fault::new("bad_packed", why.to_string()),
    })
}

/// The fault of a packed object that says nothing.
#[must_use]
pub fn unreadable(why: &Unreadable) -> Fault {
    Fault::new("bad_packed", why.to_string())
}

/// The fault of a packed object whose end cannot be found.
#[must_use]
pub fn broken_packed() -> Fault {
    Fault::new(
        "bad_packed",
        "a packed object whose length is less than 8, or that was cut short; what follows is skipped up to the next line end",
    )
}

/// Line of the labels of the stream whose packed objects have the number `number`.
#[must_use]
pub fn packed_stream(number: u32, stream: &Stream) -> Bytes {
    let labels = match stream.content {
        Content::Samples(kind) => vec![("sample_kind", kind.name())],
        Content::Attitude | Content::Truth => vec![
            ("rotates", &*stream.rotates),
            ("world", &stream.world_axes),
            ("body", &stream.body_axes),
        ],
    };
    // By hand: the class comes first.
    let mut said = format!("{{\"class\":\"PACKED\",\"stream\":{number}");
    for (name, value) in [("id", &*stream.id)].into_iter().chain(labels) {
        said += &format!(",\"{name}\":{}", Value::from(value));
    }
    said += "}\n";
    said.into()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use strapd_attitude::record::SampleKind;
    use strapd_recording::decode::{Class, GyroUnit};

    #[test]
    fn a_number_is_bound_to_what_a_line_would_say() {
        let bound = |rest: &str| read(format!("{{\"class\":\"PACKED\",{rest}}}").as_bytes());
        let line = Line {
            class: Class::Rate,
            gyro_unit: Some(GyroUnit::Rad),
            ..Line::default()
        };
        assert_eq!(bound(r#""stream":0"#), Ok((0, line.clone())));
        let named = Line {
            id: Some("a\"é".to_owned()),
            sample_kind: Some(SampleKind::DeltaAngle),
            gyro_unit: Some(GyroUnit::Mrad),
            ..line
        };
        assert_eq!(
            bound(
                r#""stream":4294967295,"id":"a\"é","sample_kind":"delta-angle","gyro_unit":"mrad","x":[]"#
            ),
            Ok((u32::MAX, named))
        );
        assert_eq!(
            bound(r#""stream":1,"id":"a\u001b""#).unwrap_err().code,
            "bad_id"
        );
        for rest in [
            r#""id":"a""#,
            r#""stream":-1"#,
            r#""stream":4294967296"#,
            r#""stream":"1""#,
            r#""stream":1,"id":7"#,
            r#""stream":1,"sample_kind":"rates""#,
            r#""stream":1,"gyro_unit":"rpm""#,
        ] {
            assert_eq!(bound(rest).unwrap_err().code, "bad_packed", "{rest}");
        }
    }

    #[test]
    fn a_stream_of_samples_is_announced_as_a_sender_would_bind_it() {
        let mut stream = Stream::new("/imu", "imu");
        stream.id = "a\"é".to_owned();
        stream.content = Content::Samples(SampleKind::Average);
        let said = packed_stream(7, &stream);
        let (number, head) = read(&said).unwrap();
        assert_eq!((number, head.id.as_deref()), (7, Some("a\"é")));
        assert_eq!(head.sample_kind, Some(SampleKind::Average));
    }
}
