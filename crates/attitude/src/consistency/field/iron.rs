//! Segments -> hard and soft iron, one linear solve about the recorded axes. Pure.
//!
//! Apart from the maps because it is asked only where those agree. An ellipsoid through the fields leaves the rotation of
//! its matrix open; that the field stands still in the frame of the gyro closes it, and needs no full sphere.

use super::maps::{self, Judged};
use super::{FieldSegment, UNKNOWNS, normalised};
use crate::median::median;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Priors: entries of the matrix less the identity, and hard iron by the field.
const SIGMA_MATRIX: f64 = 0.3;
const SIGMA_IRON: f64 = 1.0;
/// Independent rows of a segment by its weight: half of six, since segments overlap.
const ROWS: f64 = 3.0;
/// Least scatter, as a square share of the field.
const FLOOR: f64 = 1e-6;
/// Rounds in which segments are weighted anew.
const ROUNDS: usize = 8;
const LEAST_SEGMENTS: usize = 8;
/// Largest sigma of an entry, and of hard iron by the field, that counts as observed.
const OBSERVED_MATRIX: f64 = 0.02;
const OBSERVED_IRON: f64 = 0.03;
/// Soft iron shows from this on, from so many sigmas, and where the scatter falls to this share.
const SHOWS: f64 = 0.03;
const SHOWS_SIGMAS: f64 = 5.0;
const FALLS_TO: f64 = 0.33;
/// Largest scatter that is left of the field of a room; beyond, what is there belongs to places, not to the sensor.
const LARGEST_LEFT: f64 = 0.02;
/// Least singular value of a matrix that iron can make, and the largest.
const PLAUSIBLE: std::ops::Range<f64> = 0.5..2.0;

/// Iron that turns with a magnetometer: `field = matrix (measured - offset)`, in the axes that were given.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FieldIron {
    /// Soft iron undone, of trace 3.
    pub matrix: Matrix3<f64>,
    /// One standard deviation of each entry.
    pub matrix_sigma: Matrix3<f64>,
    /// Hard iron, in the field's unit.
    pub offset: Vector3<f64>,
    /// One standard deviation of it.
    pub offset_sigma: Vector3<f64>,
    /// Median length of the field as measured.
    pub length: f64,
    /// Scatter of the field in the integrated frame, as a share of it, with a hard iron alone and with both.
    pub scatter: [f64; 2],
    /// Scatter as recorded, without any.
    pub scatter_recorded: f64,
    /// Angle of the field above the horizon, rad, where gravity was seen.
    pub elevation: Option<f64>,
    /// Segments of four seconds that it comes from.
    pub segments: usize,
}

impl FieldIron {
    /// Whether the motion shows all of it.
    #[must_use]
    pub fn is_observed(&self) -> bool {
        self.matrix_sigma.max() <= OBSERVED_MATRIX
            && self.offset_sigma.max() <= OBSERVED_IRON * self.length
    }

    /// Whether soft iron shows beyond what is left of it in a calibrated sensor.
    #[must_use]
    pub fn has_soft_iron(&self) -> bool {
        let off = (self.matrix - Matrix3::identity()).abs();
        let mut entries = off.iter().zip(&self.matrix_sigma);
        self.is_observed()
            && self.scatter[1] <= FALLS_TO * self.scatter[0]
            && self.scatter[1] <= LARGEST_LEFT
            && entries.any(|(off, sigma)| *off >= SHOWS.max(SHOWS_SIGMAS * sigma))
    }

    /// Field without the iron.
    #[must_use]
    pub fn undone(&self, measured: &Vector3<f64>) -> Vector3<f64> {
        self.matrix * (measured - self.offset)
    }
}

