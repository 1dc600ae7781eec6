//! The peer to be beaten at reading: merely iterates `mcap::MessageStream` over a file, decodes nothing.
//!
//! ```text
//! cargo run --release --example iterate_message_stream -- FILE.mcap [--check-crc]
//! ```
//!
//! Prints messages, bytes of payload and seconds as one JSON object. Generous to the peer: the clock starts
//! when the whole file is already in memory (its documentation maps the file; mapping needs `unsafe`, which
//! this crate forbids) and chunk checksums are not verified unless asked for, which is its default.

#![allow(clippy::print_stdout)]

use clap::Parser;
use mcap::MessageStream;
use mcap::read::Options;
use std::error::Error;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

/// Iterates every message of an MCAP file.
#[derive(Parser, Debug)]
struct Arguments {
    /// File to read.
    input: PathBuf,
    /// Verify the checksum of each chunk, as a reader that trusts nobody must.
    #[arg(long)]
    check_crc: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let bytes = std::fs::read(&arguments.input)?;
    let options = if arguments.check_crc {
        Options::ValidateChunkCrcs.into()
    } else {
        Default::default()
    };

    let start = Instant::now();
    let mut messages = 0_u64;
    let mut payload = 0_u64;
    for message in MessageStream::new_with_options(&bytes, options)? {
        let message = black_box(message?);
        messages += 1;
        payload += message.data.len() as u64;
    }
    let seconds = start.elapsed().as_secs_f64();

    println!(r#"{{"messages":{messages},"payload_bytes":{payload},"seconds":{seconds:.6}}}"#);
    Ok(())
}
