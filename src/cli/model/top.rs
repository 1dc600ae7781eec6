//! `strapd model top`: a top and methods -> how far each is from the exact motion. I/O.
//!
//! With flags for people, without any as a filter.

mod tables;

use super::filter::{self, Refusal};
use super::top_flags::TopFlags;
use crate::cli::{Global, Outcome, print};
use crate::error::{Error, Result};
use crate::report::summary::significant;
use clap::Args;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_bodies::top::method_errors::{self as compare, Course, How, MethodErrors};
use strapd_bodies::top::{Case, EulerState, SymmetricTop};

/// The symmetric top: its cases, and how well each method finds its attitude.
#[derive(Args, Debug)]
#[command(
    after_help = "Methods: live-left, live-right, live-mean (the document's simulation), euler-angles (singular upright and
hanging), gyro-left, gyro-right, gyro-mean (one rotation a sample), and those of replay --method on exact
samples: auto, magnus, commit, dcm-mean, rk4, ...

Without flags requests are read from stdin, one JSON object a line:
  {\"case\":\"cusped\",\"rate_hz\":2000,\"duration\":1.2,\"methods\":[\"live-right\",\"auto\"]}
  more fields: spin_hz, tilt_deg, mass, arm, inertia [across, along], gravity
  -> {\"errors_deg\":{\"auto\":{\"axis_max\":..,\"attitude_max\":..},..},\"energy_drift\":..}

Examples:
  strapd model top --case cusped
  strapd model top --case looping --methods live-right,auto --rate-hz 500
  strapd model top --compare                             the tables of docs/top.md, run now
  echo '{\"case\":\"wavy\",\"methods\":[\"auto\"]}' | strapd model top"
)]
pub struct Top {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub top: TopFlags,
    /// Samples a second [default: 2000]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    pub rate_hz: Option<f64>,
    /// Seconds [default: 1.2]
    #[arg(long, value_name = "SECS", allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Methods, separated by commas [default: the seven of the table, and auto]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub methods: Vec<String>,
    /// The tables of docs/top.md, from live runs
    #[arg(long, conflicts_with_all = ["case", "methods", "euler", "rate_hz", "duration"])]
    pub compare: bool,
}

const RATE_HZ: f64 = 2000.0;
const DURATION: f64 = 1.2;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    case: String,
    rate_hz: Option<f64>,
    duration: Option<f64>,
    methods: Option<Vec<String>>,
    spin_hz: Option<f64>,
    tilt_deg: Option<f64>,
    mass: Option<f64>,
    arm: Option<f64>,
    inertia: Option<[f64; 2]>,
    gravity: Option<f64>,
}

/// Runs it.
///
/// # Errors
/// Flags that cannot be; standard input or output fails.
pub(super) fn run(global: &Global, args: &Top) -> Result<Outcome> {
    if args.compare {
        print(&tables::text().map_err(|e| Error::usage(format!("model top: {e}")))?)?;
        return Ok(Outcome::Done);
    }
    if args.is_bare() {
        return filter::run(|request: Request| answer(&request));
    }
    let usage = |e: String| Error::usage(Diagnostic::new(e).at("model top"));
    let top = args.top.body()?;
    let start = args.top.start(&top)?;
    let methods = if args.methods.is_empty() {
        How::defaults()
    } else {
        How::parse_all(&args.methods).map_err(|e| Error::usage(e.at("model top")))?
    };
    let course = Course::new(
        top,
        start,
        args.rate_hz.unwrap_or(RATE_HZ),
        args.duration.unwrap_or(DURATION),
    )
    .map_err(usage)?;
    let found = course.errors(&methods).map_err(usage)?;
    if global.json {
        print(&format!("{}\n", as_json(&found)))?;
    } else {
        print(&as_text(args, &course, &found))?;
    }
    Ok(Outcome::Done)
}

impl Top {
    /// Whether no flag says anything: then requests come on stdin.
    fn is_bare(&self) -> bool {
        self.top.is_bare()
            && self.rate_hz.is_none()
            && self.duration.is_none()
            && self.methods.is_empty()
    }
}

fn answer(request: &Request) -> std::result::Result<Value, Refusal> {
    let case = compare::case(&request.case)?;
    let seed = SymmetricTop::published();
    let top = compare::body(
        request.mass.unwrap_or(seed.mass()),
        request.arm.unwrap_or(seed.arm()),
        request.inertia.unwrap_or([seed.transverse(), seed.axial()]),
        request.gravity.unwrap_or(seed.gravity()),
    )?;
    let tilt = request.tilt_deg.map_or(Case::SEED_TILT, f64::to_radians);
    let w3 = request
        .spin_hz
        .map_or(Case::SEED_W3, |hz| hz * std::f64::consts::TAU);
    let start: EulerState = case.start(&top, tilt, w3).map_err(|e| e.to_string())?;
    let methods = match &request.methods {
        Some(names) => How::parse_all(names).map_err(|e| e.to_string())?,
        None => How::defaults(),
    };
    let course = Course::new(
        top,
        start,
        request.rate_hz.unwrap_or(RATE_HZ),
        request.duration.unwrap_or(DURATION),
    )?;
    Ok(as_json(&course.errors(&methods)?))
}

fn as_json(found: &MethodErrors) -> Value {
    let errors: Map<String, Value> = found
        .errors
        .iter()
        .map(|(how, e)| {
            let value = json!({
                "axis_max": e.axis.to_degrees(),
                "attitude_max": e.attitude.to_degrees(),
            });
            (how.name(), value)
        })
        .collect();
    json!({ "errors_deg": errors, "energy_drift": found.energy_drift })
}

fn as_text(args: &Top, course: &Course, found: &MethodErrors) -> String {
    let mut out = String::from("symmetric top\n");
    for (name, value) in args.top.parameters() {
        let _ = writeln!(out, "  {:<28} {value}", name.replace('_', " "));
    }
    for note in TopFlags::notes(&course.top, &course.start) {
        let _ = writeln!(out, "  note: {note}");
    }
    let threshold = course.top.sleeping_threshold() / std::f64::consts::TAU;
    let _ = writeln!(out, "  {:<28} {threshold:.3} Hz", "sleeps upright above");
    if let Ok((slow, fast)) = course
        .top
        .steady_precession(course.start.angles.nutation, course.start.w3)
    {
        let _ = writeln!(
            out,
            "  {:<28} {slow:.6} and {fast:.6} rad/s",
            "steady precession"
        );
    }
    let [least, most] = found.nutation.map(f64::to_degrees);
    let _ = writeln!(
        out,
        "  {:<28} {least:.3} to {most:.3} deg over {} s",
        "nutation", course.secs
    );
    let _ = writeln!(
        out,
        "  {:<28} its energy to {:.1e}",
        "the exact motion keeps", found.energy_drift
    );
    let _ = writeln!(
        out,
        "\n  largest error, deg, at {} Hz\n  method              axis    attitude",
        course.rate_hz
    );
    for (how, e) in &found.errors {
        let [axis, attitude] = [e.axis, e.attitude].map(|a| significant(a.to_degrees(), 3));
        let _ = writeln!(out, "  {:<12} {axis:>11} {attitude:>11}", how.name());
    }
    out
}