/// Iron that the segments show about the axes that were given.
pub(super) fn found(kept: &[FieldSegment]) -> Option<FieldIron> {
    if kept.len() < LEAST_SEGMENTS || maps::disagreement(kept).is_some() {
        return None;
    }
    let (segments, unit) = normalised(kept)?;
    let hard = maps::judged(&segments, &Matrix3::identity());
    let (both, covariance) = solved(&segments, &hard)?;
    let matrix = Matrix3::from_fn(|i, j| both.unknowns[3 * i + j]);
    let singular = matrix.singular_values();
    let inverse = matrix.try_inverse()?;
    if !singular.iter().all(|value| PLAUSIBLE.contains(value)) || matrix.determinant() < 0.0 {
        return None;
    }
    let offset = offset_of(&both.unknowns)?;
    // d offset = D^-1 (dh - dD offset).
    let mut by = SMatrix::<f64, 3, UNKNOWNS>::zeros();
    for b in 0..3 {
        for k in 0..3 {
            by.set_column(3 * b + k, &(-inverse.column(b) * offset[k]));
        }
        by.set_column(9 + b, &inverse.column(b).into_owned());
    }
    let of_offset = by * covariance * by.transpose();
    // Iron is the same at any time; what a place does to the field is not, and its residual hides that.
    let (early, late) = segments.split_at(segments.len() / 2);
    let [early, late] = [early, late].map(|part| {
        let (found, _) = solved(part, &maps::judged(part, &Matrix3::identity()))?;
        let matrix = Matrix3::from_fn(|i, j| found.unknowns[3 * i + j]);
        Some((matrix, offset_of(&found.unknowns)?))
    });
    let ((early, early_offset), (late, late_offset)) = (early?, late?);
    let matrix_apart = (early - late).abs() * 0.5;
    let offset_apart = (early_offset - late_offset).abs() * 0.5;
    let root = |variance: f64| variance.max(0.0).sqrt();
    let mut none = SVector::<f64, UNKNOWNS>::zeros();
    [0, 4, 8].into_iter().for_each(|i| none[i] = 1.0);
    let mut recorded: Vec<f64> = segments
        .iter()
        .map(|s| none.dot(&(s.gram * none)))
        .collect();
    Some(FieldIron {
        matrix,
        matrix_sigma: Matrix3::from_fn(|i, j| {
            root(covariance[(3 * i + j, 3 * i + j)]).max(matrix_apart[(i, j)])
        }),
        offset: offset * unit,
        offset_sigma: of_offset.diagonal().map(root).sup(&offset_apart) * unit,
        length: unit,
        scatter: [hard.scatter(), both.scatter()],
        scatter_recorded: root(median(&mut recorded)),
        elevation: maps::elevation(&segments, &both.unknowns),
        segments: segments.len(),
    })
}

/// Hard iron as measured, in units of the field: `D^-1 h`.
fn offset_of(unknowns: &SVector<f64, UNKNOWNS>) -> Option<Vector3<f64>> {
    let matrix = Matrix3::from_fn(|i, j| unknowns[3 * i + j]);
    let inverse = matrix.try_inverse()?;
    Some(inverse * Vector3::new(unknowns[9], unknowns[10], unknowns[11]))
}

/// Matrix of trace 3 and hard iron that leave least, with their covariance.
fn solved(
    segments: &[FieldSegment],
    start: &Judged,
) -> Option<(Judged, SMatrix<f64, UNKNOWNS, UNKNOWNS>)> {
    let mut trace = SVector::<f64, UNKNOWNS>::zeros();
    [0, 4, 8].into_iter().for_each(|i| trace[i] = 1.0);
    let prior = SVector::<f64, UNKNOWNS>::from_fn(|i, _| match i {
        0..9 => SIGMA_MATRIX.powi(-2),
        _ => SIGMA_IRON.powi(-2),
    });
    let about = trace.component_mul(&prior);
    let mut unknowns = start.unknowns;
    let mut costs = start.costs.clone();
    let mut covariance = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
    for _ in 0..ROUNDS {
        let usual = median(&mut costs.clone()).max(FLOOR);
        let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::from_diagonal(&prior);
        for (segment, cost) in segments.iter().zip(&costs) {
            normal += segment.gram * (2.0 * ROWS / (cost + usual));
        }
        let inverse = normal.try_inverse()?;
        let toward = inverse * trace;
        let free = inverse * about;
        let lever = trace.dot(&toward);
        unknowns = free + toward * ((3.0 - trace.dot(&free)) / lever);
        covariance = inverse - toward * toward.transpose() / lever;
        let cost = |segment: &FieldSegment| unknowns.dot(&(segment.gram * unknowns)).max(0.0);
        costs = segments.iter().map(cost).collect();
    }
    let is_sound = unknowns.iter().all(|number| number.is_finite());
    is_sound.then_some((Judged { unknowns, costs }, covariance))
}
