//! The hub -> somebody who listens: `serve -o tcp://`, `-o udp://`, and the protocols of others. I/O.
//!
//! A client like any other, but that we call: its outbox is bounded, the oldest give way, and it slows
//! nobody down. One that cannot be reached, or goes, is called again.

use crate::serve::core::context::Context;
use crate::serve::core::hub::{Client, ClientProtocol, Hub, count};
use crate::serve::guard::log_throttle;
use crate::serve::guard::shutdown::Running;
use crate::serve::protocol::filter::Filter;
use crate::sink::{Datagrams, Profile, Recipient, Target};
use bytes::Bytes;
use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpStream, UdpSocket};
use tokio::time::{interval, sleep, timeout};

/// Time between two calls.
const AGAIN: Duration = Duration::from_secs(1);
/// Time that a call may ring.
const CONNECT: Duration = Duration::from_secs(10);
/// Time between two looks at whether a sign of life is due.
const BEAT: Duration = Duration::from_millis(250);
/// Bytes taken from the outbox at once.
const TAKE: usize = 64 << 10;

/// Sends every attitude there until the daemon ends.
pub(in crate::serve) async fn send(target: Target, context: Context) {
    let Context {
        hub, mut running, ..
    } = context;
    let (name, profile) = match &target {
        Target::Tcp(address) => (format!("tcp://{address}"), Default::default()),
        Target::Udp { address, profile } => (format!("udp://{address}"), *profile),
        Target::Protocol(recipient) => (recipient.to_string(), Profile::Records),
        _ => return,
    };
    let client = hub.join_as(name, ClientProtocol::Lines(profile));
    loop {
        let ended = match &target {
            Target::Tcp(address) => tcp(address, &hub, &client, &mut running).await,
            Target::Udp { address, .. } => udp(address, &hub, &client, &mut running).await,
            Target::Protocol(recipient) => converse(recipient, &hub, &client, &mut running).await,
            _ => return,
        };
        hub.watch(&client, None);
        client.outbox.forget();
        let Err(why) = ended else { break };
        log_throttle::warn(
            "outgoing",
            &format!("-o {}: {why}; trying again", client.peer),
        );
        tokio::select! {
            () = sleep(AGAIN) => {}
            () = running.asked() => break,
        }
    }
    hub.leave(&client, &[]);
}

fn begin(hub: &Hub, client: &Client) {
    let filter = Filter {
        last: true,
        ..Filter::default()
    };
    hub.watch(client, Some(filter));
}

/// Next piece to send; `None`: the daemon ends and all was sent.
async fn next(
    client: &Client,
    running: &mut Running,
    asked: &mut Option<bool>,
    parts: &mut VecDeque<Bytes>,
) -> Option<usize> {
    loop {
        let bytes = client.outbox.take(TAKE, parts);
        if !parts.is_empty() {
            return Some(bytes);
        }
        if *asked == Some(true) {
            return None;
        }
        tokio::select! {
            () = client.outbox.filled() => {}
            () = running.asked_further(asked.is_some()) => {
                *asked = Some(asked.is_some());
                running.has_read();
            }
        }
    }
}

async fn tcp(address: &str, hub: &Hub, client: &Client, running: &mut Running) -> io::Result<()> {
    let late = |what: &str| io::Error::new(io::ErrorKind::TimedOut, what.to_owned());
    let stream = tokio::select! {
        stream = timeout(CONNECT, TcpStream::connect(address)) => {
            stream.map_err(|_| late("no answer"))??
        }
        () = running.asked() => return Ok(()),
    };
    // A loss of comfort at most.
    let _ = stream.set_nodelay(true);
    begin(hub, client);
    let (mut answers, mut stream) = stream.into_split();
    let (mut parts, mut asked, mut heard) = (VecDeque::new(), None, [0; 4096]);
    loop {
        let bytes = tokio::select! {
            bytes = next(client, running, &mut asked, &mut parts) => bytes,
            read = answers.read(&mut heard) => match read? {
                0 => return Err(io::Error::new(io::ErrorKind::ConnectionAborted, "it has closed")),
                // What it says is its own matter; unread it would turn our close into a reset.
                _ => continue,
            },
        };
        let Some(bytes) = bytes else {
            return stream.shutdown().await;
        };
        for part in parts.drain(..) {
            timeout(hub.limits().no_progress, stream.write_all(&part))
                .await
                .map_err(|_| late("it took nothing for too long"))??;
            count(&hub.counters.bytes_out, part.len());
        }
        client.outbox.written(bytes);
    }
}

/// Connects a socket to an address.
async fn connected(address: &str) -> io::Result<UdpSocket> {
    let place = tokio::net::lookup_host(address).await?.next();
    let place = place.ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))?;
    let own: SocketAddr = match place {
        SocketAddr::V4(_) => ([0, 0, 0, 0], 0).into(),
        SocketAddr::V6(_) => ([0; 16], 0).into(),
    };
    let socket = UdpSocket::bind(own).await?;
    socket.connect(place).await?;
    Ok(socket)
}

/// Sends a datagram, whether or not somebody listens.
async fn send_one(socket: &UdpSocket, hub: &Hub, datagram: &[u8]) -> io::Result<()> {
    match socket.send(datagram).await {
        Ok(n) => count(&hub.counters.bytes_out, n),
        // The answer to an earlier one: nobody listens, yet.
        Err(why) if why.kind() == io::ErrorKind::ConnectionRefused => {}
        Err(why) => return Err(why),
    }
    Ok(())
}

/// Speaks another program's protocol with it.
async fn converse(
    recipient: &Recipient,
    hub: &Arc<Hub>,
    client: &Arc<Client>,
    running: &mut Running,
) -> io::Result<()> {
    let socket = connected(&recipient.address).await?;
    let mut datagrams = Datagrams::new(recipient);
    begin(hub, client);
    let (mut parts, mut asked, mut said) = (VecDeque::new(), None, [0; 1500]);
    let mut beat = interval(BEAT);
    loop {
        let taken = tokio::select! {
            taken = next(client, running, &mut asked, &mut parts) => Some(taken),
            _ = beat.tick(), if recipient.converses() => None,
            heard = socket.recv(&mut said), if recipient.converses() => {
                // That nobody listens is no answer.
                if let Ok(length) = heard {
                    datagrams.hear(said.get(..length).unwrap_or(&[]), Instant::now());
                }
                None
            }
        };
        if recipient.converses() {
            datagrams.tick(Instant::now());
        }
        for part in parts.drain(..) {
            datagrams.take(&part);
        }
        while let Some(datagram) = datagrams.ready() {
            send_one(&socket, hub, &datagram).await?;
        }
        match taken {
            Some(Some(bytes)) => client.outbox.written(bytes),
            Some(None) => return Ok(()),
            None => {}
        }
    }
}

async fn udp(
    address: &str,
    hub: &Hub,
    client: &Arc<Client>,
    running: &mut Running,
) -> io::Result<()> {
    let socket = connected(address).await?;
    begin(hub, client);
    let (mut parts, mut asked) = (VecDeque::new(), None);
    while let Some(bytes) = next(client, running, &mut asked, &mut parts).await {
        for part in parts.drain(..) {
            for line in part.split_inclusive(|b| *b == b'\n') {
                send_one(&socket, hub, line).await?;
            }
        }
        client.outbox.written(bytes);
    }
    Ok(())
}
