//! Names of an output stream: topics, frames, labels. Pure.

use super::Transforms;
use std::collections::{BTreeMap, BTreeSet};
use strapd_attitude::record::SampleKind;

/// The longest topic or frame written, in bytes. A hostile log can carry a name of 60 MB; it would
/// be repeated in every message.
const MAX_NAME_BYTES: usize = 255;

/// The frame a nameless sensor gets: tf2 refuses an empty child.
const NAMELESS_FRAME: &str = "body";

/// Content of a stream's samples, and so the messages they become.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Content {
    /// Estimated attitude ([`Sink::write`](super::Sink::write)): `sensor_msgs/msg/Imu` and `/tf`;
    /// `ATT` objects; rows.
    #[default]
    Attitude,
    /// Samples of a gyro ([`Sink::write_raw`](super::Sink::write_raw)): `sensor_msgs/msg/Imu`
    /// whose orientation is marked absent; `RATE` objects; rows in which a recorded orientation
    /// stands beside the sample.
    Samples(SampleKind),
    /// The attitude and rate that truly were ([`Sink::write`](super::Sink::write)):
    /// `geometry_msgs/msg/QuaternionStamped` and, on the topic with `/rate` behind it,
    /// `geometry_msgs/msg/Vector3Stamped`; `ATT` objects. A CSV has no place for it.
    Truth,
}

/// One estimated topic and what its output is called.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Stream {
    /// Content of its samples.
    pub content: Content,
    /// `id` of the `ATT` object: the input topic, unless something shorter is unambiguous.
    pub id: String,
    /// Topic from which the samples came.
    pub input_topic: String,
    /// Kind of those samples, where somebody states it.
    pub input_kind: Option<SampleKind>,
    /// Topic of the attitude ([`output_topic`]).
    pub output_topic: String,
    /// Topic of the magnetic field that samples carry; `None`: no channel is declared for it.
    pub field_topic: Option<String>,
    /// Whether its attitudes carry the acceleration without gravity.
    pub has_linear_acceleration: bool,
    /// Whether they carry the temperature of the sensor.
    pub has_temperature: bool,
    /// The frame whose attitude this is: `header.frame_id` of the Imu, child of the transform.
    pub frame_id: String,
    /// The frame it is given in: parent of the transform.
    pub world_frame: String,
    /// Transforms between the two.
    pub transforms: Transforms,
    /// Action of the quaternion: `sensor_to_world`, or `body_to_world` when a mounting was applied.
    pub rotates: String,
    /// Axes of the world: `start`, `enu`, `ned`, `nwu`.
    pub world_axes: String,
    /// Axes of the body: `flu`, `frd`, or an axis map.
    pub body_axes: String,
}

impl Stream {
    /// A stream with every default: world frame `world`, world axes `start`, body axes `flu`.
    #[must_use]
    pub fn new(input_topic: &str, frame_id: &str) -> Stream {
        Stream {
            content: Content::Attitude,
            id: input_topic.to_owned(),
            input_topic: input_topic.to_owned(),
            input_kind: None,
            output_topic: output_topic(input_topic, &BTreeSet::new()),
            field_topic: None,
            has_linear_acceleration: false,
            has_temperature: false,
            frame_id: frame_id.to_owned(),
            world_frame: "world".to_owned(),
            transforms: Transforms::Forward,
            rotates: "sensor_to_world".to_owned(),
            world_axes: "start".to_owned(),
            body_axes: "flu".to_owned(),
        }
    }

    /// Whether its attitudes come with transforms.
    #[must_use]
    pub fn has_transforms(&self) -> bool {
        self.content == Content::Attitude && self.transforms != Transforms::None
    }

    /// The same with every name cut to what can safely be repeated in each message.
    pub(super) fn bounded(&self) -> Stream {
        Stream {
            content: self.content,
            id: bounded(&self.id),
            input_topic: bounded(&self.input_topic),
            input_kind: self.input_kind,
            output_topic: bounded(&self.output_topic),
            field_topic: self.field_topic.as_deref().map(bounded),
            has_linear_acceleration: self.has_linear_acceleration,
            has_temperature: self.has_temperature,
            frame_id: bounded(&self.frame_id),
            world_frame: bounded(&self.world_frame),
            transforms: self.transforms,
            rotates: bounded(&self.rotates),
            world_axes: bounded(&self.world_axes),
            body_axes: bounded(&self.body_axes),
        }
    }
}

/// Names of the frames of attitudes, instead of those of the recording and `world`, and the transforms between them.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct FrameNames {
    /// `--frame-id`, or that of `--base-frame`: the frame whose attitude it is, of the one sensor of a run.
    pub body: Option<String>,
    /// `--world-frame`.
    pub world: Option<String>,
    /// `--tf`.
    pub transforms: Transforms,
}

impl FrameNames {
    /// Gives a stream these names.
    pub fn name(&self, stream: &mut Stream) {
        if let Some(world) = &self.world {
            stream.world_frame.clone_from(world);
        }
        if let Some(body) = &self.body {
            stream.frame_id.clone_from(body);
        }
        stream.transforms = self.transforms;
    }
}

/// Facts about the run that go into the file: version, command line, method, frames,
/// initial attitude, input hash.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Provenance {
    /// Key and value, as the reader will see them.
    pub metadata: BTreeMap<String, String>,
}

