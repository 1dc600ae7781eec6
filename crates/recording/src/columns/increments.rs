//! Words of a name -> an increment of the turn or of the speed, or the step since the row before. Pure.
//!
//! Apart from the other names because what is derived from a measurement is none of the roles, and these are: sensors
//! that
//! integrate themselves (Xsens, Movella DOT) give nothing else, and loops of microcontrollers print the step alone.

use super::names::Kind;
use super::units::{Quantity, Unit};

/// Names that makers give to the quaternion of a turn, and to the change of the velocity that belongs to it, without
/// blanks.
const TURN: &[&str] = &["dq", "deltaq", "delq", "oriinc"];
const PUSH: &[&str] = &["dv", "deltav", "delv", "velinc"];
const STEP: &[&str] = &["dt", "deltat", "deltatime", "timedelta", "timestep"];

/// The kind and part of an increment: `dq_W`, `OriInc_q0`; `dv[1]`, `VelInc_X`.
pub(super) fn increment(all: &[String]) -> Option<(Kind, usize, String)> {
    let (last, stem) = all.split_last()?;
    let stem = stem.concat();
    let is = |known: &[&str]| known.contains(&stem.as_str());
    let place = |names: &[&str]| names.iter().position(|name| name == last);
    if is(TURN) {
        let part = place(&["w", "x", "y", "z"]).or_else(|| place(&["q0", "q1", "q2", "q3"]))?;
        return Some((Kind::Turn, part, stem));
    }
    if is(PUSH) {
        let part = place(&["x", "y", "z"]).or_else(|| place(&["1", "2", "3"]))?;
        return Some((Kind::Push, part, stem));
    }
    None
}

/// Whether these words name the step since the row before, and the unit that they say: `dt`, `dt_us`.
pub(super) fn step(all: &[String]) -> Option<Option<Unit>> {
    let is = |words: &[String]| STEP.contains(&words.concat().as_str());
    if is(all) {
        return Some(None);
    }
    let (last, stem) = all.split_last()?;
    let unit = Unit::of(Quantity::Time, last)?;
    is(stem).then_some(Some(unit))
}
