//! Channels of a log -> the topics to estimate from. Pure.
//!
//! Never mixes two IMUs, never guesses silently: when a choice is made it is said, when it cannot
//! be made the error lists what is there.

use crate::error::{Error, Result};
use crate::text::named_few;
use std::collections::BTreeSet;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::TOPIC;

/// Candidate: what the choice needs to know of one channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Name that `--topic` takes: the topic, or one of its sources.
    pub topic: String,
    /// The topic.
    pub of: String,
    /// Type and encoding, for the listing.
    pub described: String,
    /// Messages, where known.
    pub messages: Option<u64>,
    /// Likelihood that this is "the IMU": 0 = carries no rate, 1 = could be told to, higher = better.
    pub rank: u8,
    /// Whether these are attitudes of a sensor whose samples are another topic: no other sensor.
    pub is_derived: bool,
    /// Name of the columns that tell the sensors of a table apart, where it is one of a table.
    pub sensor_column: Option<String>,
}

/// A rank from which a topic is picked without being named.
pub const PICKED_UNNAMED: u8 = 2;

/// Most topics that are looked at or integrated at once: each takes memory and a part of every step. Robots
/// have a few IMUs, and the largest body suits some dozens.
pub const MOST_TOPICS: usize = 256;

/// The topics to estimate from, and what to say about the choice.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Choice {
    /// Topics in order of appearance.
    pub topics: Vec<String>,
    /// A note for the user, when something else was there too.
    pub note: Option<Diagnostic>,
}

/// Chooses. `named` is `--topic`.
///
/// # Errors
/// [`Error::NoImuTopic`], [`Error::SeveralImuTopics`], [`Error::NoSuchTopic`].
pub fn choose(path: &Path, candidates: &[Candidate], named: Option<&str>) -> Result<Choice> {
    let best = candidates.iter().map(|c| c.rank).max().unwrap_or(0);
    match named {
        Some("all") if best >= PICKED_UNNAMED => all(path, candidates),
        Some(topic) if topic != "all" => {
            if candidates.iter().any(|c| c.topic == topic) {
                return Ok(Choice {
                    topics: vec![topic.to_owned()],
                    note: None,
                });
            }
            Err(Error::NoSuchTopic {
                path: path.to_owned(),
                topic: topic.to_owned(),
                topics: listing(candidates),
            })
        }
        _ if best < PICKED_UNNAMED => Err(Error::NoImuTopic {
            path: path.to_owned(),
            topics: listing(candidates),
            undefined: None,
        }),
        _ => the_best(path, candidates, best),
    }
}

/// Topics of at least this rank, each once.
fn imus(candidates: &[Candidate], least: u8) -> Vec<String> {
    let mut seen = BTreeSet::new();
    candidates
        .iter()
        .filter(|c| c.rank >= least && seen.insert(c.topic.as_str()))
        .map(|c| c.topic.clone())
        .collect()
}

/// Chooses all topics that carry a rate.
fn all(path: &Path, candidates: &[Candidate]) -> Result<Choice> {
    let topics = imus(candidates, PICKED_UNNAMED);
    if topics.len() > MOST_TOPICS {
        return Err(Error::Unsupported {
            path: path.to_owned(),
            what: Diagnostic::new(format!(
                "{} topics carry a rate, and at most {MOST_TOPICS} are taken at once: {}",
                topics.len(),
                named_few(&topics)
            ))
            .help(format!("{TOPIC} NAME takes one of them")),
        });
    }
    Ok(Choice { topics, note: None })
}

/// Chooses the one topic of the best rank.
fn the_best(path: &Path, candidates: &[Candidate], best: u8) -> Result<Choice> {
    let topics = imus(candidates, best);
    if topics.len() > 1 {
        let these = candidates.iter().filter(|c| c.rank == best);
        let these: Vec<Candidate> = these.cloned().collect();
        if let Some(choice) = first_of_table(&these) {
            return Ok(choice);
        }
        return Err(Error::SeveralImuTopics {
            path: path.to_owned(),
            topics: listing(&these),
        });
    }
    let is_own = |name: &String| {
        let mut all = candidates.iter().filter(|c| c.topic == *name);
        topics.contains(name) || all.all(|c| c.is_derived)
    };
    let mut others = imus(candidates, PICKED_UNNAMED);
    others.retain(|name| !is_own(name));
    let note = (!others.is_empty()).then(|| {
        Diagnostic::new(format!(
            "took {}; {} could be taken too",
            named_few(&topics),
            named_few(&others)
        ))
        .help(format!("{TOPIC} NAME"))
    });
    Ok(Choice { topics, note })
}

