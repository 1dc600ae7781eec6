//! Parsers, and inputs of any length on which each could go wrong: the same thing again and again, or one thing
//! that is long beside many that refer to it.

use crate::made_databases::database;
use crate::parsers;
use std::ops::ControlFlow;
use strapd_attitude::estimate::settings::{self, ROWS, Value};
use strapd_attitude::record::Nanos;
use strapd_recording::decode::framing::Framer;
use strapd_recording::decode::{Channel, FieldPath, Options, decode_line, role};
use strapd_recording::mcap::{MAGIC, Reader, WalkOptions, op, walk};
use strapd_recording::pool::Pool;
use strapd_recording::recording::warn::Warn;
use strapd_recording::{Input, Recording};

/// A parser and what it is fed.
pub(crate) struct Case {
    pub name: &'static str,
    pub parse: fn(&[u8]),
    pub input: fn(usize) -> Vec<u8>,
}

macro_rules! cases {
    ($($parse:expr => { $($name:literal: $input:expr;)* })*) => {
        &[$($(Case { name: $name, parse: $parse, input: $input },)*)*]
    };
}

/// `head`, `piece` as often as it fits into `length`, `tail`.
fn again(head: &str, piece: &str, tail: &str, length: usize) -> Vec<u8> {
    let times = length.saturating_sub(head.len() + tail.len()) / piece.len();
    format!("{head}{}{tail}", piece.repeat(times)).into_bytes()
}

/// Numbered pieces, as many as fit.
fn numbered(head: &str, length: usize, piece: impl Fn(usize) -> String) -> Vec<u8> {
    let mut out = head.to_owned();
    for n in 0.. {
        let next = piece(n);
        if out.len() + next.len() > length.max(head.len()) {
            break;
        }
        out.push_str(&next);
    }
    out.into_bytes()
}

fn compile(message_encoding: &str, schema_encoding: &str, schema_name: &str, schema_data: &[u8]) {
    let channel = Channel {
        topic: "/t",
        message_encoding,
        schema_name,
        schema_encoding,
        schema_data,
    };
    let _ = role(&channel, None);
}

fn idl(data: &[u8]) {
    compile("cdr", "ros2idl", "a/msg/A", data);
}

fn rosmsg(data: &[u8]) {
    compile("cdr", "ros2msg", "a/msg/A", data);
}

fn json_schema(data: &[u8]) {
    compile("json", "jsonschema", "A", data);
}

fn descriptors(data: &[u8]) {
    compile("protobuf", "protobuf", "p.A", data);
}

fn line(data: &[u8]) {
    let mut out = Vec::new();
    let _ = decode_line(data, Nanos(0), &mut out);
}

fn framed(data: &[u8]) {
    let mut framer = Framer::new();
    let mut out = Vec::new();
    for piece in data.chunks(7) {
        framer.feed(piece, &mut |framed| {
            if let strapd_recording::decode::framing::Framed::Line(_, line) = framed {
                let _ = decode_line(line, Nanos(0), &mut out);
                out.clear();
            }
            true
        });
    }
    framer.finish(&mut |_| true);
}

/// A log as a stream: every record of it.
fn mcap(data: &[u8]) {
    let Ok(reader) = Reader::from_stream("m", Box::new(std::io::Cursor::new(data.to_vec()))) else {
        return;
    };
    let mut items = 0;
    let report = walk(
        reader,
        &WalkOptions::default(),
        |_| Some(()),
        |(), message, out: &mut Vec<u64>| out.push(message.log_time),
        |times| {
            items += times.len();
            ControlFlow::Continue(())
        },
    );
    assert!(report.is_ok());
}

/// The same as a file: with its summary, and a way back.
fn mcap_file(data: &[u8]) {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    std::io::Write::write_all(&mut file, data).unwrap();
    let Ok(reader) = Reader::open(file.path()) else {
        return;
    };
    let report = walk(
        reader,
        &WalkOptions::default(),
        |_| Some(()),
        |(), message, out: &mut Vec<u64>| out.push(message.log_time),
        |_| ControlFlow::Continue(()),
    );
    assert!(report.is_ok());
}

