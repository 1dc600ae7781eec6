//! Steps and clocks of the samples as recorded -> findings about their stamps. Pure.

use super::{Finding, Seen, Severity};
use crate::summary::clocks::clock_was_set;
use crate::summary::significant;
use strapd_attitude::condition::quality::QualitySummary;
use strapd_attitude::condition::regularise::Lines;
use strapd_attitude::setting::{
    AGAINST_RECORDED, MAX_GAP, ON_GAP, RATE_HZ, REGULARISE_STAMPS, TIME,
};

/// Header and recorder's clock further apart than this are different clocks, s.
const OTHER_CLOCK_SECS: f64 = 1.0;
/// Clocks that drift by more are wrong, ppm.
const DRIFT_PPM: f64 = 200.0;
/// Share of the step above which single steps jitter (p99).
const JITTER: f64 = 0.1;
/// Part of a step, rms, above which stamp noise is worth a flag: 1750 arcsec a minute of lively motion
/// (`docs/theory/attitude.md` 6.4). What carries its own intervals is nearly immune.
const NOISY_STAMPS: f64 = 0.01;

/// Stamps that are all zero or equal.
pub(super) fn stand_still(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let q = &seen.looked.quality;
    if q.count > 2 && q.spacing.is_none() && !seen.looked.has_no_clock() {
        out.push(
            Finding::new(
                Severity::Error,
                "stamps-stand-still",
                "the stamps do not advance",
            )
            .advise("take another clock")
            .help([TIME.to("log")])
            .help([TIME.to("index"), RATE_HZ.to("HZ")]),
        );
    }
}

/// A clock that was set, one of another speed, batches.
pub(super) fn clocks(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let looked = seen.looked;
    out.extend(looked.clock_set.map(clock_was_set));
    let of_speed = looked.clocks.of_speed.as_ref();
    out.extend(of_speed.map(|said| Finding::said(Severity::Error, "clock-speed", said)));
    let of_batches = looked.clocks.of_batches.as_ref();
    out.extend(of_batches.map(|said| Finding::said(Severity::Warning, "batches", said)));
}

/// Whether steps are those of batches or of a coarse clock, of which neither jitter nor missing samples can be told.
fn are_spread(seen: &Seen<'_>) -> bool {
    let clocks = &seen.looked.clocks;
    clocks.batches.is_some() || clocks.coarse.is_some()
}

/// The 99th percentile of the jitter over the step, where it is worth a word.
fn jitter_of_steps(q: &QualitySummary) -> Option<f64> {
    let spacing = q.spacing?;
    let share = spacing.jitter_p99_secs / spacing.median_secs.max(1e-9);
    (share > JITTER).then_some(share)
}

/// Lines about which stamps jitter enough to be straightened.
fn noisy_lines(q: &QualitySummary) -> Option<&Lines> {
    let says_its_intervals = q.with_interval > 0 && q.with_interval == q.count;
    let lines = q.lines.as_ref()?.as_ref().ok()?;
    (lines.jitter() >= NOISY_STAMPS && !says_its_intervals).then_some(lines)
}

/// Steps that jitter: about straight lines, about none, or as nobody has laid any.
pub(super) fn jitter(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let q = &seen.looked.quality;
    let Some(share) = jitter_of_steps(q).filter(|_| !are_spread(seen)) else {
        return;
    };
    let said = |more: &str| {
        let what = format!(
            "stamps jitter by {:.0} % of the step (p99){more}",
            share * 100.0
        );
        Finding::new(Severity::Warning, "jitter", what).with("p99_share_of_step", share)
    };
    out.push(match (noisy_lines(q), &q.lines) {
        (Some(lines), _) => about_lines(seen, lines),
        (None, Some(Err(_))) => said(" and keep no constant rate")
            .advise("another clock may be steadier; if no sample is missing, number them")
            .help([TIME.to("log")])
            .help([TIME.to("index"), RATE_HZ.to("HZ")]),
        (None, _) => said("")
            .with("p99_s", q.spacing.map_or(0.0, |s| s.jitter_p99_secs))
            .advise("if the sensor samples evenly and only its stamps jitter, straighten them; if it samples unevenly, keep them")
            .help([REGULARISE_STAMPS]),
    });
}

