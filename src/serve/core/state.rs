//! Attitudes <-> the file a restarted daemon goes on from (`--state`). Pure, but for [`StateFile`].
//!
//! One JSON object, written under another name, synced and renamed: whatever happens, there is a whole
//! one, at most a second old. Since the file is replaced again and again, the lock that keeps a second daemon
//! out is that of another one beside it, `.NAME.lock`, which stays.

use super::stream::doubts::Lasting;
use super::stream::run::Span;
use crate::error::{Error, Result};
use crate::sink::{self, claim_or_warn, sync_directory};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use strapd_attitude::condition::BatchRate;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Memory;
use strapd_attitude::plausible::{LARGEST, is_covariance, is_unit};
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::TimeUnit;
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};
use strapd_recording::text::printable;

/// Version that this release writes. 1 had neither the run nor the memory.
pub(in crate::serve) const FORMAT: u32 = 2;
/// A larger file is none of ours: a sensor takes no more than 10 KiB.
const MAX_BYTES: u64 = 64 << 20;

/// The last attitude of a sensor, and between which axes it is.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Saved {
    /// Nanoseconds since the epoch of the sensor's clock.
    stamp_ns: i64,
    /// Sensor to world, w, x, y, z.
    q: [f64; 4],
    /// rad/s.
    rate: [f64; 3],
    /// rad^2: xx, xy, xz, yy, yz, zz.
    covariance: [f64; 6],
    reset: u32,
    world: String,
    body: String,
    /// First stamp of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    first_ns: Option<i64>,
    /// Last stamp that was taken, where the last attitude is an older one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    last_ns: Option<i64>,
    /// Unit of stamps that do not say theirs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
    /// Number of the next attitude.
    #[serde(default)]
    seq: u64,
    /// Memory of the estimator, to go on exactly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    memory: Option<Box<Memory>>,
    /// Batches in which its samples come: step, ns, size, and step inside, ns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    batches: Option<(f64, usize, f64)>,
    /// Findings about the sensor that a restart does not end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lasting: Option<Box<Lasting>>,
}

/// The last attitudes of all sensors, by `id`.
pub type Sensors = BTreeMap<String, Saved>;

#[derive(Serialize, Deserialize)]
struct Document<S> {
    strapd_state: u32,
    sensors: S,
}

impl Saved {
    /// Makes it of a stream with these labels.
    #[must_use]
    pub fn new(last: &AttitudeSample, labels: &sink::Stream) -> Saved {
        Saved {
            stamp_ns: last.stamp.0,
            q: last.q_nb.wxyz(),
            rate: last.rate.into(),
            covariance: last.covariance.upper(),
            reset: last.reset_count,
            world: labels.world_axes.clone(),
            body: labels.body_axes.clone(),
            first_ns: None,
            last_ns: None,
            unit: None,
            seq: 0,
            memory: None,
            batches: None,
            lasting: None,
        }
    }

    /// Adds the run, which began with this stamp, before the attitude with number `seq`.
    #[must_use]
    pub fn in_run(
        self,
        first: Option<Nanos>,
        seq: u64,
        unit: Option<TimeUnit>,
        memory: Option<Memory>,
    ) -> Saved {
        let last = memory.as_ref().and_then(Memory::last);
        Saved {
            first_ns: first.map(|f| f.0),
            last_ns: last.map(|l| l.0).filter(|l| *l != self.stamp_ns),
            seq,
            unit: unit.map(|unit| unit.name().to_owned()),
            // What would be refused is not saved: the attitude alone is held, as from other settings.
            memory: memory.filter(Memory::is_plausible).map(Box::new),
            ..self
        }
    }

    /// Adds findings that a restart does not end.
    #[must_use]
    pub(super) fn with_lasting(self, lasting: Option<Lasting>) -> Saved {
        Saved {
            lasting: lasting.filter(Lasting::is_plausible).map(Box::new),
            ..self
        }
    }

    /// Adds the batches in which its samples come.
    #[must_use]
    pub(super) fn with_batches(self, rate: Option<BatchRate>) -> Saved {
        Saved {
            batches: rate.map(|rate| (rate.step, rate.size, rate.inside)),
            ..self
        }
    }

