//! The first messages of a channel -> what no schema says: what JSON holds, and the unit of a stamp that
//! is a bare number. Pure.
//!
//! Apart from the decoder because it happens once, before the first sample, and a daemon settles units
//! in its own way.

use super::definition::nothing_wanted;
use super::json;
use super::registers::{Form, StampForm};
use super::select::MatchQuality;
use super::stamp::{Ambiguous, Bare, MOST_WAITING, UnitEvidence, unit_in_log};
use super::{Decoder, FieldRole, Program, Unsupported, Wanted, unsupported};
use crate::text::printable;
use strapd_attitude::record::Nanos;
use strapd_attitude::record::TimeUnit;
use strapd_attitude::setting::FIELD;

impl Decoder {
    /// Learns from one message (the first of the topic) what no schema says: the unit of a bare stamp, by the
    /// recorder's clock and else by its magnitude (until more were seen), and for JSON what the messages hold. Without this call such stamps are read by magnitude,
    /// one by one.
    ///
    /// # Errors
    /// [`Unsupported`] when a JSON message lacks a `--field` path, or holds neither body rate nor
    /// orientation; it lists the keys there are. A message that cannot be decoded is no error here.
    pub fn settle(&mut self, payload: &[u8], log: Nanos) -> Result<(), Unsupported> {
        if let Program::Json(_) = &self.plan {
            return self.settle_json(payload, log);
        }
        let bare = self.bare_numbers(payload).first().copied();
        if let Some(bare) = bare.filter(|bare| bare.count() != 0.0) {
            self.set_unit(settled_unit(bare, log));
        }
        Ok(())
    }

    /// Whether stamps are bare numbers, whose unit the first messages are to tell
    /// (`Decoder::settle_unit`). Of JSON: whether they may be.
    #[must_use]
    pub fn has_bare_stamps(&self) -> bool {
        self.has_bare_stamps
    }

    /// Settles the unit of stamps that are bare numbers by the first messages of the channel, with their
    /// log times: by the recorder's clock where they are instants of it, else by how far they are apart, and
    /// where that leaves several units, by which of them is as fast as the recorder's clock or makes instants
    /// of our time. It stays as it is where there are no two different stamps.
    ///
    /// # Errors
    /// [`Unsupported`] where that tells none, or several: with what is known, and the flag that states it.
    pub(crate) fn settle_unit(&mut self, first: &[(Nanos, Vec<u8>)]) -> Result<(), Unsupported> {
        if !self.has_bare_stamps {
            return Ok(());
        }
        let numbers: Vec<(Nanos, Vec<Bare>)> = first
            .iter()
            .map(|(log, payload)| (*log, self.bare_numbers(payload)))
            .filter(|(_, bare)| !bare.is_empty())
            .collect();
        match unit_in_log(&numbers, MOST_WAITING + 1) {
            Ok(UnitEvidence::Unit(unit)) => {
                self.set_unit(unit);
                Ok(())
            }
            Ok(UnitEvidence::Nothing) => Ok(()),
            Err(why) => Err(self.unclear(&why, first)),
        }
    }

    fn unclear(&self, why: &Ambiguous, first: &[(Nanos, Vec<u8>)]) -> Unsupported {
        let mut given = self.options.fields.iter();
        let given = given.find(|field| field.role == FieldRole::Stamp);
        let mut what = why.what();
        let path = match (given, &self.plan) {
            (Some(field), _) => printable(&field.text),
            (None, Program::Json(_)) => {
                let keys = first.first().map(|(_, payload)| json::keys::keys(payload));
                what.push_str(&format!("; keys: {}", keys.unwrap_or_default().join(", ")));
                "PATH".to_owned()
            }
            (None, _) => {
                let read = self.stamps.get(self.nth_stamp());
                read.map_or_else(|| "PATH".to_owned(), String::clone)
            }
        };
        let help = format!("{FIELD} stamp={path}:ns (or us, ms, s) states it");
        unsupported(&self.label, what, help)
    }

