//! `strapd watch URL`: every sensor of a daemon, live in the terminal. I/O.
//!
//! | file | arrow | |
//! |---|---|---|
//! | `board` | what a daemon says -> what is known of every sensor | pure |
//! | `view`, `horizon` | what is known -> lines of text | pure |
//! | `screen` | lines -> the terminal, and its restoration | I/O |

mod board;
mod horizon;
mod screen;
mod view;

use super::{Global, Outcome, When, print};
use crate::client;
use crate::client::remote::Remote;
use crate::client::secret::Secret;
use crate::client::watcher::{Said, Watcher, request};
use crate::error::{Error, Result};
use crate::serve::guard::shutdown::Signals;
use board::Board;
use clap::Args;
use screen::{Key, Screen};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use strapd_recording::decode::packed::Form;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval, timeout};

/// Time between two pictures; a sensor is asked for no more attitudes than that.
const FRAME: Duration = Duration::from_millis(100);
/// Attitudes asked of each sensor, a second.
const RATE_HZ: f64 = 10.0;
/// Time between two questions for the daemon's state.
const POLL: Duration = Duration::from_secs(1);
/// Time between two lines of a sensor where there is no terminal.
const LINE: Duration = Duration::from_secs(1);
/// Time by which a daemon must have answered before another attempt.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between a loss and the next attempt.
const RETRY: Duration = Duration::from_millis(500);

/// Every sensor of a daemon, live in the terminal: attitude, horizon, rates, health.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd watch                                  the daemon of this machine
  strapd watch ws://robot:8765 --id imu0        one sensor of another
  strapd watch | tee attitude.log               a line a second for each sensor where there is no terminal

Keys: q or Ctrl-C leaves; up, down, page up, page down scroll.
Roll, pitch and yaw turn about z, then y, then x. When the daemon goes, it is waited for.")]
pub struct Watch {
    /// The daemon: tcp://HOST:PORT, ws://HOST:PORT, unix:///PATH; or udp-listen://HOST:PORT
    #[arg(value_name = "URL", default_value = "tcp://127.0.0.1:4550")]
    pub url: String,
    /// Only this sensor. May be given several times
    #[arg(long = "id", value_name = "NAME")]
    pub ids: Vec<String>,
    /// The token the daemon asks for is in this file (first line, mode 0600)
    #[arg(long, value_name = "FILE", env = "STRAPD_TOKEN_FILE")]
    pub token_file: Option<PathBuf>,
}

/// Runs it.
///
/// # Errors
/// The address is none, the terminal cannot be used, stdout cannot be written.
pub fn run(global: &Global, args: &Watch) -> Result<Outcome> {
    let remote = Remote::parse(&args.url)?;
    let token = args
        .token_file
        .as_deref()
        .map(|file| Secret::read("--token-file", file))
        .transpose()?;
    let watching = async {
        let mut signals = Signals::new().map_err(|e| Error::usage(format!("signals: {e}")))?;
        // Made inside, so that it is restored before anything is said.
        let mut out = if std::io::stdout().is_terminal() {
            let (screen, keys) = Screen::open(use_colour(global.color))?;
            Out::Screen(screen, keys)
        } else {
            Out::Lines(Instant::now())
        };
        let mut watching = Watching {
            board: Board::new(remote.to_string(), &args.ids),
            remote: &remote,
            token: token.as_ref(),
            request: request(&args.ids, Some(RATE_HZ), Form::Packed),
        };
        tokio::select! {
            ended = watching.on(&mut out) => ended,
            _ = signals.next() => Ok(()),
        }
    };
    client::run(&format!("watch {}", args.url), watching).map(|()| Outcome::Done)
}

fn use_colour(when: When) -> bool {
    match when {
        When::Always => true,
        When::Never => false,
        When::Auto => std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty()),
    }
}

/// Output on which it is shown.
enum Out {
    Screen(Screen, mpsc::Receiver<Key>),
    /// And when a line was written last.
    Lines(Instant),
}

struct Watching<'a> {
    board: Board,
    remote: &'a Remote,
    token: Option<&'a Secret>,
    request: String,
}

impl Watching<'_> {
    /// Runs until the user has enough.
    async fn on(&mut self, out: &mut Out) -> Result<()> {
        let mut frames = interval(FRAME);
        frames.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let (remote, token, request) = (self.remote, self.token, self.request.clone());
            let connecting = timeout(PATIENCE, Watcher::connect(remote, token, &request));
            tokio::pin!(connecting);
            let connected = loop {
                tokio::select! {
                    connected = &mut connecting => break connected,
                    _ = frames.tick() => out.show(&mut self.board)?,
                    key = out.key() => if !out.obey(key, &mut self.board)? { return Ok(()) },
                }
            };
            let why = match connected {
                Ok(Ok(watcher)) => match self.listen(watcher, out, &mut frames).await? {
                    None => return Ok(()),
                    Some(why) => why,
                },
                Ok(Err(why)) => why,
                Err(_) => format!("no answer within {} s", PATIENCE.as_secs()),
            };
            self.board.lost(why, Instant::now());
            out.show(&mut self.board)?;
            let again = tokio::time::sleep(RETRY);
            tokio::pin!(again);
            loop {
                tokio::select! {
                    () = &mut again => break,
                    _ = frames.tick() => out.show(&mut self.board)?,
                    key = out.key() => if !out.obey(key, &mut self.board)? { return Ok(()) },
                }
            }
        }
    }

    /// One connection. Returns why it was lost, `None` when the user has enough.
    async fn listen(
        &mut self,
        mut watcher: Watcher,
        out: &mut Out,
        frames: &mut tokio::time::Interval,
    ) -> Result<Option<String>> {
        self.board.connected(Instant::now());
        let mut polls = interval(POLL);
        polls.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let board = &mut self.board;
            let mut take = |said: Said<'_>| {
                board.take(said, Instant::now());
                true
            };
            tokio::select! {
                next = watcher.next(&mut take) => if let Err(why) = next {
                    return Ok(Some(why));
                },
                _ = frames.tick() => out.show(&mut self.board)?,
                _ = polls.tick() => if let Err(why) = watcher.poll().await {
                    return Ok(Some(why));
                },
                key = out.key() => if !out.obey(key, &mut self.board)? {
                    return Ok(None);
                },
            }
        }
    }
}

impl Out {
    /// Shows what is known now.
    fn show(&mut self, board: &mut Board) -> Result<()> {
        let now = Instant::now();
        match self {
            Out::Screen(screen, _) => screen.show(board, now),
            Out::Lines(last) => {
                if now.duration_since(*last) < LINE {
                    return Ok(());
                }
                *last = now;
                print(&view::plain(board, now))
            }
        }
    }

    /// The next key; never, where there is no terminal.
    async fn key(&mut self) -> Option<Key> {
        match self {
            Out::Screen(_, keys) => keys.recv().await,
            Out::Lines(_) => std::future::pending().await,
        }
    }

    /// Does what a key says; whether to go on.
    fn obey(&mut self, key: Option<Key>, board: &mut Board) -> Result<bool> {
        match (self, key) {
            (_, None | Some(Key::Leave)) => Ok(false),
            (Out::Screen(screen, _), Some(key)) => {
                screen.turn(key);
                screen.show(board, Instant::now())?;
                Ok(true)
            }
            (Out::Lines(_), Some(_)) => Ok(true),
        }
    }
}
