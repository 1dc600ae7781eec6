//! Tables of phones: MATLAB's.

use super::{options, read};
use crate::delimited::Given;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::Nanos;

/// 2026-11-28 10:00:00 UTC.
const TEN: i64 = 1_795_860_000_000_000_000;

fn given(name: &str, head: &str, row: impl Fn(usize) -> String) -> Result<Given, String> {
    let rows: String = (0..40).map(|k| row(k) + "\n").collect();
    read(name, format!("{head}\n{rows}").as_bytes(), &options(""))
}

#[test]
fn matlabs_dates_are_stamps_and_its_file_of_angular_velocities_has_rates() {
    let row = |k: usize| format!("28-Nov-2026 10:00:00.{:03},{k},0.5,-1", 10 * k);
    let head = "Timestamp,X,Y,Z";
    let found = given("AngularVelocity.csv", head, row).unwrap();
    assert_eq!((found.samples.len(), found.bad.len()), (40, 0));
    assert_eq!((found.gyro, found.notes), (Some(GyroUnit::Rad), vec![]));
    for (k, sample) in found.samples.iter().enumerate() {
        assert_eq!(sample.header, Some(Nanos(TEN + k as i64 * 10_000_000)));
        assert_eq!(sample.gyro, Some([k as f64, 0.5, -1.0]));
    }
    // An October has a t, which ends no date; a name that is none is told.
    let october = |k: usize| row(k).replace("Nov", "Oct");
    let found = given("angularvelocity_2.csv", head, october).unwrap();
    let month = 31 * 86_400 * 1_000_000_000;
    assert_eq!(found.samples[0].header, Some(Nanos(TEN - month)));
    let why = given("AngularVelocity.csv", head, |k| {
        row(k).replace("Nov", "Okt")
    })
    .unwrap_err();
    assert!(why.contains("is no stamp that is known"), "{why}");
    // What is called so and more is another thing.
    let why = given("AngularVelocityTarget.csv", head, row).unwrap_err();
    assert!(why.contains("AngularVelocity"), "{why}");
}
