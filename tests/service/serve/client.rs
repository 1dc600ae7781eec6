//! Clients that read with patience and no more.

use super::daemon::PATIENCE;
use serde_json::Value;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::os::unix::net::UnixStream;
use std::path::Path;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// Somebody at the other end of a socket.
pub(crate) struct Client {
    link: Link,
    /// Packed objects of a message of which the first was handed over.
    objects: VecDeque<Vec<u8>>,
}

/// Item that a client is told.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Item {
    Line(String),
    Packed(Vec<u8>),
}

enum Link {
    Tcp(BufReader<TcpStream>),
    Unix(BufReader<UnixStream>),
    Web(Box<WebSocket<MaybeTlsStream<TcpStream>>>),
    Udp(UdpSocket),
}

impl Client {
    pub(crate) fn tcp(address: SocketAddr) -> Client {
        Client::over(TcpStream::connect(address).unwrap())
    }

    /// Connects from another address of this machine: another peer.
    pub(crate) fn from_another(address: SocketAddr) -> Client {
        use socket2::{Domain, Socket, Type};
        let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
        socket
            .bind(&SocketAddr::from(([127, 0, 0, 2], 0)).into())
            .unwrap();
        socket.connect(&address.into()).unwrap();
        Client::over(socket.into())
    }

    fn over(stream: TcpStream) -> Client {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.set_nodelay(true).unwrap();
        Client {
            link: Link::Tcp(BufReader::new(stream)),
            objects: VecDeque::new(),
        }
    }

    pub(crate) fn unix(path: &Path) -> Client {
        let stream = UnixStream::connect(path).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Client {
            link: Link::Unix(BufReader::new(stream)),
            objects: VecDeque::new(),
        }
    }

    pub(crate) fn web(address: SocketAddr) -> Client {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) =
            tungstenite::client(format!("ws://{address}/ws"), MaybeTlsStream::Plain(stream))
                .unwrap();
        Client {
            link: Link::Web(Box::new(socket)),
            objects: VecDeque::new(),
        }
    }

    /// Sends only.
    pub(crate) fn udp(address: SocketAddr) -> Client {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(address).unwrap();
        Client {
            link: Link::Udp(socket),
            objects: VecDeque::new(),
        }
    }

    /// Greeted, watching what `request` says.
    pub(crate) fn watching(mut self, request: &str) -> Client {
        self.send(request);
        let answer = self.next_of("WATCH");
        assert_eq!(answer["enable"], true, "{answer}");
        self
    }

    pub(crate) fn send(&mut self, text: &str) {
        self.send_bytes(format!("{text}\n").as_bytes());
    }

    pub(crate) fn send_bytes(&mut self, bytes: &[u8]) {
        match &mut self.link {
            Link::Tcp(s) => s.get_mut().write_all(bytes).unwrap(),
            Link::Unix(s) => s.get_mut().write_all(bytes).unwrap(),
            Link::Web(s) => s
                .send(Message::text(String::from_utf8_lossy(bytes).into_owned()))
                .unwrap(),
            Link::Udp(s) => assert_eq!(s.send(bytes).unwrap(), bytes.len()),
        }
    }

    /// Sends packed objects, and lines if need be: where there are messages, as a binary one.
    pub(crate) fn send_packed(&mut self, bytes: &[u8]) {
        match &mut self.link {
            Link::Web(s) => s.send(Message::binary(bytes.to_vec())).unwrap(),
            _ => self.send_bytes(bytes),
        }
    }

    /// The next line or packed object; `None` when the daemon has closed.
    pub(crate) fn item(&mut self) -> Option<Item> {
        match &mut self.link {
            Link::Tcp(s) => item(s),
            Link::Unix(s) => item(s),
            Link::Web(s) => loop {
                if let Some(object) = self.objects.pop_front() {
                    return Some(Item::Packed(object));
                }
                match s.read() {
                    Ok(Message::Text(text)) => return Some(Item::Line(text.as_str().to_owned())),
                    Ok(Message::Binary(bytes)) => {
                        let mut bytes = &bytes[..];
                        while let Some(Item::Packed(object)) = item(&mut bytes) {
                            self.objects.push_back(object);
                        }
                        assert!(
                            bytes.is_empty(),
                            "a message of packed objects holds nothing else"
                        );
                    }
                    Ok(Message::Close(_)) => return None,
                    Ok(_) => {}
                    Err(tungstenite::Error::Io(e))
                        if e.kind() == std::io::ErrorKind::Interrupted => {}
                    Err(e) => {
                        assert!(!is_late(&e), "nothing came");
                        return None;
                    }
                }
            },
            Link::Udp(_) => unreachable!("nobody answers datagrams"),
        }
    }

    /// The next packed object; there must be no line before it.
    pub(crate) fn packed(&mut self) -> Vec<u8> {
        match self.item() {
            Some(Item::Packed(object)) => object,
            other => unreachable!("{other:?}"),
        }
    }

    /// Sends unless the daemon has closed.
    pub(crate) fn try_send(&mut self, bytes: &[u8]) -> bool {
        match &mut self.link {
            Link::Tcp(s) => s.get_mut().write_all(bytes).is_ok(),
            _ => unreachable!("asked of TCP only"),
        }
    }

    /// The next line, without its end; `None` when the daemon has closed.
    pub(crate) fn line(&mut self) -> Option<String> {
        match self.item()? {
            Item::Line(line) => Some(line),
            Item::Packed(object) => unreachable!("no line: {object:?}"),
        }
    }

    /// The next object of a class; others are passed over.
    pub(crate) fn next_of(&mut self, class: &str) -> Value {
        loop {
            let line = self
                .line()
                .unwrap_or_else(|| unreachable!("closed before {class}"));
            let value: Value = serde_json::from_str(&line).unwrap();
            if value["class"] == class {
                return value;
            }
        }
    }

    /// The next line, which must be of this class.
    pub(crate) fn object(&mut self, class: &str) -> Value {
        let line = self
            .line()
            .unwrap_or_else(|| unreachable!("closed before {class}"));
        let value: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(value["class"], class, "{line}");
        value
    }

    /// Everything up to the close.
    pub(crate) fn rest(&mut self) -> Vec<Value> {
        std::iter::from_fn(|| self.line())
            .map(|line| serde_json::from_str(&line).unwrap())
            .collect()
    }

    /// Says that nothing more will be sent.
    pub(crate) fn shut(&mut self) {
        match &mut self.link {
            Link::Tcp(s) => s.get_mut().shutdown(std::net::Shutdown::Write).unwrap(),
            Link::Unix(s) => s.get_mut().shutdown(std::net::Shutdown::Write).unwrap(),
            Link::Web(s) => s.close(None).unwrap(),
            Link::Udp(_) => {}
        }
    }
}

