//! Bodies that no model of the estimators has, with exact truth: error of tilt and heading, and whether sigma covers it.
//!
//! ```text
//! cargo run --release -p strapd-bodies --features random --example coverage -- \
//!     [--bodies hand,car] [--noise consumer_imu;industrial_imu] [--by default,smooth] [--seeds 1..3] [--csv FILE.csv]
//! ```
//!
//! Errors are those of earth axes from 5 s on, the heading set right there: rms of tilt and heading, the largest
//! heading, degrees; shares of tilt (about x and about y) and of heading within three sigma; sigma of the heading at the
//! end; rms of the acceleration without gravity along an axis of the body, m/s^2, and the share of it within three
//! sigma. `gyro` is the gyro alone after its rest. A CSV file is one of `smooth_csv` (strapd-attitude).

#![allow(clippy::print_stdout)]

mod log;
mod poses;
mod score;

use log::Log;
use score::{Score, score};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{
    Aid, Bias, EstimationSettings, Estimator, Initial, Meaning, Noise, Patience, Preparation,
    Prepared, at_once,
};
use strapd_attitude::propagate::{Method, Sequential};
use strapd_attitude::record::{Declared, SampleKind};

type Failure = Box<dyn std::error::Error>;

/// Estimators by name; any may have a class behind a colon, `smooth:uncalibrated`.
const ESTIMATORS: [&str; 6] = ["gyro", "default", "live", "field", "smooth", "smooth_field"];

fn plan(name: &str) -> Result<EstimationSettings, Failure> {
    let (name, class) = name.split_once(':').unwrap_or((name, ""));
    let mut plan = EstimationSettings {
        kind: Some(SampleKind::Average),
        aid: Aid::Gravity,
        linear_acceleration: true,
        ..EstimationSettings::default()
    };
    match name {
        "gyro" => {
            plan.aid = Aid::None;
            plan.bias = Bias::Auto;
            plan.initial = Initial::Gravity;
        }
        "default" => {}
        "live" => plan.method = Method::COMMIT,
        "field" => plan.aid = Aid::GravityAndField,
        "smooth" => plan.smooth = true,
        "smooth_field" => {
            plan.smooth = true;
            plan.aid = Aid::GravityAndField;
        }
        _ => return Err(format!("{name}: one of {ESTIMATORS:?}").into()),
    }
    if !class.is_empty() {
        plan.noise = Noise::named(class).ok_or("no such class")?;
    }
    Ok(plan)
}

/// Findings of a file that can be read twice, before its first sample is taken.
fn looked_through(
    plan: &EstimationSettings,
    meaning: &Meaning,
    log: &Log,
) -> Result<Prepared, Diagnostic> {
    let mut preparation = Preparation::new(plan, meaning, Patience::WholeLog);
    for sample in &log.samples {
        preparation.take(sample)?;
        if !preparation.wants_more() {
            break;
        }
    }
    preparation.decide()
}

/// Attitudes of a log by a plan, and their score; what was noticed, in words.
fn run(plan: &EstimationSettings, log: &Log) -> Result<(Score, String), Failure> {
    let meaning = Meaning::new(plan, &Declared::default());
    let is_live = plan.method == Method::COMMIT;
    let prepared = if is_live {
        at_once(plan, &meaning, log.samples.get(..1).unwrap_or_default())
    } else {
        looked_through(plan, &meaning, log)
    };
    let prepared = prepared.map_err(|e| e.to_string())?;
    let estimator = if is_live {
        Estimator::live(plan, &meaning, &prepared)
    } else {
        Estimator::new(plan, &meaning, &prepared)
    };
    let mut estimator = estimator.map_err(|e| e.to_string())?;
    let mut attitudes = Vec::with_capacity(log.samples.len());
    for sample in &log.samples {
        estimator.take(sample);
        if !plan.smooth {
            attitudes.extend_from_slice(estimator.attitudes(&Sequential));
        }
    }
    attitudes.extend(estimator.finish(&Sequential));
    let mut notes = String::new();
    let is_beyond = match estimator.smoothed() {
        Some(Ok(recording)) => recording.is_beyond_class,
        Some(Err(why)) => {
            notes += &format!(" not smoothed: {why}");
            false
        }
        None => estimator.filter().is_some_and(|f| f.is_beyond_class()),
    };
    if is_beyond {
        notes += " beyond-class";
    }
    if prepared
        .warnings
        .iter()
        .any(|w| w.code() == Some("class-by-data"))
    {
        notes += " class-by-data";
    }
    let is_absolute = plan.aid == Aid::GravityAndField;
    Ok((
        score(&attitudes, log, is_absolute).ok_or("nothing to score")?,
        notes,
    ))
}

