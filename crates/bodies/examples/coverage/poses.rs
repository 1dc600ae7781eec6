//! Bodies that no carrier of the library is: attitude and acceleration as functions of time.

use nalgebra::Vector3;
use std::f64::consts::TAU;
use strapd_attitude::quaternion::{Quaternion, RotationVector};

type Q = Quaternion<(), ()>;
/// Attitude (body to world, z up) and acceleration (m/s^2, world) at a time; times come in order.
pub(crate) type Pose = Box<dyn FnMut(f64) -> (Q, Vector3<f64>)>;

/// Numbers from a seed, from 0 to 1.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Sum of `count` sines between two frequencies (Hz), of this rms.
    fn sines(
        &mut self,
        count: usize,
        [least, most]: [f64; 2],
        rms: f64,
    ) -> impl Fn(f64) -> f64 + use<> {
        let waves: Vec<[f64; 2]> = (0..count)
            .map(|_| {
                [
                    TAU * (least + (most - least) * self.next()),
                    TAU * self.next(),
                ]
            })
            .collect();
        let size = rms * (2.0 / count as f64).sqrt();
        move |t| {
            waves
                .iter()
                .map(|[w, phase]| size * (w * t + phase).sin())
                .sum()
        }
    }

    fn three(&mut self, hz: [f64; 2], rms: f64) -> impl Fn(f64) -> Vector3<f64> + use<> {
        let [x, y, z] = [(); 3].map(|()| self.sines(6, hz, rms));
        move |t| Vector3::new(x(t), y(t), z(t))
    }
}

/// Share between two times, 0 before and 1 behind.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    let x = ((t - from) / (to - from)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn rotation(about: Vector3<f64>) -> Q {
    Q::from_rotation_vector(&RotationVector(about))
}

/// Wheels: rate about the vertical (rad/s) and speed (m/s) by time, integrated as they come.
struct Wheels {
    turn: Box<dyn Fn(f64) -> f64>,
    speed: Box<dyn Fn(f64) -> f64>,
    /// Slope of the road, rad, and what it shakes: rad and m/s^2 of a body that moves.
    slope: f64,
    shaken: [f64; 2],
}

impl Wheels {
    fn pose(self, draw: &mut Draw) -> Pose {
        let (tilts, pushes) = (draw.three([3.0, 18.0], 1.0), draw.three([3.0, 18.0], 1.0));
        let slopes = draw.three([0.01, 0.05], 1.0);
        let (mut yaw, mut last) = (0.0, 0.0);
        Box::new(move |t| {
            yaw += (self.turn)(0.5 * (t + last)) * (t - last);
            last = t;
            let (speed, step) = ((self.speed)(t), 1e-4);
            let moving = (speed.abs() / 0.5).min(1.0);
            let slope = slopes(t) * self.slope;
            let lean = tilts(t) * (self.shaken[0] * moving) + Vector3::new(slope.x, slope.y, 0.0);
            let q = rotation(Vector3::z() * yaw) * rotation(lean);
            let push = ((self.speed)(t + step) - (self.speed)(t - step)) / (2.0 * step);
            let ahead = Vector3::new(yaw.cos(), yaw.sin(), 0.0);
            let across = Vector3::new(-yaw.sin(), yaw.cos(), 0.0);
            let acceleration = ahead * push + across * (speed * (self.turn)(t));
            (q, acceleration + pushes(t) * (self.shaken[1] * moving))
        })
    }
}

pub(crate) fn pose(body: &str, seed: u64) -> Option<Pose> {
    let mut draw = Draw(seed.wrapping_mul(7919).wrapping_add(13));
    for _ in 0..4 {
        draw.next();
    }
    let wanders = draw.sines(5, [0.03, 0.3], 0.35);
    let under_way = |t: f64| ramp(t, 6.0, 9.0) * (1.0 - ramp(t, 112.0, 115.0));
    let wheels = |turn: Box<dyn Fn(f64) -> f64>, speed: Box<dyn Fn(f64) -> f64>| Wheels {
        turn,
        speed,
        slope: 0.0,
        shaken: [0.004, 0.5],
    };
    let steady = draw.sines(3, [0.02, 0.08], 0.3);
    let wheels = match body {
        "straight" => wheels(
            Box::new(|_| 0.0),
            Box::new(move |t| 2.0 * under_way(t) * (1.0 + steady(t))),
        ),
        "curves" => wheels(
            Box::new(move |t| wanders(t) * under_way(t)),
            Box::new(move |t| 1.5 * under_way(t)),
        ),
        "parking" => {
            let stops = move |t: f64| {
                under_way(t)
                    * (TAU * t / 15.0).sin().max(0.0).powi(2)
                    * if ((t / 15.0) as u64).is_multiple_of(2) {
                        1.0
                    } else {
                        -1.0
                    }
            };
            wheels(
                Box::new(move |t| 0.6 * stops(t) * wanders(t).signum()),
                Box::new(move |t| 1.2 * stops(t)),
            )
        }
        "turntable" => Wheels {
            shaken: [0.0; 2],
            ..wheels(
                Box::new(|t| {
                    30_f64.to_radians() * ramp(t, 30.0, 32.0) * (1.0 - ramp(t, 92.0, 94.0))
                }),
                Box::new(|_| 0.0),
            )
        },
        // Never at rest: a car that is driven already, and goes on.
        "slope" => Wheels {
            slope: 0.05,
            shaken: [0.004, 0.8],
            ..wheels(
                Box::new(move |t| 0.3 * wanders(t)),
                Box::new(move |t| 11.0 + 8.0 * steady(t)),
            )
        },
        "robot" => {
            let between = |t: f64| ramp(t, 1.2, 2.7) * (1.0 - ramp(t, 116.5, 118.0));
            wheels(
                Box::new(move |t| {
                    (2.5 * (1.0 - ramp(t, 1.2, 2.2)) + 2.2 * ramp(t, 118.0, 119.0)).to_radians()
                        + wanders(t) * between(t)
                }),
                Box::new(move |t| 0.4 * between(t)),
            )
        }
        _ => return limb(body, &mut draw),
    };
    Some(wheels.pose(&mut draw))
}

