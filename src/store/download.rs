//! One range of an object -> its bytes, over as many requests as it takes. I/O.

use super::answer::{Reply, Version};
use super::fault::Fault;
use super::patience::{Pace, Patience};
use super::place::Place;
use bytes::Bytes;
use futures_util::StreamExt;
use std::ops::Range;
use strapd_attitude::diagnostic::Diagnostic;

/// Asks until there is an answer, or as often as it makes sense.
pub(super) async fn asked(
    place: &Place,
    range: Range<u64>,
    patience: &Patience,
) -> Result<Reply, Fault> {
    let mut failed = 0;
    loop {
        match place.get(range.clone()).await {
            Err(Fault::Passing { what, asked }) => {
                failed += 1;
                if failed >= patience.tries {
                    return Err(given_up(&what, failed));
                }
                tokio::time::sleep(patience.pause(failed, asked)).await;
            }
            other => return other,
        }
    }
}

/// Downloads a range of the object that is `version`, and hands it on piece by piece: where each lies, and what. A body that is
/// cut is gone on with where it ended.
pub(super) async fn range(
    place: &Place,
    range: Range<u64>,
    version: &Version,
    patience: &Patience,
    mut take: impl FnMut(u64, &[u8]) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut at = range.start;
    let (mut failed, mut good) = (0, at);
    while at < range.end {
        let fault = match place.get(at..range.end).await {
            Ok(Reply::Part(part)) if part.version != *version => return Err(Fault::changed()),
            Ok(Reply::Part(part)) => {
                let mut body = part.body;
                let mut pace = Pace::new();
                loop {
                    match body.next().await {
                        Some(Ok(bytes)) => {
                            let bytes = within(&bytes, range.end - at);
                            take(at, bytes)?;
                            at += bytes.len() as u64;
                            // A body may be longer than what was asked for, or have no end.
                            if at >= range.end {
                                return Ok(());
                            }
                            if !pace.holds(bytes.len(), patience) {
                                break too_slow(patience);
                            }
                        }
                        Some(Err(fault)) => break fault,
                        None => break Fault::passing("a part came short"),
                    }
                }
            }
            Ok(Reply::All { .. }) => return Err(Fault::changed()),
            Err(fault) => fault,
        };
        let Fault::Passing { what, asked } = fault else {
            return Err(fault);
        };
        if at - good >= patience.least {
            (failed, good) = (0, at);
        }
        failed += 1;
        if failed >= patience.tries {
            return Err(given_up(&what, failed));
        }
        tokio::time::sleep(patience.pause(failed, asked)).await;
    }
    Ok(())
}

fn within(bytes: &Bytes, most: u64) -> &[u8] {
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    bytes.get(..most).unwrap_or(bytes)
}

pub(super) fn too_slow(patience: &Patience) -> Fault {
    Fault::passing(format!(
        "less than {} bytes came within {} s",
        patience.least,
        patience.spell.as_secs_f64()
    ))
}

pub(super) fn given_up(what: &str, tries: u32) -> Fault {
    Diagnostic::new(format!("{what} ({tries} times)"))
        .help("try again later, or save it to a file first")
        .into()
}