/// The topic the attitude of `input` is written to: `X/data_raw` becomes `X/data` (the habit of
/// ROS), anything else `X/attitude`.
///
/// `taken` holds the topics that are already in the file (those of `--copy-input`, and the outputs
/// named before); the answer is never one of them.
#[must_use]
pub fn output_topic(input: &str, taken: &BTreeSet<String>) -> String {
    let input = input.trim_end_matches('/');
    let attitude = format!("{input}/attitude");
    let ros = input
        .strip_suffix("data_raw")
        .filter(|rest| rest.is_empty() || rest.ends_with('/'))
        .map(|rest| format!("{rest}data"));
    ros.into_iter()
        .chain([attitude.clone()])
        .chain((2..).map(|n| format!("{attitude}_{n}")))
        .find(|name| !taken.contains(name))
        .unwrap_or(attitude)
}

/// The child frames of transforms: unique under their parent, not empty, without leading slash and not the world
/// itself, all of which tf2 refuses or confuses. The first free of `NAME`, `NAME_2`, `NAME_3`, ...
#[derive(Clone, Debug, Default)]
pub struct ChildFrames {
    /// Parent and child.
    used: BTreeSet<(String, String)>,
    /// Next numbers by parent and name: no number below this is free.
    next: BTreeMap<(String, String), u64>,
}

impl ChildFrames {
    /// The child of a further stream.
    pub fn take(&mut self, stream: &Stream) -> String {
        let world = parent_frame(stream);
        let next = self
            .next
            .entry((world.clone(), base_frame(stream).to_owned()))
            .or_insert(1);
        loop {
            let name = numbered(base_frame(stream), *next);
            *next += 1;
            if name != world && self.used.insert((world.clone(), name.clone())) {
                return name;
            }
        }
    }

    /// The stream with this child is no more.
    pub fn give_back(&mut self, stream: &Stream, child: &str) {
        let world = parent_frame(stream);
        let base = base_frame(stream);
        self.used.remove(&(world.clone(), child.to_owned()));
        let number = match child.strip_prefix(base) {
            Some("") => Some(1),
            rest => rest.and_then(|rest| rest.strip_prefix('_')?.parse().ok()),
        };
        if let (Some(next), Some(number)) = (self.next.get_mut(&(world, base.to_owned())), number) {
            *next = number.min(*next);
        }
    }
}

fn numbered(base: &str, number: u64) -> String {
    match number {
        0 | 1 => base.to_owned(),
        n => format!("{base}_{n}"),
    }
}

fn base_frame(stream: &Stream) -> &str {
    match stream.frame_id.trim_start_matches('/') {
        "" => NAMELESS_FRAME,
        own => own,
    }
}

/// The frame an attitude message names: the stream's own, or where it has none the child of its transform.
pub(super) fn named_frame<'s>(stream: &'s Stream, child: &'s str) -> &'s str {
    match stream.frame_id.as_str() {
        "" => child,
        own => own,
    }
}

/// The parent frame of a stream's transform.
pub(super) fn parent_frame(stream: &Stream) -> String {
    match stream.world_frame.trim_start_matches('/') {
        "" => "world".to_owned(),
        name => name.to_owned(),
    }
}

/// Shortens to at most [`MAX_NAME_BYTES`] bytes on a character boundary, and no NUL: CDR strings end at one.
fn bounded(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars().filter(|c| *c != '\0') {
        if out.len() + c.len_utf8() > MAX_NAME_BYTES {
            break;
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(names: &[&str]) -> BTreeSet<String> {
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    #[test]
    fn data_raw_becomes_data_and_everything_else_gets_attitude_appended() {
        for (input, output) in [
            ("/imu/data_raw", "/imu/data"),
            ("/data_raw", "/data"),
            ("data_raw", "data"),
            ("/imu", "/imu/attitude"),
            ("/imu/", "/imu/attitude"),
            ("/imu/my_data_raw", "/imu/my_data_raw/attitude"),
            ("/imu/data", "/imu/data/attitude"),
            ("", "/attitude"),
        ] {
            assert_eq!(output_topic(input, &taken(&[])), output, "{input}");
        }
    }

    #[test]
    fn the_output_topic_is_never_one_that_is_already_in_the_file() {
        let t = taken(&["/imu/data"]);
        assert_eq!(output_topic("/imu/data_raw", &t), "/imu/data_raw/attitude");
        let t = taken(&["/imu/data", "/imu/data_raw/attitude"]);
        assert_eq!(
            output_topic("/imu/data_raw", &t),
            "/imu/data_raw/attitude_2"
        );
    }

    #[test]
    fn child_frames_are_unique_named_relative_and_never_the_world() {
        let streams = ["imu", "/imu", "", "world", "imu"].map(|f| Stream::new("/t", f));
        let mut frames = ChildFrames::default();
        let taken = streams.each_ref().map(|stream| frames.take(stream));
        assert_eq!(taken, ["imu", "imu_2", "body", "world_2", "imu_3"]);
        // One that went leaves its own to the next, and nobody gets what another still has.
        frames.give_back(&streams[1], "imu_2");
        let taken = [0, 0, 3].map(|n| frames.take(&streams[n]));
        assert_eq!(taken, ["imu_2", "imu_4", "world_3"]);
    }

    #[test]
    fn a_further_frame_costs_the_same_however_many_there_are() {
        let stream = Stream::new("/t", "");
        let mut frames = ChildFrames::default();
        for n in 1..=50_000 {
            let name = frames.take(&stream);
            assert_eq!(name, numbered("body", n));
        }
        // Only the first that is free was tried, each time.
        assert_eq!(frames.next.values().copied().collect::<Vec<_>>(), [50_001]);
    }

    #[test]
    fn a_name_of_sixty_megabytes_is_cut_on_a_character_boundary_and_loses_its_nuls() {
        let name = "a\0".to_owned() + &"é".repeat(30_000_000);
        let cut = bounded(&name);
        assert_eq!(cut.len(), 255, "1 + 127 * 2 bytes fit into 255");
        assert!(!cut.contains('\0'));
    }
}
