//! Sensors, clients, channels and the simulation of a hub. Locks.
//!
//! Apart from the hub because each has its own locks, and none of them names another.

use super::places::Absent;
use super::truth::Truth;
use super::{Client, Sensor};
use crate::serve::core::channel::Channel;
use crate::serve::core::state;
use crate::serve::protocol::position::Timeline;
use crate::sink::{ChildFrames, FrameNames};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64};
use std::sync::{Arc, Mutex, RwLock};
use strapd_attitude::estimate::EstimationSettings;
use tokio::sync::Notify;

/// Sensors, those that are there and those that were.
#[derive(Debug)]
pub(super) struct SensorTable {
    plan: EstimationSettings,
    /// Plans of sensors that have their own.
    plans: BTreeMap<String, EstimationSettings>,
    pub(super) by_id: RwLock<BTreeMap<Arc<str>, Arc<Mutex<Sensor>>>>,
    /// Attitudes of sensors that are not there.
    pub(super) absent: Mutex<Absent>,
    /// Sensors that gave way last.
    pub(super) gave_way: Mutex<VecDeque<Arc<str>>>,
    /// Count of what is heard of sensors.
    pub(super) heard: AtomicU64,
    /// Count of the calls of [`Hub::forget_silent`](super::Hub::forget_silent).
    pub(super) tick: AtomicU64,
    /// Some sensor's samples wait for the unit of their stamps.
    pub(super) stamps_wait: AtomicBool,
}

impl SensorTable {
    pub(super) fn new(
        plan: EstimationSettings,
        plans: BTreeMap<String, EstimationSettings>,
        saved: state::Sensors,
    ) -> SensorTable {
        SensorTable {
            plan,
            plans,
            by_id: RwLock::default(),
            absent: Mutex::new(Absent::new(saved)),
            gave_way: Mutex::default(),
            heard: AtomicU64::new(0),
            tick: AtomicU64::new(0),
            stamps_wait: AtomicBool::new(false),
        }
    }

    /// Settings by which the samples of this sensor are understood.
    pub(super) fn plan_of(&self, id: &str) -> &EstimationSettings {
        self.plans.get(id).unwrap_or(&self.plan)
    }
}

/// Clients, and which of them watch.
#[derive(Debug, Default)]
pub(super) struct ClientTable {
    pub(super) by_number: RwLock<BTreeMap<u64, Arc<Client>>>,
    pub(super) watchers: RwLock<Arc<[Arc<Client>]>>,
    /// A watcher has room again.
    pub(super) room_made: Arc<Notify>,
    /// Number given last.
    pub(super) last: AtomicU64,
}

/// Channels, as viewers know the streams.
#[derive(Debug, Default)]
pub(super) struct ChannelTable {
    pub(super) by_number: RwLock<BTreeMap<u32, Arc<Channel>>>,
    /// Number given last.
    pub(super) last: AtomicU32,
    /// Child frames of the transforms of all channels.
    pub(super) child_frames: Mutex<ChildFrames>,
    /// Names of the frames of sensors, and the transforms between them.
    pub(super) frames: FrameNames,
}

/// The replay or simulation behind what is served.
#[derive(Debug)]
pub(super) struct Simulation {
    /// Timeline of the replay that is served, which is then the only source.
    pub(super) timeline: Option<Arc<dyn Timeline>>,
    /// Samples can be watched, too.
    pub(super) brings_samples: bool,
    /// True attitudes by simulations, by `id`.
    pub(super) truths: Mutex<BTreeMap<String, Truth>>,
}
