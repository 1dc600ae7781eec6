//! The conversation with one client, round by round: read, worked on, written. I/O.
//!
//! Apart from the socket because what is still read and still said depends on who has ended what: the client its
//! side, the session, the daemon.

use super::{Duplex, LAST_READ, MADE_ROOM, Pending, SETTLE, TURNS, linger};
use crate::client::link;
use crate::serve::core::hub::{Client, Flood, Hub, count};
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::Session;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::limits::Limits;
use crate::serve::guard::places::{Kind, Place};
use crate::serve::guard::shutdown::Running;
use crate::serve::protocol::wire;
use std::future::ready;
use std::io;
use std::ops::ControlFlow;
use std::sync::Arc;
use tokio::task::yield_now;
use tokio::time::{Instant, Interval, MissedTickBehavior, interval, sleep, timeout};

/// Reason for which we ended a conversation; `None`: it ended by itself.
pub(super) type Reason = Option<&'static str>;

/// Phase of a conversation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    /// Reading, as long as something is sent.
    Talking,
    /// The daemon ends: what has arrived is still taken, at most so many bytes.
    LastRead { left: usize },
    /// Nothing more is read; what waits for it is still sent.
    Closing(Reason),
}

/// Sending side of a client.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Input {
    /// Nothing is known of its end.
    Open,
    /// Ended by the client: it sends nothing more.
    Ended,
    /// Others may send its sensors.
    GivenBack,
}

/// Outcome of writing without waiting.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Output {
    /// All is written.
    Empty,
    /// The socket has no room.
    Blocked,
    /// More is there, and it takes it as fast as it is made.
    Hurry,
}

/// Conversation with one client.
pub(super) struct Talk<'a, D> {
    io: &'a D,
    session: &'a mut Session,
    running: &'a mut Running,
    place: &'a Place,
    hub: Arc<Hub>,
    client: Arc<Client>,
    limits: Limits,
    phase: Phase,
    input: Input,
    /// Whether it has the place of one who converses.
    has_place: bool,
    pending: Pending,
    flood: Flood,
    tick: Interval,
    opened: Instant,
    /// Time at which something left last, or nothing waited.
    progress: Instant,
    written: Instant,
}

