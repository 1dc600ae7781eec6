//! WebSocket frames nobody should send: 100,000 of them end their own connections and nothing
//! else.

use super::client::{Client, rate};
use super::daemon::{Daemon, PATIENCE, TCP, WS, eventually, listening};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};

/// A frame as a client should send it: masked, whole.
fn frame(opcode: u8, payload: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mask: [u8; 4] = rng.random();
    let mut out = vec![0x80 | opcode];
    match payload.len() {
        n @ 0..126 => out.push(0x80 | n as u8),
        n => {
            out.push(0x80 | 126);
            out.extend_from_slice(&(n as u16).to_be_bytes());
        }
    }
    out.extend_from_slice(&mask);
    out.extend(payload.iter().zip(mask.iter().cycle()).map(|(b, m)| b ^ m));
    out
}

/// Opens a connection and completes the handshake.
fn open(address: SocketAddr) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    write!(
        stream,
        "GET /ws HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    .unwrap();
    let mut head = Vec::new();
    let mut byte = [0];
    while !head.ends_with(b"\r\n\r\n") {
        stream.read_exact(&mut byte).unwrap();
        head.push(byte[0]);
    }
    assert!(head.starts_with(b"HTTP/1.1 101"), "{}", head.escape_ascii());
    stream
}

#[test]
fn a_hundred_thousand_frames_nobody_should_send_end_their_own_connections_alone() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut watcher =
        Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\",\"id\":\"good\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut frames, mut good) = (0, 0);
    while frames < 100_000 {
        let mut bytes = Vec::new();
        for _ in 0..50 {
            let line = rate("web", rng.random_range(0..100), 1.0);
            let text = match rng.random_range(0..4) {
                0 => "{\"class\":\"POLL\"}",
                _ => &line,
            };
            let opcode = [1, 1, 1, 2, 0, 8, 9, 10, 3, 15][rng.random_range(0..10)];
            let mut one = frame(opcode, text.as_bytes(), &mut rng);
            // Half of them changed: flags, opcode, length, mask, text.
            if rng.random() {
                for _ in 0..rng.random_range(1..4) {
                    let at = rng.random_range(0..one.len().min(24));
                    one[at] ^= 1 << rng.random_range(0..8);
                }
            }
            if rng.random_range(0..40) == 0 {
                let mut noise = [0; 30];
                rng.fill_bytes(&mut noise);
                one.extend_from_slice(&noise);
            }
            bytes.extend(one);
            frames += 1;
        }
        let mut stream = open(daemon.address(1));
        // The daemon may have closed before the last of them.
        let _ = stream.write_all(&bytes);
        if frames % 1000 == 0 {
            sender.send(&rate("good", good, 1.0));
            assert_eq!(watcher.object("ATT")["seq"], good, "{frames} frames");
            good += 1;
        }
    }
    eventually("the others to be gone", || daemon.hub.connected() == 2);
    assert!(daemon.stop());
}
