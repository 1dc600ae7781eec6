//! Nodes and constants -> better ones, iteration by iteration (Gauss and Newton). Pure.
//!
//! A stage of its own because it is run without the field, then with it, and what came before is kept in case a phase
//! ends nowhere.

use super::border::{self, Constants, Priors, WIDE};
use super::factors::{BIAS, Node, POSITION, STATES, VELOCITY};
use super::heading::{FieldTrust, sections};
use super::motion::Bound;
use super::pass::{Model, sweep_all};
use super::planar::Along;
use super::sample::Samples;
use super::segments::Segment;
use super::settings::Settings;
use super::solver::{Marginal, Solver};
use super::survey::Survey;
use super::sweep::GRAVITY;
use nalgebra::{Matrix3, Vector3};
use std::fmt;
use step::{Step, largest_counted, tilted};

mod step;

/// A heading that nothing tells is held to this, rad.
const HELD: f64 = 1e-4;
/// Sigmas of the first node, rad, m/s, m: only so that there is a solution.
const ANYWHERE: f64 = 1e6;
/// Done below this, rad, after so many iterations.
const DONE: f64 = 1e-6_f64.to_radians();
const FEWEST: usize = 4;
/// Turns above this that grow again and again lead nowhere, rad: smaller ones grow when weights change.
const DIVERGING: f64 = 0.1;
/// Times running: where the body rests somewhere, and where nothing holds its attitude.
const GROWING: [usize; 2] = [3, 2];
/// Most iterations without the field, in units of the setting; and of a body that leans and never rests, whose bound and
/// heading settle together.
const LONGEST: usize = 2;
const LEANING_LONGEST: usize = 4;
/// A result's last turn is below this, rad; while it is not, there are more iterations.
const SETTLED: f64 = 0.1_f64.to_radians();
/// And beside the sigma of its node.
const SETTLED_SHARE: f64 = 0.3;
/// Time over which a mean force points up, s.
const UPRIGHT_SECS: f64 = 10.0;

/// Part that does not change between iterations.
pub(super) struct Problem<'a> {
    pub(super) survey: &'a Survey,
    pub(super) settings: &'a Settings,
    pub(super) segments: &'a [Segment],
    pub(super) priors: &'a Priors,
    pub(super) trust: &'a FieldTrust,
    /// Prior of the gyro's bias, rad/s.
    pub(super) bias: Vector3<f64>,
    pub(super) bias_sigma: Vector3<f64>,
    /// The same along the axis that stays vertical, without the field.
    pub(super) along: Option<Along>,
}

/// State that the iterations improve.
#[derive(Clone)]
pub(super) struct State {
    pub(super) nodes: Vec<Node>,
    pub(super) constants: Constants,
    pub(super) bound: Bound,
    pub(super) field_weights: Vec<f64>,
    /// Sections whose heading the field tells.
    pub(super) has_north: Vec<bool>,
}

/// Why a phase led nowhere.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Failure {
    /// A number was none, or the equations had no solution.
    NotFinite,
    /// The largest turn of a node grew twice running; the last was this, rad.
    Diverging(f64),
    /// Rotation of the nodes in the last iteration, which was too large, rad.
    Unfinished(f64),
    /// The motion was taken to go this far, m, without a standstill anywhere.
    Strays(f64),
    /// The mean force is this far off the vertical, rad.
    NotUpright(f64),
    /// The accelerometer's bias was found to be this large, m/s^2.
    ForceBias(f64),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::NotFinite => write!(f, "the equations had no solution"),
            Failure::Diverging(turn) => {
                write!(f, "it diverged, by {:.1} deg in the end", turn.to_degrees())
            }
            Failure::Unfinished(turn) => {
                write!(
                    f,
                    "it still turned by {:.1} deg at the end",
                    turn.to_degrees()
                )
            }
            Failure::Strays(far) => write!(f, "the motion went {far:.0} m without a rest"),
            Failure::NotUpright(off) => {
                let off = off.to_degrees();
                write!(f, "the mean force was {off:.1} deg off the vertical")
            }
            Failure::ForceBias(bias) => {
                write!(f, "the accelerometer's bias came out as {bias:.2} m/s^2")
            }
        }
    }
}

