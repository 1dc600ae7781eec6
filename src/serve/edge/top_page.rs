//! `GET /model/top`: a top and methods -> their paths and errors, for the interactive top. Pure but
//! for the handler.
//!
//! The numbers are those of `strapd model top`. Every one that is asked for is bounded, and so is how
//! many requests are worked on at once: whoever asks too much hears why.

use super::http::answer::{refusal, response, unauthorised};
use super::http::connection::Connection;
use axum::body::Body as Answer;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Extension, Query};
use axum::http::{Response, StatusCode};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;
use std::sync::LazyLock;
use std::time::Duration;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;
use strapd_bodies::top::method_errors::{self as compare, Course, How, MethodPath, Paths};
use strapd_bodies::top::{Case, EulerAngles, EulerState, SymmetricTop};
use tokio::sync::Semaphore;

/// Most samples of one request: with [`MOST_METHODS`] about a fifth of a second's work.
const MOST_SAMPLES: f64 = 20_000.0;
const MOST_METHODS: usize = 4;
/// Points that are answered at most.
const MOST_POINTS: usize = 2000;
const POINTS: usize = 1000;
/// Requests worked on at once, over all listeners.
static AT_ONCE: LazyLock<Semaphore> = LazyLock::new(|| Semaphore::new(2));
/// Time for which one waits for its turn.
const PATIENCE: Duration = Duration::from_secs(5);

/// Query that may be asked; what is left out is the source document's top.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::serve) struct Request {
    /// A case by name, or `free`: a start by its tilt and rates.
    case: Option<String>,
    methods: Option<String>,
    rate_hz: Option<f64>,
    duration: Option<f64>,
    spin_hz: Option<f64>,
    tilt_deg: Option<f64>,
    /// Precession of `free` alone, degrees a second.
    precession_dps: Option<f64>,
    nutation_dps: Option<f64>,
    mass: Option<f64>,
    arm: Option<f64>,
    across: Option<f64>,
    along: Option<f64>,
    gravity: Option<f64>,
    points: Option<usize>,
}

/// A value within its bounds.
fn within(name: &str, value: Option<f64>, or: f64, low: f64, high: f64) -> Result<f64, String> {
    let value = value.unwrap_or(or);
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{name} {value}: from {low} to {high} is allowed"))
    }
}

impl Request {
    /// The top, its start, and how it is looked at.
    fn course(&self) -> Result<(Course, Vec<How>), String> {
        let seed = SymmetricTop::published();
        let top = compare::body(
            within("mass", self.mass, seed.mass(), 0.01, 100.0)?,
            within("arm", self.arm, seed.arm(), 0.0, 1.0)?,
            [
                within("across", self.across, seed.transverse(), 1e-5, 10.0)?,
                within("along", self.along, seed.axial(), 1e-5, 10.0)?,
            ],
            within("gravity", self.gravity, seed.gravity(), 0.0, 100.0)?,
        )?;
        let seed_tilt = Case::SEED_TILT.to_degrees();
        let tilt = within("tilt_deg", self.tilt_deg, seed_tilt, 0.0, 180.0)?.to_radians();
        let w3 = within("spin_hz", self.spin_hz, 20.0, -200.0, 200.0)? * TAU;
        let precession = within("precession_dps", self.precession_dps, 0.0, -2e4, 2e4)?;
        let nutation = within("nutation_dps", self.nutation_dps, 0.0, -2e4, 2e4)?;
        let name = self.case.as_deref().unwrap_or("cusped");
        let start = if name == "free" {
            EulerState {
                angles: EulerAngles {
                    nutation: tilt,
                    ..EulerAngles::default()
                },
                precession_rate: precession.to_radians(),
                nutation_rate: nutation.to_radians(),
                w3,
            }
        } else {
            if self.precession_dps.is_some() || self.nutation_dps.is_some() {
                return Err(
                    "precession_dps and nutation_dps belong to case=free: a case has its own"
                        .to_owned(),
                );
            }
            let case = compare::case(name).map_err(|e| format!("{e}, or free"))?;
            case.start(&top, tilt, w3)
                .map_err(|e| format!("case {}: {e}", case.name()))?
        };
        let rate_hz = within("rate_hz", self.rate_hz, 2000.0, 10.0, 20_000.0)?;
        let secs = within("duration", self.duration, 1.2, 0.01, 20.0)?;
        if rate_hz * secs > MOST_SAMPLES {
            return Err(format!(
                "{rate_hz} Hz for {secs} s are {} samples: at most {MOST_SAMPLES}",
                rate_hz * secs
            ));
        }
        let names: Vec<String> = self
            .methods
            .as_deref()
            .unwrap_or("live-right,euler-angles,auto")
            .split(',')
            .filter(|name| !name.is_empty())
            .map(str::to_owned)
            .collect();
        if names.len() > MOST_METHODS {
            return Err(format!(
                "{} methods: at most {MOST_METHODS} at once",
                names.len()
            ));
        }
        Ok((
            Course::new(top, start, rate_hz, secs)?,
            How::parse_all(&names).map_err(|e| e.to_string())?,
        ))
    }

