//! A log -> the first message of each of its channels. I/O.
//!
//! Apart from the survey because a summary tells channels and counts, and what a channel can serve as may show only in a
//! message.

use super::log_channel::nanos;
use super::opened::problems;
use crate::error::Result;
use crate::mcap::{self, Reader, Survey, WalkOptions};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use strapd_attitude::record::Nanos;

/// Largest first message that is kept, and all of them together: an IMU's is small, and a log may
/// have thousands of channels of images.
const FIRST_LIMIT: usize = 64 << 10;
const FIRSTS_LIMIT: usize = 16 << 20;

pub(super) struct First {
    pub(super) id: u16,
    pub(super) topic: String,
    pub(super) log: Nanos,
    pub(super) data: Vec<u8>,
}

/// The first message of every channel, in file order, reading no further than needed; and what was
/// wrong with the file up to there.
pub(super) fn first_messages(reader: Reader, survey: &Survey) -> Result<(Vec<First>, Vec<String>)> {
    let wanted = survey.channels.iter().filter(|c| c.messages > 0).count();
    let mut firsts: Vec<First> = Vec::new();
    let (mut met, mut bytes) = (0, 0);
    // On the calling thread: "first" must not depend on who was faster.
    let report = mcap::walk(
        reader,
        // One item a channel: waiting for a batch of them would read the whole log.
        &WalkOptions {
            batch: 1,
            only_firsts: true,
            ..WalkOptions::default()
        },
        |_| Some(AtomicBool::new(false)),
        |seen, message, out: &mut Vec<First>| {
            if !seen.swap(true, Ordering::Relaxed) {
                out.push(First {
                    id: message.channel.id,
                    topic: message.channel.topic.clone(),
                    log: nanos(message.log_time),
                    data: message
                        .data
                        .get(..FIRST_LIMIT.min(message.data.len()))
                        .map_or_else(Vec::new, <[u8]>::to_vec),
                });
            }
        },
        |items| {
            for first in items.drain(..) {
                met += 1;
                bytes += first.data.len();
                if first.data.len() < FIRST_LIMIT && bytes < FIRSTS_LIMIT {
                    firsts.push(first);
                }
            }
            if met >= wanted {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        },
    )?;
    Ok((firsts, problems(&report.survey)))
}
