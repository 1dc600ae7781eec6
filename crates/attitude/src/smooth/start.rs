//! Samples -> attitudes at the nodes to begin with. Pure.
//!
//! A stage of its own because the equations are solved from wherever this leaves them: the vertical of the first
//! seconds of each section, then a complementary filter. Heading begins where the section before ended.

use super::pass::by_segment;
use super::prepared::Prepared;
use super::sample::Samples;
use super::segments::Segment;
use super::settings::Settings;
use super::survey::Survey;
use super::sweep::GRAVITY;
use crate::quaternion::kernel::{normalised, product, rows, turned, turned_in_navigation};
use nalgebra::{Matrix3, Vector3};

/// The mean force over this tells the vertical where a section begins, s.
const LEVELLED_BY: f64 = 2.0;
/// Time constants of the low pass of the force, s, and rate of levelling by it, 1/s.
const LOW_PASS: f64 = 3.0;
const LEVELLING: f64 = 0.3;

/// Attitudes at all nodes by a forward pass with the gyro's bias.
pub(super) fn forward<S: Samples>(
    samples: &mut S,
    with: (&Survey, &Settings),
    segments: &[Segment],
    bias: &Vector3<f64>,
) -> Result<Vec<[f64; 4]>, S::Error> {
    let mut forward = Forward {
        bias: *bias,
        wanted: ((LEVELLED_BY / with.0.interval.max(1e-9)) as usize).clamp(1, 1 << 20),
        q: [1.0, 0.0, 0.0, 0.0],
        force: Vector3::z() * GRAVITY,
        waiting: Vec::new(),
        ends: Vec::new(),
        is_level: false,
        is_first: true,
        nodes: Vec::with_capacity(segments.len() + 1),
    };
    by_segment(samples, with, segments, |k, held| {
        forward.take(k.is_none_or(|k| segments[k].is_break), held);
    })?;
    forward.level();
    forward.go_on();
    let mut nodes = forward.nodes;
    let last = nodes.last().copied().unwrap_or([1.0, 0.0, 0.0, 0.0]);
    nodes.resize(segments.len() + 1, last);
    Ok(nodes)
}

struct Forward {
    bias: Vector3<f64>,
    wanted: usize,
    q: [f64; 4],
    force: Vector3<f64>,
    /// Samples of this section that wait until the vertical is known, and which of them are nodes.
    waiting: Vec<Prepared>,
    ends: Vec<usize>,
    is_level: bool,
    is_first: bool,
    nodes: Vec<[f64; 4]>,
}

impl Forward {
    fn take(&mut self, is_new_section: bool, held: &[Prepared]) {
        if is_new_section {
            self.level();
            self.go_on();
            self.is_level = false;
            self.is_first = true;
        }
        self.waiting.extend_from_slice(held);
        self.ends.push(self.waiting.len());
        if self.waiting.len() >= self.wanted {
            self.level();
        }
        if self.is_level {
            self.go_on();
        }
    }

    /// The vertical by the samples that wait.
    fn level(&mut self) {
        if self.is_level || self.waiting.is_empty() {
            return;
        }
        let mut q = [1.0, 0.0, 0.0, 0.0];
        let mut sum = Vector3::zeros();
        for (i, sample) in self.waiting.iter().take(self.wanted).enumerate() {
            if i > 0 {
                q = turned(&q, &((sample.rate - self.bias) * sample.secs));
            }
            sum += matrix(&q) * sample.force;
        }
        let upright = shortest_to_up(&(matrix(&self.q) * sum));
        self.q = product(&upright, &self.q);
        self.force = Vector3::z() * GRAVITY;
        self.is_level = true;
    }

    fn go_on(&mut self) {
        let mut ends = self.ends.iter().copied().peekable();
        for (i, sample) in self.waiting.iter().enumerate() {
            let secs = if std::mem::take(&mut self.is_first) {
                0.0
            } else {
                sample.secs
            };
            self.q = turned(&self.q, &((sample.rate - self.bias) * secs));
            self.force += (matrix(&self.q) * sample.force - self.force) * (secs / LOW_PASS);
            let share = LEVELLING * secs / self.force.norm().max(1e-3);
            let up = Vector3::new(self.force.y, -self.force.x, 0.0) * share;
            self.q = normalised(&turned_in_navigation(&up, &self.q));
            if ends.next_if_eq(&(i + 1)).is_some() {
                self.nodes.push(self.q);
            }
        }
        self.waiting.clear();
        self.ends.clear();
    }
}

pub(super) fn matrix(q: &[f64; 4]) -> Matrix3<f64> {
    let r = rows(q);
    Matrix3::from_fn(|i, j| r[i][j])
}

/// The shortest rotation that takes a direction up; half a turn about x for down.
fn shortest_to_up(direction: &Vector3<f64>) -> [f64; 4] {
    let norm = direction.norm();
    if norm.is_nan() || norm < 1e-9 {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let z = direction / norm;
    let q = [1.0 + z.z, z.y, -z.x, 0.0];
    let size = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]).sqrt();
    if size > 1e-6 {
        q.map(|c| c / size)
    } else {
        [0.0, 1.0, 0.0, 0.0]
    }
}
