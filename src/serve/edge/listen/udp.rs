//! Datagrams -> sessions. I/O.
//!
//! Samples in only: whoever answers datagrams can be made to shout at somebody else. What is wrong
//! is counted and shows in `STATUS`.

use crate::serve::core::context::Context;
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::{Session, Side};
use crate::serve::guard::fault::Fault;
use crate::serve::guard::peer::Peer;
use std::collections::HashMap;
use std::net::SocketAddr;
use tokio::net::UdpSocket;
use tokio::task::yield_now;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

/// Senders remembered at once.
const MAX_SENDERS: usize = 256;
/// Longest datagram there is.
const MAX_DATAGRAM: usize = 65_536;

struct Sender {
    session: Session,
    heard: Instant,
}

pub(super) async fn serve(socket: UdpSocket, context: Context) {
    let Context {
        hub,
        mut running,
        reading,
        ..
    } = context;
    let silence = hub.limits().sender_silence;
    let mut senders: HashMap<SocketAddr, Sender> = HashMap::new();
    let mut buffer = vec![0; MAX_DATAGRAM];
    let mut tick = interval(silence / 4);
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            ready = socket.readable() => {
                if ready.is_err() {
                    return;
                }
                // An error is an answer to nobody's question (a port that was closed), or none.
                let Ok((n, peer)) = socket.try_recv_from(&mut buffer) else { continue };
                if senders.len() >= MAX_SENDERS && !senders.contains_key(&peer) {
                    let what = format!("{MAX_SENDERS} senders of datagrams are heard already");
                    hub.turned_away(&Fault::new("too_many_clients", what));
                    continue;
                }
                let sender = senders.entry(peer).or_insert_with(|| Sender {
                    session: Session::with(
                        &hub,
                        Peer::at("udp", peer),
                        Side::ListenOnly { trusted: false },
                    )
                    .reading(reading.clone()),
                    heard: Instant::now(),
                });
                sender.heard = Instant::now();
                let datagram = buffer.get(..n).unwrap_or_default();
                take(&mut sender.session, datagram).await;
                if sender.session.end().is_some() {
                    senders.remove(&peer);
                }
            }
            _ = tick.tick() => senders.retain(|_, s| s.heard.elapsed() < silence),
            () = running.asked() => {
                let rest = async {
                    while let Ok((n, peer)) = socket.try_recv_from(&mut buffer) {
                        if let Some(sender) = senders.get_mut(&peer) {
                            let datagram = buffer.get(..n).unwrap_or_default();
                            take(&mut sender.session, datagram).await;
                        }
                    }
                };
                let _ = timeout(hub.limits().drain / 2, rest).await;
                return;
            }
        }
    }
}

/// Takes a datagram, step by step. What would be answered goes nowhere.
async fn take(session: &mut Session, datagram: &[u8]) {
    with_read_buffer(|_, scratch| session.message(datagram, now(), scratch));
    loop {
        session.complaints();
        if !session.is_held() {
            return;
        }
        yield_now().await;
        with_read_buffer(|_, scratch| session.go_on(scratch));
    }
}
