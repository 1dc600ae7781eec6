//! Errors -> the charts of `docs/pictures/`. Pure.

use crate::contenders::{Contender, OF_INCREMENTS, OF_RATES};
use crate::runs::{Failure, MARGIN, Run, arcsec};
use strapd::report::plot::{Axis, Chart, Series, SeriesStyle};
use strapd_attitude::record::SampleKind;

/// Amount that is computed: `Whole` for publication, `Quick` to see that it runs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Amount {
    Whole,
    Quick,
}

/// A file name and its SVG text.
pub type Picture = (String, String);

const OF_RATES_SHOWN: [(&str, &str); 7] = [
    ("exp(w dt)", "exp(w dt): gyroflow, ahrs, VQF"),
    ("linear rate", "linear rate, 1/12: pyins; PX4 the same"),
    ("Runge-Kutta 4 over", "Runge-Kutta 4 over two samples"),
    ("causal 5", "strapd causal 5, order 6"),
    ("**commit 6", "strapd commit 6, live"),
    ("centred 8", "strapd centred 8"),
    ("**auto", "strapd auto: centred 16"),
];

const OF_INCREMENTS_SHOWN: [(&str, &str); 7] = [
    ("exp(d)", "exp(d): gyroflow, ahrs, VQF"),
    ("1/12 before", "1/12 before: pyins"),
    ("`coning3", "optimal of 3"),
    ("`coning4", "optimal of 4"),
    ("**commit 5", "strapd commit 5, live"),
    ("centred 9", "strapd centred 9"),
    ("**auto", "strapd auto: centred 15"),
];

/// Contenders that are drawn, and the words of the legend.
fn shown(kind: SampleKind) -> Result<Vec<(Contender, &'static str)>, Failure> {
    let (all, picked): (&[Contender], _) = match kind {
        SampleKind::Rate => (&OF_RATES, OF_RATES_SHOWN),
        SampleKind::Average | SampleKind::DeltaAngle | SampleKind::Rotation => {
            (&OF_INCREMENTS, OF_INCREMENTS_SHOWN)
        }
    };
    picked
        .into_iter()
        .map(|(start, words)| {
            let found = all.iter().find(|who| who.name.starts_with(start));
            Ok((
                *found.ok_or_else(|| format!("nobody is called {start}"))?,
                words,
            ))
        })
        .collect()
}

/// One line for each contender, one point for each run. The axes leave room above for the legend.
fn lines(
    kind: SampleKind,
    runs: &[(f64, Vec<Run>)],
    margin: usize,
    scale: fn(f64) -> f64,
    most: f64,
) -> Result<Vec<Series>, Failure> {
    shown(kind)?
        .into_iter()
        .enumerate()
        .map(|(i, (who, words))| {
            let mut points = Vec::new();
            let mut followed = true;
            for (x, seeds) in runs {
                let mut errors = Vec::new();
                for run in seeds {
                    errors.push(scale(run.error(&who, kind, margin)?));
                }
                errors.sort_by(f64::total_cmp);
                let median = errors[errors.len() / 2];
                // Beyond this the angle between two attitudes no longer grows with the error: the line ends.
                followed &= median < most;
                points.push([*x, if followed { median } else { f64::NAN }]);
            }
            Ok(Series {
                name: words.to_owned(),
                points,
                look: SeriesStyle::Marked,
                // The same in every picture.
                color: Some(i),
            })
        })
        .collect()
}

fn words(kind: SampleKind) -> &'static str {
    match kind {
        SampleKind::Rate => "instantaneous rates",
        SampleKind::Average | SampleKind::DeltaAngle | SampleKind::Rotation => "delta angles",
    }
}

