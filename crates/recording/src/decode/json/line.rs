//! One line of NDJSON -> samples and what the line says of itself. Pure.
//!
//! For stdin and sockets: there a line has no channel, so class, sensor and sequence number travel
//! in it. Takes our own `RATE` and `ATT`, gpsd's `IMU` and `ATT`, SensorServer, Sensor Logger, and any
//! object with a body rate.

use super::Program;
use super::find::Seeker;
use super::scan::Scanner;
use crate::decode::refusal::exact_name;
use crate::decode::{Bare, Decoded, GyroUnit, Options, Undecodable};
use crate::text::printable;
use strapd_attitude::record::{AccelUnit, Nanos, RawSample, SampleKind, TimeUnit};

/// Longest line that is read.
pub const MAX_LINE: usize = 64 << 10;

/// Class that a line states.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Class {
    /// Bare sample without a class.
    #[default]
    None,
    /// Our own sample.
    Rate,
    /// Our own attitude, or gpsd's.
    Att,
    /// gpsd's IMU: deg/s.
    Imu,
    /// Another class, escaped for a terminal.
    Other(String),
}

/// Contents of one line besides its samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Line {
    /// Class.
    pub class: Class,
    /// Sensor's id, as it is: nothing in it needs to be escaped.
    pub id: Option<String>,
    /// Name of one of several sensors of one device, if a line states it (`android.sensor.gyroscope`);
    /// escaped for a terminal.
    pub sensor: Option<String>,
    /// The sender's sequence number.
    pub seq: Option<u64>,
    /// Meaning of its samples in time, if it states that.
    pub sample_kind: Option<SampleKind>,
    /// Unit of its body rate, where it says so.
    pub gyro_unit: Option<GyroUnit>,
    /// Unit of its specific force, where that is known: of a row by its table's columns.
    pub accel_unit: Option<AccelUnit>,
    /// Unit of its stamps, where their name or a setting states it.
    pub stamp_unit: Option<TimeUnit>,
    /// Number of samples, and what was noticed.
    pub decoded: Decoded,
    /// Stamps that are numbers without a unit, at the places of their samples, which have none until
    /// [`unit_of`](crate::decode::unit_of) some of them is known; shorter where no more follow.
    pub bare: Vec<Option<Bare>>,
}

impl Line {
    /// Whether samples of a line like `next` are of the same run: of one sensor, and alike in meaning.
    #[must_use]
    pub fn goes_on_in(&self, next: &Line) -> bool {
        self.id == next.id
            && (self.sample_kind, self.gyro_unit) == (next.sample_kind, next.gyro_unit)
    }
}

/// Reads lines; holds the paths of `--field`.
#[derive(Debug, Clone, Default)]
pub struct LineDecoder {
    plan: Program,
    takes_log: bool,
}

impl LineDecoder {
    /// A decoder of lines with these options.
    #[must_use]
    pub fn new(options: &Options) -> Self {
        LineDecoder {
            plan: Program::compile("", options),
            takes_log: false,
        }
    }

    /// The same for lines that do not say which sensor they are of: it is `sensor`, as Android names
    /// it. One that does is believed.
    #[must_use]
    pub fn with_sensor(options: &Options, sensor: &str) -> Self {
        let mut decoder = LineDecoder::new(options);
        decoder.plan.sensor = Some(sensor.to_owned());
        decoder
    }

    /// The same that reads specific forces and fields that come by themselves, too ([`RawSample::is_beside`]).
    #[must_use]
    pub fn with_besides(mut self) -> Self {
        self.plan.takes_besides = true;
        self
    }

    /// The same of lines that were kept: their log time is the one they state (`log_ns`), if they do.
    #[must_use]
    pub(crate) fn with_log_times(mut self) -> Self {
        self.takes_log = true;
        self
    }

    /// Reads one line, without or with its line end; `received` becomes the log and publish time.
    ///
    /// # Errors
    /// Not a JSON object (or array of them), or longer than [`MAX_LINE`]; an `id` that could be taken for
    /// another's.
    pub fn decode(
        &self,
        line: &[u8],
        received: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Line, Undecodable> {
        if line.len() > MAX_LINE {
            return Err(Undecodable::LongLine {
                have: line.len() as u64,
                limit: MAX_LINE as u64,
            });
        }
        self.decode_object(line, received, out)
    }

    /// The same for an object whose length the caller bounds, and which may go over several lines.
    ///
    /// # Errors
    /// Not a JSON object (or array of them).
    pub fn decode_object(
        &self,
        line: &[u8],
        received: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Line, Undecodable> {
        let mut seeker = Seeker::new(&self.plan, Scanner::new(line)?);
        let found = seeker.message()?;
        let class = match seeker.class.as_deref() {
            None => Class::None,
            Some("RATE") => Class::Rate,
            Some("ATT") => Class::Att,
            Some("IMU") => Class::Imu,
            Some(other) => Class::Other(printable(other)),
        };
        let of_rates = |find: &super::ObjectFields<'_>| (find.kind, find.unit);
        let (kind, unit) = match found.batch.first() {
            Some(first) if !found.has_gyro() => of_rates(first),
            _ => of_rates(&found),
        };
        // Where there is no rate, its unit is not said either.
        let has_rate = found.has_gyro() || found.batch.iter().any(|f| f.has_gyro());
        let stated = match class {
            _ if !has_rate => None,
            Class::Imu => Some(GyroUnit::Deg),
            Class::Rate | Class::Att => Some(GyroUnit::Rad),
            Class::None | Class::Other(_) => None,
        };
        let id = seeker.id.as_deref().map(exact_name).transpose()?;
        let mut bare = Vec::new();
        let kept = seeker.log.filter(|_| self.takes_log).map(Nanos);
        let log = kept.unwrap_or(received);
        let decoded = self.plan.push(&found, log, log, out, &mut bare);
        Ok(Line {
            class,
            id,
            sensor: seeker.sensor.as_deref().map(printable),
            seq: seeker.seq,
            sample_kind: seeker.kind.as_deref().and_then(SampleKind::named).or(kind),
            gyro_unit: unit.or(stated),
            accel_unit: None,
            stamp_unit: found.stamp_unit(),
            decoded,
            bare,
        })
    }
}

/// Reads one line without any options: see [`LineDecoder::decode`].
///
/// # Errors
/// As [`LineDecoder::decode`].
pub fn decode_line(
    line: &[u8],
    received: Nanos,
    out: &mut Vec<RawSample>,
) -> Result<Line, Undecodable> {
    LineDecoder::default().decode(line, received, out)
}
