//! A recording -> its attitudes, as `strapd replay` makes them.
//!
//! ```sh
//! cargo run -p strapd-replay --example attitudes_of_a_recording fixtures/xsens_mti.mcap
//! ```
#![allow(clippy::print_stdout)]

use std::ops::ControlFlow;
use strapd_attitude::estimate::Aid;
use strapd_recording::Source;
use strapd_recording::pool::Pool;
use strapd_replay::error::Result;
use strapd_replay::pipeline::request::ReplayRequest;

fn main() -> Result<()> {
    let log = std::env::args().nth(1);
    let mut request = ReplayRequest::new(Source::parse(log.as_deref().unwrap_or("-")));
    request.plan.aid = Aid::Auto;
    let pool = Pool::new(0)?;

    // All of it at once.
    let (topics, summary) = request.attitudes(&pool)?;
    for topic in &topics {
        let Some(last) = topic.samples.last() else {
            continue;
        };
        let sigma = last.covariance.sigma().map(f64::to_degrees);
        println!(
            "{}: {} attitudes, {} -> {}; the last {:?} (w, x, y, z), sigma {:.3?} degrees",
            topic.stream.id,
            topic.samples.len(),
            topic.stream.body_axes,
            topic.stream.world_axes,
            last.q_nb.wxyz(),
            sigma.as_slice()
        );
    }
    println!("in {:.3} s", summary.elapsed_secs);

    // Or as they are made, until there are enough of them.
    let mut count = 0;
    request.each_attitude(&pool, move |streams, topic, samples| {
        count += samples.len();
        if count > 500 {
            println!("{count} of {} are enough", streams[topic].id);
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    })?;
    Ok(())
}
