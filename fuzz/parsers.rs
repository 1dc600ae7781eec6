//! Everything that reads bytes from outside, each as a function of bytes alone: what the fuzzers of this folder and
//! the mutation test (`tests/hostile/mutations.rs`) run. What must hold is asserted; a panic is a finding.
#![allow(dead_code, unreachable_pub)]

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, LazyLock};
use strapd::serve::core::hub::Hub;
use strapd::serve::core::session::{Scratch, Session};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::framing::{Framed, Framer};
use strapd_recording::decode::packed::{self, Object};
use strapd_recording::decode::{Channel, Decoder, Options, decode_line, role};
use strapd_recording::delimited::Table;
use strapd_recording::devices::{Asked, Link};
use strapd_recording::format::Format;
use strapd_recording::lines::{HeldRow, Lines, TableStream};
use strapd_recording::mcap::{Reader, WalkOptions, walk};
use strapd_recording::{Input, Warn};

const NOW: Nanos = Nanos(1_700_000_000_000_000_000);

/// A message with what decoders find hardest: sequences of messages, strings, arrays, alignment.
pub const RIG: &str = "string[] words\nsensor_msgs/Imu[] imus\nfloat32[<=4] data\nuint8 x\nfloat64[3] gyro\nduration d\n\
================================================================================\nMSG: sensor_msgs/Imu\n\
std_msgs/Header header\ngeometry_msgs/Vector3 angular_velocity\n\
================================================================================\nMSG: std_msgs/Header\n\
builtin_interfaces/Time stamp\nstring frame_id\n\
================================================================================\nMSG: builtin_interfaces/Time\n\
int32 sec\nuint32 nanosec\n\
================================================================================\nMSG: geometry_msgs/Vector3\n\
float64 x\nfloat64 y\nfloat64 z\n";

/// `FileDescriptorSet` of `message S { repeated float gyro = 1; int64 t = 2; }` and
/// `message B { repeated S samples = 4; }` in package `p`.
pub const DESCRIPTORS: &[u8] = b"\x0a\x40\x0a\x01\x70\x12\x01\x70\x22\x1c\x0a\x01\x53\x12\x0c\x0a\x04\x67\x79\x72\x6f\x18\x01\x20\x03\x28\x02\x12\x09\x0a\x01\x74\x18\x02\x20\x01\x28\x03\x22\x1a\x0a\x01\x42\x12\x15\x0a\x07\x73\x61\x6d\x70\x6c\x65\x73\x18\x04\x20\x03\x28\x0b\x32\x04\x2e\x70\x2e\x53";

/// The first byte chooses the decoder, the rest is the payload.
fn payload(decoders: &[Decoder], data: &[u8]) {
    let Some((which, payload)) = data.split_first() else {
        return;
    };
    let Some(decoder) = decoders.get(*which as usize % decoders.len().max(1)) else {
        return;
    };
    let mut out = Vec::new();
    match decoder.decode(payload, NOW, NOW, &mut out) {
        Ok(decoded) => assert_eq!(decoded.samples, out.len()),
        Err(why) => assert!(out.is_empty() && !why.to_string().is_empty()),
    }
    let _ = decoder.frame_id(payload);
}

fn compiled(channels: &[(&str, &str, &str, &[u8])]) -> Vec<Decoder> {
    channels
        .iter()
        .map(|(encoding, name, schema_encoding, schema_data)| {
            let channel = Channel {
                topic: "/t",
                message_encoding: encoding,
                schema_name: name,
                schema_encoding,
                schema_data,
            };
            match Decoder::compile(&channel, &Options::default()) {
                Ok(decoder) => decoder,
                Err(why) => panic!("{encoding} {name}: {why}"),
            }
        })
        .collect()
}

/// CDR, little and big endian by its own head: well-known and custom types.
pub fn cdr(data: &[u8]) {
    static DECODERS: LazyLock<Vec<Decoder>> = LazyLock::new(|| {
        compiled(&[
            ("cdr", "sensor_msgs/msg/Imu", "", b""),
            ("cdr", "tf2_msgs/msg/TFMessage", "", b""),
            ("cdr", "a/msg/Rig", "ros2msg", RIG.as_bytes()),
        ])
    });
    payload(&DECODERS, data);
}

