//! Bytes of one message -> [`RawSample`]. Pure, total, no I/O.
//!
//! A stage of its own because it is where outside data enters: no payload and no schema, however
//! broken, makes it panic, loop or allocate beyond a bound. What the bytes say is not judged here;
//! NaN, zero stamps and absurd rates pass, and conditioning counts them.
//!
//! Long because a decoder and how it is compiled are the same parts twice: what one kind of message needs is in an arm of each.
//!
//! ```text
//! schema text or descriptor -> schema (one graph for all languages)
//!                              -> select (which fields)  -> plan, compiled once per channel
//! payload                      -> plan -> registers -> RawSample
//! ```
//!
//! | encoding | schema | decoder |
//! |---|---|---|
//! | `cdr` | `ros2msg`, `ros2idl`, `omgidl`, or none for well-known types | `decode::ros` |
//! | `ros1` | `ros1msg`, or none for well-known types | `decode::ros` |
//! | `json` | any or none | `decode::json` |
//! | `protobuf` | `protobuf` (file descriptor set) | `decode::protobuf` |
//! | lines, packed objects | cut from a stream by [`framing`] | [`LineDecoder`], [`packed`] |

mod definition;
mod fields;
pub mod framing;
mod handed;
mod json;
mod makers;
pub mod packed;
mod protobuf;
mod refusal;
mod registers;
mod role;
mod ros;
mod schema;
mod select;
mod settle;
mod stamp;
mod stated;

pub(crate) use definition::known_definition;
pub use fields::{BadFieldPath, FieldPath, FieldRole};
pub use handed::{Handed, HandedDecoders, Refused};
pub use json::line::{Class, Line, LineDecoder, MAX_LINE, decode_line};
pub use json::objects::{Object, Objects};
pub(crate) use refusal::defining;
pub use refusal::{Undecodable, Unsupported, exact_name};
pub use role::{Rank, Role, role, role_of};
pub use select::names::is_rate_name;
pub use stamp::{Ambiguous, Bare, MOST_WAITING, unit_of};
pub(crate) use stamp::{
    OUR_TIME, SHORTEST_STEP, bare as bare_of_text, days_since_1970, decimal_in_steps,
    from_rfc3339 as instant_of_date, units_of_steps, units_that_fit,
};
pub use stated::Stated;
pub use strapd_attitude::condition::GyroUnit;

use crate::columns::{Columns, Delimiter, RowFilter};
use crate::text::printable;
use definition::{read_schema, understand, well_known};
use registers::{Form, Slot, StampForm};
use ros::fifo::Fifo;
use schema::{Schema, ros_name};
use select::names::{self, Px4};
use select::{MatchQuality, Selection};
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::record::{Nanos, RawSample, SampleKind, TimeUnit};

/// Most samples one message may hold.
pub const MAX_BATCH: usize = 65_536;

/// A channel as its container describes it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Channel<'a> {
    /// Topic.
    pub topic: &'a str,
    /// `cdr`, `ros1`, `json`, `protobuf`.
    pub message_encoding: &'a str,
    /// Message type: `sensor_msgs/msg/Imu`.
    pub schema_name: &'a str,
    /// `ros2msg`, `ros1msg`, `jsonschema`, `protobuf`, or empty.
    pub schema_encoding: &'a str,
    /// The schema itself.
    pub schema_data: &'a [u8],
}

/// Purpose for which a channel's messages are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Wanted {
    /// Body rates and what stands beside them, or orientations.
    #[default]
    Rates,
    /// Specific forces, in messages of their own.
    Forces,
    /// Magnetic fields, in messages of their own.
    Fields,
    /// Temperatures, in messages of their own.
    Temperatures,
}

impl Wanted {
    /// Role and slots of the numbers that are wanted.
    fn numbers(self) -> (FieldRole, Slot, u8) {
        match self {
            Wanted::Rates => (FieldRole::Gyro, Slot::GYRO, 3),
            Wanted::Forces => (FieldRole::Accel, Slot::ACCEL, 3),
            Wanted::Fields => (FieldRole::Mag, Slot::MAG, 3),
            Wanted::Temperatures => (FieldRole::Temperature, Slot::TEMPERATURE, 1),
        }
    }
}

