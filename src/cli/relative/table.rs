//! Relative attitudes -> a table of text: CSV, or the storage file of OpenSim. Pure.

use crate::error::{Error, Result};
use crate::report::summary::significant;
use std::fmt::Write as _;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::joint::Joint;

/// Form of the table.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Form {
    /// Comma-separated, with a header.
    Csv,
    /// Storage of OpenSim: a motion of one coordinate.
    Sto,
}

impl Form {
    /// Returns the form that a name asks for.
    pub(super) fn of(path: &Path) -> Result<Form> {
        let ending = path.extension().map(|e| e.to_ascii_lowercase());
        match ending.as_deref().and_then(|e| e.to_str()) {
            _ if path == Path::new("-") => Ok(Form::Csv),
            Some("csv") => Ok(Form::Csv),
            Some("sto" | "mot") => Ok(Form::Sto),
            _ => Err(Error::usage(
                Diagnostic::new(format!("-o {}: no form of this name", path.display()))
                    .help("a name that ends in .csv or .sto"),
            )),
        }
    }

    /// Returns the whole table. A quantity that is not known is an empty cell of a CSV; OpenSim reads the angle alone.
    pub(super) fn text(self, found: &Joint) -> String {
        match self {
            Form::Csv => csv(found),
            Form::Sto => sto(found),
        }
    }
}

fn csv(found: &Joint) -> String {
    let mut out =
        String::from("stamp_ns,angle_deg,off_axis_deg,sigma_deg,heading_offset_deg,qw,qx,qy,qz\n");
    for row in &found.rows {
        let sigma = row
            .sigma
            .map_or_else(String::new, |s| significant(s.to_degrees(), 4));
        let [w, x, y, z] = row.q_ab.wxyz();
        let _ = writeln!(
            out,
            "{},{},{},{sigma},{},{w},{x},{y},{z}",
            row.stamp.0,
            row.angle.to_degrees(),
            row.off_axis.to_degrees(),
            row.heading_offset.to_degrees()
        );
    }
    out
}

fn sto(found: &Joint) -> String {
    let mut out = format!(
        "joint\nversion=1\nnRows={}\nnColumns=2\ninDegrees=yes\nendheader\ntime\tangle\n",
        found.rows.len()
    );
    let first = found.rows.first().map(|row| row.stamp);
    for row in &found.rows {
        let seconds = first.map_or(0.0, |first| row.stamp.secs_since(first));
        let _ = writeln!(out, "{seconds:.9}\t{:.9}", row.angle.to_degrees());
    }
    out
}
