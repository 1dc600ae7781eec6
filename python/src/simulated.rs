//! A motion by its name -> samples and their truth as numpy arrays. Pure but for Python's objects.
//!
//! What `strapd simulate` writes, to the bit, without a file in between.

use crate::columns::rows;
use crate::errand::{self, Stopped};
use crate::raw_columns::{RawColumns, Time};
use crate::refusal;
use nalgebra::Vector3;
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::noise::sensor_error::{ImuError, StampError};
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_bodies::field::Field;
use strapd_bodies::motion::{BandLimited, Carrier, Coning, Motion, Worn};
use strapd_bodies::synthetic::{ForceSampling, Magnetometer, Sampling, Stretch, Synthetic};
use strapd_bodies::top::method_errors::case;
use strapd_bodies::top::{Case, SymmetricTop};

/// Standard gravity, where the motion does not say otherwise.
const GRAVITY: f64 = 9.80665;
/// The Earth's field: T, dip.
const FIELD: (f64, f64) = (48e-6, 60.0);
/// Instants made together.
const BATCH: usize = 2048;
/// Instants of one call: 12 GB of arrays.
const MOST: u64 = 100_000_000;

/// Words and numbers about a motion, by name.
struct About(BTreeMap<String, String>);

impl About {
    fn text(&mut self, name: &str) -> Option<String> {
        self.0.remove(name)
    }

    fn number<T: std::str::FromStr>(&mut self, name: &str, plain: T) -> Result<T, String> {
        let given = self.0.remove(name).map(|text| {
            text.parse()
                .map_err(|_| format!("{name}: {text:?} is no number"))
        });
        given.unwrap_or(Ok(plain))
    }

    /// Refuses what nobody has asked for by now: it is none of this motion's.
    fn nothing_left(&self, motion: &str) -> Result<(), String> {
        match self.0.keys().next() {
            None => Ok(()),
            Some(name) => Err(format!("{name}: the motion {motion:?} has no such thing")),
        }
    }
}

struct Made {
    motion: Motion,
    force: ForceSampling,
    gravity: f64,
}

impl Made {
    fn still(motion: Motion) -> Made {
        Made {
            motion,
            force: ForceSampling::Instant,
            gravity: GRAVITY,
        }
    }
}

fn made(name: &str, about: &mut About, seed: u64) -> Result<Made, Diagnostic> {
    let carried = |carrier: Carrier| Made {
        motion: Motion::Carried(Box::new(carrier.motion(seed, GRAVITY))),
        force: ForceSampling::AsGyro,
        gravity: GRAVITY,
    };
    Ok(match name {
        "top" => {
            let top = SymmetricTop::published();
            let case = about
                .text("case")
                .map_or(Ok(Case::Cusped), |named| case(&named));
            let case = case.map_err(|why| format!("case: {why}"))?;
            let spin = about.number("spin_hz", 20.0)? * TAU;
            let tilt = about.number("tilt_deg", Case::SEED_TILT.to_degrees())?;
            // The seed's own angle is no whole number of degrees.
            let tilt = match tilt == Case::SEED_TILT.to_degrees() {
                true => Case::SEED_TILT,
                false => tilt.to_radians(),
            };
            let start = case
                .start(&top, tilt, spin)
                .map_err(|why| format!("case: {}: {why}", case.name()))?;
            let motion = top
                .exact(&start)
                .map_err(|why| format!("motion: top: {why}"))?;
            Made {
                gravity: top.gravity(),
                ..Made::still(Motion::HeavyBody(Box::new(motion)))
            }
        }
        "coning" => {
            let angle = about.number("half_angle_deg", 10.0_f64)?;
            let frequency = about.number("frequency_hz", 3.0)?;
            let coning = Coning::new(angle.to_radians(), frequency).map_err(|why| {
                Diagnostic::new(format!("half_angle_deg, frequency_hz: {why}"))
                    .help("up to 180, up to 15000")
            })?;
            Made::still(Motion::Coning(coning))
        }
        "random" => {
            let rms = about.number("rms", 1.0_f64)?;
            let highest = about.number("f_max", 5.0_f64)?;
            let sines = about.number("sines", 20_usize)?;
            let fits = |value: f64| value >= 0.0 && value.is_finite();
            if !(fits(rms) && fits(highest) && (1..=BandLimited::MOST_SINES).contains(&sines)) {
                return Err(format!(
                    "rms, f_max, sines: 0 or more rad/s, 0 or more Hz, 1 to {} are needed",
                    BandLimited::MOST_SINES
                )
                .into());
            }
            let motion = BandLimited::random(seed, rms, highest, sines).map_err(|why| {
                Diagnostic::new(format!("rms, f_max, sines: {why}")).help("f_max up to 15000")
            })?;
            Made::still(Motion::BandLimited(Box::new(motion)))
        }
        "walking" | "running" => {
            let worn = match about.text("worn").as_deref() {
                None | Some("waist") => Worn::Waist,
                Some("hand") => Worn::Hand,
                Some("foot") => Worn::Foot,
                Some(other) => {
                    return Err(Diagnostic::new(format!("worn: there is no {other:?}"))
                        .help("one of waist, hand, foot"));
                }
            };
            carried(match name {
                "walking" => Carrier::Walking(worn),
                _ => Carrier::Running(worn),
            })
        }
        "circling" => carried(Carrier::Circling),
        "arm" => carried(Carrier::Arm),
        "car" => carried(Carrier::Car),
        "vibration" => carried(Carrier::Vibration),
        "drone" => carried(Carrier::Drone),
        "hand" => carried(Carrier::Hand),
        "boat" => carried(Carrier::Boat),
        _ => {
            return Err(Diagnostic::new(format!("motion: there is no {name:?}")).help("one of top, coning, random, walking, running, circling, arm, car, vibration, drone, hand, boat"));
        }
    })
}