struct Asked {
    bodies: Vec<String>,
    noises: Vec<String>,
    estimators: Vec<String>,
    seeds: std::ops::RangeInclusive<u64>,
    is_each: bool,
    files: Vec<String>,
}

fn asked() -> Result<Asked, Failure> {
    let list = |text: &str, at: char| text.split(at).map(str::to_owned).collect::<Vec<_>>();
    let mut asked = Asked {
        bodies: log::BODIES.iter().map(|name| (*name).to_owned()).collect(),
        noises: vec!["consumer_imu".to_owned()],
        estimators: list("gyro,default,smooth", ','),
        seeds: 1..=2,
        is_each: false,
        files: Vec::new(),
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or("a value is missing");
        match argument.as_str() {
            "--bodies" => asked.bodies = list(&value()?, ','),
            "--noise" => asked.noises = list(&value()?, ';'),
            "--by" => asked.estimators = list(&value()?, ','),
            "--seeds" => {
                let value = value()?;
                let (first, last) = value.split_once("..").ok_or("FIRST..LAST")?;
                asked.seeds = first.parse()?..=last.parse()?;
            }
            "--each" => asked.is_each = true,
            "--csv" => asked.files.push(value()?),
            _ => asked.files.push(argument),
        }
    }
    Ok(asked)
}

fn main() -> Result<(), Failure> {
    let asked = asked()?;
    println!(
        "body | noise | by | runs | tilt rms | heading rms | total rms | most | tilt in | heading in | sigma | acceleration rms | in | notes"
    );
    let mut cases: Vec<(String, String, Vec<Log>)> = Vec::new();
    for file in &asked.files {
        let name = file.rsplit('/').next().unwrap_or(file).to_owned();
        cases.push((name, "as recorded".to_owned(), vec![log::read(file)?]));
    }
    if asked.files.is_empty() {
        for body in &asked.bodies {
            for noise in &asked.noises {
                let logs = asked
                    .seeds
                    .clone()
                    .map(|seed| log::simulated(body, noise, seed));
                let logs = logs.collect::<Result<_, _>>()?;
                cases.push((body.clone(), noise.clone(), logs));
            }
        }
    }
    let mut totals = vec![Score::default(); asked.estimators.len()];
    for (body, noise, logs) in &cases {
        for (by, total) in asked.estimators.iter().zip(&mut totals) {
            let plan = plan(by)?;
            let (mut sum, mut noted, mut failed) = (Score::default(), Vec::new(), 0);
            for (seed, log) in asked.seeds.clone().zip(logs) {
                match run(&plan, log) {
                    Ok((one, notes)) => {
                        if asked.is_each && logs.len() > 1 {
                            println!("{body} | {noise} | {by} | seed {seed} | {one} | {notes}");
                        }
                        sum.add(&one);
                        total.add(&one);
                        noted.push(notes);
                    }
                    Err(error) => {
                        failed += 1;
                        noted.push(format!(" {error}"));
                    }
                }
            }
            noted.sort_unstable();
            let mut said = String::new();
            for note in noted
                .chunk_by(|a, b| a == b)
                .filter(|c| c.first() != Some(&String::new()))
            {
                said += &format!("{}x{}; ", note.len(), note[0]);
            }
            println!(
                "{body} | {noise} | {by} | {} | {sum} | {said}",
                logs.len() - failed
            );
        }
    }
    for (by, total) in asked.estimators.iter().zip(&totals) {
        println!("all | | {by} | | {total} |");
    }
    Ok(())
}