/// A log as `info`, `check` and `report` look at it, topic by topic.
fn looked_at(data: &[u8]) {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    std::io::Write::write_all(&mut file, data).unwrap();
    let (pool, options) = (Pool::new(1).unwrap(), Options::default());
    let input = Input::open(file.path(), &Warn::by(|_| {})).unwrap();
    let log = Recording::told_apart(&input, None, &options, &pool).unwrap();
    let looks = strapd_replay::pipeline::inspection::look(&log, None, &options, &pool).unwrap();
    assert!(looks.topics.len() > 1 || data.len() < 1000);
}

/// Topics with a message each, and a type each, as in every bag of ROS 1.
fn own_types(length: usize) -> Vec<u8> {
    let said = "# what the type is for\n".repeat(25);
    records(length, |n| {
        let text =
            format!("uint64 timestamp\nfloat32[3] gyro_rad\nuint32 gyro_integral_dt\n{said}# {n}");
        let (id, schema) = ((n as u16).to_le_bytes(), (1 + n as u16).to_le_bytes());
        let name = sized(b"px4_msgs/msg/SensorCombined");
        let of_schema = [name, sized(b"ros2msg"), sized(text.as_bytes())].concat();
        let topic = sized(format!("/t{n}").as_bytes());
        let of_channel = [topic, sized(b"cdr"), sized(b"")].concat();
        [
            record(op::SCHEMA, &[&schema[..], &of_schema].concat()),
            record(op::CHANNEL, &[&id[..], &schema, &of_channel].concat()),
            record(
                op::MESSAGE,
                &[&id[..], &[0; 20], &[0, 1, 0, 0], &[0; 24]].concat(),
            ),
        ]
        .concat()
    })
}

/// Frames of a sensor, by which a capture of it is known.
fn captured(device: &str) -> Vec<u8> {
    let seeds = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/seeds/mcap");
    std::fs::read(format!("{seeds}/{device}_capture")).unwrap()
}

/// Two heartbeats, by which captured bytes of a link are known.
fn capture_head() -> Vec<u8> {
    let frame = |n: u8| {
        let mut frame = vec![0xfe, 9, n, 1, 1, 0];
        frame.extend([0; 9]);
        let sum = strapd_recording::mavlink::checksum(&frame[1..], 50);
        frame.extend(sum.to_le_bytes());
        frame
    };
    [frame(0), frame(1)].concat()
}

/// A recording of ROS 2 in pages of 1 kB.
fn sqlite(length: usize) -> Vec<u8> {
    let data = [0; 100];
    let messages = vec![(0, 7, &data[..]); (length.saturating_sub(3000)) / 128];
    database(1024, &[("/t", "a/msg/A")], &messages)
}

/// Cells of a header, and rows under it.
fn wide(length: usize) -> Vec<u8> {
    let names: String = (0..200).map(|n| format!("a{n},")).collect();
    let row = "1.25,".repeat(204);
    let head = format!("time_s,gyro_x,gyro_y,gyro_z,{names}\n");
    again(&head, &format!("{row}\n"), "", length)
}

/// Everything a command line takes as text.
fn arguments(data: &[u8]) {
    let text = std::str::from_utf8(data).unwrap();
    let _ = text.parse::<FieldPath>();
    let _ = strapd::sink::Target::parse(text);
    let _ = strapd::sink::address::Listen::parse(text);
    let _ = strapd::client::remote::Remote::parse(text);
    for row in &ROWS {
        let _ = row.apply(&mut settings::defaults(), &Value::Text(text));
    }
    let _ = strapd_replay::shell::quoted(text);
}

fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// Records behind the head of a log, as many as fit.
fn records(length: usize, record: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    for n in 0.. {
        let next = record(n);
        if out.len() + next.len() > length {
            return out;
        }
        out.extend(next);
    }
    out
}

fn schema_record(n: usize, text: &str) -> Vec<u8> {
    let id = (1 + n as u16).to_le_bytes();
    let rest = [sized(b"a/msg/A"), sized(b"ros2msg"), sized(text.as_bytes())].concat();
    record(op::SCHEMA, &[&id[..], &rest].concat())
}

