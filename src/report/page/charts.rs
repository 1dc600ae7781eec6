//! Series kept of a run -> charts over time. Pure.

use super::looking;
use crate::report::plot::{Axis, Chart, Series, SeriesStyle};
use crate::report::series::{Drawn, ErrorTrace};
use crate::report::trace::Traces;
use crate::report::warming::Warming;
use strapd_attitude::condition::quality::QualitySummary;
use strapd_attitude::smooth::Sizes;

/// Size of a chart over time, pixels.
const SIZE: (u32, u32) = (960, 300);
/// Width of the legend: the same everywhere, so that the axes of time lie under each other.
const BESIDE: u32 = 128;
/// Up to this many points each is marked.
const FEW: usize = 60;
/// Stretches of time in which sizes are drawn.
const SIZES: usize = 240;
/// Resets of a reference that are marked at most.
const RESETS: usize = 100;
/// Errors this many times the smallest would flatten the others.
const FLATTENING: f64 = 6.0;

/// Bounds are drawn up to this many times the largest error, or their own ordinary size.
const ROOM: f64 = 1.5;

/// The axis of time all charts of a topic share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time {
    /// ns of the unit.
    pub(super) nanos: f64,
    pub(super) unit: &'static str,
    /// End, in the unit.
    pub(super) end: f64,
}

impl Time {
    pub(super) fn of(drawn: &Drawn) -> Time {
        let nanos = drawn.elapsed.x() as f64;
        let (unit, length) = match nanos * 1e-9 {
            secs if secs < 600.0 => ("s", 1e9),
            secs if secs < 3.0 * 3600.0 => ("min", 60e9),
            _ => ("h", 3600e9),
        };
        Time {
            nanos: length,
            unit,
            end: nanos / length,
        }
    }

    fn axis(self) -> Axis {
        Axis {
            label: format!("time since the first sample, {}", self.unit),
            // A given range is taken as it is; one sample has none.
            range: (self.end > 0.0).then_some((0.0, self.end)),
            ..Axis::default()
        }
    }
}

fn over_time(time: Time, title: &str, unit: &str, series: Vec<Series>) -> Result<String, String> {
    let numbers = looking::numbers(time, title, unit, &series);
    let svg = Chart {
        title: format!("{title}, {unit}"),
        x: time.axis(),
        y: Axis::linear(unit),
        series,
        size: SIZE,
        beside: BESIDE,
        ..Chart::default()
    }
    .svg()
    .map_err(|e| e.to_string())?;
    Ok(format!("{}\n{numbers}", svg.trim()))
}

fn line(name: &str, color: usize, points: Vec<[f64; 2]>) -> Series {
    Series {
        name: name.to_owned(),
        look: match points.len() {
            0..=FEW => SeriesStyle::Marked,
            _ => SeriesStyle::Thin,
        },
        points,
        color: Some(color),
    }
}

fn bound(name: &str, points: Vec<[f64; 2]>, color: usize) -> Series {
    Series {
        look: SeriesStyle::Dashed,
        ..line(name, color, points)
    }
}

/// Sizes of the force at rest and of the field, as measured and as calibrated, where there are some.
pub(super) fn sizes(sizes: &[Sizes], drawn: &Drawn) -> Vec<(&'static str, Result<String, String>)> {
    let time = Time::of(drawn);
    let chart = |of: &dyn Fn(&Sizes) -> Option<[f64; 2]>, title: &str, unit: &str| {
        let mut traces = Traces::<2>::new(SIZES);
        for found in sizes {
            match of(found) {
                Some(values) => traces.push(drawn.elapsed.at(found.stamp), values),
                None => traces.interrupt(),
            }
        }
        let named = [(1, "calibrated"), (0, "measured")];
        let lines = named.map(|(i, name)| line(name, 2 - i, traces.points(i, time.nanos)));
        (traces.samples > 1).then(|| over_time(time, title, unit, lines.into()))
    };
    let force = chart(&|found| found.force, "Size of the force at rest", "m/s^2");
    let field = chart(&|found| found.field, "Size of the field", "uT");
    let named = [("force-size", force), ("field-size", field)];
    named
        .into_iter()
        .filter_map(|(id, chart)| Some((id, chart?)))
        .collect()
}