    /// The stamps of one payload that are bare numbers.
    fn bare_numbers(&self, payload: &[u8]) -> Vec<Bare> {
        let nobody = Nanos(0);
        let mut samples = Vec::new();
        if let Program::Json(plan) = &self.plan {
            let Ok(found) = plan.find(payload) else {
                return Vec::new();
            };
            let mut bare = Vec::new();
            plan.push_in(None, &found, nobody, nobody, &mut samples, &mut bare);
            return bare.into_iter().flatten().collect();
        }
        if !self.has_bare_stamps {
            return Vec::new();
        }
        let mut read = |stamp: StampForm| -> Vec<i64> {
            let form = Form { stamp, ..self.form };
            samples.clear();
            match self.decode_as(&form, payload, nobody, nobody, &mut samples) {
                Ok(_) => samples.iter().filter_map(|s| Some(s.header?.0)).collect(),
                Err(_) => Vec::new(),
            }
        };
        if let StampForm::Count(_) = self.form.stamp {
            let counts = read(StampForm::Count(TimeUnit::Nano)).into_iter();
            return counts.map(Bare::whole).collect();
        }
        // As seconds in nanoseconds every digit is there, unless they are too many.
        let billionths = read(StampForm::Float(TimeUnit::Second));
        let whole = read(StampForm::Float(TimeUnit::Nano));
        let each = billionths.into_iter().zip(whole);
        each.map(|(billionths, whole)| match billionths {
            i64::MAX | i64::MIN => Bare::whole(whole),
            exact => Bare::billionths(exact),
        })
        .collect()
    }

    fn set_unit(&mut self, unit: TimeUnit) {
        match (&mut self.plan, self.form.stamp) {
            (Program::Json(plan), _) => plan.settled = Some(unit),
            (_, StampForm::Count(_)) => self.form.stamp = StampForm::Count(unit),
            (_, StampForm::Float(_)) => self.form.stamp = StampForm::Float(unit),
            (_, StampForm::None | StampForm::SecNanos) => {}
        }
    }

    fn settle_json(&mut self, payload: &[u8], log: Nanos) -> Result<(), Unsupported> {
        let Program::Json(plan) = &mut self.plan else {
            return Ok(());
        };
        let learnt = match plan.find(payload) {
            Ok(found) => found,
            Err(_) => return Ok(()),
        };
        let one = match learnt.batch.first() {
            Some(first) if !learnt.has_gyro() => first,
            _ => &learnt,
        };
        let stamped = if one.stamp.is_some() { one } else { &learnt };
        let unit = stamped.unlabelled().map(|bare| settled_unit(bare, log));
        let wanted = self.options.wanted;
        let (_, slot, numbers) = wanted.numbers();
        let is_reference = wanted == Wanted::Rates && one.has_orientation();
        let has_stamp = stamped.stamp.is_some();
        let missing = self.options.fields.iter().find(|field| match field.role {
            FieldRole::Stamp => !has_stamp,
            role => !one.has(role),
        });
        let complaint = match missing {
            Some(field) => Some(format!(
                "no {} at `{}`",
                field.role.name(),
                printable(&field.text)
            )),
            None if !one.registers.has(slot, u32::from(numbers)) && !is_reference => {
                Some(nothing_wanted("message", wanted).0)
            }
            None => None,
        };
        let stated = &mut self.stated;
        stated.has_gyro = one.has(FieldRole::Gyro);
        stated.has_accel = one.has(FieldRole::Accel);
        stated.has_mag = one.has(FieldRole::Mag);
        stated.has_temperature = one.has(FieldRole::Temperature);
        stated.has_orientation = one.has(FieldRole::Orientation);
        stated.has_stamp = has_stamp;
        stated.has_interval = one.has(FieldRole::Interval);
        let interval = || ("PATH".to_owned(), one.interval);
        stated.declared.interval = stated.has_interval.then(interval);
        stated.batched = !learnt.has_gyro() && !learnt.batch.is_empty();
        stated.declared.gyro_unit = one.unit.or(stated.declared.gyro_unit);
        stated.declared.sample_kind = one.kind.or(stated.declared.sample_kind);
        self.found = match one.gyro_rank {
            None => MatchQuality::Nothing,
            Some(5) if plan.vector_stamped => MatchQuality::Vector,
            Some(5) if plan.px4.is_none() => MatchQuality::Twist,
            Some(_) => MatchQuality::Named,
        };
        let rivals = learnt.has_rival_stamps;
        drop(learnt);
        if rivals && !plan.trie.gives(FieldRole::Stamp) {
            self.stamps = ["the outer stamp", "the nested stamp"]
                .map(str::to_owned)
                .into();
        }
        self.has_bare_stamps = unit.is_some() || !has_stamp;
        plan.settled = unit.or(plan.settled);
        match complaint {
            None => Ok(()),
            Some(why) => {
                let keys = json::keys::keys(payload).join(", ");
                Err(unsupported(
                    &self.label,
                    format!("{why}; its keys: {keys}"),
                    nothing_wanted("message", wanted).1,
                ))
            }
        }
    }
}

fn settled_unit(bare: Bare, log: Nanos) -> TimeUnit {
    let count = bare.count();
    TimeUnit::nearest(count, log).unwrap_or_else(|| TimeUnit::of_magnitude(count))
}
