//! Rates and forces -> whether gyro and accelerometer speak of the same body. Pure.
//!
//! A stage of its own because a filter cannot tell: of a gyro whose axes are exchanged it takes gravity for
//! acceleration. Gravity stands still in the world, so under the right map of the gyro's axes its mean stands still in
//! the integrated frame, and under a wrong one it wanders.
//!
//! ```text
//! Reading -> blocks (20 ms, bias of rest) -> segment (4 s: scatter of gravity under a map) -> bank (evidence) -> refine
//! where no map of the bank explains it -> finer (unit and axes at once, factors of single axes, a turned gyro)
//! segments in order -> change (other axes from one moment on)
//! segments in order -> bias_change (another bias from one moment on)
//! blocks in order -> leap (both sensors in other axes from one moment on)
//! ```
//!
//! The bank runs only where gravity wanders as recorded, which healthy sensors do not let it do. Memory is bounded, and
//! what is said does not depend on how readings arrive.
//!
//! Theory, thresholds and what cannot be seen: `docs/theory/consistency.md`.

mod bank;
mod bias_change;
mod blocks;
mod change;
mod euler;
mod field;
mod finer;
mod leap;
mod refine;
mod segment;
#[cfg(test)]
mod tests;

pub use self::bank::CHIPS;
use self::bank::{Answer, BANK, DEGREE, Evidence, OF_UNIT, Verdict};
pub use self::bias_change::BiasChange;
use self::bias_change::BiasWatch;
use self::blocks::{Block, Blocks, Rest, Step};
pub use self::change::AxesChange;
use self::change::Sound;
pub use self::field::{FieldConsistency, FieldDisagreement, FieldIron, FieldReading};
use self::finer::Finer;
pub use self::leap::GravityLeap;
use self::leap::Leaps;
use self::refine::refine;
use self::segment::{SEGMENT_SECS, Segment};
use crate::frames::AxisMap;
use crate::record::{Measured, Nanos};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// A segment begins every so many nanoseconds, and is so long.
const HOP_NANOS: i64 = 2_000_000_000;
const SEGMENT_NANOS: i64 = (SEGMENT_SECS * 1e9) as i64;
/// Rounding of stamps.
const SLACK_NANOS: i64 = 1_000;
/// Sigma of the bias, rad/s, without a rest and after one.
const BIAS_FREE: f64 = 0.1;
const BIAS_KNOWN: f64 = 0.01;
/// Change of the running length of gravity with a block.
const GRAVITY_STEP: f64 = 1.002;
/// The bank runs once this share of the last segments, of which there are so many, scatters by more than this, g.
const GATE_SCATTER: f64 = 0.05;
const GATE_SHARE: f64 = 0.4;
const GATE_LAST: usize = 8;
const GATE_LEAST: usize = 3;
/// Segments before the gate opens that the bank is given.
const GATE_BACK: usize = 3;
/// Segments by which a factor is refined.
const REFINED_BY: usize = 32;
/// Segments in a row for which a verdict holds before it is said.
const HOLD: usize = 3;
/// Maps beyond the bank are looked for after so many segments of a live stream, after twice as many, and so on.
const FINER_FIRST: usize = 8;
/// Least segments for that at the end, and their median scatter as recorded, g, where the bank was never opened.
const FINER_LEAST: usize = 4;
const FINER_SCATTER: f64 = 0.03;
/// Segments after which the bank of a live stream closes, if the last ones do not scatter and nothing was found.
const OPEN_LEAST: usize = 64;
/// Segments that move, without a bank, after which a live stream counts as sound.
const SOUND_LEAST: usize = 32;

/// A rate with the force that belongs to it, in the axes of the sensor.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Instant of the rate, or end of its interval.
    pub stamp: Nanos,
    /// Rate, rad/s, or what was turned since the reading before, rad.
    pub gyro: Measured,
    /// Specific force, up at rest, in any unit.
    pub force: Vector3<f64>,
}

