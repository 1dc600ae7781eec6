//! Marks and rests -> one strip each on the axis of time. Pure.

use super::charts::Time;
use super::markup::escaped;
use crate::report::series::{Drawn, Mark};
use crate::report::summary::significant;
use std::fmt::Write as _;
use strapd_attitude::condition::stillness::Rests;

/// Pixels: left edge and width, those of the charts above; height of a row.
const LEFT: f64 = 72.0;
const WIDTH: f64 = 736.0;
const ROW: f64 = 24.0;
/// Narrowest mark, pixels: one bad sample in ten million is seen.
const NARROWEST: f64 = 2.0;
/// Labelled places of the axis, about.
const TICKS: f64 = 8.0;

/// Name, class, and from where to where, ns.
type Row = (&'static str, &'static str, Vec<(f64, f64)>);

/// The strips that have something in them; `None` when none has.
pub(super) fn strips(drawn: &Drawn, rests: &Rests, time: Time) -> Option<String> {
    let end = drawn.elapsed.x().max(1) as f64;
    let rows = rows(drawn, rests);
    if rows.is_empty() {
        return None;
    }
    let bottom = ROW * rows.len() as f64 + 6.0;
    let mut svg = format!(
        "<svg viewBox=\"0 0 960 {:.0}\" width=\"960\" height=\"{:.0}\" role=\"img\" aria-label=\"Where samples are missing or bad\" font-size=\"13\">",
        bottom + 40.0,
        bottom + 40.0
    );
    for (index, (name, class, spans)) in rows.iter().enumerate() {
        let y = ROW * index as f64 + 4.0;
        let _ = write!(
            svg,
            "<text x=\"{:.0}\" y=\"{:.0}\">{}</text><line class=\"row\" x1=\"{LEFT}\" x2=\"{:.0}\" y1=\"{4:.0}\" y2=\"{4:.0}\"/>",
            LEFT + WIDTH + 24.0,
            y + 14.0,
            escaped(name),
            LEFT + WIDTH,
            y + ROW - 4.0
        );
        let mut drawn_to = f64::NEG_INFINITY;
        for (from, to) in spans {
            let x = LEFT + WIDTH * (from / end).clamp(0.0, 1.0);
            let width = (WIDTH * ((to - from) / end).clamp(0.0, 1.0)).max(NARROWEST);
            // What lies within what is drawn already shows no more.
            if x + width <= drawn_to + 0.05 {
                continue;
            }
            drawn_to = x + width;
            let _ = write!(
                svg,
                "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.0}\" width=\"{width:.1}\" height=\"{:.0}\"/>",
                ROW - 6.0
            );
        }
    }
    let _ = write!(
        svg,
        "<line class=\"axis\" x1=\"{LEFT}\" x2=\"{:.0}\" y1=\"{1:.0}\" y2=\"{1:.0}\"/>",
        LEFT + WIDTH,
        bottom
    );
    for place in ticks(time.end) {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>",
            LEFT + WIDTH * (place / time.end.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
            bottom + 16.0,
            significant(place, 3)
                .trim_end_matches(".00")
                .trim_end_matches(".0")
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">time since the first sample, {}</text></svg>",
        LEFT + WIDTH / 2.0,
        bottom + 34.0,
        time.unit
    );
    Some(svg)
}

/// Strips that have something in them.
fn rows(drawn: &Drawn, rests: &Rests) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for (mark, marks) in Mark::ALL.iter().zip(&drawn.marks) {
        if marks.samples == 0 {
            continue;
        }
        let class = match mark {
            Mark::Bridged | Mark::Moved => "mild",
            _ => "mark",
        };
        let spans = marks.points(0, 1.0).into_iter();
        let spans = spans.filter(|p| p[0].is_finite());
        let spans = spans.map(|[at, length]| (at, at + length));
        rows.push((mark.words(), class, spans.collect()));
    }
    if !rests.kept.is_empty() {
        let at = |stamp| drawn.elapsed.at(stamp) as f64;
        let spans = rests.kept.iter().map(|r| (at(r.start), at(r.end)));
        rows.push(("at rest", "rest", spans.collect()));
    }
    rows
}

/// Round places from 0 to `end`.
fn ticks(end: f64) -> Vec<f64> {
    if !(end.is_finite() && end > 0.0) {
        return vec![0.0];
    }
    let rough = end / TICKS;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|step| *step >= rough)
        .unwrap_or(rough);
    let last = (end / step) as usize;
    (0..=last.min(20)).map(|k| k as f64 * step).collect()
}
