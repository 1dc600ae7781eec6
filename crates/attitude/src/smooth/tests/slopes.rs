//! Derivatives against differences: those of the sweep, and of every row of the equations.

use super::golden::prepared;
use super::logs::{BIAS, Motion, log};
use crate::quaternion::exp_minus_one;
use crate::quaternion::kernel::product;
use crate::smooth::border::{self, ALL, Constants, WIDE};
use crate::smooth::factors::{
    BIAS as BIAS_STATE, Blocks, Node, Row, STATES, assemble, difference, field, inertial,
    standstill,
};
use crate::smooth::motion::Bound;
use crate::smooth::prepared::Prepared;
use crate::smooth::segments::Segment;
use crate::smooth::sweep::{Sensor, Swept, sweep};
use crate::smooth::{MotionModel, Settings};
use nalgebra::Vector3;

/// Sums are of first order in the time step, and so are their derivatives: what the document grants.
const SHARE: f64 = 2e-3;

/// Half a second of the hand in motion, and a place to differentiate at where nothing is zero.
struct Place {
    samples: Vec<Prepared>,
    nodes: [Node; 2],
    constants: Constants,
    segment: Segment,
}

fn place() -> Place {
    let hand = log(Motion::Hand);
    let (_, prepared) = prepared(&hand.samples, &Settings::default());
    let node = |i: usize| Node {
        q: hand.truth[i],
        velocity: Vector3::new(0.3, -0.2, 0.1),
        position: Vector3::new(0.2, 0.1, -0.3),
        bias: Vector3::from(BIAS),
    };
    let mut constants = [0.0; ALL];
    for (i, constant) in constants.iter_mut().enumerate() {
        *constant = 1e-3 * ((i * 7 % 11) as f64 - 5.0);
    }
    for (i, north) in [(border::NORTH, 18.0), (border::NORTH + 1, -45.0)] {
        constants[i] = north;
    }
    // What an offset in time makes of bias and matrix is left out: a millisecond of what they are.
    constants[border::FORCE_TIME] = 0.0;
    constants[border::FIELD_TIME] = 0.0;
    let segment = Segment::moving();
    let mut place = Place {
        samples: prepared[3001..=3050].to_vec(),
        nodes: [node(3000), node(3050)],
        constants,
        segment,
    };
    // The rotation vector of a small turn has the identity for derivative.
    place.nodes[1].q = place.swept().q;
    place
}

impl Place {
    fn swept(&self) -> Swept {
        sweep::<true>(
            &self.samples,
            &self.nodes[0].q,
            &self.nodes[0].bias,
            &Sensor::of(&self.constants, Vector3::new(1.0, -2.0, 9.0)),
        )
    }

    /// Moved by `step` along one unknown: of the first node, of the second, or a constant.
    fn moved(&self, unknown: usize, step: f64) -> Place {
        let (mut nodes, mut constants) = (self.nodes, self.constants);
        match unknown {
            k if k < 2 * STATES => {
                let (node, i) = (&mut nodes[k / STATES], k % STATES);
                let axis = Vector3::from_fn(|r, _| if r == i % 3 { step } else { 0.0 });
                match i / 3 {
                    0 => {
                        let [w, x, y, z] = exp_minus_one(&axis);
                        node.q = product(&[1.0 + w, x, y, z], &node.q);
                    }
                    1 => node.velocity += axis,
                    2 => node.position += axis,
                    _ => node.bias += axis,
                }
            }
            k => constants[k - 2 * STATES] += step,
        }
        Place {
            samples: self.samples.clone(),
            nodes,
            constants,
            segment: self.segment,
        }
    }
}

/// Coefficient of an unknown of the later node in a row.
fn by_next(row: &Row<WIDE>, unknown: usize) -> f64 {
    let held = [row.next.map(|next| (next, 1.0)), row.second];
    let of = |(state, by): (usize, f64)| if state == unknown { by } else { 0.0 };
    held.into_iter().flatten().map(of).sum()
}

/// Every row's derivatives by every unknown, against central differences of its residual.
#[track_caller]
fn check<const N: usize>(rows: impl Fn(&Place) -> [Row<WIDE>; N]) {
    let place = place();
    let at = rows(&place);
    let kinds = N.div_ceil(3);
    for unknown in 0..2 * STATES + ALL {
        let step = 1e-4;
        let (above, below) = (
            rows(&place.moved(unknown, step)),
            rows(&place.moved(unknown, -step)),
        );
        // Three rows of a kind have one scale.
        for kind in 0..kinds {
            let three = 3 * kind..3 * kind + 3;
            let residual = |row: &Row<WIDE>| -row.border[WIDE - 1];
            let differences: Vec<f64> = three
                .clone()
                .map(|i| (residual(&above[i]) - residual(&below[i])) / (2.0 * step))
                .collect();
            let claimed: Vec<f64> = three
                .map(|i| match unknown {
                    k if k < STATES => at[i].own[k],
                    k if k < 2 * STATES => by_next(&at[i], k - STATES),
                    k if k - 2 * STATES < at[i].span => at[i].border[k - 2 * STATES],
                    _ => 0.0,
                })
                .collect();
            let size = claimed
                .iter()
                .chain(&differences)
                .fold(0.0_f64, |most, x| most.max(x.abs()));
            for (a, b) in claimed.iter().zip(&differences) {
                assert!(
                    (a - b).abs() <= SHARE * size + 1e-7,
                    "unknown {unknown}, rows {kind}: {claimed:?} {differences:?}"
                );
            }
        }
    }
}

