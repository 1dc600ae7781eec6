//! Mean fields of segments -> north of each section, and how far each segment's field is believed. Pure.
//!
//! A stage of its own because without a field heading is anything, and equations solved from a wrong half turn stay
//! there.

use super::border::{self, Constants};
use super::factors::Node;
use super::segments::Segment;
use super::settings::HeadingReference;
use crate::median::median;
use crate::quaternion::kernel::product;
use nalgebra::{Rotation3, Vector3};

/// One sigma of a field over a second, uT: at rest, while moving. Errors while moving last over many nodes.
const SIGMA: [f64; 2] = [0.3, 10.0];
/// Residuals as large as this are believed half as much, at rest and while moving, uT.
const ROBUST: [f64; 2] = [6.0, 8.0];
/// Factor of the limit at first.
const ROBUST_AT_FIRST: f64 = 16.0;

/// Trust in the field, by segment.
pub(super) struct FieldTrust {
    reference: HeadingReference,
    spacing: f64,
}

impl FieldTrust {
    pub(super) fn new(reference: HeadingReference, spacing: f64) -> FieldTrust {
        FieldTrust { reference, spacing }
    }

    fn kind(&self, segment: &Segment) -> usize {
        match self.reference {
            HeadingReference::Standstill if segment.is_still => 0,
            _ => 1,
        }
    }

    /// Trust before any residual is known.
    pub(super) fn first(&self, segments: &[Segment]) -> Vec<f64> {
        segments
            .iter()
            .map(|segment| self.spacing / SIGMA[self.kind(segment)].powi(2))
            .collect()
    }

    /// Trust after iteration `i` left these squares of residuals, uT^2 (Geman and McClure 1987).
    pub(super) fn after(
        &self,
        iteration: usize,
        residuals: &[f64],
        segments: &[Segment],
    ) -> Vec<f64> {
        let wide = (ROBUST_AT_FIRST / 2_f64.powi(iteration.min(60) as i32)).max(1.0);
        let first = self.first(segments);
        let each = first.iter().zip(residuals).zip(segments);
        each.map(|((first, square), segment)| {
            let scale = ROBUST[self.kind(segment)] * wide;
            first / (1.0 + square / (scale * scale)).powi(2)
        })
        .collect()
    }
}

/// Sections: nodes between breaks, `(first, last)`.
pub(super) fn sections(segments: &[Segment]) -> Vec<(usize, usize)> {
    let mut sections = Vec::new();
    let mut first = 0;
    for (k, segment) in segments.iter().enumerate() {
        if segment.is_break {
            sections.push((first, k));
            first = k + 1;
        }
    }
    sections.push((first, segments.len()));
    sections
}

/// Turns each section about the vertical so that its field points north. Which sections have a field.
pub(super) fn turn_north(
    segments: &[Segment],
    fields: &[Option<[f64; 3]>],
    weights: &[f64],
    nodes: &mut [Node],
    constants: &mut Constants,
) -> Vec<bool> {
    let mut is_first = true;
    sections(segments)
        .into_iter()
        .map(|(first, last)| {
            let found: Vec<(Vector3<f64>, f64)> = (first..last)
                .filter_map(|k| fields[k].map(|field| (Vector3::from(field), weights[k])))
                .collect();
            let Some(mean) = robust_mean(&found) else {
                return false;
            };
            let angle = mean.x.atan2(mean.y);
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
            let (sin, cos) = (0.5 * angle).sin_cos();
            for node in &mut nodes[first..=last] {
                node.q = product(&[cos, 0.0, 0.0, sin], &node.q);
                node.velocity = turn * node.velocity;
                node.position = turn * node.position;
            }
            if is_first {
                let centre = turn * border::vector(constants, border::CENTRE);
                constants[border::CENTRE..border::IRON].copy_from_slice(centre.as_slice());
                constants[border::NORTH] = mean.x.hypot(mean.y);
                constants[border::NORTH + 1] = mean.z;
                is_first = false;
            }
            true
        })
        .collect()
}

/// A mean that half of the values cannot carry away.
fn robust_mean(found: &[(Vector3<f64>, f64)]) -> Option<Vector3<f64>> {
    if found.is_empty() {
        return None;
    }
    let mut mean = Vector3::from_fn(|axis, _| {
        let mut values: Vec<f64> = found.iter().map(|(field, _)| field[axis]).collect();
        median(&mut values)
    });
    let mut weights: Vec<f64> = found.iter().map(|(_, weight)| *weight).collect();
    for _ in 0..20 {
        let sum: Vector3<f64> = found
            .iter()
            .zip(&weights)
            .map(|((field, _), weight)| field * *weight)
            .sum();
        mean = sum / weights.iter().sum::<f64>();
        let squares: Vec<f64> = found
            .iter()
            .map(|(field, _)| (field - mean).norm_squared())
            .collect();
        let scale = median(&mut squares.clone()).max(4.0);
        for ((weight, (_, first)), square) in weights.iter_mut().zip(found).zip(&squares) {
            *weight = first / (1.0 + square / scale).powi(2);
        }
    }
    mean.iter().all(|m| m.is_finite()).then_some(mean)
}