fn channel_record(n: usize, topic: &str) -> Vec<u8> {
    let id = (n as u16).to_le_bytes();
    let rest = [sized(topic.as_bytes()), sized(b"cdr"), sized(b"")].concat();
    record(
        op::CHANNEL,
        &[&id[..], &1_u16.to_le_bytes(), &rest].concat(),
    )
}

fn message_record(n: usize) -> Vec<u8> {
    let head = [&(n as u16).to_le_bytes()[..], &[0; 20]].concat();
    record(op::MESSAGE, &head)
}

fn chunk_record(records: &[u8]) -> Vec<u8> {
    let size = (records.len() as u64).to_le_bytes();
    let head = [&[0; 16][..], &size, &[0; 4], &sized(b""), &size].concat();
    record(op::CHUNK, &[&head, records].concat())
}

/// A protobuf field of bytes.
fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
    let mut out = vec![number << 3 | 2];
    let mut n = bytes.len();
    while n >= 0x80 {
        out.push(n as u8 | 0x80);
        n >>= 7;
    }
    out.push(n as u8);
    out.extend(bytes);
    out
}

/// A descriptor set of one file with these messages.
fn file_set(package: &[u8], messages: &[u8]) -> Vec<u8> {
    field(1, &[field(2, package), messages.to_vec()].concat())
}

fn repeated(length: usize, piece: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let mut out = Vec::new();
    for n in 0.. {
        let next = piece(n);
        if out.len() + next.len() + 60 > length {
            break;
        }
        out.extend(next);
    }
    out
}

const TABLE: &str = "time_s,gyro_x,gyro_y,gyro_z\n0,1,2,3\n";

const IMU_JSON: &str = r#""gyro":[0.1,2,3],"#;

fn ulog_record(kind: u8, body: &[u8]) -> Vec<u8> {
    let length = (body.len() as u16).to_le_bytes();
    [&length[..], &[kind], body].concat()
}

/// A ULog of such pieces.
fn ulog(length: usize, piece: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let head = [&b"ULog\x01\x12\x35\x01"[..], &[0; 8]].concat();
    pieces(head, length, piece)
}

/// A record of a bag whose data are said to be of `said` bytes.
fn bag_record(op: u8, fields: &[(&str, &[u8])], said: u32, data: &[u8]) -> Vec<u8> {
    let of = |(name, value): &(&str, &[u8])| {
        let length = (name.len() + 1 + value.len()) as u32;
        [&length.to_le_bytes()[..], name.as_bytes(), b"=", value].concat()
    };
    let fields: Vec<u8> = [("op", &[op][..])]
        .iter()
        .chain(fields)
        .flat_map(of)
        .collect();
    let length = (fields.len() as u32).to_le_bytes();
    [&length[..], &fields, &said.to_le_bytes(), data].concat()
}

/// A bag of such pieces.
fn bag(length: usize, piece: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    pieces(b"#ROSBAG V2.0\n".to_vec(), length, piece)
}

fn pieces(head: Vec<u8>, length: usize, piece: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let mut out = head;
    for n in 0.. {
        let next = piece(n);
        if out.len() + next.len() > length {
            break;
        }
        out.extend(next);
    }
    out
}

