//! Raw samples of one sensor -> attitudes, live. Pure.
//!
//! The estimator is the one of a replay; what differs is decided here: the method needs no later
//! sample, no sample is held back, nothing is looked at before the first attitude leaves, and senders
//! come and go ([`run`]).
//!
//! Long because a sensor is one state: which sample is its next and what is known of it are read from the same fields. What
//! is decided without them, and who continues it, is in the files below.

mod arrival;
pub(super) mod attitude_now;
mod doubting;
pub(super) mod doubts;
mod intervals;
mod joining;
mod losing;
mod meaning;
mod pace;
pub(in crate::serve::core) mod resetting;
pub mod run;
mod stamp_unit;
pub mod stamps;
mod still_stamps;

use crate::pipeline::session_builder::labelled;
use crate::report::calibration;
use crate::serve::core::channel::Channel;
use crate::serve::core::channel::health::Health;
use crate::serve::core::recorder::stream_of;
use crate::serve::core::state::Saved;
use crate::serve::guard::fault::Fault;
use crate::sink::Stream;
use arrival::Arrivals;
use attitude_now::attitude_now;
use doubting::Logged;
use doubts::Doubts;
use intervals::Intervals;
use joining::Joining;
pub use losing::Fate;
use losing::Losing;
use meaning::declared;
use pace::Pace;
use resetting::Resetting;
use run::SampleRun;
use stamp_unit::StampUnit;
use stamps::{Stamps, TimedSamples};
use std::collections::VecDeque;
use std::sync::Arc;
use still_stamps::StillStamps;
use strapd_attitude::aid::{OutsideHeading, OutsideHeadingCounts};
use strapd_attitude::condition::{Report, StampRepair};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::estimate::{Aid, EstimationSettings, Memory};
use strapd_attitude::estimate::{Meaning, Prepared, SensorCalibration, at_once, learned};
use strapd_attitude::propagate::{Method, Sequential};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeSample, Counts, Nanos, RawSample, Verdict};
use strapd_attitude::record::{Declared, TimeUnit};
use strapd_attitude::setting::MEND;
use strapd_recording::decode::{Ambiguous, Line};
use strapd_recording::recording::early_besides;

/// Bit that says that unused forces were logged; the bits below are verdicts.
const FORCES: u32 = 1 << 31;

/// Numbers a sample may come behind its turn. Further back, the sender counts anew.
const OVERTAKEN: u64 = 64;

/// One sensor: its estimator, what its attitudes are called, and what has been said of it.
#[derive(Debug)]
pub struct SensorStream {
    id: Arc<str>,
    estimator: Estimator,
    channel: Arc<Channel>,
    resolved: Meaning,
    prepared: Prepared,
    /// Progress of a sender that has just come, whose first stamp is still to decide where it stands.
    joining: Joining,
    /// Whether its sender may still state another meaning than the one before: none of its rates have come.
    is_meaning_open: bool,
    /// State to go on from, until a stamp has decided that.
    saved: Option<Saved>,
    /// The unit of stamps that do not say theirs.
    stamps: Stamps,
    /// Clock of samples that have no stamp but their arrival.
    arrivals: Option<Box<Arrivals>>,
    /// Fault to report of them.
    ambiguous: Option<Fault>,
    /// Why there is no unit.
    why_no_stamp: Option<String>,
    /// Whether the samples' intervals can be true.
    intervals: Intervals,
    /// Check of the unit of its stamps.
    stamp_unit: StampUnit,
    /// Check that its stamps go on.
    still_stamps: StillStamps,
    /// Findings about its samples; `None` of one of so many that they are not watched.
    doubts: Option<Box<Doubts>>,
    /// Findings from its counts that are in the log.
    logged: Logged,
    /// Speed of its stamps beside their arrivals.
    pace: Pace,
    /// Reset that was asked of it.
    resetting: Resetting,
    /// First stamp of the run.
    first: Option<Nanos>,
    /// Runs begun by a connection since the start.
    runs: u64,
    /// Number of the next attitude, and of the first since the start.
    next_seq: u64,
    first_seq: u64,
    /// The sender's number expected next.
    expected: Option<u64>,
    /// Samples that by the sender's numbers did not come in their turn: never, or late.
    missing: u64,
    last: Option<AttitudeSample>,
    /// Distance of a step from the ordinary one, s, smoothed over about 16 steps.
    jitter_secs: f64,
    /// Verdicts that were said to who sends it, as bits, and what was counted when it came.
    told: u32,
    counted: Counts,
    losing: Losing,
    /// Specific forces came that this attitude cannot use.
    has_unused_forces: bool,
    /// Forces and fields that came before the first rate, the last few.
    early: VecDeque<RawSample>,
}

