//! The document's heavy symmetric top, by Taylor series in double-double: rates and delta angles a perfect
//! gyro would give, and the attitude they must lead to.

use super::double::Double;

const ORDER: usize = 20;
const SPIN: f64 = 125.663_706_143_591_72;

pub struct Top {
    /// q_nb `[w, x, y, z]` at every step.
    pub q: Vec<[f64; 4]>,
    /// Body rate, rad/s.
    pub w: Vec<[f64; 3]>,
    /// Integral of the body rate from the start, rad.
    pub angle: Vec<[Double; 3]>,
}

type Series = [Double; ORDER + 1];

fn product(a: &Series, b: &Series, k: usize) -> Double {
    (0..=k).fold(Double::ZERO, |sum, i| sum + a[i] * b[k - i])
}

fn at(series: &Series, h: Double) -> Double {
    series
        .iter()
        .rev()
        .fold(Double::ZERO, |sum, c| sum * h + *c)
}

/// The cusped case of docs/top.md: released with no precession at a tilt of 54.57 degrees about +x.
/// One step every 1/`rate` s; Taylor's series of 20 terms leaves 1e-26 per step at 500 Hz.
pub fn cusped(rate: usize, steps: usize) -> Top {
    let d = Double::from;
    let inertia = d(0.002);
    let difference = (inertia - d(0.0008)) * d(SPIN) / inertia;
    let pull = d(9.8) * d(0.04) / inertia;
    let half = 0.5 * 54.57_f64.to_radians();
    let (c, s) = (d(half.cos()), d(half.sin()));
    let norm = (c * c + s * s).sqrt();
    let (c, s) = (c / norm, s / norm);
    let mut q = [c, s, Double::ZERO, Double::ZERO];
    let mut w = [Double::ZERO; 2];
    // The vertical, seen from the body.
    let two = d(2.0);
    let mut up = [Double::ZERO, two * s * c, d(1.0) - two * s * s];
    let mut angle = [Double::ZERO; 3];
    let h = d(1.0) / d(rate as f64);
    let mut top = Top {
        q: vec![],
        w: vec![],
        angle: vec![],
    };
    for step in 0..=steps {
        top.q.push(q.map(Double::value));
        top.w.push([w[0].value(), w[1].value(), SPIN]);
        top.angle.push(angle);
        if step == steps {
            break;
        }
        let zero: Series = [Double::ZERO; ORDER + 1];
        let (mut ws, mut us, mut qs) = ([zero; 2], [zero; 3], [zero; 4]);
        for (series, value) in ws.iter_mut().zip(w) {
            series[0] = value;
        }
        for (series, value) in us.iter_mut().zip(up) {
            series[0] = value;
        }
        for (series, value) in qs.iter_mut().zip(q) {
            series[0] = value;
        }
        let spin = d(SPIN);
        for k in 0..ORDER {
            let n = d((k + 1) as f64);
            ws[0][k + 1] = (difference * ws[1][k] + pull * us[1][k]) / n;
            ws[1][k + 1] = -(difference * ws[0][k] + pull * us[0][k]) / n;
            us[0][k + 1] = (us[1][k] * spin - product(&us[2], &ws[1], k)) / n;
            us[1][k + 1] = (product(&us[2], &ws[0], k) - us[0][k] * spin) / n;
            us[2][k + 1] = (product(&us[0], &ws[1], k) - product(&us[1], &ws[0], k)) / n;
            let n = n + n;
            let [x, y] = &ws;
            let [qw, qx, qy, qz] = &qs;
            let next = [
                -(product(qx, x, k) + product(qy, y, k) + qz[k] * spin) / n,
                (product(qw, x, k) + qy[k] * spin - product(qz, y, k)) / n,
                (product(qw, y, k) + product(qz, x, k) - qx[k] * spin) / n,
                (qw[k] * spin + product(qx, y, k) - product(qy, x, k)) / n,
            ];
            for (series, value) in qs.iter_mut().zip(next) {
                series[k + 1] = value;
            }
        }
        for axis in 0..2 {
            let integral = (0..=ORDER).rev().fold(Double::ZERO, |sum, k| {
                (sum * h) + ws[axis][k] / d((k + 1) as f64)
            });
            angle[axis] = angle[axis] + integral * h;
        }
        angle[2] = angle[2] + spin * h;
        w = [at(&ws[0], h), at(&ws[1], h)];
        up = [at(&us[0], h), at(&us[1], h), at(&us[2], h)];
        q = [at(&qs[0], h), at(&qs[1], h), at(&qs[2], h), at(&qs[3], h)];
    }
    top
}