impl<const W: usize> Phase<W> {
    /// The largest turn of the last iteration that was small neither by itself nor beside what is known of its node,
    /// rad: a heading that has wandered for an hour may turn by more than one that is held.
    pub(super) fn unsettled(&self, marginals: &[Marginal]) -> Option<f64> {
        let nodes = self.turns.iter().zip(marginals);
        let turns = nodes.flat_map(|(turns, marginal)| {
            turns.iter().enumerate().filter_map(|(axis, turn)| {
                let sigma = marginal.turn[(axis, axis)].max(0.0).sqrt();
                (*turn > SETTLED.max(SETTLED_SHARE * sigma)).then_some(*turn)
            })
        });
        turns.max_by(f64::total_cmp)
    }
}

/// End of a phase.
pub(super) struct Phase<const W: usize> {
    /// The equations of the last iteration.
    pub(super) solver: Option<Solver<W>>,
    pub(super) failure: Option<Failure>,
    pub(super) iterations: usize,
    /// Rotation of each node in the last iteration, earth axes, rad.
    turns: Vec<[f64; 3]>,
    /// Mean fields by segment, of the last iteration.
    pub(super) fields: Vec<Option<[f64; 3]>>,
    /// Twice the negative logarithm of the likelihood but for a constant.
    pub(super) cost: f64,
}

/// Iterates, with the field if the border is wide.
pub(super) fn run<S: Samples, const W: usize>(
    samples: &mut S,
    problem: &Problem<'_>,
    state: &mut State,
    most: usize,
) -> Result<Phase<W>, S::Error> {
    let mut phase = Phase {
        solver: None,
        failure: None,
        iterations: 0,
        turns: Vec::new(),
        fields: Vec::new(),
        cost: f64::NAN,
    };
    let (mut largest, mut growing) = (f64::INFINITY, 0);
    let mut before: Option<Step> = None;
    let is_guarded = state.bound.is_leaning && !problem.rests();
    // With the field, weights change to the end: more of it is not better.
    let longest = match W == WIDE {
        true => most,
        false if state.bound.is_leaning && !problem.rests() => LEANING_LONGEST * most,
        false => LONGEST * most,
    };
    for iteration in 0..longest {
        let reused = phase.solver.take();
        let equations = equations::<S, W>(samples, problem, state, reused)?;
        phase.iterations += 1;
        let too_long = before
            .as_mut()
            .filter(|step| iteration + 1 < longest && step.is_too_long(equations.cost));
        if let Some(step) = too_long {
            phase.solver = Some(equations.solver);
            step.shorten(state);
            let centre = border::vector(&state.constants, border::CENTRE);
            state.bound.learn(&state.nodes, &centre, problem.segments);
            continue;
        }
        phase.fields = equations.fields;
        phase.cost = equations.cost;
        let tilt = off_vertical(problem.segments, &equations.pushes);
        let solution = equations.solver.solve();
        phase.solver = Some(equations.solver);
        let Some(solution) = solution else {
            phase.failure = Some(Failure::NotFinite);
            return Ok(phase);
        };
        let from = is_guarded.then(|| state.clone());
        let turns = state.correct(&solution, 1.0);
        let turn = turns.iter().flatten().copied().fold(0.0, f64::max);
        let counted = largest_counted(&turns, &state.bound);
        if W == WIDE {
            state.field_weights =
                problem
                    .trust
                    .after(iteration, &equations.residuals, problem.segments);
        }
        let centre = border::vector(&state.constants, border::CENTRE);
        state.bound.learn(&state.nodes, &centre, problem.segments);
        // A heading's steps are guarded by what they cost.
        let guarded = if is_guarded { tilted(&turns) } else { counted };
        growing = if guarded > largest && guarded > DIVERGING {
            growing + 1
        } else {
            0
        };
        largest = guarded;
        phase.failure = problem.failure(state, counted, tilt);
        if growing >= GROWING[usize::from(!problem.rests())] {
            phase.failure = Some(Failure::Diverging(counted));
            return Ok(phase);
        }
        phase.turns = turns;
        before = from.map(|from| Step {
            from,
            solution,
            share: 1.0,
            cost: phase.cost,
        });
        let is_done = turn < DONE && iteration + 1 >= FEWEST;
        if is_done || (turn < SETTLED && iteration + 1 >= most) {
            break;
        }
    }
    Ok(phase)
}