/// The plan as it is for live streams: `auto` is the method without latency.
///
/// # Errors
/// In words, with the flag that helps: what a live stream cannot do.
pub fn live_plan(plan: &EstimationSettings) -> Result<EstimationSettings, Diagnostic> {
    if plan.mend {
        let what = format!("{MEND}: what a recording tells as a whole, a live stream cannot");
        return Err(Diagnostic::new(what).help("give the settings that its findings name"));
    }
    let mut plan = plan.clone();
    if plan.method == Method::Auto {
        plan.method = Method::COMMIT;
    }
    let resolved = Meaning::new(&plan, &Declared::default());
    // An orientation and a specific force, so that only what no sample can bring is refused.
    let sample = RawSample {
        accel: Some([0.0, 0.0, 9.81]),
        orientation: Some(
            Quaternion::<strapd_attitude::frames::Nav, strapd_attitude::frames::Body>::identity()
                .wxyz(),
        ),
        ..RawSample::default()
    };
    let prepared = at_once(&plan, &resolved, &[sample])?;
    Estimator::live(&plan, &resolved, &prepared)?;
    Ok(plan)
}

impl SensorStream {
    /// Makes one for the sensor `id`, whose first line states `stated` and brings `together`. `plan` is a
    /// [`live_plan`]. It goes on from `saved`, where there is such and the stamps do; if `is_watched`, its samples are
    /// doubted; `declare` makes its labels known to clients.
    ///
    /// # Errors
    /// The fault to answer with: the samples do not fit the plan.
    pub fn new(
        plan: &EstimationSettings,
        id: Arc<str>,
        stated: &Line,
        together: &[RawSample],
        (saved, is_watched): (Option<Saved>, bool),
        declare: impl FnOnce(&Stream) -> Arc<Channel>,
    ) -> Result<SensorStream, Fault> {
        let fault = |what: Diagnostic| Fault {
            id: Some(id.to_string()),
            ..Fault::new("not_ready", what.to_string())
        };
        let resolved = Meaning::new(plan, &declared(stated));
        let memory = saved.as_ref().and_then(Saved::memory);
        let plan = &expecting(plan, memory.is_some_and(Memory::has_forces_beside));
        let mut prepared = at_once(plan, &resolved, together).map_err(fault)?;
        prepared.has_arrival = plan.stamps == StampRepair::Auto;
        prepared.batches = saved
            .as_ref()
            .and_then(Saved::batches)
            .filter(|_| prepared.has_arrival);
        let mut estimator = Estimator::live(plan, &resolved, &prepared).map_err(fault)?;
        let known = plan.calibration.as_deref();
        prepared
            .warnings
            .extend(known.and_then(|known| known.mismatch(&id)).map(Into::into));
        let labels = labelled(stream_of(&id), plan, &resolved, &prepared);
        let saved = saved.filter(|saved| match saved.attitude(&labels) {
            Ok(_) => true,
            Err(why) => {
                prepared.warnings.push(why);
                false
            }
        });
        let first_seq = saved.as_ref().map_or(0, Saved::next_seq);
        let before = saved.as_ref().and_then(Saved::lasting);
        let doubts =
            is_watched.then(|| Box::new(Doubts::new(&resolved, &prepared, &mut estimator, before)));
        Ok(SensorStream {
            channel: declare(&labels),
            id,
            estimator,
            doubts,
            logged: Logged::default(),
            pace: Pace::default(),
            resolved,
            prepared,
            joining: Joining::Undecided,
            is_meaning_open: true,
            stamps: Stamps::new(saved.as_ref().and_then(Saved::unit)),
            arrivals: None,
            ambiguous: None,
            why_no_stamp: None,
            intervals: Intervals::default(),
            stamp_unit: StampUnit::default(),
            still_stamps: StillStamps::default(),
            resetting: Resetting::default(),
            saved,
            first: None,
            runs: 0,
            next_seq: first_seq,
            first_seq,
            expected: None,
            missing: 0,
            last: None,
            jitter_secs: 0.0,
            told: 0,
            counted: Counts::default(),
            losing: Losing::default(),
            has_unused_forces: false,
            early: VecDeque::new(),
        })
    }

