//! Standard input -> a session. I/O.

use crate::serve::core::hub::{Complaint, Flood, Hub};
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::{Session, Side};
use crate::serve::guard::log_throttle;
use std::io::Read;
use std::sync::Arc;

/// Reads lines to the end of `input` on this thread; whoever started the daemon is trusted, and
/// what is wrong with the lines is said in the log.
pub fn read(hub: &Arc<Hub>, mut input: impl Read) {
    let side = Side::ListenOnly { trusted: true };
    let mut session = Session::with(hub, "standard input".to_owned(), side);
    let mut flood = Flood::default();
    loop {
        flood.wait_in_thread(hub);
        let read = with_read_buffer(|buffer, scratch| {
            let n = input.read(buffer)?;
            flood.read(n, buffer.len());
            match buffer.get(..n).unwrap_or_default() {
                [] => session.finish(now(), scratch),
                bytes => session.bytes(bytes, now(), scratch),
            }
            std::io::Result::Ok(n)
        });
        loop {
            for Complaint { fault, line, .. } in session.complaints() {
                // While nothing of it is used, that is said with a count of what is not.
                if session.has_sent() || !fault.is_loss() {
                    let at = if line > 0 {
                        format!(", line {line}")
                    } else {
                        String::new()
                    };
                    let what = format!("standard input{at}: {}", fault.in_words());
                    log_throttle::warn("stdin", &what);
                }
            }
            if !session.is_held() {
                break;
            }
            with_read_buffer(|_, scratch| session.go_on(scratch));
        }
        match read {
            Ok(0) => {
                tracing::info!("standard input has ended");
                return;
            }
            Ok(_) => {
                let Some(end) = session.end() else { continue };
                tracing::warn!("standard input: {}; it is read no further", end.reason());
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