impl Problem<'_> {
    /// Weights of the first node's bias beforehand, and about what it scatters.
    fn first_bias(&self, has_field: bool) -> (Matrix3<f64>, Vector3<f64>) {
        let weights = self.bias_sigma.map(|sigma| 1.0 / (sigma * sigma));
        let weights = Matrix3::from_diagonal(&weights);
        match &self.along {
            Some(along) if !has_field => along.put_in(&weights, &self.bias),
            _ => (weights, self.bias),
        }
    }

    fn rests(&self) -> bool {
        self.segments.iter().any(|segment| segment.is_still)
    }

    fn failure(&self, state: &State, turn: f64, tilt: f64) -> Option<Failure> {
        const FARTHEST: f64 = 100.0;
        const MOST_TILT: f64 = 5.0_f64.to_radians();
        const MOST_BIAS: f64 = 0.6;
        let bias = border::vector(&state.constants, border::FORCE_BIAS).norm();
        let [_, strays] = state.bound.sigma;
        if !turn.is_finite() {
            Some(Failure::NotFinite)
        } else if turn > DIVERGING {
            Some(Failure::Unfinished(turn))
        } else if strays > FARTHEST && !self.rests() {
            Some(Failure::Strays(strays))
        } else if tilt > MOST_TILT {
            Some(Failure::NotUpright(tilt))
        } else if bias > MOST_BIAS {
            Some(Failure::ForceBias(bias))
        } else {
            None
        }
    }
}

struct Equations<const W: usize> {
    solver: Solver<W>,
    fields: Vec<Option<[f64; 3]>>,
    residuals: Vec<f64>,
    pushes: Vec<[f64; 3]>,
    cost: f64,
}

/// Sweeps, assembles and eliminates in one pass.
fn equations<S: Samples, const W: usize>(
    samples: &mut S,
    problem: &Problem<'_>,
    state: &State,
    before: Option<Solver<W>>,
) -> Result<Equations<W>, S::Error> {
    let segments = problem.segments;
    let mut solver = Solver::<W>::new(segments.len() + 1, before);
    problem.priors.add(&state.constants, &mut solver.border);
    let last = W - 1;
    let held = held_headings(problem, state, W == WIDE);
    let mut own = [[0.0; STATES]; STATES];
    let mut border = [[0.0; W]; STATES];
    for i in 0..BIAS {
        own[i][i] = 1.0 / (ANYWHERE * ANYWHERE);
    }
    let (weights, centre) = problem.first_bias(W == WIDE);
    let pull = -weights * (state.nodes[0].bias - centre);
    for i in 0..3 {
        for j in 0..3 {
            own[BIAS + i][BIAS + j] = weights[(i, j)];
        }
        border[BIAS + i][last] = pull[i];
    }
    let centre = border::vector(&state.constants, border::CENTRE);
    let count = segments.len();
    let (mut fields, mut residuals, mut pushes) = (
        Vec::with_capacity(count),
        Vec::with_capacity(count),
        Vec::with_capacity(count),
    );
    let mut cost = state.bound.log_norm(segments);
    let model = Model {
        segments,
        nodes: &state.nodes,
        constants: &state.constants,
        bound: &state.bound,
        field_weights: &state.field_weights,
    };
    let mut finish = |k: usize,
                      own: &mut [[f64; STATES]; STATES],
                      border: &mut [[f64; W]; STATES],
                      corner: &mut [[f64; W]; W]| {
        cost += state
            .bound
            .add((k, &state.nodes[k]), &centre, segments, own, border, corner);
        if held[k] {
            own[2][2] += 1.0 / (HELD * HELD);
        }
    };
    let mut squares = 0.0;
    sweep_all::<S, W>(samples, (problem.survey, problem.settings), &model, |job| {
        solver.add_border(&job.border);
        squares += job.border[last][last];
        for (i, blocks) in job.blocks.iter().enumerate() {
            add(&mut own, &blocks.own);
            add(&mut border, &blocks.own_border);
            finish(job.first + i, &mut own, &mut border, &mut solver.border);
            solver.eliminate(&mut own, &blocks.next, &mut border);
            for (j, next) in blocks.next_own.iter().enumerate() {
                own[j][j] += next;
            }
            for (axis, across) in blocks.next_across.iter().enumerate() {
                own[VELOCITY + axis][POSITION + axis] += across;
                own[POSITION + axis][VELOCITY + axis] += across;
            }
            add(&mut border, &blocks.next_border);
            residuals.push(blocks.field_residual);
        }
        fields.extend(job.seen.iter().map(|seen| seen.field));
        pushes.extend(job.seen.iter().map(|seen| seen.velocity));
    })?;
    finish(segments.len(), &mut own, &mut border, &mut solver.border);
    solver.eliminate(&mut own, &[[0.0; STATES]; STATES], &mut border);
    Ok(Equations {
        solver,
        fields,
        residuals,
        pushes,
        cost: cost + squares,
    })
}

