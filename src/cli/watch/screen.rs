//! Lines -> the terminal, and its restoration. I/O.

use super::board::Board;
use super::view::{self, Line, Tone};
use crate::error::{Error, Result};
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::style::{Attribute, Color, Print, ResetColor, SetAttribute, SetForegroundColor};
use crossterm::terminal::{self, Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen};
use crossterm::{cursor, execute, queue};
use std::io::{self, BufWriter, Stdout, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tokio::sync::mpsc;

/// Whether the terminal is ours now, and must be given back.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Key that the user pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    Leave,
    Up,
    Down,
    PageUp,
    PageDown,
    /// The size has changed.
    Resized,
}

/// The whole terminal; given back when dropped.
#[derive(Debug)]
pub(super) struct Screen {
    out: BufWriter<Stdout>,
    colour: bool,
    /// The first line shown of what lies between head and foot.
    top: usize,
    page: usize,
}

impl Screen {
    /// Takes the terminal, and reads its keys on a thread of its own.
    pub(super) fn open(colour: bool) -> Result<(Screen, mpsc::Receiver<Key>)> {
        let failed = |e| Error::writing("the terminal", e);
        terminal::enable_raw_mode().map_err(failed)?;
        TAKEN.store(true, Ordering::SeqCst);
        // A panic says what it has to say on a terminal that shows it.
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |why| {
            give_back();
            before(why);
        }));
        let screen = Screen {
            out: BufWriter::with_capacity(1 << 16, io::stdout()),
            colour,
            top: 0,
            page: 1,
        };
        execute!(io::stdout(), EnterAlternateScreen, cursor::Hide).map_err(failed)?;
        let (tell, keys) = mpsc::channel(16);
        std::thread::spawn(move || {
            while let Ok(event) = event::read() {
                if let Some(key) = key(&event)
                    && tell.blocking_send(key).is_err()
                {
                    return;
                }
            }
        });
        Ok((screen, keys))
    }

    /// Scrolls.
    pub(super) fn turn(&mut self, key: Key) {
        self.top = match key {
            Key::Up => self.top.saturating_sub(1),
            Key::Down => self.top + 1,
            Key::PageUp => self.top.saturating_sub(self.page),
            Key::PageDown => self.top + self.page,
            Key::Leave | Key::Resized => self.top,
        };
    }

    /// Shows what is known now.
    pub(super) fn show(&mut self, board: &Board, now: Instant) -> Result<()> {
        let (width, height) = terminal::size().unwrap_or((80, 24));
        let (width, height) = (usize::from(width), usize::from(height));
        let body = view::body(board, now, width);
        self.page = height.saturating_sub(2).max(1);
        self.top = self.top.min(body.len().saturating_sub(self.page));
        let mut lines = vec![view::heading(board, now)];
        lines.extend(body.into_iter().skip(self.top).take(self.page));
        lines.resize(height.saturating_sub(1), (Tone::Plain, String::new()));
        lines.push(view::footing(board));
        self.draw(&lines, width, height)
            .map_err(|e| Error::writing("the terminal", e))
    }

    fn draw(&mut self, lines: &[Line], width: usize, height: usize) -> io::Result<()> {
        for (row, (tone, text)) in (0_u16..).zip(lines.iter().take(height)) {
            // One column is left: some terminals break the line behind the last.
            let text: String = text.chars().take(width.saturating_sub(1)).collect();
            queue!(self.out, cursor::MoveTo(0, row))?;
            match tone {
                Tone::Plain | Tone::Axes(_) => {}
                Tone::Heading => queue!(self.out, SetAttribute(Attribute::Bold))?,
                Tone::Alarm if self.colour => queue!(
                    self.out,
                    SetAttribute(Attribute::Bold),
                    SetForegroundColor(Color::Red)
                )?,
                // No colour of an axis.
                Tone::Silent if self.colour => {
                    queue!(self.out, SetForegroundColor(Color::Yellow))?;
                }
                Tone::Alarm | Tone::Silent => {
                    queue!(self.out, SetAttribute(Attribute::Reverse))?;
                }
            }
            match tone {
                Tone::Axes(places) if self.colour => self.figures(&text, *places)?,
                _ => queue!(self.out, Print(text))?,
            }
            if *tone != Tone::Plain {
                queue!(self.out, SetAttribute(Attribute::Reset))?;
                if self.colour {
                    queue!(self.out, ResetColor)?;
                }
            }
            queue!(self.out, Clear(ClearType::UntilNewLine))?;
        }
        self.out.flush()
    }

    /// x red, y green, z blue, as on the page.
    fn figures(&mut self, text: &str, [x, y, z, end]: [usize; 4]) -> io::Result<()> {
        let part =
            |from: usize, until: usize| -> String { text.chars().take(until).skip(from).collect() };
        queue!(self.out, Print(part(0, x)))?;
        for (from, until, colour) in [
            (x, y, Color::Red),
            (y, z, Color::Green),
            (z, end, Color::Blue),
        ] {
            queue!(
                self.out,
                SetForegroundColor(colour),
                Print(part(from, until))
            )?;
        }
        queue!(self.out, ResetColor, Print(part(end, usize::MAX)))
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // What was still to be shown is of no interest now.
        let _ = self.out.flush();
        give_back();
    }
}

/// Gives the terminal back as it was, once.
fn give_back() {
    if TAKEN.swap(false, Ordering::SeqCst) {
        // It may have gone: then there is nothing to restore.
        let _ = execute!(io::stdout(), LeaveAlternateScreen, cursor::Show);
        let _ = terminal::disable_raw_mode();
    }
}

fn key(event: &Event) -> Option<Key> {
    match event {
        Event::Resize(..) => Some(Key::Resized),
        Event::Key(KeyEvent {
            code,
            modifiers,
            kind: KeyEventKind::Press | KeyEventKind::Repeat,
            ..
        }) => match code {
            KeyCode::Char('c' | 'd') if modifiers.contains(KeyModifiers::CONTROL) => {
                Some(Key::Leave)
            }
            KeyCode::Char('q' | 'Q') => Some(Key::Leave),
            KeyCode::Up => Some(Key::Up),
            KeyCode::Down => Some(Key::Down),
            KeyCode::PageUp => Some(Key::PageUp),
            KeyCode::PageDown => Some(Key::PageDown),
            _ => None,
        },
        _ => None,
    }
}
