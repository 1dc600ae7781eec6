//! One topic -> its part of the page. Pure.

use super::charts::{self, Time};
use super::markup::{Rows, escaped, figure, folded, table};
use super::{Noise, Page, numbers, reference, timeline};
use crate::report::aid::FilterSummary;
use crate::report::series::Drawn;
use crate::report::smoothing::Smoothing;
use crate::report::summary::{TopicSummary, significant};
use std::fmt::Write as _;
use strapd_replay::inspection::CheckedTopic;

/// Keys of the rows about gaps and bad samples, which have a part of the page to themselves.
const LOST: [&str; 2] = ["gaps", "first_losses"];
/// Key of the row about the reference, of which a part of the page says more.
const AGAINST: &str = "against_recorded";
/// Rests and cuts told one by one.
const TOLD: usize = 12;

pub(super) fn section(
    page: &Page<'_>,
    topic: &CheckedTopic,
    noise: Option<&Noise>,
    (stretches, is_folded): (Option<usize>, bool),
    out: &mut String,
) {
    let _ = writeln!(
        out,
        "<section class=\"topic\"><h2>{}</h2>",
        escaped(&topic.looked.topic)
    );
    if is_folded {
        out.push_str("<details><summary>not taken unless it is named</summary>\n");
    }
    let is_damaged = page.checked.file_losses > 0;
    match &topic.replayed {
        Err(why) => {
            let why = why.line();
            let _ = writeln!(out, "<p>No attitude could be had: {}.</p>", escaped(&why));
        }
        Ok(summary) => integrated(summary, is_damaged, stretches, out),
    }
    let drawn = topic
        .replayed
        .as_ref()
        .ok()
        .and_then(|s| s.drawn.as_deref())
        .filter(|d| d.series.samples > 0);
    if let Ok(summary) = &topic.replayed {
        let errors = summary.drawn.as_deref().and_then(|d| d.errors.as_ref());
        let drawn = drawn.zip(stretches).map(|(d, n)| (Time::of(d), n));
        reference::section(summary, &page.reference, errors, drawn, out);
    }
    out.push_str("<h3>Gaps, bad samples and resets</h3>\n");
    if let Ok(summary) = &topic.replayed {
        out.push_str(&facts(summary, is_damaged, |key| LOST.contains(&key)));
    }
    match drawn {
        Some(drawn) => timeline(topic, drawn, stretches, out),
        None => {
            out.push_str("<p>Without an attitude there is no axis of time to draw them on.</p>\n")
        }
    }
    steps(topic, out);
    rest(topic, out);
    out.push_str("<h3>Allan deviation</h3>\n");
    match noise {
        Some(Noise::Measured { svg, text, .. }) => {
            out.push_str(&figure("allan", Ok(svg.clone())));
            let _ = writeln!(out, "<pre>{}</pre>", lines(text));
        }
        Some(Noise::Missing(why)) => {
            let _ = writeln!(out, "<p>{}</p>", escaped(why));
        }
        None => {}
    }
    if is_folded {
        out.push_str("</details>\n");
    }
    out.push_str("</section>\n");
}

/// Text of several lines, each fit for HTML.
fn lines(text: &str) -> String {
    text.lines().map(escaped).collect::<Vec<_>>().join("\n")
}

/// The rows of a summary under the keys that are wanted, as a table.
fn facts(s: &TopicSummary, is_damaged: bool, is_wanted: impl Fn(&str) -> bool) -> String {
    let mut table = Rows::default();
    for row in s.rows(is_damaged).iter().filter(|row| is_wanted(row.key())) {
        for (label, line) in row.lines() {
            table.add(label, line);
        }
    }
    table.html()
}

fn integrated(s: &TopicSummary, is_damaged: bool, stretches: Option<usize>, out: &mut String) {
    let drawn = s.drawn.as_deref().filter(|d| d.series.samples > 0);
    match (drawn, stretches) {
        (Some(drawn), Some(stretches)) => plots(s, drawn, stretches, out),
        (Some(_), None) => out.push_str("<p>Not drawn, to keep this page small: <code>strapd report --topic NAME</code> draws it.</p>\n"),
        (None, _) => out.push_str("<p>No sample was used, so there is nothing to draw.</p>\n"),
    }
    if stretches.is_some()
        && let Some(chart) = charts::warming(&s.warming)
    {
        out.push_str(&figure("warming", chart));
        out.push_str("<p class=\"small\">What was learned of the bias, once a second, at the temperature of the samples, and the line of least squares through it.</p>\n");
    }
    let facts = facts(s, is_damaged, |key| !LOST.contains(&key) && key != AGAINST);
    out.push_str(&folded("how it was made, and how good it is", &facts));
    if let Some(smoothing) = s.smoothing() {
        smoothed(smoothing, s.drawn.as_deref(), out);
    } else if let Some(learned) = s.aided.as_ref().and_then(FilterSummary::learned) {
        out.push_str("<h3>Calibration learned on the way</h3>\n");
        let head = ["", "x", "y", "z", "+- x", "+- y", "+- z"];
        out.push_str(&folded(
            "bias, scale and misalignment",
            &table("numbers", &head, &learned),
        ));
        out.push_str("<p class=\"small\">One sigma. What the motion does not show stays near nothing, with the sigma it had at first.</p>\n");
    }
}

