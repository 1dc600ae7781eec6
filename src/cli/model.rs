//! `strapd model top|inertia|youbot`: the model library at the command line, JSON in and out. I/O.
//!
//! Each model is a subcommand and a file. As a filter (`filter`) a model answers one JSON object per
//! line of standard input; what people ask with flags is answered as text.

mod filter;
mod inertia;
mod top;
pub(crate) mod top_flags;
pub(crate) mod youbot;

use super::{Global, Outcome};
use crate::error::Result;
use clap::{Args, Subcommand};

/// The model library: requests as NDJSON on stdin, answers on stdout.
#[derive(Args, Debug)]
#[command(
    after_help = "Every request is a JSON object on one line; the answers come in order, one line each.
What cannot be answered becomes {\"error\": \"...\"} on its line, and the exit code is 3.
SI units and radians.

Examples:
  strapd model top --compare                   the tables of docs/top.md, run now
  strapd model inertia < requests.ndjson > answers.ndjson"
)]
pub struct Model {
    /// Model
    #[command(subcommand)]
    pub which: Which,
}

/// The models.
#[derive(Subcommand, Debug)]
pub enum Which {
    /// The symmetric top: its cases, and how well each method finds its attitude
    Top(Box<top::Top>),
    /// The KUKA youBot's arm: kinematics, forces, paths
    Youbot(youbot::Youbot),
    /// Mass, centre of gravity, inertia -> 6x6 matrices, Coriolis forces, acceleration
    Inertia(inertia::Inertia),
}

/// Runs it.
///
/// # Errors
/// Standard input or output fails; flags that cannot be.
pub fn run(global: &Global, args: &Model) -> Result<Outcome> {
    match &args.which {
        Which::Top(command) => top::run(global, command),
        Which::Inertia(command) => inertia::run(command),
        Which::Youbot(command) => youbot::run(command),
    }
}