/// Cause of a disagreement of gyro and accelerometer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Cause {
    /// Axes of the gyro: true rates by recorded ones.
    Axes {
        /// Map that makes gravity stand still.
        map: AxisMap,
        /// Recorded axes whose place the motion decides.
        decided: [bool; 3],
        /// Factor of true rates by recorded ones where the unit is wrong, too, and one standard deviation as a share.
        scale: Option<(f64, f64)>,
    },
    /// Scale, or unit, of the gyro.
    Scale {
        /// True rates are so many times the recorded ones.
        factor: f64,
        /// One standard deviation of the factor, as a share of it.
        sigma: f64,
    },
    /// Scale of single axes of the gyro.
    Scales {
        /// True rates by recorded ones, x, y, z.
        factors: [f64; 3],
        /// Largest standard deviation of a factor.
        sigma: f64,
    },
    /// Mounting of the gyro against the accelerometer.
    Turned {
        /// Rotation that makes true rates of recorded ones, in the axes of the accelerometer.
        by: Matrix3<f64>,
        /// Angle of it, rad.
        angle: f64,
        /// Largest standard deviation about an axis, rad.
        sigma: f64,
    },
    /// Rates that are derivatives of roll, pitch and yaw.
    EulerRates,
    /// Lack of rates: gravity turns, and the gyro reads next to nothing.
    Unturned,
    /// Unknown, since no map explains it: the rates are wrong, or gravity stays with the body.
    Unknown,
}

/// Disagreement of gyro and accelerometer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Disagreement {
    /// Cause.
    pub cause: Cause,
    /// Median scatter of gravity in the integrated frame as recorded, g: 0.02 of healthy sensors.
    pub recorded: f64,
    /// The same when the recording is integrated with what the cause names, g.
    pub cured: f64,
    /// Segments of four seconds in which it shows.
    pub segments: usize,
}

/// Watches gyro and accelerometer of one stream.
#[derive(Clone, Debug)]
pub struct Consistency {
    blocks: Blocks,
    rest: Rest,
    run: Vec<Block>,
    gravity: Option<f64>,
    /// Scatter as recorded, with the bias that suits it.
    identity: bank::Residuals,
    /// Whether the last segments scattered.
    scattered: VecDeque<bool>,
    kept: VecDeque<Segment>,
    bank: Option<Evidence>,
    held: usize,
    settled: Option<Verdict>,
    /// Gravity that wanders though no map explains it, and how often in a row it was seen.
    unexplained: Option<Verdict>,
    unexplained_held: usize,
    /// Map that the bank has not, and how many segments the bank has judged.
    finer: Option<Finer>,
    judged: usize,
    /// Segments in which gravity stood still, for what comes later.
    sound: Sound,
    /// Axes that are others from one moment on, and how often in a row they were seen.
    change: Option<AxesChange>,
    change_held: usize,
    leaps: Leaps,
    biases: BiasWatch,
    /// Whether it runs beside a stream without an end: it keeps no segment that does not scatter, and closes a bank
    /// that finds nothing.
    is_live: bool,
    /// Segments that moved since the bank was opened or closed.
    moved: usize,
}

impl Default for Consistency {
    fn default() -> Consistency {
        Consistency {
            blocks: Blocks::default(),
            rest: Rest::default(),
            run: Vec::new(),
            gravity: None,
            identity: bank::Residuals::new(1),
            scattered: VecDeque::new(),
            kept: VecDeque::new(),
            bank: None,
            held: 0,
            settled: None,
            unexplained: None,
            unexplained_held: 0,
            finer: None,
            judged: 0,
            sound: Sound::default(),
            change: None,
            change_held: 0,
            leaps: Leaps::default(),
            biases: BiasWatch::default(),
            is_live: false,
            moved: 0,
        }
    }
}

impl Consistency {
    /// Watch over a stream without an end, of which there are many: less is kept while gravity stands still, 15 kB.
    #[must_use]
    pub fn live() -> Consistency {
        Consistency {
            is_live: true,
            ..Consistency::default()
        }
    }