/// Columns of a trajectory of the TUM benchmark (Sturm et al., 2012): `timestamp tx ty tz qx qy qz qw`.
const TUM: &str = "orientation=8:5:6:7,stamp=1:s";

/// Options that the user may state about messages.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Purpose for which they are read.
    pub wanted: Wanted,
    /// `--field` paths.
    pub fields: Vec<FieldPath>,
    /// `--columns`: which columns of a table fill which role.
    pub columns: Option<Columns>,
    /// `--delimiter`: what stands between the cells of a table.
    pub delimiter: Option<Delimiter>,
    /// `--where`: the rows of a table that are read; others are left out and counted.
    pub rows: Vec<RowFilter>,
    /// Use data that its covariance (-1) marks as absent.
    pub ignore_covariance_flag: bool,
    /// Child frame whose transform is taken when a message holds several; else the first.
    pub child_frame: Option<String>,
    /// Index of the stamp to read when a message has several: 0 is the message's own, then those of nested
    /// messages from the outside in ([`Decoder::stamps`]).
    pub nth_stamp: usize,
    /// Stamps are not read, since the samples' time is another: whether their unit is right is nobody's concern.
    pub are_stamps_unread: bool,
    /// Somebody states the unit of the rates: that the table does not is nobody's concern.
    pub is_unit_stated: bool,
}

impl Options {
    /// Returns whether the user states the unit of the stamps.
    #[must_use]
    pub(crate) fn states_stamp_unit(&self) -> bool {
        let mut fields = self.fields.iter();
        self.columns.is_some() || fields.any(|f| f.role == FieldRole::Stamp && f.unit.is_some())
    }

    /// The same for a file of this name: a `.tum` has columns and no heading.
    #[must_use]
    pub(crate) fn for_file(mut self, name: &Path) -> Options {
        let ending = name.extension().unwrap_or_default();
        if self.columns.is_none() && ending.eq_ignore_ascii_case("tum") {
            self.columns = TUM.parse().ok();
        }
        self
    }

    /// Whether the user says where the samples' own interval lies, and in which unit.
    #[must_use]
    pub(crate) fn states_interval_unit(&self) -> bool {
        let mut fields = self.fields.iter();
        fields.any(|f| f.role == FieldRole::Interval && f.unit.is_some())
    }
}

/// Outcome of one payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Decoded {
    /// Samples pushed.
    pub samples: usize,
    /// Number of these whose body rate the message marks as absent (covariance -1, Imu.msg): their
    /// `gyro` is `None`, or kept where [`Options::ignore_covariance_flag`] says so.
    pub gyro_marked_absent: usize,
    /// Stamps whose nanoseconds were a second or more (or negative), carried into the seconds.
    pub stamps_carried: usize,
}

/// Reads the messages of one channel. A copy shares what was compiled.
#[derive(Debug, Clone)]
pub struct Decoder {
    plan: Program,
    /// Form by which registers become samples; of JSON the plan knows.
    form: Form,
    /// Finds the frame in messages that have a schema.
    frame: Option<Program>,
    stated: Stated,
    found: MatchQuality,
    /// Stamps are numbers whose unit nothing states; of JSON before its first message: they may be.
    has_bare_stamps: bool,
    /// Paths of stamps; the one that is read is [`Options::nth_stamp`].
    stamps: Vec<String>,
    options: Options,
    /// Label for the messages about it: topic, type, encoding.
    label: [String; 3],
}

#[derive(Debug, Clone)]
enum Program {
    Ros(Arc<ros::Program>),
    Fifo(Arc<Fifo>),
    Protobuf(Arc<protobuf::Program>),
    Json(json::Program),
    /// Messages come as samples.
    Samples,
}

