//! Frames of a robot in its own recording -> how the sensor is mounted on it. I/O.
//!
//! Apart from the replay because it is known before a sample is understood: it takes the place of a setting.

use crate::error::{Error, Result};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::frames::{Body, Sensor};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::setting::{MOUNT, TOPIC};
use strapd_recording::pool::Pool;
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::static_transforms::StaticTransforms;
use strapd_recording::recording::topic_plan::TopicPlan;
use strapd_recording::{Input, Recording, Selection};

/// Reads the rotation from the sensor to the frame `base` of the robot it is on.
///
/// # Errors
/// The recording cannot be read, has several sensors and none named, a sensor without a frame, or no way from it to
/// the base.
pub fn read(
    input: &Input,
    selection: &Selection,
    base: &str,
    pool: &Pool,
) -> Result<Quaternion<Body, Sensor>> {
    let path = input.name();
    let topic = selection.topic.as_deref();
    let log = Recording::told_apart(input, topic, &selection.decode, pool)?;
    let refused = |what: Diagnostic| Error::from(strapd_recording::Error::unsupported(path, what));
    let names = log.choose(path, topic)?.topics;
    let [name] = names.as_slice() else {
        let what = format!(
            "--base-frame {base}: {} sensors, and a mounting is of one",
            names.len()
        );
        return Err(refused(Diagnostic::new(what).help(format!("{TOPIC} NAME"))));
    };
    let frame = TopicPlan::named(&log, name, &mut Decoders::default())?.frame();
    if frame.is_empty() {
        let what = format!("--base-frame {base}: the messages of {name} name no frame");
        let help = format!("{MOUNT} q=W,X,Y,Z says how it is mounted");
        return Err(refused(Diagnostic::new(what).help(help)));
    }
    let found = StaticTransforms::of(&log, pool)?.rotation(&frame, base);
    let turn = found.map_err(|why| {
        refused(
            why.at(format_args!("--base-frame {base}"))
                .help(format!("{MOUNT} q=W,X,Y,Z says how it is mounted")),
        )
    })?;
    Ok(Quaternion::assume_unit(turn.wxyz()))
}
