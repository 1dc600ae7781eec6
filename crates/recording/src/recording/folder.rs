//! A folder -> the recording in it. I/O.
//!
//! Apart from the input because phones and recorders write a folder for a recording: one file has the rates, and those
//! beside it have what corrects them, or nothing of use here.

use super::line_input;
use super::own_output::MadeBefore;
use super::warn::Warn;
use crate::decode::{Options, Wanted};
use crate::delimited::Table;
use crate::error::{Error, Result};
use crate::format::{Format, open};
use std::io::Read;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::JOIN;

/// Files that are looked at: who has more has no recording there, but an archive.
const MOST: usize = 1000;
/// Names that an error repeats.
const MOST_SAID: usize = 8;

/// Contents of a folder.
#[derive(Debug)]
pub(super) struct Folder {
    /// The file with the rates.
    pub(super) main: PathBuf,
    pub(super) format: Format,
    /// Tables with forces or fields of the same recording.
    pub(super) beside: Vec<PathBuf>,
    /// Table with the orientation that the recorder itself says, where it is not that of the rates.
    pub(super) orientation: Option<PathBuf>,
    /// The files of a recording that is in several.
    pub(super) parts: Vec<PathBuf>,
}

/// The tables of a folder, by what they hold.
#[derive(Default)]
struct Tables {
    rates: Vec<PathBuf>,
    orientations: Vec<PathBuf>,
    forces: Vec<PathBuf>,
    fields: Vec<PathBuf>,
}

/// Looks at the files of a folder, not at those of folders in it.
///
/// # Errors
/// It cannot be read; there is no recording in it, or more than one.
pub(super) fn of(path: &Path, warn: &Warn) -> Result<Folder> {
    let unsupported = |what: Diagnostic| Error::unsupported(path, what);
    let files = files(path)?;
    if files.len() > MOST {
        return Err(unsupported(
            Diagnostic::new(format!("a folder of {} files", files.len()))
                .help("name one of them, or the folder of one recording"),
        ));
    }
    let mut whole: Vec<(PathBuf, Format)> = Vec::new();
    let mut tables = Tables::default();
    let mut known = None;
    for file in &files {
        match Format::of_file(file) {
            Ok(Some(format)) => whole.push((file.clone(), format)),
            Err(why @ Error::NotRead { .. }) => known = known.or(Some(why)),
            Ok(None) | Err(_) => {}
        }
    }
    let (of_tables, whole): (Vec<_>, Vec<_>) = without_those_made_before(path, whole, warn)
        .into_iter()
        .partition(|(_, format)| *format == Format::Table);
    of_tables.iter().for_each(|(file, _)| tables.add(file));
    for found in [&mut tables.rates, &mut tables.fields] {
        let is_raw = |file: &PathBuf| stem(file).contains("uncalibrated");
        if found.iter().any(|file| !is_raw(file)) {
            found.retain(|file| !is_raw(file));
        }
    }
    let mut mains = whole;
    let best = match tables.rates.is_empty() {
        true => &tables.orientations,
        false => &tables.rates,
    };
    mains.extend(best.iter().map(|file| (file.clone(), Format::Table)));
    match mains.as_slice() {
        [(main, format)] => Ok(Folder {
            orientation: match format {
                Format::Table => tables.orientation(main),
                _ => None,
            },
            beside: match format {
                Format::Table => tables.beside(main, warn),
                _ => Vec::new(),
            },
            main: main.clone(),
            format: *format,
            parts: Vec::new(),
        }),
        [] => {
            let what = format!(
                "a folder without a recording that is read: {}",
                named(&files)
            );
            Err(known.unwrap_or_else(|| unsupported(Diagnostic::new(what).help("name a file"))))
        }
        several => of_several(path, several),
    }
}

/// A folder of several recordings, which is one where a single recorder split it.
fn of_several(path: &Path, several: &[(PathBuf, Format)]) -> Result<Folder> {
    let files = several.iter().map(|(file, _)| file.clone());
    let files: Vec<PathBuf> = files.collect();
    if let Some(format) = split_by_rosbag2(path, several) {
        return Ok(Folder {
            main: path.to_owned(),
            format,
            beside: Vec::new(),
            orientation: None,
            parts: files,
        });
    }
    let what = format!("a folder of {} recordings: {}", files.len(), named(&files));
    let what = Diagnostic::new(what).help(format!(
        "name one of them; {JOIN} makes one of the files of a recording"
    ));
    Err(Error::unsupported(path, what))
}

impl Tables {
    fn add(&mut self, file: &Path) {
        if let Some(found) = table(file, Wanted::Rates) {
            match found.has_rate() {
                true => self.rates.push(file.to_owned()),
                false => self.orientations.push(file.to_owned()),
            }
        } else if let Some(found) = table(file, Wanted::Forces).filter(Table::has_stamps) {
            if found.has_force() {
                self.forces.push(file.to_owned());
            }
            if found.has_field() {
                self.fields.push(file.to_owned());
            }
        }
    }