/// Bodies that lean and swing.
fn limb(body: &str, draw: &mut Draw) -> Option<Pose> {
    let start = rotation(Vector3::z() * (TAU * draw.next()))
        * rotation(Vector3::new(0.3, 0.8, 0.0) * (2.0 * draw.next() - 1.0));
    let numeric = |at: Box<dyn Fn(f64) -> Vector3<f64>>| {
        move |t: f64| {
            let h = 1e-3;
            (at(t + h) - at(t) * 2.0 + at(t - h)) / (h * h)
        }
    };
    Some(match body {
        // On a rod of 0.8 m, in a plane that turns slowly and a little besides; let go after 4 s, never touched again.
        "pendulum" => {
            let (phase, length) = (draw.next(), 0.8);
            let w = (9.80665_f64 / length).sqrt();
            let angles = move |t: f64| {
                let size = 0.6 * ramp(t, 4.0, 5.0) * (-(t - 4.0).max(0.0) / 90.0).exp();
                let plane = 0.012 * t + phase;
                let (a, b) = (size * (w * t).cos(), 0.25 * size * (w * t).sin());
                Vector3::new(
                    a * plane.cos() - b * plane.sin(),
                    a * plane.sin() + b * plane.cos(),
                    0.0,
                )
            };
            let q = move |t: f64| rotation(angles(t)) * start;
            let acceleration = numeric(Box::new(move |t| {
                rotation(angles(t)).to_dcm().as_matrix() * Vector3::z() * -length
            }));
            Box::new(move |t| (q(t), acceleration(t)))
        }
        // A phone in trousers: a thigh that swings, steps, turns of the way; it never lies still, and slides about.
        "pocket" | "soft" => {
            let (stride, turns) = (
                TAU * (0.85 + 0.2 * draw.next()),
                draw.sines(4, [0.01, 0.06], 0.9),
            );
            let (slides, pushes) = (draw.three([0.05, 0.4], 0.06), draw.three([0.1, 0.8], 0.01));
            let soft = if body == "soft" { 0.05 } else { 0.0 };
            let wobbles = draw.three([4.0, 9.0], 1.0);
            let swing =
                move |t: f64| 0.4 * (stride * t).sin() + 0.1 * (2.0 * stride * t + 1.0).sin();
            let q = move |t: f64| {
                let step = (stride * t).sin().abs().powi(4);
                rotation(Vector3::z() * turns(t))
                    * rotation(Vector3::new(
                        0.05 * (stride * t + 0.4).sin(),
                        swing(t),
                        0.08 * (stride * t).cos(),
                    ))
                    * rotation(slides(t) + wobbles(t) * (soft * step))
                    * start
            };
            let position = numeric(Box::new(move |t| {
                let by_swing = Vector3::new(
                    -0.35 * swing(t).sin(),
                    0.02 * (stride * t).sin(),
                    0.03 * (2.0 * stride * t).cos(),
                );
                by_swing + pushes(t) * 2.0
            }));
            Box::new(move |t| (q(t), position(t)))
        }
        // A camera in the hand that looks about; it never rests.
        "camera" => {
            let (looks, trembles) = (draw.three([0.05, 0.5], 0.35), draw.three([3.0, 9.0], 0.004));
            let (moves, shakes) = (
                draw.three([0.08, 0.5], 0.12),
                draw.three([3.0, 9.0], 0.0006),
            );
            let q = move |t: f64| start * rotation(looks(t) + trembles(t));
            let acceleration = numeric(Box::new(move |t| moves(t) + shakes(t)));
            Box::new(move |t| (q(t), acceleration(t)))
        }
        _ => return None,
    })
}
