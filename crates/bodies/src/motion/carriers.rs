//! The name of a carrier and a seed -> its motion: what people, vehicles, machines and hands do to a sensor. Pure.
//!
//! Frequencies, strokes and accelerations are of the size that is measured on them; which turns come
//! when, and all phases, are drawn from the seed. Everything that has a cycle has one of two minutes.

use super::band_limited::SplitMix;
use super::carried::{Carried, Place};
use super::course::{Course, Harmonic, Rhythm, Step, Steps, Wave};
use std::f64::consts::TAU;

/// Carrier of the sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Carrier {
    /// A person who walks, turns off every ten seconds or so, and stops now and then.
    Walking(Worn),
    /// A person who runs.
    Running(Worn),
    /// A cart on a circle of 10 m at 4 m/s: 1.6 m/s^2 towards its middle, always.
    Circling,
    /// The tool of an arm with two links: from place to place, with rests between.
    Arm,
    /// A car in town: pulls away, brakes, turns, stands; its engine runs.
    Car,
    /// A machine that shakes: 6 m/s^2 on each axis between 12 and 45 Hz.
    Vibration,
    /// A drone: tilts to go somewhere, so that force stays along its own z axis.
    Drone,
    /// A thing in a hand: turned every way, moved about, laid down now and then.
    Hand,
    /// A boat on waves of six to twelve seconds.
    Boat,
}

/// Place where a person wears the sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Worn {
    /// Waist.
    Waist,
    /// Hand of a swinging arm.
    Hand,
    /// Foot.
    Foot,
}

/// Standing still at the start, s.
const FIRST_REST: f64 = 3.0;
/// The cycle of everything that has one, s.
const CYCLE: f64 = 120.0;

impl Carrier {
    /// Motion of the carrier. The same seed gives the same motion; gravity (m/s^2) matters to a drone alone.
    #[must_use]
    pub fn motion(self, seed: u64, gravity: f64) -> Carried {
        let mut made = Maker(SplitMix(seed));
        match self {
            Self::Walking(worn) => made.gait(&WALKING, worn),
            Self::Running(worn) => made.gait(&RUNNING, worn),
            Self::Circling => made.circling(),
            Self::Arm => made.arm(),
            Self::Car => made.car(),
            Self::Vibration => made.vibration(),
            Self::Drone => made.drone(gravity),
            Self::Hand => made.hand(),
            Self::Boat => made.boat(),
        }
    }
}

/// Gait of a person.
struct Gait {
    stride_hz: f64,
    /// m/s.
    speed: f64,
    /// Up and down of the body at each step, m.
    bounce: f64,
    /// Acceleration of the lowest harmonic of a step's impact on the waist, m/s^2.
    impact: f64,
    /// Angles, of those of walking.
    swing: f64,
}

const WALKING: Gait = Gait {
    stride_hz: 0.95,
    speed: 1.3,
    bounce: 0.02,
    impact: 1.2,
    swing: 1.0,
};
const RUNNING: Gait = Gait {
    stride_hz: 1.4,
    speed: 3.2,
    bounce: 0.045,
    impact: 5.0,
    swing: 1.6,
};

fn rad(degrees: f64) -> f64 {
    degrees.to_radians()
}

/// A motion under way to be made: the numbers that are drawn.
struct Maker(SplitMix);

