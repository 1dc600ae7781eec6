//! JSON -> registers. Pure.
//!
//! JSON channels rarely have a schema worth the name, so the choice of fields is made in each
//! message by the names of its keys, from that message alone: the result does not depend on which
//! message came first. What only several messages could tell (the unit of an unlabelled stamp) is
//! settled once, by [`super::Decoder::settle`].

pub(crate) mod find;
pub(crate) mod found;
pub(crate) mod keys;
pub(crate) mod line;
pub(crate) mod objects;
pub(crate) mod scan;
pub(crate) mod trie;

use super::fields::FieldRole;
use super::registers::Form;
use super::schema::{last_name, ros_name};
use super::select::names::{Px4, px4};
use super::stamp::Bare;
use super::{Decoded, MAX_BATCH, Options, Undecodable, Wanted};
use crate::text::printable;
use find::Seeker;
use found::{Instant, ObjectFields, StampRule};
use scan::Scanner;
use strapd_attitude::record::TimeUnit;
use strapd_attitude::record::{Nanos, RawSample};
use trie::Trie;

/// Plan of what is looked for in the messages of a channel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Program {
    /// The paths of `--field`.
    pub(crate) trie: Trie,
    pub(crate) px4: Option<Px4>,
    pub(crate) wanted: Wanted,
    /// The channel's type is `Vector3Stamped`: its `vector` is what is wanted, or may be a body rate.
    pub(crate) vector_stamped: bool,
    pub(crate) child: Option<String>,
    pub(crate) form: Form,
    /// Unit of stamps that do not state theirs.
    pub(crate) settled: Option<TimeUnit>,
    /// The sensor of messages that name none.
    pub(crate) sensor: Option<String>,
    /// Whether the nested stamp is read of a message's stamp and a nested one.
    pub(crate) nested_stamp: bool,
    /// Specific forces and fields that come by themselves are read, too ([`RawSample::is_beside`]).
    pub(crate) takes_besides: bool,
}

impl Program {
    pub(crate) fn compile(type_name: &str, options: &Options) -> Self {
        Program {
            trie: Trie::new(&options.fields),
            px4: px4(type_name),
            wanted: options.wanted,
            vector_stamped: last_name(&ros_name(type_name)) == "Vector3Stamped",
            child: options.child_frame.clone(),
            form: Form {
                ignore_covariance_flag: options.ignore_covariance_flag,
                ..Form::default()
            },
            settled: None,
            sensor: None,
            nested_stamp: options.nth_stamp > 0,
            takes_besides: false,
        }
    }

    /// Rule by which a stamp is chosen if a message and one nested in it both have one.
    pub(crate) fn stamp_rule(&self) -> StampRule {
        match (self.trie.gives(FieldRole::Stamp), self.nested_stamp) {
            (true, _) => StampRule::Given,
            (false, true) => StampRule::Nested,
            (false, false) => StampRule::Outer,
        }
    }

    /// Reads one payload; pushes nothing when it fails.
    pub(crate) fn decode(
        &self,
        payload: &[u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Decoded, Undecodable> {
        let mut seeker = Seeker::new(self, Scanner::new(payload)?);
        let found = seeker.message()?;
        Ok(self.push_by_magnitude(&found, log, publish, out))
    }

    /// Pushes the samples of what was found, bare stamps by their magnitude.
    fn push_by_magnitude(
        &self,
        found: &ObjectFields<'_>,
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Decoded {
        let before = out.len();
        let mut bare = Vec::new();
        let decoded = self.push(found, log, publish, out, &mut bare);
        for (sample, bare) in out.iter_mut().skip(before).zip(bare) {
            sample.header = bare.map(Bare::by_magnitude).or(sample.header);
        }
        decoded
    }

    /// The same for a message that names this frame, or none; nothing of one that names another.
    pub(crate) fn decode_of(
        &self,
        frame: &str,
        payload: &[u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Option<Decoded>, Undecodable> {
        let mut seeker = Seeker::new(self, Scanner::new(payload)?);
        let found = seeker.message()?;
        let names_another = |named: &str| named != frame && printable(named) != frame;
        if found.frame.as_deref().is_some_and(names_another) {
            return Ok(None);
        }
        Ok(Some(self.push_by_magnitude(&found, log, publish, out)))
    }

    /// Everything one payload holds.
    pub(crate) fn find<'a>(&'a self, payload: &'a [u8]) -> Result<ObjectFields<'a>, Undecodable> {
        Seeker::new(self, Scanner::new(payload)?).message()
    }

    /// Pushes the samples of what was found; those whose stamp is a bare number have none yet, and the
    /// number stands at their place in `bare`.
    pub(crate) fn push(
        &self,
        found: &ObjectFields<'_>,
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
        bare: &mut Vec<Option<Bare>>,
    ) -> Decoded {
        self.push_in(self.settled, found, log, publish, out, bare)
    }

    /// The same with bare numbers in this unit.
    pub(crate) fn push_in(
        &self,
        settled: Option<TimeUnit>,
        found: &ObjectFields<'_>,
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
        bare: &mut Vec<Option<Bare>>,
    ) -> Decoded {
        let mut outcome = Decoded::default();
        let header = found.instant(settled, &mut outcome);
        let form = &self.form;
        let mut stamped = |n: usize, instant: Option<Instant>| match instant {
            None => None,
            Some(Instant::At(stamp)) => Some(stamp),
            Some(Instant::Bare(number)) => {
                bare.resize(n, None);
                bare.push(Some(number));
                None
            }
        };
        let is_beside = |found: &ObjectFields<'_>| self.takes_besides && found.is_beside();
        if found.has_gyro() || found.batch.is_empty() {
            let header = stamped(0, header);
            out.push(RawSample {
                is_beside: is_beside(found),
                ..found.sample(form, header, log, publish, &mut outcome)
            });
            outcome.samples = 1;
            return outcome;
        }
        for element in found.batch.iter().take(MAX_BATCH) {
            let own = element.instant(settled, &mut outcome);
            let stamp = if element.stamp.is_some() { own } else { header };
            let stamp = stamped(outcome.samples, stamp);
            out.push(RawSample {
                is_beside: is_beside(element),
                ..element.sample(form, stamp, log, publish, &mut outcome)
            });
            outcome.samples += 1;
        }
        outcome
    }
}
