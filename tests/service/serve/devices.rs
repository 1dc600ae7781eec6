//! Promise: a sensor that speaks its maker's frames is read like any other, over UDP, TCP and a serial port, and its
//! protocol is recognised where nobody says it.

use super::client::Client;
use super::daemon::{Daemon, TCP, eventually, listening};
use std::net::UdpSocket;
use std::time::Duration;

/// Packet of a MicroStrain sensor at rest that rotates about its z, which is down, by 1 rad/s.
pub(super) fn mip(n: u64) -> Vec<u8> {
    let floats = |v: [f32; 3]| v.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    let time = (n * 10_000_000).to_be_bytes().to_vec();
    let fields = [
        (0x04, floats([0.0, 0.0, -1.0])),
        (0x05, floats([0.0, 0.0, 1.0])),
        (0xd5, time),
    ];
    let mut data = Vec::new();
    for (descriptor, bytes) in fields {
        data.extend([bytes.len() as u8 + 2, descriptor]);
        data.extend(bytes);
    }
    let mut packet = [&[0x75, 0x65, 0x80, data.len() as u8], data.as_slice()].concat();
    let (mut one, mut two) = (0u8, 0u8);
    for byte in &packet {
        one = one.wrapping_add(*byte);
        two = two.wrapping_add(one);
    }
    packet.extend([one, two]);
    packet
}

/// Line of a VectorNav, which has no time.
const VNYMR: &[u8] = b"$VNYMR,-165.981,-037.301,+001.245,+00.2901,+00.0720,+00.7482,-05.966,-00.150,-07.836,+00.001373,-00.001533,-00.001054*68\r\n";

#[test]
fn frames_become_attitudes_over_udp_and_tcp_in_any_cut_asked_for_or_recognised() {
    let daemon = Daemon::start(listening(&[
        TCP,
        "udp-listen://127.0.0.1:0?protocol=mip&id=wheel",
        "tcp-listen://127.0.0.1:0?protocol=auto&id=arm",
    ]));
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let device = UdpSocket::bind("127.0.0.1:0").unwrap();
    device.send_to(&mip(0), daemon.address(1)).unwrap();
    for n in 0..50u32 {
        let packet = mip(u64::from(n) + 1);
        device.send_to(&packet, daemon.address(1)).unwrap();
        let attitude = watcher.object("ATT");
        assert_eq!(attitude["id"], "wheel");
        // About down in the sensor's axes is against up in ours.
        let z = attitude["q"]["z"].as_f64().unwrap();
        let wanted = -(0.005 * f64::from(n)).sin();
        assert!((z - wanted).abs() < 1e-9, "{attitude}");
    }
    let mut link = Client::tcp(daemon.address(2));
    watcher.object("ATT");
    link.send_bytes(b"boot: ok\r\n");
    for byte in (0..6).flat_map(mip) {
        link.send_bytes(&[byte]);
    }
    // What came before it was recognised is read, too.
    let ids: Vec<_> = (0..6)
        .map(|_| watcher.object("ATT")["id"].clone())
        .collect();
    assert_eq!(ids, ["arm"; 6]);
    assert!(daemon.stop());
}

#[test]
fn a_sensor_without_a_clock_is_stamped_when_it_comes() {
    let daemon = Daemon::start(listening(&[
        TCP,
        "tcp-listen://127.0.0.1:0?protocol=vectornav&id=vn",
    ]));
    let mut sender = Client::tcp(daemon.address(1));
    for _ in 0..150 {
        sender.send_bytes(VNYMR);
        std::thread::sleep(Duration::from_millis(10));
    }
    let attitudes = || {
        let mut asking = Client::tcp(daemon.address(0));
        asking.send("{\"class\":\"POLL\"}");
        let status = asking.next_of("STATUS");
        (
            status["sources"][0]["attitudes"].as_u64().unwrap_or(0),
            status["sources"][0]["id"] == "vn",
        )
    };
    eventually("150 attitudes", || attitudes() == (150, true));
    assert!(daemon.stop());
}
