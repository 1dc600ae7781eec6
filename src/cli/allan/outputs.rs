//! Curves and fits -> a chart, a table. Pure.

use super::Axis;
use crate::report::plot::{self, Chart, Series, SeriesStyle};
use std::fmt::Write as _;

const DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Measured points and fitted curves of the three axes, deg/h over s.
pub(super) fn chart(topic: &str, axes: &[Axis]) -> Chart {
    let mut series = Vec::new();
    for (i, axis) in axes.iter().enumerate() {
        let points = |of: &dyn Fn(&strapd_attitude::noise::allan::Point) -> f64| {
            axis.points
                .iter()
                .map(|p| [p.tau, of(p) / DEG_PER_H])
                .collect()
        };
        series.push(Series {
            name: format!("{}, measured", axis.name),
            points: points(&|p| p.sigma),
            look: SeriesStyle::Dots,
            color: Some(i + 1),
        });
        if let Some(fit) = &axis.fit {
            series.push(Series {
                name: format!("{}, fitted", axis.name),
                points: points(&|p| fit.deviation(p.tau)),
                look: SeriesStyle::Dashed,
                color: Some(i + 1),
            });
        }
    }
    Chart {
        title: format!("Allan deviation of {topic}"),
        x: plot::Axis::log("cluster time, s"),
        y: plot::Axis::log("Allan deviation, deg/h"),
        series,
        ..Chart::default()
    }
}

/// One row per cluster time: measured and fitted, rad/s.
pub(super) fn table(axes: &[Axis]) -> String {
    let mut out = "tau_s,steps,relative_error".to_owned();
    for axis in axes {
        let _ = write!(out, ",sigma_{0},fit_{0}", axis.name);
    }
    out.push('\n');
    let Some(first) = axes.first() else {
        return out;
    };
    for (k, point) in first.points.iter().enumerate() {
        let _ = write!(out, "{},{},{}", point.tau, point.steps, point.error);
        for axis in axes {
            let sigma = axis.points.get(k).map_or(0.0, |p| p.sigma);
            let _ = write!(out, ",{sigma},");
            if let Some(fit) = &axis.fit {
                let _ = write!(out, "{}", fit.deviation(point.tau));
            }
        }
        out.push('\n');
    }
    out
}
