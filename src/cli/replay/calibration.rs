//! `--save-calibration`: the summary of a log -> a file of what was learned of its sensor. I/O.
//!
//! Apart from the run because all that can be wrong with it is found before the first log is read.

use super::Replay;
use crate::cli::{calibration_files, outputs};
use crate::error::{Error, Result};
use crate::report::summary::RunSummary;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::BIAS;

impl Replay {
    /// Path for the calibration of a log.
    fn calibration_file(&self, log: &str) -> Option<String> {
        let name = self.save_calibration.as_ref()?;
        Some(name.replace("{stem}", &outputs::stem(log)))
    }

    /// Checks that each log has a file for its calibration, and each calibration is of one sensor.
    pub(super) fn check_calibrations(&self, logs: &[&String]) -> Result<()> {
        let Some(name) = &self.save_calibration else {
            return Ok(());
        };
        let wrong = |what: &str, help: &str| {
            let what = format!("--save-calibration {name}: {what}");
            Err(Error::usage(Diagnostic::new(what).help(help)))
        };
        if self.recordings().len() > 1 && !name.contains("{stem}") {
            return wrong(
                "each log would be saved there",
                "a name with {stem}, for example {stem}.calibration.toml",
            );
        }
        if self.estimation.topic.as_deref() == Some("all") {
            return wrong("a calibration is of one sensor", "--topic NAME");
        }
        if self.estimation.is_unaided() && !self.estimation.settings.is(BIAS, "auto") {
            return wrong(
                "the gyro alone learns nothing",
                "--aid gravity, or --bias auto for the bias of a rest",
            );
        }
        let files = logs.iter().filter_map(|log| self.calibration_file(log));
        files.map(PathBuf::from).try_for_each(|file| {
            if outputs::is_pattern(name) {
                outputs::make_folder(&file)?;
            }
            calibration_files::check_target(&file, self.force)
        })
    }

    /// Writes what was learned of the sensor of a log, and states in its summary where.
    pub(super) fn save_calibration(&self, log: &str, summary: &mut RunSummary) -> Result<()> {
        let Some(file) = self.calibration_file(log) else {
            return Ok(());
        };
        let [topic] = summary.topics.as_slice() else {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "--save-calibration {file}: {} sensors, and a calibration is of one",
                    summary.topics.len()
                ))
                .help("--topic NAME"),
            ));
        };
        calibration_files::write(Path::new(&file), &topic.calibration)?;
        summary.calibration = Some(file);
        Ok(())
    }
}
