//! Rates known as power series -> attitude at any instant, exact to rounding for minutes. Pure.
//!
//! The reference everything else is judged by. Over one segment attitude, rate and integrated rate
//! are power series in time; the recurrences follow from `q_dot = q (0, w) / 2` and what makes the
//! rates. The state at the joints, and the low coefficients, carry 32 digits
//! ([`DoubleDouble`]), so that 10^5 joints add no error; the high coefficients are small and `f64`
//! serves them. Segments are cut where the series says its remainder is below 1e-21, never by the
//! instants asked for: the answer at t does not depend on what was asked before.
//!
//! # Source
//! Recurrences: Moore, Methods and Applications of Interval Analysis (1979), 3.4. Step from the last
//! two coefficients: Jorba, Zou, Experimental Mathematics 14 (2005) 99, section 3.2.

mod series;

use crate::double_double::DoubleDouble;
use nalgebra::{Matrix3, Vector3};
use series::{LOW, Number, ORDER, Series};
use strapd_attitude::quaternion::kernel as quat;

/// One sine of a body rate component: `amplitude sin(omega t + phase)`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Sine {
    /// rad/s
    pub(crate) amplitude: f64,
    /// rad/s
    pub(crate) omega: f64,
    /// rad
    pub(crate) phase: f64,
}

/// Source of the rates.
#[derive(Clone, Debug)]
pub(crate) enum Rates {
    /// Euler's equations in uniform gravity.
    Heavy(Box<Heavy>),
    /// Sums of sines about x, y, z.
    Sines([Vec<Sine>; 3]),
}

/// A rigid body about a fixed point in uniform gravity.
#[derive(Clone, Debug)]
pub(crate) struct Heavy {
    inertia: [[f64; 3]; 3],
    inverse: [[DoubleDouble; 3]; 3],
    /// Mass times the vector from the fixed point to the centre of gravity, kg m, body axes.
    moment: [f64; 3],
    gravity_n: [f64; 3],
}

impl Heavy {
    pub(crate) fn new(
        inertia: &Matrix3<f64>,
        moment: &Vector3<f64>,
        gravity_n: &Vector3<f64>,
    ) -> Self {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| inertia[(i, j)]));
        Self {
            inertia: rows,
            inverse: inverse(&rows),
            moment: [moment.x, moment.y, moment.z],
            gravity_n: [gravity_n.x, gravity_n.y, gravity_n.z],
        }
    }
}

/// Inverse by cofactors, in 32 digits: an inverse rounded to `f64` would be another body.
fn inverse(m: &[[f64; 3]; 3]) -> [[DoubleDouble; 3]; 3] {
    let e = |i: usize, j: usize| DoubleDouble::from(m[i % 3][j % 3]);
    let cofactor =
        |i: usize, j: usize| e(i + 1, j + 1) * e(i + 2, j + 2) - e(i + 1, j + 2) * e(i + 2, j + 1);
    let det = e(0, 0) * cofactor(0, 0) + e(0, 1) * cofactor(0, 1) + e(0, 2) * cofactor(0, 2);
    std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / det))
}

/// The state at a joint.
#[derive(Clone, Copy, Debug)]
struct State {
    t: DoubleDouble,
    q: [DoubleDouble; 4],
    w: [DoubleDouble; 3],
    theta: [DoubleDouble; 3],
}

/// One segment: the state it starts from, its series and its length.
#[derive(Clone, Debug)]
struct Segment {
    start: State,
    low: Box<Series<DoubleDouble>>,
    all: Box<Series<f64>>,
    length: f64,
}