/// Some of a run's series in one chart.
pub(super) fn series(
    traces: &Traces<8>,
    time: Time,
    title: &str,
    unit: &str,
    named: &[(usize, &str)],
) -> Result<String, String> {
    let wraps = unit == "deg" && named.len() == 3;
    let lines = named.iter().enumerate().map(|(color, (index, name))| {
        let mut points = traces.points(*index, time.nanos);
        if wraps {
            interrupt_turns(&mut points, traces.samples);
        }
        line(name, color + 1, points)
    });
    over_time(time, title, unit, lines.collect())
}

/// Breaks a line of angles where it passes from 180 to -180 deg: the stroke across the chart is no
/// motion. Not where a stretch holds many samples: there it is the band the angle sweeps.
fn interrupt_turns(points: &mut Vec<[f64; 2]>, samples: u64) {
    if samples > 3 * points.len() as u64 {
        return;
    }
    let whole = std::mem::take(points);
    for point in whole {
        if points
            .last()
            .is_some_and(|last: &[f64; 2]| (last[1] - point[1]).abs() > 180.0)
        {
            points.push([f64::NAN; 2]);
        }
        points.push(point);
    }
}

/// Total errors of every meaning worth drawing, and the names of the others.
pub(super) fn totals(
    traces: &[(&ErrorTrace, Traces<3>)],
    time: Time,
    resets: &[i64],
) -> (Result<String, String>, Vec<&'static str>) {
    let rms = |t: &ErrorTrace| t.comparison.errors.map_or(f64::INFINITY, |e| e.total.rms);
    let least = traces
        .iter()
        .map(|(t, _)| rms(t))
        .fold(f64::INFINITY, f64::min);
    let flattens = |t: &ErrorTrace| rms(t) > FLATTENING * least && !t.is_used && rms(t) > 0.02;
    let mut lines: Vec<Series> = traces
        .iter()
        .enumerate()
        .filter(|(_, (t, _))| !flattens(t))
        .map(|(color, (t, trace))| line(t.kind, color + 1, trace.points(0, time.nanos)))
        .collect();
    lines.extend(reset_marks(&lines, time, resets));
    let left_out = traces
        .iter()
        .filter(|(t, _)| flattens(t))
        .map(|(t, _)| t.kind);
    (
        over_time(time, "Error by meaning of a sample", "deg", lines),
        left_out.collect(),
    )
}

/// Upright dashed lines where the reference was reset, as high as the curves; none where it was not.
fn reset_marks(lines: &[Series], time: Time, resets: &[i64]) -> Option<Series> {
    let values = lines
        .iter()
        .flat_map(|line| line.points.iter().map(|p| p[1]));
    let most = values.filter(|v| v.is_finite()).fold(0.0, f64::max);
    let upright = |at: &i64| {
        let x = *at as f64 / time.nanos;
        [[x, 0.0], [x, most], [f64::NAN; 2]]
    };
    let points: Vec<_> = resets.iter().take(RESETS).flat_map(upright).collect();
    (!points.is_empty()).then(|| bound("reference reset", points, 0))
}

/// Heading and tilt of one meaning.
pub(super) fn parts(trace: &Traces<3>, time: Time) -> Result<String, String> {
    let lines = [(1, "heading"), (2, "tilt")]
        .map(|(index, name)| line(name, index, trace.points(index, time.nanos)));
    over_time(time, "Error as taken here, in parts", "deg", lines.into())
}

/// Errors of the run between three sigma of what it says of them: tilt, or heading, which has a sign.
pub(super) fn bounds(trace: &Traces<4>, time: Time, part: Bounded) -> Result<String, String> {
    let (error, three, title) = match part {
        Bounded::Tilt => (0, 1, "Tilt: error and 3 sigma"),
        Bounded::Heading => (2, 3, "Heading: error and 3 sigma"),
    };
    let errors = trace.points(error, time.nanos);
    let mut above = trace.points(three, time.nanos);
    let largest = errors.iter().map(|p| p[1].abs()).fold(0.0, f64::max);
    leave_out_giants(&mut above, largest);
    let mut lines = vec![line("error", 3, errors)];
    if part == Bounded::Heading {
        let below = above.iter().map(|[x, y]| [*x, -*y]).collect();
        lines.push(bound("", below, 1));
    }
    lines.push(bound("3 sigma", above, 1));
    over_time(time, title, "deg", lines)
}

