//! Losses of senders -> one warning for each of them and each cause, again with a count after a minute, and
//! `STATUS`. Pure but for the log and the clock.
//!
//! Apart from the answers to senders because a sensor seldom reads them: without this a stream of which nothing is
//! used leaves no trace in the log. What is remembered and what is logged is bounded, whoever sends what.

use super::fault::Fault;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use strapd_recording::text::snippet;

/// Samples in a row that are not used, after which a stream is reported; a few are no stream.
const MANY: u64 = 10;
/// A sender of which nothing at all was used is reported after so long, however little it sends.
const SOON: Duration = Duration::from_secs(2);
/// A loss that goes on is reported again after so long, and then every hour.
const AGAIN: Duration = Duration::from_secs(60);
const LATER: Duration = Duration::from_secs(3600);
/// A loss that has ended is forgotten after so long.
const FORGOTTEN: Duration = Duration::from_secs(600);
/// Losses remembered; the one that was heard of longest ago makes room.
const MOST: usize = 256;
/// Losses in `STATUS`, those heard of last.
const SHOWN: usize = 32;
/// Lines of the log in a minute.
const LINES: u32 = 16;

/// Samples, or lines that should have brought some, that are not used.
#[derive(Clone, Copy, Debug)]
pub struct Lost<'a> {
    /// The sensor, or the sender where no sensor is known.
    pub source: &'a str,
    /// Why, and what helps.
    pub fault: &'a Fault,
    /// The first line's number, 0 where it has none, and its beginning.
    pub first: (u64, &'a [u8]),
    /// Number of samples.
    pub count: u64,
    /// Nothing of this sender has been used so far.
    pub is_whole: bool,
}

/// All losses of late.
#[derive(Debug, Default)]
pub struct Losses {
    state: Mutex<State>,
    /// Number of those known: without one nobody waits for the lock.
    known: AtomicUsize,
}

#[derive(Debug, Default)]
struct State {
    /// Losses by source and code.
    known: BTreeMap<(String, &'static str), Loss>,
    /// The minute in which lines are counted.
    minute: Option<Instant>,
    lines: u32,
    left_out: u64,
}

#[derive(Debug)]
struct Loss {
    message: String,
    line: u64,
    column: u64,
    near: String,
    total: u64,
    in_a_row: u64,
    is_whole: bool,
    since: Instant,
    last: Instant,
    told: Option<LossReport>,
}

/// Report of a loss: when, of how many samples, and how often.
#[derive(Clone, Copy, Debug)]
struct LossReport {
    at: Instant,
    total: u64,
    times: u32,
}

impl Losses {
    /// Samples are not used.
    pub fn add(&self, lost: &Lost<'_>) {
        let said = self.add_at(lost, Instant::now());
        log(&said);
    }

    /// Samples of this source are used.
    pub fn over(&self, source: &str) {
        if self.known.load(Ordering::Relaxed) == 0 {
            return;
        }
        let mut state = self.lock();
        let from = (source.to_owned(), "");
        let codes: Vec<&'static str> = state
            .known
            .range(from..)
            .take_while(|((of, _), _)| of == source)
            .map(|((_, code), _)| *code)
            .collect();
        for code in codes {
            let key = (source.to_owned(), code);
            if let Some(loss) = state.known.get_mut(&key) {
                (loss.in_a_row, loss.is_whole) = (0, false);
                if loss.told.is_none() {
                    state.known.remove(&key);
                }
            }
        }
        self.known.store(state.known.len(), Ordering::Relaxed);
    }

    /// Reports what is due; to be called again and again.
    pub fn tick(&self) {
        if self.known.load(Ordering::Relaxed) > 0 {
            log(&self.tick_at(Instant::now()));
        }
    }

