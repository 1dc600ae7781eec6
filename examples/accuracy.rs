//! The tables and pictures of `docs/accuracy.md`: our methods and the formulas of other projects, on motions whose
//! truth no integrator made.
//!
//! ```text
//! cargo run --release --example accuracy [-- [--quick] [--coning-csv FILE] [PICTURES]]
//! ```
//!
//! Prints the tables as Markdown and writes the pictures to `docs/pictures`, or to PICTURES. `--quick` computes a
//! little of everything, to see that it runs. `--coning-csv` writes a coning as others' programs can read it, with
//! what one exponential a sample makes of it (`benches/peers/attitude.py`).

#![allow(clippy::print_stdout, unreachable_pub)]

#[path = "accuracy/contenders.rs"]
mod contenders;
#[path = "accuracy/peers.rs"]
mod peers;
#[path = "accuracy/pictures.rs"]
mod pictures;
#[path = "accuracy/runs.rs"]
mod runs;

use contenders::{Contender, OF_INCREMENTS, OF_RATES};
use pictures::Amount;
use runs::{Failure, MARGIN, Run, arcsec};
use std::fmt::Write;
use std::path::PathBuf;
use strapd_attitude::record::SampleKind;

fn main() -> Result<(), Failure> {
    let mut amount = Amount::Whole;
    let mut folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/pictures");
    let mut arguments = std::env::args_os().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.to_str() {
            Some("--quick") => amount = Amount::Quick,
            Some("--coning-csv") => {
                let file = arguments.next().ok_or("--coning-csv takes a file")?;
                std::fs::write(file, coning_csv()?)?;
                return Ok(());
            }
            _ => folder = PathBuf::from(argument),
        }
    }
    top_table(SampleKind::Rate, &OF_RATES, amount)?;
    top_table(SampleKind::DeltaAngle, &OF_INCREMENTS, amount)?;
    coning_table(SampleKind::Rate, &OF_RATES, amount)?;
    coning_table(SampleKind::DeltaAngle, &OF_INCREMENTS, amount)?;
    random_table(&OF_RATES, amount)?;

    std::fs::create_dir_all(&folder)?;
    let (rate, delta) = (SampleKind::Rate, SampleKind::DeltaAngle);
    for (name, svg) in [
        pictures::coning(10.0, rate, amount)?,
        pictures::coning(1.0, rate, amount)?,
        pictures::coning(10.0, delta, amount)?,
        pictures::top(rate, amount)?,
        pictures::top(delta, amount)?,
        pictures::jitter(0.0, amount)?,
        pictures::jitter(0.01, amount)?,
    ] {
        println!("{:>8} bytes  {name}", svg.len());
        std::fs::write(folder.join(name), svg)?;
    }
    Ok(())
}

/// Degrees beyond which the angle between two attitudes no longer grows with the error.
const WRAPPED: f64 = 110.0;

fn heading(title: &str, columns: &[String]) {
    println!("## {title}\n\n| | {} |", columns.join(" | "));
    println!("|{}", "---|".repeat(columns.len() + 1));
}

/// Error of one contender on one motion; `None` where it means nothing.
fn row(
    who: &Contender,
    mut errors: impl Iterator<Item = Result<Option<f64>, Failure>>,
) -> Result<(), Failure> {
    let text = errors.try_fold(format!("| {} |", who.name), |mut text, error| {
        match error? {
            Some(error) => write!(text, " {error:.1e} |")?,
            None => text.push_str(" - |"),
        }
        Ok::<_, Failure>(text)
    })?;
    println!("{text}");
    Ok(())
}

fn top_table(kind: SampleKind, contenders: &[Contender], amount: Amount) -> Result<(), Failure> {
    let rates: &[u64] = match amount {
        Amount::Whole => &[500, 1000, 2000, 4000],
        Amount::Quick => &[500],
    };
    let mut runs = Vec::new();
    for hz in rates {
        runs.push(Run::top(*hz)?);
    }
    let title = format!(
        "Spinning top, 1.2 s, {}: greatest error, degrees; in brackets away from the ends",
        kind.name()
    );
    let columns: Vec<String> = rates.iter().map(|hz| format!("{hz} Hz")).collect();
    heading(&title, &columns);
    for who in contenders {
        let mut text = format!("| {} |", who.name);
        for run in &runs {
            let whole = run.error(who, kind, 0)?.to_degrees();
            let inside = run.error(who, kind, MARGIN)?.to_degrees();
            if whole < WRAPPED {
                write!(text, " {whole:.1e} ({inside:.1e}) |")?;
            } else {
                text.push_str(" - |");
            }
        }
        println!("{text}");
    }
    println!();
    Ok(())
}

