//! `strapd`: parse the arguments, start the diagnostics, run, map the outcome to an exit code.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = strapd::cli::Cli::parse();
    strapd::cli::start_diagnostics(&cli.global);
    strapd::sink::make_size_limit_an_error();
    match strapd::cli::run(cli) {
        Ok(outcome) => outcome.into(),
        Err(error) if error.is_broken_pipe() => ExitCode::SUCCESS,
        Err(error) => {
            strapd::cli::say_error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}
