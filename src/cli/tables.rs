//! `--columns`, `--delimiter`: what the columns of a table of text are, where its names do not tell. Pure.

use crate::error::{Error, Result};
use clap::Args;
use strapd_recording::decode::Options;

/// Layout of a table of text (CSV, TSV, ...).
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Tables of text")]
pub struct Tables {
    /// Columns of a table, by name or number from 1: ROLE=NAME:NAME:NAME[:UNIT],ROLE=...
    ///
    /// ROLE is one of gyro, accel, mag (x:y:z), orientation (w:x:y:z), stamp, counter. `info` and the summary print
    /// what they assumed. Roles that are not given are found by name; =none leaves one out.
    #[arg(long, value_name = "ROLE=NAMES")]
    pub columns: Option<String>,
    /// Delimiter between the cells of a table: tab, semicolon, comma, pipe, blanks, or a punctuation mark
    #[arg(long, value_name = "MARK")]
    pub delimiter: Option<String>,
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
        Ok(())
    }
}
