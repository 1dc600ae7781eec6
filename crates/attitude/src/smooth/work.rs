//! Samples -> the best that the whole recording says of them. Pure.
//!
//! Apart from its parts because this is their order, and what becomes of a part that leads nowhere.

use super::border::{ALL, NARROW, Priors, WIDE};
use super::error::SmoothError;
use super::factors::Node;
use super::heading::{FieldTrust, sections, turn_north};
use super::motion::Bound;
use super::pass::by_segment;
use super::phase::{Failure, Phase, Problem, State, run};
use super::planar::{Along, HeldBias, Main, headed};
use super::prepare::Preparer;
use super::prepared::Prepared;
use super::realtime::{self, Realtime};
use super::rests::{keep_rests, rests};
use super::result::{Calibration, Counts, Outcome, Section};
use super::sample::Samples;
use super::segments::{Cutter, STILL_RATE, Segment, find_standstill};
use super::settings::{HeadingReference, Settings};
use super::smoothed::{ANY_HEADING, Smoothed};
use super::solver::Marginal;
use super::start::forward;
use super::survey::Survey;
use super::sweep::{Sensor, sweep};
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};

/// The stillest segment is at rest if its mean rate is this near to the filter's bias, rad/s.
const NEAR: f64 = 2.0_f64.to_radians();
/// The field may be another while a log moves that rests in more segments than this.
const RESTS: usize = 10;

/// Smooths a recording.
///
/// # Errors
/// [`SmoothError`]: samples that cannot be read, or are too few. A recording that the smoother cannot make sense of
/// is none: see [`Smoothed::outcome`].
pub fn smooth<S: Samples>(
    samples: &mut S,
    settings: &Settings,
) -> Result<Smoothed, SmoothError<S::Error>> {
    if let Some((name, value)) = settings.fault() {
        return Err(SmoothError::Setting { name, value });
    }
    let survey = Survey::of(samples, settings).map_err(SmoothError::Read)?;
    if survey.accepted < 2 {
        return Err(SmoothError::TooFew {
            samples: survey.samples,
            forceless: survey.forceless,
        });
    }
    let spacing = settings.spacing(survey.secs);
    let (mut segments, first, bridged) =
        cut(samples, (&survey, settings), spacing).map_err(SmoothError::Read)?;
    find_standstill(&mut segments);
    let still = keep_rests(&mut segments, settings.bias_sigma);
    let work = Work {
        survey,
        settings: *settings,
        segments,
        first,
        bridged,
        spacing,
    };
    work.smoothed(samples, still).map_err(SmoothError::Read)
}

fn cut<S: Samples>(
    samples: &mut S,
    (survey, settings): (&Survey, &Settings),
    spacing: f64,
) -> Result<(Vec<Segment>, i64, u64), S::Error> {
    let mut cutter = Cutter::new(spacing);
    let mut preparer = Preparer::new(survey, settings);
    let (mut ready, mut bridged) = (Vec::new(), 0);
    let mut take = |ready: &mut Vec<Prepared>| {
        for sample in ready.drain(..) {
            bridged += u64::from(sample.is_bridged);
            cutter.take(&sample);
        }
    };
    samples.pass(&mut |chunk| {
        preparer.push(chunk, &mut ready);
        take(&mut ready);
    })?;
    preparer.finish(&mut ready);
    take(&mut ready);
    let (segments, first) = cutter.finish();
    Ok((segments, first, bridged))
}

/// A recording of which nodes and standstills are known.
struct Work {
    survey: Survey,
    settings: Settings,
    segments: Vec<Segment>,
    first: i64,
    bridged: u64,
    spacing: f64,
}

/// Solution of a phase, and what it states of the nodes.
struct Solved {
    state: State,
    covariance: Vec<Vec<f64>>,
    marginals: Vec<Marginal>,
    outcome: Outcome,
    iterations: [u64; 2],
    held: Option<HeldBias>,
}

impl Solved {
    fn of<const W: usize>(
        state: State,
        phase: &Phase<W>,
        iterations: [u64; 2],
        doubt: Option<&[[f64; ALL]]>,
    ) -> Result<Solved, Failure> {
        let solver = phase.solver.as_ref();
        let known = solver.and_then(|solver| solver.covariance(doubt));
        let (covariance, marginals) = known.ok_or(Failure::NotFinite)?;
        let unsettled = phase.unsettled(&marginals);
        Ok(Solved {
            outcome: unsettled.map_or(Outcome::Converged, Outcome::Unsettled),
            state,
            covariance,
            marginals,
            iterations,
            held: None,
        })
    }
}

