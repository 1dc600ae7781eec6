//! Curves and fits -> text for people, JSON, and flags to paste. Pure.

use super::Axis;
use super::gather::AngleSeries;
use crate::report::summary::{meaning, significant};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use strapd_attitude::noise::allan::{AllanFit, FittedTerm, MAX_MISFIT, Point};
use strapd_attitude::noise::sensor_error::{ImuError, TERMS, Term};

/// Selector of a term of a fit.
type Of = fn(&AllanFit) -> &FittedTerm;

/// The fitted terms by key.
const FITTED: [(&str, Of); 5] = [
    ("quantization", |f| &f.quantization),
    ("arw", |f| &f.arw),
    ("bias_instability", |f| &f.bias_instability),
    ("rrw", |f| &f.rrw),
    ("rate_ramp", |f| &f.rate_ramp),
];

fn term(key: &str) -> Option<&'static Term> {
    TERMS.iter().find(|t| t.key == key)
}

/// Reasons why the fit is doubtful.
pub(super) fn doubts(axes: &[Axis]) -> Vec<String> {
    let mut all = Vec::new();
    for axis in axes {
        match &axis.fit {
            None => all.push(format!(
                "{}: stuck, or nearly so: there is no noise to fit",
                axis.name
            )),
            Some(fit) if fit.misfit > MAX_MISFIT => all.push(format!(
                "{}: the five terms do not explain the curve (off by {:.0} standard errors at one point): a correlated bias, vibration, temperature or motion; look at --plot",
                axis.name, fit.misfit
            )),
            Some(_) => {}
        }
    }
    all
}

/// Axes' terms together: root mean square over the axes where the term was seen; absent where most
/// axes do not show it. Nothing from a sensor that moved.
fn together(gathered: &AngleSeries, axes: &[Axis]) -> ImuError {
    if gathered.moved() {
        return ImuError::default();
    }
    let fits: Vec<&AllanFit> = axes.iter().filter_map(|a| a.fit.as_ref()).collect();
    let typical = |of: Of| {
        let seen: Vec<f64> = fits.iter().filter_map(|f| of(f).value).collect();
        if 2 * seen.len() <= fits.len() {
            return 0.0;
        }
        (seen.iter().map(|v| v * v).sum::<f64>() / seen.len() as f64).sqrt()
    };
    ImuError {
        quantization: typical(|f| &f.quantization),
        arw: typical(|f| &f.arw),
        bias_instability: typical(|f| &f.bias_instability),
        rrw: typical(|f| &f.rrw),
        rate_ramp: typical(|f| &f.rate_ramp),
        ..ImuError::default()
    }
}

/// Text that `replay --noise` takes, axis by axis, in the units of data sheets. `None` without an
/// angle random walk on every axis, or from a sensor that moved.
fn for_replay(gathered: &AngleSeries, axes: &[Axis]) -> Option<String> {
    let errors: Option<Vec<ImuError>> = axes
        .iter()
        .map(|a| a.fit.as_ref().map(AllanFit::error))
        .collect();
    let errors = errors.filter(|e| !gathered.moved() && e.iter().all(|e| e.arw > 0.0))?;
    let parts: Vec<String> = ["arw", "bias_instability", "rrw"]
        .into_iter()
        .filter_map(term)
        .filter(|t| errors.iter().any(|e| (t.read)(e) > 0.0))
        .map(|t| {
            let values: Vec<String> = errors
                .iter()
                .map(|e| significant((t.read)(e) / t.si, 4))
                .collect();
            format!("{}={}", t.key.replace('_', "-"), values.join("/"))
        })
        .collect();
    Some(parts.join(","))
}

/// The lowest point of a curve.
fn lowest(points: &[Point]) -> Option<&Point> {
    points.iter().min_by(|a, b| a.sigma.total_cmp(&b.sigma))
}