pub(crate) const CASES: &[Case] = cases! {
    looked_at => {
        "log: topics of a type each": own_types;
    }
    idl => {
        "IDL: tokens on one line": |n| again("struct A { double x; }; ", "; ", "", n);
        "IDL: members": |n| again("struct A { ", "double x; ", "};", n);
        "IDL: names of one type": |n| again("struct B { double x; }; struct A { ", "B x; ", "};", n);
        "IDL: a long name for many members": |n| again(&format!("struct A {{ {} ", "b::".repeat(200)), "x,", "x; };", n);
        "IDL: structs in deep modules": |n| again(&"module mmmmmmmm { ".repeat(30), "struct A { B b; }; ", "", n);
        "IDL: typedefs of typedefs": |n| numbered("struct A { T9 x; }; ", n, |k| format!("typedef T{} T{k}; ", k + 1));
        "IDL: enums and constants": |n| again("", "enum E { A, B }; const long C = 5; ", "", n);
        "IDL: comments that do not end": |n| again("", "/* ", "", n);
        "IDL: line comments": |n| again("", "//\n", "", n);
        "IDL: strings": |n| again("@a (x=\"", "\\\" ", "\")", n);
        "IDL: annotations": |n| again("", "@a(b) ", "", n);
        "IDL: sequences in each other": |n| again("struct A { ", "sequence<", "", n);
        "IDL: modules opened again": |n| again("", "module a { };", "", n);
        "IDL: arrays": |n| again("struct A { double x", "[2]", "; };", n);
    }
    rosmsg => {
        "msg: fields": |n| again("", "float64 x\n", "", n);
        "msg: fields of one type": |n| again("B b\n=====\nMSG: a/B\n", "C c\n", "=====\nMSG: a/C\nbyte x\n", n);
        "msg: a long package": |n| again(&format!("=====\nMSG: {}/A\n", "p".repeat(1000)), "B b\n", "", n);
        "msg: sections": |n| numbered("float64 x\n", n, |k| format!("=====\nMSG: a/B{k}\nfloat64 x\n"));
        "msg: types in types": |n| numbered("B0 b\n", n, |k| format!("=====\nMSG: a/B{k}\nB{} b\n", k + 1));
        "msg: types twice in types": |n| numbered("B0 b\n", n, |k| format!("=====\nMSG: a/B{k}\nB{0} b\nB{0} c\n", k + 1));
        "msg: many of many": |n| {
            let half = |kind: &str| String::from_utf8(again("", &format!("{kind} x\n"), "", n / 2 - 20)).unwrap();
            format!("{}=====\nMSG: a/B\n{}", half("B"), half("byte")).into_bytes()
        };
        "msg: comments": |n| again("", "# # #\n", "", n);
        "msg: one long line": |n| again("float64 ", "x", "", n);
        "msg: a long type": |n| again("", "a/", " x\n", n);
    }
    descriptors => {
        "descriptors: messages": |n| file_set(b"p", &repeated(n, |_| field(4, &field(1, b"A"))));
        "descriptors: fields": |n| file_set(b"p", &field(4, &repeated(n, |_| field(2, &field(1, b"x")))));
        "descriptors: types of one name": |n| file_set(b"p", &field(4, &[field(1, b"A"), repeated(n, |_| field(2, &[&field(1, b"x")[..], &[0x18, 1, 0x28, 11], &field(6, b".p.A")].concat()))].concat()));
        "descriptors: files": |n| repeated(n, |_| field(1, &field(2, b"p")));
        "descriptors: a long package": |n| file_set(&vec![b'p'; n / 2], &repeated(n / 2, |_| field(4, &field(1, b"A"))));
        "descriptors: messages in messages": |n| {
            let inner = repeated(n, |_| field(3, &field(1, b"B")));
            file_set(b"p", &field(4, &[field(1, b"A"), inner].concat()))
        };
    }
    json_schema => {
        "JSON schema: keys": |n| numbered("{", n, |k| format!("\"k{k}\":0,"));
        "JSON schema: empty objects under a long key": |n| again(&format!("{{\"{}\":{{", "k".repeat(250)), "\"\":{},", "", n);
        "JSON schema: arrays": |n| again("{\"a\":", "[{},", "", n);
    }
    parsers::json => {
        "JSON: keys": |n| again("\0{", "\"gyro_x\":1,", "\"z\":0}", n);
        "JSON: objects in objects": |n| again("\0", "{\"imu\":", "", n);
        "JSON: samples in an array": |n| again("\0{\"a\":[", "{\"gyro\":[1,2,3]},", "{}]}", n);
        "JSON: samples with samples in them": |n| again("\0{\"a\":[", "{\"gyro\":[1,2,3],\"b\":[{\"gyro\":[1,2,3]}]},", "{}]}", n);
        "JSON: escapes": |n| again("\0{\"frame_id\":\"", "\\u0041\\\\", "\"}", n);
        "JSON: stamps again and again": |n| again("\0{", "\"header\":{\"stamp\":{\"sec\":1,\"nanosec\":2}},", "\"z\":0}", n);
        "JSON: a number of many digits": |n| again("\0{\"gyro\":[", "1", ",2,3]}", n);
        "JSON: a stamp of many digits": |n| again("\0{\"gyro\":[1,2,3],\"stamp\":\"", "1", "\"}", n);
        "JSON: brackets": |n| again("\0", "[", "", n);
        "JSON: spaces": |n| again("\0{\"gyro\"", " ", ":[1,2,3]}", n);
    }
    parsers::cdr => {
        "CDR: empty strings": |n| {
            let count = (n / 4) as u32;
            [&[2, 0, 1, 0, 0][..], &count.to_le_bytes(), &vec![0; n]].concat()
        };
        "CDR: empty samples": |n| {
            let count = (n / 40) as u32;
            [&[2, 0, 1, 0, 0, 0, 0, 0, 0][..], &count.to_le_bytes(), &vec![0; n]].concat()
        };
        "CDR: transforms": |n| {
            let count = (n / 80) as u32;
            [&[1, 0, 1, 0, 0][..], &count.to_le_bytes(), &vec![0; n]].concat()
        };
    }
    parsers::ros1 => {
        "ROS 1: empty strings": |n| {
            let count = (n / 4) as u32;
            [&[1][..], &count.to_le_bytes(), &vec![0; n]].concat()
        };
        "ROS 1: samples": |n| {
            let count = (n / 40) as u32;
            [&[1, 0, 0, 0, 0][..], &count.to_le_bytes(), &vec![0; n]].concat()
        };
    }
    parsers::protobuf => {
        "protobuf: samples": |n| [vec![0], repeated(n, |_| field(4, &field(1, &[0; 12])))].concat();
        "protobuf: one sample's numbers": |n| [vec![0], field(4, &repeated(n, |_| field(1, &[0; 4])))].concat();
        "protobuf: unknown fields": |n| [vec![0], vec![0x28; n]].concat();
    }
    line => {
        "a line: keys": |n| again("{\"class\":\"RATE\",", IMU_JSON, "\"stamp\":1}", n);
        "a line: a long id": |n| again("{\"class\":\"RATE\",\"id\":\"", "\\u0007", "\",\"gyro\":[1,2,3]}", n);
    }
    framed => {
        "lines: short": |n| again("", "{}\n", "", n);
        "lines: one in small pieces": |n| again("{", IMU_JSON, "\"stamp\":1}\n", n);
        "lines: blank": |n| again("", "\n", "", n);
        "lines: none ends": |n| again("", "x", "", n);
    }
    parsers::whole_table => {
        "tables: rows": |n| again(TABLE, "0.01,1,2,3\n", "", n);
        "tables: rows of many cells": wide;
        "tables: rows that are none": |n| again(TABLE, "0.01,x,2,3\n", "", n);
        "tables: rows in quotes": |n| again(TABLE, "\"0.01\",\"1\",\"2\",3\n", "", n);
        "tables: one quote": |n| again(&format!("{TABLE}\""), "a\"\"", "", n);
        "tables: other tables": |n| again(TABLE, "time_s,gyro_z,gyro_y,gyro_x\n1,2\n", "", n);
        "tables: a header of many names": |n| again("", "gyro_x,", "\n1,2,3\n", n);
        "tables: no header": |n| again("", "a,b,c\n", "", n);
    }
    parsers::lines => {
        "packed: objects": |n| b"\xf8\x01\x08\0\0\0\0\0".repeat(n / 8);
        "packed: broken objects": |n| b"\xf8\x01\0\0\n".repeat(n / 5);
    }
    mcap => {
        "log: channels": |n| records(n, |k| channel_record(k, &format!("/t{k}")));
        "log: channels of one topic": |n| records(n, |k| channel_record(k, "/t"));
        "log: one channel again": |n| records(n, |_| channel_record(1, "/t"));
        "log: a channel that changes": |n| records(n, |k| channel_record(1, &format!("/t{k}")));
        "log: schemas": |n| records(n, |k| schema_record(k, "float64 x"));
        "log: one schema again": |n| records(n, |_| schema_record(1, "float64 x"));
        "log: messages of no channel": |n| records(n, message_record);
        "log: messages of one channel": |n| records(n, |k| match k { 0 => channel_record(0, "/t"), _ => message_record(0) });
        "log: chunks of nothing": |n| records(n, |_| chunk_record(&[]));
        "log: chunks of one message": |n| records(n, |_| chunk_record(&message_record(0)));
        "log: a chunk of definitions": |n| records(n + 100, |k| match k { 0 => chunk_record(&records(n - 100, |k| channel_record(k, &format!("/t{k}")))[8..]), _ => vec![0; n] });
        "log: a chunk of zeros": |n| records(n + 100, |k| match k { 0 => chunk_record(&vec![0; n - 100]), _ => vec![0; n] });
        "log: metadata": |n| records(n, |_| record(op::METADATA, &[sized(b""), sized(b"")].concat()));
        "log: pairs of one channel": |n| records(n + 100, |k| match k { 0 => record(op::CHANNEL, &[&[1, 0, 0, 0][..], &sized(b"t"), &sized(b""), &sized(&vec![0; (n - 100) / 8 * 8])].concat()), _ => vec![0; n] });
        "log: logs joined": |n| records(n, |_| [record(op::DATA_END, &[0; 4]), record(op::FOOTER, &[0; 20]), MAGIC.to_vec(), MAGIC.to_vec()].concat());
        "log: nothing but heads of chunks": |n| records(n, |_| vec![op::CHUNK; 9]);
        "log: garbage": |n| records(n, |_| vec![0x55; 9]);
        // The length it claims is shorter than any input: one between two of them costs a second look from there on.
        "ULog: garbage": |n| ulog(n, |_| vec![5; 9]);
        "ULog: zeros": |n| ulog(n, |_| vec![0; 9]);
        "ULog: messages nothing defines": |n| ulog(n, |k| ulog_record(b'D', &[k as u8, 0, 1, 2, 3]));
        "ULog: two records, then none": |n| ulog(n, |_| [ulog_record(b'R', &[0; 2]), ulog_record(b'R', &[0; 2]), vec![0xff; 5]].concat());
        "ULog: records of no known type": |n| ulog(n, |_| ulog_record(b'z', &[0; 20]));
        "ULog: texts that are none": |n| ulog(n, |_| ulog_record(b'L', &[0; 20]));
        "ULog: formats": |n| ulog(n, |k| ulog_record(b'F', format!("f{k}:f{} x;", k + 1).as_bytes()));
        "ULog: subscriptions of one format": |n| ulog(n, |k| match k {
            0 => ulog_record(b'F', b"f:uint64_t timestamp;"),
            _ => ulog_record(b'A', b"\0\0\0f"),
        });
        "ULog: subscriptions of a circle": |n| ulog(n, |k| match k {
            0 => ulog_record(b'F', b"f:f x;f y;"),
            _ => ulog_record(b'A', b"\0\0\0f"),
        });
        "ULog: messages": |n| ulog(n, |k| match k {
            0 => [ulog_record(b'F', b"f:uint64_t timestamp;"), ulog_record(b'A', b"\0\0\0f")].concat(),
            _ => ulog_record(b'D', &[0; 10]),
        });
        "SQLite: messages": |n| sqlite(n);
        "SQLite: leaves that are none": |n| {
            let mut out = sqlite(n);
            out[3 * 1024..].fill(0x55);
            out
        };
        "SQLite: children that are not there": |n| {
            let mut out = sqlite(n);
            let end = 2 * 1024 + 12 + 2 * usize::from(out[2 * 1024 + 4]);
            out[end..3 * 1024].fill(0x33);
            out
        };
        "tlog: garbage": |n| [&b"\0\x06\0\0\0\0\0\0\xfd\xff\0"[..], &vec![0x55; n]].concat();
        "tlog: times": |n| b"\0\x06\0\0\0\0\0\0\xfe\xff".repeat(n / 10);
        "tlog: messages that are not read": |n| b"\0\x06\0\0\0\0\0\0\xfe\0\0\0\0\x07\0\0".repeat(n / 16);
        "MAVLink capture: marks": |n| [capture_head(), b"\xfd\x09\0".repeat(n / 3)].concat();
        "MAVLink capture: messages that are not read": |n| [capture_head(), b"\xfe\0\0\0\0\x07\0\0".repeat(n / 8)].concat();
        "sensor capture: marks of Xsens": |n| [captured("xsens"), b"\xfa\xff\x36\xfe".repeat(n / 4)].concat();
        "sensor capture: marks of MIP": |n| [captured("mip"), b"\x75\x65\x80\xff".repeat(n / 4)].concat();
        "sensor capture: marks of VectorNav": |n| [captured("vectornav"), b"\xfa\x01\xff\x0f".repeat(n / 4)].concat();
        "sensor capture: lines of VectorNav": |n| [captured("vectornav"), b"$VN".repeat(n / 3)].concat();
        "sensor capture: marks of WitMotion": |n| [captured("witmotion"), b"\x55\x52".repeat(n / 2)].concat();
        "sensor capture: marks of x-IMU3": |n| [captured("ximu3"), b"\xc9".repeat(n)].concat();
        "sensor capture: text of x-IMU3": |n| [captured("ximu3"), b"I,1".repeat(n / 3)].concat();
        "DataFlash: garbage": |n| [&b"\xa3\x95\x80"[..], &vec![0x55; n]].concat();
        "DataFlash: marks": |n| b"\xa3\x95\x80".repeat(n / 3);
        "GPMF: empty devices": |n| b"DEVC\0\x01\0\0".repeat(n / 8);
        "GPMF: devices that go on behind the end": |n| b"DEVC\0\xff\xff\xff".repeat(n / 8);
        "GPMF: garbage": |n| [&b"DEVC\0\x01\0\0"[..], &vec![0x55; n]].concat();
        "GPMF: garbage between devices": |n| b"DEVC\0\x01\0\0.....".repeat(n / 13);
        "bag: garbage": |n| bag(n, |_| vec![0x55; 9]);
        "bag: heads of chunks that go on behind the end": |n| bag(n, |_| bag_record(5, &[("compression", b"none"), ("size", &[0, 0, 16, 0])], 1 << 20, &[]));
        "bag: empty chunks": |n| bag(n, |_| bag_record(5, &[("compression", b"bz2"), ("size", &[1, 0, 0, 0])], 0, &[]));
        "bag: index records": |n| bag(n, |_| bag_record(4, &[("conn", &[0; 4])], 0, &[]));
        "bag: connections": |n| bag(n, |k| bag_record(7, &[("conn", &(k as u32).to_le_bytes()), ("topic", b"/t")], 0, &[]));
        "bag: messages": |n| bag(n, |_| bag_record(2, &[("conn", &[0; 4]), ("time", &[0; 8])], 4, &[0; 4]));
    }
    mcap_file => {
        "file: garbage after each chunk": |n| records(n, |_| [chunk_record(&[]), vec![0; 9]].concat());
        "file: records that skip to garbage": |n| {
            let mut out = records(n - 40, |_| [chunk_record(&[]), record(0x20, &[0; 8])].concat());
            let end = out.len() as u64;
            for at in 8..out.len().saturating_sub(9) {
                if out[at] == 0x20 && out[at + 1..at + 9] == 8_u64.to_le_bytes() {
                    let length = (end - at as u64 - 9).to_le_bytes();
                    out[at + 1..at + 9].copy_from_slice(&length);
                }
            }
            out.extend([0; 30]);
            out
        };
    }
    arguments => {
        "arguments: a path of fields": |n| again("gyro=", "a.", "b", n);
        "arguments: elements": |n| again("gyro=a", "[1]", "", n);
        "arguments: commas": |n| again("gyro=", "a,", "a", n);
        "arguments: an address": |n| again("tcp://", "[::1]:", "80?a=b", n);
        "arguments: parameters": |n| again("udp://127.0.0.1:1?", "a=b&", "", n);
        "arguments: numbers": |n| again("", "1,", "1", n);
        "arguments: quotes": |n| again("", "'\n", "", n);
    }
};
