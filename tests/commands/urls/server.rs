//! A server on loopback that behaves as servers do.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Manner of a server.
#[derive(Clone, Debug)]
pub(super) enum Manner {
    /// Server that knows ranges.
    Good,
    /// Server that knows none.
    NoRanges,
    /// Server that knows none, and cuts the body.
    NoRangesCut,
    /// A kilobyte at a time.
    Slow,
    /// A body ends after so many bytes, whatever its length was said to be.
    Cut(usize),
    /// Every third request is refused for now.
    BusyEveryThird,
    /// Every one is; what it says when to come back.
    Busy(&'static str),
    /// Server that has another object from the so-manyth request on.
    ChangedAfter(usize),
    /// A body never ends.
    Endless,
    /// Server that states a length that is not that of the body.
    WrongLength,
    /// Server that sends everybody on to there.
    Elsewhere(String),
    /// Server that refuses.
    Refuse(u16),
    /// Server that takes requests and says nothing.
    Silent,
    /// Server that begins a body and goes on with a byte now and then.
    Dripping,
    /// Server that packs what it sends.
    Packed,
}

pub(super) struct Server {
    /// `127.0.0.1:PORT`.
    pub(super) place: String,
    shared: Arc<Shared>,
}

struct Shared {
    manner: Manner,
    object: Vec<u8>,
    /// Heads of requests.
    asked: Mutex<Vec<String>>,
    /// Bytes of bodies.
    sent: AtomicUsize,
}

impl Server {
    /// Has `object` under every name.
    pub(super) fn of(manner: Manner, object: Vec<u8>) -> Server {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let shared = Arc::new(Shared {
            manner,
            object,
            asked: Mutex::default(),
            sent: AtomicUsize::new(0),
        });
        let place = listener.local_addr().unwrap().to_string();
        let by = Arc::clone(&shared);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let by = Arc::clone(&by);
                // Who asked may go before the answer ends.
                std::thread::spawn(move || drop(by.answer(stream)));
            }
        });
        Server { place, shared }
    }

    pub(super) fn file(manner: Manner, path: &std::path::Path) -> Server {
        Server::of(manner, std::fs::read(path).unwrap())
    }

    pub(super) fn url(&self, name: &str) -> String {
        format!("http://{}/{name}", self.place)
    }

    pub(super) fn asked(&self) -> Vec<String> {
        self.shared.asked.lock().unwrap().clone()
    }

    pub(super) fn sent(&self) -> usize {
        self.shared.sent.load(Ordering::Relaxed)
    }
}

impl Shared {
    fn answer(&self, stream: TcpStream) -> std::io::Result<()> {
        let mut reader = BufReader::new(stream.try_clone()?);
        let mut head = String::new();
        while reader.read_line(&mut head)? > 2 {}
        let number = {
            let mut asked = self.asked.lock().unwrap();
            asked.push(head.clone());
            asked.len()
        };
        let mut to = stream;
        match &self.manner {
            Manner::Refuse(status) => return empty(&mut to, &status.to_string(), ""),
            Manner::Busy(wait) => return empty(&mut to, "503", wait),
            Manner::BusyEveryThird if number.is_multiple_of(3) => {
                return empty(&mut to, "503", "Retry-After: 0\r\n");
            }
            Manner::Elsewhere(place) => {
                return empty(&mut to, "302", &format!("Location: {place}\r\n"));
            }
            Manner::Silent => {
                // Until the other end has enough.
                let _ = to.read(&mut [0])?;
                return Ok(());
            }
            _ => {}
        }
        let size = self.object.len();
        let asked = asked_range(&head)
            .filter(|_| !matches!(self.manner, Manner::NoRanges | Manner::NoRangesCut));
        let Some(range) = asked else {
            let length = format!("Content-Length: {size}\r\n");
            let length = if head.starts_with("HEAD") {
                length + "ETag: \"1\"\r\n"
            } else {
                length
            };
            self.begin(&mut to, "200 OK", &length)?;
            if head.starts_with("HEAD") {
                return Ok(());
            }
            let end = if matches!(self.manner, Manner::NoRangesCut) {
                size / 2
            } else {
                size
            };
            return self.send(&mut to, 0..end);
        };
        if range.start >= size {
            return empty(
                &mut to,
                "416",
                &format!("Content-Range: bytes */{size}\r\n"),
            );
        }
        let range = range.start..range.end.min(size);
        let tag = match self.manner {
            Manner::ChangedAfter(n) if number > n => "2",
            _ => "1",
        };
        let length = match self.manner {
            Manner::Endless => 1 << 40,
            Manner::WrongLength => range.len() + 100,
            _ => range.len(),
        };
        let packed = match self.manner {
            Manner::Packed => "Content-Encoding: gzip\r\n",
            _ => "",
        };
        let said = format!(
            "Content-Range: bytes {}-{}/{size}\r\nContent-Length: {length}\r\nETag: \"{tag}\"\r\nLast-Modified: Tue, 24 Nov 2026 20:00:00 GMT\r\n{packed}",
            range.start,
            range.end - 1,
        );
        self.begin(&mut to, "206 Partial Content", &said)?;
        match self.manner {
            Manner::Cut(after) => {
                self.send(&mut to, range.start..range.end.min(range.start + after))
            }
            Manner::Endless => {
                self.send(&mut to, range)?;
                loop {
                    to.write_all(&[7; 1 << 14])?;
                }
            }
            Manner::Dripping => loop {
                to.write_all(&[7])?;
                std::thread::sleep(Duration::from_millis(50));
            },
            _ => self.send(&mut to, range),
        }
    }

    fn begin(&self, to: &mut TcpStream, status: &str, said: &str) -> std::io::Result<()> {
        write!(to, "HTTP/1.1 {status}\r\nConnection: close\r\n{said}\r\n")
    }

    fn send(&self, to: &mut TcpStream, range: Range<usize>) -> std::io::Result<()> {
        let (piece, pause) = match self.manner {
            Manner::Slow => (1 << 12, Duration::from_millis(2)),
            _ => (1 << 16, Duration::ZERO),
        };
        for bytes in self.object[range].chunks(piece) {
            // Before: who has them all may look at once.
            self.sent.fetch_add(bytes.len(), Ordering::Relaxed);
            to.write_all(bytes)?;
            std::thread::sleep(pause);
        }
        Ok(())
    }
}

fn empty(to: &mut TcpStream, status: &str, said: &str) -> std::io::Result<()> {
    write!(
        to,
        "HTTP/1.1 {status} \r\nConnection: close\r\nContent-Length: 0\r\n{said}\r\n"
    )
}

pub(super) fn asked_range(head: &str) -> Option<Range<usize>> {
    let line = head.lines().find_map(|line| {
        let (name, value) = line.split_once(':')?;
        name.eq_ignore_ascii_case("range").then(|| value.trim())
    })?;
    let (start, last) = line.strip_prefix("bytes=")?.split_once('-')?;
    Some(start.parse().ok()?..last.parse::<usize>().ok()? + 1)
}