/// ROS 1 serialisation.
pub fn ros1(data: &[u8]) {
    static DECODERS: LazyLock<Vec<Decoder>> = LazyLock::new(|| {
        let rig = RIG.replace("builtin_interfaces/Time stamp", "uint32 seq\ntime stamp");
        let rig = rig
            .replace("float32[<=4]", "float32[]")
            .replace("duration d", "uint8 y");
        compiled(&[
            ("ros1", "sensor_msgs/Imu", "", b""),
            ("ros1", "a/Rig", "ros1msg", rig.as_bytes()),
        ])
    });
    payload(&DECODERS, data);
}

/// JSON messages of a log.
pub fn json(data: &[u8]) {
    static DECODERS: LazyLock<Vec<Decoder>> =
        LazyLock::new(|| compiled(&[("json", "", "", b""), ("json", "a", "jsonschema", b"{}")]));
    payload(&DECODERS, data);
}

/// Protobuf.
pub fn protobuf(data: &[u8]) {
    static DECODERS: LazyLock<Vec<Decoder>> =
        LazyLock::new(|| compiled(&[("protobuf", "p.B", "protobuf", DESCRIPTORS)]));
    payload(&DECODERS, data);
}

/// Schema text or descriptors up to the first 0xff, then a payload; in every language.
pub fn schema(data: &[u8]) {
    let (text, payload) = match data.iter().position(|b| *b == 0xff) {
        Some(at) => (&data[..at], &data[at + 1..]),
        None => (data, &[][..]),
    };
    for (message_encoding, schema_encoding, schema_name) in [
        ("cdr", "ros2msg", "a/msg/A"),
        ("cdr", "ros2idl", "a/msg/A"),
        ("ros1", "ros1msg", "a/A"),
        ("protobuf", "protobuf", "p.B"),
    ] {
        let channel = Channel {
            topic: "/t",
            message_encoding,
            schema_name,
            schema_encoding,
            schema_data: text,
        };
        let _ = role(&channel, Some((payload, NOW)));
        if let Ok(decoder) = Decoder::compile(&channel, &Options::default()) {
            let mut out = Vec::new();
            match decoder.decode(payload, NOW, NOW, &mut out) {
                Ok(decoded) => assert_eq!(decoded.samples, out.len()),
                Err(_) => assert!(out.is_empty()),
            }
        }
    }
}

/// NDJSON with packed objects, or a table: however the bytes are cut, the lines and objects are the same, and each is
/// a sample or an error.
pub fn lines(data: &[u8]) {
    let cut = |size: usize| {
        let mut framer = Framer::new();
        let mut items: Vec<(u64, Item)> = Vec::new();
        let mut take = |framed: Framed<'_>| {
            items.push(match framed {
                Framed::Line(n, line) => (n, Item::Line(line.to_vec())),
                Framed::TooLong(n, _) => (n, Item::TooLong),
                Framed::Packed(n, object) => (n, Item::Packed(object.to_vec())),
                Framed::Broken(n) => (n, Item::Broken),
            });
            true
        };
        for piece in data.chunks(size) {
            framer.feed(piece, &mut take);
        }
        framer.finish(&mut take);
        items
    };
    let whole = cut(usize::MAX);
    assert_eq!(whole, cut(1 + data.len() % 7));
    assert!(whole.windows(2).all(|pair| pair[0].0 < pair[1].0));
    let mut out: Vec<RawSample> = Vec::new();
    for (_, item) in &whole {
        out.clear();
        match item {
            Item::Line(line) => {
                if decode_line(line, NOW, &mut out).is_err() {
                    assert!(out.is_empty());
                }
            }
            Item::Packed(object) => packed_object(object),
            Item::TooLong | Item::Broken => {}
        }
    }
    rows(data);
}

/// A table, where the first line names its columns: each row is a sample, the first line again, or an error.
fn rows(data: &[u8]) {
    let mut lines = data.split(|b| *b == b'\n');
    let Some(Ok(mut table)) = lines.next().map(Table::own) else {
        return;
    };
    let mut out: Vec<RawSample> = Vec::new();
    for row in lines {
        out.clear();
        match table.decode(row, &mut out) {
            Ok(line) => assert_eq!(line.decoded.samples, out.len()),
            Err(why) => assert!(out.is_empty() && !why.to_string().is_empty()),
        }
    }
}

/// Reader that gives as many bytes at a time.
struct Dribble<'b>(&'b [u8], usize);