/// Budget for the schemas of one log: a few kilobytes of schema can spell out to tens of thousands of
/// fields, and a log can hold thousands of schemas. Those of a hundred recordings together spell out to fewer.
#[derive(Debug, Clone)]
pub(crate) struct Effort {
    fields: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Effort { fields: 5_000_000 }
    }
}

impl Effort {
    /// Most fields one schema counts for: beyond, none is compiled.
    const ONE: usize = 50_000;

    fn spend(&mut self, schema: Schema, encoding: &str) -> Result<Schema, (String, String)> {
        // Protobuf's types may hold themselves, and are not written out; elsewhere that is no schema, and is
        // found out only by going round.
        let circle = if encoding == "protobuf" {
            0
        } else {
            Effort::ONE
        };
        let spelled = schema.spelled(Effort::ONE, circle);
        match self.fields.checked_sub(spelled) {
            Some(left) => {
                self.fields = left;
                Ok(schema)
            }
            None => Err((
                "the schemas of this log spell out to more fields than are gone over for one log"
                    .to_owned(),
                String::new(),
            )),
        }
    }
}

impl Decoder {
    /// Compiles the decoder of a channel.
    ///
    /// # Errors
    /// [`Unsupported`] with the reason: an encoding or schema this crate does not read, a schema
    /// without body rate or orientation, a `--field` that leads nowhere (with the fields there are).
    /// A JSON channel always compiles: what it holds shows in its messages ([`Decoder::settle`]).
    pub fn compile(channel: &Channel<'_>, options: &Options) -> Result<Decoder, Unsupported> {
        Decoder::compile_within(channel, options, &mut Effort::default())
    }

    /// The same for one of many channels, as long as `effort` lasts.
    ///
    /// # Errors
    /// As [`Decoder::compile`], and when the effort is spent.
    pub(crate) fn compile_within(
        channel: &Channel<'_>,
        options: &Options,
        effort: &mut Effort,
    ) -> Result<Decoder, Unsupported> {
        let label = label(channel);
        let refuse = |(why, help): (String, String)| unsupported(&label, why, help);
        if channel.message_encoding == "json" {
            return Ok(Decoder::json(channel, options, label));
        }
        if let Some(fifo) = fifo(channel, options) {
            return Ok(Decoder::fifo(fifo, label));
        }
        // A recorder may leave a well-known type's text out, or shorten it to a stub.
        let read =
            read_schema(channel).and_then(|schema| effort.spend(schema, channel.message_encoding));
        let (schema, selection) = understand(channel, read, options)
            .or_else(|why| understand(channel, well_known(channel), options).map_err(|_| why))
            .map_err(refuse)?;
        let plan = compile_plan(channel, &schema, &selection, options)
            .map_err(|why| refuse((why, String::new())))?;
        let frame = selection
            .frame
            .as_deref()
            .and_then(|path| match channel.message_encoding {
                "protobuf" => protobuf::plan::text(&schema, path)
                    .ok()
                    .map(|plan| Program::Protobuf(Arc::new(plan))),
                "ros1" => ros::compile::text(&schema, path, ros::compile::Layout::Ros1)
                    .ok()
                    .map(|plan| Program::Ros(Arc::new(plan))),
                _ => ros::compile::text(&schema, path, ros::compile::Layout::Cdr)
                    .ok()
                    .map(|plan| Program::Ros(Arc::new(plan))),
            });
        let form = match &plan {
            Program::Ros(plan) => plan.form(),
            Program::Protobuf(plan) => plan.form(),
            Program::Fifo(_) | Program::Json(_) | Program::Samples => Form::default(),
        };
        Ok(Decoder {
            has_bare_stamps: matches!(
                form.stamp,
                StampForm::Count(TimeUnit::ByMagnitude) | StampForm::Float(TimeUnit::ByMagnitude)
            ),
            form,
            plan,
            frame,
            stated: state(channel.schema_name, &selection, options),
            found: selection.found,
            stamps: selection.stamps.iter().map(|s| printable(s)).collect(),
            options: options.clone(),
            label,
        })
    }

