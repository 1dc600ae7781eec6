//! Words of a name -> the kind, the stamp or the sensor that they stand for. Pure.
//!
//! Apart from the reading of a name because a logger with words of its own adds to these lists, and to nothing else.

use super::Kind;

const GYRO: &[&str] = &[
    "gyro",
    "gyros",
    "gyr",
    "gyroscope",
    "gyroskop",
    "omega",
    "angvel",
    "angularvelocity",
    "rotationrate",
];
const ACCEL: &[&str] = &[
    "accel",
    "accels",
    "acc",
    "accelerometer",
    "acceleration",
    "accelerations",
    "beschleunigung",
];
const MAG: &[&str] = &[
    "mag",
    "magn",
    "magnetometer",
    "magnetic",
    "magfield",
    "magnetfeld",
];
pub(super) const ORIENTATION: &[&str] = &[
    "q",
    "quat",
    "quaternion",
    "orientation",
    "attitude",
    "ori",
    "element",
];
/// Stems that an axis may be written to without anything between.
pub(super) const FUSED: &[&str] = &[
    "gyro",
    "gyr",
    "gyroscope",
    "w",
    "g",
    "omega",
    "acc",
    "accel",
    "a",
    "mag",
    "m",
    "b",
    "q",
    "quat",
    "gf",
    "f",
];

/// Words of what is derived from a measurement, or is about it: such a column is none of the roles.
pub(super) const DERIVED: &[&str] = &[
    "gravity",
    "grav",
    "bias",
    "biases",
    "offset",
    "std",
    "stddev",
    "var",
    "variance",
    "cov",
    "covariance",
    "sigma",
    "temp",
    "temperature",
    "setpoint",
    "command",
    "cmd",
    "desired",
    "target",
    "error",
    "err",
    "scale",
    "delta",
    "dv",
    "dq",
    "jerk",
    "noise",
    "angle",
    "euler",
    "status",
];
pub(super) const WITHOUT_GRAVITY: &[&str] = &["linear", "lin", "user", "free"];
pub(super) const AS_COUNTED: &[&str] = &["raw", "uncal", "uncalibrated", "lsb"];

/// All words of a stamp's name are among these, and one of them is strong.
pub(super) const STAMP_STRONG: &[&str] = &[
    "timestamp",
    "time",
    "t",
    "stamp",
    "ts",
    "elapsed",
    "millis",
    "micros",
    // Of GNSS: the time of week.
    "tow",
];
pub(super) const STAMP_WEAK: &[&str] = &[
    "sample",
    "fine",
    "since",
    "start",
    "epoch",
    "unix",
    "utc",
    "system",
    "sys",
    "device",
    "imu",
    "gyro",
    "gyroscope",
    "header",
    "sensor",
    "boot",
    "reboot",
    "realtime",
    "cal",
    "in",
    "the",
    "gps",
    "gnss",
    "i",
    "of",
    "week",
];

/// Names of a time of day, and of its date.
pub(super) const TIMES_OF_DAY: &[&str] = &[
    "rtctime",
    "timeofday",
    "localtime",
    "clocktime",
    "gpstime",
    "datetime",
    "dateandtime",
    "utcdatetime",
    "localdatetime",
    "recordedat",
    // Of SensorLog.
    "loggingtime",
];
pub(super) const DATES: &[&str] = &[
    "date",
    "rtcdate",
    "localdate",
    "gpsdate",
    "utcdate",
    "datum",
];

/// Names of a column that says whose a row is.
const SENSOR: &[&str] = &[
    "device",
    "deviceid",
    "devicename",
    "deviceaddress",
    "devicemac",
    "sensor",
    "sensorid",
    "sensorname",
    "imu",
    "imuid",
    "imuname",
    "mac",
    "macaddress",
    "tracker",
    "trackerid",
    "serial",
    "serialnumber",
    "nodeid",
    "placement",
    "bodypart",
    "limb",
];
/// The same of one that may as well be a number of the row, or of something else.
const SENSOR_OR_NUMBER: &[&str] = &["id", "instance", "node", "address", "addr", "unit"];

/// Whether a name, without what is between its words, says whose a row is, and whether that is clear.
pub(super) fn names_sensor(joined: &str) -> Option<bool> {
    match SENSOR.contains(&joined) {
        true => Some(true),
        false => SENSOR_OR_NUMBER.contains(&joined).then_some(false),
    }
}

/// The kind that words without a part stand for. `is_fused`: nothing stood between them and the part.
pub(super) fn kind_of(rest: &[String], is_fused: bool) -> Option<Kind> {
    let is = |all: &[&str]| rest.iter().map(String::as_str).eq(all.iter().copied());
    let has = |word: &str| rest.iter().any(|w| w == word);
    let any = |known: &[&str]| rest.iter().any(|w| known.contains(&w.as_str()));
    let is_turning = (has("angular") && (has("velocity") || has("rate") || has("speed")))
        || ((has("rotation") || has("turn") || has("body")) && has("rate"));
    if any(GYRO) || is_turning || is(&["w"]) || is(&["w", "rs", "s"]) || is(&["rate"]) {
        return Some(Kind::Gyro);
    }
    if is_fused && is(&["g"]) {
        return Some(Kind::Gyro);
    }
    if has("angular") {
        return None;
    }
    // `gF` of Physics Toolbox.
    if any(ACCEL) || is(&["a"]) || is(&["a", "rs", "s"]) || is(&["gf"]) || is(&["g", "f"]) {
        return Some(Kind::Accel);
    }
    if any(MAG) || (is_fused && (is(&["m"]) || is(&["b"]))) {
        return Some(Kind::Mag);
    }
    None
}