impl Segment {
    /// Makes a segment in the memory of one that is no longer needed, if there is one: every coefficient
    /// that is read is written first, and which these are depends on the kind of rates alone.
    fn new(rates: &Rates, start: State, spent: Option<Segment>) -> Self {
        let (mut low, mut all) = match spent {
            Some(segment) => (segment.low, segment.all),
            None => (Box::new(Series::zero()), Box::new(Series::zero())),
        };
        for i in 0..4 {
            low.q[i][0] = start.q[i];
        }
        match rates {
            Rates::Heavy(body) => {
                for i in 0..3 {
                    low.w[i][0] = start.w[i];
                    low.gravity[i][0] = to_body(&start.q, &body.gravity_n, i);
                }
                let inertia = body.inertia.map(|row| row.map(DoubleDouble::from));
                let moment = body.moment.map(DoubleDouble::from);
                low.fill_momentum(0, &inertia);
                for k in 0..LOW {
                    low.extend_attitude(k);
                    low.extend_heavy(k, &inertia, &body.inverse, &moment);
                }
                all.copy_low(&low);
                let inverse = body.inverse.map(|row| row.map(DoubleDouble::to_f64));
                for k in LOW..ORDER {
                    all.extend_attitude(k);
                    all.extend_heavy(k, &body.inertia, &inverse, &body.moment);
                }
            }
            Rates::Sines(axes) => {
                for (i, sines) in axes.iter().enumerate() {
                    low.w[i] = sines_series(sines, start.t).map(DoubleDouble::from);
                }
                for k in 0..LOW {
                    low.extend_attitude(k);
                }
                all.copy_low(&low);
                for i in 0..3 {
                    for k in LOW + 1..=ORDER {
                        all.w[i][k] = low.w[i][k].to_f64();
                    }
                }
                for k in LOW..ORDER {
                    all.extend_attitude(k);
                }
            }
        }
        let length = all.converged_length();
        Self {
            start,
            low,
            all,
            length,
        }
    }

    fn end(&self) -> State {
        let h = DoubleDouble::from(self.length);
        let mut q = self.low.q;
        let values: [DoubleDouble; 4] = std::array::from_fn(|i| sum(&q[i], &self.all.q[i], h));
        let norm = values
            .iter()
            .fold(DoubleDouble::ZERO, |s, x| s + *x * *x)
            .sqrt();
        for (q, value) in q.iter_mut().zip(values) {
            q[0] = value / norm;
        }
        State {
            t: self.start.t + h,
            q: std::array::from_fn(|i| q[i][0]),
            w: std::array::from_fn(|i| sum(&self.low.w[i], &self.all.w[i], h)),
            theta: std::array::from_fn(|i| {
                self.start.theta[i] + integral(&self.low.w[i], &self.all.w[i], h)
            }),
        }
    }

    /// Attitude and rate `dt` seconds after the start.
    fn at(&self, dt: f64) -> ([f64; 4], Vector3<f64>) {
        // All seven side by side: one after the other they would wait for themselves.
        let (q, w) = (&self.all.q, &self.all.w);
        let mut sum = [0.0; 7];
        for k in (1..=ORDER).rev() {
            let c = [
                q[0][k], q[1][k], q[2][k], q[3][k], w[0][k], w[1][k], w[2][k],
            ];
            for (sum, c) in sum.iter_mut().zip(c) {
                *sum = *sum * dt + c;
            }
        }
        let first = self.low.q.iter().chain(&self.low.w).map(|c| c[0]);
        for (sum, first) in sum.iter_mut().zip(first) {
            *sum = (first + DoubleDouble::from(*sum * dt)).to_f64();
        }
        let [q0, q1, q2, q3, x, y, z] = sum;
        let (q, w) = ([q0, q1, q2, q3], [x, y, z]);
        (quat::normalised(&q), Vector3::from(w))
    }

    /// Integrated rate `dt` seconds after the start.
    fn theta(&self, dt: f64) -> [DoubleDouble; 3] {
        std::array::from_fn(|i| {
            let mut rest = 0.0;
            for k in (0..=ORDER).rev() {
                rest = rest * dt + self.all.w[i][k] / (k + 1) as f64;
            }
            self.start.theta[i] + DoubleDouble::from(rest * dt)
        })
    }
}

/// Coefficients of a sum of sines about `t`.
fn sines_series(sines: &[Sine], t: DoubleDouble) -> [f64; ORDER + 1] {
    let mut c = [0.0; ORDER + 1];
    for s in sines {
        let (sin, cos) = (t * s.omega + DoubleDouble::from(s.phase)).sin_cos();
        let derivatives = [sin, cos, -sin, -cos];
        let mut power = s.amplitude;
        for (k, c) in c.iter_mut().enumerate() {
            *c += power * derivatives[k % 4];
            power *= s.omega;
        }
    }
    let mut factorial = 1.0;
    for (k, c) in c.iter_mut().enumerate().skip(1) {
        factorial *= k as f64;
        *c /= factorial;
    }
    c
}

