//! A file -> an object in a store, whole or not at all. I/O.
//!
//! Apart from what is read because of what may go wrong: an object of several parts is there when it is completed,
//! and not before; where that fails, or somebody interrupts, the parts are given up, and nothing of them can be read.

use super::cloud::Cloud;
use super::fault::Fault;
use super::interrupt::{Interrupt, interrupt};
use super::patience::Patience;
use super::{runtime, wait};
use bytes::Bytes;
use std::fs::File;
use std::future::Future;
use std::io::Read;
use std::sync::Arc;
use std::time::Duration;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::address::Address;
use strapd_replay::sink::upload::Way;

/// Bytes of a part; at most 10,000 are taken, which makes 78 GiB.
const PART: u64 = 8 << 20;
const MOST_PARTS: u64 = 10_000;
/// Time for a part, from its first byte to the answer.
const SILENCE: Duration = Duration::from_secs(300);

/// Way by which objects are put into stores.
pub const WAY: Way = Way { exists, put };

fn exists(address: &Address) -> Result<bool, Diagnostic> {
    let size = at(address, Patience::default(), async |cloud, patience| {
        again(&patience, || cloud.size()).await
    });
    size.map(|size| size.is_some())
}

fn put(address: &Address, file: File) -> Result<(), Diagnostic> {
    let size = file.metadata().map(|found| found.len());
    let size =
        size.map_err(|why| Diagnostic::new(format!("cannot read what was written: {why}")))?;
    if size > PART * MOST_PARTS {
        return Err(
            Diagnostic::new(format!("{size} bytes are more than a store takes in parts"))
                .help("write a file, and bring it there"),
        );
    }
    let patience = Patience {
        silence: SILENCE,
        ..Patience::default()
    };
    let place = address.place();
    at(address, patience, async move |cloud, patience| {
        let mut interrupt = interrupt();
        let put = match size {
            0..=PART => whole(&cloud, file, &patience, &mut interrupt).await,
            _ => in_parts(&cloud, file, size, &patience, &mut interrupt).await,
        };
        if interrupt.has_come() {
            let what = match (&put, size) {
                (Ok(()), _) => "it is there as a whole",
                // The store may have taken all of the one request, and its answer was not waited for.
                (Err(_), 0..=PART) => "it is there as a whole, or not at all",
                (Err(_), _) => "nothing is there of this run",
            };
            tracing::error!("{place}: interrupted: {what}");
            interrupt.end();
        }
        put
    })
}

/// Does what is to be done with the object at an address, where requests run.
fn at<T: Send + 'static, F: Future<Output = Result<T, Fault>> + Send>(
    address: &Address,
    patience: Patience,
    work: impl FnOnce(Arc<Cloud>, Patience) -> F + Send + 'static,
) -> Result<T, Diagnostic> {
    let runtime = runtime().map_err(|e| Diagnostic::new(format!("cannot start threads: {e}")))?;
    let cloud = Arc::new(Cloud::of(address, patience)?);
    let own = Arc::clone(&cloud);
    let done = wait(runtime, async move { work(own, patience).await });
    done.unwrap_or_else(|| Err(Diagnostic::new("the request was given up").into()))
        .map_err(|fault| fault.told(|status| cloud.help(status)))
}

/// Asks until there is an answer that does not pass.
async fn again<T, F: Future<Output = Result<T, Fault>>>(
    patience: &Patience,
    mut ask: impl FnMut() -> F,
) -> Result<T, Fault> {
    let mut failed = 0;
    loop {
        match ask().await {
            Err(Fault::Passing { what, asked }) => {
                failed += 1;
                if failed >= patience.tries {
                    let what = format!("{what}, {failed} times in a row");
                    return Err(Fault::Passing { what, asked });
                }
                tokio::time::sleep(patience.pause(failed, asked)).await;
            }
            answer => return answer,
        }
    }
}

fn read(file: &mut File, count: u64) -> Result<Bytes, Fault> {
    let mut bytes = Vec::new();
    let read = file.take(count).read_to_end(&mut bytes);
    let fail = |why| Diagnostic::new(format!("cannot read what was written: {why}"));
    read.map_err(fail)?;
    Ok(bytes.into())
}

/// Puts it in one piece, which a store takes as a whole.
async fn whole(
    cloud: &Cloud,
    mut file: File,
    patience: &Patience,
    interrupt: &mut Interrupt,
) -> Result<(), Fault> {
    let bytes = read(&mut file, PART)?;
    tokio::select! {
        put = again(patience, || cloud.put(bytes.clone())) => put,
        () = interrupt.come() => Err(Diagnostic::new("interrupted").into()),
    }
}

async fn in_parts(
    cloud: &Cloud,
    file: File,
    size: u64,
    patience: &Patience,
    interrupt: &mut Interrupt,
) -> Result<(), Fault> {
    let id = again(patience, || cloud.begin()).await?;
    let put = tokio::select! {
        put = parts(cloud, &id, file, size, patience) => put,
        () = interrupt.come() => Err(Diagnostic::new("interrupted").into()),
    };
    let Err(why) = put else { return Ok(()) };
    // What fails here is swept up by the store, if it was told to; the first failure is what matters.
    if again(patience, || cloud.give_up(&id)).await.is_err() {
        tracing::warn!(
            "its parts could not be given up: they cannot be read, and are kept until the store sweeps them up"
        );
    }
    Err(why)
}

/// One after the other: what is answered is told by the last request.
async fn parts(
    cloud: &Cloud,
    id: &String,
    mut file: File,
    size: u64,
    patience: &Patience,
) -> Result<(), Fault> {
    let mut all = Vec::new();
    for n in 0..size.div_ceil(PART) as usize {
        let bytes = read(&mut file, PART)?;
        all.push(again(patience, || cloud.part(id, n, bytes.clone())).await?);
    }
    let made = again(patience, || cloud.complete(id, all.clone())).await;
    match made {
        // It is not known any more: the answer to an earlier request to complete it was lost.
        Err(Fault::Refused(404)) if cloud.size().await == Ok(Some(size)) => Ok(()),
        made => made,
    }
}
