//! Corrections of all unknowns -> the state that they lead to. Pure.
//!
//! Apart from the iterations because a step may be too long: for what is linear, and for what it was to cost.

use super::super::border;
use super::super::factors::{BIAS, HEADING, Node, POSITION, STATES, VELOCITY};
use super::super::motion::Bound;
use super::super::solver::Solution;
use super::State;
use crate::quaternion::kernel::{normalised, turned_in_navigation};
use nalgebra::{Rotation3, Vector3};

/// Largest turn of a node in one iteration, rad.
const LARGEST_TURN: f64 = 0.5;
/// Share for which a turn of the heading counts of a body that leans: its path turns along, and what is left to first
/// order is little.
const HEADING_SHARE: f64 = 0.1;
/// A cost may rise by so much in a step, since the bound is learned anew; a step is shortened to no less than this
/// share.
const ROUGH: f64 = 300.0;
const SHORTEST: f64 = 0.1;

/// A step that may have been too long.
pub(super) struct Step {
    pub(super) from: State,
    pub(super) solution: Solution,
    pub(super) share: f64,
    /// Cost where it began.
    pub(super) cost: f64,
}

impl Step {
    /// Whether it led to a higher cost, and may be shorter.
    pub(super) fn is_too_long(&self, cost: f64) -> bool {
        cost > self.cost + ROUGH && self.share > SHORTEST
    }

    /// Goes half as far from where it began.
    pub(super) fn shorten(&mut self, state: &mut State) {
        self.share *= 0.5;
        *state = self.from.clone();
        state.correct(&self.solution, self.share);
    }
}

impl State {
    /// Takes a share of the corrections, at most `most`; by how much each node was to turn, rad.
    pub(super) fn correct(&mut self, solution: &Solution, most: f64) -> Vec<[f64; 3]> {
        let turn = |x: &[f64; STATES]| std::array::from_fn(|axis| x[axis].abs());
        let turns: Vec<[f64; 3]> = solution.nodes.iter().map(turn).collect();
        let largest = largest_counted(&turns, &self.bound);
        let share = if largest < LARGEST_TURN {
            most
        } else {
            most * (LARGEST_TURN / largest)
        };
        let centre = border::vector(&self.constants, border::CENTRE);
        let moved = Vector3::from_fn(|i, _| share * solution.border[border::CENTRE + i]);
        let is_leaning = self.bound.is_leaning;
        for (node, x) in self.nodes.iter_mut().zip(&solution.nodes) {
            let part = |first: usize| Vector3::from_fn(|i, _| share * x[first + i]);
            node.bias += part(BIAS);
            let (turn, velocity, position) = (part(0), part(VELOCITY), part(POSITION));
            if is_leaning {
                node.turn_path((&centre, &moved), turn, (velocity, position));
            } else {
                node.q = normalised(&turned_in_navigation(&turn, &node.q));
                node.velocity += velocity;
                node.position += position;
            }
        }
        for (constant, x) in self.constants.iter_mut().zip(&solution.border) {
            *constant += share * x;
        }
        turns
    }
}

impl Node {
    /// Takes corrections whose part about the vertical turns the path along: a change of heading by radians is exact,
    /// where corrections to first order would stretch the path. The centre moves as well.
    fn turn_path(
        &mut self,
        (centre, moved): (&Vector3<f64>, &Vector3<f64>),
        turn: Vector3<f64>,
        (velocity, position): (Vector3<f64>, Vector3<f64>),
    ) {
        let heading = Vector3::z() * turn.z;
        let turned = Rotation3::from_scaled_axis(heading);
        let tilted = turned_in_navigation(&(turn - heading), &self.q);
        self.q = normalised(&turned_in_navigation(&heading, &tilted));
        self.velocity = turned * (self.velocity + velocity - heading.cross(&self.velocity));
        let off = self.position - centre;
        let off = turned * (off + position - moved - heading.cross(&off));
        self.position = centre + moved + off;
    }
}

/// The largest turn of a node by what it counts for, rad.
pub(super) fn largest_counted(turns: &[[f64; 3]], bound: &Bound) -> f64 {
    let share = match bound.is_leaning {
        true => HEADING_SHARE,
        false => 1.0,
    };
    let heading = turns.iter().map(|turn| share * turn[HEADING]);
    heading.fold(tilted(turns), f64::max)
}

/// The largest turn of a node about a horizontal axis, rad.
pub(super) fn tilted(turns: &[[f64; 3]]) -> f64 {
    let about = turns.iter().flat_map(|turn| [turn[0], turn[1]]);
    about.fold(0.0, f64::max)
}