impl std::io::Read for Dribble<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let n = self.1.min(into.len()).min(self.0.len());
        let (now, later) = self.0.split_at(n);
        into[..n].copy_from_slice(now);
        self.0 = later;
        Ok(n)
    }
}

/// Contents of a table: samples, and why rows are none.
fn table(data: &[u8], at_once: usize, options: &Options) -> (Vec<String>, Vec<RawSample>) {
    let mut said = Vec::new();
    let mut samples = Vec::new();
    let name = std::path::Path::new("Gyroscope.csv");
    match Lines::new(name, Format::Table, Dribble(data, at_once), options) {
        Err(why) => said.push(why.to_string()),
        Ok(mut lines) => {
            said.extend(lines.table().map(|table| table.assumed().to_owned()));
            while let Some(line) = lines.next(&mut samples).unwrap() {
                match line {
                    Ok(line) => assert!(line.decoded.samples <= 1),
                    Err(why) => said.push(format!("{}: {why}", lines.number())),
                }
            }
            assert_eq!(lines.offset(), data.len() as u64);
        }
    }
    (said, samples)
}

/// A table of somebody's, in one piece.
pub fn whole_table(data: &[u8]) {
    let _ = table(data, usize::MAX, &Options::default());
}

/// A table of somebody's, what is said of its columns before it (`gyro=2:3:4`, a line end): however it is cut, the same
/// comes of it.
pub fn delimited(data: &[u8]) {
    let _ = Format::of_bytes(data);
    let (first, rest) = data.split_at(data.iter().position(|b| *b == b'\n').unwrap_or(0));
    let columns = std::str::from_utf8(first)
        .ok()
        .and_then(|text| text.parse().ok());
    let (rest, options) = match columns {
        None => (data, Options::default()),
        columns => {
            let options = Options {
                columns,
                ..Options::default()
            };
            (rest.get(1..).unwrap_or_default(), options)
        }
    };
    table_stream(rest, &options);
    let whole = table(rest, usize::MAX, &options);
    let cut = table(rest, 1 + data.len() % 7, &options);
    assert_eq!(format!("{whole:?}"), format!("{cut:?}"));
}

/// The same line by line, as it comes over a socket: every row that is held comes once, in order, and none after an error.
fn table_stream(data: &[u8], options: &Options) {
    let mut stream = TableStream::new(options, data.len().is_multiple_of(2));
    let mut samples = Vec::new();
    let mut last = 0;
    let mut held = |stream: &mut TableStream, (rows, skipped): (Vec<HeldRow>, u64)| {
        assert!(rows.len() <= 2 * 200 && skipped <= 2 * 200);
        for row in rows {
            assert!(row.number > last);
            last = row.number;
            let _ = stream.decode(&row.line, row.received, &mut samples);
        }
        assert!(samples.iter().all(|raw| raw.log == NOW));
        samples.clear();
    };
    for (number, line) in (1..).zip(data.split(|b| *b == b'\n')) {
        if stream.table().is_some() {
            let _ = stream.decode(line, NOW, &mut Vec::new());
            continue;
        }
        match stream.push(number, NOW, line) {
            Ok(None) => {}
            Ok(Some(opened)) => held(&mut stream, opened),
            Err(why) => {
                assert!(!why.to_string().is_empty());
                return;
            }
        }
    }
    if let Ok(Some(opened)) = stream.finish() {
        held(&mut stream, opened);
    }
}

/// A table in Parquet: every row is a sample, or one that was lost and says why.
pub fn parquet(data: &[u8]) {
    if !data.starts_with(b"PAR1") {
        return;
    }
    let quiet = Warn::by(|_| {});
    let input = Input::of_stream(Path::new("t.parquet"), data, &quiet);
    let Ok(mut lines) = input.and_then(|input| input.lines(&Options::default())) else {
        return;
    };
    let mut samples = Vec::new();
    let mut rows = 0u64;
    while let Ok(Some(line)) = lines.next(&mut samples) {
        rows += 1;
        if let Err(why) = line {
            assert!(!why.to_string().is_empty());
        }
        samples.clear();
    }
    assert!(rows <= (1 << 20) + 256 * data.len() as u64);
}

#[derive(Debug, PartialEq, Eq)]
enum Item {
    Line(Vec<u8>),
    Packed(Vec<u8>),
    TooLong,
    Broken,
}

