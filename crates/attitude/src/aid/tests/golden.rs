//! The golden case of an independent implementation: motion by formula, a gyro with errors, the propagator
//! that goes with the figures.

use crate::aid::filter::Measured;
use crate::aid::{Filter, Settings};
use crate::frames::{Body, Dcm, In, Nav};
use crate::propagate::shared_data;
use crate::quaternion::{Quaternion, RotationVector};
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::fs;

const STEP: f64 = 0.01;
const LAST: usize = 2000;

/// Settings from before the changes that other recordings asked for.
pub(super) fn plain() -> Settings {
    Settings {
        bias_walk: 8e-5,
        bias_prior: 8.7e-3,
        bias_drift: 0.0,
        force_carried: f64::INFINITY,
        colour: 0.0,
        tilt_by_gravity: false,
        force_explained: 0.0,
        force_turning: f64::INFINITY,
        rest_rate: 0.0349,
        rest_beside_bias: false,
        force_instant: 0.4,
        rest_lag: 0.0,
        bias_by_tilt: 0.0,
        rest_by_spell: false,
        lean_believed: 0.0,
        ..Settings::default()
    }
}

/// Share of the motion at an instant, roll, pitch, yaw, and their rates.
fn angles(t: f64) -> (f64, Vector3<f64>, Vector3<f64>) {
    let x = (t - 3.0).max(0.0);
    let cube = x.powi(3);
    let u = cube / (1.0 + cube);
    let du = 3.0 * x * x / (1.0 + cube).powi(2);
    let a = Vector3::new(
        0.7 * (1.3 * t).sin(),
        0.5 * (1.7 * t + 0.4).sin(),
        0.9 * (0.8 * t).sin() + 0.3 * t,
    );
    let da = Vector3::new(
        0.91 * (1.3 * t).cos(),
        0.85 * (1.7 * t + 0.4).cos(),
        0.72 * (0.8 * t).cos() + 0.3,
    );
    (u, a * u, da * u + a * du)
}

fn attitude(angles: &Vector3<f64>) -> Matrix3<f64> {
    *Rotation3::from_euler_angles(angles.x, angles.y, angles.z).matrix()
}

/// The attitude at sample `k`.
pub(super) fn truth(k: usize) -> Matrix3<f64> {
    attitude(&angles(k as f64 * STEP).1)
}

/// Gyro, force and field of sample `k`.
pub(super) fn sample(k: usize) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let t = k as f64 * STEP;
    let (_, a, d) = angles(t - 0.5 * STEP);
    let (sr, cr) = a.x.sin_cos();
    let (sp, cp) = a.y.sin_cos();
    let rate = Vector3::new(
        d.x - d.z * sp,
        d.y * cr + d.z * cp * sr,
        -d.y * sr + d.z * cp * cr,
    );
    let gyro =
        rate.component_mul(&Vector3::new(1.005, 0.997, 1.002)) + Vector3::new(0.01, -0.008, 0.005);
    let (u, a, _) = angles(t);
    let r = attitude(&a);
    let acceleration = Vector3::new(
        1.5 * (4.0 * t).sin(),
        (3.0 * t).sin(),
        0.5 * (5.0 * t).sin(),
    ) * u;
    let force = r.transpose() * (acceleration + Vector3::z() * 9.81);
    let field = r.transpose() * Vector3::new(0.0, 16.0, -41.0) + Vector3::repeat(1e-9 * k as f64);
    (gyro, force, field)
}

/// The filter beside the propagator of the golden figures: third order, from means.
pub(super) struct Run {
    pub(super) filter: Filter,
    pub(super) propagated: Quaternion<Nav, Body>,
    before: Vector3<f64>,
    last: Option<(f64, Vector3<f64>)>,
}

impl Run {
    pub(super) fn new(settings: Settings) -> Run {
        Run {
            filter: Filter::new(settings, false, In::assume(Vector3::zeros())),
            propagated: Quaternion::identity(),
            before: Vector3::zeros(),
            last: None,
        }
    }

    pub(super) fn take(
        &mut self,
        t: f64,
        rate: Vector3<f64>,
        force: Option<Vector3<f64>>,
        field: Option<Vector3<f64>>,
    ) {
        let Some((before, rate_before)) = self.last.replace((t, rate)) else {
            let measured = Measured {
                secs: 0.0,
                rate,
                force,
                field,
                is_saturated: false,
            };
            self.filter.begin(&measured, &self.propagated);
            return;
        };
        let secs = t - before;
        let is_gap = secs > 1.5 * STEP;
        let mean = if is_gap {
            0.5 * (rate + rate_before)
        } else {
            rate
        };
        let known = self.filter.applied();
        let turn = known.corrected(mean, 1.0) * secs;
        let coning = if is_gap {
            Vector3::zeros()
        } else {
            self.before.cross(&turn) / 12.0
        };
        self.before = turn;
        let phi = RotationVector(turn + coning);
        self.propagated = self.propagated.advanced(&phi).normalised();
        let measured = Measured {
            secs,
            rate,
            force,
            field,
            is_saturated: false,
        };
        let (_, r) = self.filter.corrected(&self.propagated);
        let _ = self.filter.take(&measured, &known, &r);
    }