/// Chooses the first sensor of one table: its rows name whose they are, and nothing is mixed. The others are named.
fn first_of_table(sensors: &[Candidate]) -> Option<Choice> {
    let (first, others) = sensors.split_first()?;
    let column = first.sensor_column.as_ref()?;
    if others
        .iter()
        .any(|other| other.sensor_column.as_ref() != Some(column))
    {
        return None;
    }
    let counted = |sensor: &Candidate| match sensor.messages {
        Some(count) => format!("{} ({count} samples)", sensor.topic),
        None => sensor.topic.clone(),
    };
    let named: Vec<String> = others.iter().map(counted).collect();
    let other = match others {
        [one] => one.topic.as_str(),
        _ => "NAME",
    };
    let note = Diagnostic::new(format!(
        "{} sensors are in this table, by its column {column}: took the first, {}, and left out {}",
        sensors.len(),
        counted(first),
        named_few(&named)
    ))
    .help(format!("{TOPIC} {other} takes another, {TOPIC} all each"))
    .coded("several-topics");
    Some(Choice {
        topics: vec![first.topic.clone()],
        note: Some(note),
    })
}

/// One indented line per channel, at most 40.
#[must_use]
pub fn listing(candidates: &[Candidate]) -> String {
    const MOST: usize = 40;
    if candidates.is_empty() {
        return "\n    nothing".to_owned();
    }
    let mut out: String = candidates
        .iter()
        .take(MOST)
        .map(|c| {
            let count = c
                .messages
                .map_or_else(String::new, |n| format!("  {n} messages"));
            let topic = crate::text::printable(&c.topic);
            format!("\n    {topic}  {}{count}", c.described)
        })
        .collect();
    if candidates.len() > MOST {
        out.push_str(&format!("\n    ... and {} more", candidates.len() - MOST));
    }
    out
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn candidate(topic: &str, rank: u8) -> Candidate {
        Candidate {
            topic: topic.into(),
            of: topic.into(),
            described: "t [e]".into(),
            messages: Some(3),
            rank,
            is_derived: false,
            sensor_column: None,
        }
    }

    fn chosen(candidates: &[Candidate], named: Option<&str>) -> Result<Choice> {
        choose(Path::new("a.mcap"), candidates, named)
    }

    #[test]
    fn the_only_imu_needs_no_name_and_an_odometry_is_never_picked_unnamed() {
        let all = [
            candidate("/odom", 1),
            candidate("/imu", 5),
            candidate("/mag", 0),
        ];
        assert_eq!(chosen(&all, None).unwrap().topics, ["/imu"]);
        assert!(matches!(
            chosen(&all[..1], None),
            Err(Error::NoImuTopic { .. })
        ));
        assert_eq!(chosen(&all, Some("/odom")).unwrap().topics, ["/odom"]);
    }

    #[test]
    fn two_imus_are_refused_without_a_name_and_listed() {
        let all = [candidate("/a", 5), candidate("/b", 5)];
        let error = chosen(&all, None).unwrap_err().to_string();
        assert!(
            error.contains("/a") && error.contains("/b") && error.contains("topic"),
            "{error}"
        );
        assert_eq!(chosen(&all, Some("all")).unwrap().topics, ["/a", "/b"]);
    }

    #[test]
    fn of_the_sensors_of_one_table_the_first_is_taken_and_the_others_are_named() {
        let of_table = |topic: &str| Candidate {
            sensor_column: Some("device".to_owned()),
            ..candidate(topic, 5)
        };
        let all = [of_table("left"), of_table("right")];
        let choice = chosen(&all, None).unwrap();
        assert_eq!(choice.topics, ["left"]);
        let note = choice.note.unwrap().to_string();
        for part in [
            "column device",
            "left out right (3 samples)",
            "topic right",
            "topic all",
        ] {
            assert!(note.contains(part), "{note}");
        }
        assert_eq!(chosen(&all, Some("right")).unwrap().topics, ["right"]);
        assert!(chosen(&[of_table("left"), candidate("/imu", 5)], None).is_err());
    }

    #[test]
    fn a_better_ranked_topic_is_taken_and_the_other_is_said() {
        let all = [
            candidate("/vehicle_imu", 3),
            candidate("/sensor_combined", 4),
        ];
        let choice = chosen(&all, None).unwrap();
        assert_eq!(choice.topics, ["/sensor_combined"]);
        let note = choice.note.unwrap().to_string();
        assert!(note.contains("/vehicle_imu"));
    }

    #[test]
    fn two_channels_of_one_topic_are_one_topic() {
        let all = [candidate("/imu", 5), candidate("/imu", 5)];
        assert_eq!(chosen(&all, None).unwrap().topics, ["/imu"]);
    }

    #[test]
    fn a_wrong_name_lists_what_is_there() {
        let error = chosen(&[candidate("/imu", 5)], Some("/nope"))
            .unwrap_err()
            .to_string();
        assert!(error.contains("/nope") && error.contains("/imu"), "{error}");
    }
}
