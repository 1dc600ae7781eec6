//! Lines -> a daemon, and what it complains of meanwhile. I/O.
//!
//! A watcher that asks for nothing: what comes back is read as a watcher reads it.

use super::remote::Remote;
use super::secret::Secret;
use super::watcher::{Said, Watcher};
use std::time::Duration;
use tokio::time::{Instant, timeout_at};

/// Time that the other end may take to say why it has gone.
const REASON: Duration = Duration::from_secs(2);
/// Time that it may take to read the rest and close.
const CLOSE: Duration = Duration::from_secs(10);
/// Complaints that are said.
const MOST_SAID: u64 = 8;

/// Somebody who sends samples.
#[derive(Debug)]
pub struct Sender {
    watcher: Watcher,
    complaints: u64,
}

impl Sender {
    /// Connects, and shows the token where one is given.
    ///
    /// # Errors
    /// In words.
    pub async fn connect(remote: &Remote, token: Option<&Secret>) -> Result<Sender, String> {
        Ok(Sender {
            watcher: Watcher::open(remote, token).await?,
            complaints: 0,
        })
    }

    /// Sends lines, given without the end of the last one, and leaves none of them.
    ///
    /// # Errors
    /// The daemon has gone: how, and what it complained of last.
    pub async fn send(&mut self, lines: &mut String) -> Result<(), String> {
        if lines.is_empty() {
            return Ok(());
        }
        let sent = self.watcher.link().send(lines).await;
        lines.clear();
        match sent {
            Ok(()) => self.listen(Duration::ZERO).await,
            Err(why) => {
                // Why it has gone may still be on its way.
                let _ = self.listen(REASON).await;
                Err(self.watcher.ended(&why.to_string()))
            }
        }
    }

    /// Hears what is answered for so long; with no time, what is there already.
    ///
    /// # Errors
    /// As [`Sender::send`].
    pub async fn listen(&mut self, wait: Duration) -> Result<(), String> {
        let until = Instant::now() + wait;
        while let Ok(heard) = timeout_at(until, self.hear()).await {
            heard?;
        }
        Ok(())
    }

    /// Everything was sent: waits until the other end has read it and closed, and says how often it complained.
    ///
    /// # Errors
    /// It has not closed in time: what it has read nobody knows.
    pub async fn finish(mut self) -> Result<u64, String> {
        // It may have gone already, which is what we wait for.
        let _ = self.watcher.link().end().await;
        let until = Instant::now() + CLOSE;
        loop {
            match timeout_at(until, self.hear()).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) => return Ok(self.complaints),
                Err(_) => {
                    return Err(self.watcher.ended(&format!(
                        "everything was sent, but it has not closed within {} s",
                        CLOSE.as_secs()
                    )));
                }
            }
        }
    }

    /// Waits for what comes next. May be dropped and called again: nothing is lost.
    async fn hear(&mut self) -> Result<(), String> {
        let (complaints, peer) = (&mut self.complaints, self.watcher.peer().to_owned());
        let mut take = |said: Said<'_>| {
            if let Said::Complaint(what) = said {
                *complaints += 1;
                if *complaints <= MOST_SAID {
                    tracing::warn!("{peer}: {what}");
                }
            }
            true
        };
        self.watcher.next(&mut take).await.map(|_| ())
    }
}