/// Parses an object as long as it states; what it holds is written again as the same sample.
fn packed_object(object: &[u8]) {
    assert_eq!(packed::length(object), Some(object.len()));
    match packed::read(object, NOW) {
        Ok(Object::Rate {
            stream,
            seq,
            sample,
        }) => {
            let mut again = Vec::new();
            packed::push_sample(&mut again, stream, seq.unwrap_or(packed::NO_SEQ), &sample);
            let Ok(Object::Rate { sample: other, .. }) = packed::read(&again, NOW) else {
                panic!("what was written cannot be read");
            };
            // A line has neither: what is infinite is no data there, and no stamp is when it was logged.
            let finite = |v: &[f64; 3]| v.iter().all(|c| c.is_finite());
            assert_eq!(other.gyro, sample.gyro.filter(finite));
            assert_eq!(other.accel, sample.accel.filter(finite));
            assert_eq!(other.header, sample.header.or(Some(NOW)));
            assert_eq!(other.interval_nanos, sample.interval_nanos);
        }
        Ok(Object::Att { .. }) => assert!(object.len() >= packed::ATT),
        Err(why) => assert!(!why.to_string().is_empty()),
    }
}

/// Bytes of a sensor or autopilot, whose protocol the first byte chooses: lines of samples, the same however they are cut.
pub fn devices(data: &[u8]) {
    const NAMES: [&str; 7] = [
        "ximu3",
        "xsens",
        "witmotion",
        "vectornav",
        "mip",
        "mavlink",
        "auto",
    ];
    let Some((first, data)) = data.split_first() else {
        return;
    };
    let which = usize::from(*first) % NAMES.len();
    let read = |size: usize| {
        let asked = NAMES.get(which).and_then(|name| Asked::parse(name).ok());
        let Some(mut link) = asked.and_then(Link::of) else {
            panic!("each has a reader");
        };
        let mut lines = Vec::new();
        for (n, piece) in data.chunks(size).enumerate() {
            let now = Nanos(NOW.0 + n as i64 * 100_000_000);
            link.push(piece, now, Some("a \"b\""), &mut lines);
            assert!(link.notes().len() < 10);
        }
        lines
    };
    let lines = read(1 + usize::from(*first) / NAMES.len());
    // What is no frame that can be checked is believed by what follows, and lines are what they were.
    if which < 5 {
        assert_eq!(lines, read(data.len().max(1)));
    }
    if which < 6 {
        for line in lines.split_inclusive(|byte| *byte == b'\n') {
            let mut samples = Vec::new();
            match decode_line(line, NOW, &mut samples) {
                Ok(line) => assert_eq!((samples.len(), line.bare.len()), (1, 0)),
                Err(why) => panic!("{why}: {}", line.escape_ascii()),
            }
        }
    }
}

/// A whole conversation with the daemon, watched as lines or (by the first byte) packed: what it answers is JSON, a
/// line each, or whole packed attitudes that were named before, and every attitude is finite.
pub fn session(data: &[u8]) {
    let settings = strapd::serve::core::hub::Settings::default();
    let Ok(hub) = Hub::new(settings) else {
        panic!("the default settings are in order");
    };
    let hub = Arc::new(hub);
    let mut session = Session::new(&hub, "fuzz".to_owned(), false);
    let mut scratch = Scratch::default();
    let watch: &[u8] = match data.first().is_some_and(|n| n % 2 == 0) {
        true => b"{\"class\":\"WATCH\"}\n",
        false => b"{\"class\":\"WATCH\",\"packed\":true}\n",
    };
    session.bytes(watch, NOW, &mut scratch);
    let mut named = BTreeSet::new();
    let (size, data) = data
        .split_first()
        .map_or((1, data), |(n, rest)| (1 + *n as usize, rest));
    for (n, piece) in data.chunks(size).enumerate() {
        let received = Nanos(NOW.0 + n as i64 * 1_000_000);
        match n % 5 {
            4 => session.message(piece, received, &mut scratch),
            _ => session.bytes(piece, received, &mut scratch),
        }
        worked(&mut session, &mut named, &mut scratch);
        if session.end().is_some() {
            return;
        }
    }
    session.finish(NOW, &mut scratch);
    worked(&mut session, &mut named, &mut scratch);
}

