//! Writes every file of `fixtures/` that ends in `.mcap`: recordings converted from their makers' text
//! (`fixtures/source`), motions in closed form with exact truth, and a log of known faults.
//!
//! ```text
//! cargo run --example make_fixtures [-- OUTPUT_DIR]
//! ```
//!
//! The same bytes on every machine; `tests/commands/fixtures.rs` checks the committed files against this program.

#![allow(clippy::print_stdout)]

#[path = "make_fixtures/catalogue.rs"]
mod catalogue;

use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let fixtures = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let output = std::env::args_os()
        .nth(1)
        .map_or_else(|| fixtures.clone(), PathBuf::from);
    std::fs::create_dir_all(&output)?;
    for fixture in catalogue::make_all(&fixtures.join("source"))? {
        std::fs::write(output.join(fixture.name), &fixture.bytes)?;
        println!("{:>8} bytes  {}", fixture.bytes.len(), fixture.name);
    }
    Ok(())
}
