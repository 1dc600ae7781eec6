//! Bodies that move, and what a sensor on them would read. Pure: no I/O, no clock, no randomness but a passed seed.
//!
//! | module | arrow |
//! |---|---|
//! | [`inertia`] | bodies -> 6x6 inertia, from centre of gravity to any point |
//! | [`rigid_body`] | inertia, torque, initial state -> motion |
//! | [`top`] | the symmetric top: exact, and ways to integrate it compared |
//! | [`dh`] | Denavit-Hartenberg rows -> poses |
//! | [`youbot`] | the KUKA youBot's arm: kinematics, dynamics, paths |
//! | [`motion`] | motions with exact truth at any instant |
//! | [`field`] | a time -> the magnetic field |
//! | [`synthetic`] | a motion and a sensor's errors -> samples, and the truth beside them |

#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod dh;
mod double_double;
mod elliptic;
pub mod field;
mod gauss;
pub mod inertia;
mod kinematics;
pub mod motion;
mod motion_error;
mod rest_to_rest;
pub mod rigid_body;
#[cfg(feature = "random")]
pub mod synthetic;
pub mod top;
pub mod youbot;
