//! Settings of a hub. Data.

use crate::serve::core::reading::LineParameters;
use crate::serve::core::{recorder, state};
use crate::serve::guard::admission::Token;
use crate::serve::guard::limits::Limits;
use crate::serve::protocol::position::Timeline;
use crate::sink::FrameNames;
use std::collections::BTreeMap;
use std::sync::Arc;
use strapd_attitude::estimate::EstimationSettings;

/// Settings of a hub.
#[derive(Debug, Default)]
pub struct Settings {
    /// Options by which lines are read, for every sensor: that is done before it is known whose they are.
    pub decode: strapd_recording::decode::Options,
    /// Way in which lines are read where their address says nothing else.
    pub lines: LineParameters,
    /// Settings by which samples are understood and integrated.
    pub plan: EstimationSettings,
    /// Settings for sensors that are understood in another way, by `id`.
    pub plans: BTreeMap<String, EstimationSettings>,
    /// Names of the frames of sensors, and the transforms between them.
    pub frames: FrameNames,
    /// The bounds.
    pub limits: Limits,
    /// Token that clients must show.
    pub token: Option<Token>,
    /// Recorder of everything that goes through.
    pub recorder: Option<recorder::Handle>,
    /// The attitudes sensors had before the daemon was restarted.
    pub saved: state::Sensors,
    /// The replay that is served; no samples are taken then.
    pub timeline: Option<Arc<dyn Timeline>>,
    /// Whether what is served brings samples beside attitudes: clients may ask for them before the first stream is
    /// there.
    pub brings_samples: bool,
}
