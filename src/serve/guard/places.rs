//! Places of connections, and who gives one up when they are short. Locks; reads the clock.
//!
//! Every connection needs one. Plain HTTP, and whoever has not shown the token that is asked for, have
//! places of their own: however many come, they take none from those who converse. Where places are
//! short, somebody who does nothing with his gives way to whoever comes.

use super::fault::Fault;
use super::limits::Limits;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// Kind of a connection, as far as places go.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Plain HTTP, as a WebSocket is until it is one.
    Http,
    /// Connection that has not shown the token that is asked for.
    Unproven,
    /// Conversation.
    Served,
}

/// Guest at a place, as far as places go.
pub trait Guest: Send + Sync {
    /// Whether it watches: then it is there for something, though it says nothing.
    fn is_watching(&self) -> bool;
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl std::fmt::Debug for dyn Guest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Guest")
    }
}

/// All places of a daemon, over all its listeners.
#[derive(Debug)]
pub struct Places {
    limits: Limits,
    began: Instant,
    taken: Mutex<SeatTable>,
}

#[derive(Debug, Default)]
struct SeatTable {
    next: u64,
    seats: BTreeMap<u64, Seat>,
}

/// Somebody's place, as the others see it.
#[derive(Debug)]
struct Seat {
    kind: Kind,
    /// Whether it has shown the token that is asked for.
    has_token: bool,
    /// Guest that converses there: it may be watching.
    guest: Option<Arc<dyn Guest>>,
    signs: Arc<Signs>,
}

/// Signs that a connection and those who look for a place give each other.
#[derive(Debug, Default)]
struct Signs {
    /// Time at which it was heard last, in ms since the start.
    heard: AtomicU64,
    is_http: AtomicBool,
    /// Whether it has ended its side, and watches.
    only_watches: AtomicBool,
    leave: Notify,
}

/// A connection's place, free again when this is dropped.
#[derive(Debug)]
pub struct Place {
    places: Arc<Places>,
    number: u64,
    signs: Arc<Signs>,
}

impl Places {
    /// All free.
    #[must_use]
    pub fn new(limits: Limits) -> Places {
        Places {
            limits,
            began: Instant::now(),
            taken: Mutex::default(),
        }
    }

    fn taken(&self) -> MutexGuard<'_, SeatTable> {
        // Every change is whole before anything could panic.
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    /// Number of places for a kind.
    fn room(&self, kind: Kind) -> usize {
        match kind {
            Kind::Http => self.limits.http,
            Kind::Unproven => self.limits.unproven,
            Kind::Served => self.limits.connections,
        }
    }

    /// A place for somebody who has just come; whoever has to give way for it is told.
    #[must_use]
    pub fn take(self: &Arc<Places>, kind: Kind) -> Option<Place> {
        let mut taken = self.taken();
        self.make_room(&mut taken, kind)?;
        let number = taken.next;
        taken.next += 1;
        let signs = Arc::new(Signs::default());
        signs.heard.store(self.now(), Ordering::Relaxed);
        signs.is_http.store(kind == Kind::Http, Ordering::Relaxed);
        let seat = Seat {
            kind,
            has_token: false,
            guest: None,
            signs: signs.clone(),
        };
        taken.seats.insert(number, seat);
        Some(Place {
            places: self.clone(),
            number,
            signs,
        })
    }

    /// Fault that somebody is told who finds none.
    #[must_use]
    pub fn refusal(&self, kind: Kind) -> Fault {
        let whose = match kind {
            Kind::Http => "HTTP requests",
            Kind::Unproven => "connections that have not shown the token",
            Kind::Served => "connections",
        };
        let room = self.room(kind);
        let help = match kind {
            Kind::Http => "",
            Kind::Unproven | Kind::Served => "; --max-clients allows more",
        };
        Fault::new(
            "too_many_clients",
            format!("{room} {whose} are served already{help}"),
        )
    }