    /// Last losses that were reported, for `STATUS`.
    pub fn status(&self) -> Vec<Value> {
        let state = self.lock();
        let now = Instant::now();
        let ago = |at: Instant| now.saturating_duration_since(at).as_secs_f64();
        let mut told: Vec<_> = state
            .known
            .iter()
            .filter(|(_, loss)| loss.told.is_some())
            .collect();
        told.sort_by_key(|(_, loss)| std::cmp::Reverse(loss.last));
        let told = told.into_iter().take(SHOWN);
        told.map(|((source, code), loss)| {
            json!({
                "source": source, "code": code, "message": loss.message, "count": loss.total,
                "since_s": ago(loss.since), "last_s_ago": ago(loss.last),
                "line": (loss.line > 0).then_some(loss.line), "column": loss.column, "near": loss.near,
            })
        })
        .collect()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing is left half changed by a panic elsewhere.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn add_at(&self, lost: &Lost<'_>, now: Instant) -> Vec<String> {
        let mut state = self.lock();
        let key = (lost.source.to_owned(), lost.fault.code);
        if state.known.len() >= MOST && !state.known.contains_key(&key) {
            let oldest = state.known.iter().min_by_key(|(_, loss)| loss.last);
            if let Some(oldest) = oldest.map(|(key, _)| key.clone()) {
                state.known.remove(&oldest);
            }
        }
        let loss = state.known.entry(key).or_insert_with(|| Loss {
            message: lost.fault.message.clone(),
            line: lost.first.0,
            column: lost.fault.column.unwrap_or_else(|| suspect(lost)),
            near: snippet(lost.first.1),
            total: 0,
            in_a_row: 0,
            is_whole: lost.is_whole,
            since: now,
            last: now,
            told: None,
        });
        loss.total = loss.total.saturating_add(lost.count);
        loss.in_a_row = loss.in_a_row.saturating_add(lost.count);
        loss.last = now;
        let is_due = loss.told.is_none() && loss.in_a_row >= MANY;
        self.known.store(state.known.len(), Ordering::Relaxed);
        match is_due {
            true => state.tell(&(lost.source.to_owned(), lost.fault.code), now),
            false => Vec::new(),
        }
    }

    fn tick_at(&self, now: Instant) -> Vec<String> {
        let mut state = self.lock();
        state
            .known
            .retain(|_, loss| now.saturating_duration_since(loss.last) < FORGOTTEN);
        self.known.store(state.known.len(), Ordering::Relaxed);
        let due = state.known.iter().filter(|(_, loss)| loss.is_due(now));
        let due: Vec<_> = due.map(|(key, _)| key.clone()).collect();
        let mut said = state.turn(now);
        for key in due {
            said.extend(state.tell(&key, now));
        }
        said
    }
}

impl Loss {
    fn is_due(&self, now: Instant) -> bool {
        let since = |at: Instant| now.saturating_duration_since(at);
        match &self.told {
            None => self.is_whole && self.in_a_row > 0 && since(self.since) >= SOON,
            Some(told) => {
                let wait = if told.times == 1 { AGAIN } else { LATER };
                self.total > told.total && since(told.at) >= wait
            }
        }
    }

    /// Text for the log.
    fn words(&self, source: &str) -> String {
        let source = snippet(source.as_bytes());
        let message = &self.message;
        if let Some(told) = &self.told {
            let (more, total) = (self.total - told.total, self.total);
            return format!(
                "{source}: {more} more samples were not used, {total} in all: {message}"
            );
        }
        let what = match (self.is_whole, self.total) {
            (true, 1) => "the only sample is not used".to_owned(),
            (true, total) => format!("none of {total} samples is used"),
            (false, _) => format!("the last {} samples are not used", self.in_a_row),
        };
        let mut words = format!("{source}: {what}: {message}");
        if self.line > 0 {
            let (line, column) = (self.line, self.column);
            words.push_str(&format!("; first at line {line}, column {column}"));
        }
        if !self.near.is_empty() {
            words.push_str(&format!(": {}", self.near));
        }
        words
    }
}

impl State {
    /// A minute may have begun: what was left out of the log in the last one is counted.
    fn turn(&mut self, now: Instant) -> Vec<String> {
        let minute = *self.minute.get_or_insert(now);
        if now.saturating_duration_since(minute) < AGAIN {
            return Vec::new();
        }
        (self.minute, self.lines) = (Some(now), 0);
        match std::mem::take(&mut self.left_out) {
            0 => Vec::new(),
            n => vec![format!(
                "{n} more reports of samples that are not used were left out here; STATUS has the last"
            )],
        }
    }

