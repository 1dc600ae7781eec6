//! Promise: the command line says what it does, what went wrong and which flag helps, on the right
//! stream and with the right exit code.

mod aiding;
mod bare_stamps;
mod flags;
mod help;
mod inputs;
mod made_before;
mod manual;
mod outputs;
mod paste;
mod summaries;

use crate::program::{Ran, strapd, strapd_fed};
use std::path::Path;

/// A directory with `log.mcap`: 300 samples, 3 s, on `/imu/data_raw`.
fn bench() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    crate::made_logs::written(dir.path(), "log.mcap", &crate::made_logs::motion(300));
    dir
}

/// The names in a directory, hidden ones too.
fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