    /// Channel as clients know it.
    #[must_use]
    pub fn channel(&self) -> &Arc<Channel> {
        &self.channel
    }

    /// Name.
    #[must_use]
    pub fn id(&self) -> &Arc<str> {
        &self.id
    }

    /// Labels in a recording.
    #[must_use]
    pub fn recorded(&self) -> crate::sink::Stream {
        self.channel.stream().clone()
    }

    /// State that a daemon after this one needs to go on; `None` before the first attitude.
    #[must_use]
    pub fn saved(&self) -> Option<Saved> {
        if let Some(saved) = &self.saved {
            return Some(saved.clone());
        }
        let saved = Saved::new(self.last.as_ref()?, self.channel.stream());
        let saved = saved.in_run(
            self.first,
            self.next_seq,
            self.stamps.unit(),
            self.estimator.memory(),
        );
        let saved = saved.with_batches(self.conditioning().batches);
        Some(saved.with_lasting(self.doubts.as_ref().and_then(|doubts| doubts.lasting())))
    }

    /// Calibration of the sensor by now. `plan` is that of [`SensorStream::new`].
    #[must_use]
    pub fn calibration(&self, plan: &EstimationSettings) -> SensorCalibration {
        let filter = self.estimator.filter();
        let known = learned((plan, &self.resolved, &self.prepared), filter, None);
        calibration::described(known, &self.id, "live", self.last.as_ref())
    }

    /// The samples of a run whose stamps are known by now: `None` where these are all that came, as they
    /// are. Those whose stamps are bare numbers wait for the unit of all.
    pub fn stamped(&mut self, run: &SampleRun<'_>) -> Option<TimedSamples> {
        self.stamp_unit.state(run.head.stamp_unit);
        let bare = run.bare.iter().flatten().next();
        let is_stamped = bare.is_some() || run.samples.iter().any(|raw| raw.header.is_some());
        if run.by_arrival && !is_stamped {
            let arrivals = self.arrivals.get_or_insert_default();
            return Some(arrivals.take(run.lines, run.samples, run.received));
        }
        if self.joining == Joining::Undecided
            && let Some(bare) = bare
            && !self.continues(*bare)
        {
            self.stamps.reopen();
        }
        let (taken, why) = self
            .stamps
            .take(run.lines, run.samples, run.bare, run.received);
        self.doubt(why);
        taken
    }

