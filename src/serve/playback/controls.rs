//! Position of a replay, and who makes it stop, go on, or be elsewhere. Pure but for locks and the clock.
//!
//! One thread runs the replay and asks before it hands anything on ([`Playback::grant`]); clients ask
//! for changes from the tasks that serve them. A seek changes no bit of any attitude: forward, the run
//! integrates on without showing; backward, it is begun again and does not show until it is there.

use super::overview::Overview;
use crate::pipeline::pace::Pace;
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::position::{Action, Mode, Part, Position, Timeline};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use strapd_attitude::record::Nanos;

/// Time between two notices of where it is.
const TICK: Duration = Duration::from_millis(500);

/// Fastest and slowest a client may ask for.
const SPEEDS: std::ops::RangeInclusive<f64> = 1e-3..=1e4;

/// Permission to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grant {
    /// Number of items to everybody.
    Show(usize),
    /// Number of items to nobody who watches: a seek is under way.
    Mute(usize),
    /// Nothing more in this run.
    End,
}

/// Notice for watchers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Nothing.
    Nothing,
    /// Progress.
    Tick,
    /// Change of state.
    Changed,
    /// Beginning: the first stamp is known.
    Begun,
}

/// A replay that is served.
#[derive(Debug)]
pub struct Playback {
    state: Mutex<State>,
    changed: Condvar,
    file: String,
    overview: OnceLock<Arc<Overview>>,
}

#[derive(Debug)]
struct State {
    /// `None`: as fast as possible, and not to be controlled.
    pace: Option<Pace>,
    speed: f64,
    mode: Mode,
    at: Option<Nanos>,
    start: Option<Nanos>,
    end: Option<Nanos>,
    /// Length from the start to the end, about.
    length: Option<Nanos>,
    /// Nothing before it is shown.
    until: Option<Nanos>,
    /// One item is shown although it is paused: where a seek has led.
    glimpse: bool,
    /// Whether this run is to end, for another to begin.
    restart: bool,
    /// Why it cannot go back, if it cannot.
    forward_only: Option<&'static str>,
    stopped: bool,
    run: u64,
    told: Option<Instant>,
}

impl Playback {
    /// Makes one of `file`; `speed` `None` = as fast as possible, and not to be controlled.
    #[must_use]
    pub fn new(file: &str, speed: Option<f64>, paused: bool) -> Playback {
        Playback {
            state: Mutex::new(State {
                pace: Pace::new(speed),
                speed: speed.unwrap_or_default(),
                mode: if paused && speed.is_some() {
                    Mode::Paused
                } else {
                    Mode::Playing
                },
                at: None,
                start: None,
                end: None,
                length: None,
                until: None,
                glimpse: false,
                restart: false,
                forward_only: None,
                stopped: false,
                run: 0,
                told: None,
            }),
            changed: Condvar::new(),
            file: file.to_owned(),
            overview: OnceLock::new(),
        }
    }

