//! Facts about a sensor at the end of a run -> its calibration as it is saved, and words. Pure.

use super::calendar::date;
use strapd_attitude::estimate::{CalibrationTerm, SensorCalibration};
use strapd_attitude::record::AttitudeSample;

/// Recordings that are named.
const MOST_SOURCES: usize = 16;

/// Adds whose it is, from where, and when: by the clock of the samples, where that knows the day.
#[must_use]
pub fn described(
    known: SensorCalibration,
    sensor: &str,
    source: &str,
    last: Option<&AttitudeSample>,
) -> SensorCalibration {
    let day = |nanos: i64| date(u64::try_from(nanos).ok()?);
    let mut sources = known.sources;
    sources.push(source.to_owned());
    SensorCalibration {
        sensor: Some(sensor.chars().take(1000).collect()),
        date: last
            .and_then(|last| day(last.stamp.0).or_else(|| day(last.log.0)))
            .or(known.date),
        sources: latest(sources),
        ..known
    }
}

/// Recordings it comes from: each once, where it was last, and no more than are kept.
#[must_use]
pub fn latest(sources: Vec<String>) -> Vec<String> {
    let mut kept: Vec<String> = Vec::new();
    for source in sources.into_iter().rev() {
        if kept.len() < MOST_SOURCES && !kept.contains(&source) {
            kept.push(source);
        }
    }
    kept.reverse();
    kept
}

/// Text of the numbers that data have told.
#[must_use]
pub fn observed(known: &SensorCalibration) -> String {
    match names(known).as_slice() {
        [] => "calibration, of which NOTHING was observed".to_owned(),
        all => format!("calibration; observed: {}", all.join(", ")),
    }
}

/// The keys of those numbers.
#[must_use]
pub fn names(known: &SensorCalibration) -> Vec<String> {
    fn of<const N: usize>(key: &'static str, known: &Option<CalibrationTerm<N>>) -> Option<String> {
        let known = known.as_ref()?;
        match known.observed.iter().filter(|o| **o).count() {
            0 => None,
            n if n == N => Some(key.to_owned()),
            n => Some(format!("{key} ({n} of {N})")),
        }
    }
    [
        of("bias", &known.bias),
        of("G", &known.gyro),
        of("ba", &known.force_bias),
        of("A", &known.force),
        of("lead", &known.lead),
        of("h", &known.hard_iron),
        of("S", &known.soft_iron),
        of("mag_lead", &known.field_lead),
        of("truncation_step", &known.truncation_step),
    ]
    .into_iter()
    .flatten()
    .collect()
}