    fn fifo(fifo: Fifo, label: [String; 3]) -> Decoder {
        let mut stated = Stated::default();
        state_px4(Some(Px4::SensorGyroFifo), &mut stated);
        stated.batched = true;
        stated.description = "gyro x, y, z, stamp timestamp_sample".to_owned();
        Decoder {
            plan: Program::Fifo(Arc::new(fifo)),
            form: Form::default(),
            frame: None,
            stated,
            found: MatchQuality::Named,
            has_bare_stamps: false,
            stamps: Vec::new(),
            options: Options::default(),
            label,
        }
    }

    fn json(channel: &Channel<'_>, options: &Options, label: [String; 3]) -> Decoder {
        let mut stated = Stated::default();
        stated.declared.interval_unit_given = options.states_interval_unit();
        state_by_type(channel.schema_name, &mut stated);
        let px4 = names::px4(channel.schema_name);
        state_px4(px4, &mut stated);
        stated.description = "fields by name, in each message".to_owned();
        let keys = json::keys::schema_keys(channel.schema_data);
        stated.has_gyro |= keys.0;
        stated.has_stamp |= keys.1;
        let found = if stated.has_gyro {
            MatchQuality::Named
        } else {
            MatchQuality::Nothing
        };
        Decoder {
            plan: Program::Json(json::Program::compile(channel.schema_name, options)),
            form: Form::default(),
            frame: None,
            stated,
            found,
            has_bare_stamps: true,
            stamps: Vec::new(),
            options: options.clone(),
            label,
        }
    }

    /// Says what the samples of a channel are that has no messages to be read: lines and rows come as samples.
    #[must_use]
    pub fn of_samples(channel: &Channel<'_>, stated: Stated) -> Decoder {
        Decoder {
            plan: Program::Samples,
            form: Form::default(),
            frame: None,
            stated,
            found: MatchQuality::Named,
            has_bare_stamps: false,
            stamps: Vec::new(),
            options: Options::default(),
            label: label(channel),
        }
    }