/// Stamps that jitter about straight lines, by less than single steps tell.
pub(super) fn slight_jitter(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let q = &seen.looked.quality;
    if jitter_of_steps(q).is_none() && !are_spread(seen) {
        out.extend(noisy_lines(q).map(|lines| about_lines(seen, lines)));
    }
}

/// Whether the sensor samples evenly, its stamps cannot tell.
fn about_lines(seen: &Seen<'_>, lines: &Lines) -> Finding {
    let advice = "if a clock of its own triggers the sensor, straighten its stamps; if it samples when it is asked, keep them";
    Finding::new(
        Severity::Warning,
        "jitter",
        format!(
            "stamps jitter by {:.1} % of the step (rms) about {}",
            lines.jitter() * 100.0,
            match lines.len() {
                1 => "one constant rate".to_owned(),
                n => format!("{n} stretches of constant rate"),
            }
        ),
    )
    .with("rms_share_of_step", lines.jitter())
    .with("segments_of_constant_rate", lines.len())
    .advise(match seen.looked.has_reference {
        true => format!("{advice}: they cannot tell, {AGAINST_RECORDED} may"),
        false => advice.to_owned(),
    })
    .help([REGULARISE_STAMPS])
}

/// Header and log times that drift apart.
pub(super) fn drift(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let q = &seen.looked.quality;
    let ppm = q.offset.map_or(0.0, |offset| offset.drift_ppm);
    // The wrong speed of a clock is no drift.
    let is_wrong = seen.looked.clocks.of_speed.is_some();
    // Nor is a step, which was taken off.
    let is_wrong = is_wrong || seen.looked.clock_set.is_some();
    if q.duration_secs >= 60.0 && ppm.abs() > DRIFT_PPM && !is_wrong {
        out.push(
            Finding::new(
                Severity::Warning,
                "clock-drift",
                format!("header and log time drift apart by {ppm:.0} ppm"),
            )
            .with("ppm", ppm)
            .advise("one of the clocks is wrong by as much, and so is every angle")
            .help([TIME.to("header|log")]),
        );
    }
}

/// Samples that are missing.
pub(super) fn missing(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let q = &seen.looked.quality;
    if q.missing > 0 && lacks(q) && !are_spread(seen) {
        out.push(missing_samples(q.missing, q.longest_gap_secs, q.gaps));
    }
}

/// Whether the log is short of the samples its long steps seem to lack: where stamps jitter by more
/// than half a step, a long step is made up for by short ones.
fn lacks(q: &QualitySummary) -> bool {
    let Some(spacing) = &q.spacing else {
        return true;
    };
    // Then a step and a half is a gap and nothing else.
    if spacing.jitter_p99_secs < 0.3 * spacing.median_secs {
        return true;
    }
    let by_time = q.duration_secs / spacing.median_secs.max(1e-9) + 1.0;
    let distinct = q.count.saturating_sub(q.duplicates);
    by_time - distinct as f64 > 0.5 * q.missing as f64
}

/// Finding for so many missing samples.
pub(in crate::findings) fn missing_samples(missing: u64, longest_secs: f64, gaps: u64) -> Finding {
    Finding::new(
        Severity::Warning,
        "missing",
        format!("{missing} samples are missing, at most {longest_secs:.3} s at a time"),
    )
    .with("missing", missing)
    .with("longest_s", longest_secs)
    .with("gaps", gaps)
    .advise("bridged by interpolation where short")
    .help([MAX_GAP.to("SECS"), ON_GAP.to("hold|bridge|reset")])
}

/// Clocks of the headers and of the recorder that are far apart.
pub(super) fn other_clock(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    if let Some(offset) = &seen.looked.quality.offset
        && offset.mean_secs.abs() > OTHER_CLOCK_SECS
    {
        out.push(
            Finding::new(
                Severity::Note,
                "other-clock",
                format!(
                    "header stamps are {} s {} the recorder's clock",
                    significant(offset.mean_secs.abs(), 4),
                    if offset.mean_secs < 0.0 {
                        "behind"
                    } else {
                        "ahead of"
                    }
                ),
            )
            .with("mean_s", offset.mean_secs)
            .with("drift_ppm", offset.drift_ppm)
            .advise("different clocks, or a log played again; compare only on one of them")
            .help([TIME.to("header|log")]),
        );
    }
}
