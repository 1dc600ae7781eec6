//! Two tracks of attitudes -> pairs at the instants of the first. Pure.
//!
//! Apart from the fit because it alone knows of order, gaps and rows that are no attitude.

use super::about_vertical;
use crate::compare::Stamped;
use crate::compare::matching::Track;
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::{AttitudeCovariance, Nanos};
use nalgebra::{Matrix3, Vector3};

/// Attitudes of one body.
#[derive(Clone, Copy, Debug)]
pub struct Segment<'a> {
    /// Attitudes; any order.
    pub rows: &'a [Stamped],
    /// Covariances of their errors in body axes, one a row; empty where they are not stated.
    pub covariances: &'a [AttitudeCovariance],
}

/// Covariances of both attitudes of a pair, each in its own body's axes, rad^2.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Covariances {
    first: Matrix3<f64>,
    second: Matrix3<f64>,
}

impl Covariances {
    /// Covariance of the relative attitude in axes of the first body. The two errors are taken as independent.
    pub(super) fn in_first(&self, q_ab: &Quaternion<Body, Body>) -> Matrix3<f64> {
        let c = *q_ab.to_dcm().as_matrix();
        self.first + c * self.second * c.transpose()
    }
}

/// Attitudes of both bodies at one instant, each in its own world.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Pair {
    pub(super) stamp: Nanos,
    pub(super) first: Quaternion<Nav, Body>,
    pub(super) second: Quaternion<Nav, Body>,
    pub(super) covariances: Option<Covariances>,
}

impl Pair {
    /// Axes of the second body to axes of the first, the world of the second turned by `offset` about the vertical.
    pub(super) fn relative(&self, offset: f64) -> Quaternion<Body, Body> {
        self.first.inverse() * about_vertical(offset) * self.second
    }

    /// Up, in axes of the first body.
    pub(super) fn vertical_in_first(&self) -> Vector3<f64> {
        let c = *self.first.to_dcm().as_matrix();
        c.row(2).transpose()
    }

    /// Heading of the second body less that of the first, rad: the part about the vertical of the rotation from the
    /// first attitude to the second.
    pub(super) fn heading_difference(&self) -> f64 {
        let [w, _, _, z] = (self.second * self.first.inverse()).wxyz();
        2.0 * z.atan2(w)
    }
}

/// Pairs, and what found no partner.
#[derive(Debug)]
pub(super) struct Pairs {
    pub(super) pairs: Vec<Pair>,
    pub(super) unmatched: usize,
    pub(super) bad: usize,
}

/// Rows in order of time that are attitudes, with their covariances in the same order.
struct Ordered {
    rows: Vec<Stamped>,
    covariances: Vec<Matrix3<f64>>,
    bad: usize,
}

impl Ordered {
    fn of(segment: Segment<'_>) -> Ordered {
        let is_attitude =
            |q: &Quaternion<Nav, Body>| Quaternion::<Nav, Body>::try_from_wxyz(q.wxyz()).is_ok();
        let mut places: Vec<usize> = segment
            .rows
            .iter()
            .enumerate()
            .filter(|(_, (_, q))| is_attitude(q))
            .map(|(place, _)| place)
            .collect();
        let row = |place: &usize| segment.rows.get(*place).copied();
        // Stable: equal stamps stay in their order.
        places.sort_by_key(|place| row(place).map(|(stamp, _)| stamp));
        let covariance = |place: &usize| {
            segment
                .covariances
                .get(*place)
                .map(AttitudeCovariance::matrix)
        };
        Ordered {
            rows: places.iter().filter_map(row).collect(),
            covariances: places.iter().filter_map(covariance).collect(),
            bad: segment.rows.len() - places.len(),
        }
    }

    fn covariance(&self, place: usize) -> Option<Matrix3<f64>> {
        let is_stated = self.covariances.len() == self.rows.len();
        self.covariances.get(place).filter(|_| is_stated).copied()
    }
}

/// Finds the attitude of the second body at every instant of the first.
pub(super) fn pairs(first: Segment<'_>, second: Segment<'_>) -> Pairs {
    let (first, second) = (Ordered::of(first), Ordered::of(second));
    let track = Track::new(&second.rows);
    let (mut pairs, mut unmatched) = (Vec::with_capacity(first.rows.len()), 0);
    let mut after = 0;
    for (place, (stamp, q)) in first.rows.iter().enumerate() {
        while second.rows.get(after).is_some_and(|(t, _)| t <= stamp) {
            after += 1;
        }
        let Ok(partner) = track.at(*stamp, after) else {
            unmatched += 1;
            continue;
        };
        let covariances = first
            .covariance(place)
            .zip(second.covariance(after.saturating_sub(1)));
        pairs.push(Pair {
            stamp: *stamp,
            first: q.normalised(),
            second: partner,
            covariances: covariances.map(|(first, second)| Covariances { first, second }),
        });
    }
    Pairs {
        pairs,
        unmatched,
        bad: first.bad + second.bad,
    }
}
