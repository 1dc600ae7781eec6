#![allow(clippy::unwrap_used, clippy::indexing_slicing)]
//! Knees whose angle is known exactly.

use super::*;
use crate::record::AttitudeCovariance;

/// Deterministic noise with a time constant of its own: a first-order process driven by a linear congruence.
struct Wander {
    seed: u64,
    value: f64,
    keep: f64,
    size: f64,
}

impl Wander {
    fn new(seed: u64, seconds: f64, size: f64) -> Wander {
        let keep = (-STEP / seconds).exp();
        let mut wander = Wander {
            seed: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1,
            value: 0.0,
            keep,
            size,
        };
        (0..500).for_each(|_| _ = wander.next());
        wander
    }

    fn next(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..6 {
            self.seed = self
                .seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        }
        // Six uniform numbers have a variance of a half.
        let drive = self.size * (2.0 * (1.0 - self.keep * self.keep)).sqrt();
        self.value = self.keep * self.value + drive * sum;
        self.value
    }
}

const STEP: f64 = 0.02;

fn about(axis: [f64; 3], angle: f64) -> Quaternion<Body, Body> {
    Quaternion::from_rotation_vector(&RotationVector(Vector3::from(axis) * angle))
}

fn in_world(axis: [f64; 3], angle: f64) -> Quaternion<Nav, Nav> {
    Quaternion::from_rotation_vector(&RotationVector(Vector3::from(axis) * angle))
}

#[derive(Clone, Copy)]
struct Case {
    seed: u64,
    seconds: usize,
    bend: f64,
    play: f64,
    tilt: f64,
    /// Offset of the second world at the start, and drift in rad/s.
    offset: f64,
    drift: f64,
    /// The axis of the joint stands upright.
    is_upright: bool,
}

const KNEE: Case = Case {
    seed: 1,
    seconds: 120,
    bend: 0.52,
    play: 0.035,
    tilt: 0.009,
    offset: 2.0,
    drift: 0.001,
    is_upright: false,
};

struct Simulated {
    first: Vec<(Nanos, Quaternion<Nav, Body>)>,
    second: Vec<(Nanos, Quaternion<Nav, Body>)>,
    angle: Vec<f64>,
    relative: Vec<Quaternion<Body, Body>>,
    axis: Vector3<f64>,
}

