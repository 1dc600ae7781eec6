//! Position of a replay, and what a client may ask of it. Pure: what the protocols and the hub know of a playback.

use crate::serve::guard::fault::Fault;
use strapd_attitude::record::Nanos;

/// Whether it moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Playing.
    Playing,
    /// Waiting for a client.
    Paused,
    /// Ended.
    Ended,
}

impl Mode {
    /// Name on the wire.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Mode::Playing => "playing",
            Mode::Paused => "paused",
            Mode::Ended => "ended",
        }
    }
}

/// Action that a client asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Go on; after the end, from the start.
    Play,
    /// Wait.
    Pause,
    /// Be there.
    Seek(Nanos),
    /// Be so many times as fast as the data.
    Speed(f64),
}

/// Position.
#[derive(Clone, Debug, PartialEq)]
pub struct Position {
    /// Whether it moves.
    pub mode: Mode,
    /// Stamp of what was shown last, or of where it is going.
    pub at: Option<Nanos>,
    /// First stamp.
    pub start: Option<Nanos>,
    /// Last stamp, as far as it is known.
    pub end: Option<Nanos>,
    /// Speed as a multiple of the data's.
    pub speed: f64,
    /// File that is played.
    pub file: String,
    /// Number of times it was begun anew: attitudes before and after a change do not belong together.
    pub run: u64,
    /// Whether there is an overview of the whole.
    pub has_overview: bool,
}

/// Part of a recording of which curves are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// First stamp; `None`: from the start.
    pub from: Option<Nanos>,
    /// Last stamp; `None`: to the end.
    pub to: Option<Nanos>,
    /// Most points of each stream.
    pub points: usize,
}

/// A replay that is served, as the hub sees it.
pub trait Timeline: Send + Sync {
    /// Position; `None`: it cannot be controlled.
    fn position(&self) -> Option<Position>;

    /// Number of times it was begun anew.
    fn run(&self) -> u64;

    /// A client asks for something. `stale` is called where what waits for the watchers is out of date
    /// by that, before the run goes on.
    ///
    /// # Errors
    /// The fault to answer with.
    fn ask(&self, action: Action, stale: &mut dyn FnMut()) -> Result<(), Fault>;

    /// Curves of a part of the whole; `None`: nobody has looked at the whole.
    fn overview(&self, part: &Part) -> Option<serde_json::Value> {
        let _ = part;
        None
    }
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl std::fmt::Debug for dyn Timeline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Timeline")
    }
}
