//! Draws the pictures of `docs/top.md` into `docs/pictures`: `cargo run --release --example top_pictures`.
//!
//! What the source document shows on screen: the path of the axis for the four classic motions, by the
//! service's integrator on gyro samples and by the differential equation of the Euler angles; the
//! error over time for each method; the error over the sample rate.

// Says what it wrote.
#![allow(clippy::print_stdout)]

use std::path::Path;
use strapd::report::plot::{Axis, Chart, Series, SeriesStyle};
use strapd_attitude::frames::{Body, In, Nav};
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::Nanos;
use strapd_bodies::rigid_body::{HeldRate, Spin};
use strapd_bodies::top::method_errors;
use strapd_bodies::top::{Case, EulerState, SymmetricTop, TopMethod, TopRun};

type Failure = Box<dyn std::error::Error>;
type Attitude = Quaternion<Nav, Body>;

const RATE_HZ: f64 = 2000.0;
const SECS: f64 = 1.2;

fn main() -> Result<(), Failure> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures");
    std::fs::create_dir_all(&folder)?;
    let mut pictures = Vec::new();
    for case in [Case::Cusped, Case::Wavy, Case::Looping, Case::SteadySlow] {
        pictures.push((format!("top-{}", case.name()), path_of_the_axis(case)?));
    }
    pictures.push(("top-error-time".to_owned(), error_over_time()?));
    pictures.push(("top-error-rate".to_owned(), error_over_rate()?));
    for (name, chart) in pictures {
        let svg = chart.svg()?;
        let bytes = svg.len();
        std::fs::write(folder.join(format!("{name}.svg")), svg)?;
        println!("{name}.svg  {bytes} bytes");
    }
    Ok(())
}

/// Exact motion at every sample.
fn truth(case: Case, rate_hz: f64) -> Result<(SymmetricTop, EulerState, Vec<Spin>), Failure> {
    let top = SymmetricTop::published();
    let start = case.start(&top, Case::SEED_TILT, Case::SEED_W3)?;
    let mut exact = top.exact(&start)?;
    let steps = (SECS * rate_hz).round() as u64;
    let spins = (0..=steps)
        .map(|k| exact.at_nanos(nanos(k, rate_hz)))
        .collect();
    Ok((top, start, spins))
}

fn nanos(k: u64, rate_hz: f64) -> u64 {
    (k as f64 * 1e9 / rate_hz).round() as u64
}

/// The propagator on exact samples.
fn propagated(method: Method, truth: &[Spin], rate_hz: f64) -> Result<Vec<Attitude>, Failure> {
    let stamped: Vec<_> = truth
        .iter()
        .zip(0..)
        .map(|(spin, k)| (Nanos(nanos(k, rate_hz) as i64), *spin))
        .collect();
    Ok(method_errors::attitudes(method, &stamped)?)
}

/// One of the model's own methods.
fn stepped(
    method: TopMethod,
    top: &SymmetricTop,
    start: &EulerState,
    steps: usize,
    rate_hz: f64,
) -> Result<Vec<Attitude>, Failure> {
    let mut run = TopRun::new(method, top, start, rate_hz)?;
    let mut attitudes = vec![start.spin().q_nb];
    for _ in 0..steps {
        attitudes.push(run.advance()?);
    }
    Ok(attitudes)
}

/// The sphere seen from 65 degrees above its equator.
fn seen(point: &nalgebra::Vector3<f64>) -> [f64; 2] {
    let (s, c) = 65_f64.to_radians().sin_cos();
    [point.x, s * point.y + c * point.z]
}

/// Directions of the axis of symmetry, at every `thin`-th sample.
fn locus(attitudes: &[Attitude], thin: usize) -> Vec<[f64; 2]> {
    attitudes
        .iter()
        .step_by(thin)
        .map(|q| seen((*q * In::<Body>::assume(nalgebra::Vector3::z())).as_vector()))
        .collect()
}

/// A circle of points at `angle` from the vertical.
fn parallel(angle: f64) -> Vec<[f64; 2]> {
    let (s, c) = angle.sin_cos();
    (0..=72)
        .map(|k| {
            let (y, x) = (f64::from(k) * 5_f64.to_radians()).sin_cos();
            seen(&nalgebra::Vector3::new(s * x, s * y, c))
        })
        .collect()
}