    /// Everything the page draws.
    ///
    /// # Errors
    /// In words: what cannot be, or is too much.
    fn answer(&self) -> Result<Value, String> {
        let (course, methods) = self.course()?;
        let points = self.points.unwrap_or(POINTS);
        if !(2..=MOST_POINTS).contains(&points) {
            return Err(format!(
                "points {points}: from 2 to {MOST_POINTS} are allowed"
            ));
        }
        let found = course.errors(&methods)?;
        let paths = course.paths(&methods, points)?;
        let errors: Map<String, Value> = found
            .errors
            .iter()
            .map(|(how, worst)| {
                let value = json!({
                    "axis_max": worst.axis.to_degrees(),
                    "attitude_max": worst.attitude.to_degrees(),
                });
                (how.name(), value)
            })
            .collect();
        let top = course.top;
        Ok(json!({
            "case": self.case.as_deref().unwrap_or("cusped"),
            "top": {
                "mass": top.mass(), "arm": top.arm(), "across": top.transverse(),
                "along": top.axial(), "gravity": top.gravity(),
            },
            "start": {
                "tilt_deg": course.start.angles.nutation.to_degrees(),
                "precession_dps": course.start.precession_rate.to_degrees(),
                "nutation_dps": course.start.nutation_rate.to_degrees(),
                "spin_hz": course.start.w3 / TAU,
            },
            "rate_hz": course.rate_hz,
            "duration": course.secs,
            "errors_deg": errors,
            "energy_drift": found.energy_drift,
            "nutation_deg": found.nutation.map(f64::to_degrees),
            "sleeps_above_hz": top.sleeping_threshold() / TAU,
            "t": paths.times.iter().map(|t| rounded(*t, 1e7)).collect::<Vec<_>>(),
            "truth": truth(&course, &paths)?,
            "methods": paths.methods.iter().map(path).collect::<Vec<_>>(),
        }))
    }
}

/// Attitude, direction of the angular momentum, and body rate in the world as a part of its first size.
fn truth(course: &Course, paths: &Paths) -> Result<Value, String> {
    let rotor = course.top.rotor().map_err(|e| e.to_string())?;
    let size = course.start.spin().w_nb_b.norm();
    let size = if size > 0.0 { size } else { 1.0 };
    let momentum: Vec<_> = paths
        .truth
        .iter()
        .map(|spin| {
            let l = rotor.angular_momentum_n(spin);
            let norm = l.norm();
            let unit = if norm > 0.0 { l / norm } else { l };
            <[f64; 3]>::from(unit).map(|v| rounded(v, 1e5))
        })
        .collect();
    let rate: Vec<_> = paths
        .truth
        .iter()
        .map(|spin| {
            let w = quat::matrix(&spin.q_nb.wxyz()) * spin.w_nb_b;
            <[f64; 3]>::from(w).map(|v| rounded(v / size, 1e5))
        })
        .collect();
    let q: Vec<_> = paths.truth.iter().map(|spin| short(&spin.q_nb)).collect();
    Ok(json!({"q": q, "momentum": momentum, "rate": rate}))
}

