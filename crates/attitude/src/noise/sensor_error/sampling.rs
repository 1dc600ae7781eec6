//! Rate and seed -> sampling instants, stamps, losses. Pure.

use super::normal::{Purpose, Stream};
use super::{ImuErrorFault, StampError};
use crate::record::Nanos;

/// One sample's time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tick {
    /// Instant at which it was really taken: where the truth is to be evaluated.
    pub instant: Nanos,
    /// Stamp that it carries.
    pub stamp: Nanos,
    /// Whether it does not arrive.
    pub dropped: bool,
}

/// Sampling instants without end, in order; the stamps and losses that go with them.
///
/// Losses are a two-state chain (E. N. Gilbert, 1960): runs of geometric length.
#[derive(Clone, Debug)]
pub struct StampModel {
    error: StampError,
    start: Nanos,
    interval: f64,
    index: u64,
    losing: Option<bool>,
    sampling: Stream,
    stamps: Stream,
    drops: Stream,
}

impl StampModel {
    /// Samples at `start`, `start + 1 / rate_hz`, ...
    ///
    /// # Errors
    /// What [`StampError::check`] refuses, or a rate that is not from 1e-6 to 1e8 Hz.
    pub fn new(
        error: &StampError,
        start: Nanos,
        rate_hz: f64,
        seed: u64,
    ) -> Result<StampModel, ImuErrorFault> {
        error.check()?;
        if !(1e-6..=1e8).contains(&rate_hz) {
            return Err(ImuErrorFault(
                format!("a sample rate of {rate_hz} Hz: a number from 1e-6 to 1e8 is needed")
                    .into(),
            ));
        }
        Ok(StampModel {
            error: *error,
            start,
            interval: 1e9 / rate_hz,
            index: 0,
            losing: None,
            sampling: Stream::new(seed, Purpose::SamplingJitter, 0),
            stamps: Stream::new(seed, Purpose::StampJitter, 0),
            drops: Stream::new(seed, Purpose::Drops, 0),
        })
    }

    /// The next sample's time. Instants increase by at least a nanosecond up to 1e8 Hz.
    pub fn tick(&mut self) -> Tick {
        let error = &self.error;
        let mut elapsed = self.index as f64 * self.interval;
        self.index += 1;
        if error.sampling_jitter > 0.0 {
            let uniform = 2.0 * self.sampling.uniform() - 1.0;
            elapsed += error.sampling_jitter * self.interval * uniform;
        }
        let instant = elapsed.round();
        let mut shown = instant * (error.drift_ppm * 1e-6);
        if error.stamp_jitter > 0.0 {
            shown += error.stamp_jitter * self.interval * self.stamps.normal();
        }
        let instant = Nanos(self.start.0.saturating_add(instant as i64));
        let dropped = error.drop_probability > 0.0 && {
            let likely = match self.losing {
                None => error.drop_probability,
                Some(false) => error.entering(),
                Some(true) => 1.0 - 1.0 / error.burst_length,
            };
            self.drops.uniform() <= likely
        };
        self.losing = Some(dropped);
        Tick {
            instant,
            stamp: Nanos(
                instant
                    .0
                    .saturating_add(shown.round() as i64)
                    .saturating_add(error.offset_nanos),
            ),
            dropped,
        }
    }
}
