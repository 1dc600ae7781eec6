//! An estimator -> what it says of itself: counts, checks of the sensors, filter and smoother. Pure.
//!
//! Apart from what samples go through because nothing here changes an attitude.

use super::super::gyro_watch::GyroWatch;
use super::super::magnetometer_watch::MagnetometerWatch;
use super::super::meaning::Meaning;
use super::super::preparation::Prepared;
use super::super::sample_kind::KindChoice;
use super::super::smoothing::Recording;
use super::Estimator;
use crate::aid;
use crate::condition::{self, regularise};
use crate::consistency::{Consistency, FieldConsistency};
use crate::diagnostic::Diagnostic;
use crate::propagate::{self, Method};
use crate::record::Nanos;

impl Estimator {
    /// Holds the gyro against accelerometer and magnetometer from now on, for [`Estimator::consistency`] and
    /// [`Estimator::field_consistency`]; `resolved` and `prepared` are those by which this was made.
    pub fn watch_sensors(&mut self, resolved: &Meaning, prepared: &Prepared) {
        let sensors = (Consistency::default(), FieldConsistency::default());
        self.watch_by(resolved, prepared, sensors);
    }

    /// The same of a stream without an end, of which there may be many: less is kept of what is healthy.
    pub fn watch_sensors_live(&mut self, resolved: &Meaning, prepared: &Prepared) {
        let sensors = (Consistency::live(), FieldConsistency::live());
        self.watch_by(resolved, prepared, sensors);
    }

    fn watch_by(
        &mut self,
        resolved: &Meaning,
        prepared: &Prepared,
        (gyro, field): (Consistency, FieldConsistency),
    ) {
        self.watch = Some(GyroWatch::new(&resolved.to_body(), gyro));
        let watch = MagnetometerWatch::new(resolved, prepared.clock, field);
        self.magnetometer = Some(Box::new(watch));
    }

    /// Number that tells settings apart under which samples, or what is remembered of them, mean something else.
    #[must_use]
    pub fn settings_fingerprint(&self) -> u64 {
        self.settings
    }

    /// Gyro against accelerometer as far as was seen; `None` where nobody asked to watch.
    #[must_use]
    pub fn consistency(&self) -> Option<&Consistency> {
        self.watch.as_ref().map(GyroWatch::consistency)
    }

    /// Gyro against magnetometer as far as was seen; `None` where nobody asked to watch.
    #[must_use]
    pub fn field_consistency(&self) -> Option<&FieldConsistency> {
        Some(self.magnetometer.as_ref()?.consistency())
    }

    /// Kind for which samples are taken by now, and why.
    #[must_use]
    pub fn sample_kind(&self) -> KindChoice {
        self.sample_kind
    }

    /// Temperature that was received last, degrees Celsius; `None` where samples carry none.
    #[must_use]
    pub fn temperature(&self) -> Option<f32> {
        self.temperatures.last()
    }

    /// Report of conditioning.
    #[must_use]
    pub fn conditioning(&self) -> &condition::Report {
        self.conditioner.report()
    }

    /// Report of the stamps, if they were regularised: whether causally, and how.
    #[must_use]
    pub fn regularising(&self) -> Option<(bool, regularise::Report)> {
        let regulariser = self.regulariser.as_ref()?;
        Some((regulariser.is_causal(), regulariser.report()))
    }

    /// Report of propagation.
    #[must_use]
    pub fn propagation(&self) -> propagate::Report {
        self.integrator.propagation()
    }

    /// Filter that corrects the attitude, if there is one; beside a smoother, the one that runs along with it.
    #[must_use]
    pub fn filter(&self) -> Option<&aid::Filter> {
        self.integrator.filter()
    }

    /// Result of a smoother, once it is finished; `None` where nobody asked for one.
    ///
    /// # Errors
    /// In words: why it made nothing of it. The attitudes are the filter's then, to the bit.
    #[must_use]
    pub fn smoothed(&self) -> Option<Result<&Recording, &Diagnostic>> {
        self.integrator.smoothed()
    }

    /// Keeps the innovations of what corrects the attitude, for [`Estimator::innovations`].
    pub fn keep_innovations(&mut self) {
        self.integrator.keep_innovations();
    }

    /// Takes the innovations kept since the last call, each with the stamp of the correction.
    pub fn innovations(&mut self) -> Vec<(Nanos, aid::Innovation)> {
        self.integrator.innovations()
    }

    /// Whether attitudes carry the acceleration without gravity, of samples with a specific force: it was asked for, and
    /// something tells the vertical.
    #[must_use]
    pub fn gives_acceleration(&self) -> bool {
        self.integrator.gives_acceleration() || self.asked.gravity.is_some()
    }

    /// The method, with its window and order.
    #[must_use]
    pub fn method(&self) -> Method {
        self.integrator.method()
    }
}
