//! Lines -> a daemon, and what it complains of meanwhile. I/O.

use super::link::{Heard, Link};
use super::remote::Remote;
use super::secret::Secret;
use super::watcher::{MAX_LINE, Said, understood};
use std::time::Duration;
use strapd_recording::decode::framing::{Framed, Framer};
use tokio::time::{Instant, timeout_at};

/// How long the other end may take to read the rest and close.
const CLOSE: Duration = Duration::from_secs(2);
/// Complaints that are said.
const MOST_SAID: u64 = 8;

/// Somebody who sends samples.
#[derive(Debug)]
pub struct Sender {
    link: Link,
    framer: Framer,
    buffer: Vec<u8>,
    complaints: u64,
    last: Option<String>,
}

impl Sender {
    /// Connects, and shows the token where one is given.
    ///
    /// # Errors
    /// In words.
    pub async fn connect(remote: &Remote, token: Option<&Secret>) -> Result<Sender, String> {
        Ok(Sender {
            link: Link::connect_as(remote, token, MAX_LINE).await?,
            framer: Framer::with_limit(MAX_LINE),
            buffer: Vec::new(),
            complaints: 0,
            last: None,
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
        let sent = self.link.send(lines).await;
        lines.clear();
        match sent {
            Ok(()) => self.listen(Duration::ZERO).await,
            Err(why) => {
                // Why it has gone may still be on its way.
                let _ = self.listen(CLOSE).await;
                Err(self.ended(&why.to_string()))
            }
        }
    }

    /// Hears what is answered for so long; with no time, what is there already.
    ///
    /// # Errors
    /// As [`Sender::send`].
    pub async fn listen(&mut self, wait: Duration) -> Result<(), String> {
        let until = Instant::now() + wait;
        while let Ok(heard) = timeout_at(until, self.link.read(&mut self.buffer)).await {
            match heard {
                Ok(heard) => {
                    if let Some(how) = self.hear(&heard) {
                        return Err(self.ended(&how));
                    }
                }
                Err(why) => return Err(self.ended(&why.to_string())),
            }
        }
        Ok(())
    }

    /// Everything was sent: waits until the other end has read it, and says how often it complained.
    ///
    /// # Errors
    /// As [`Sender::send`].
    pub async fn finish(mut self) -> Result<u64, String> {
        // It may have gone already, which is what we wait for.
        let _ = self.link.end().await;
        let until = Instant::now() + CLOSE;
        while let Ok(Ok(heard)) = timeout_at(until, self.link.read(&mut self.buffer)).await {
            if self.hear(&heard).is_some() {
                break;
            }
        }
        Ok(self.complaints)
    }

    /// What was read; how the other end has closed, if it has.
    fn hear(&mut self, heard: &Heard) -> Option<String> {
        let (complaints, last, peer) = (&mut self.complaints, &mut self.last, self.link.peer());
        let mut framed = |framed: Framed<'_>| {
            if let Framed::Line(_, line) = framed
                && let Some(Said::Complaint(what)) = understood(line)
            {
                *complaints += 1;
                if *complaints <= MOST_SAID {
                    tracing::warn!("{peer}: {what}");
                }
                *last = Some(what);
            }
            true
        };
        self.framer.feed(&self.buffer, &mut framed);
        match heard {
            Heard::Bytes => None,
            Heard::Message => {
                self.framer.finish(&mut framed);
                None
            }
            Heard::Closed(words) => {
                self.framer.finish(&mut framed);
                Some(words.as_ref().map_or_else(
                    || "it has closed the connection".to_owned(),
                    |words| format!("it has closed the connection: {words}"),
                ))
            }
        }
    }

    fn ended(&self, how: &str) -> String {
        match &self.last {
            Some(complaint) => format!("{how}; it said {complaint}"),
            None => how.to_owned(),
        }
    }
}