/// Component i of C_nb^T v.
fn to_body(q: &[DoubleDouble; 4], v: &[f64; 3], i: usize) -> DoubleDouble {
    let [w, x, y, z] = *q;
    let two = |a: DoubleDouble| a * 2.0;
    let columns = match i {
        0 => [
            w * w + x * x - y * y - z * z,
            two(x * y + w * z),
            two(x * z - w * y),
        ],
        1 => [
            two(x * y - w * z),
            w * w - x * x + y * y - z * z,
            two(y * z + w * x),
        ],
        _ => [
            two(x * z + w * y),
            two(y * z - w * x),
            w * w - x * x - y * y + z * z,
        ],
    };
    columns[0] * v[0] + columns[1] * v[1] + columns[2] * v[2]
}

fn high(all: &[f64; ORDER + 1], h: f64, weight: impl Fn(usize) -> f64) -> f64 {
    (LOW + 1..=ORDER)
        .rev()
        .fold(0.0, |s, k| s * h + all[k] * weight(k))
}

fn sum(low: &[DoubleDouble; ORDER + 1], all: &[f64; ORDER + 1], h: DoubleDouble) -> DoubleDouble {
    let start = DoubleDouble::from(high(all, h.to_f64(), |_| 1.0));
    (0..=LOW).rev().fold(start, |s, k| s * h + low[k])
}

fn integral(
    low: &[DoubleDouble; ORDER + 1],
    all: &[f64; ORDER + 1],
    h: DoubleDouble,
) -> DoubleDouble {
    let start = DoubleDouble::from(high(all, h.to_f64(), |k| 1.0 / (k + 1) as f64));
    h * (0..=LOW)
        .rev()
        .fold(start, |s, k| s * h + low[k].over((k + 1) as f64))
}

/// A motion from t = 0 on, evaluated anywhere. Forward is cheap; far backward starts again.
#[derive(Clone, Debug)]
pub(crate) struct Trajectory {
    rates: Rates,
    initial: State,
    /// The segment before, so that the interval that ends in this one is at hand.
    previous: Option<Segment>,
    current: Segment,
}

impl Trajectory {
    /// Makes it from attitude and (for [`Rates::Heavy`]) rate at t = 0.
    pub(crate) fn new(rates: Rates, q: &[f64; 4], w: &Vector3<f64>) -> Self {
        let q = q.map(DoubleDouble::from);
        let norm = q.iter().fold(DoubleDouble::ZERO, |s, x| s + *x * *x).sqrt();
        let initial = State {
            t: DoubleDouble::ZERO,
            q: q.map(|x| x / norm),
            w: [w.x, w.y, w.z].map(DoubleDouble::from),
            theta: [DoubleDouble::ZERO; 3],
        };
        let current = Segment::new(&rates, initial, None);
        Self {
            rates,
            initial,
            previous: None,
            current,
        }
    }

    /// The segment t lies in, and how far into it.
    fn segment(&mut self, t: DoubleDouble) -> (&Segment, f64) {
        let into = |s: &Segment| (t - s.start.t).to_f64();
        let mut dt = into(&self.current);
        if dt < 0.0 {
            if let Some(previous) = &self.previous
                && into(previous) >= 0.0
            {
                let dt = into(previous);
                return (self.previous.as_ref().unwrap_or(&self.current), dt);
            }
            self.current = Segment::new(&self.rates, self.initial, self.previous.take());
            dt = into(&self.current);
        }
        while dt >= self.current.length {
            let end = self.current.end();
            let next = Segment::new(&self.rates, end, self.previous.take());
            self.previous = Some(std::mem::replace(&mut self.current, next));
            dt = into(&self.current);
        }
        (&self.current, dt)
    }

    /// Attitude and rate at `t` seconds, `t >= 0`.
    pub(crate) fn at(&mut self, t: DoubleDouble) -> ([f64; 4], Vector3<f64>) {
        let (segment, dt) = self.segment(t);
        segment.at(dt)
    }

    /// Integral of the rate from `from` to `to`, rad.
    pub(crate) fn delta_angle(&mut self, from: DoubleDouble, to: DoubleDouble) -> Vector3<f64> {
        let (segment, dt) = self.segment(from);
        let a = segment.theta(dt);
        let (segment, dt) = self.segment(to);
        let b = segment.theta(dt);
        Vector3::from_fn(|i, _| (b[i] - a[i]).to_f64())
    }
}