fn add<const N: usize>(sum: &mut [[f64; N]; STATES], part: &[[f64; N]; STATES]) {
    for (row, part) in sum.iter_mut().zip(part) {
        for (sum, x) in row.iter_mut().zip(part) {
            *sum += x;
        }
    }
}

/// Nodes whose heading nothing tells: the first of each section without a field.
fn held_headings(problem: &Problem<'_>, state: &State, has_field: bool) -> Vec<bool> {
    let mut held = vec![false; problem.segments.len() + 1];
    for (i, (first, _)) in sections(problem.segments).into_iter().enumerate() {
        held[first] = !has_field || !state.has_north.get(i).copied().unwrap_or(false);
    }
    held
}

/// Angle of the mean forces of parts of the log off the vertical: the median, rad; 0 of a short log.
fn off_vertical(segments: &[Segment], pushes: &[[f64; 3]]) -> f64 {
    let mut angles = Vec::new();
    let (mut secs, mut velocity) = (0.0, Vector3::zeros());
    for (segment, push) in segments.iter().zip(pushes) {
        if segment.is_break {
            (secs, velocity) = (0.0, Vector3::zeros());
            continue;
        }
        secs += segment.secs;
        velocity += Vector3::from(*push);
        if secs >= UPRIGHT_SECS {
            let up: Vector3<f64> = velocity / secs + Vector3::z() * GRAVITY;
            angles.push(up.x.hypot(up.y).atan2(up.z));
            (secs, velocity) = (0.0, Vector3::zeros());
        }
    }
    crate::median::median(&mut angles)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::{Marginal, Phase};
    use crate::smooth::border::NARROW;

    fn unsettled(turn: f64, sigma: f64) -> Option<f64> {
        let phase = Phase::<NARROW> {
            solver: None,
            failure: None,
            iterations: 1,
            turns: vec![[0.0; 3], [0.0, 0.0, turn.to_radians()]],
            fields: Vec::new(),
            cost: 0.0,
        };
        let known = |sigma: f64| Marginal {
            by_class: Matrix3::zeros(),
            turn: Matrix3::identity() * sigma.to_radians().powi(2),
            bias: [0.0; 3],
        };
        phase.unsettled(&[known(1e-3), known(sigma)])
    }

    #[test]
    fn a_turn_is_small_by_itself_or_beside_what_is_known_of_its_own_node() {
        assert_eq!(unsettled(0.09, 0.01), None);
        assert_eq!(unsettled(2.3, 0.4), Some(2.3_f64.to_radians()));
        assert_eq!(unsettled(2.3, 9.0), None);
        assert_eq!(unsettled(2.8, 9.0), Some(2.8_f64.to_radians()));
    }
}
