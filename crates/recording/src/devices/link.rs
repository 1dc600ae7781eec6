//! Bytes of a living link, in any cut -> lines of samples, as a daemon reads them. Pure: time comes with the bytes.
//!
//! Apart from the readers because here a link becomes what everything behind it knows already: names, lines, and words
//! about what is lost.

use super::auto::{Auto, Found, PATIENCE};
use super::reader::Reader;
use super::sample::{Sample, name};
use super::{Asked, Opens, Protocol};
use crate::mavlink;
use crate::records::problem::ProblemKind;
use strapd_attitude::record::Nanos;

/// Link of a protocol that is asked for.
#[derive(Debug)]
pub struct Link {
    state: State,
    /// Time of the first bytes.
    began: Option<Nanos>,
    bytes: u64,
    told: Told,
    notes: Vec<Note>,
}

/// Words about a link, for the log.
#[derive(Clone, PartialEq, Debug)]
pub struct Note {
    /// Name of what it is about, of which the last words hold.
    pub about: &'static str,
    /// Text.
    pub text: String,
    /// Whether something is wrong.
    pub is_warning: bool,
}

impl Note {
    fn warning(about: &'static str, text: String) -> Note {
        Note {
            about,
            text,
            is_warning: true,
        }
    }
}

/// Counts that were reported.
#[derive(Debug, Default)]
struct Told {
    silence: bool,
    missing: u64,
    clipped: u64,
    skipped: u64,
}

#[derive(Debug)]
enum State {
    /// Lines, which are passed on as they are.
    Lines,
    Mavlink(&'static Protocol, mavlink::Link),
    Device(&'static Protocol, Box<Reader>),
    Auto(Box<Auto>),
    /// A protocol of which nothing can be used.
    Useless,
}

impl Link {
    /// Link of what is asked for; `None` where that is lines.
    #[must_use]
    pub fn of(asked: Asked) -> Option<Link> {
        let state = match asked {
            Asked::Lines => return None,
            Asked::Auto => State::Auto(Box::default()),
            Asked::Named(protocol) => State::of(protocol),
        };
        Some(Link {
            state,
            began: None,
            bytes: 0,
            told: Told::default(),
            notes: Vec::new(),
        })
    }

    /// Takes the next bytes, received `now`, and appends a line for each sample in them; `prefix` names the sensor, or goes
    /// before the names of several.
    pub fn push(&mut self, bytes: &[u8], now: Nanos, prefix: Option<&str>, lines: &mut Vec<u8>) {
        let began = *self.began.get_or_insert(now);
        self.bytes += bytes.len() as u64;
        if let State::Auto(auto) = &mut self.state {
            match auto.push(bytes, now) {
                Some((found, held)) => {
                    self.settle(found);
                    self.state.push(&held, prefix, lines);
                }
                None => {
                    let unknown = auto.unknown(now);
                    self.notes.extend(unknown.map(|bytes| {
                        let text = format!("{bytes} bytes and no frame of any known protocol, nor a line of text, in 2 s: the baud rate is another, or the device sends something else");
                        Note::warning("protocol", text)
                    }));
                }
            }
        } else {
            self.state.push(bytes, prefix, lines);
        }
        self.report(now.since(began) >= PATIENCE);
    }

    fn settle(&mut self, found: Found) {
        let (state, what, is_warning) = match found {
            Found::Lines => (State::Lines, "lines of text".to_owned(), false),
            Found::Protocol(protocol) => {
                let refusal = protocol.refusal();
                let what = match refusal {
                    None => format!("{}, as protocol={}", protocol.title, protocol.name),
                    Some(why) => format!("{}, which cannot be used: {why}", protocol.title),
                };
                (State::of(protocol), what, refusal.is_some())
            }
        };
        self.state = state;
        self.notes.push(Note {
            about: "protocol",
            text: format!("recognised {what}"),
            is_warning,
        });
    }

    fn report(&mut self, is_late: bool) {
        let (frames, missing) = self.counts();
        let named = match &self.state {
            State::Device(protocol, _) | State::Mavlink(protocol, _) => Some(protocol.title),
            State::Lines | State::Auto(_) | State::Useless => None,
        };
        if let Some(title) = named.filter(|_| is_late && frames == 0)
            && !std::mem::replace(&mut self.told.silence, true)
        {
            let bytes = self.bytes;
            let text = format!(
                "{bytes} bytes and no frame of {title} in 2 s: the baud rate is another, or the device sends something else (protocol=auto finds out what)"
            );
            self.notes.push(Note::warning("protocol", text));
        }
        if missing > self.told.missing {
            self.told.missing = missing;
            let all = frames + missing;
            let text =
                format!("{missing} frames that the sender has numbered did not come, of {all}");
            self.notes.push(Note::warning("frames missing", text));
        }
        let State::Device(_, reader) = &self.state else {
            return;
        };
        let (skipped, clipped) = (reader.skipped, reader.taken.clipped);
        if clipped > self.told.clipped {
            self.told.clipped = clipped;
            let text = ProblemKind::Clipped { count: clipped }.to_string();
            self.notes.push(Note::warning("clipped", text));
        }
        if skipped > self.told.skipped {
            self.told.skipped = skipped;
            let text = format!(
                "{skipped} bytes between frames are no frame: damage, or two devices on one port"
            );
            self.notes.push(Note::warning("bytes skipped", text));
        }
    }

    /// Words about the link that were not taken yet, for the log.
    pub fn notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    /// Appends the lines that are held, where nothing more comes.
    pub fn finish(&mut self, lines: &mut Vec<u8>) {
        if let State::Auto(auto) = &mut self.state {
            lines.append(&mut auto.rest());
        }
    }

    /// Whether its lines are those of samples in frames, and not lines that came.
    #[must_use]
    pub fn has_frames(&self) -> bool {
        matches!(self.state, State::Mavlink(..) | State::Device(..))
    }

    /// Whether its samples may have no stamp, since a device has no clock.
    #[must_use]
    pub fn may_lack_stamps(&self) -> bool {
        matches!(self.state, State::Device(..))
    }

    /// Number of frames so far, and of those that their senders have numbered and that did not come.
    #[must_use]
    pub fn counts(&self) -> (u64, u64) {
        match &self.state {
            State::Mavlink(_, link) => link.counts(),
            State::Device(_, reader) => (reader.frames, reader.taken.missing),
            State::Lines | State::Auto(_) | State::Useless => (0, 0),
        }
    }
}

impl State {
    fn of(protocol: &'static Protocol) -> State {
        match protocol.opens {
            Opens::Device(open) => State::Device(protocol, Box::new(Reader::of(protocol, open()))),
            Opens::Mavlink => State::Mavlink(protocol, mavlink::Link::default()),
            Opens::Nothing(_) => State::Useless,
        }
    }

    fn push(&mut self, bytes: &[u8], prefix: Option<&str>, lines: &mut Vec<u8>) {
        match self {
            State::Lines => lines.extend_from_slice(bytes),
            State::Mavlink(_, link) => link.push(bytes, prefix, lines),
            State::Device(protocol, reader) => {
                reader.push(bytes);
                // An attitude of the device's own is none that a daemon takes.
                let samples = reader.taken.samples.drain(..);
                for sample in samples.filter(Sample::has_motion) {
                    sample.line(&name(prefix.unwrap_or(protocol.name), sample.unit), lines);
                }
            }
            State::Auto(_) | State::Useless => {}
        }
    }
}