    /// Sees to it that one more of a kind has room; `None`: there is none, and nobody has to go.
    fn make_room(&self, taken: &mut SeatTable, kind: Kind) -> Option<()> {
        let of_kind = || taken.seats.iter().filter(|(_, seat)| seat.kind == kind);
        if of_kind().count() < self.room(kind) {
            return Some(());
        }
        let now = self.now();
        let leaves = of_kind()
            .filter(|(_, seat)| seat.may_have_to_go(now, self.limits.idle))
            .min_by_key(|(_, seat)| (!seat.only_watches(), seat.has_token, seat.heard()))
            .map(|(number, _)| *number)?;
        // The place is the other's from now on; who had it is on the way out.
        let seat = taken.seats.remove(&leaves)?;
        seat.signs.leave.notify_one();
        Some(())
    }
}

impl Seat {
    fn heard(&self) -> u64 {
        self.signs.heard.load(Ordering::Relaxed)
    }

    fn only_watches(&self) -> bool {
        self.signs.only_watches.load(Ordering::Relaxed)
    }

    /// Whether it must go when places of its kind are short. A request, or the first line, takes moments:
    /// whoever was longest without a sign of life gives way. Who converses, or has shown the token, goes
    /// when it did nothing for long; a watcher that has ended its side, at any time: it may have gone.
    fn may_have_to_go(&self, now: u64, idle: Duration) -> bool {
        if self.only_watches() || (self.kind != Kind::Served && !self.has_token) {
            return true;
        }
        let is_watching = || {
            let guest = self.guest.as_ref();
            guest.is_some_and(|guest| guest.is_watching())
        };
        u128::from(now.saturating_sub(self.heard())) >= idle.as_millis() && !is_watching()
    }
}

impl Place {
    /// Notes that it has sent something.
    pub fn heard(&self) {
        self.signs.heard.store(self.places.now(), Ordering::Relaxed);
    }

    /// Bytes have come or gone: a sign of life, while it speaks HTTP. Of who converses only what it says
    /// is one: it may be made to say nothing of its own will.
    pub fn moved(&self) {
        if self.signs.is_http.load(Ordering::Relaxed) {
            self.heard();
        }
    }

    /// Marks one that has ended its side: whether it is still there shows late, and it is the first to give way.
    pub fn only_watches(&self) {
        self.signs.only_watches.store(true, Ordering::Relaxed);
    }

    /// Notes the guest that converses there.
    pub fn serves(&self, guest: Arc<dyn Guest>) {
        if let Some(seat) = self.places.taken().seats.get_mut(&self.number) {
            seat.guest = Some(guest);
        }
    }

    /// Notes that the token was shown with an HTTP request.
    pub fn has_shown_token(&self) {
        if let Some(seat) = self.places.taken().seats.get_mut(&self.number) {
            seat.has_token = true;
        }
    }

    /// Makes it another kind from now on, if that has room.
    ///
    /// # Errors
    /// What it is told: there is no place.
    pub fn become_of(&self, kind: Kind, has_token: bool) -> Result<(), Fault> {
        let places = &self.places;
        let mut taken = places.taken();
        let is = taken.seats.get(&self.number).map(|seat| seat.kind);
        if is != Some(kind) {
            let room = is.and_then(|_| places.make_room(&mut taken, kind));
            room.ok_or_else(|| places.refusal(kind))?;
        }
        if let Some(seat) = taken.seats.get_mut(&self.number) {
            seat.kind = kind;
            seat.has_token |= has_token;
        }
        let is_http = kind == Kind::Http;
        self.signs.is_http.store(is_http, Ordering::Relaxed);
        self.heard();
        Ok(())
    }

    /// Waits until somebody else has its place.
    pub async fn lost(&self) {
        self.signs.leave.notified().await;
    }

