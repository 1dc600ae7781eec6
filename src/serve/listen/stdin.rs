//! Standard input -> a session. I/O.

use super::{in_room, now};
use crate::serve::hub::{Flood, Hub};
use crate::serve::session::Session;
use std::collections::VecDeque;
use std::io::Read;
use std::sync::Arc;

/// Reads lines to the end of `input` on this thread; whoever started the daemon is trusted, and
/// what is wrong with the lines is said in the log.
pub fn read(hub: &Arc<Hub>, mut input: impl Read) {
    let mut session = Session::new(hub, "standard input".to_owned(), true);
    let mut said = VecDeque::new();
    let mut flood = Flood::default();
    loop {
        flood.wait_in_thread(hub);
        let read = in_room(|buffer, scratch| {
            let n = input.read(buffer)?;
            flood.read(n, buffer.len());
            match buffer.get(..n).unwrap_or_default() {
                [] => session.finish(now(), scratch),
                bytes => session.bytes(bytes, now(), scratch),
            }
            std::io::Result::Ok(n)
        });
        let client = session.client();
        client.outbox.watch(None);
        client.outbox.take(usize::MAX, &mut said);
        for line in said.drain(..) {
            let line = String::from_utf8_lossy(&line);
            if line.contains("\"class\":\"ERROR\"") {
                super::super::quiet::warn("stdin", &format!("standard input: {}", line.trim_end()));
            }
        }
        match read {
            Ok(0) => {
                tracing::info!("standard input has ended");
                return;
            }
            Ok(_) if session.end().is_none() => {}
            Ok(_) => {
                tracing::warn!("standard input: too many bad lines; it is read no further");
                return;
            }
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => {
                tracing::warn!("standard input: {e}");
                return;
            }
        }
    }
}
