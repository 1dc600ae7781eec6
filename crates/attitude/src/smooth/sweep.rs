//! The samples of a segment -> its turn, push and path, and how these depend on bias and constants. Pure.
//!
//! A stage of its own because it is the hot loop, once a sample and pass: plain arrays, no branches on values.
//! Derivatives by bias and by the accelerometer's bias are kept before the product with the calibration's matrices,
//! which are the same for all samples. First order in the time step, as the sums themselves are.

use super::border::{self, Constants};
use super::prepared::Prepared;
use crate::quaternion::kernel::{rows, turned, unit};
use nalgebra::{Matrix3, Vector3};

/// Gravity that is assumed, m/s^2.
pub(super) const GRAVITY: f64 = 9.81;

/// Derivatives that a turn has: by bias, by the gyro's matrix, by its sensitivity to acceleration.
pub(super) const TURN: usize = 21;
/// Number of columns of velocity and position: those, by the accelerometer's bias, matrix and time offset.
pub(super) const PUSH: usize = 34;
/// Columns of the accelerometer in the loop, and one for alignment.
const OWN: usize = 14;

/// The constants as the loop takes them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensor {
    pub gyro: Matrix3<f64>,
    /// Sensitivity to acceleration, rad/s per m/s^2, and the force about which it counts, m/s^2: the bias is that there.
    pub sensitivity: Matrix3<f64>,
    pub usual_force: Vector3<f64>,
    pub force_bias: Vector3<f64>,
    pub force: Matrix3<f64>,
    pub force_time: f64,
    pub iron: Vector3<f64>,
    pub field: Matrix3<f64>,
    pub field_time: f64,
}

impl Sensor {
    /// Makes it of the constants; `usual_force`: the mean one of the recording, m/s^2, body axes.
    pub(super) fn of(constants: &Constants, usual_force: Vector3<f64>) -> Sensor {
        Sensor {
            gyro: border::matrix(constants, border::GYRO),
            sensitivity: border::matrix(constants, border::SENSITIVITY) - Matrix3::identity(),
            usual_force,
            force_bias: border::vector(constants, border::FORCE_BIAS),
            force: border::matrix(constants, border::FORCE),
            force_time: constants[border::FORCE_TIME],
            iron: border::vector(constants, border::IRON),
            field: border::matrix(constants, border::FIELD),
            field_time: constants[border::FIELD_TIME],
        }
    }

    /// Force that the gyro feels beside the usual one, m/s^2.
    fn felt(&self, sample: &Prepared) -> Vector3<f64> {
        sample.force - self.usual_force
    }

    /// Rate as it was measured, without bias and sensitivity, rad/s.
    fn less_bias(&self, sample: &Prepared, bias: &Vector3<f64>) -> Vector3<f64> {
        sample.rate - bias - self.sensitivity * self.felt(sample)
    }

    /// Rate by the gyro's calibration, rad/s.
    pub(super) fn rate(&self, sample: &Prepared, bias: &Vector3<f64>) -> Vector3<f64> {
        self.gyro * self.less_bias(sample, bias)
    }
}

/// Sums of a segment, earth axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Swept {
    /// Attitude at its end.
    pub q: [f64; 4],
    /// Less gravity, from rest, m/s and m.
    pub velocity: [f64; 3],
    pub position: [f64; 3],
    pub secs: f64,
    /// Variance that samples at the end of the gyro's range leave of the rotation about each axis of the earth, rad^2.
    pub clipped: [f64; 3],
    /// Derivative by bias (3), the gyro's matrix (9) and its sensitivity (9).
    pub by_turn: [[f64; TURN]; 3],
    /// The same, then by the accelerometer's bias (3), matrix (9), time offset.
    pub by_velocity: [[f64; PUSH]; 3],
    pub by_position: [[f64; PUSH]; 3],
    pub field: FieldMeans,
}

/// Means over the samples with a field.
#[derive(Clone, Copy, Debug)]
pub(super) struct FieldMeans {
    pub samples: f64,
    /// Mean field as it was measured, earth axes.
    pub measured: [f64; 3],
    /// Derivative by the matrix, and of its columns times the measured components: `[r][3 j + l]`.
    pub r: [[f64; 3]; 3],
    pub rm: [[f64; 9]; 3],
    /// Derivative by the time offset.
    pub by_time: [f64; 3],
    /// Derivative by bias, the gyro's matrix and its sensitivity.
    pub by_turn: [[f64; TURN]; 3],
}