impl Maker {
    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.0.unit()
    }

    /// Sines spread evenly in the logarithm of their frequency, each with the same amplitude after
    /// `integrals` integrations, `rms` together.
    fn band(&mut self, count: u32, [least, most]: [f64; 2], rms: f64, integrals: i32) -> Course {
        let amplitude = rms * (2.0 / f64::from(count)).sqrt();
        let step = (most / least).powf(1.0 / f64::from(count));
        let waves = (0..count)
            .map(|k| {
                let hz = least * step.powf(f64::from(k) + self.0.unit());
                Wave {
                    amplitude: amplitude / (TAU * hz).powi(integrals),
                    hz,
                    phase: self.0.unit(),
                }
            })
            .collect();
        Course {
            waves,
            ..Course::default()
        }
    }

    /// Turns of the way between `from` and `to` s, one every `gap` s or so.
    fn turns(&mut self, [from, to]: [f64; 2], gap: f64) -> Vec<Step> {
        let mut steps = Vec::new();
        let mut at = from;
        loop {
            at += self.between(0.6 * gap, 1.4 * gap);
            if at > to {
                return steps;
            }
            let angle = [90.0, -90.0, 60.0, -60.0, 180.0][(5.0 * self.0.unit()) as usize % 5];
            let over = self.between(1.2, 2.0) * f64::abs(angle) / 90.0;
            steps.push(Step::of(at, over, rad(angle)));
        }
    }

    fn gait(&mut self, gait: &Gait, worn: Worn) -> Carried {
        let going = |by: f64| {
            let events = [(FIRST_REST, 1.0), (41.0, -1.0), (45.0, 1.0), (82.0, -1.0)]
                .into_iter()
                .chain([(88.0, 1.0), (117.0, -1.0)]);
            let steps = events.map(|(at, sign)| Step::of(at, 1.5, sign * by));
            Steps::every(CYCLE, 0.0, steps.collect())
        };
        let omega = TAU * gait.stride_hz;
        // A sum of harmonics by amplitude, and of impacts by acceleration.
        let mut course = |strokes: &[(u32, f64)], impacts: &[(u32, f64)]| {
            let of_impact = |(order, a): &(u32, f64)| {
                let w = omega * f64::from(*order);
                (*order, a * gait.impact / (w * w))
            };
            let all = strokes.iter().copied().chain(impacts.iter().map(of_impact));
            let harmonics = all
                .map(|(order, amplitude)| Harmonic {
                    order,
                    amplitude,
                    phase: self.0.unit(),
                })
                .collect();
            Course {
                harmonics,
                ..Course::default()
            }
        };
        let b = gait.bounce;
        let degrees = |d: f64| rad(d) * gait.swing;
        let [x, y, z, yaw, mut pitch, roll] = match worn {
            Worn::Waist => [
                course(&[(2, 0.6 * b)], &[(4, 0.7), (6, 0.4)]),
                course(&[(1, b)], &[(3, 0.4), (5, 0.25)]),
                course(&[(2, b)], &[(4, 1.0), (6, 0.7), (8, 0.5), (10, 0.35)]),
                course(&[(1, degrees(5.0))], &[]),
                course(&[(2, degrees(2.0)), (4, degrees(0.7))], &[]),
                course(&[(1, degrees(3.0)), (2, degrees(1.0))], &[]),
            ],
            Worn::Hand => [
                course(&[(1, 0.25)], &[(4, 0.5), (6, 0.3)]),
                course(&[(1, 0.03)], &[(3, 0.4)]),
                course(&[(2, 0.03 + b)], &[(4, 0.6), (6, 0.4)]),
                course(&[(1, degrees(10.0))], &[]),
                course(&[(1, degrees(25.0)), (2, degrees(5.0))], &[]),
                course(&[(1, degrees(8.0)), (2, degrees(3.0))], &[]),
            ],
            Worn::Foot => [
                course(&[(1, 0.33)], &[(4, 2.0), (7, 2.0), (11, 1.5)]),
                course(&[(1, 0.03)], &[(5, 1.0), (9, 1.0)]),
                course(&[(1, 0.05), (2, 0.03)], &[(5, 2.5), (8, 2.5), (12, 2.0)]),
                course(&[(1, degrees(6.0))], &[]),
                course(&[(1, degrees(35.0)), (2, degrees(12.0))], &[]),
                course(&[(1, degrees(8.0)), (3, degrees(3.0))], &[]),
            ],
        };
        if worn == Worn::Hand {
            pitch.steps = Steps::constant(rad(50.0));
        }
        let heading = self.turns([FIRST_REST + 4.0, CYCLE - 5.0], 10.0);
        Carried {
            rhythm: Rhythm {
                envelope: going(1.0),
                stride_hz: gait.stride_hz,
                unsteady: vec![
                    self.wave(0.04, 0.037),
                    self.wave(0.02, 0.11),
                    self.wave(0.008, 0.31),
                ],
            },
            heading: steps(Steps::every(CYCLE, 0.0, heading)),
            speed: steps(going(gait.speed)),
            sway: [x, y, z],
            turn: [yaw, pitch, roll],
            place: Place::Way,
        }
    }

    fn wave(&mut self, amplitude: f64, hz: f64) -> Wave {
        Wave {
            amplitude,
            hz,
            phase: self.0.unit(),
        }
    }

    fn circling(&mut self) -> Carried {
        let road = |maker: &mut Self, rms| maker.band(12, [0.8, 15.0], rms, 2);
        let lean = |maker: &mut Self| maker.band(6, [0.3, 2.0], rad(0.5), 0);
        Carried {
            rhythm: rhythm(Steps::once(0.0, vec![Step::of(FIRST_REST, 4.0, 1.0)])),
            heading: steps(Steps::once(0.0, vec![Step::of_rate(FIRST_REST, 4.0, 0.4)])),
            speed: steps(Steps::once(0.0, vec![Step::of(FIRST_REST, 4.0, 4.0)])),
            sway: [road(self, 0.1), road(self, 0.1), road(self, 0.3)],
            turn: [Course::default(), lean(self), lean(self)],
            place: Place::Way,
        }
    }

    fn arm(&mut self) -> Carried {
        // Base, shoulder, elbow, wrist, flange: where each may be, degrees.
        const REACH: [[f64; 2]; 5] = [
            [-120.0, 120.0],
            [10.0, 80.0],
            [10.0, 110.0],
            [-60.0, 60.0],
            [-170.0, 170.0],
        ];
        let home = REACH.map(|[least, most]| rad(0.5 * (least + most)));
        let (mut now, mut at) = (home, FIRST_REST);
        let mut moves: [Vec<Step>; 5] = Default::default();
        while at < CYCLE - 8.0 {
            let to = REACH.map(|[least, most]| rad(self.between(least, most)));
            let ways = to.iter().zip(&now).map(|(to, from)| to - from);
            // The longest way takes 0.8 to 2 s, and a second for each 90 degrees.
            let longest = ways.clone().fold(0.0, |most: f64, way| most.max(way.abs()));
            let over = self.between(0.8, 2.0) + longest / rad(90.0);
            for (steps, way) in moves.iter_mut().zip(ways) {
                steps.push(Step::of(at, over, way));
            }
            now = to;
            at += over + self.between(0.0, 2.5);
        }
        for ((joint, steps), home) in now.iter().zip(&mut moves).zip(home) {
            steps.push(Step::of(CYCLE - 5.0, 3.0, home - joint));
        }
        let mut start = home.into_iter();
        let [base, shoulder, elbow, wrist, flange] =
            moves.map(|m| steps(Steps::every(CYCLE, start.next().unwrap_or(0.0), m)));
        Carried {
            rhythm: Rhythm::default(),
            heading: base,
            speed: Course::default(),
            sway: [shoulder, elbow, Course::default()],
            turn: [Course::default(), wrist, flange],
            place: Place::Arm([0.6, 0.5]),
        }
    }

    fn car(&mut self) -> Carried {
        let speed = [
            (6.0, 8.0, 14.0),
            (30.0, 4.0, -9.0),
            (43.0, 6.0, 12.0),
            (62.0, 5.0, -17.0),
            (72.0, 7.0, 15.0),
            (110.0, 6.0, -15.0),
        ];
        let turns = [
            (35.0, 5.0, 90.0),
            (52.0, 4.0, -60.0),
            (80.0, 8.0, 90.0),
            (95.0, 6.0, -120.0),
        ];
        let every =
            |steps: &mut dyn Iterator<Item = Step>| Steps::every(CYCLE, 0.0, steps.collect());
        let heading = every(
            &mut turns
                .iter()
                .map(|(at, over, by)| Step::of(*at, *over, rad(*by))),
        );
        let speed = every(&mut speed.iter().map(|(at, over, by)| Step::of(*at, *over, *by)));
        let mut shaken = |road: f64, engine: f64| {
            let mut course = self.band(16, [0.7, 15.0], road, 2);
            for hz in [27.3, 54.6] {
                let amplitude = engine / (TAU * hz).powi(2);
                course.waves.push(self.wave(amplitude, hz));
            }
            course
        };
        let sway = [shaken(0.2, 0.2), shaken(0.25, 0.3), shaken(0.5, 0.4)];
        Carried {
            rhythm: rhythm(Steps::constant(1.0)),
            heading: steps(heading),
            speed: steps(speed),
            sway,
            turn: [
                Course::default(),
                self.band(8, [0.3, 3.0], rad(0.4), 0),
                self.band(8, [0.3, 3.0], rad(0.6), 0),
            ],
            place: Place::Way,
        }
    }

    fn vibration(&mut self) -> Carried {
        const BAND: [f64; 2] = [12.0, 45.0];
        let shaken = |maker: &mut Self| maker.band(12, BAND, 6.0, 2);
        let turned = |maker: &mut Self| {
            let mut course = maker.band(12, BAND, rad(15.0), 1);
            course
                .waves
                .extend(maker.band(4, [0.02, 0.1], rad(20.0), 0).waves);
            course
        };
        let runs = vec![
            Step::of(FIRST_REST, 2.0, 1.0),
            Step::of(58.0, 2.0, -1.0),
            Step::of(64.0, 2.0, 1.0),
            Step::of(116.0, 2.0, -1.0),
        ];
        Carried {
            rhythm: rhythm(Steps::every(CYCLE, 0.0, runs)),
            heading: Course::default(),
            speed: Course::default(),
            sway: [shaken(self), shaken(self), shaken(self)],
            turn: [turned(self), turned(self), turned(self)],
            place: Place::Way,
        }
    }

    fn drone(&mut self, gravity: f64) -> Carried {
        const ROTOR_HZ: f64 = 94.0;
        let tilt = |maker: &mut Self| {
            let mut course = maker.band(10, [0.1, 1.0], rad(5.0), 0);
            let amplitude = rad(10.0) / (TAU * ROTOR_HZ);
            course.waves.push(maker.wave(amplitude, ROTOR_HZ));
            course
        };
        let rotors = |maker: &mut Self, slow: f64| {
            let mut course = maker.band(8, [0.1, 1.0], slow, 2);
            let amplitude = 3.0 / (TAU * ROTOR_HZ).powi(2);
            course.waves.push(maker.wave(amplitude, ROTOR_HZ));
            course
        };
        let flight = vec![Step::of(FIRST_REST, 3.0, 1.0), Step::of(112.0, 3.0, -1.0)];
        Carried {
            rhythm: rhythm(Steps::every(CYCLE, 0.0, flight)),
            heading: self.band(6, [0.02, 0.1], rad(40.0), 0),
            speed: Course::default(),
            sway: [rotors(self, 0.0), rotors(self, 0.0), rotors(self, 0.8)],
            turn: [Course::default(), tilt(self), tilt(self)],
            place: Place::Thrust(gravity),
        }
    }

    fn hand(&mut self) -> Carried {
        let moved = |maker: &mut Self| maker.band(12, [0.25, 2.5], 2.0, 2);
        let turned = |maker: &mut Self, rms| maker.band(10, [0.05, 0.8], rad(rms), 0);
        let held = vec![
            Step::of(FIRST_REST, 2.0, 1.0),
            Step::of(38.0, 2.0, -1.0),
            Step::of(43.0, 2.0, 1.0),
            Step::of(78.0, 2.0, -1.0),
            Step::of(84.0, 2.0, 1.0),
            Step::of(116.0, 2.0, -1.0),
        ];
        Carried {
            rhythm: rhythm(Steps::every(CYCLE, 0.0, held)),
            heading: Course::default(),
            speed: Course::default(),
            sway: [moved(self), moved(self), moved(self)],
            turn: [turned(self, 50.0), turned(self, 35.0), turned(self, 50.0)],
            place: Place::Way,
        }
    }

    fn boat(&mut self) -> Carried {
        const SWELL: [f64; 2] = [0.08, 0.17];
        Carried {
            rhythm: rhythm(Steps::constant(1.0)),
            heading: self.band(5, [0.01, 0.05], rad(15.0), 0),
            speed: Course::default(),
            sway: [
                self.band(8, SWELL, 0.6, 2),
                self.band(8, SWELL, 0.8, 2),
                self.band(8, SWELL, 1.2, 2),
            ],
            turn: [
                self.band(8, SWELL, rad(2.0), 0),
                self.band(8, SWELL, rad(3.0), 0),
                self.band(8, SWELL, rad(7.0), 0),
            ],
            place: Place::Way,
        }
    }
}

fn steps(steps: Steps) -> Course {
    Course {
        steps,
        ..Course::default()
    }
}

fn rhythm(envelope: Steps) -> Rhythm {
    Rhythm {
        envelope,
        ..Rhythm::default()
    }
}
