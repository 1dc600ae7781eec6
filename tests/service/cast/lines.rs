//! Output of a run on standard output, and what a client was sent of it.

use crate::program;
use crate::serve::client::Client;
use serde_json::Value;
use std::path::Path;

pub(crate) const LOG: &str = "fixtures/xsens_mti.mcap";
pub(crate) const SIMULATION: &str = "simulate top --rate-hz 200 --duration 2 --drop 0.05";

/// The lines of `strapd ARGS -o -`.
pub(crate) fn lines_of(arguments: &str) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ran = program::strapd(root, &format!("{arguments} -o -"));
    ran.done().out.lines().map(str::to_owned).collect()
}

/// Lines of a class.
pub(crate) fn of_class(lines: &[String], class: &str) -> Vec<String> {
    let head = format!("{{\"class\":\"{class}\"");
    lines
        .iter()
        .filter(|l| l.starts_with(&head))
        .cloned()
        .collect()
}

impl Client {
    /// Every line up to the close.
    pub(crate) fn lines(&mut self) -> Vec<String> {
        std::iter::from_fn(|| self.line()).collect()
    }

    /// Asks for something of the playback; the answer.
    pub(crate) fn play(&mut self, action: &str) -> Value {
        self.send(&format!("{{\"class\":\"PLAYBACK\",\"action\":{action}}}"));
        self.next_of("PLAYBACK")
    }
}
