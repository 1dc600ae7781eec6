//! The program: everything is in the library, so that tests can see inside.

use std::process::ExitCode;

fn main() -> ExitCode {
    strapd::main()
}
