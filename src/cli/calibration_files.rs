//! `--calibration`, `--save-calibration`: files and folders <-> calibrations. I/O.

use crate::client::remote::encoded;
use crate::config::calibration::{parse, text_of};
use crate::error::{Error, Result};
use crate::sink::{no_folder, sync_directory};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::SensorCalibration;

/// A larger file is no calibration.
const MAX_BYTES: u64 = 1 << 16;
/// Most files of a folder.
const MOST_FILES: usize = 4096;

/// Calibrations that `--calibration` names.
#[derive(Debug)]
pub(super) enum Calibrations {
    /// Calibration of every sensor there is.
    One(Arc<SensorCalibration>),
    /// Calibrations of sensors by their names.
    Each(BTreeMap<String, Arc<SensorCalibration>>),
}

impl Calibrations {
    /// Reads a file, or the `.toml` files of a folder.
    ///
    /// # Errors
    /// [`strapd_recording::Error::Open`]; [`Error::Usage`] with line and key: it is no calibration.
    pub(super) fn read(path: &Path) -> Result<Calibrations> {
        if !path.is_dir() {
            return Ok(Calibrations::One(Arc::new(read(path)?)));
        }
        let mut files: Vec<PathBuf> = std::fs::read_dir(path)
            .and_then(|entries| entries.map(|e| e.map(|e| e.path())).collect())
            .map_err(opening(path))?;
        files.retain(|file| file.extension().is_some_and(|e| e == "toml"));
        files.sort();
        if files.len() > MOST_FILES {
            return Err(no_calibration(
                path,
                format!("{} files, at most {MOST_FILES} are read", files.len()),
            ));
        }
        let mut each = BTreeMap::new();
        for file in files {
            let known = read(&file)?;
            let Some(sensor) = known.sensor.clone() else {
                return Err(no_calibration(
                    &file,
                    Diagnostic::new("names no sensor")
                        .help("sensor = \"ID\" says whose it is, of several in a folder"),
                ));
            };
            if each.insert(sensor.clone(), Arc::new(known)).is_some() {
                return Err(no_calibration(
                    &file,
                    format!("there is another of the sensor `{sensor}` in this folder"),
                ));
            }
        }
        Ok(Calibrations::Each(each))
    }

    /// Whether it holds for every sensor.
    pub(super) fn of_all(&self) -> Option<Arc<SensorCalibration>> {
        match self {
            Calibrations::One(known) => Some(known.clone()),
            Calibrations::Each(_) => None,
        }
    }
}

fn opening(path: &Path) -> impl Fn(io::Error) -> Error {
    let path = path.to_owned();
    move |source| {
        strapd_recording::Error::Open {
            path: path.clone(),
            source,
        }
        .into()
    }
}

fn no_calibration(path: &Path, why: impl Into<Diagnostic>) -> Error {
    let place = format!("--calibration {}", path.display());
    Error::usage(why.into().at(place))
}

fn read(path: &Path) -> Result<SensorCalibration> {
    let metadata = std::fs::metadata(path).map_err(opening(path))?;
    // To open a FIFO is to wait for its other end.
    if !metadata.is_file() || metadata.len() > MAX_BYTES {
        return Err(no_calibration(
            path,
            "is no calibration: a text file of at most 64 KiB is expected",
        ));
    }
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MAX_BYTES).read_to_end(&mut bytes))
        .map_err(opening(path))?;
    let text = String::from_utf8(bytes)
        .map_err(|e| no_calibration(path, format!("is no text: {}", e.utf8_error())))?;
    parse(&text).map_err(|why| no_calibration(path, why))
}

/// Checks that a calibration can be saved there.
///
/// # Errors
/// [`Error::Usage`], [`Error::OutputExists`].
pub(super) fn check_target(path: &Path, force: bool) -> Result<()> {
    // So that no slip of the hand replaces a recording.
    if path.extension().is_none_or(|e| e != "toml") {
        return Err(Error::usage(
            Diagnostic::new(format!(
                "--save-calibration {}: a calibration is a TOML file",
                path.display()
            ))
            .help("give it a name that ends in .toml"),
        ));
    }
    if path.exists() && !force {
        return Err(Error::OutputExists {
            path: path.to_owned(),
        });
    }
    // Before hours of work, not after them.
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => Err(Error::Write {
            path: path.to_owned(),
            source: no_folder(folder),
        }),
        _ => Ok(()),
    }
}

/// Writes it: whatever happens, there is a whole one, or the one there was.
///
/// # Errors
/// [`Error::Write`].
pub(super) fn write(path: &Path, known: &SensorCalibration) -> Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    tempfile::Builder::new()
        .prefix(".strapd-calibration")
        .tempfile_in(folder)
        .and_then(|mut file| {
            file.write_all(text_of(known).as_bytes())?;
            file.as_file().sync_all()?;
            file.persist(path).map_err(|e| e.error)?;
            sync_directory(path)
        })
        .map_err(|source| Error::Write {
            path: path.to_owned(),
            source,
        })
}

/// The file of a sensor in a folder of calibrations.
pub(super) fn file_of(folder: &Path, sensor: &str) -> PathBuf {
    // A dot at the beginning would hide it.
    let name = encoded(sensor, b"").replacen('.', "%2E", usize::from(sensor.starts_with('.')));
    folder.join(format!("{name}.toml"))
}