    /// Batches in which its samples come, where that can be.
    pub(super) fn batches(&self) -> Option<BatchRate> {
        let (step, size, inside) = self.batches?;
        let rate = BatchRate { step, size, inside };
        Some(rate).filter(BatchRate::is_plausible)
    }

    /// Findings that the restart has not ended.
    pub(super) fn lasting(&self) -> Option<&Lasting> {
        self.lasting.as_deref()
    }

    /// Span of the run.
    pub(super) fn span(&self) -> Span {
        Span {
            first: self.first_ns.map(Nanos),
            last: Nanos(self.last_ns.unwrap_or(self.stamp_ns)),
        }
    }

    /// Number of the next attitude.
    #[must_use]
    pub fn next_seq(&self) -> u64 {
        // Who has written another number there must not make the count overflow.
        self.seq.min(u64::MAX / 4)
    }

    /// The unit of stamps that do not say theirs.
    #[must_use]
    pub fn unit(&self) -> Option<TimeUnit> {
        TimeUnit::named(self.unit.as_deref()?)
    }

    /// Number of times it has been reset.
    #[must_use]
    pub fn resets(&self) -> u32 {
        self.reset
    }

    /// Memory of the estimator.
    #[must_use]
    pub fn memory(&self) -> Option<&Memory> {
        self.memory.as_deref()
    }

    /// Checks that a daemon can have saved it.
    ///
    /// # Errors
    /// In words: what cannot be.
    pub(in crate::serve) fn check(&self) -> std::result::Result<(), String> {
        if !is_unit(&self.q) {
            return Err("`q` is no unit quaternion".to_owned());
        }
        if !is_covariance(&self.covariance) {
            return Err("`covariance` is none".to_owned());
        }
        if !self.rate.iter().all(|rate| rate.abs() <= LARGEST) {
            return Err("`rate` is none".to_owned());
        }
        if !self.lasting().is_none_or(Lasting::is_plausible) {
            return Err("`lasting` holds what is no finding".to_owned());
        }
        match self.memory().is_none_or(Memory::is_plausible) {
            true => Ok(()),
            false => Err("`memory` holds what no filter can know".to_owned()),
        }
    }

    /// Attitude as it was.
    ///
    /// # Errors
    /// In words: it is between other axes than those of the stream that is to go on from it.
    pub fn attitude(
        &self,
        labels: &sink::Stream,
    ) -> std::result::Result<AttitudeSample, Diagnostic> {
        let saved = (&self.world, &self.body);
        let wanted = (&labels.world_axes, &labels.body_axes);
        if saved != wanted {
            return Err(format!(
                "the attitude saved is of body {} in world {}, and now body {} in world {} is asked for: begun anew",
                self.body, self.world, labels.body_axes, labels.world_axes
            ).into());
        }
        Ok(AttitudeSample {
            stamp: Nanos(self.stamp_ns),
            q_nb: Quaternion::assume_unit(self.q),
            rate: BodyRate(self.rate.into()),
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::from_upper(self.covariance),
            status: Status::OK,
            reset_count: self.reset,
            log: Nanos(self.stamp_ns),
            temperature: None,
        })
    }
}

/// Checks that a daemon can have saved all of them.
///
/// # Errors
/// In words: which sensor's state cannot be, and why.
pub(in crate::serve) fn check(sensors: &Sensors) -> std::result::Result<(), String> {
    sensors.iter().try_for_each(|(id, saved)| {
        let named = |why| format!("sensor {}: {why}", printable(id));
        saved.check().map_err(named)
    })
}

/// The file.
#[derive(Debug)]
pub struct StateFile {
    path: PathBuf,
    temporary: PathBuf,
    written: Vec<u8>,
    /// Locked while this daemon lives.
    _lock: File,
}