    /// Fault that it is told then.
    #[must_use]
    pub fn made_room(&self) -> Fault {
        let secs = self.places.limits.idle.as_secs();
        Fault::new(
            "made_room",
            format!(
                "others needed its place: it had not shown the token yet, had ended its side, or had sent and watched nothing for {secs} s"
            ),
        )
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.taken().seats.remove(&self.number);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::serve::core::hub::{Hub, Settings};
    use crate::serve::protocol::filter::Filter;
    use futures_util::FutureExt;

    fn places(idle: Duration) -> Arc<Places> {
        Arc::new(Places::new(Limits {
            connections: 3,
            http: 2,
            unproven: 2,
            idle,
            ..Limits::default()
        }))
    }

    const LONG: Duration = Duration::from_secs(3600);

    fn has_lost(place: &Place) -> bool {
        place.lost().now_or_never().is_some()
    }

    /// Later than all before: times are told apart to the millisecond.
    fn later(places: &Places) {
        let now = places.now();
        while places.now() == now {
            std::thread::yield_now();
        }
    }

    #[test]
    fn no_kind_takes_a_place_of_another() {
        let places = places(LONG);
        let served: Vec<_> = (0..3).map(|_| places.take(Kind::Served).unwrap()).collect();
        assert!(places.take(Kind::Served).is_none());
        let http: Vec<_> = (0..200).map(|_| places.take(Kind::Http).unwrap()).collect();
        let unproven: Vec<_> = (0..200)
            .map(|_| places.take(Kind::Unproven).unwrap())
            .collect();
        assert_eq!(http.iter().filter(|place| has_lost(place)).count(), 198);
        assert_eq!(unproven.iter().filter(|place| has_lost(place)).count(), 198);
        assert!(!served.iter().any(has_lost));
        assert_eq!(places.taken().seats.len(), 7);
        drop((http, unproven));
        assert_eq!(places.taken().seats.len(), 3);
        drop(served);
        assert!(places.take(Kind::Served).is_some());
    }

    #[test]
    fn who_was_heard_longest_ago_goes_first_and_one_with_the_token_last() {
        let places = places(Duration::ZERO);
        let first = places.take(Kind::Http).unwrap();
        later(&places);
        let second = places.take(Kind::Http).unwrap();
        later(&places);
        first.heard();
        let third = places.take(Kind::Http).unwrap();
        assert!(has_lost(&second) && !has_lost(&first));
        first.has_shown_token();
        later(&places);
        third.heard();
        let fourth = places.take(Kind::Http).unwrap();
        assert!(has_lost(&third) && !has_lost(&first));
        fourth.has_shown_token();
        // Only those with the token are left, and they have done nothing for as long as it takes.
        let fifth = places.take(Kind::Http).unwrap();
        assert!(has_lost(&first) && !has_lost(&fourth) && !has_lost(&fifth));
    }

    #[test]
    fn who_watches_or_was_heard_of_late_keeps_its_place() {
        let hub = Arc::new(Hub::new(Settings::default()).unwrap());
        let places = places(Duration::from_millis(50));
        let watcher = places.take(Kind::Served).unwrap();
        let client = hub.join("somebody".to_owned());
        client.outbox.watch(Some(Filter::default()));
        watcher.serves(client.clone());
        let sender = places.take(Kind::Served).unwrap();
        let idle = places.take(Kind::Served).unwrap();
        let taken = loop {
            sender.heard();
            if let Some(taken) = places.take(Kind::Served) {
                break taken;
            }
            std::thread::yield_now();
        };
        assert!(has_lost(&idle) && !has_lost(&watcher) && !has_lost(&sender));
        // Who has lost its place is nobody any more, and frees none when it goes.
        assert!(idle.become_of(Kind::Http, true).is_err());
        drop(idle);
        assert_eq!(places.taken().seats.len(), 3);
        drop(taken);
    }

    #[test]
    fn who_shows_the_token_moves_to_a_place_among_those_who_did() {
        let places = places(LONG);
        let one = places.take(Kind::Unproven).unwrap();
        let _other = places.take(Kind::Unproven).unwrap();
        one.become_of(Kind::Served, true).unwrap();
        // Its old place is free: nobody has to go for this one.
        let third = places.take(Kind::Unproven).unwrap();
        let _served: Vec<_> = (0..2).map(|_| places.take(Kind::Served).unwrap()).collect();
        let fault = third.become_of(Kind::Served, true).unwrap_err();
        assert_eq!(fault.code, "too_many_clients");
        assert!(fault.message.starts_with("3 connections"), "{fault:?}");
    }
}
