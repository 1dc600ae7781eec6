//! Quaternions that know their frames, rotation vectors, exp and log. Pure.

use nalgebra::Vector3;
use std::marker::PhantomData;

/// A unit quaternion with the book's subscripts: `Quaternion<Nav, Body>` is q_nb, takes body
/// components to navigation components. Hamilton product, scalar first in every signature.
#[derive(Debug)]
pub struct Quaternion<To, From> {
    wxyz: [f64; 4],
    frames: PhantomData<(To, From)>,
}

impl<To, From> Clone for Quaternion<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Quaternion<To, From> {}
impl<To, From> PartialEq for Quaternion<To, From> {
    fn eq(&self, other: &Self) -> bool {
        self.wxyz == other.wxyz
    }
}

impl<To, From> Quaternion<To, From> {
    /// No rotation: both frames coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self::assume_unit([1.0, 0.0, 0.0, 0.0])
    }
    /// A human says: these four numbers `[w, x, y, z]` have unit norm and take `From` to `To`.
    #[must_use]
    pub fn assume_unit(wxyz: [f64; 4]) -> Self {
        Quaternion {
            wxyz,
            frames: PhantomData,
        }
    }
    /// `[w, x, y, z]`.
    #[must_use]
    pub fn wxyz(&self) -> [f64; 4] {
        self.wxyz
    }
}

/// A rotation vector (Bortz): axis times angle in rad, resolved in body axes; coning included.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RotationVector(pub Vector3<f64>);