impl StateFile {
    /// Reads what a daemon before this one has left, if there was one, and shows that the file can be
    /// written, and that no other daemon does.
    ///
    /// # Errors
    /// [`strapd_recording::Error::Open`], [`Error::Write`]; [`Error::Usage`] when it is no state file: to begin anew in
    /// silence would be to give an attitude nobody expects.
    pub fn open(path: &Path) -> Result<(StateFile, Sensors)> {
        let failed = |source| strapd_recording::Error::Open {
            path: path.to_owned(),
            source,
        };
        let exists = match std::fs::metadata(path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => false,
            Err(source) => return Err(failed(source).into()),
            // To open a FIFO is to wait for its other end, and what is replaced must be a file.
            Ok(found) if !found.is_file() => {
                return Err(Error::usage(
                    Diagnostic::new(format!(
                        "--state {}: is no regular file",
                        path.display()
                    ))
                    .help(
                        "name a file in a folder that the daemon may write to; it is made if it is not there",
                    )
                ));
            }
            Ok(_) => true,
        };
        // First of all: what another daemon writes is no state to go on from.
        let lock = locked(path)?;
        let sensors = match exists {
            true => read(path, File::open(path).map_err(failed)?)?,
            false => Sensors::new(),
        };
        let mut file = StateFile {
            temporary: beside(path, ".part"),
            path: path.to_owned(),
            written: Vec::new(),
            _lock: lock,
        };
        file.write(&sensors)?;
        Ok((file, sensors))
    }

    /// Replaces its content, unless that is the same.
    ///
    /// # Errors
    /// [`Error::Write`]; what was there before is there still.
    pub fn write(&mut self, sensors: &Sensors) -> Result<()> {
        let document = Document {
            strapd_state: FORMAT,
            sensors,
        };
        let failed = |source| Error::Write {
            path: self.path.clone(),
            source,
        };
        let mut text = serde_json::to_vec(&document).map_err(|e| failed(e.into()))?;
        text.push(b'\n');
        if text == self.written {
            return Ok(());
        }
        // What a crash has left, or somebody has put there.
        match std::fs::remove_file(&self.temporary) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(failed(e)),
            _ => {}
        }
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let replaced = options.open(&self.temporary).and_then(|mut file| {
            file.write_all(&text)?;
            file.sync_all()?;
            std::fs::rename(&self.temporary, &self.path)?;
            sync_directory(&self.path)
        });
        replaced.map_err(failed)?;
        self.written = text;
        Ok(())
    }
}

/// The name of a hidden file in the same folder.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(ending);
    path.with_file_name(name)
}

/// The file that is locked in place of the one at `path`.
///
/// # Errors
/// [`Error::Write`]: another daemon has it, or it cannot be made.
fn locked(path: &Path) -> Result<File> {
    let lock = beside(path, ".lock");
    let failed = |path: &Path, source| Error::Write {
        path: path.to_owned(),
        source,
    };
    // What is no file may be waited for without end, or be somebody else's.
    if lock.symlink_metadata().is_ok_and(|found| !found.is_file()) {
        let why = io::Error::new(
            io::ErrorKind::AlreadyExists,
            "is in the way and is no regular file",
        );
        return Err(failed(&lock, why));
    }
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(&lock).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => failed(path, e),
        _ => failed(&lock, e),
    })?;
    claim_or_warn(&file, path).map_err(|e| failed(path, e))?;
    Ok(file)
}

fn read(path: &Path, file: File) -> Result<Sensors> {
    let mut text = Vec::new();
    let read = file.take(MAX_BYTES).read_to_end(&mut text);
    read.map_err(|source| strapd_recording::Error::Open {
        path: path.to_owned(),
        source,
    })?;
    let foreign = |why: String| {
        Error::usage(
            Diagnostic::new(format!("--state {}: {why}", path.display()))
                .help("move it away to begin anew"),
        )
    };
    let document: Document<Sensors> = serde_json::from_slice(&text)
        .map_err(|e| foreign(format!("is no state that strapd has saved: {e}")))?;
    if !(1..=FORMAT).contains(&document.strapd_state) {
        return Err(foreign(format!(
            "is of format {}, and this release reads 1 to {FORMAT}",
            document.strapd_state
        )));
    }
    check(&document.sensors)
        .map_err(|why| foreign(format!("is no state that strapd has saved: {why}")))?;
    Ok(document.sensors)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