impl FieldMeans {
    fn none() -> FieldMeans {
        FieldMeans {
            samples: 0.0,
            measured: [0.0; 3],
            r: [[0.0; 3]; 3],
            rm: [[0.0; 9]; 3],
            by_time: [0.0; 3],
            by_turn: [[0.0; TURN]; 3],
        }
    }
}

#[inline(always)]
fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn apply(m: &[[f64; 3]; 3], v: &[f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|r| m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2])
}

/// Columns of `d` crossed with `f`, and what becomes of their first and second sums.
#[inline(always)]
fn push_by_turn(
    d: &[[f64; TURN]; 3],
    f: &[f64; 3],
    secs: f64,
    velocity: &mut [[f64; TURN]; 3],
    position: &mut [[f64; TURN]; 3],
) {
    let half = 0.5 * secs * secs;
    for (r, (a, b)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
        for j in 0..TURN {
            let y = d[a][j] * f[b] - d[b][j] * f[a];
            position[r][j] += velocity[r][j] * secs + y * half;
            velocity[r][j] += y * secs;
        }
    }
}

/// The samples of a segment from the attitude `start` with the gyro's `bias`. `FIELD`: with all of the field, not
/// its mean alone.
pub(super) fn sweep<const FIELD: bool>(
    samples: &[Prepared],
    start: &[f64; 4],
    bias: &Vector3<f64>,
    sensor: &Sensor,
) -> Swept {
    let mut q = *start;
    let mut r = rows(&q);
    let (mut d, mut dv, mut dp) = ([[0.0; TURN]; 3], [[0.0; TURN]; 3], [[0.0; TURN]; 3]);
    let (mut own_v, mut own_p) = ([[0.0; OWN]; 3], [[0.0; OWN]; 3]);
    let (mut v, mut p) = ([0.0; 3], [0.0; 3]);
    let mut secs = 0.0;
    let mut clipped = [0.0; 3];
    let mut field = FieldMeans::none();
    for sample in samples {
        let dt = sample.secs;
        let felt = sensor.felt(sample);
        let u = sensor.less_bias(sample, bias);
        let w: Vector3<f64> = sensor.gyro * u;
        q = turned(&q, &(w * dt));
        let before = r;
        r = rows(&q);
        let e: [f64; 3] = (sample.force - sensor.force_bias).into();
        let fs: [f64; 3] = (sensor.force * Vector3::from(e)).into();
        let x = cross(&w.into(), &fs);
        let fs = [0, 1, 2].map(|i| fs[i] + sensor.force_time * x[i]);
        let f = apply(&r, &fs);
        let rx = apply(&r, &x);
        for i in 0..3 {
            for j in 0..3 {
                let mean = 0.5 * dt * (before[i][j] + r[i][j]);
                d[i][j] += mean;
                d[i][3 + 3 * j] += mean * u[0];
                d[i][4 + 3 * j] += mean * u[1];
                d[i][5 + 3 * j] += mean * u[2];
                d[i][12 + 3 * j] += mean * felt[0];
                d[i][13 + 3 * j] += mean * felt[1];
                d[i][14 + 3 * j] += mean * felt[2];
            }
        }
        push_by_turn(&d, &f, dt, &mut dv, &mut dp);
        let half = 0.5 * dt * dt;
        for i in 0..3 {
            let mut y = [0.0; OWN];
            for j in 0..3 {
                y[j] = r[i][j];
                for l in 0..3 {
                    y[3 + 3 * j + l] = r[i][j] * e[l];
                }
            }
            y[12] = rx[i];
            for j in 0..OWN {
                own_p[i][j] += own_v[i][j] * dt + y[j] * half;
                own_v[i][j] += y[j] * dt;
            }
        }
        if sample.is_saturated {
            for (sum, row) in clipped.iter_mut().zip(&r) {
                let about = row.iter().zip(&sample.clipped);
                *sum += about.map(|(r, variance)| r * r * variance).sum::<f64>();
            }
        }
        if !sample.field.x.is_nan() {
            add_field::<FIELD>(&sample.field, &w, &r, &d, sensor, &mut field);
        }
        let f = [f[0], f[1], f[2] - GRAVITY];
        for i in 0..3 {
            p[i] += v[i] * dt + f[i] * half;
            v[i] += f[i] * dt;
        }
        secs += dt;
    }
    field.divide::<FIELD>(&sensor.gyro);
    Swept {
        q: unit(&q),
        velocity: v,
        position: p,
        secs,
        clipped,
        by_turn: by_bias(d, &sensor.gyro),
        by_velocity: joined(by_bias(dv, &sensor.gyro), &own_v, &sensor.force),
        by_position: joined(by_bias(dp, &sensor.gyro), &own_p, &sensor.force),
        field,
    }
}

