//! `--columns`, `--delimiter`, `--where`: what the columns of a table of text are, where its names do not tell, and which
//! of its rows are read. Pure.

use crate::error::{Error, Result};
use clap::Args;
use strapd_recording::decode::Options;

/// Layout of a table of text (CSV, TSV, ...).
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Tables of text")]
pub struct Tables {
    /// Columns of a table, by name or number from 1: ROLE=NAME:NAME:NAME[:UNIT[*FACTOR]],ROLE=...
    ///
    /// ROLE is one of gyro, accel, mag, dq, dv (x:y:z), orientation (w:x:y:z), stamp, dt, counter, sensor,
    /// temperature. `info` and the summary print what they assumed. Roles that are not given are found by name; =none
    /// leaves one out.
    #[arg(long, value_name = "ROLE=NAMES")]
    pub columns: Option<String>,
    /// Delimiter between the cells of a table: tab, semicolon, comma, pipe, blanks, or a punctuation mark
    #[arg(long, value_name = "MARK")]
    pub delimiter: Option<String>,
    /// Rows of a table that are read: those of this value in a column; others are left out and counted
    ///
    /// May be given several times: values of one column are alternatives, different columns must all fit.
    #[arg(long = "where", value_name = "COLUMN=VALUE")]
    pub rows: Vec<String>,
}

impl Tables {
    /// Puts them into the options that a table is read with.
    ///
    /// # Errors
    /// [`Error::Usage`] for one that is none.
    pub fn put(&self, options: &mut Options) -> Result<()> {
        let columns = self.columns.as_deref().map(str::parse);
        options.columns = columns
            .transpose()
            .map_err(|why| Error::usage(format!("--columns: {why}")))?;
        let delimiter = self.delimiter.as_deref().map(str::parse);
        options.delimiter = delimiter
            .transpose()
            .map_err(|why| Error::usage(format!("--delimiter: {why}")))?;
        let rows = self.rows.iter().map(|row| row.parse());
        options.rows = rows
            .collect::<std::result::Result<_, String>>()
            .map_err(|why| Error::usage(format!("--where: {why}")))?;
        Ok(())
    }
}