/// A line, or what begins with the mark and is as long as it says.
fn item(from: &mut impl BufRead) -> Option<Item> {
    // A read that has a timeout is ended by any signal, and of the readers here this one alone does not go on.
    while matches!(from.fill_buf(), Err(e) if e.kind() == std::io::ErrorKind::Interrupted) {}
    let first = *there(from.fill_buf())?.first()?;
    if first == 0xf8 {
        let mut object = vec![0; 4];
        there(from.read_exact(&mut object))?;
        object.resize(usize::from(u16::from_le_bytes([object[2], object[3]])), 0);
        there(from.read_exact(&mut object[4..]))?;
        return Some(Item::Packed(object));
    }
    let mut line = String::new();
    there(from.read_line(&mut line))?;
    Some(Item::Line(line.trim_end_matches('\n').to_owned()))
}

/// Bytes that were read; `None` when the daemon has closed without a word.
fn there<T>(read: std::io::Result<T>) -> Option<T> {
    match read {
        Ok(read) => Some(read),
        Err(e) if e.kind() == std::io::ErrorKind::ConnectionReset => None,
        Err(e) => unreachable!("nothing came: {e}"),
    }
}

fn is_late(error: &tungstenite::Error) -> bool {
    matches!(error, tungstenite::Error::Io(e) if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut))
}

/// A sample line: sensor, number, milliseconds, rate about x.
pub(crate) fn rate(id: &str, n: u64, rate: f64) -> String {
    format!(
        "{{\"class\":\"RATE\",\"id\":\"{id}\",\"seq\":{n},\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"gyro\":[{rate},0,0]}}",
        1_700_000_000 + n / 1000,
        n % 1000 * 1_000_000
    )
}

/// An HTTP answer: its status and its body.
pub(crate) fn get(address: SocketAddr, path: &str, headers: &[(&str, &str)]) -> (u16, String) {
    ask(address, &format!("GET {path}"), headers, b"")
}

/// Sends any request, otherwise as [`get`]: method and target, headers, body.
pub(crate) fn ask(
    address: SocketAddr,
    what: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) -> (u16, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut request = format!("{what} HTTP/1.1\r\nConnection: close\r\n");
    for (name, value) in headers {
        request.push_str(&format!("{name}: {value}\r\n"));
    }
    if !body.is_empty() {
        request.push_str(&format!("Content-Length: {}\r\n", body.len()));
    }
    request.push_str("\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    // Who is refused by its head need not have been read to the end.
    let _ = stream.write_all(body);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let answer = String::from_utf8(answer).unwrap();
    let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    (status, body.to_owned())
}