/// Error over 60 s against cone frequency over sampling frequency.
pub fn coning(degrees: f64, kind: SampleKind, amount: Amount) -> Result<Picture, Failure> {
    let (ratios, seconds): (&[f64], _) = match amount {
        Amount::Whole => (
            &[
                0.001, 0.0015, 0.0022, 0.0033, 0.005, 0.0075, 0.011, 0.017, 0.025, 0.035, 0.05,
                0.07, 0.1, 0.14, 0.2, 0.3,
            ],
            60,
        ),
        Amount::Quick => (&[0.01, 0.1], 2),
    };
    let mut runs = Vec::new();
    for ratio in ratios {
        runs.push((*ratio, vec![Run::coning(degrees, 100.0 * ratio, seconds)?]));
    }
    let wrapped = 110.0 * 3600.0;
    let chart = Chart {
        title: format!(
            "Coning of {degrees} degrees, {}, {seconds} s at 100 Hz",
            words(kind)
        ),
        x: Axis::log("cone frequency / sampling frequency"),
        y: Axis {
            range: Some((1e-11, 1e12)),
            ..Axis::log("greatest error, arcsec")
        },
        series: lines(kind, &runs, MARGIN, arcsec, wrapped)?,
        ..Chart::default()
    };
    let what = if kind == SampleKind::Rate {
        "rates"
    } else {
        "increments"
    };
    Ok((
        format!("accuracy-coning-{degrees}deg-{what}.svg"),
        chart.svg()?,
    ))
}

/// Error of the seed's top against the sampling rate.
pub fn top(kind: SampleKind, amount: Amount) -> Result<Picture, Failure> {
    let rates: &[u64] = match amount {
        Amount::Whole => &[500, 625, 800, 1000, 1250, 1600, 2000, 2500, 3125, 4000],
        Amount::Quick => &[500, 1000],
    };
    let mut runs = Vec::new();
    for hz in rates {
        runs.push((*hz as f64, vec![Run::top(*hz)?]));
    }
    let chart = Chart {
        title: format!("Spinning top, 1.2 s, {}, away from the ends", words(kind)),
        x: Axis::log("sampling rate, Hz"),
        y: Axis {
            range: Some((1e-14, 1e10)),
            ..Axis::log("greatest error, degrees")
        },
        series: lines(kind, &runs, MARGIN, f64::to_degrees, 110.0)?,
        ..Chart::default()
    };
    let what = if kind == SampleKind::Rate {
        "rates"
    } else {
        "increments"
    };
    Ok((format!("accuracy-top-{what}.svg"), chart.svg()?))
}

/// Error on random motion against true sampling jitter, with a part of the samples lost; median of three seeds.
pub fn jitter(lost: f64, amount: Amount) -> Result<Picture, Failure> {
    let (jitters, seeds, seconds): (&[f64], &[u64], _) = match amount {
        Amount::Whole => (
            &[0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3],
            &[1, 2, 3],
            60,
        ),
        Amount::Quick => (&[0.0, 0.3], &[1], 2),
    };
    let mut runs = Vec::new();
    for part in jitters {
        let mut of_seeds = Vec::new();
        for seed in seeds {
            let run = Run::random(*seed, *part, seconds)?;
            of_seeds.push(if lost > 0.0 {
                run.with_losses(*seed, lost)
            } else {
                run
            });
        }
        runs.push((100.0 * part, of_seeds));
    }
    let mut series = lines(SampleKind::Rate, &runs, MARGIN, arcsec, 110.0 * 3600.0)?;
    // Four orders for equal spacings have no meaning here.
    series.retain(|line| !line.name.starts_with("Runge"));
    let percent = 100.0 * lost;
    let chart = Chart {
        title: format!(
            "Random motion to 10 Hz, {seconds} s at 200 Hz, {percent:.0} % of the samples lost"
        ),
        x: Axis::linear("jitter of the sampling instants, % of the interval, either way"),
        y: Axis {
            range: Some((1e-10, 1e12)),
            ..Axis::log("greatest error, arcsec")
        },
        series,
        ..Chart::default()
    };
    Ok((
        format!("accuracy-jitter-{percent:.0}-lost.svg"),
        chart.svg()?,
    ))
}
