//! Stamps that state their unit -> what to say of a sensor whose steps say another one, once. Pure.
//!
//! Apart from the stream because a replay refuses such a log, while a daemon goes on: all it can do is say so.

use crate::report::findings::{Finding, Severity};
use crate::serve::guard::fault::Fault;
use strapd_attitude::condition::Clock;
use strapd_attitude::record::{RawSample, TimeUnit};
use strapd_recording::recording::stated_nanos::{StatedNanos, TooFast};

/// Steps after which they are judged, again whenever their number has doubled, and for the last time: a sender may
/// begin with what it has held back.
const FIRST: u64 = 128;
const LAST: u64 = 8192;

/// The steps of a run's stamps, as far as they are looked at.
#[derive(Debug, Default)]
pub(super) struct StampUnit {
    steps: StatedNanos,
    /// The unit that the newest lines state.
    stated: Option<TimeUnit>,
    judged: u64,
    found: Option<TooFast>,
    is_unsaid: bool,
}

impl StampUnit {
    /// Prepares to tell another sender what is wrong.
    pub(super) fn meet(&mut self) {
        self.is_unsaid = self.found.is_some();
    }

    /// Takes the unit that lines state, before their samples come.
    pub(super) fn state(&mut self, stated: Option<TimeUnit>) {
        self.stated = stated;
    }

    /// The unit that the newest lines state.
    pub(super) fn stated(&self) -> Option<TimeUnit> {
        self.stated
    }

    /// Begins a run.
    pub(super) fn begin(&mut self) {
        *self = StampUnit {
            stated: self.stated,
            ..StampUnit::default()
        };
    }

    /// Takes the next sample of the run.
    #[inline]
    pub(super) fn take(&mut self, raw: &RawSample, clock: Clock) {
        let Some(stamp) = raw.header.filter(|_| clock == Clock::Header) else {
            return;
        };
        if self.judged >= LAST {
            return;
        }
        self.steps.take(stamp);
        let steps = self.steps.steps();
        if steps < FIRST.max(2 * self.judged) {
            return;
        }
        self.judged = steps;
        let was_found = self.found.is_some();
        self.found = self.steps.too_fast(self.stated);
        self.is_unsaid |= self.found.is_some() && !was_found;
    }

    /// Returns the fault to report to the sender, once.
    pub(super) fn news(&mut self, id: &str) -> Option<Fault> {
        let found = self.found.as_ref()?;
        std::mem::take(&mut self.is_unsaid).then(|| Fault {
            id: Some(id.to_owned()),
            ..Fault::new(
                Fault::STAMP_UNIT,
                format!("{}; {}", found.what(), advice(found)),
            )
        })
    }

    /// The finding for `STATUS`.
    pub(super) fn finding(&self) -> Option<Finding> {
        let found = self.found.as_ref()?;
        let evidence = [
            ("step_ns".to_owned(), found.step_nanos().into()),
            ("stated".to_owned(), found.stated.map(TimeUnit::name).into()),
            ("unit".to_owned(), found.unit().into()),
        ];
        Some(Finding {
            severity: Severity::Error,
            code: "stamp-unit",
            topic: String::new(),
            what: found.what(),
            evidence: evidence.into_iter().collect(),
            advice: advice(found),
            help: Vec::new(),
        })
    }
}

fn advice(found: &TooFast) -> String {
    let unit = found.unit();
    let send = match found.stated.map(TimeUnit::name) {
        Some(stated) => format!(
            "send them as stamp_{unit}, or start the daemon with --field stamp=stamp_{stated}:{unit} (of a table --columns stamp=NAME:{unit})"
        ),
        None => "convert them before they are sent".to_owned(),
    };
    format!("{send}; the attitude stands still until then")
}
