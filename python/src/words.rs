//! The arguments of a replay as the command takes them -> what is to be done. Pure but for a file with a calibration.
//!
//! As texts, and by the functions that read the command's: what `strapd replay` understands is understood here, in
//! its words. (What arrays are estimated by, [`crate::settings`] reads: there a number is a number.)

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::settings::{ROWS, Takes, Value, defaults};
use strapd_attitude::estimate::{EstimationSettings, SensorCalibration};
use strapd_recording::{Selection, Source};
use strapd_replay::config::{calibration, selection, take_beside};
use strapd_replay::error::{Error, Result};
use strapd_replay::pipeline::request::ReplayRequest;

/// A larger file is no calibration.
const LARGEST_CALIBRATION: u64 = 1 << 16;

/// Values by name; the names are the command's, `-` as `_`. Only `field` may have several.
pub struct Words(BTreeMap<String, Vec<String>>);

fn usage(what: impl Into<Diagnostic>) -> Error {
    Error::usage(what)
}

impl Words {
    /// Makes them of these names and values.
    pub fn new(words: BTreeMap<String, Vec<String>>) -> Words {
        Words(words)
    }

    fn all(&self, name: &str) -> &[String] {
        self.0.get(name).map_or(&[], Vec::as_slice)
    }

    /// The value of a name, where it has one.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.all(name).last().map(String::as_str)
    }

    fn owned(&self, name: &str) -> Option<String> {
        self.text(name).map(str::to_owned)
    }

    /// The value of a name as what it is.
    ///
    /// # Errors
    /// [`Error::Usage`] for a text that is none.
    pub fn parsed<T: FromStr<Err: std::fmt::Display>>(&self, name: &str) -> Result<Option<T>> {
        let parsed = self.text(name).map(|text| {
            text.parse()
                .map_err(|why| usage(format!("{name}: {text:?}: {why}")))
        });
        parsed.transpose()
    }

    fn truth(&self, name: &str) -> bool {
        self.text(name) == Some("true")
    }

    /// The replay of the log at `path`.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the argument; the calibration cannot be read.
    pub fn request(
        &self,
        path: PathBuf,
        known: Option<SensorCalibration>,
    ) -> Result<ReplayRequest> {
        let out_rate = self.parsed::<f64>("out_rate")?;
        if out_rate.is_some_and(|hz| !(hz.is_finite() && hz > 0.0)) {
            return Err(usage("out_rate: a rate above 0 Hz is needed"));
        }
        Ok(ReplayRequest {
            selection: self.selection()?,
            plan: self.plan(known)?,
            out_rate,
            ..ReplayRequest::new(Source::File(path))
        })
    }

    /// Selection of samples, and how messages are read.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the argument.
    pub fn selection(&self) -> Result<Selection> {
        let (topic, accel, mag) = (
            self.owned("topic"),
            self.owned("accel_topic"),
            self.owned("mag_topic"),
        );
        let mut selection = selection(
            topic.as_ref(),
            self.all("field"),
            self.truth("ignore_covariance_flag"),
            [accel.as_ref(), mag.as_ref()],
        )?;
        selection.decode.columns = self.parsed("columns")?;
        selection.decode.delimiter = self.parsed("delimiter")?;
        let rows = self.all("where").iter().map(|row| row.parse());
        selection.decode.rows = rows
            .collect::<std::result::Result<_, String>>()
            .map_err(|why| usage(format!("where: {why}")))?;
        Ok(selection)
    }

    fn plan(&self, known: Option<SensorCalibration>) -> Result<EstimationSettings> {
        let known = match (known, self.text("calibration")) {
            (None, Some(path)) => Some(read_calibration(Path::new(path))?),
            (known, _) => known,
        };
        let known = known.map(Arc::new);
        let mut plan = defaults();
        for row in &ROWS {
            let value = match row.takes {
                Takes::Calibration(_) => known.clone().map(Value::Calibration),
                _ => self.text(row.name()).map(Value::Text),
            };
            if let Some(value) = value {
                row.apply(&mut plan, &value).map_err(usage)?;
            }
        }
        let (accel, mag) = (self.owned("accel_topic"), self.owned("mag_topic"));
        take_beside(&mut plan, [accel.as_ref(), mag.as_ref()])?;
        plan.check().map_err(usage)?;
        Ok(plan)
    }
}

fn read_calibration(path: &Path) -> Result<SensorCalibration> {
    let opening = |source| strapd_recording::Error::Open {
        path: path.to_owned(),
        source,
    };
    let file = std::fs::File::open(path).map_err(opening)?;
    let mut text = String::new();
    file.take(LARGEST_CALIBRATION + 1)
        .read_to_string(&mut text)
        .map_err(opening)?;
    let wrong = |what: &str| usage(format!("calibration: {}: {what}", path.display()));
    if text.len() as u64 > LARGEST_CALIBRATION {
        return Err(wrong("larger than any calibration"));
    }
    calibration::parse(&text).map_err(|what| wrong(&what.to_string()))
}