    /// Whether samples wait for the unit of their stamps.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.stamps.is_waiting() || self.arrivals.as_ref().is_some_and(|a| a.is_waiting())
    }

    /// Whether some have waited for the unit of their stamps for long enough.
    #[must_use]
    pub fn is_overdue(&self, now: Nanos) -> bool {
        let arrivals = self.arrivals.as_ref();
        self.stamps.is_overdue(now) || arrivals.is_some_and(|a| a.is_overdue(now))
    }

    /// Takes those that wait for the unit of their stamps, when nobody is to wait any longer.
    pub fn overdue(&mut self) -> TimedSamples {
        if let Some(arrivals) = self.arrivals.as_mut().filter(|a| a.is_waiting()) {
            return arrivals.release();
        }
        let (taken, why) = self.stamps.release(true);
        self.doubt(why);
        taken
    }

    fn doubt(&mut self, why: Option<Ambiguous>) {
        let Some(why) = why else { return };
        // Not said of each of them once more.
        self.told |= 1 << Verdict::NoStamp as u32;
        self.why_no_stamp = Some(why.to_string());
        self.ambiguous = Some(Fault {
            id: Some(self.id.to_string()),
            ..Fault::new("ambiguous_stamp", why.to_string())
        });
    }

    /// Takes samples in the order they came, by the `plan` of [`SensorStream::new`]. The attitudes they
    /// give come from `attitudes`.
    pub fn take(&mut self, plan: &EstimationSettings, seq: Option<u64>, samples: &[RawSample]) {
        if let Some(seq) = seq {
            let expected = self.expected.unwrap_or(seq);
            self.missing = self.missing.saturating_add(seq.saturating_sub(expected));
            // One that was overtaken, or came twice, is no new beginning.
            if seq >= expected || expected - seq > OVERTAKEN {
                self.expected = Some(seq.saturating_add(1));
            }
        }
        if self.joining == Joining::Joined {
            for raw in self.early.drain(..) {
                self.estimator.take(&raw);
            }
        }
        for raw in samples {
            if raw.is_beside {
                self.take_beside(plan, raw);
            } else if self.joining == Joining::Joined || !self.is_again(plan, raw) {
                self.reset_if_asked(plan, raw);
                self.estimator.take(raw);
                if let Some(doubts) = &mut self.doubts {
                    doubts.take(raw);
                }
                let kind = self.estimator.sample_kind().kind;
                self.intervals.take(raw, plan.clock, kind);
                self.stamp_unit.take(raw, plan.clock);
                self.still_stamps.take(raw, plan.clock);
                self.pace.take(raw, plan.clock);
            }
        }
        self.first = self.first.or(self.conditioning().first);
    }

    /// A specific force or a field with a stamp of its own; until a rate has told where the run stands, it waits.
    fn take_beside(&mut self, plan: &EstimationSettings, raw: &RawSample) {
        if self.joining == Joining::Joined {
            self.estimator.take(raw);
            if let Some(doubts) = &mut self.doubts {
                doubts.take(raw);
            }
        } else {
            if self.early.len() == early_besides::MOST {
                self.early.pop_front();
            }
            self.early.push_back(*raw);
        }
        let is_alone = self.prepared.aiding.is_none() && plan.aid == Aid::Auto;
        self.has_unused_forces |= is_alone && raw.accel.is_some();
    }

    /// Takes a heading that something else has measured; `false` where nothing can use it.
    pub(in crate::serve::core) fn take_heading(
        &mut self,
        stamp: Option<Nanos>,
        measured: OutsideHeading,
    ) -> bool {
        self.estimator.take_heading(stamp, measured)
    }

    /// Headings that something else has measured, for `STATUS`; null of a sensor that none came for.
    fn outside_headings(&self) -> Option<serde_json::Value> {
        let counts = self.estimator.outside_headings();
        (counts != OutsideHeadingCounts::default()).then(|| {
            serde_json::json!({
                "used": counts.used, "doubted": counts.doubted,
                "unpaired": counts.unpaired, "turns": counts.turns,
            })
        })
    }

    /// A line that could not be decoded stood here.
    pub fn take_undecodable(&mut self) {
        self.estimator.take_undecodable();
    }

    /// The attitudes of what was taken, and the number of the first.
    pub(crate) fn attitudes(&mut self) -> (u64, &[AttitudeSample], &Arc<Channel>) {
        let first = self.next_seq;
        let spacing = self.estimator.conditioning().spacing_nanos;
        let attitudes = self.estimator.attitudes(&Sequential);
        let mut before = self.last.map(|l| l.stamp);
        for attitude in attitudes {
            let step = before.map(|b| attitude.stamp.since(b));
            before = Some(attitude.stamp);
            // A step over missing samples is a gap.
            if let (Some(spacing), Some(step)) = (spacing, step)
                && step < spacing.saturating_mul(2)
            {
                // A saved stamp may be anything.
                let off = step.saturating_sub(spacing).unsigned_abs() as f64 * 1e-9;
                self.jitter_secs += (off - self.jitter_secs) / 16.0;
            }
        }
        self.next_seq = self.next_seq.saturating_add(attitudes.len() as u64);
        self.last = attitudes.last().copied().or(self.last);
        (first, attitudes, &self.channel)
    }

    /// Frees memory when its attitudes are handed out and it waits for its next samples.
    pub(crate) fn trim(&mut self) {
        self.estimator.trim();
    }

    /// Faults found, and the kinds of loss that have happened, for the first time to who sends it, since
    /// this was asked last.
    pub fn news(&mut self) -> Vec<Fault> {
        let counts = self.estimator.conditioning().counts;
        let mut news = Vec::from_iter(self.ambiguous.take());
        news.extend(self.intervals.news(&self.id));
        news.extend(self.stamp_unit.news(&self.id));
        news.extend(self.still_stamps.news(&self.id));
        if std::mem::take(&mut self.has_unused_forces) && self.told & FORCES == 0 {
            self.told |= FORCES;
            news.push(Fault {
                id: Some(self.id.to_string()),
                ..Fault::new("forces_unused", "specific forces come in messages of their own, and the first came after the attitude had begun with the gyro alone; start the daemon with --aid gravity, or send a force first. Said once".to_owned())
            });
        }
        for verdict in Verdict::ALL {
            let bit = 1 << verdict as u32;
            let is_new = counts.get(verdict) > self.counted.get(verdict);
            if self.told & bit == 0 && verdict.is_loss() && is_new {
                self.told |= bit;
                // An undecodable line was answered itself.
                if verdict != Verdict::Undecodable {
                    news.push(Fault {
                        id: Some(self.id.to_string()),
                        ..Fault::new(
                            verdict.name(),
                            format!("not used: {}. Said once; STATUS counts", explained(verdict)),
                        )
                    });
                }
            }
        }
        news
    }

    /// Report of conditioning.
    #[must_use]
    pub fn conditioning(&self) -> &Report {
        self.estimator.conditioning()
    }

    /// Health, which a replay's streams report of themselves, too.
    pub(in crate::serve) fn health(&self) -> Health {
        Health::of(&self.estimator)
    }

    /// One sigma of tilt and heading, degrees, where a vertical is known.
    #[must_use]
    pub fn sigma_degrees(&self) -> Option<[f64; 2]> {
        let now = attitude_now(self.estimator.filter(), self.last.as_ref());
        let of = |name: &str| now["sigma_deg"][name].as_f64();
        Some([of("tilt")?, of("heading")?])
    }

    /// State for `STATUS`.
    #[must_use]
    pub fn status(&self) -> serde_json::Value {
        let warnings = &self.prepared.warnings;
        let warnings: Vec<String> = warnings
            .iter()
            .map(ToString::to_string)
            .chain(self.intervals.warning())
            .collect();
        let stamp = |s: Nanos| {
            let (sec, nsec) = s.to_sec_nanosec();
            serde_json::json!({"sec": sec, "nsec": nsec})
        };
        let own = serde_json::json!({
            "id": &*self.id,
            // By the sender's numbers, not by the stamps.
            "missing": self.missing,
            "attitudes": self.next_seq - self.first_seq,
            "new_runs": self.runs,
            "resets": self.resetting.taken,
            "reset": self.last.map_or(0, |l| l.reset_count),
            "last_stamp": self.last.map(|l| stamp(l.stamp)),
            "jitter_s": self.jitter_secs,
            "stamp_unit": self.stamps.unit().map(TimeUnit::name),
            "arrival": self.arrivals.as_ref().map(|arrivals| arrivals.status()),
            "sample_kind": self.estimator.sample_kind().kind.name(),
            "sample_kind_by": self.estimator.sample_kind().reason.name(),
            "gyro_unit": self.resolved.unit.name(),
            "world": self.channel.stream().world_axes,
            "body": self.channel.stream().body_axes,
            "initial": self.prepared.initial_origin,
            "bias": self.prepared.bias_origin,
            "headings": self.outside_headings(),
            "interval_mismatches": self.intervals.found(),
            "warnings": warnings,
            "findings": self.findings(),
        });
        self.health().beside(own, self.last.as_ref())
    }
}