pub(super) fn text(path: &Path, gathered: &AngleSeries, axes: &[Axis]) -> String {
    let mut out = format!(
        "{} {} ({})\n",
        path.display(),
        gathered.topic,
        gathered.described
    );
    let _ = writeln!(
        out,
        "  record   {:.3} s, {} samples every {} ms; {}",
        gathered.secs,
        gathered.record.count() - gathered.filled,
        significant(gathered.interval * 1e3, 6),
        meaning(gathered.resolved.kind),
    );
    let _ = writeln!(
        out,
        "  at rest  {:.1} s of it; longest cluster {} s",
        gathered.resting(),
        axes.iter()
            .filter_map(|a| a.points.last())
            .map(|p| significant(p.tau, 3))
            .next()
            .unwrap_or_default()
    );
    let _ = write!(out, "  {:<32}", "");
    for axis in axes {
        let _ = write!(out, " {:<22}", axis.name);
    }
    out.push('\n');
    for (key, of) in FITTED {
        let Some(term) = term(key) else { continue };
        let _ = write!(out, "  {:<32}", format!("{key}, {}", term.unit));
        for axis in axes {
            let cell = axis
                .fit
                .as_ref()
                .map_or_else(|| "stuck".to_owned(), |f| cell(of(f), term.si));
            let _ = write!(out, " {cell:<22}");
        }
        out.push('\n');
    }
    let _ = write!(out, "  {:<32}", "lowest point, deg/h at s");
    let per_hour = term("bias_instability").map_or(1.0, |t| t.si);
    for axis in axes {
        let cell = lowest(&axis.points).map_or_else(String::new, |p| {
            format!(
                "{} at {}",
                significant(p.sigma / per_hour, 3),
                significant(p.tau, 3)
            )
        });
        let _ = write!(out, " {cell:<22}");
    }
    out.push('\n');
    let error = together(gathered, axes);
    if error != ImuError::default() {
        let _ = writeln!(out, "  to use   simulate --noise {}", error.text());
    }
    if let Some(flag) = for_replay(gathered, axes) {
        let _ = writeln!(out, "           replay --noise {flag}   (axis by axis)");
    }
    // The last column is padded.
    out.lines()
        .fold(String::new(), |all, line| all + line.trim_end() + "\n")
}

/// One coefficient in its data-sheet unit.
fn cell(fitted: &FittedTerm, si: f64) -> String {
    match fitted.value {
        Some(value) => {
            // Two digits of the error decide how many the value has.
            let (value, error) = (value / si, fitted.error / si);
            let digits = ((value / error).log10().floor() as i64 + 2).clamp(2, 8);
            format!(
                "{} +- {}",
                significant(value, digits as usize),
                significant(error, 2)
            )
        }
        None => format!("not seen, < {}", significant(fitted.at_most / si, 2)),
    }
}

pub(super) fn json(gathered: &AngleSeries, axes: &[Axis]) -> Value {
    let error = together(gathered, axes);
    let noise: serde_json::Map<String, Value> = FITTED
        .iter()
        .filter_map(|(key, _)| term(key))
        .map(|t| (t.key.to_owned(), json!((t.read)(&error))))
        .collect();
    let doubts: Vec<String> = gathered
        .warnings()
        .into_iter()
        .chain(doubts(axes))
        .collect();
    json!({
        "topic": gathered.topic,
        "sample_kind": gathered.resolved.kind.name(),
        "samples": gathered.record.count() - gathered.filled,
        "duration_s": gathered.secs,
        "interval_s": gathered.interval,
        "resting_s": gathered.resting(),
        "filled": gathered.filled,
        "splits": gathered.splits,
        "stride": gathered.record.stride(),
        "axes": axes.iter().map(axis_json).collect::<Vec<_>>(),
        "noise_si": noise,
        "simulate_noise": error.text(),
        "replay_noise": for_replay(gathered, axes),
        "warnings": doubts,
    })
}

fn axis_json(axis: &Axis) -> Value {
    let terms: serde_json::Map<String, Value> = axis
        .fit
        .iter()
        .flat_map(|fit| FITTED.map(|(key, of)| (key.to_owned(), *of(fit))))
        .map(|(key, f)| {
            let bound = f.value.is_none().then_some(f.at_most);
            let error = f.value.map(|_| f.error);
            (
                key,
                json!({ "value": f.value, "error": error, "at_most": bound }),
            )
        })
        .collect();
    json!({
        "axis": axis.name,
        "stuck": axis.fit.is_none(),
        "terms_si": terms,
        "misfit": axis.fit.map(|f| f.misfit),
        "lowest": lowest(&axis.points).map(|p| json!({ "tau_s": p.tau, "sigma_rad_s": p.sigma })),
        "points": axis.points.iter().map(|p| json!({
            "tau_s": p.tau, "steps": p.steps, "sigma_rad_s": p.sigma, "relative_error": p.error,
        })).collect::<Vec<_>>(),
    })
}
