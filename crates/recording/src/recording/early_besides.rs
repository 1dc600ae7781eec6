//! Lines with forces or fields that come before the first rate of their sensor: they wait for it. Pure.
//!
//! Apart from the lines because nobody knows before whose they are, and where the run stands.

use crate::decode::{Class, Line};
use std::collections::VecDeque;
use strapd_attitude::record::RawSample;

/// Number that waits at most, in a log and in `serve`; of more the last, since the first attitude wants the latest
/// force.
pub const MOST: usize = 16;

/// A line, and its samples.
pub(super) type Early = (Line, Vec<RawSample>);

/// Lines that wait for the first rate of their sensor.
#[derive(Debug, Default)]
pub(super) struct EarlyBesides {
    held: VecDeque<Early>,
}

impl EarlyBesides {
    pub(super) fn hold(&mut self, line: Line, samples: &mut Vec<RawSample>) {
        if self.held.len() == MOST {
            self.held.pop_front();
        }
        self.held.push_back((line, std::mem::take(samples)));
    }

    /// Releases those of a sensor, and those that name none; its attitudes have none.
    pub(super) fn of(&mut self, (id, is_attitude): &(String, bool)) -> Vec<Early> {
        if *is_attitude {
            return Vec::new();
        }
        let (own, others) = std::mem::take(&mut self.held)
            .into_iter()
            .partition(|(line, _)| line.id.as_deref().is_none_or(|of| of == *id));
        self.held = others;
        Vec::from(own)
    }
}

/// Whether a line holds nothing but forces or fields of other sensors than the gyro. What says that it is of the gyro
/// is.
pub(super) fn are_beside(line: &Line, samples: &mut [RawSample]) -> bool {
    if line.class == Class::Rate {
        for sample in samples.iter_mut() {
            sample.is_beside = false;
        }
    }
    !samples.is_empty() && samples.iter().all(|raw| raw.is_beside)
}
