//! Account of what `--regularise-stamps` did -> text or JSON. Pure.

use super::significant;
use serde_json::{Value, json};
use strapd_attitude::condition::regularise;
use strapd_attitude::record::Nanos;

/// Segments written out for people.
const SAID: usize = 5;

/// Outcome of the stamps.
#[derive(Clone, Debug, Default)]
pub struct Regularised {
    /// Whether each stamp was filtered by those before it alone (a stream), and not by all (a file).
    pub causal: bool,
    /// Stretches of constant rate.
    pub segments: u64,
    /// The first of them.
    pub kept: Vec<Segment>,
    /// Jitter removed: recorded minus new stamp, rms, ns.
    pub rms_nanos: f64,
    /// 99th percentile of it, ns.
    pub p99_nanos: f64,
    /// The largest, ns.
    pub max_nanos: i64,
    /// rms over the step.
    pub jitter: f64,
    /// Samples that could belong to another instant.
    pub ambiguous: u64,
    /// Whether there was no constant rate after all.
    pub uneven: bool,
}

/// A stretch of constant rate.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// First stamp, seconds after the first of all.
    pub from_secs: f64,
    /// Samples in it.
    pub samples: u64,
    /// `None` where they were too few to tell.
    pub rate_hz: Option<f64>,
}

impl Regularised {
    /// Makes it of what was found; `first` is the first stamp of all.
    #[must_use]
    pub fn of(causal: bool, report: &regularise::Report, first: Nanos) -> Regularised {
        Regularised {
            causal,
            segments: report.segments,
            kept: report
                .kept
                .iter()
                .map(|s| Segment {
                    from_secs: s.start.secs_since(first),
                    samples: s.samples,
                    rate_hz: s.rate_hz,
                })
                .collect(),
            rms_nanos: report.rms_nanos,
            p99_nanos: report.p99_nanos,
            max_nanos: report.max_nanos,
            jitter: report.jitter,
            ambiguous: report.ambiguous,
            uneven: report.is_uneven(),
        }
    }

    /// Text for people.
    #[must_use]
    pub fn text(&self) -> String {
        let how = if self.causal {
            "regularised causally (a file would be fitted as a whole)"
        } else {
            "regularised by straight lines"
        };
        let mut text = format!(
            "{how}: jitter removed rms {}, p99 {}, max {} us ({} % of the step); {} samples of doubtful place",
            significant(self.rms_nanos * 1e-3, 3),
            significant(self.p99_nanos * 1e-3, 3),
            significant(self.max_nanos as f64 * 1e-3, 3),
            significant(self.jitter * 100.0, 2),
            self.ambiguous
        );
        for segment in self.kept.iter().take(SAID) {
            let rate = segment
                .rate_hz
                // Nine digits: to the ppm and what lies below it.
                .map_or("no rate".to_owned(), |hz| {
                    format!("{} Hz", significant(hz, 9))
                });
            text += &format!(
                "\n{rate} from {:.3} s on, {} samples",
                // Not -0.000.
                (segment.from_secs * 1e3).round() * 1e-3 + 0.0,
                segment.samples
            );
        }
        let more = self.segments.saturating_sub(SAID as u64);
        if more > 0 {
            text += &format!("\nand {more} more segments");
        }
        text
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "mode": if self.causal { "causal" } else { "lines" },
            "segments": self.segments,
            "kept_segments": self.kept.iter().map(|s| json!({
                "from_s": s.from_secs, "samples": s.samples, "rate_hz": s.rate_hz,
            })).collect::<Vec<_>>(),
            "jitter_removed_ns": {
                "rms": self.rms_nanos, "p99": self.p99_nanos, "max": self.max_nanos,
            },
            "jitter_over_step": self.jitter,
            "ambiguous_samples": self.ambiguous,
            "uneven": self.uneven,
        })
    }
}