fn path_of_the_axis(case: Case) -> Result<Chart, Failure> {
    let (top, start, truth) = truth(case, RATE_HZ)?;
    let ours = propagated(Method::Auto, &truth, RATE_HZ)?;
    let angles = stepped(
        TopMethod::EulerAngles,
        &top,
        &start,
        truth.len() - 1,
        RATE_HZ,
    )?;
    let outline = (0..=72)
        .map(|k| {
            let (y, x) = (f64::from(k) * 5_f64.to_radians()).sin_cos();
            [x, y]
        })
        .collect();
    let line = |name: &str, points, look, color| Series {
        name: name.to_owned(),
        points,
        look,
        color: Some(color),
    };
    Ok(Chart {
        title: format!("{}: path of the axis, 1.2 s", case.name()),
        x: Axis {
            range: Some((-1.05, 1.05)),
            ..Axis::linear("east")
        },
        y: Axis {
            range: Some((-1.05, 1.05)),
            ..Axis::linear("north, tilted by the view")
        },
        series: vec![
            line("", outline, SeriesStyle::Line, 5),
            line(
                "start's angle from the vertical",
                parallel(Case::SEED_TILT),
                SeriesStyle::Dashed,
                6,
            ),
            line(
                "gyro samples, integrated (auto)",
                locus(&ours, 6),
                SeriesStyle::Line,
                1,
            ),
            line(
                "Euler-angle equations",
                locus(&angles, 6),
                SeriesStyle::Dashed,
                0,
            ),
        ],
        equal: true,
        size: (860, 640),
        ..Chart::default()
    })
}

/// Contender that is compared over time and rate: name, and the attitudes at every sample.
type Compared = (&'static str, How);

#[derive(Clone, Copy)]
enum How {
    Top(TopMethod),
    Samples(Method),
}

const fn causal(window: usize) -> How {
    How::Samples(Method::Magnus {
        window,
        order: Order::M6,
        placement: Placement::Causal,
    })
}

fn attitudes(
    how: How,
    top: &SymmetricTop,
    start: &EulerState,
    truth: &[Spin],
    rate_hz: f64,
) -> Result<Vec<Attitude>, Failure> {
    match how {
        How::Top(method) => stepped(method, top, start, truth.len() - 1, rate_hz),
        How::Samples(method) => propagated(method, truth, rate_hz),
    }
}

fn error_over_time() -> Result<Chart, Failure> {
    let (top, start, truth) = truth(Case::Cusped, RATE_HZ)?;
    let compared: [Compared; 7] = [
        (
            "live, w(t_i+1): the document's",
            How::Top(TopMethod::Live(HeldRate::Right)),
        ),
        ("gyro, w(t_i+1)", How::Top(TopMethod::Gyro(HeldRate::Right))),
        ("gyro, mean", How::Top(TopMethod::Gyro(HeldRate::Mean))),
        ("causal, 4 samples", causal(4)),
        ("causal, 6 samples", causal(6)),
        ("Euler-angle equations", How::Top(TopMethod::EulerAngles)),
        ("auto", How::Samples(Method::Auto)),
    ];
    let mut series = Vec::new();
    for (name, how) in compared {
        let found = attitudes(how, &top, &start, &truth, RATE_HZ)?;
        let points = found
            .iter()
            .zip(&truth)
            .enumerate()
            .skip(1)
            .step_by(16)
            .map(|(k, (q, spin))| [k as f64 / RATE_HZ, q.angle_to(&spin.q_nb).to_degrees()])
            .collect();
        series.push(Series {
            name: name.to_owned(),
            points,
            ..Series::default()
        });
    }
    Ok(Chart {
        title: "cusped top, 2000 Hz: error of the attitude".to_owned(),
        x: Axis {
            range: Some((0.0, 1.2)),
            ..Axis::linear("time, s")
        },
        y: Axis {
            range: Some((1e-14, 1e3)),
            ..Axis::log("error, deg")
        },
        series,
        ..Chart::default()
    })
}

fn error_over_rate() -> Result<Chart, Failure> {
    let compared: [Compared; 7] = [
        (
            "live, w(t_i+1): the document's",
            How::Top(TopMethod::Live(HeldRate::Right)),
        ),
        ("gyro, w(t_i+1)", How::Top(TopMethod::Gyro(HeldRate::Right))),
        ("gyro, mean", How::Top(TopMethod::Gyro(HeldRate::Mean))),
        ("causal, 3 samples", causal(3)),
        ("causal, 4 samples", causal(4)),
        ("causal, 6 samples", causal(6)),
        ("auto", How::Samples(Method::Auto)),
    ];
    let mut series: Vec<Series> = compared
        .iter()
        .map(|(name, _)| Series {
            name: (*name).to_owned(),
            look: SeriesStyle::Marked,
            ..Series::default()
        })
        .collect();
    for rate_hz in [200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0, 12800.0] {
        let (top, start, truth) = truth(Case::Cusped, rate_hz)?;
        for (series, (_, how)) in series.iter_mut().zip(&compared) {
            let worst = attitudes(*how, &top, &start, &truth, rate_hz)?
                .iter()
                .zip(&truth)
                .map(|(q, spin)| q.angle_to(&spin.q_nb))
                .fold(0.0, f64::max);
            series.points.push([rate_hz, worst.to_degrees()]);
        }
    }
    Ok(Chart {
        title: "cusped top, 20 turns a second: largest error over 1.2 s".to_owned(),
        x: Axis {
            range: Some((150.0, 15000.0)),
            ..Axis::log("sample rate, Hz")
        },
        y: Axis {
            range: Some((1e-14, 1e3)),
            ..Axis::log("error, deg")
        },
        series,
        ..Chart::default()
    })
}