impl<'a, D: Duplex> Talk<'a, D> {
    pub(super) fn new(
        io: &'a D,
        session: &'a mut Session,
        running: &'a mut Running,
        place: &'a Place,
    ) -> Talk<'a, D> {
        let (hub, client) = (session.hub().clone(), session.client().clone());
        let limits = *hub.limits();
        let opened = Instant::now();
        let mut tick = interval(limits.tick());
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        Talk {
            io,
            has_place: session.is_authorised(),
            session,
            running,
            place,
            hub,
            client,
            limits,
            phase: Phase::Talking,
            input: Input::Open,
            pending: Pending::default(),
            flood: Flood::default(),
            tick,
            opened,
            progress: opened,
            written: opened,
        }
    }

    fn is_closing(&self) -> bool {
        matches!(self.phase, Phase::Closing(_))
    }

    /// Whether something of it is still to be read.
    fn is_reading(&self) -> bool {
        self.input == Input::Open
            && match self.phase {
                Phase::Talking => true,
                Phase::LastRead { left } => left > 0,
                Phase::Closing(_) => false,
            }
    }

    /// Draws the consequences of where it stands, writes what there is, then waits for whatever comes next.
    pub(super) async fn round(&mut self) -> ControlFlow<Reason> {
        self.end_with_session().await?;
        self.take_place();
        let is_held = self.session.is_held();
        self.end_input(is_held);
        let output = self.write()?;
        let has_read = matches!(self.phase, Phase::LastRead { .. }) && !self.is_reading();
        if self.is_closing() || (has_read && !is_held) {
            self.running.has_read();
        }
        let outbox = &self.client.outbox;
        match self.phase {
            Phase::Closing(reason) if output == Output::Empty && !outbox.owes_answer() => {
                linger(self.io).await;
                return ControlFlow::Break(reason);
            }
            Phase::Talking | Phase::LastRead { .. } if outbox.full().is_some() => {
                return ControlFlow::Break(Some("it does not read the replies to what it sends"));
            }
            _ => {}
        }
        if output != Output::Blocked {
            // Nothing waits: the clock of progress stands still.
            self.progress = Instant::now();
        }
        self.wait(output, is_held).await
    }

    /// Closes when the session is over, after its last words.
    async fn end_with_session(&mut self) -> ControlFlow<Reason> {
        let Some(end) = self.session.end().filter(|_| !self.is_closing()) else {
            return ControlFlow::Continue(());
        };
        self.phase = Phase::Closing(Some(end.reason()));
        end.warn_of(&self.client.peer.name);
        if let Some((delay, words)) = self.session.last_words() {
            tokio::select! {
                () = sleep(delay) => {}
                () = self.place.lost() => return ControlFlow::Break(Some(MADE_ROOM)),
                () = self.running.asked() => {}
            }
            self.client.outbox.reply(words);
        }
        ControlFlow::Continue(())
    }

    /// Takes the place of one who converses, once it has shown the token.
    fn take_place(&mut self) {
        if self.has_place || self.is_closing() || !self.session.is_authorised() {
            return;
        }
        self.has_place = true;
        if let Err(fault) = self.place.become_of(Kind::Served, true) {
            self.hub.turned_away(&fault);
            self.close(&fault, "there is no place for it");
        }
    }

    /// Tells it why, and closes.
    fn close(&mut self, fault: &Fault, reason: &'static str) {
        self.client.complain(fault, (0, &[]), 0);
        self.phase = Phase::Closing(Some(reason));
    }

    /// Draws the consequences of its having ended its side.
    fn end_input(&mut self, is_held: bool) {
        if self.input == Input::Open || is_held {
            return;
        }
        if self.input == Input::Ended {
            self.input = Input::GivenBack;
            let noticed = link::VANISHED.saturating_sub(self.limits.ping);
            self.io.expect_notice(noticed);
            self.session.give_back();
            self.place.only_watches();
        }
        // Whoever sent a request and nothing more still wants the answers.
        if !self.is_closing() && !self.client.outbox.level().watching {
            self.phase = Phase::Closing(None);
        }
    }

    /// Writes what there is without asking: there nearly always is room.
    fn write(&mut self) -> ControlFlow<Reason, Output> {
        let mut turns = 0;
        while self.pending.fill(&self.client.outbox) {
            // A client that takes as fast as is made must not keep this task from all else.
            if turns == TURNS {
                return ControlFlow::Continue(Output::Hurry);
            }
            turns += 1;
            match self.pending.write(self.io) {
                Ok(n) => {
                    count(&self.hub.counters.bytes_out, n);
                    self.written = Instant::now();
                    self.progress = self.written;
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    return ControlFlow::Continue(Output::Blocked);
                }
                Err(_) => {
                    return ControlFlow::Break(match self.phase {
                        Phase::Closing(reason) => reason,
                        Phase::Talking | Phase::LastRead { .. } => None,
                    });
                }
            }
        }
        ControlFlow::Continue(Output::Empty)
    }

    /// Waits for whatever comes first, and does it.
    async fn wait(&mut self, output: Output, is_held: bool) -> ControlFlow<Reason> {
        let is_reading = self.is_reading() && !is_held;
        let is_last = matches!(self.phase, Phase::LastRead { .. });
        let is_closing = self.is_closing();
        let must_wait = self.flood.must_wait();
        let goes_on = is_held && !is_closing && self.session.may_go_on();
        tokio::select! {
            () = self.flood.wait(&self.hub), if must_wait && !is_held => {}
            () = ready(()), if goes_on => {
                yield_now().await;
                let _turn = self.hub.turn(self.session.is_asking()).await;
                with_read_buffer(|_, scratch| self.session.go_on(scratch));
            }
            readable = self.io.readable(), if is_reading && !is_last && !must_wait => {
                return self.read(readable).await;
            }
            // What has arrived is still taken, also what the kernel has and the reactor has not yet told
            // of.
            () = ready(()), if is_reading && is_last => {
                yield_now().await;
                self.read_last().await;
            }
            ready = self.io.writable(), if output == Output::Blocked => {
                if ready.is_err() {
                    return ControlFlow::Break(None);
                }
            }
            () = self.client.outbox.filled(), if output == Output::Empty => {}
            () = yield_now(), if output == Output::Hurry => {}
            () = self.place.lost() => {
                self.client.complain(&self.place.made_room(), (0, &[]), 0);
                if self.pending.fill(&self.client.outbox) {
                    // What has no room now comes too late.
                    let _ = self.pending.write(self.io);
                }
                return ControlFlow::Break(Some(MADE_ROOM));
            }
            _ = self.tick.tick() => return self.look(output),
            () = self.running.asked_further(is_last), if !is_closing => {
                if is_last {
                    self.phase = Phase::Closing(None);
                } else {
                    let _ = timeout(SETTLE, self.io.readable()).await;
                    self.phase = Phase::LastRead { left: LAST_READ };
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Reads what there is.
    async fn read(&mut self, readable: io::Result<()>) -> ControlFlow<Reason> {
        let _turn = self.hub.turn(self.session.is_asking()).await;
        let read = readable.and_then(|()| {
            with_read_buffer(|buffer, scratch| {
                let most = self.flood.most(buffer.len());
                let n = self
                    .io
                    .try_read(buffer.get_mut(..most).unwrap_or_default())?;
                self.flood.read(n, most);
                let bytes = buffer.get(..n).unwrap_or_default();
                self.session.bytes(bytes, now(), scratch);
                Ok(n)
            })
        });
        match read {
            Ok(0) => {
                self.input = Input::Ended;
                with_read_buffer(|_, scratch| self.session.finish(now(), scratch));
            }
            Ok(_) => self.place.heard(),
            Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
            Err(_) => return ControlFlow::Break(None),
        }
        ControlFlow::Continue(())
    }

    /// Reads what has arrived before the end of the daemon.
    async fn read_last(&mut self) {
        let Phase::LastRead { left } = self.phase else {
            return;
        };
        let _turn = self.hub.turn(self.session.is_asking()).await;
        let read = with_read_buffer(|buffer, scratch| {
            let n = self.io.try_read(buffer)?;
            let bytes = buffer.get(..n).unwrap_or_default();
            self.session.bytes(bytes, now(), scratch);
            io::Result::Ok(n)
        });
        if let Ok(0) = read {
            with_read_buffer(|_, scratch| self.session.finish(now(), scratch));
        }
        let left = match read {
            Ok(n) if n > 0 => left.saturating_sub(n),
            _ => 0,
        };
        self.phase = Phase::LastRead { left };
    }

    /// Looks now and then whether it is still there, and does something.
    fn look(&mut self, output: Output) -> ControlFlow<Reason> {
        let has_ended = self.input != Input::Open;
        let is_blocked = output == Output::Blocked;
        if has_ended && self.io.is_closed() {
            return ControlFlow::Break(None);
        }
        let is_silent = !is_blocked && self.written.elapsed() >= self.limits.ping;
        if has_ended && !D::SHOWS_CLOSE && is_silent {
            self.client.outbox.reply(wire::heartbeat(self.limits.ping));
        }
        if is_blocked && self.progress.elapsed() >= self.limits.no_progress {
            return ControlFlow::Break(Some("it took nothing for too long"));
        }
        let is_late = self.opened.elapsed() >= self.limits.first_line;
        if self.is_reading() && !self.session.has_spoken() && is_late {
            let fault = Fault::new(
                "first_line_timeout",
                "no line came in time; the connection is closed",
            );
            self.close(&fault, "no first line");
        }
        ControlFlow::Continue(())
    }
}