#[inline(always)]
fn add_field<const FIELD: bool>(
    measured: &Vector3<f64>,
    w: &Vector3<f64>,
    r: &[[f64; 3]; 3],
    d: &[[f64; TURN]; 3],
    sensor: &Sensor,
    field: &mut FieldMeans,
) {
    let m: [f64; 3] = (*measured).into();
    field.samples += 1.0;
    let mean = apply(r, &m);
    for i in 0..3 {
        field.measured[i] += mean[i];
    }
    if !FIELD {
        return;
    }
    let s: [f64; 3] = (sensor.field * (measured - sensor.iron)).into();
    let y = cross(&(*w).into(), &s);
    let s = [0, 1, 2].map(|i| s[i] + sensor.field_time * y[i]);
    let (z, ry) = (apply(r, &s), apply(r, &y));
    for (i, (a, b)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
        field.by_time[i] += ry[i];
        for j in 0..3 {
            field.r[i][j] += r[i][j];
            for l in 0..3 {
                field.rm[i][3 * j + l] += r[i][j] * m[l];
            }
        }
        for j in 0..TURN {
            field.by_turn[i][j] += d[a][j] * z[b] - d[b][j] * z[a];
        }
    }
}

impl FieldMeans {
    fn divide<const FIELD: bool>(&mut self, gyro: &Matrix3<f64>) {
        if self.samples == 0.0 {
            return;
        }
        let share = 1.0 / self.samples;
        self.measured = self.measured.map(|m| m * share);
        if FIELD {
            self.r = self.r.map(|row| row.map(|x| x * share));
            self.rm = self.rm.map(|row| row.map(|x| x * share));
            self.by_time = self.by_time.map(|x| x * share);
            self.by_turn = by_bias(self.by_turn, gyro).map(|row| row.map(|x| x * share));
        }
    }
}

/// Adds the product by the gyro's matrix that the loop leaves out.
fn by_bias(mut d: [[f64; TURN]; 3], gyro: &Matrix3<f64>) -> [[f64; TURN]; 3] {
    for row in &mut d {
        let bare = Vector3::new(row[0], row[1], row[2]);
        let by: [f64; 3] = (-(gyro.transpose() * bare)).into();
        row[..3].copy_from_slice(&by);
        // A sensitivity is a bias by the share of the force.
        for l in 0..3 {
            let bare = Vector3::new(row[12 + l], row[15 + l], row[18 + l]);
            let by = -(gyro.transpose() * bare);
            (row[12 + l], row[15 + l], row[18 + l]) = (by.x, by.y, by.z);
        }
    }
    d
}

/// Both kinds of columns, with the product by the accelerometer's matrix.
fn joined(turn: [[f64; TURN]; 3], own: &[[f64; OWN]; 3], force: &Matrix3<f64>) -> [[f64; PUSH]; 3] {
    [0, 1, 2].map(|i| {
        let mut row = [0.0; PUSH];
        row[..TURN].copy_from_slice(&turn[i]);
        row[TURN..].copy_from_slice(&own[i][..OWN - 1]);
        let bare = Vector3::new(own[i][0], own[i][1], own[i][2]);
        let by: [f64; 3] = (-(force.transpose() * bare)).into();
        row[TURN..TURN + 3].copy_from_slice(&by);
        row
    })
}
