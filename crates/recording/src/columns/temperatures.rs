//! Words of a column's name -> whether it is the temperature of the sensor. Pure.
//!
//! Apart from the vectors because it is one number, of which a table may well have several: the gyro's is the one that
//! tells something, and none is asked for.

use super::units::{Quantity, Unit};

/// Words for it.
const TEMPERATURE: [&str; 3] = ["temp", "temperature", "temps"];
/// Words that may stand beside it, those of a gyro first.
const GYRO: [&str; 4] = ["gyro", "gyr", "gyroscope", "g"];
const SENSOR: [&str; 8] = [
    "imu", "sensor", "chip", "die", "internal", "device", "mpu", "inertial",
];

/// Closeness of a temperature to the gyro, 0 the gyro's own, and the unit behind its words; `None` of any other column.
pub(crate) fn temperature(words: &[String]) -> Option<(u8, Option<Unit>)> {
    let is = |known: &[&str], word: &String| known.contains(&word.as_str());
    let at = words.iter().position(|word| is(&TEMPERATURE, word))?;
    let (before, behind) = (words.get(..at)?, words.get(at + 1..)?);
    let unit = Unit::of(Quantity::Temperature, &behind.concat());
    // `temp_imu`: what stands behind, and is no unit, is whose it is.
    let behind = behind.iter().filter(|_| unit.is_none());
    let mut rank = 2;
    for word in before.iter().chain(behind) {
        rank = match word {
            word if is(&GYRO, word) => 0,
            word if is(&SENSOR, word) => rank.min(1),
            _ => return None,
        };
    }
    Some((rank, unit))
}

#[cfg(test)]
mod tests {
    use super::super::names::words;
    use super::*;

    #[test]
    fn the_temperature_of_a_gyro_is_told_from_that_of_something_else() {
        let celsius = Some(Unit::Temperature(1.0, 0.0));
        for (name, expected) in [
            ("temperature", Some((2, None))),
            ("Temp", Some((2, None))),
            ("temp_c", Some((2, celsius))),
            ("gyro_temp_degC", Some((0, celsius))),
            ("GyroTemperature", Some((0, None))),
            ("temp_imu", Some((1, None))),
            (
                "imuTemperatureK",
                Some((1, Some(Unit::Temperature(1.0, -273.15)))),
            ),
            ("accel_temperature", None),
            ("baro_temp", None),
            ("temp_cpu", None),
            ("gyro_temp_x", None),
            ("time", None),
        ] {
            assert_eq!(temperature(&words(name)), expected, "{name}");
        }
    }
}