fn path(path: &MethodPath) -> Value {
    let q: Vec<_> = path.attitudes.iter().map(short).collect();
    let errors: Vec<_> = path
        .errors
        .iter()
        .map(|e| format!("{:.3e}", e.to_degrees()).parse().unwrap_or(0.0))
        .collect::<Vec<f64>>();
    json!({"name": path.how.name(), "q": q, "error_deg": errors})
}

/// Quaternion in short for pictures: errors are taken before.
fn short(q: &Quaternion<Nav, Body>) -> [f64; 4] {
    q.wxyz().map(|v| rounded(v, 1e7))
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

/// Answers, on a thread that may take its time.
pub(in crate::serve) async fn answer(
    Extension(connection): Extension<Connection>,
    request: Result<Query<Request>, QueryRejection>,
) -> Response<Answer> {
    if connection.hub.token().is_some() && !connection.trusted {
        return unauthorised();
    }
    let request = match request {
        Ok(Query(request)) => request,
        Err(why) => {
            let text = strapd_recording::text::printable(&why.body_text());
            return refusal(StatusCode::BAD_REQUEST, "bad_request", &text);
        }
    };
    let Ok(Ok(turn)) = tokio::time::timeout(PATIENCE, AT_ONCE.acquire()).await else {
        return refusal(
            StatusCode::SERVICE_UNAVAILABLE,
            "busy",
            "other tops are being worked on; ask again",
        );
    };
    let work = tokio::task::spawn_blocking(move || {
        // Kept until it is done, though nobody may wait for it any more.
        let _turn = turn;
        request.answer()
    });
    match work.await {
        Ok(Ok(found)) => response(StatusCode::OK, "application/json", format!("{found}\n")),
        Ok(Err(why)) => refusal(StatusCode::BAD_REQUEST, "bad_request", &why),
        Err(_) => refusal(
            StatusCode::INTERNAL_SERVER_ERROR,
            "failed",
            "this top could not be computed",
        ),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_shows_what_the_table_says() {
        for case in ["cusped", "wavy", "looping", "steady-slow"] {
            let request = Request {
                case: Some(case.to_owned()),
                methods: Some("live-right,euler-angles,auto,gyro-left".to_owned()),
                points: Some(100),
                ..Request::default()
            };
            let found = request.answer().unwrap();
            // At most: every so-manieth sample, and the last.
            let points = found["t"].as_array().unwrap().len();
            assert!((90..=100).contains(&points), "{points}");
            for method in found["methods"].as_array().unwrap() {
                let of = |list: &Value| list.as_array().unwrap().len();
                assert_eq!(
                    (of(&method["q"]), of(&method["error_deg"])),
                    (points, points)
                );
                let errors = method["error_deg"].as_array().unwrap().iter();
                let most = errors.map(|e| e.as_f64().unwrap()).fold(0.0, f64::max);
                let name = method["name"].as_str().unwrap();
                let said = found["errors_deg"][name]["attitude_max"].as_f64().unwrap();
                assert!(
                    (most - said).abs() <= 6e-4 * said,
                    "{case}, {name}: {most} drawn, {said} said"
                );
            }
        }
    }

    #[test]
    fn what_is_asked_is_bounded_and_the_reason_said() {
        let ask = |change: fn(&mut Request)| {
            let mut request = Request::default();
            change(&mut request);
            request.answer().unwrap_err()
        };
        assert!(ask(|r| r.duration = Some(15.0)).contains("30000 samples"));
        assert!(ask(|r| r.duration = Some(f64::NAN)).contains("duration"));
        assert!(ask(|r| r.rate_hz = Some(1e9)).contains("rate_hz"));
        assert!(ask(|r| r.spin_hz = Some(f64::INFINITY)).contains("spin_hz"));
        assert!(ask(|r| r.methods = Some("auto,".repeat(5))).contains("5 methods"));
        assert!(ask(|r| r.methods = Some("magic".to_owned())).contains("live-right"));
        assert!(ask(|r| r.case = Some("spilt".to_owned())).contains("or free"));
        assert!(ask(|r| r.points = Some(1_000_000)).contains("points"));
        assert!(ask(|r| r.precession_dps = Some(1.0)).contains("case=free"));
        assert!(ask(|r| r.case = Some("sleeping".to_owned())).contains("euler-angles"));
        assert!(ask(|r| r.along = Some(1.0)).contains("no matter"));
    }
}
