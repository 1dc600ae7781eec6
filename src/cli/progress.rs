//! Position of a long run: a bar on a terminal, or one JSON object a second. I/O.

use super::{Global, Progress as Mode};
use crate::pipeline::position::Position;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Steps of the bar.
const TICKS: u64 = 1000;

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
    /// Makes one as `--progress` and `--quiet` state; the bar only on a terminal.
    #[must_use]
    pub fn new(global: &Global, name: &str) -> Reporter {
        let mode = match global.progress {
            Mode::Json => Show::Json,
            Mode::Auto if !global.quiet && std::io::stderr().is_terminal() => Show::Bar(bar(name)),
            Mode::Auto | Mode::None => Show::Nothing,
        };
        Reporter {
            mode,
            begun: Instant::now(),
            shown: None,
        }
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

    /// Leaves the terminal clean.
    pub fn finish(&mut self) {
        if let Show::Bar(bar) = &self.mode {
            bar.finish_and_clear();
        }
    }

    fn show(&self, p: &Position) {
        let wall = self.begun.elapsed().as_secs_f64().max(1e-9);
        match &self.mode {
            Show::Nothing => {}
            Show::Bar(bar) => {
                if let Some(fraction) = p.fraction {
                    bar.set_length(TICKS);
                    bar.set_position((fraction.clamp(0.0, 1.0) * TICKS as f64) as u64);
                }
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
                    "class": "PROGRESS", "fraction": p.fraction,
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
    let style =
        ProgressStyle::with_template("{prefix} {bar:24.cyan/blue} {percent}%  ETA {eta}  {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    bar.set_style(style);
    bar.set_prefix(name.to_owned());
    bar
}