#[test]
fn rows_of_the_integrated_sensors_are_those_of_differences() {
    check(|place| {
        let swept = place.swept();
        inertial(&place.segment, &swept, [&place.nodes[0], &place.nodes[1]])
    });
}

/// The sweep sees the first node's attitude and bias, and the constants.
#[test]
fn derivatives_of_the_sweep_are_those_of_differences() {
    let place = place();
    let swept = place.swept();
    let step = 1e-4;
    let columns = (0..3)
        .map(|i| (BIAS_STATE + i, i))
        .chain((0..22).map(|i| (2 * STATES + i, 3 + i)));
    for (unknown, column) in columns {
        let (above, below) = (
            place.moved(unknown, step).swept(),
            place.moved(unknown, -step).swept(),
        );
        let turn = difference(&above.q, &below.q) / (2.0 * step);
        let by = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)) / (2.0 * step);
        let claims = [
            (column < 12).then(|| (Vector3::from_fn(|r, _| swept.by_turn[r][column]), turn)),
            Some((
                Vector3::from_fn(|r, _| swept.by_velocity[r][column]),
                by(above.velocity, below.velocity),
            )),
            Some((
                Vector3::from_fn(|r, _| swept.by_position[r][column]),
                by(above.position, below.position),
            )),
        ];
        for (claimed, found) in claims.into_iter().flatten() {
            let size = claimed.amax().max(found.amax());
            assert!(
                (claimed - found).amax() <= SHARE * size,
                "column {column}: {claimed} {found}"
            );
        }
    }
}

#[test]
fn rows_of_the_field_are_those_of_differences() {
    for is_still in [false, true] {
        check(|place| field(&place.swept(), &place.constants, is_still, 1.0));
    }
}

#[test]
fn rows_of_a_body_at_rest_are_those_of_differences() {
    check(|place| {
        // Ends of a rest are near each other.
        let mut nodes = place.nodes;
        nodes[1].q = product(
            &nodes[1].q,
            &crate::quaternion::kernel::conjugate(&self::place().nodes[1].q),
        );
        nodes[1].q = product(&nodes[1].q, &self::place().nodes[0].q);
        standstill([&nodes[0], &nodes[1]])
    });
}

fn process(place: &Place) -> [Row<WIDE>; 6] {
    let centre = border::vector(&place.constants, border::CENTRE);
    let bound = Bound::new(MotionModel::Process, 2);
    let nodes = [&place.nodes[0], &place.nodes[1]];
    bound.rows((0, &place.segment), nodes, &centre).unwrap()
}

#[test]
fn rows_of_the_motion_are_those_of_differences() {
    check(process);
}

/// Checks that a segment adds the sum of its rows' products.
#[test]
fn the_equations_are_the_products_of_their_rows() {
    let place = place();
    let swept = place.swept();
    let nodes = [&place.nodes[0], &place.nodes[1]];
    let (mut blocks, mut corner) = (Blocks::<WIDE>::zero(), [[0.0; WIDE]; WIDE]);
    assemble(
        &place.segment,
        &swept,
        nodes,
        &place.constants,
        Some(process(&place)),
        1.0,
        (&mut blocks, &mut corner),
    );
    let rows = inertial(&place.segment, &swept, nodes)
        .into_iter()
        .chain(process(&place))
        .chain(field(&swept, &place.constants, false, 1.0));
    let (mut own, mut next) = ([[0.0; STATES]; STATES], [[0.0; STATES]; STATES]);
    let (mut later, mut border) = ([[0.0; STATES]; STATES], [[0.0; WIDE]; STATES]);
    for row in rows {
        for i in 0..STATES {
            let x = row.weight * by_next(&row, i);
            for j in 0..STATES {
                own[i][j] += row.weight * row.own[i] * row.own[j];
                next[i][j] += row.weight * row.own[i] * by_next(&row, j);
                later[i][j] += x * by_next(&row, j);
            }
            for (sum, j) in border[i].iter_mut().zip(&row.border) {
                *sum += x * j;
            }
        }
    }
    let mut found = [[0.0; STATES]; STATES];
    for i in 0..STATES {
        found[i][i] = blocks.next_own[i];
    }
    for (axis, across) in blocks.next_across.iter().enumerate() {
        found[3 + axis][6 + axis] = *across;
        found[6 + axis][3 + axis] = *across;
    }
    let agree = |ours: &[f64], theirs: &[f64]| {
        let size = theirs.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (a, b) in ours.iter().zip(theirs) {
            assert!((a - b).abs() <= 1e-12 * size, "{ours:?}\n{theirs:?}");
        }
    };
    agree(blocks.own.as_flattened(), own.as_flattened());
    agree(blocks.next.as_flattened(), next.as_flattened());
    agree(found.as_flattened(), later.as_flattened());
    agree(blocks.next_border.as_flattened(), border.as_flattened());
}