/// Samples of a motion, and their truth: `truth_t`, `truth_q`, `truth_rate`.
#[pyfunction]
#[pyo3(signature = (motion, about, rate_hz, duration, seed, noise, kind, mag_hz, start, /))]
#[allow(clippy::too_many_arguments)]
pub fn simulate<'py>(
    py: Python<'py>,
    motion: String,
    about: BTreeMap<String, String>,
    rate_hz: f64,
    duration: f64,
    seed: u64,
    noise: &str,
    kind: &str,
    mag_hz: Option<f64>,
    start: i64,
) -> PyResult<Bound<'py, PyDict>> {
    let refused = |what: Diagnostic| refusal::argument_of_log(&what);
    let kind = SampleKind::named(kind).ok_or_else(|| {
        refused(
            Diagnostic::new(format!("kind: there is no {kind:?}"))
                .help("one of rate, average, delta-angle, rotation"),
        )
    })?;
    let error = ImuError::parse(noise)
        .map_err(|why| refused(Diagnostic::from(&why).at(format_args!("noise: {noise}"))))?;
    let instants = rate_hz * duration;
    if instants > MOST as f64 {
        return Err(refused(
            Diagnostic::new(format!(
                "rate_hz, duration: {instants:.0} samples are more than {MOST}"
            ))
            .help("a shorter one, or `strapd simulate` into a file"),
        ));
    }
    let mut about = About(about);
    let made = made(&motion, &mut about, seed)
        .and_then(|made| {
            about
                .nothing_left(&motion)
                .map(|()| made)
                .map_err(Into::into)
        })
        .map_err(refused)?;
    let sampling = Sampling {
        rate_hz,
        duration_secs: duration,
        kind,
        start: Nanos(start),
        gravity: made.gravity,
        lever_b: Vector3::zeros(),
        force: made.force,
        magnetometer: mag_hz.map(|rate_hz| Magnetometer {
            rate_hz,
            field: Field::new(FIELD.0, FIELD.1.to_radians(), 0.0, Vec::new()),
        }),
        error,
        stamps: StampError::default(),
        seed,
    };
    let source = Synthetic::new(made.motion, sampling)
        .map_err(|why| refused(Diagnostic::from(&why).at(format_args!("motion: {motion}"))))?;
    let taken = errand::run(py, move |stopped| sampled(source, stopped))?;
    let taken = taken.map_err(|why| refused(format!("motion: {motion}: {why}").into()))?;
    let dict = taken.columns.into_dict(py)?;
    dict.set_item("kind", kind.name())?;
    dict.set_item("truth_t", taken.t.into_pyarray(py))?;
    dict.set_item("truth_q", rows(py, taken.q, 4)?)?;
    dict.set_item("truth_rate", rows(py, taken.rate, 3)?)?;
    Ok(dict)
}

struct Sampled {
    columns: RawColumns,
    t: Vec<i64>,
    q: Vec<f64>,
    rate: Vec<f64>,
}

fn sampled(mut source: Synthetic, stopped: &Stopped) -> Result<Sampled, String> {
    let mut taken = Sampled {
        columns: RawColumns::new(Time::Header),
        t: Vec::new(),
        q: Vec::new(),
        rate: Vec::new(),
    };
    let mut stretch = Stretch::default();
    while !stopped.is_set() {
        let count = source.next_stretch(BATCH, &mut stretch);
        if count.map_err(|why| why.to_string())? == 0 {
            break;
        }
        for raw in &mut stretch.samples {
            // The truth is given apart, at every instant.
            raw.orientation = None;
            taken.columns.push(raw);
        }
        for truth in &stretch.truth {
            taken.t.push(truth.stamp.0);
            taken.q.extend_from_slice(&truth.spin.q_nb.wxyz());
            taken.rate.extend_from_slice(truth.spin.w_nb_b.as_slice());
        }
    }
    Ok(taken)
}