/// Adds what the whole recording told of the sensor, and what that is worth.
fn smoothed(smoothing: &Smoothing, drawn: Option<&Drawn>, out: &mut String) {
    out.push_str("<h3>Calibration by the whole recording</h3>\n");
    let learned = table("numbers", &Smoothing::HEAD, &smoothing.learned());
    out.push_str(&folded("bias, scale and misalignment", &learned));
    out.push_str("<p class=\"small\">One sigma, after and before. What the motion does not show stays near nothing, with the sigma it had: it is not observed. Axes are small turns: xy is how far x reads y.</p>\n");
    let Some(drawn) = drawn else { return };
    for (id, chart) in charts::sizes(smoothing.sizes(), drawn) {
        out.push_str(&figure(id, chart));
    }
}

fn plots(s: &TopicSummary, drawn: &Drawn, stretches: usize, out: &mut String) {
    let time = Time::of(drawn);
    let traces = drawn.series.reduced(stretches);
    if drawn.series.samples == 1 {
        out.push_str(
            "<p>One sample is an instant: nothing turns, and the charts hold one point.</p>\n",
        );
    }
    let rate = charts::series(
        &traces,
        time,
        "Body rate",
        "deg/s",
        &[(0, "x"), (1, "y"), (2, "z")],
    );
    out.push_str(&figure("rate", rate));
    let title = format!("Attitude, {} to {}", s.body, s.world);
    let named = [(3, "roll"), (4, "pitch"), (5, "yaw")];
    out.push_str(&figure(
        "attitude",
        charts::series(&traces, time, &title, "deg", &named),
    ));
    let sigma = charts::series(
        &traces,
        time,
        "One sigma of the attitude",
        "deg",
        &[(6, "tilt"), (7, "heading")],
    );
    out.push_str(&figure("sigma", sigma));
    if drawn.innovations.samples > 0 {
        let innovations = charts::innovations(&drawn.innovations.reduced(stretches), time);
        for (chart, id) in innovations
            .into_iter()
            .zip(["innovations", "innovations-heading"])
        {
            out.push_str(&figure(id, chart));
        }
        out.push_str("<p class=\"small\">How far what was measured was from what was expected, ten times a second. Accelerations make it large, and sigma with it; long on one side it says that the body moves otherwise than the filter thinks.</p>\n");
    }
    if drawn.series.samples > stretches as u64 * 4 {
        let _ = writeln!(
            out,
            "<p class=\"small\">{} samples; of each stretch of time the first, smallest, largest and last are drawn, so no spike is hidden.</p>",
            drawn.series.samples
        );
    }
    say_jumps(drawn, time, out);
}

/// Says where the clock jumps.
fn say_jumps(drawn: &Drawn, time: Time, out: &mut String) {
    for (at, nanos) in drawn.elapsed.kept.iter().take(TOLD) {
        let _ = writeln!(
            out,
            "<p class=\"small\">The clock jumps by {} s at {} {}; the axis of time is cut there.</p>",
            significant(*nanos as f64 * 1e-9, 6),
            significant(*at as f64 / time.nanos, 5),
            time.unit
        );
    }
    let more = drawn.elapsed.cuts.saturating_sub(TOLD as u64);
    if more > 0 {
        let _ = writeln!(out, "<p class=\"small\">And {more} more such jumps.</p>");
    }
}

fn timeline(topic: &CheckedTopic, drawn: &Drawn, stretches: Option<usize>, out: &mut String) {
    if stretches.is_some()
        && let Some(svg) = timeline::strips(drawn, &topic.looked.rests, Time::of(drawn))
    {
        out.push_str(&figure("timeline", Ok(svg)));
    }
}

