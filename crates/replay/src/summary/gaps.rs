//! Gaps and clock jumps of a run -> numbers, words, JSON. Pure.

use serde_json::{Value, json};
use strapd_attitude::condition::quality::LONGEST_GAP_NANOS;
use strapd_attitude::{condition, propagate};

/// Gaps and jumps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gaps {
    /// Bridged by interpolation.
    pub bridged: u64,
    /// Attitude held over.
    pub held: u64,
    /// Attitude reset at.
    pub resets: u64,
    /// Samples missing in gaps that may be of the motion: not where a clock was set.
    pub missing: u64,
    /// The longest such gap, s.
    pub longest_missing_secs: f64,
    /// Seconds missing in all.
    pub total_secs: f64,
    /// Seconds missing where nothing was integrated: held over, or reset at.
    pub held_secs: f64,
    /// The longest of those, s; 0 where only clocks jumped back.
    pub longest_held_secs: f64,
    /// The longest, s.
    pub longest_secs: f64,
    /// Beginning of the longest, seconds after the first sample.
    pub longest_at_secs: f64,
    /// Clocks that jumped back; each is held or reset at, too.
    pub jumps_back: u64,
    /// The farthest jump back, s.
    pub farthest_back_secs: f64,
    /// Time of it, seconds after the first sample.
    pub farthest_back_at_secs: f64,
}

impl Gaps {
    /// Gaps of a run.
    #[must_use]
    pub fn of(report: &condition::Report, propagation: &propagate::Report) -> Gaps {
        let secs = |nanos: i64| nanos as f64 * 1e-9;
        let gaps = &report.gaps;
        let mut found = Gaps {
            bridged: gaps.count.saturating_sub(gaps.not_bridged),
            held: propagation.holds,
            resets: propagation.resets,
            missing: gaps.missing,
            total_secs: secs(gaps.total_nanos),
            held_secs: secs(gaps.not_bridged_nanos.0),
            longest_held_secs: secs(gaps.not_bridged_nanos.1),
            longest_secs: secs(gaps.longest_nanos),
            jumps_back: gaps.jumps_back,
            ..Gaps::default()
        };
        // Stamps that jumped back are of an earlier time, not of an earlier moment of the run.
        let mut back: i64 = 0;
        let mut longest_at = None;
        for gap in &gaps.kept {
            let after = |first: i64| gap.start.0.saturating_sub(first).saturating_add(back);
            let at = secs(report.first.map_or(0, |first| after(first.0)));
            if gap.length_nanos < 0 {
                back = back.saturating_sub(gap.length_nanos);
                if secs(-gap.length_nanos) > found.farthest_back_secs {
                    found.farthest_back_secs = secs(-gap.length_nanos);
                    found.farthest_back_at_secs = at;
                }
            } else if gap.length_nanos > LONGEST_GAP_NANOS {
                found.missing = found.missing.saturating_sub(gap.missing);
            } else if gap.missing > 0 {
                found.longest_missing_secs = found.longest_missing_secs.max(secs(gap.length_nanos));
            }
            if gap.length_nanos == gaps.longest_nanos && gap.length_nanos > 0 {
                longest_at.get_or_insert(at);
            }
        }
        found.longest_at_secs = longest_at.unwrap_or(0.0);
        found
    }

    /// All of them.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.bridged + self.held + self.resets
    }

    /// Number of gaps over which time went on.
    #[must_use]
    pub fn forward(&self) -> u64 {
        self.count().saturating_sub(self.jumps_back)
    }

    /// Text about a clock that was set back, if one was.
    #[must_use]
    pub fn back_text(&self) -> Option<String> {
        let Gaps {
            farthest_back_secs: by,
            farthest_back_at_secs: at,
            ..
        } = self;
        let which = |by: &str| {
            format!(
                "by {by}{:.3} s, {at:.3} s after the start",
                self.farthest_back_secs
            )
        };
        match self.jumps_back {
            0 => None,
            // Of one that is not among those kept the size is not known.
            _ if *by == 0.0 => Some(format!("the clock was set back {} times", self.jumps_back)),
            1 => Some(format!("the clock was set back once, {}", which(""))),
            n => Some(format!(
                "the clock was set back {n} times, {}",
                which("up to ")
            )),
        }
    }

    /// Text of what an integration error does not include.
    pub(super) fn not_in_the_error(&self) -> String {
        let parts: Vec<String> = [
            (self.bridged, self.total_secs - self.held_secs, "bridged"),
            (self.held + self.resets, self.held_secs, "held or reset"),
        ]
        .into_iter()
        .filter(|(count, ..)| *count > 0)
        .map(|(count, secs, what)| {
            format!("{count} gaps of {:.3} s that were {what}", secs.max(0.0))
        })
        .collect();
        if parts.is_empty() {
            return String::new();
        }
        format!(
            "; not in it: {}, where nothing was measured",
            parts.join(", ")
        )
    }

    pub(super) fn text(&self) -> String {
        if self.count() == 0 {
            return "none".to_owned();
        }
        let mut text = format!(
            "{}: {} bridged, {} held, {} reset",
            self.count(),
            self.bridged,
            self.held,
            self.resets,
        );
        if self.forward() > 0 {
            text += &format!(
                "; {:.3} s in all, longest {:.3} s at {:.3} s",
                self.total_secs, self.longest_secs, self.longest_at_secs
            );
        }
        if let Some(back) = self.back_text() {
            text += &format!("; {back}");
        }
        text
    }
    /// JSON for machines.
    pub(super) fn json(&self) -> Value {
        json!({
            "bridged": self.bridged,
            "held": self.held,
            "resets": self.resets,
            "total_s": self.total_secs,
            "not_integrated_s": self.held_secs,
            "longest_s": self.longest_secs,
            "longest_at_s": self.longest_at_secs,
            "jumps_back": self.jumps_back,
            "farthest_back_s": self.farthest_back_secs,
            "farthest_back_at_s": self.farthest_back_at_secs,
        })
    }
}
