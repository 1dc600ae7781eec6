//! Bytes and messages to and from a remote end, over any transport. I/O.

use super::remote::{Place, Remote};
use futures_util::{SinkExt, StreamExt};
use std::io;
use std::time::Duration;
use strapd_recording::text::printable;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpStream, UdpSocket};
use tokio::time::{Instant, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{self, Message};

/// Time by which a connection must stand, name look-up and handshake included.
pub const CONNECT: Duration = Duration::from_secs(10);
/// Time by which a line must have been taken.
const SEND: Duration = Duration::from_secs(10);
/// Time between two pings over a WebSocket.
const PING: Duration = Duration::from_secs(15);
/// A WebSocket that says nothing for so long, not even in answer to two pings, has gone.
const SILENCE: Duration = Duration::from_secs(35);
/// Bytes read at once.
const READ: usize = 16 << 10;
/// Longest datagram there is.
const MAX_DATAGRAM: usize = 65_536;

/// A peer that has vanished is noticed after 15 + 3 * 5 s.
const IDLE: Duration = Duration::from_secs(15);
const PROBE: Duration = Duration::from_secs(5);
const PROBES: u32 = 3;
/// The time after which a peer that has vanished is noticed.
pub(crate) const VANISHED: Duration =
    Duration::from_secs(IDLE.as_secs() + PROBE.as_secs() * PROBES as u64);

/// A connection.
#[derive(Debug)]
pub struct Link {
    wire: Wire,
    /// Peer at the other end.
    peer: String,
}

#[derive(Debug)]
enum Wire {
    Tcp(TcpStream),
    #[cfg(unix)]
    Unix(tokio::net::UnixStream),
    WebSocket(Box<Web>),
    Udp(UdpSocket),
    Serial(serial2_tokio::SerialPort),
}

#[derive(Debug)]
struct Web {
    stream: WebSocketStream<TcpStream>,
    heard: Instant,
    pinged: Instant,
}

/// Outcome of a read into the buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Bytes of a stream: a line may end anywhere.
    Bytes,
    /// A message or datagram: its end ends its last line.
    Message,
    /// The other end has closed; its words, if it had any.
    Closed(Option<String>),
}

impl Link {
    /// Connects, for no longer than [`CONNECT`]. `token` goes with a WebSocket's request; over lines
    /// it is the caller's first line. Messages of more than `max_message` bytes end a WebSocket.
    ///
    /// # Errors
    /// In words: the name is unknown, nobody listens, nobody answers, no WebSocket.
    pub async fn connect(
        remote: &Remote,
        token: Option<&str>,
        max_message: usize,
    ) -> Result<Link, String> {
        match timeout(CONNECT, open(remote, token, max_message)).await {
            Ok(opened) => opened,
            Err(_) => Err(format!("no answer within {} s", CONNECT.as_secs())),
        }
    }

    /// Peer at the other end, by number.
    #[must_use]
    pub fn peer(&self) -> &str {
        &self.peer
    }

    /// Whether lines can be sent.
    #[must_use]
    pub fn is_two_way(&self) -> bool {
        !matches!(self.wire, Wire::Udp(_))
    }

    /// Waits for the next bytes, which replace those in `buffer`. May be dropped and called again:
    /// nothing is lost.
    ///
    /// # Errors
    /// The connection broke.
    pub async fn read(&mut self, buffer: &mut Vec<u8>) -> io::Result<Heard> {
        buffer.clear();
        match &mut self.wire {
            Wire::Tcp(stream) => stream_of_bytes(stream, buffer).await,
            #[cfg(unix)]
            Wire::Unix(stream) => stream_of_bytes(stream, buffer).await,
            Wire::Udp(socket) => {
                buffer.reserve(MAX_DATAGRAM);
                socket.recv_buf(buffer).await?;
                Ok(Heard::Message)
            }
            Wire::WebSocket(web) => web.read(buffer).await,
            Wire::Serial(port) => stream_of_bytes(port, buffer).await,
        }
    }

    /// Sends lines, given without the end of the last.
    ///
    /// # Errors
    /// The connection broke, or nothing was taken for 10 s.
    pub async fn send(&mut self, line: &str) -> io::Result<()> {
        let sending = async {
            match &mut self.wire {
                Wire::Tcp(stream) => stream.write_all(format!("{line}\n").as_bytes()).await,
                #[cfg(unix)]
                Wire::Unix(stream) => stream.write_all(format!("{line}\n").as_bytes()).await,
                Wire::WebSocket(web) => web.stream.send(Message::text(line)).await.map_err(broken),
                Wire::Udp(_) => Err(io::ErrorKind::Unsupported.into()),
                Wire::Serial(port) => port.write_all(format!("{line}\n").as_bytes()).await,
            }
        };
        timeout(SEND, sending)
            .await
            .unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()))
    }

    /// Says that nothing more will be sent; what the other end says can still be read.
    ///
    /// # Errors
    /// The connection broke.
    pub async fn end(&mut self) -> io::Result<()> {
        match &mut self.wire {
            Wire::Tcp(stream) => stream.shutdown().await,
            #[cfg(unix)]
            Wire::Unix(stream) => stream.shutdown().await,
            Wire::WebSocket(web) => web.stream.send(Message::Close(None)).await.map_err(broken),
            // A port has one end for both ways.
            Wire::Udp(_) | Wire::Serial(_) => Ok(()),
        }
    }
}