/// The plan of a sensor whose specific forces are known to come in messages of their own.
fn expecting(plan: &EstimationSettings, forces_beside: bool) -> EstimationSettings {
    EstimationSettings {
        has_forces_beside: plan.has_forces_beside || forces_beside,
        ..plan.clone()
    }
}

/// Meaning of a verdict for the one who sent the sample, and what helps.
fn explained(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoGyro => "a sample without a body rate (absent, or null as NaN becomes in JSON)",
        Verdict::NotFinite => "a body rate that is not finite",
        Verdict::Huge => {
            "a body rate no gyro can have; if it is in degrees, start the daemon with --gyro-unit deg"
        }
        Verdict::DuplicateStamp => "two samples with one stamp and other data",
        Verdict::Late => {
            "a sample older than what was already integrated; send in order, and after a connection was lost from the first sample on (a new run) or from the last one taken"
        }
        Verdict::NoStamp => {
            "a sample without a usable stamp (absent, 0, or a bare number of no unit); send `stamp`, or take the time of arrival: --stamp arrival of the daemon (or ?stamp=arrival behind the address of a listener) makes it even, --time log takes it as it is"
        }
        Verdict::StrayStamp => "a stamp far ahead of its neighbours",
        Verdict::FarStamp => {
            "a stamp more than 146 years from 1970; the sender's clock, or the unit of its stamps, is wrong"
        }
        other => other.name(),
    }
}
