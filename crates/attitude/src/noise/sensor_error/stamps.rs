//! Sizes of the errors of sampling instants and stamps. Pure.

use super::ImuErrorFault;

/// Sampling instants, stamps, and lost samples of a sensor. The default is perfect.
///
/// Two kinds of jitter that must not be confused: with `sampling_jitter` the samples really are
/// taken at uneven instants and the stamps say so; with `stamp_jitter` the stamps are wrong.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StampError {
    /// Added to every stamp, ns.
    pub offset_nanos: i64,
    /// The sensor's clock runs fast by this many millionths.
    pub drift_ppm: f64,
    /// Sampling instants are uniform within plus and minus this part of the interval; below 0.5.
    pub sampling_jitter: f64,
    /// Stamps are off by a normal error with this standard deviation, as a part of the interval.
    /// Large ones run backwards, as real ones do.
    pub stamp_jitter: f64,
    /// The part of the samples that is lost.
    pub drop_probability: f64,
    /// Mean length of a run of lost samples, >= 1.
    pub burst_length: f64,
}

impl Default for StampError {
    fn default() -> StampError {
        StampError {
            offset_nanos: 0,
            drift_ppm: 0.0,
            sampling_jitter: 0.0,
            stamp_jitter: 0.0,
            drop_probability: 0.0,
            burst_length: 1.0,
        }
    }
}

impl StampError {
    /// Checks every size.
    ///
    /// # Errors
    /// Which one, and what is possible.
    pub fn check(&self) -> Result<(), ImuErrorFault> {
        let within = |name: &str, value: f64, least: f64, most: f64| {
            if value >= least && value <= most {
                Ok(())
            } else {
                Err(ImuErrorFault(
                    format!("{name} {value}: a number from {least} to {most} is needed").into(),
                ))
            }
        };
        within("drift_ppm", self.drift_ppm, -1e5, 1e5)?;
        within("sampling_jitter", self.sampling_jitter, 0.0, 0.499)?;
        within("stamp_jitter", self.stamp_jitter, 0.0, 1e3)?;
        within("drop_probability", self.drop_probability, 0.0, 0.99)?;
        within("burst_length", self.burst_length, 1.0, 1e9)?;
        if self.entering() > 1.0 {
            return Err(ImuErrorFault(format!(
                "drop_probability {} in bursts of {}: the samples between are fewer than one a burst; longer bursts, or fewer drops",
                self.drop_probability, self.burst_length
            ).into()));
        }
        Ok(())
    }

    /// Probability that a burst begins after a sample that was kept.
    pub(super) fn entering(&self) -> f64 {
        self.drop_probability / (self.burst_length * (1.0 - self.drop_probability))
    }
}