fn steps(topic: &CheckedTopic, out: &mut String) {
    out.push_str("<h3>Stamps</h3>\n");
    let q = &topic.looked.quality;
    let Some(s) = q.spacing else {
        out.push_str("<p>Fewer than two stamps advance, so there is no rate and no jitter.</p>\n");
        return;
    };
    let _ = writeln!(
        out,
        "<p>The ordinary step is {} ({} Hz, {} clock). Steps deviate from it by {} (median), {} (99 %), {} at most; those with samples missing do not count.</p>",
        short(s.median_secs),
        significant(s.rate_hz, 5),
        topic.looked.clock.name(),
        short(s.jitter_p50_secs),
        short(s.jitter_p99_secs),
        short(s.jitter_max_secs)
    );
    let total: u64 = q.jitter.iter().map(|(.., n)| n).sum();
    let exact = q
        .jitter
        .iter()
        .find(|(from, ..)| *from == 0.0)
        .map_or(0, |(.., n)| *n);
    if exact > 0 && exact < total {
        let _ = writeln!(
            out,
            "<p>{exact} of {total} steps are the ordinary one to the nanosecond.</p>"
        );
    }
    out.push_str(&figure("jitter", charts::jitter(q)));
    if let Some(offset) = q.offset {
        let _ = writeln!(
            out,
            "<p>Header stamp less log time: mean {} s, from {} to {} s, drifting by {} ppm.</p>",
            significant(offset.mean_secs, 4),
            significant(offset.min_secs, 4),
            significant(offset.max_secs, 4),
            significant(offset.drift_ppm, 3)
        );
    }
}

/// A short time in the unit that suits it.
fn short(secs: f64) -> String {
    let (size, unit) = match secs.abs() {
        size if size == 0.0 || size >= 1.0 => (1.0, "s"),
        size if size >= 1e-3 => (1e3, "ms"),
        size if size >= 1e-6 => (1e6, "us"),
        _ => (1e9, "ns"),
    };
    format!("{} {unit}", significant(secs * size, 4))
}

fn rest(topic: &CheckedTopic, out: &mut String) {
    out.push_str("<h3>Rest and bias</h3>\n");
    let rests = &topic.looked.rests;
    let Some((_, longest)) = numbers::longest_rest(topic) else {
        let still = rests.stillest.map_or_else(String::new, |rate| {
            format!(
                ": in its stillest half second the gyro varies by {} deg/s",
                significant(rate.to_degrees(), 3)
            )
        });
        let _ = writeln!(
            out,
            "<p>The sensor was never at rest{still}, so no bias can be had from this log.</p>"
        );
        return;
    };
    let _ = writeln!(
        out,
        "<p>At rest for {} s in {} stretches, the longest {} s.</p>",
        significant(rests.secs, 4),
        rests.count,
        significant(longest, 4)
    );
    match &topic.looked.bias {
        None => {
            out.push_str("<p>The rests do not agree on a bias, or are too short for one.</p>\n")
        }
        Some(b) => {
            let per_hour = |v: f64| significant(v.to_degrees() * 3600.0, 3);
            let _ = writeln!(
                out,
                "<p>Bias at rest ({:.6}, {:.6}, {:.6}) rad/s, that is ({}, {}, {}) deg/h, &plusmn; {} deg/h, from {} s.</p>",
                b.bias.0.x,
                b.bias.0.y,
                b.bias.0.z,
                per_hour(b.bias.0.x),
                per_hour(b.bias.0.y),
                per_hour(b.bias.0.z),
                per_hour(b.sigma.max()),
                significant(b.secs, 3)
            );
        }
    }
    let first = rests.first.unwrap_or_default();
    let dps = |v: f64| significant(v.to_degrees(), 3);
    let rows: Vec<Vec<String>> = rests
        .kept
        .iter()
        .take(TOLD)
        .map(|r| {
            vec![
                format!("{:.3}", r.start.secs_since(first)),
                format!("{:.3}", r.secs()),
                format!(
                    "{}, {}, {}",
                    dps(r.mean_rate.0.x),
                    dps(r.mean_rate.0.y),
                    dps(r.mean_rate.0.z)
                ),
            ]
        })
        .collect();
    let head = ["begins, s", "lasts, s", "reads about x, y, z, deg/s"];
    out.push_str(&table("numbers", &head, &rows));
    if rests.count > TOLD as u64 {
        let _ = writeln!(
            out,
            "<p class=\"small\">And {} more.</p>",
            rests.count - TOLD as u64
        );
    }
}
