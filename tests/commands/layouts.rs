//! Promise: the layouts in `packaging/layouts` can be read, and name only topics, fields and frames that `strapd
//! replay` writes: what a viewer shows at once is not an empty panel.

use crate::program::strapd;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Topic of the layouts.
const TOPIC: &str = "/imu/data/attitude";
/// Topic that the script in Lichtblick's layout makes.
const MADE: &str = "/studio_script/angles";

fn layout(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging/layouts");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

/// Topic to the definition of its messages.
fn written(dir: &Path) -> BTreeMap<String, String> {
    let log = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fixtures/xsens_mti.mcap");
    let ran = strapd(dir, &format!("replay {} -o a.mcap", log.display()));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let bytes = std::fs::read(dir.join("a.mcap")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let text = |channel: &mcap::Channel<'_>| {
        String::from_utf8(channel.schema.as_ref().unwrap().data.to_vec()).unwrap()
    };
    let channels = summary.channels.values();
    channels.map(|c| (c.topic.clone(), text(c))).collect()
}

/// Whether a message of this definition has the field.
fn has(definition: &str, path: &[&str]) -> bool {
    let [name, rest @ ..] = path else { return true };
    let name = name.split('[').next().unwrap();
    let own = definition.split("\n===").next().unwrap();
    let Some(of) = own.lines().find_map(|line| {
        let mut words = line.split_whitespace();
        let of = words.next()?;
        (words.next()? == name).then_some(of)
    }) else {
        return false;
    };
    if rest.is_empty() {
        return true;
    }
    let short = of.rsplit('/').next().unwrap();
    let part = definition.split("MSG: ").skip(1).find(|part| {
        let head = part.lines().next().unwrap().trim();
        head.rsplit('/').next() == Some(short)
    });
    part.is_some_and(|part| {
        let own = part.split_once('\n').unwrap().1.split("\n===").next();
        // What it is made of stands in the whole.
        let whole = format!("{}\n===\n{definition}", own.unwrap());
        has(&whole, rest)
    })
}

/// Every text of a document that begins as a topic does.
fn topics(value: &Value, out: &mut Vec<String>) {
    match value {
        Value::String(text) if text.starts_with('/') => out.push(text.clone()),
        Value::Array(values) => values.iter().for_each(|value| topics(value, out)),
        Value::Object(fields) => {
            for (name, value) in fields {
                topics(&Value::String(name.clone()), out);
                topics(value, out);
            }
        }
        _ => {}
    }
}

#[test]
fn layouts_of_foxglove_and_lichtblick_name_what_a_replay_writes() {
    let dir = tempfile::tempdir().unwrap();
    let written = written(dir.path());
    for name in ["foxglove.json", "lichtblick.json"] {
        let layout: Value = serde_json::from_str(&layout(name)).unwrap();
        let panels = layout["configById"].as_object().unwrap();
        // Each panel has its place, and each place its panel.
        let mut places = Vec::new();
        let mut open = vec![&layout["layout"]];
        while let Some(node) = open.pop() {
            match node.as_str() {
                Some(panel) => places.push(panel),
                None => open.extend([&node["first"], &node["second"]]),
            }
        }
        places.sort_unstable();
        assert_eq!(places, panels.keys().collect::<Vec<_>>(), "{name}");
        let (mut named, mut checked) = (Vec::new(), 0);
        topics(&layout["configById"], &mut named);
        for path in named {
            let (topic, field) = path.split_once('.').unwrap_or((&path, ""));
            if topic == MADE {
                let source = layout["userNodes"]["angles"]["sourceCode"]
                    .as_str()
                    .unwrap();
                assert!(source.contains(&format!("{field}: number")), "{path}");
                assert!(source.contains(&format!("output = \"{MADE}\"")));
                assert!(source.contains(&format!("inputs = [\"{TOPIC}\"]")));
                continue;
            }
            let definition = written.get(topic);
            let definition = definition.unwrap_or_else(|| unreachable!("{name}: {path}"));
            // What begins with @ the viewer works out.
            let fields: Vec<&str> = field
                .split('.')
                .take_while(|part| !part.starts_with('@'))
                .filter(|part| !part.is_empty())
                .collect();
            assert!(has(definition, &fields), "{name}: {path}");
            checked += 1;
        }
        assert!(checked >= 7, "{name}: {checked}");
    }
    let imu = &written[TOPIC];
    assert!(has(imu, &["orientation", "w"]) && !has(imu, &["orientation", "roll"]));
    assert!(!has(imu, &["header", "stamp", "secs"]) && !has(imu, &["rate"]));
}

#[test]
fn the_layout_of_plotjuggler_names_what_a_replay_writes() {
    let dir = tempfile::tempdir().unwrap();
    let written = written(dir.path());
    let text = layout("plotjuggler.xml");
    // Well formed: every element that begins ends, in order.
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let tag = tag.split('>').next().unwrap();
        match tag.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name), "{tag}"),
            None if tag.starts_with('?') || tag.ends_with('/') => {}
            None => open.extend(tag.split_whitespace().next()),
        }
    }
    assert!(open.is_empty(), "{open:?}");
    let between = |from: &str, to: &str| -> Vec<&str> {
        let parts = text.split(from).skip(1);
        parts.map(|part| part.split(to).next().unwrap()).collect()
    };
    let made = between("<snippet name=\"", "\"");
    assert_eq!(made.len(), 3);
    let mut named = between("<curve name=\"", "\"");
    named.retain(|name| !made.contains(name));
    for (from, to) in [
        ("<linked_source>", "<"),
        ("<v1>", "<"),
        ("<v2>", "<"),
        ("<v3>", "<"),
    ] {
        named.extend(between(from, to));
    }
    assert_eq!(named.len(), 6 + 12);
    for name in named {
        let fields = name
            .strip_prefix(TOPIC)
            .unwrap_or_else(|| unreachable!("{name}"));
        let fields: Vec<&str> = fields.split('/').skip(1).collect();
        assert!(has(&written[TOPIC], &fields), "{name}");
    }
}

#[test]
fn the_view_of_rerun_is_of_what_a_replay_writes() {
    let dir = tempfile::tempdir().unwrap();
    let written = written(dir.path());
    let text = layout("rerun_view.py");
    assert!(text.contains(&format!("default=\"{TOPIC}\"")) && written.contains_key(TOPIC));
    assert!(text.contains("\"/tf\"") && written.contains_key("/tf"));
    // The frames of `/tf`, by which it is drawn.
    let bytes = std::fs::read(dir.path().join("a.mcap")).unwrap();
    let first = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .find(|message| message.channel.topic == "/tf")
        .unwrap();
    let said = String::from_utf8_lossy(&first.data).into_owned();
    assert!(
        said.contains("world") && said.contains("imu_link"),
        "{said}"
    );
    for name in ["foxglove.json", "lichtblick.json", "rerun_view.py"] {
        assert!(layout(name).contains("world"), "{name}");
    }
}
