//! Tables of phones: MATLAB's, and SensorLog's of iPhones and watches.

use super::{options, read};
use crate::delimited::Given;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::record::{AccelUnit, Nanos};

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

const SENSOR_LOG: &str = "loggingTime(txt),loggingSample(N),locationTimestamp_since1970(s),\
    locationHeadingX(µT),locationHeadingY(µT),locationHeadingZ(µT),\
    accelerometerTimestamp_sinceReboot(s),accelerometerAccelerationX(G),accelerometerAccelerationY(G),\
    accelerometerAccelerationZ(G),gyroTimestamp_sinceReboot(s),gyroRotationX(rad/s),gyroRotationY(rad/s),\
    gyroRotationZ(rad/s),magnetometerTimestamp_sinceReboot(s),magnetometerX(µT),magnetometerY(µT),\
    magnetometerZ(µT),motionTimestamp_sinceReboot(s),motionYaw(rad),motionRotationRateX(rad/s),\
    motionRotationRateY(rad/s),motionRotationRateZ(rad/s),motionUserAccelerationX(G),\
    motionUserAccelerationY(G),motionUserAccelerationZ(G),motionQuaternionX(R),motionQuaternionY(R),\
    motionQuaternionZ(R),motionQuaternionW(R),motionGravityX(G),motionGravityY(G),motionGravityZ(G),\
    motionMagneticFieldX(µT),motionMagneticFieldY(µT),motionMagneticFieldZ(µT),deviceID(txt)";

/// A row of it; the cells of the sensors that `is_off` are empty.
fn sensor_log(k: usize, field: &str, is_off: impl Fn(&str) -> bool) -> String {
    let at = |secs: f64| format!("{:.6}", secs + 0.01 * k as f64);
    let names = SENSOR_LOG.split(',').map(str::trim);
    let cell = |name: &str| match name {
        _ if is_off(name) => String::new(),
        "loggingTime(txt)" => format!("2026-11-28T12:00:00.{:03}+02:00", 10 * k + 7),
        "accelerometerTimestamp_sinceReboot(s)" => at(405_121.250),
        "gyroTimestamp_sinceReboot(s)" => at(405_121.240),
        "motionTimestamp_sinceReboot(s)" => at(405_121.230),
        "accelerometerAccelerationZ(G)" => "-1.0".to_owned(),
        "gyroRotationX(rad/s)" => "0.31".to_owned(),
        "motionRotationRateX(rad/s)" => "0.3".to_owned(),
        "magnetometerX(µT)" => "300".to_owned(),
        "motionMagneticFieldX(µT)" => field.to_owned(),
        "motionQuaternionW(R)" => "1".to_owned(),
        "deviceID(txt)" => "my_iOS_device".to_owned(),
        _ => "0".to_owned(),
    };
    names.map(cell).collect::<Vec<_>>().join(",")
}

#[test]
fn of_sensor_log_what_ios_mends_is_taken_with_its_stamp_and_the_force_points_up() {
    let head = SENSOR_LOG;
    let found = given("a.csv", head, |k| sensor_log(k, "20", |_| false)).unwrap();
    assert_eq!((found.bad.len(), found.notes.len()), (0, 0), "{found:?}");
    assert_eq!(found.gyro, Some(GyroUnit::Rad));
    assert_eq!(found.accel, Some(AccelUnit::StandardGravity));
    let sample = found.samples[1];
    assert_eq!(sample.header, Some(Nanos(405_121_240_000_000)));
    assert_eq!(sample.gyro, Some([0.3, 0.0, 0.0]));
    assert_eq!(sample.accel.unwrap()[2], 1.0);
    assert!((sample.mag.unwrap()[0] - 20e-6).abs() < 1e-12);
    assert_eq!(sample.orientation, Some([1.0, 0.0, 0.0, 0.0]));
    assert!(
        found.assumed.contains("accelerometerAccelerationZ(G):g*-1"),
        "{}",
        found.assumed
    );
    // What is said is what would be read.
    let text: String = (0..40)
        .map(|k| sensor_log(k, "20", |_| false) + "\n")
        .collect();
    let again = read(
        "a.csv",
        format!("{head}\n{text}").as_bytes(),
        &options(&found.assumed),
    );
    assert_eq!(again.unwrap().samples, found.samples);

    // A field that iOS does not mend, as without a compass, is zeros.
    let found = given("a.csv", head, |k| sensor_log(k, "0", |_| false)).unwrap();
    assert!((found.samples[1].mag.unwrap()[0] - 300e-6).abs() < 1e-12);

    // Of one that logs the raw sensors alone these are, by the stamp of the gyro.
    let raw = |name: &str| name.starts_with("motion");
    let found = given("a.csv", head, |k| sensor_log(k, "", raw)).unwrap();
    let sample = found.samples[1];
    assert_eq!(sample.header, Some(Nanos(405_121_250_000_000)));
    assert_eq!(sample.gyro, Some([0.31, 0.0, 0.0]));

    // Without their stamps, when the app wrote the row.
    let unstamped = |name: &str| name.contains("Timestamp");
    let found = given("a.csv", head, |k| sensor_log(k, "20", unstamped)).unwrap();
    assert_eq!(found.samples[1].header, Some(Nanos(TEN + 17_000_000)));
}