fn coning_table(kind: SampleKind, contenders: &[Contender], amount: Amount) -> Result<(), Failure> {
    // Half angle in degrees, cone frequency over sampling frequency.
    let cones: &[(f64, f64)] = match amount {
        Amount::Whole => &[
            (10.0, 0.001),
            (10.0, 0.01),
            (10.0, 0.03),
            (10.0, 0.1),
            (1.0, 0.01),
            (1.0, 0.1),
            (1.0, 0.2),
        ],
        Amount::Quick => &[(10.0, 0.01)],
    };
    let seconds = if amount == Amount::Whole { 60 } else { 2 };
    let mut runs = Vec::new();
    for (degrees, ratio) in cones {
        runs.push(Run::coning(*degrees, 100.0 * ratio, seconds)?);
    }
    let columns: Vec<String> = cones
        .iter()
        .map(|(degrees, ratio)| format!("{degrees}°, {ratio}"))
        .collect();
    let title = format!(
        "Coning, {seconds} s at 100 Hz, {}: greatest error away from the ends, arcsec",
        kind.name()
    );
    heading(&title, &columns);
    for who in contenders {
        row(
            who,
            runs.iter().map(|run| {
                let error = arcsec(run.error(who, kind, MARGIN)?);
                Ok((error < WRAPPED * 3600.0).then_some(error))
            }),
        )?;
    }
    println!();
    Ok(())
}

fn random_table(contenders: &[Contender], amount: Amount) -> Result<(), Failure> {
    let (seeds, seconds): (&[u64], _) = match amount {
        Amount::Whole => (&[1, 2, 3], 60),
        Amount::Quick => (&[1], 2),
    };
    let (mut equal, mut jittered, mut lossy) = (Vec::new(), Vec::new(), Vec::new());
    for seed in seeds {
        equal.push(Run::random(*seed, 0.0, seconds)?);
        let run = Run::random(*seed, 0.2, seconds)?;
        lossy.push(run.with_losses(*seed, 0.01));
        jittered.push(run);
    }
    let title = format!(
        "Random motion to 10 Hz, {seconds} s at 200 Hz, rates: greatest error, arcsec, median of {} draws",
        seeds.len()
    );
    let columns = ["equal spacings", "20 % jitter", "and 1 % lost"].map(str::to_owned);
    heading(&title, &columns);
    for who in contenders {
        row(
            who,
            [&equal, &jittered, &lossy].into_iter().map(|runs| {
                let mut errors = Vec::new();
                for run in runs {
                    errors.push(arcsec(run.error(who, SampleKind::Rate, MARGIN)?));
                }
                errors.sort_by(f64::total_cmp);
                Ok(errors.get(errors.len() / 2).copied())
            }),
        )?;
    }
    println!();
    Ok(())
}

/// Ten degrees at 3 Hz, 100 Hz, 10 s: rates, and the attitudes of one exponential a sample.
fn coning_csv() -> Result<String, Failure> {
    let run = Run::coning(10.0, 3.0, 10)?;
    let first = run.truth.first().ok_or("no samples")?;
    let ours = peers::one_exponential(*first, &run.rates);
    let mut text = "stamp_ns,wx,wy,wz,qw,qx,qy,qz,true_qw,true_qx,true_qy,true_qz\n".to_owned();
    for ((rate, q), truth) in run.rates.iter().zip(&ours).zip(&run.truth) {
        let numbers = rate
            .gyro
            .as_vector()
            .iter()
            .chain(&q.wxyz())
            .chain(&truth.wxyz())
            .map(f64::to_string)
            .collect::<Vec<_>>();
        writeln!(text, "{},{}", rate.stamp.0, numbers.join(","))?;
    }
    Ok(text)
}
