//! Errors against a reference -> their part of the page. Pure.

use super::charts::{self, Bounded, Time};
use super::markup::{escaped, figure, folded, sentence, table};
use crate::report::against;
use crate::report::series::{ErrorTrace, Errors};
use crate::report::summary::{TopicSummary, significant};
use std::fmt::Write as _;
use strapd_attitude::compare::ErrorStats;

pub(super) fn section(
    summary: &TopicSummary,
    reference: &str,
    errors: Option<&Errors>,
    drawn: Option<(Time, usize)>,
    out: &mut String,
) {
    out.push_str("<h3>Error against a reference</h3>\n");
    let Some(errors) = errors else {
        out.push_str("<p>There is no reference: the log holds no orientation. <code>--reference FILE</code> names a file with one (MCAP, NDJSON, CSV).</p>\n");
        return;
    };
    if errors.traces.is_empty() {
        let _ = writeln!(
            out,
            "<p>No error can be given: {}. <code>--reference FILE</code> names another reference.</p>",
            escaped(&why_none(errors))
        );
        return;
    }
    let against = match reference {
        "" => "the orientation recorded in the log".to_owned(),
        other => other.to_owned(),
    };
    let _ = writeln!(
        out,
        "<p>Against {}, for each meaning a sample can have. Totals after one constant turn of the world that makes the first common instant agree; the error over 1 s needs none. What a reference is worth decides what these numbers are worth.</p>",
        escaped(&against)
    );
    if let Some(recorded) = &summary.recorded
        && recorded.constant
    {
        out.push_str("<p>All recorded orientations are the same: the field is not filled, and this is no reference.</p>\n");
    }
    let rows: Vec<_> = errors.traces.iter().filter_map(row).collect();
    if let Some((time, stretches)) = drawn {
        draw(errors, time, stretches, out);
    }
    let numbers = table(
        "numbers",
        &[
            "a sample is",
            "over 1 s: median / 95 %, deg",
            "total: rms / 95 % / max, deg",
            "heading",
            "tilt",
        ],
        &rows,
    );
    out.push_str(&folded("errors by meaning of a sample", &numbers));
    if let Some(said) = against::resets(errors.resets.len()) {
        let _ = writeln!(
            out,
            "<p id=\"reference-resets\">{}.</p>",
            escaped(&sentence(&said))
        );
    }
    say_left_out(errors, out);
    say_within_sigma(errors, out);
}

/// Says whether the errors lie within the estimate's own sigma, where it has one.
fn say_within_sigma(errors: &Errors, out: &mut String) {
    let Some((found, _)) = &errors.bounds else {
        return;
    };
    let judged = against::beyond_sigma(found)
        .map_or_else(|| "Sigma holds".to_owned(), |beyond| sentence(&beyond));
    let _ = writeln!(
        out,
        "<p id=\"within-sigma\">{}. {}; {}.</p>",
        escaped(&judged),
        escaped(&sentence(&against::within_sigma(found))),
        against::alignment(found.align)
    );
}

/// Reason for which no error can be given.
fn why_none(errors: &Errors) -> String {
    match (errors.usable, errors.unusable) {
        (0, 0) => "the messages carry no orientation, or mark it as absent".to_owned(),
        (0, bad) => format!("none of the {bad} recorded orientations is a rotation"),
        (n, _) => format!(
            "none of the {n} reference attitudes lies within the time of the estimate; are both on the same clock (--time)?"
        ),
    }
}

/// Row of the table of errors, for one meaning that a sample can have.
fn row(trace: &ErrorTrace) -> Option<Vec<String>> {
    let found = trace.comparison.errors.as_ref()?;
    let deg = |v: f64| significant(v.to_degrees(), 3);
    let three = |s: &ErrorStats| format!("{} / {} / {}", deg(s.rms), deg(s.p95), deg(s.max));
    let over = trace
        .comparison
        .relative_1s
        .map_or("no two 1 s apart".to_owned(), |r| {
            format!("{} / {}", deg(r.median), deg(r.p95))
        });
    let used = match trace.is_used {
        true => " (as taken here)",
        false => "",
    };
    Some(vec![
        format!("{}{used}: {}", trace.kind, trace.meaning),
        over,
        three(&found.total),
        three(&found.heading),
        three(&found.inclination),
    ])
}

/// Says how many attitudes of the reference were not compared, and why.
fn say_left_out(errors: &Errors, out: &mut String) {
    let left = errors.traces.first().map(|t| t.comparison.left_out);
    let counted = left.map_or_else(Vec::new, |l| {
        vec![
            (errors.unusable, "are no rotation"),
            (l.outside as u64, "lie outside the estimate's time"),
            (l.in_gap as u64, "lie in its gaps"),
        ]
    });
    for (count, what) in counted.iter().filter(|(count, _)| *count > 0) {
        let _ = writeln!(
            out,
            "<p class=\"small\">{count} of the reference's attitudes {what}.</p>"
        );
    }
    if errors.stride > 1 {
        let _ = writeln!(
            out,
            "<p class=\"small\">Every {}th attitude of this long log was compared.</p>",
            errors.stride
        );
    }
}

/// Pictures of the errors and their bounds.
fn draw(errors: &Errors, time: Time, stretches: usize, out: &mut String) {
    if let Some((_, trace)) = &errors.bounds {
        let trace = trace.reduced(stretches);
        for (id, part) in [
            ("tilt-bounds", Bounded::Tilt),
            ("heading-bounds", Bounded::Heading),
        ] {
            out.push_str(&figure(id, charts::bounds(&trace, time, part)));
        }
    }
    let traces: Vec<_> = errors
        .traces
        .iter()
        .map(|t| (t, t.trace.reduced(stretches)))
        .collect();
    let (totals, left_out) = charts::totals(&traces, time, &errors.resets);
    out.push_str(&figure("error", totals));
    if !left_out.is_empty() {
        let _ = writeln!(
            out,
            "<p class=\"small\">Not drawn, because its size would flatten the others: {}.</p>",
            left_out.join(", ")
        );
    }
    if let Some((_, trace)) = traces.iter().find(|(t, _)| t.is_used) {
        out.push_str(&figure("error-parts", charts::parts(trace, time)));
    }
}
