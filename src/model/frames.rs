//! Direction cosine matrices and vectors that know their frames. Pure.

use nalgebra::{Matrix3, Vector3};
use std::marker::PhantomData;

/// A frame of reference: a type with no values, used only as a subscript.
pub trait Frame: Copy + 'static {
    /// The short name used in messages.
    const NAME: &'static str;
}

/// The navigation ("world") frame attitude is given in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Nav {}
/// The body frame: the vehicle's axes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Body {}
/// The sensor's own axes, before mounting.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sensor {}

impl Frame for Nav {
    const NAME: &'static str = "n";
}
impl Frame for Body {
    const NAME: &'static str = "b";
}
impl Frame for Sensor {
    const NAME: &'static str = "s";
}

/// A vector resolved in the axes of `F`.
pub struct In<F> {
    v: Vector3<f64>,
    frame: PhantomData<F>,
}

/// A direction cosine matrix C with the book's subscripts: `Dcm<Nav, Body>` is C_nb.
pub struct Dcm<To, From> {
    m: Matrix3<f64>,
    frames: PhantomData<(To, From)>,
}

/// Attitude: the rotation that takes vectors from body axes to navigation axes, C_nb.
pub type Attitude = Dcm<Nav, Body>;

impl<F> In<F> {
    /// A human says: these components are resolved in `F`.
    #[must_use]
    pub fn assume(v: Vector3<f64>) -> Self {
        In {
            v,
            frame: PhantomData,
        }
    }
    /// The bare components, for kernels.
    #[must_use]
    pub fn as_vector(&self) -> &Vector3<f64> {
        &self.v
    }
}

impl<To, From> Dcm<To, From> {
    /// A human says: this matrix takes `From` to `To`.
    #[must_use]
    pub fn assume(m: Matrix3<f64>) -> Self {
        Dcm {
            m,
            frames: PhantomData,
        }
    }
    /// The bare matrix, for kernels.
    #[must_use]
    pub fn as_matrix(&self) -> &Matrix3<f64> {
        &self.m
    }
}
