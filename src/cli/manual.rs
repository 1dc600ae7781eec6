//! `strapd completions SHELL`, `strapd man`. I/O.

use super::{Cli, Outcome, print};
use crate::error::{Error, Result};
use clap::{Args, CommandFactory};
use std::path::PathBuf;

/// Shell completions on stdout.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  strapd completions bash > ~/.local/share/bash-completion/completions/strapd")]
pub struct Completions {
    /// Shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// The manual page.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd man | man -l -
  strapd man --out-dir /usr/local/share/man/man1")]
pub struct Man {
    /// Write one page per command into this directory instead; it is made where there is none
    #[arg(long, value_name = "DIR")]
    pub out_dir: Option<PathBuf>,
}

/// Prints the completions.
///
/// # Errors
/// Stdout cannot be written.
pub fn completions(command: &Completions) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(command.shell, &mut Cli::command(), "strapd", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

/// Prints or writes the manual.
///
/// # Errors
/// Stdout or the directory cannot be written.
pub fn man(command: &Man) -> Result<Outcome> {
    if let Some(dir) = &command.out_dir {
        let written = std::fs::create_dir_all(dir)
            .and_then(|()| clap_mangen::generate_to(Cli::command(), dir));
        written.map_err(|source| Error::Write {
            path: dir.clone(),
            source,
        })?;
        return Ok(Outcome::Done);
    }
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command())
        .render(&mut page)
        .map_err(|e| Error::writing("the manual page", e))?;
    print(&String::from_utf8_lossy(&page))?;
    Ok(Outcome::Done)
}