    pub(super) fn attitude(&self) -> Quaternion<Nav, Body> {
        self.filter.corrected(&self.propagated).0
    }
}

/// Angle to the truth at the end, degrees.
pub(super) fn angle_at_end(attitude: &Quaternion<Nav, Body>) -> f64 {
    let (_, a, _) = angles(LAST as f64 * STEP);
    let truth = Quaternion::from_dcm(&Dcm::assume(self::attitude(&a)));
    attitude.angle_to(&truth).to_degrees()
}

pub(super) fn run(settings: Settings, with_field: bool, mut seen: impl FnMut(usize, &Run)) -> Run {
    let mut run = Run::new(settings);
    for k in 0..=LAST {
        let (rate, force, field) = sample(k);
        run.take(
            k as f64 * STEP,
            rate,
            Some(force),
            with_field.then_some(field),
        );
        seen(k, &run);
    }
    run
}

/// The rows of a table: second, then columns of numbers.
fn rows(text: &str, which: &str) -> Vec<(usize, Vec<Vec<f64>>)> {
    let section = text.split("9D");
    let section: Vec<&str> = section.collect();
    let part = if which == "9D" {
        section[1]
    } else {
        section[0]
    };
    part.lines()
        .filter_map(|line| {
            let mut cells = line.trim().trim_matches('|').split('|');
            let second = cells.next()?.trim().parse().ok()?;
            let numbers = |cell: &str| cell.split(',').map(|n| n.trim().parse().unwrap()).collect();
            Some((second, cells.map(numbers).collect()))
        })
        .collect()
}

/// Largest difference from a table: attitude, bias and scale, sigma; `columns` says which those are.
fn compare(file: &str, which: &str, settings: Settings, columns: [usize; 4]) -> [f64; 4] {
    let path = shared_data::shared("oracle/filter").unwrap().join(file);
    let text = fs::read_to_string(path).unwrap();
    let rows = rows(&text, which);
    assert_eq!(rows.len(), 4, "{file} {which}");
    let mut worst = [0.0_f64; 4];
    run(settings, which == "9D", |k, run| {
        let Some((_, row)) = rows.iter().find(|(second, _)| second * 100 == k) else {
            return;
        };
        let q = run.attitude();
        let q = q.same_sign_as(&Quaternion::identity()).wxyz().to_vec();
        let calibration = run.filter.calibration();
        let sigma = run.filter.earth_variances().map(f64::sqrt).to_vec();
        let ours = [
            q,
            calibration.bias.as_slice().to_vec(),
            calibration.scale.as_slice().to_vec(),
            sigma,
        ];
        for ((worst, ours), column) in worst.iter_mut().zip(ours).zip(columns) {
            assert_eq!(ours.len(), row[column].len());
            for (a, b) in ours.iter().zip(&row[column]) {
                *worst = worst.max((a - b).abs());
            }
        }
    });
    worst
}

/// Printed with six digits behind the point.
const ROUNDED: f64 = 0.6e-6;

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_golden_case_comes_out_to_all_its_digits() {
    for which in ["6D", "9D"] {
        let worst = compare("golden.txt", which, plain(), [0, 2, 3, 4]);
        assert!(worst.iter().all(|w| *w < ROUNDED), "{which} {worst:?}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_golden_case_with_coloured_residuals_comes_out_to_all_its_digits() {
    for which in ["6D", "9D"] {
        // From before what simulated motions asked for.
        let settings = Settings {
            rest_rate: 0.008_73,
            colour: 0.8,
            tilt_by_gravity: false,
            force_explained: 0.0,
            force_turning: f64::INFINITY,
            force_instant: 0.4,
            rest_lag: 0.0,
            bias_by_tilt: 0.0,
            rest_by_spell: false,
            lean_believed: 0.0,
            bias_drift: 0.0,
            force_carried: f64::INFINITY,
            ..Settings::default()
        };
        let worst = compare("golden_colour.txt", which, settings, [0, 1, 2, 3]);
        assert!(worst.iter().all(|w| *w < ROUNDED), "{which} {worst:?}");
    }
}
