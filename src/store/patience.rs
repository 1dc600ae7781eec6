//! Number and length of the waits for a server. Pure.

use std::time::Duration;

/// Patience with a server before it is given up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Patience {
    /// Requests in a row that bring next to nothing.
    pub tries: u32,
    /// The pause after the first of them; each further one is twice as long ...
    pub first_pause: Duration,
    /// ... up to this.
    pub longest_pause: Duration,
    /// The longest pause that a server may ask for.
    pub longest_asked: Duration,
    /// Time until a connection is there.
    pub connect: Duration,
    /// Time until the next byte is there.
    pub silence: Duration,
    /// Within this much time ...
    pub spell: Duration,
    /// ... so many bytes have to come, or be all.
    pub least: u64,
}

impl Default for Patience {
    fn default() -> Self {
        Patience {
            tries: 5,
            first_pause: Duration::from_millis(200),
            longest_pause: Duration::from_secs(5),
            longest_asked: Duration::from_secs(30),
            connect: Duration::from_secs(10),
            silence: Duration::from_secs(30),
            spell: Duration::from_secs(60),
            least: 64 << 10,
        }
    }
}

impl Patience {
    /// The pause after the `failed`th try in a row, from 1; what the server asks for instead, within bounds.
    #[must_use]
    pub(super) fn pause(&self, failed: u32, asked: Option<Duration>) -> Duration {
        let twice = 2u32.saturating_pow(failed.saturating_sub(1).min(16));
        let own = self.first_pause.saturating_mul(twice);
        let own = own.min(self.longest_pause);
        asked.map_or(own, |asked| asked.clamp(own, self.longest_asked.max(own)))
    }
}

/// Bytes as they come -> whether they come too slowly to be waited for.
#[derive(Debug)]
pub(super) struct Pace {
    since: tokio::time::Instant,
    bytes: u64,
}

impl Pace {
    pub(super) fn new() -> Pace {
        Pace {
            since: tokio::time::Instant::now(),
            bytes: 0,
        }
    }

    /// Takes in `bytes`; whether this is still fast enough.
    pub(super) fn holds(&mut self, bytes: usize, patience: &Patience) -> bool {
        self.bytes = self.bytes.saturating_add(bytes as u64);
        if self.since.elapsed() < patience.spell {
            return true;
        }
        let holds = self.bytes >= patience.least;
        *self = Pace::new();
        holds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_double_and_what_a_server_asks_for_is_bounded() {
        let patience = Patience::default();
        let millis = |failed, asked: Option<u64>| {
            let asked = asked.map(Duration::from_secs);
            patience.pause(failed, asked).as_millis()
        };
        assert_eq!([1, 2, 3, 4].map(|n| millis(n, None)), [200, 400, 800, 1600]);
        assert_eq!(millis(9, None), 5000);
        assert_eq!(millis(1, Some(7)), 7000);
        assert_eq!(millis(1, Some(0)), 200);
        assert_eq!(millis(1, Some(86_400)), 30_000);
    }
}
