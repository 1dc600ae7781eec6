//! The makers' text files -> IMU samples in SI units. Pure.
//!
//! A stage of its own because here, and only here, it is decided what the columns mean.

use super::imu_cdr::ImuSample;
use super::motions::STANDARD_GRAVITY;

/// Both devices count from their own start; this instant (2023-11-14 22:13:20 UTC) stands for it.
pub(crate) const EPOCH: i64 = 1_700_000_000_000_000_000;

/// A line of text that is not what the format promises.
#[derive(Debug)]
pub(crate) struct BadLine {
    file: &'static str,
    line: usize,
    why: String,
}

impl std::fmt::Display for BadLine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, line {}: {}", self.file, self.line, self.why)
    }
}

impl std::error::Error for BadLine {}

/// One row of the Xsens export.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct XsensRow {
    /// Rate, specific force, orientation.
    pub(crate) imu: ImuSample,
    /// Magnetic field in sensor axes, in units of the local field (the device's own scale).
    pub(crate) field: [f64; 3],
}

/// Xsens MT export, tab separated: counter, acceleration (m/s^2), rate (rad/s), field (arbitrary),
/// orientation w, x, y, z. The counter ticks at the rate of the second comment line and is the clock.
pub(crate) fn xsens(text: &str) -> Result<Vec<XsensRow>, BadLine> {
    const FILE: &str = "xsens_mti.txt";
    const COMMENT_AND_HEADING_LINES: usize = 5;
    const TICK: i64 = 20_000_000; // "Sample rate: 50.0Hz"
    let is_tab = |c| c == '\t';
    Ok(rows::<14>(FILE, text, COMMENT_AND_HEADING_LINES, is_tab)?
        .into_iter()
        .map(
            |[counter, ax, ay, az, wx, wy, wz, mx, my, mz, qw, qx, qy, qz]| XsensRow {
                imu: ImuSample {
                    stamp: EPOCH + counter as i64 * TICK,
                    orientation: Some([qw, qx, qy, qz]),
                    gyro: [wx, wy, wz],
                    gyro_covariance_0: 0.0,
                    accel: [ax, ay, az],
                },
                field: [mx, my, mz],
            },
        )
        .collect())
}

/// x-IMU3 `Inertial.csv`: microseconds, rate in deg/s, specific force in g.
pub(crate) fn ximu3_inertial(text: &str) -> Result<Vec<ImuSample>, BadLine> {
    Ok(rows::<7>("ximu3_inertial.csv", text, 1, |c| c == ',')?
        .into_iter()
        .map(|[micros, wx, wy, wz, ax, ay, az]| ImuSample {
            stamp: EPOCH + micros as i64 * 1000,
            orientation: None,
            gyro: [wx, wy, wz].map(f64::to_radians),
            gyro_covariance_0: 0.0,
            accel: [ax, ay, az].map(|g| g * STANDARD_GRAVITY),
        })
        .collect())
}

/// x-IMU3 `Quaternion.csv`: microseconds, orientation w, x, y, z (sensor to Earth), as stamp and `[w, x, y, z]`.
pub(crate) fn ximu3_quaternion(text: &str) -> Result<Vec<(i64, [f64; 4])>, BadLine> {
    Ok(rows::<5>("ximu3_quaternion.csv", text, 1, |c| c == ',')?
        .into_iter()
        .map(|[micros, w, x, y, z]| (EPOCH + micros as i64 * 1000, [w, x, y, z]))
        .collect())
}

/// The numbers of every line after the heading; the first column of both formats is an integer below 2^53.
fn rows<const N: usize>(
    file: &'static str,
    text: &str,
    heading: usize,
    is_separator: impl Fn(char) -> bool,
) -> Result<Vec<[f64; N]>, BadLine> {
    text.lines()
        .enumerate()
        .skip(heading)
        .map(|(index, line)| {
            let bad = |why: String| BadLine {
                file,
                line: index + 1,
                why,
            };
            let numbers = line
                .trim()
                .split(&is_separator)
                .map(str::parse)
                .collect::<Result<Vec<f64>, _>>()
                .map_err(|error| bad(error.to_string()))?;
            <[f64; N]>::try_from(numbers)
                .map_err(|numbers| bad(format!("{} columns, need {N}", numbers.len())))
        })
        .collect()
}
