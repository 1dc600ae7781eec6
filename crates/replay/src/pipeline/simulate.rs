//! A synthetic gyro -> the sinks of a run. I/O, but for the samples themselves.

use super::audience::Audience;
use super::delivery::{Delivery, Outlet, broken};
use super::position::Position;
use crate::error::{Error, Result};
use crate::sink::{Content, Flow, Options, Provenance, Stream, Target};
use crate::summary::simulation::SimulationSummary;
use std::sync::Arc;
use std::time::Instant;
use strapd_attitude::quaternion::BodyRate;
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, SampleKind, Status};
use strapd_bodies::synthetic::{Stretch, Synthetic, Truth};
use strapd_recording::attitude_line::{TRUTH_ID, truth_of};
use strapd_recording::pool::Pool;

/// The topic of the samples.
pub const TOPIC: &str = "/imu/data_raw";
/// The topic of the true attitude; the true rate is on `/truth/rate`.
pub(super) const TRUTH_TOPIC: &str = "/truth";
/// The topic of the magnetic field.
pub(super) const FIELD_TOPIC: &str = "/imu/mag";
/// Id of the samples in lines.
const ID: &str = "imu";

/// Instants made and written together, when nobody waits for them.
const BATCH: usize = 2048;
/// Data time made together when paced, s.
const PACED_SECS: f64 = 0.001;

/// A simulation to be done.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The name of the motion.
    pub name: String,
    /// The samples.
    pub source: Synthetic,
    /// Kind of the samples.
    pub kind: SampleKind,
    /// Rate, Hz.
    pub rate_hz: f64,
    /// Frame.
    pub frame_id: String,
    /// Id of the samples in lines, and beside `truth` that of the truth, instead of the usual.
    pub id: Option<String>,
    /// Targets.
    pub targets: Vec<Target>,
    /// Options by which outputs are made.
    pub options: Options,
    /// Audience that is served if a target listens.
    pub audience: Option<Arc<dyn Audience>>,
    /// `--speed`; `None` = as fast as possible.
    pub speed: Option<f64>,
    /// Everything that decides the samples, for the outputs' metadata and the summary.
    pub parameters: Vec<(String, String)>,
    /// Things to know about them.
    pub notes: Vec<String>,
}

/// Runs it.
///
/// # Errors
/// As [`crate::sink::Sink`].
pub fn run(
    mut simulation: Simulation,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<SimulationSummary> {
    let begun = Instant::now();
    let mut outlet = open(&simulation)?;
    let steps = simulation.source.count().saturating_sub(1);
    outlet.length(steps as f64 / simulation.rate_hz);
    let batch = batch(&simulation);
    let source = &mut simulation.source;
    let (mut stretch, mut truth) = (Stretch::default(), Vec::new());
    let mut reader_gone = false;
    while !reader_gone {
        let made = source
            .next_stretch(batch, &mut stretch)
            .map_err(|e| Error::usage(format!("simulate {}: {e}", simulation.name)))?;
        if made == 0 {
            break;
        }
        truth.clear();
        truth.extend(stretch.truth.iter().map(as_attitude));
        // Samples first: a stream of lines is told apart by its first one.
        let flow = outlet.write_raw(0, &stretch.samples, pool)?;
        reader_gone = flow == Flow::Closed || outlet.write(1, &truth, pool)? == Flow::Closed;
        let noticed = source.noticed();
        watch(&Position {
            fraction: Some(noticed.instants as f64 / source.count() as f64),
            data_secs: noticed.instants as f64 / simulation.rate_hz,
            samples: noticed.samples,
            written: noticed.samples,
            ..Position::default()
        });
    }
    let written = outlet.finish()?;
    let broken = broken(&written);
    let stamps_out_of_range = written.iter().map(|(_, w)| w.stamps_out_of_range).sum();
    Ok(SimulationSummary {
        name: simulation.name,
        noticed: simulation.source.noticed(),
        kind: simulation.kind,
        rate_hz: simulation.rate_hz,
        parameters: simulation.parameters,
        notes: simulation.notes,
        stamps_out_of_range,
        outputs: written
            .into_iter()
            .map(|(name, w)| (name, w.bytes, w.messages))
            .collect(),
        broken,
        reader_gone,
        elapsed_secs: begun.elapsed().as_secs_f64(),
    })
}

fn open(simulation: &Simulation) -> Result<Outlet> {
    Outlet::open(
        &simulation.targets,
        &[],
        simulation.options,
        &streams(simulation),
        &provenance(simulation),
        Delivery {
            out_rate: None,
            instants: None,
            speed: simulation.speed,
            audience: simulation.audience.clone(),
        },
    )
}

/// Samples that are made at once: few, where they leave at the pace of a clock.
fn batch(simulation: &Simulation) -> usize {
    match simulation.speed {
        None => BATCH,
        Some(speed) => ((simulation.rate_hz * speed * PACED_SECS) as usize).clamp(1, BATCH),
    }
}

fn streams(simulation: &Simulation) -> [Stream; 2] {
    let has_field = simulation.source.magnetometer().is_some();
    let samples = Stream {
        content: Content::Samples(simulation.kind),
        id: simulation.id.clone().unwrap_or_else(|| ID.to_owned()),
        output_topic: TOPIC.to_owned(),
        field_topic: has_field.then(|| FIELD_TOPIC.to_owned()),
        world_axes: "enu".to_owned(),
        ..Stream::new(TOPIC, &simulation.frame_id)
    };
    let truth = Stream {
        content: Content::Truth,
        id: match &simulation.id {
            Some(id) => truth_of(id),
            None => TRUTH_ID.to_owned(),
        },
        output_topic: TRUTH_TOPIC.to_owned(),
        field_topic: None,
        ..samples.clone()
    };
    [samples, truth]
}

/// The parameters, and what they need to be understood. Nothing of where the outputs go: the same
/// parameters are the same bytes.
fn provenance(simulation: &Simulation) -> Provenance {
    let fixed = [
        ("version", env!("CARGO_PKG_VERSION")),
        ("motion", &simulation.name),
        ("topic", TOPIC),
        ("truth_topic", TRUTH_TOPIC),
        ("rotates", "sensor_to_world"),
        ("world", "enu"),
        ("body", "flu"),
        ("sample_kind", simulation.kind.name()),
    ];
    let fixed = fixed
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value.to_owned()));
    Provenance {
        metadata: fixed.chain(simulation.parameters.iter().cloned()).collect(),
    }
}

/// Truth as an attitude nothing is uncertain about.
fn as_attitude(truth: &Truth) -> AttitudeSample {
    AttitudeSample {
        stamp: truth.stamp,
        q_nb: truth.spin.q_nb,
        rate: BodyRate(truth.spin.w_nb_b),
        accel: None,
        linear_acceleration: None,
        covariance: AttitudeCovariance::default(),
        status: Status::OK,
        reset_count: 0,
        log: truth.stamp,
        temperature: None,
    }
}