    /// The file whose orientations are those of the recording `main`: the only one, or of several the one that is called
    /// so.
    fn orientation(&self, main: &Path) -> Option<PathBuf> {
        if table(main, Wanted::Rates).is_some_and(|own| own.has_orientation()) {
            return None;
        }
        let mut found = self.orientations.iter().filter(|file| *file != main);
        let mut named = found.clone().filter(|file| stem(file) == "orientation");
        match (named.next(), found.next(), found.next()) {
            (Some(named), ..) => Some(named.clone()),
            (None, only, None) => only.cloned(),
            _ => None,
        }
    }

    /// Files that correct the rates of `main`; of several that may be meant none, with a warning.
    fn beside(mut self, main: &Path, warn: &Warn) -> Vec<PathBuf> {
        // Sensor Logger's, of which `Accelerometer` is without gravity.
        for best in ["totalacceleration", "accelerometeruncalibrated"] {
            if let Some(at) = self.forces.iter().position(|file| stem(file) == best) {
                self.forces = vec![self.forces.swap_remove(at)];
            }
        }
        let is_without_gravity = |file: &PathBuf| stem(file) == "accelerometer";
        if self.forces.iter().any(is_without_gravity) && is_of_sensor_logger(main) {
            self.forces.retain(|file| !is_without_gravity(file));
            warn.say(&format!(
                "{}: Sensor Logger's Accelerometer.csv is without gravity and is not used: record Total Acceleration or Accelerometer (Uncalibrated) beside the gyroscope",
                main.display(),
            ));
        }
        // What the rates have in their own rows is not looked for elsewhere.
        let own = table(main, Wanted::Rates);
        if own.as_ref().is_some_and(Table::has_force) {
            self.forces.clear();
        }
        if own.as_ref().is_some_and(Table::has_field) {
            self.fields.clear();
        }
        let mut beside = Vec::new();
        for (what, found) in [
            ("specific force", self.forces),
            ("magnetic field", self.fields),
        ] {
            match found.as_slice() {
                [one] if !beside.contains(one) => beside.push(one.clone()),
                [] | [_] => {}
                several => warn.say(&format!(
                    "{}: the {what} is not used, since it may be in {}: take all but one out of the folder",
                    main.display(),
                    named(several)
                )),
            }
        }
        beside
    }
}

/// Recordings among several files: attitudes that were made of one of them may lie beside it, with a warning.
fn without_those_made_before(
    path: &Path,
    found: Vec<(PathBuf, Format)>,
    warn: &Warn,
) -> Vec<(PathBuf, Format)> {
    if found.len() < 2 {
        return found;
    }
    let (made, mut left): (Vec<_>, Vec<_>) = found
        .into_iter()
        .map(|one| (MadeBefore::in_file(&one.0), one))
        .partition(|(made, _)| made.is_some());
    if left.is_empty() {
        left = made;
    } else {
        for (what, (file, _)) in &made {
            let what = what.iter().map(ToString::to_string).collect::<String>();
            let (folder, file) = (path.display(), named(std::slice::from_ref(file)));
            warn.say(&format!("{folder}: {file} is not read: {what}"));
        }
    }
    left.into_iter().map(|(_, one)| one).collect()
}

/// The format of a folder that a recorder of ROS 2 wrote in several files, by what it put beside them.
fn split_by_rosbag2(path: &Path, files: &[(PathBuf, Format)]) -> Option<Format> {
    let (_, format) = files.first()?;
    let is_of_ros = matches!(format, Format::Mcap | Format::Rosbag2);
    let is_alike = files.iter().all(|(_, other)| other == format);
    (is_of_ros && is_alike && path.join("metadata.yaml").is_file()).then_some(*format)
}

/// Whether a table is one of Sensor Logger's, by its first line.
fn is_of_sensor_logger(file: &Path) -> bool {
    let mut first = [0; 64];
    let read = open(file)
        .ok()
        .and_then(|mut opened| opened.read(&mut first).ok());
    let first = first.get(..read.unwrap_or_default()).unwrap_or_default();
    first.starts_with(b"time,seconds_elapsed,")
}

/// Table that a file is read as, with what is wanted in it.
fn table(file: &Path, wanted: Wanted) -> Option<Table> {
    let options = Options {
        wanted,
        ..Options::default()
    };
    let lines = line_input::open(file, Format::Table, open(file).ok()?, &options).ok()?;
    lines.table().cloned()
}

/// The regular files that are not hidden, by name.
fn files(path: &Path) -> Result<Vec<PathBuf>> {
    let fail = |source| Error::Open {
        path: path.to_owned(),
        source,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(fail)? {
        let file = entry.map_err(fail)?.path();
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        if !name.starts_with('.') && file.is_file() {
            files.push(file);
        }
    }
    files.sort();
    Ok(files)
}

fn stem(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().to_lowercase()
}

/// File names for people, of many the first few.
fn named(files: &[PathBuf]) -> String {
    let name = |file: &PathBuf| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        crate::text::printable(&name)
    };
    let mut names: Vec<String> = files.iter().take(MOST_SAID).map(name).collect();
    if files.is_empty() {
        names.push("no files".to_owned());
    }
    let more = files.len().saturating_sub(MOST_SAID);
    if more > 0 {
        names.push(format!("and {more} more"));
    }
    names.join(", ")
}