    /// Whether gravity stood still through a minute and more of motion.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.says_nothing() && self.bank.is_none() && self.moved >= SOUND_LEAST
    }

    /// Whether nothing speaks against the gyro: no disagreement, no change of its axes.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.says_nothing() && self.axes_change().is_none()
    }

    fn says_nothing(&self) -> bool {
        self.settled.is_none() && self.finer.is_none() && self.unexplained.is_none()
    }

    /// Axes of the gyro that are others from one moment on; `None` where they are not, or too little motion on either
    /// side tells.
    #[must_use]
    pub fn axes_change(&self) -> Option<AxesChange> {
        self.change.filter(|_| self.change_held >= HOLD)
    }

    /// Leap of gravity in one sample that the gyro does not read: from there on both sensors are in other axes.
    #[must_use]
    pub fn gravity_leap(&self) -> Option<GravityLeap> {
        self.leaps.found()
    }

    /// Bias of the gyro that is another from one moment on, in a recording; `None` where axes or a scale are wrong, too.
    #[must_use]
    pub fn bias_change(&self) -> Option<BiasChange> {
        let is_judged = self.settled.is_none() && self.finer.is_none() && self.change.is_none();
        self.biases.found().filter(|_| is_judged)
    }

    /// Takes the next reading; one without numbers is passed over.
    pub fn push(&mut self, reading: &Reading) {
        let mut numbers = reading.gyro.as_vector().iter().chain(&reading.force);
        if !numbers.all(|number| number.is_finite()) {
            return;
        }
        match self.blocks.push(reading) {
            Step::Open => {}
            Step::Broken => self.run.clear(),
            Step::Full(block) => self.take(block),
        }
    }

    /// Breaks the run: what comes next does not follow.
    pub fn interrupt(&mut self) {
        self.blocks.interrupt();
        self.run.clear();
    }

    /// Disagreement that is seen; `None` where there is none, or too little motion to tell.
    #[must_use]
    pub fn disagreement(&self) -> Option<Disagreement> {
        if let Some(finer) = self.finer_at_the_end().or(self.finer) {
            return Some(finer.disagreement());
        }
        let is_open = self.axes_change().is_none();
        let verdict = self.settled.or(self.unexplained.filter(|_| is_open))?;
        let cause = match verdict.answer {
            Answer::Map(decided) => BANK
                .get(verdict.hypothesis)
                .and_then(|hypothesis| AxisMap::from_matrix(&hypothesis.map))
                .map(|map| {
                    (
                        Cause::Axes {
                            map,
                            decided,
                            scale: None,
                        },
                        verdict.found,
                    )
                }),
            Answer::Factor => self.refined(&verdict),
            Answer::Degrees => Some((
                Cause::Scale {
                    factor: DEGREE,
                    sigma: OF_UNIT,
                },
                verdict.found,
            )),
            Answer::EulerRates => Some((Cause::EulerRates, verdict.found)),
            Answer::Unturned => Some((Cause::Unturned, verdict.found)),
            Answer::Contradiction => None,
        };
        let (cause, cured) = cause.unwrap_or((Cause::Unknown, verdict.found));
        Some(Disagreement {
            cause,
            recorded: verdict.recorded,
            cured,
            segments: verdict.segments,
        })
    }

    /// Whether gravity wanders in the integrated frame as it does of no healthy sensor at ease: something is wrong, or the
    /// body is shaken.
    #[must_use]
    pub fn wanders(&self) -> bool {
        self.bank.is_some()
    }

    /// Median scatter of gravity in the last segments when true rates are `factor` times the recorded ones of
    /// other axes, g; `None` where there is nothing to judge by.
    #[must_use]
    pub fn scatter_by(&self, axes: AxisMap, factor: f64) -> Option<f64> {
        let map = axes.matrix() * factor;
        let found = refine::<3>(self.kept.iter(), &map, &[])?;
        Some(found.left).filter(|left| left.is_finite())
    }

    /// A map that the bank has not, by the last segments of a recording.
    fn finer_at_the_end(&self) -> Option<Finer> {
        if self.is_live || self.kept.len() < FINER_LEAST {
            return None;
        }
        let segments: Vec<&Segment> = self.kept.iter().collect();
        match self.bank {
            Some(_) => finer::finer(&segments, self.settled.as_ref()),
            None => finer::nearby(&segments, FINER_SCATTER),
        }
    }

    /// The factor near that of the bank which makes gravity stand still best.
    fn refined(&self, verdict: &Verdict) -> Option<(Cause, f64)> {
        let start = BANK.get(verdict.hypothesis)?.map;
        let found = refine::<4>(self.kept.iter(), &start, &[Matrix3::identity()])?;
        let factor = found.map[(0, 0)];
        let sigma = found.sigma[3] * start[(0, 0)] / factor;
        let is_sound = factor.is_finite() && factor > 0.0 && sigma.is_finite();
        is_sound.then_some((Cause::Scale { factor, sigma }, found.left))
    }

    fn take(&mut self, block: Block) {
        let length = block.force.norm();
        let gravity = match self.gravity {
            None => length,
            Some(gravity) if length > gravity => gravity * GRAVITY_STEP,
            Some(gravity) => gravity / GRAVITY_STEP,
        };
        self.gravity = (gravity > 0.0).then_some(gravity);
        if self.gravity.is_none() {
            return;
        }
        self.rest.push(&block, gravity);
        self.run.push(block);
        self.leaps.look(&self.run, gravity);
        let Some(start) = self.run.first().map(|first| first.start) else {
            return;
        };
        if block.end.since(start) >= SEGMENT_NANOS - SLACK_NANOS {
            self.close(gravity);
            self.run
                .retain(|block| block.start.since(start) >= HOP_NANOS - SLACK_NANOS);
        }
    }

    /// Lets go of what a healthy stream does not need.
    fn forget(&mut self, opens: bool) {
        let is_still = self.scattered.iter().all(|scattered| !scattered);
        if self.bank.is_none() && !opens && is_still {
            self.kept = VecDeque::new();
        }
        if self.moved >= OPEN_LEAST && is_still && self.says_nothing() && self.bank.is_some() {
            self.bank = None;
            self.moved = 0;
        }
    }

    /// Judges the segment that the run of blocks makes.
    fn close(&mut self, gravity: f64) {
        let bias = self.rest.bias();
        let sigma = bias.map_or(BIAS_FREE, |_| BIAS_KNOWN);
        let segment = Segment::new(&self.run, gravity, bias, sigma);
        if !segment.moves() {
            return;
        }
        let scatter = self.identity.push(&segment, |_| true).as_recorded();
        if let Some(found) = self.identity.last.filter(|_| !self.is_live) {
            let taken = bias.unwrap_or_else(Vector3::zeros);
            self.biases.push(&segment, taken, found);
        }
        if scatter <= GATE_SCATTER {
            self.sound.push(&self.run, &segment, gravity, bias);
        }
        self.scattered.push_back(scatter > GATE_SCATTER);
        if self.scattered.len() > GATE_LAST {
            self.scattered.pop_front();
        }
        self.kept.push_back(segment);
        let most = match self.bank.is_none() && self.is_live {
            true => GATE_BACK + 1,
            false => REFINED_BY,
        };
        if self.kept.len() > most {
            self.kept.pop_front();
        }
        let scattered = self.scattered.iter().filter(|s| **s).count() as f64;
        let opens = self.scattered.len() >= GATE_LEAST
            && scattered >= GATE_SHARE * self.scattered.len() as f64;
        self.moved += 1;
        if self.is_live {
            self.forget(opens);
        }
        match &mut self.bank {
            Some(bank) => self
                .kept
                .back()
                .into_iter()
                .for_each(|last| bank.push(last)),
            None if opens => {
                self.moved = 0;
                let bank = self.bank.insert(Evidence::new());
                let before = self.kept.len().saturating_sub(GATE_BACK + 1);
                let kept = self.kept.iter().skip(before);
                kept.for_each(|segment| bank.push(segment));
                self.judged = GATE_BACK.min(self.kept.len() - 1);
            }
            None => return,
        }
        let verdict = self.bank.as_ref().and_then(Evidence::verdict);
        self.held = verdict.map_or(0, |_| self.held + 1);
        self.look_for_change();
        if self.held >= HOLD {
            self.settled = verdict;
        }
        let unexplained = self.bank.as_ref().and_then(Evidence::unexplained);
        self.unexplained_held = unexplained.map_or(0, |_| self.unexplained_held + 1);
        if self.unexplained_held >= HOLD {
            self.unexplained = unexplained;
        }
        self.judged += 1;
        // The end of a recording judges all that is kept, which until then is all there was.
        let first = if self.is_live {
            FINER_FIRST
        } else {
            REFINED_BY
        };
        if self.judged >= first && self.judged.is_power_of_two() {
            let segments: Vec<&Segment> = self.kept.iter().collect();
            let known = self.finer.filter(|finer| finer.holds(&segments));
            self.finer = finer::finer(&segments, self.settled.as_ref()).or(known);
        }
    }

    /// Judges the parts of the recording by themselves, until a change is certain.
    fn look_for_change(&mut self) {
        if self.change_held >= HOLD {
            return;
        }
        let settled = self.settled.as_ref();
        let back = || {
            self.bank
                .as_ref()
                .zip(settled)
                .and_then(|(bank, settled)| change::back(bank, settled))
        };
        let away = self
            .bank
            .as_ref()
            .and_then(|bank| change::away(bank, &self.sound));
        let found = away.or_else(back);
        self.change_held = found.map_or(0, |_| self.change_held + 1);
        self.change = found;
    }
}