/// Size that nine of ten points do not exceed.
fn ordinary(points: &[[f64; 2]]) -> f64 {
    let sizes = points.iter().map(|p| p[1].abs());
    let mut sizes: Vec<f64> = sizes.filter(|v| v.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() * 9 / 10).copied().unwrap_or(0.0)
}

/// Leaves out of a bound what was not known at the very beginning, or after a reset, and would flatten all else.
fn leave_out_giants(bound: &mut [[f64; 2]], shown: f64) {
    let most = ROOM * ordinary(bound).max(shown);
    for point in bound.iter_mut().filter(|p| p[1] > most) {
        point[1] = f64::NAN;
    }
}

/// Innovations between three sigma of what was expected: gravity, and heading where a field
/// told it.
pub(super) fn innovations(traces: &Traces<5>, time: Time) -> Vec<Result<String, String>> {
    let of_gravity = (
        "Innovations of gravity, as tilt",
        vec![(0, "x"), (1, "y")],
        2,
    );
    let of_heading = ("Innovations of heading", vec![(3, "heading")], 4);
    let mut charts = Vec::new();
    for (title, named, three) in [of_gravity, of_heading] {
        let of = |index: usize| traces.points(index, time.nanos);
        let mut lines: Vec<Series> = named
            .iter()
            .map(|(index, name)| line(name, (index + 1).min(3), of(*index)))
            .collect();
        if lines.iter().all(|series| series.points.is_empty()) {
            continue;
        }
        // One that begins far off is no reason to show how little was known then.
        let values: Vec<[f64; 2]> = lines.iter().flat_map(|s| s.points.clone()).collect();
        let mut above = of(three);
        leave_out_giants(&mut above, ordinary(&values));
        let below = above.iter().map(|[x, y]| [*x, -*y]).collect();
        lines.extend([bound("3 sigma", above, 4), bound("", below, 4)]);
        charts.push(over_time(time, title, "deg", lines));
    }
    charts
}

/// The bias against the temperature: what was learned, and the line through it; `None` where temperatures differ too
/// little for one.
pub(super) fn warming(warming: &Warming) -> Option<Result<String, String>> {
    let fitted = warming.line()?;
    let pairs = warming.pairs();
    let mut series = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let points = pairs
            .iter()
            .map(|pair| [pair.temperature, pair.bias[axis].to_degrees()]);
        series.push(Series {
            name: name.to_owned(),
            look: SeriesStyle::Dots,
            points: points.collect(),
            color: Some(axis + 1),
        });
        let on_line = |temperature: f64| {
            let bias = fitted.middle[axis] + fitted.slope[axis] * (temperature - fitted.at);
            [temperature, bias.to_degrees()]
        };
        series.push(bound("", fitted.ends.map(on_line).into(), axis + 1));
    }
    let chart = Chart {
        title: "Bias against temperature, deg/s".to_owned(),
        x: Axis::linear("temperature, degC"),
        y: Axis::linear("deg/s"),
        series,
        size: SIZE,
        beside: BESIDE,
        ..Chart::default()
    };
    Some(chart.svg().map_err(|e| e.to_string()))
}

/// Part of an error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Bounded {
    Tilt,
    Heading,
}

/// Deviations of the step from the ordinary one: how many, by octave.
pub(super) fn jitter(quality: &QualitySummary) -> Result<String, String> {
    let mut stairs = Vec::new();
    for (from, to, count) in quality.jitter.iter().filter(|(from, ..)| *from > 0.0) {
        let height = (*count as f64).max(0.5);
        stairs.push([from * 1e-3, height]);
        stairs.push([to * 1e-3, height]);
    }
    if stairs.is_empty() {
        return Err("Every step is the ordinary one: there is no jitter to draw.".to_owned());
    }
    let highest = stairs.iter().map(|p| p[1]).fold(1.0, f64::max);
    Chart {
        title: "How far steps are from the ordinary one".to_owned(),
        x: Axis::log("deviation, us"),
        y: Axis {
            range: Some((0.5, 2.0 * highest)),
            ..Axis::log("steps")
        },
        series: vec![Series {
            points: stairs,
            color: Some(1),
            ..Series::default()
        }],
        size: SIZE,
        ..Chart::default()
    }
    .svg()
    .map_err(|e| e.to_string())
}