async fn open(remote: &Remote, token: Option<&str>, max_message: usize) -> Result<Link, String> {
    let (wire, peer) = match remote {
        Remote::Tcp(place) => {
            let stream = dial(place).await?;
            let peer = address(&stream);
            (Wire::Tcp(stream), format!("tcp://{peer}"))
        }
        Remote::WebSocket { place, resource } => {
            let stream = dial(place).await?;
            let peer = address(&stream);
            let web = upgrade(stream, place, resource.typed(), token, max_message).await?;
            (Wire::WebSocket(Box::new(web)), format!("ws://{peer}"))
        }
        #[cfg(unix)]
        Remote::Unix(path) => {
            let stream = tokio::net::UnixStream::connect(path)
                .await
                .map_err(|e| e.to_string())?;
            (Wire::Unix(stream), format!("unix://{}", path.display()))
        }
        #[cfg(not(unix))]
        Remote::Unix(_) => return Err("there are no Unix sockets here".to_owned()),
        Remote::UdpListen(place) => {
            let socket = UdpSocket::bind((place.host.as_str(), place.port))
                .await
                .map_err(|e| e.to_string())?;
            let bound = socket.local_addr().map_err(|e| e.to_string())?;
            (Wire::Udp(socket), format!("udp-listen://{bound}"))
        }
        Remote::Serial(place) => (Wire::Serial(place.open()?), place.to_string()),
    };
    Ok(Link { wire, peer })
}

async fn dial(place: &Place) -> Result<TcpStream, String> {
    let stream = TcpStream::connect((place.host.as_str(), place.port))
        .await
        .map_err(|e| e.to_string())?;
    prepare(&stream);
    Ok(stream)
}

/// Small messages leave at once, and silence is probed. Neither can be refused with more than a
/// loss of comfort.
pub(crate) fn prepare(stream: &TcpStream) {
    let _ = stream.set_nodelay(true);
    let keepalive = socket2::TcpKeepalive::new().with_time(IDLE);
    #[cfg(unix)]
    let keepalive = keepalive.with_interval(PROBE).with_retries(PROBES);
    let _ = socket2::SockRef::from(stream).set_tcp_keepalive(&keepalive);
}

fn address(stream: &TcpStream) -> String {
    stream
        .peer_addr()
        .map_or_else(|_| "?".to_owned(), |a| a.to_string())
}

async fn upgrade(
    stream: TcpStream,
    place: &Place,
    path: &str,
    token: Option<&str>,
    max_message: usize,
) -> Result<Web, String> {
    let mut request = format!("ws://{place}{path}")
        .into_client_request()
        .map_err(|e| e.to_string())?;
    if let Some(token) = token {
        let mut value = HeaderValue::try_from(format!("Bearer {token}"))
            .map_err(|_| "the token holds what no HTTP header can".to_owned())?;
        value.set_sensitive(true);
        request.headers_mut().insert("authorization", value);
    }
    let config = WebSocketConfig::default()
        .max_message_size(Some(max_message))
        .max_frame_size(Some(max_message));
    match tokio_tungstenite::client_async_with_config(request, stream, Some(config)).await {
        Ok((stream, _)) => Ok(Web {
            stream,
            heard: Instant::now(),
            pinged: Instant::now(),
        }),
        Err(tungstenite::Error::Http(answer)) => {
            let words = answer.body().as_deref().unwrap_or_default();
            let words =
                String::from_utf8_lossy(words.get(..words.len().min(200)).unwrap_or_default());
            Err(format!(
                "answered {}, no WebSocket: {}",
                answer.status(),
                printable(words.trim())
            ))
        }
        Err(why) => Err(format!("no WebSocket: {}", printable(&why.to_string()))),
    }
}

async fn stream_of_bytes(
    stream: &mut (impl AsyncReadExt + Unpin),
    buffer: &mut Vec<u8>,
) -> io::Result<Heard> {
    buffer.reserve(READ);
    match stream.read_buf(buffer).await? {
        0 => Ok(Heard::Closed(None)),
        _ => Ok(Heard::Bytes),
    }
}

impl Web {
    async fn read(&mut self, buffer: &mut Vec<u8>) -> io::Result<Heard> {
        loop {
            let now = Instant::now();
            if now >= self.heard + SILENCE {
                return Err(io::Error::new(
                    io::ErrorKind::TimedOut,
                    "nothing was heard for 35 s, not even an answer to a ping",
                ));
            }
            let until = (self.pinged + PING).min(self.heard + SILENCE);
            let message = match tokio::time::timeout_at(until, self.stream.next()).await {
                Ok(message) => message,
                Err(_) => {
                    if Instant::now() >= self.pinged + PING {
                        self.pinged = Instant::now();
                        let ping = self.stream.send(Message::Ping(bytes::Bytes::new()));
                        timeout(SEND, ping)
                            .await
                            .unwrap_or(Err(tungstenite::Error::ConnectionClosed))
                            .map_err(broken)?;
                    }
                    continue;
                }
            };
            self.heard = Instant::now();
            match message {
                None => return Ok(Heard::Closed(None)),
                Some(Ok(Message::Text(text))) => buffer.extend_from_slice(text.as_bytes()),
                Some(Ok(Message::Binary(bytes))) => buffer.extend_from_slice(&bytes),
                Some(Ok(Message::Close(words))) => {
                    return Ok(Heard::Closed(words.map(|w| {
                        printable(&format!("{} {}", u16::from(w.code), w.reason))
                    })));
                }
                Some(Ok(_)) => continue,
                Some(Err(
                    tungstenite::Error::ConnectionClosed | tungstenite::Error::AlreadyClosed,
                )) => return Ok(Heard::Closed(None)),
                Some(Err(why)) => return Err(broken(why)),
            }
            return Ok(Heard::Message);
        }
    }
}

fn broken(why: tungstenite::Error) -> io::Error {
    match why {
        tungstenite::Error::Io(why) => why,
        other => io::Error::other(printable(&other.to_string())),
    }
}