/// Takes what is answered, and every further step, until nothing of what was sent is left.
fn worked(session: &mut Session, named: &mut BTreeSet<u64>, scratch: &mut Scratch) {
    session.hub().answer_polls();
    answered(session, named);
    while session.is_held() {
        assert!(session.may_go_on(), "everything was read");
        session.go_on(scratch);
        session.hub().answer_polls();
        answered(session, named);
    }
}

fn answered(session: &Session, named: &mut BTreeSet<u64>) {
    let outbox = &session.client().outbox;
    let mut taken = std::collections::VecDeque::new();
    let bytes = outbox.take(usize::MAX, &mut taken);
    outbox.written(bytes);
    for part in &taken {
        if packed::is_packed(part) {
            packed_attitudes(part, named);
        } else {
            for line in part.split(|b| *b == b'\n').filter(|l| !l.is_empty()) {
                answer(line, named);
            }
        }
    }
}

fn packed_attitudes(part: &[u8], named: &BTreeSet<u64>) {
    let whole: usize = packed::objects(part).map(<[u8]>::len).sum();
    assert_eq!(whole, part.len());
    for object in packed::objects(part) {
        let Ok(Object::Att { stream, attitude }) = packed::read(object, NOW) else {
            panic!("no attitude");
        };
        assert!(named.contains(&u64::from(stream)), "{stream} was not named");
        assert!(attitude.q.iter().all(|c| c.is_finite()), "{attitude:?}");
    }
}

fn answer(line: &[u8], named: &mut BTreeSet<u64>) {
    let Ok(text) = std::str::from_utf8(line) else {
        panic!("an answer that is no text");
    };
    assert!(
        text.starts_with("{\"class\":\"") && text.ends_with('}'),
        "{text}"
    );
    if text.starts_with("{\"class\":\"ATT\"") {
        let q = text
            .split("\"q\":")
            .nth(1)
            .and_then(|rest| rest.split('}').next());
        assert!(q.is_some_and(|q| !q.contains("null")), "{text}");
    }
    if text.starts_with("{\"class\":\"PACKED\"") {
        let number = text.rsplit("\"stream\":").next().map(|rest| {
            let digits = rest.bytes().take_while(u8::is_ascii_digit);
            digits.fold(0, |n, b| n * 10 + u64::from(b - b'0'))
        });
        assert!(
            named.insert(number.unwrap_or_default()),
            "named twice: {text}"
        );
    }
}

/// Parses what a viewer sends: text and binary messages of Foxglove's protocol.
pub fn foxglove(data: &[u8]) {
    for asked in [
        strapd::serve::protocol::foxglove::read_text(data),
        strapd::serve::protocol::foxglove::read_binary(data),
    ] {
        if let Err(why) = asked {
            assert!(!why.is_empty());
        }
    }
}

/// A log, as a stream and as a file: the walk ends, and both find the same where nothing is damaged.
pub fn mcap(data: &[u8]) {
    fn read(reader: Reader) -> (u64, bool) {
        let mut items = 0;
        let report = walk(
            reader,
            &WalkOptions::default(),
            |_| Some(()),
            |(), message, out: &mut Vec<u64>| out.push(message.log_time),
            |times| {
                items += times.len() as u64;
                ControlFlow::Continue(())
            },
        );
        match report {
            Ok(report) => {
                assert_eq!(report.items, items);
                (items, report.survey.problems.is_empty())
            }
            Err(why) => {
                assert!(!why.to_string().is_empty());
                (0, false)
            }
        }
    }
    thread_local! {
        static FILE: RefCell<Option<tempfile::NamedTempFile>> = RefCell::new(tempfile::NamedTempFile::new().ok());
    }
    let streamed =
        Reader::from_stream("m", Box::new(std::io::Cursor::new(data.to_vec()))).map(read);
    FILE.with_borrow(|file| {
        let Some(path) = file.as_ref().map(|f| f.path()) else {
            panic!("no room for a temporary file");
        };
        let Ok(()) = std::fs::write(path, data) else {
            panic!("no room for a temporary file");
        };
        match (Reader::open(path).map(read), streamed) {
            (Ok((from_file, true)), Ok((from_stream, true))) => assert_eq!(from_file, from_stream),
            (Ok(_), Ok(_)) | (Err(_), Err(_)) => {}
            (file, stream) => panic!("{file:?} from a file, {stream:?} from a stream"),
        }
    });
}