    /// Sets where curves of the whole are.
    pub fn set_overview(&self, overview: Arc<Overview>) {
        // There is one, for as long as the replay is served.
        let _ = self.overview.set(overview);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change of the state is whole before anything in it could panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether clients may control it.
    #[must_use]
    pub fn is_controlled(&self) -> bool {
        self.state().pace.is_some()
    }

    /// Forbids going back, for this reason (`None`: it can).
    pub fn forward_only(&self, why: Option<&'static str>) {
        self.state().forward_only = why;
    }

    /// Sets the approximate length of the data; what is known better stays.
    pub fn length(&self, secs: f64) {
        self.state().length = Some(Nanos((secs * 1e9) as i64));
    }

    /// Waits until items with these stamps are due, and says how many of them are.
    pub fn grant(&self, mut stamps: impl Iterator<Item = Nanos> + Clone) -> (Grant, Notice) {
        let mut state = self.state();
        let Some(first) = stamps.clone().next() else {
            return (Grant::Show(0), Notice::Nothing);
        };
        let mut notice = Notice::Nothing;
        if state.start.is_none() {
            state.start = Some(first);
            state.end = state.length.map(|l| Nanos(first.0.saturating_add(l.0)));
            notice = Notice::Begun;
        }
        loop {
            if state.stopped || state.restart {
                return (Grant::End, notice);
            }
            match state.until {
                Some(until) if first < until => {
                    return (
                        Grant::Mute(stamps.take_while(|stamp| *stamp < until).count()),
                        notice,
                    );
                }
                Some(_) => {
                    state.until = None;
                    state.at = Some(first);
                    state.glimpse = state.mode == Mode::Paused;
                    if let Some(pace) = &mut state.pace {
                        pace.restart();
                    }
                    notice = Notice::Changed;
                }
                None => {}
            }
            if state.mode != Mode::Playing && !std::mem::take(&mut state.glimpse) {
                if notice != Notice::Nothing {
                    // Said before it waits; the same items are asked for again.
                    return (Grant::Show(0), notice);
                }
                state = self
                    .changed
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            let paused = state.mode != Mode::Playing;
            let Some(pace) = &mut state.pace else {
                return (Grant::Show(stamps.count()), notice);
            };
            if paused {
                state.at = Some(first);
                return (Grant::Show(1), Notice::Changed);
            }
            let wait = pace.until(first, Instant::now());
            if wait > Duration::ZERO {
                (state, _) = self
                    .changed
                    .wait_timeout(state, wait)
                    .unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            let n = pace.take(stamps.clone());
            state.at = stamps.nth(n.saturating_sub(1)).or(Some(first));
            if notice == Notice::Nothing && state.told.is_none_or(|told| told.elapsed() >= TICK) {
                notice = Notice::Tick;
            }
            if notice != Notice::Nothing {
                state.told = Some(Instant::now());
            }
            return (Grant::Show(n), notice);
        }
    }

    /// Stops handing on.
    pub fn stop(&self) {
        self.state().stopped = true;
        self.changed.notify_all();
    }

    /// Whether it was stopped.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.state().stopped
    }

    /// Whether the run is to end for another to begin.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        let state = self.state();
        state.stopped || state.restart
    }

    /// The run has come to its end; what has been asked for meanwhile may make it begin anew.
    /// `true`: watchers should be told.
    pub fn ended(&self) -> bool {
        let mut state = self.state();
        if state.stopped || state.restart {
            return false;
        }
        // A seek may have led beyond the end.
        state.until = None;
        state.mode = Mode::Ended;
        if let Some(at) = state.at {
            state.end = Some(at);
        }
        true
    }

    /// The last stamp there was, shown or not.
    pub fn passed(&self, last: Nanos) {
        let mut state = self.state();
        if state.until.is_some() {
            state.at = Some(last);
        }
    }

    /// Waits until it is to begin anew, or stopped. `false`: stopped.
    #[must_use]
    pub fn wait_for_restart(&self) -> bool {
        let mut state = self.state();
        while !state.stopped && !state.restart {
            state = self
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        !state.stopped
    }

    /// Begins anew from the start.
    pub fn again(&self) {
        let mut state = self.state();
        state.restart = true;
        state.until = None;
        state.mode = Mode::Playing;
    }

    /// A new run begins, if one is to. `false`: the last one was the last.
    #[must_use]
    pub fn begin_anew(&self) -> bool {
        let mut state = self.state();
        if state.stopped || !state.restart {
            return false;
        }
        state.restart = false;
        state.at = None;
        state.run += 1;
        if let Some(pace) = &mut state.pace {
            pace.restart();
        }
        true
    }
}

impl Timeline for Playback {
    fn position(&self) -> Option<Position> {
        let state = self.state();
        state.pace.as_ref()?;
        Some(Position {
            mode: state.mode,
            at: state.until.or(state.at).or(state.start),
            start: state.start,
            end: state.end,
            speed: state.speed,
            file: self.file.clone(),
            run: state.run,
            has_overview: self.overview.get().is_some(),
        })
    }

    fn run(&self) -> u64 {
        self.state().run
    }

    fn overview(&self, part: &Part) -> Option<serde_json::Value> {
        Some(self.overview.get()?.answer(part))
    }

    fn ask(&self, action: Action, stale: &mut dyn FnMut()) -> Result<(), Fault> {
        let refuse = |what: &str| Err(Fault::new("bad_playback", what.to_owned()));
        let mut state = self.state();
        if state.pace.is_none() {
            return Err(Fault::new(
                "not_paced",
                "this run goes as fast as it can; --speed 1 makes it one that can be controlled",
            ));
        }
        let mut leaps = false;
        match action {
            Action::Pause if state.mode == Mode::Playing => state.mode = Mode::Paused,
            Action::Pause => {}
            Action::Play if state.mode == Mode::Ended => {
                state.rewind(None)?;
                leaps = true;
                state.mode = Mode::Playing;
            }
            Action::Play => {
                if state.mode == Mode::Paused
                    && let Some(pace) = &mut state.pace
                {
                    pace.restart();
                }
                state.mode = Mode::Playing;
            }
            Action::Speed(speed) => {
                if !SPEEDS.contains(&speed) {
                    return refuse("speed: a factor from 0.001 to 10000 is needed");
                }
                state.speed = speed;
                if let Some(pace) = &mut state.pace {
                    pace.set_speed(speed, Instant::now());
                }
            }
            Action::Seek(to) => {
                let Some(start) = state.start else {
                    return refuse("nothing has been read yet, so there is no place to go to");
                };
                state.seek(to.max(start))?;
                leaps = true;
            }
        }
        if leaps {
            stale();
        }
        drop(state);
        self.changed.notify_all();
        Ok(())
    }
}

impl State {
    /// Goes to `to`: on, unseen, where it lies ahead, else from the start again.
    fn seek(&mut self, to: Nanos) -> Result<(), Fault> {
        let is_ahead =
            self.mode != Mode::Ended && !self.restart && self.at.is_none_or(|at| to > at);
        if is_ahead {
            self.until = Some(to);
        } else {
            self.rewind(Some(to))?;
        }
        if self.mode == Mode::Ended {
            self.mode = Mode::Paused;
        }
        Ok(())
    }

    /// Runs again from the start, unseen up to `to`.
    fn rewind(&mut self, to: Option<Nanos>) -> Result<(), Fault> {
        if let Some(why) = self.forward_only {
            return Err(Fault::new("forward_only", why));
        }
        self.restart = true;
        self.until = to;
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
