//! Where a long run is: a bar on a terminal, or one JSON object a second. I/O.

use super::{Global, Progress as Mode};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Where a run is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Position {
    /// Bytes of the input done.
    pub bytes: u64,
    /// Bytes of the input in all, where known.
    pub total_bytes: Option<u64>,
    /// Seconds of data since the first sample.
    pub data_secs: f64,
    /// Samples read.
    pub samples: u64,
    /// Attitudes written.
    pub written: u64,
    /// Gaps so far.
    pub gaps: u64,
    /// Samples lost so far.
    pub lost: u64,
}

/// Shows positions; cheap to call often.
#[derive(Debug)]
pub struct Reporter {
    mode: Show,
    begun: Instant,
    shown: Option<Instant>,
}

#[derive(Debug)]
enum Show {
    Nothing,
    Bar(ProgressBar),
    Json,
}

impl Reporter {
    /// As `--progress` and `--quiet` say; the bar only on a terminal.
    #[must_use]
    pub fn new(global: &Global, name: &str) -> Reporter {
        let mode = match global.progress {
            Mode::Json => Show::Json,
            Mode::Auto if !global.quiet && std::io::stderr().is_terminal() => Show::Bar(bar(name)),
            Mode::Auto | Mode::None => Show::Nothing,
        };
        Reporter { mode, begun: Instant::now(), shown: None }
    }

    /// Shows `position` if the last one is old enough.
    pub fn update(&mut self, position: &Position) {
        let every = match self.mode {
            Show::Nothing => return,
            Show::Bar(_) => Duration::from_millis(100),
            Show::Json => Duration::from_secs(1),
        };
        if self.shown.is_some_and(|t| t.elapsed() < every) {
            return;
        }
        self.shown = Some(Instant::now());
        self.show(position);
    }

    /// Shows the end and leaves the terminal clean.
    pub fn finish(&mut self, position: &Position) {
        match &self.mode {
            Show::Nothing => {}
            Show::Bar(bar) => bar.finish_and_clear(),
            Show::Json => self.show(position),
        }
    }

    fn show(&self, p: &Position) {
        let wall = self.begun.elapsed().as_secs_f64().max(1e-9);
        match &self.mode {
            Show::Nothing => {}
            Show::Bar(bar) => {
                bar.set_length(p.total_bytes.unwrap_or(p.bytes));
                bar.set_position(p.bytes);
                bar.set_message(format!(
                    "{:.1} s  {:.0}x  {} samples/s  gaps {}  lost {}",
                    p.data_secs,
                    p.data_secs / wall,
                    crate::report::summary::human_count(p.samples as f64 / wall),
                    p.gaps,
                    p.lost
                ));
            }
            Show::Json => {
                let object = serde_json::json!({
                    "class": "PROGRESS", "bytes": p.bytes, "total_bytes": p.total_bytes,
                    "data_s": p.data_secs, "samples": p.samples, "written": p.written,
                    "gaps": p.gaps, "lost": p.lost, "elapsed_s": wall,
                });
                // A stderr that is gone leaves nobody to tell.
                let _ = writeln!(std::io::stderr(), "{object}");
            }
        }
    }
}

fn bar(name: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(
        "{prefix} {bar:24.cyan/blue} {bytes}/{total_bytes}  ETA {eta}  {msg}",
    )
    .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    bar.set_style(style);
    bar.set_prefix(name.to_owned());
    bar
}
