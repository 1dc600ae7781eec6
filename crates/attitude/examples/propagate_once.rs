//! One method over one log, as often as asked: for counting instructions (`benches/callgrind.sh`).
//!
//! ```text
//! cargo run --release -p strapd-attitude --example propagate_once -- METHOD INPUT PASSES
//! ```
//!
//! METHOD as in the table below; INPUT `rates`, `jittered`, `increments` or `increments-jittered`, 8192 samples at
//! 200 Hz of 2 rad/s with white noise of 5 mrad/s. The cost of a sample is the difference of two runs over that of
//! their passes. Prints a digest of the last pass. Without a method: their names.

#![allow(clippy::print_stdout, unreachable_pub)]

#[path = "../benches/propagate/cases.rs"]
mod cases;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let Some(name) = arguments.next() else {
        for (name, _) in cases::METHODS {
            println!("{name}");
        }
        return Ok(());
    };
    let input = arguments.next().ok_or("INPUT is missing")?;
    let passes: usize = arguments.next().ok_or("PASSES is missing")?.parse()?;
    let (_, method) = cases::METHODS
        .into_iter()
        .find(|(known, _)| *known == name)
        .ok_or_else(|| format!("no method is called {name}"))?;
    let (_, input) = cases::INPUTS
        .into_iter()
        .find(|(known, _)| *known == input)
        .ok_or_else(|| format!("no input is called {input}"))?;
    let samples = cases::log(8192, &input);
    let mut out = Vec::with_capacity(samples.len());
    for _ in 0..passes {
        cases::run(method, input.kind, &samples, &mut out)?;
    }
    // Of all bits of all attitudes (FNV-1a): a change that is to cost no bit is checked by it.
    let digest = out
        .iter()
        .flat_map(|a| a.q_nb.wxyz())
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, c| {
            (hash ^ c.to_bits()).wrapping_mul(0x0100_0000_01b3)
        });
    println!("{digest:016x}");
    Ok(())
}