    /// Reads one payload and pushes its samples; pushes nothing when it fails.
    ///
    /// # Errors
    /// [`Undecodable`], to be counted; it says at which field or byte.
    pub fn decode(
        &self,
        payload: &[u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Decoded, Undecodable> {
        self.decode_as(&self.form, payload, log, publish, out)
    }

    fn decode_as(
        &self,
        form: &Form,
        payload: &[u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Decoded, Undecodable> {
        match &self.plan {
            Program::Ros(plan) => plan.decode(form, payload, log, publish, out),
            Program::Fifo(fifo) => fifo.decode(payload, log, publish, out),
            Program::Protobuf(plan) => plan.decode(form, payload, log, publish, out),
            Program::Json(plan) => plan.decode(payload, log, publish, out),
            Program::Samples => Ok(Decoded::default()),
        }
    }

    /// The same for a message that names this frame, or none; nothing of one that names another.
    ///
    /// # Errors
    /// As [`Decoder::decode`].
    pub(crate) fn decode_of(
        &self,
        frame: &str,
        payload: &[u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Option<Decoded>, Undecodable> {
        if let Program::Json(plan) = &self.plan {
            return plan.decode_of(frame, payload, log, publish, out);
        }
        let names_another = |named: &[u8]| {
            named != frame.as_bytes() && printable(&String::from_utf8_lossy(named)) != frame
        };
        if self.frame_bytes(payload).is_some_and(names_another) {
            return Ok(None);
        }
        self.decode(payload, log, publish, out).map(Some)
    }

    /// The same for another topic's messages of the same type, which share what was compiled.
    #[must_use]
    pub fn of_topic(&self, topic: &str) -> Decoder {
        let mut other = self.clone();
        other.label[0] = printable(topic);
        other.stated.declared.usual_kind = makers::usual_kind([topic, &self.label[1]]);
        other
    }

    /// The same for messages whose channel states that their samples are of this kind.
    #[must_use]
    pub(crate) fn stating(mut self, kind: Option<SampleKind>) -> Decoder {
        let declared = &mut self.stated.declared;
        declared.sample_kind = declared.sample_kind.or(kind);
        self
    }

    /// Statements of type and schema, and the fields that were chosen.
    #[must_use]
    pub fn stated(&self) -> &Stated {
        &self.stated
    }

    /// Paths of the stamps that messages carry, the message's own first, then those of messages nested in it; one
    /// of them is read ([`Options::nth_stamp`]). Empty where `--field` names it.
    #[must_use]
    pub fn stamps(&self) -> &[String] {
        &self.stamps
    }

    /// Index of the stamp among [`Decoder::stamps`] that is read.
    #[must_use]
    pub fn nth_stamp(&self) -> usize {
        self.options
            .nth_stamp
            .min(self.stamps.len().saturating_sub(1))
    }

    /// Whether the stamp that is read is one: not zero, not shared by many samples, not in whole seconds
    /// throughout. `first` are the first messages of the channel, with their log times.
    #[must_use]
    pub(crate) fn has_good_stamps(&self, first: &[(Nanos, Vec<u8>)]) -> bool {
        let mut samples = Vec::new();
        for (log, payload) in first {
            // What cannot be decoded says nothing about stamps.
            let _ = self.decode(payload, *log, *log, &mut samples);
        }
        let mut stamps: Vec<i64> = samples.iter().filter_map(|s| Some(s.header?.0)).collect();
        let n = stamps.len();
        stamps.retain(|stamp| *stamp != 0);
        let nonzero = stamps.len();
        let whole = stamps.iter().filter(|s| *s % 1_000_000_000 == 0).count();
        stamps.sort_unstable();
        stamps.dedup();
        // A few that collide are jitter; one that stands at a whole second is chance.
        2 * nonzero > n && 10 * stamps.len() >= 9 * nonzero && (whole < 2 || whole < nonzero)
    }

    /// The frame a message names: at most 255 bytes, control characters escaped.
    #[must_use]
    pub fn frame_id(&self, payload: &[u8]) -> Option<String> {
        if let Program::Json(plan) = &self.plan {
            return plan.find(payload).ok()?.frame.as_deref().map(printable);
        }
        let bytes = self.frame_bytes(payload)?;
        Some(printable(&String::from_utf8_lossy(bytes)))
    }

    /// Whether messages may name a frame.
    #[must_use]
    pub(crate) fn names_frames(&self) -> bool {
        self.frame.is_some() || matches!(self.plan, Program::Json(_))
    }

    fn frame_bytes<'a>(&'a self, payload: &'a [u8]) -> Option<&'a [u8]> {
        match self.frame.as_ref()? {
            Program::Ros(plan) => plan.text(payload),
            Program::Protobuf(plan) => plan.text(payload),
            Program::Fifo(_) | Program::Json(_) | Program::Samples => None,
        }
    }

    fn found(&self) -> MatchQuality {
        self.found
    }
}

fn label(channel: &Channel<'_>) -> [String; 3] {
    let encoding = if channel.schema_encoding.is_empty() {
        printable(channel.message_encoding)
    } else {
        printable(&format!(
            "{}/{}",
            channel.message_encoding, channel.schema_encoding
        ))
    };
    [
        printable(channel.topic),
        printable(channel.schema_name),
        encoding,
    ]
}

fn unsupported(
    [topic, type_name, encoding]: &[String; 3],
    why: String,
    help: String,
) -> Unsupported {
    Unsupported {
        topic: topic.clone(),
        type_name: type_name.clone(),
        encoding: encoding.clone(),
        why,
        help,
    }
}

/// The reader of PX4's raw samples, where a channel has such and no flag says otherwise.
fn fifo(channel: &Channel<'_>, options: &Options) -> Option<Fifo> {
    let is_cdr = match channel.message_encoding {
        "cdr" => true,
        "ros1" => false,
        _ => return None,
    };
    let is_fifo = names::px4(channel.schema_name) == Some(Px4::SensorGyroFifo);
    let is_asked = options.fields.is_empty() && options.wanted == Wanted::Rates;
    let schema = (is_fifo && is_asked).then(|| read_schema(channel))?;
    Fifo::compile(&schema.ok()?, is_cdr)
}

fn compile_plan(
    channel: &Channel<'_>,
    schema: &Schema,
    selection: &Selection,
    options: &Options,
) -> Result<Program, String> {
    let child = options.child_frame.as_deref();
    let layout = match channel.message_encoding {
        "protobuf" => {
            return protobuf::plan::samples(schema, selection, child)
                .map(|plan| Program::Protobuf(Arc::new(plan)));
        }
        "ros1" => ros::compile::Layout::Ros1,
        _ => ros::compile::Layout::Cdr,
    };
    let plan = ros::compile::samples(schema, selection, child, layout)?;
    Ok(Program::Ros(Arc::new(plan.recognised())))
}

fn state(type_name: &str, selection: &Selection, options: &Options) -> Stated {
    let mut stated = Stated::default();
    stated.declared.interval_unit_given = options.states_interval_unit();
    state_by_type(type_name, &mut stated);
    state_by_type(&selection.holder, &mut stated);
    stated.declared.gyro_unit = selection.unit.or(stated.declared.gyro_unit);
    state_px4(names::px4(type_name), &mut stated);
    stated.declared.sample_kind = match (selection.kind, stated.declared.sample_kind) {
        // The field is called an angle; the type says what is in it.
        (Some(SampleKind::DeltaAngle), Some(SampleKind::Rotation)) => Some(SampleKind::Rotation),
        (found, by_type) => found.or(by_type),
    };
    stated.has_gyro = selection.has(Slot::GYRO, 3);
    stated.has_accel = selection.has(Slot::ACCEL, 3);
    stated.has_mag = selection.has(Slot::MAG, 3);
    stated.has_temperature = selection.has(Slot::TEMPERATURE, 1);
    stated.has_orientation = selection.has(Slot::ORIENTATION, 4);
    stated.has_stamp = selection.form.stamp != StampForm::None;
    stated.has_interval = selection.has(Slot::INTERVAL, 1);
    stated.declared.interval = stated
        .has_interval
        .then(|| (printable(&selection.interval), selection.form.interval));
    stated.batched = selection
        .batch
        .as_ref()
        .is_some_and(|batch| batch.element == select::PathStep::Each);
    stated.description = printable(&selection.description.join(", "));
    stated
}

/// Types whose units and axes a published text fixes.
fn state_by_type(type_name: &str, stated: &mut Stated) {
    let name = ros_name(type_name);
    let package = name.split('/').next().unwrap_or("");
    if matches!(
        package,
        "sensor_msgs" | "geometry_msgs" | "nav_msgs" | "tf2_msgs" | "tf"
    ) {
        stated.ros();
        stated.has_gyro |= name == "sensor_msgs/Imu";
        stated.has_stamp |= name == "sensor_msgs/Imu";
    }
}

fn state_px4(px4: Option<Px4>, stated: &mut Stated) {
    let Some(px4) = px4 else { return };
    stated.px4();
    let is_beside = matches!(
        px4,
        Px4::SensorAccel | Px4::SensorMag | Px4::VehicleMagnetometer
    );
    stated.has_gyro = px4 != Px4::VehicleAttitude && !is_beside;
    stated.has_stamp = true;
    stated.has_orientation = px4 == Px4::VehicleAttitude;
    stated.declared.sample_kind = Some(match px4 {
        Px4::SensorCombined => SampleKind::Average,
        // Coning is added before it is sent.
        Px4::VehicleImu => SampleKind::Rotation,
        Px4::VehicleAngularVelocity
        | Px4::SensorGyro
        | Px4::SensorAccel
        | Px4::SensorMag
        | Px4::VehicleMagnetometer
        | Px4::SensorGyroFifo
        | Px4::VehicleAttitude => SampleKind::Rate,
    });
}