fn simulated(case: Case) -> Simulated {
    let Case {
        seed,
        bend,
        play,
        tilt,
        ..
    } = case;
    let mut facing = Wander::new(seed, 20.0, 0.8);
    let mut roll = Wander::new(seed + 100, 1.0, 0.07);
    let mut sideways = [
        Wander::new(seed + 200, 1.0, play),
        Wander::new(seed + 300, 1.0, play),
    ];
    let mut leaning = [0, 1, 2, 3].map(|k| Wander::new(seed + 400 + k, 10.0, tilt));
    let on_first = about([0.6, 0.0, 0.8], 1.1);
    let on_second = about([0.0, -0.6, 0.8], -2.0);
    let mut out = Simulated {
        first: Vec::new(),
        second: Vec::new(),
        angle: Vec::new(),
        relative: Vec::new(),
        axis: *on_first.inverse().to_dcm().as_matrix() * Vector3::y(),
    };
    for k in 0..case.seconds * 50 {
        let t = k as f64 * STEP;
        let phase = 5.0 * t;
        let angle = bend * (1.0 - (phase + 0.6).cos());
        let upright = if case.is_upright {
            in_world([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2)
        } else {
            Quaternion::identity()
        };
        let swing = if case.is_upright {
            0.0
        } else {
            0.44 * phase.sin()
        };
        let lean = if case.is_upright { 0.0 } else { roll.next() };
        let thigh = in_world([0.0, 0.0, 1.0], facing.next())
            * upright
            * Quaternion::<Nav, Body>::from_rotation_vector(&RotationVector(Vector3::y() * swing))
            * about([1.0, 0.0, 0.0], lean);
        let joint = about([0.0, 1.0, 0.0], angle)
            * about([1.0, 0.0, 0.0], sideways[0].next())
            * about([0.0, 0.0, 1.0], sideways[1].next());
        let (first, second) = (thigh * on_first, thigh * joint * on_second);
        let [ax, ay, bx, by] = [0, 1, 2, 3].map(|i: usize| leaning[i].next());
        let world = in_world([0.0, 0.0, 1.0], case.offset + case.drift * t);
        let stamp = Nanos(k as i64 * 20_000_000);
        out.first
            .push((stamp, in_world([ax, ay, 0.0], 1.0) * first));
        out.second
            .push((stamp, world * in_world([bx, by, 0.0], 1.0) * second));
        out.angle.push(angle);
        out.relative.push(first.inverse() * second);
    }
    out
}

fn of(simulated: &Simulated, heading: RelativeHeading) -> Result<Joint, NoHinge> {
    let covariances =
        vec![AttitudeCovariance::from_sigma(Vector3::new(0.01, 0.01, 0.01)); simulated.first.len()];
    let segment = |rows| Segment {
        rows,
        covariances: &covariances,
    };
    joint(
        segment(&simulated.first),
        segment(&simulated.second),
        heading,
    )
}

fn rms(errors: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = errors.clone().count() as f64;
    let mean = errors.clone().sum::<f64>() / n;
    (errors.map(|e| (e - mean).powi(2)).sum::<f64>() / n)
        .sqrt()
        .to_degrees()
}

/// Errors of the angle and of the heading offset, deg rms.
fn errors(case: Case) -> [f64; 2] {
    let truth = simulated(case);
    let found = of(&truth, RelativeHeading::Hinge).unwrap();
    let hinge = found.hinge.unwrap();
    let sign = hinge.axis_first.dot(&truth.axis).signum();
    let angles = found
        .rows
        .iter()
        .zip(&truth.angle)
        .map(|(row, angle)| sign * row.angle - angle);
    let offsets = found.rows.iter().enumerate().map(|(k, row)| {
        let error = row.heading_offset + case.offset + case.drift * k as f64 * STEP;
        error - TAU * (error / TAU).round()
    });
    let squares: f64 = offsets.clone().map(|e| e * e).sum();
    // A person reads -57 degrees and not 303.
    let first = found.rows.first().unwrap().heading_offset;
    assert!(first.abs() <= TAU / 2.0 + 0.01, "{first}");
    [
        rms(angles),
        (squares / found.rows.len() as f64).sqrt().to_degrees(),
    ]
}

#[test]
fn a_hinge_without_errors_gives_its_angle_and_the_offset_of_the_worlds() {
    let [angle, offset] = errors(Case {
        play: 0.0,
        tilt: 0.0,
        drift: 0.0,
        ..KNEE
    });
    assert!(angle < 1e-4 && offset < 1e-4, "{angle} {offset} deg");
}

#[test]
fn a_knee_with_play_under_drifting_headings_is_known_to_a_degree() {
    for seed in 1..6 {
        let [angle, offset] = errors(Case { seed, ..KNEE });
        assert!(
            angle < 1.3 && offset < 1.3,
            "seed {seed}: {angle} {offset} deg"
        );
        let [angle, offset] = errors(Case {
            seed,
            play: 0.07,
            tilt: 0.0175,
            ..KNEE
        });
        assert!(
            angle < 2.6 && offset < 2.6,
            "seed {seed}: {angle} {offset} deg"
        );
    }
}

#[test]
fn sigma_of_the_heading_offset_covers_its_error() {
    for seed in 1..6 {
        let truth = simulated(Case { seed, ..KNEE });
        let hinge = of(&truth, RelativeHeading::Hinge).unwrap().hinge.unwrap();
        let inside = truth.first.iter().enumerate().filter(|(k, (stamp, _))| {
            let (offset, sigma) = hinge.heading_offset_at(*stamp);
            let error = offset + KNEE.offset + KNEE.drift * *k as f64 * STEP;
            (error - TAU * (error / TAU).round()).abs() < 3.0 * sigma
        });
        assert!(inside.count() > truth.first.len() * 97 / 100, "seed {seed}");
        assert!(
            hinge.heading_sigma().to_degrees() < 4.0,
            "{}",
            hinge.heading_sigma().to_degrees()
        );
    }
}

#[test]
fn what_is_no_hinge_is_refused_with_its_reason() {
    let refused = |case| of(&simulated(case), RelativeHeading::Hinge).unwrap_err();
    assert!(matches!(
        refused(Case { bend: 0.0, ..KNEE }),
        NoHinge::Still { .. }
    ));
    assert!(matches!(
        refused(Case { play: 0.45, ..KNEE }),
        NoHinge::SeveralAxes { .. }
    ));
    assert!(matches!(
        refused(Case { seconds: 5, ..KNEE }),
        NoHinge::TooShort
    ));
    assert!(matches!(
        refused(Case {
            is_upright: true,
            tilt: 0.0,
            ..KNEE
        }),
        NoHinge::Vertical
    ));
}

#[test]
fn without_a_hinge_the_headings_stay_as_recorded_or_start_equal() {
    let truth = simulated(Case {
        play: 0.45,
        drift: 0.0,
        tilt: 0.0,
        ..KNEE
    });
    let found = of(&truth, RelativeHeading::Auto).unwrap();
    assert_eq!(found.heading, RelativeHeading::Recorded);
    assert!(found.rows.iter().all(|row| row.heading_offset == 0.0));
    let start = of(&truth, RelativeHeading::Start).unwrap();
    // Equal headings of the boxes at the start, whatever their mounting: a constant apart from the offset of the worlds.
    let first = start.rows[0].heading_offset;
    assert!(start.rows.iter().all(|row| row.heading_offset == first));
    assert!(
        Pair::heading_difference(
            &pairs(
                Segment {
                    rows: &truth.first[..1],
                    covariances: &[]
                },
                Segment {
                    rows: &truth.second[..2],
                    covariances: &[]
                },
            )
            .pairs[0]
        ) + first
            < 1e-12
    );
    assert!(start.rows[0].angle < 1e-12);
}

#[test]
fn the_same_worlds_need_no_hinge_and_the_relative_attitude_is_exact() {
    let truth = simulated(Case {
        tilt: 0.0,
        offset: 0.0,
        drift: 0.0,
        ..KNEE
    });
    let found = of(&truth, RelativeHeading::Recorded).unwrap();
    for (row, q) in found.rows.iter().zip(&truth.relative) {
        assert!(row.q_ab.angle_to(q) < 1e-12);
        // Two errors of 0.01 rad, alike about all axes.
        assert!((row.sigma.unwrap() - 0.01 * 2.0_f64.sqrt()).abs() < 1e-6);
    }
}

#[test]
fn a_joint_that_turns_round_and_round_has_an_angle_beyond_a_turn() {
    let mut truth = simulated(Case {
        seconds: 30,
        play: 0.0,
        tilt: 0.0,
        ..KNEE
    });
    for (k, (first, second)) in truth.first.iter().zip(truth.second.iter_mut()).enumerate() {
        let on = about([0.0, -0.6, 0.8], -2.0);
        let from = about([0.6, 0.0, 0.8], 1.1);
        second.1 = first.1 * from.inverse() * about([0.0, 1.0, 0.0], k as f64 * 0.02) * on;
    }
    let found = of(&truth, RelativeHeading::Hinge).unwrap();
    let last = found.rows.last().unwrap().angle.abs();
    assert!((last - 1499.0 * 0.02).abs() < 1e-3, "{last} rad");
}

#[test]
fn rows_that_are_no_attitude_and_instants_without_a_partner_are_counted() {
    let mut truth = simulated(Case {
        seconds: 20,
        ..KNEE
    });
    truth.first[3].1 = Quaternion::assume_unit([f64::NAN, 0.0, 0.0, 0.0]);
    truth.second.drain(100..200);
    truth.second.reverse();
    let found = of(&truth, RelativeHeading::Hinge).unwrap();
    // Covariances belong to rows: two of other lengths are none.
    assert_eq!((found.bad, found.unmatched), (1, 100));
    assert_eq!(found.rows.len(), 1000 - 1 - 100);
    let none = joint(
        Segment {
            rows: &[],
            covariances: &[],
        },
        Segment {
            rows: &truth.second,
            covariances: &[],
        },
        RelativeHeading::Auto,
    )
    .unwrap();
    assert!(none.rows.is_empty() && none.hinge == Err(NoHinge::TooShort));
}