impl Work {
    fn with(&self) -> (&Survey, &Settings) {
        (&self.survey, &self.settings)
    }

    fn smoothed<S: Samples>(
        self,
        samples: &mut S,
        still: Option<Vector3<f64>>,
    ) -> Result<Smoothed, S::Error> {
        let stills = self.segments.iter().filter(|segment| segment.is_still);
        let is_separate = self.settings.heading_reference == HeadingReference::Standstill
            && stills.count() > RESTS;
        let priors = Priors::new(&self.settings, is_separate);
        let trust = FieldTrust::new(self.settings.heading_reference, self.spacing);
        let known = self.settings.bias_sigmas();
        let problem = |bias: Vector3<f64>, along: Option<Along>| Problem {
            survey: &self.survey,
            settings: &self.settings,
            segments: &self.segments,
            priors: &priors,
            trust: &trust,
            bias: self.settings.bias_beforehand(&bias),
            bias_sigma: known,
            along,
        };
        let mut filter = None;
        let mut starts = Vec::new();
        match still {
            Some(bias) => {
                starts.push((bias, forward(samples, self.with(), &self.segments, &bias)?))
            }
            None => {
                filter = self.filtered(samples)?;
                for bias in self.biases(filter.as_ref()) {
                    let nodes = match &filter {
                        Some(filter) => filter.nodes.clone(),
                        None => forward(samples, self.with(), &self.segments, &bias)?,
                    };
                    starts.push((bias, nodes));
                }
            }
        }
        let mut best: Option<(Problem<'_>, State, Phase<NARROW>, Option<HeldBias>)> = None;
        let rests = rests(&self.segments);
        let mut main = None;
        for (bias, nodes) in starts {
            let upright = Main::of(&self.segments, &nodes);
            let held = upright
                .as_ref()
                .and_then(|main| main.by_rests(&rests, &known, self.settings.bias_sigma));
            let along = held.map(|held| held.along());
            // What the filter found in a motion has no weight of its own: the equations have that motion as well.
            let beforehand = match still.is_none() && upright.is_none() {
                true => Vector3::zeros(),
                false => bias,
            };
            let problem = problem(beforehand, along.or(upright.map(|main| main.free())));
            let nodes: Vec<_> = nodes.into_iter().map(|q| (q, bias)).collect();
            let mut state = self.state(nodes, &trust);
            state.bound.is_leaning = upright.is_none();
            let phase = run::<S, NARROW>(samples, &problem, &mut state, self.settings.iterations)?;
            let is_better = best.as_ref().is_none_or(|(_, _, other, _)| {
                (phase.failure.is_none(), -phase.cost) > (other.failure.is_none(), -other.cost)
            });
            if is_better {
                main = upright;
                best = Some((problem, state, phase, held));
            }
        }
        if let (Some(main), Some((problem, state, phase, held @ None))) = (main, &mut best)
            && !matches!(phase.failure, Some(Failure::Strays(_)))
        {
            let mut iterations = phase.iterations;
            let mut again = None;
            if let (Some(_), Some(filter)) = (phase.failure, &filter) {
                // The filter's heading may be any number of turns off: that of the gyro alone is not.
                let found = main.by_motion(&self.segments, None, Some(filter), &known);
                let bias = found.put_in(&filter.bias);
                let headings = forward(samples, self.with(), &self.segments, &bias)?;
                let nodes = headed(&filter.nodes, &headings).into_iter();
                let nodes: Vec<_> = nodes.map(|q| (q, bias)).collect();
                *state = self.state(nodes.clone(), &trust);
                *phase = run::<S, NARROW>(samples, problem, state, self.settings.iterations)?;
                iterations += phase.iterations;
                again = Some(nodes);
            }
            let solver = phase.solver.as_ref().filter(|_| phase.failure.is_none());
            let covariance = solver.and_then(|solver| solver.covariance(None));
            let solved = covariance
                .as_ref()
                .map(|(_, left)| (&state.nodes[..], &left[..]));
            let found = main.by_motion(&self.segments, solved, filter.as_ref(), &known);
            let nodes = match (solved, again) {
                (None, Some(nodes)) => nodes,
                _ => found.begun(&self.segments, &state.nodes),
            };
            problem.along = Some(found.along());
            *held = Some(found);
            *state = self.state(nodes, &trust);
            *phase = run::<S, NARROW>(samples, problem, state, self.settings.iterations)?;
            phase.iterations += iterations;
        }
        let Some((problem, state, phase, held)) = best else {
            return self.fallen_back(samples, filter, Failure::NotFinite, &priors);
        };
        if let Some(failure) = phase.failure {
            return self.fallen_back(samples, filter, failure, &priors);
        }
        let solved = self.with_field(samples, &problem, (state, held), phase)?;
        match solved {
            Ok(solved) => Ok(self.finish(solved, &priors)),
            Err(failure) => self.fallen_back(samples, filter, failure, &priors),
        }
    }

    /// The real-time filter's view where nothing rests. A body that leans shows its bias to the filter that expects no
    /// more than the class has; with a wide prior the heading may be off by turns.
    fn filtered<S: Samples>(&self, samples: &mut S) -> Result<Option<Realtime>, S::Error> {
        let filter = realtime::run(samples, self.with(), &self.segments)?;
        let leans = |filter: &Realtime| Main::of(&self.segments, &filter.nodes).is_none();
        if !filter.as_ref().is_some_and(leans) {
            return Ok(filter);
        }
        let by_class = realtime::run_by_class(samples, self.with(), &self.segments)?;
        Ok(by_class.filter(leans).or(filter))
    }

    /// Prior of the gyro's bias where nothing rests.
    fn biases(&self, filter: Option<&Realtime>) -> Vec<Vector3<f64>> {
        let inner = self.segments.iter().filter(|segment| !segment.is_break);
        let stillest = inner.min_by(|a, b| a.spread[0].total_cmp(&b.spread[0]));
        match (stillest, filter) {
            (None, None) => vec![Vector3::zeros()],
            (Some(segment), None) => vec![segment.mean_rate],
            (None, Some(filter)) => vec![filter.bias],
            (Some(segment), Some(filter)) if segment.spread[0] >= STILL_RATE => vec![filter.bias],
            (Some(segment), Some(filter)) if (segment.mean_rate - filter.bias).norm() < NEAR => {
                vec![segment.mean_rate]
            }
            (Some(segment), Some(filter)) => vec![filter.bias, segment.mean_rate],
        }
    }

    fn state(&self, nodes: Vec<([f64; 4], Vector3<f64>)>, trust: &FieldTrust) -> State {
        let node = |(q, bias)| Node {
            q,
            velocity: Vector3::zeros(),
            position: Vector3::zeros(),
            bias,
        };
        State {
            bound: Bound::new(self.settings.motion, nodes.len()),
            nodes: nodes.into_iter().map(node).collect(),
            constants: [0.0; ALL],
            field_weights: trust.first(&self.segments),
            has_north: Vec::new(),
        }
    }

    /// The phase with the field, where there is one. Where it leads nowhere so do the attitudes without it: what is
    /// solved without a north is turned by one wherever the gyro has brought it.
    fn with_field<S: Samples>(
        &self,
        samples: &mut S,
        problem: &Problem<'_>,
        (mut state, held): (State, Option<HeldBias>),
        plain: Phase<NARROW>,
    ) -> Result<Result<Solved, Failure>, S::Error> {
        let mut iterations = [plain.iterations as u64, 0];
        let doubt = problem.priors.doubt(&self.settings);
        let has_north = turn_north(
            &self.segments,
            &plain.fields,
            &state.field_weights,
            &mut state.nodes,
            &mut state.constants,
        );
        state.has_north = has_north;
        // Now the field tells the heading.
        state.bound.is_leaning = false;
        if !state.has_north.contains(&true) || self.settings.field_iterations == 0 {
            let mut solved = Solved::of(state, &plain, iterations, doubt.as_deref());
            if let (Ok(solved), Some(held)) = (&mut solved, held) {
                held.widen(&self.segments, &mut solved.marginals);
                solved.held = Some(held);
            }
            return Ok(solved);
        }
        drop(plain);
        let phase = run::<S, WIDE>(samples, problem, &mut state, self.settings.field_iterations)?;
        iterations[1] = phase.iterations as u64;
        Ok(match phase.failure {
            Some(failure) => Err(failure),
            None => Solved::of(state, &phase, iterations, doubt.as_deref()),
        })
    }

    /// The real-time filter's attitudes; the forward pass's where even that has none.
    fn fallen_back<S: Samples>(
        self,
        samples: &mut S,
        filter: Option<Realtime>,
        failure: Failure,
        priors: &Priors,
    ) -> Result<Smoothed, S::Error> {
        let filter = match filter {
            Some(filter) => Some(filter),
            None => realtime::run(samples, self.with(), &self.segments)?,
        };
        let unknown = Matrix3::from_diagonal_element(ANY_HEADING * ANY_HEADING);
        let filter = match filter {
            Some(filter) => filter,
            None => {
                let nodes = forward(samples, self.with(), &self.segments, &Vector3::zeros())?;
                Realtime {
                    covariances: vec![unknown; nodes.len()],
                    nodes,
                    bias: Vector3::zeros(),
                    bias_sigma: self.settings.bias_sigmas(),
                }
            }
        };
        let bias = filter.bias_sigma.map(|sigma| sigma * sigma).into();
        let marginals = filter
            .covariances
            .iter()
            .map(|turn| Marginal {
                turn: *turn,
                bias,
                by_class: Matrix3::zeros(),
            })
            .collect();
        let trust = FieldTrust::new(self.settings.heading_reference, self.spacing);
        let nodes = filter.nodes.into_iter().map(|q| (q, filter.bias));
        let mut state = self.state(nodes.collect(), &trust);
        let outcome = Outcome::Filter(failure);
        if self.survey.fields > 0 {
            let fields = self.fields(samples, &state.nodes)?;
            state.has_north = turn_north(
                &self.segments,
                &fields,
                &state.field_weights,
                &mut state.nodes,
                &mut state.constants,
            );
            state.constants = [0.0; ALL];
        }
        let solved = Solved {
            state,
            covariance: Vec::new(),
            marginals,
            outcome,
            iterations: [0; 2],
            held: None,
        };
        Ok(self.finish(solved, priors))
    }

    /// Mean field of each segment with these attitudes.
    fn fields<S: Samples>(
        &self,
        samples: &mut S,
        nodes: &[Node],
    ) -> Result<Vec<Option<[f64; 3]>>, S::Error> {
        let sensor = Sensor::of(&[0.0; ALL], self.survey.force);
        let mut fields = Vec::with_capacity(self.segments.len());
        by_segment(samples, self.with(), &self.segments, |k, held| {
            let Some(k) = k else { return };
            let swept = sweep::<false>(held, &nodes[k].q, &nodes[k].bias, &sensor);
            let has_field = swept.field.samples > 0.0 && !self.segments[k].is_break;
            fields.push(has_field.then_some(swept.field.measured));
        })?;
        Ok(fields)
    }

    fn finish(self, solved: Solved, priors: &Priors) -> Smoothed {
        let Solved {
            state,
            covariance,
            marginals,
            outcome,
            iterations,
            held,
        } = solved;
        let stamp = |node: usize| {
            Nanos(
                node.checked_sub(1)
                    .and_then(|k| self.segments.get(k))
                    .map_or(self.first, |segment| segment.stamp),
            )
        };
        let sections: Vec<Section> = sections(&self.segments)
            .into_iter()
            .enumerate()
            .map(|(i, (first, last))| Section {
                start: stamp(first),
                end: stamp(last),
                has_north: state.has_north.get(i).copied().unwrap_or(false),
            })
            .collect();
        let counts = Counts {
            samples: self.survey.samples,
            rejected: self.survey.samples - self.survey.accepted,
            forceless: self.survey.forceless,
            segments: self.segments.len() as u64,
            standstills: self
                .segments
                .iter()
                .filter(|segment| segment.is_still)
                .count() as u64,
            bridged: self.bridged,
            breaks: sections.len() as u64 - 1,
            iterations,
            quantisation: self.survey.quantisation,
        };
        Smoothed {
            calibration: Calibration::of(
                &state.constants,
                &covariance,
                priors,
                self.survey.field_scale,
            ),
            survey: self.survey,
            settings: self.settings,
            segments: self.segments,
            nodes: state.nodes,
            constants: state.constants,
            marginals,
            first: self.first,
            sections,
            outcome,
            bound: state.bound.sigma,
            held,
            counts,
        }
    }
}