    /// Reports a loss: once for all that come from one place for one cause, and no more lines than may be.
    fn tell(&mut self, key: &(String, &'static str), now: Instant) -> Vec<String> {
        let mut said = self.turn(now);
        let (host, is_fresh) = (host(&key.0), |told: &LossReport| {
            now.saturating_duration_since(told.at) < AGAIN
        });
        let is_said = self.known.iter().any(|(other, loss)| {
            let is_alike = other.1 == key.1 && other.0 != key.0 && self::host(&other.0) == host;
            is_alike && loss.told.as_ref().is_some_and(is_fresh)
        });
        let Some(loss) = self.known.get_mut(key) else {
            return said;
        };
        if is_said || self.lines >= LINES {
            self.left_out += 1;
        } else {
            self.lines += 1;
            said.push(loss.words(&key.0));
        }
        loss.told = Some(LossReport {
            at: now,
            total: loss.total,
            times: loss.told.map_or(1, |told| told.times.saturating_add(1)),
        });
        said
    }
}

/// A sender without its port, which changes when it comes again; of a sensor its name.
fn host(source: &str) -> &str {
    let place = source.rsplit_once(':').filter(|_| source.contains("://"));
    place.map_or(source, |(host, _)| host)
}

/// The column of what is probably wrong; 1 where nothing tells.
fn suspect(lost: &Lost<'_>) -> u64 {
    let key: &[u8] = match lost.fault.code {
        "no_rate" | "no_gyro" | "not_finite" | "huge" => b"\"gyro\"",
        "no_stamp" | "ambiguous_stamp" | "stray_stamp" | "duplicate_stamp" | "late" => b"\"stamp\"",
        _ => b"",
    };
    let at = memchr::memmem::find(lost.first.1, key);
    at.map_or(1, |at| at as u64 + 1)
}

fn log(said: &[String]) {
    for words in said {
        tracing::warn!("{words}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault() -> Fault {
        Fault::new("no_stamp", "no stamp; send `stamp`")
    }

    fn lost<'a>(source: &'a str, fault: &'a Fault, count: u64, is_whole: bool) -> Lost<'a> {
        Lost {
            source,
            fault,
            first: (7, b"{\"stamp\":0}"),
            count,
            is_whole,
        }
    }

    #[test]
    fn a_stream_that_is_lost_is_reported_once_and_again_after_a_minute() {
        let (losses, fault, start) = (Losses::default(), fault(), Instant::now());
        assert!(losses.add_at(&lost("a", &fault, 9, true), start).is_empty());
        let said = losses.add_at(&lost("a", &fault, 1, true), start);
        assert_eq!(
            said,
            [
                "a: none of 10 samples is used: no stamp; send `stamp`; first at line 7, column 2: {\"stamp\":0}"
            ]
        );
        for n in 1..60 {
            let now = start + Duration::from_secs(n);
            assert!(losses.add_at(&lost("a", &fault, 100, true), now).is_empty());
            assert!(losses.tick_at(now).is_empty());
        }
        let said = losses.tick_at(start + AGAIN);
        assert_eq!(
            said,
            ["a: 5900 more samples were not used, 5910 in all: no stamp; send `stamp`"]
        );
        assert_eq!(losses.status().len(), 1);
        assert!(losses.tick_at(start + 2 * AGAIN + FORGOTTEN).is_empty());
        assert!(losses.status().is_empty());
    }

    #[test]
    fn a_few_lost_samples_of_a_good_stream_are_none() {
        let (losses, fault, start) = (Losses::default(), fault(), Instant::now());
        for n in 0..100 {
            let now = start + Duration::from_secs(n);
            assert!(losses.add_at(&lost("a", &fault, 9, false), now).is_empty());
            losses.over("a");
            assert!(losses.tick_at(now).is_empty());
        }
        assert!(
            losses
                .add_at(&lost("a", &fault, 9, false), start)
                .is_empty()
        );
        assert!(losses.tick_at(start + 2 * SOON).is_empty());
        // Of one that sends little and of which nothing was used, one is enough.
        assert!(losses.add_at(&lost("b", &fault, 1, true), start).is_empty());
        assert_eq!(losses.tick_at(start + SOON).len(), 1);
    }

    #[test]
    fn a_flood_of_names_floods_neither_the_log_nor_the_memory() {
        let (losses, fault, start) = (Losses::default(), fault(), Instant::now());
        let mut said = Vec::new();
        for n in 0..20_000_u64 {
            let name = format!("{}\u{1b}[31m{n}", "x".repeat(200));
            let now = start + Duration::from_millis(n);
            said.extend(losses.add_at(&lost(&name, &fault, 50, true), now));
            assert!(losses.lock().known.len() <= MOST);
        }
        assert_eq!(said.len(), LINES as usize);
        assert!(said.iter().all(|s| s.len() < 250 && !s.contains('\u{1b}')));
        assert_eq!(losses.status().len(), SHOWN);
        let said = losses.tick_at(start + AGAIN);
        assert!(said[0].starts_with("19984 more reports"), "{said:?}");
    }

    #[test]
    fn one_that_connects_again_and_again_is_one_sender() {
        let (losses, fault, start) = (Losses::default(), fault(), Instant::now());
        let mut said = Vec::new();
        for port in 50_000..50_100 {
            let name = format!("tcp://10.0.0.1:{port}");
            said.extend(losses.add_at(&lost(&name, &fault, 20, true), start));
        }
        assert_eq!(said.len(), 1, "{said:?}");
        let other = losses.add_at(&lost("tcp://10.0.0.2:1", &fault, 20, true), start);
        assert_eq!(other.len(), 1);
    }
}
