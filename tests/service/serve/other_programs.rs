//! Promise: the daemon hears a vehicle and speaks to other programs, live.

use super::client::Client;
use super::daemon::{Daemon, PATIENCE, TCP, eventually, listening};
use std::net::UdpSocket;
use strapd::serve::Settings;
use strapd::serve::edge::output::Output;
use strapd_recording::mavlink::checksum;

/// SCALED_IMU2 of system 1, component 1: 1 rad/s about the vehicle's z, which is down, at rest.
fn scaled(n: u32) -> Vec<u8> {
    let mut frame = vec![0xfd, 22, 0, 0, n as u8, 1, 1, 116, 0, 0];
    frame.extend((10 * n).to_le_bytes());
    for value in [0_i16, 0, -1000, 0, 0, 1000, 0, 0, 7] {
        frame.extend(value.to_le_bytes());
    }
    let sum = checksum(&frame[1..], 76);
    frame.extend(sum.to_le_bytes());
    frame
}

fn hearing() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    socket
}

#[test]
fn frames_of_a_vehicle_become_attitudes_over_udp_and_tcp_in_any_cut() {
    let daemon = Daemon::start(listening(&[
        TCP,
        "udp-listen://127.0.0.1:0?protocol=mavlink&id=copter",
        "tcp-listen://127.0.0.1:0?protocol=mavlink",
    ]));
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let vehicle = UdpSocket::bind("127.0.0.1:0").unwrap();
    // The first attitude comes with the second sample.
    vehicle.send_to(&scaled(0), daemon.address(1)).unwrap();
    for n in 0..50 {
        vehicle.send_to(&scaled(n + 1), daemon.address(1)).unwrap();
        let attitude = watcher.object("ATT");
        assert_eq!(attitude["id"], "copter/SCALED_IMU2");
        // About down in the vehicle's axes is against up in ours.
        let z = attitude["q"]["z"].as_f64().unwrap();
        assert!(
            (z + (0.005 * f64::from(n)).sin()).abs() < 1e-9,
            "{attitude}"
        );
    }
    let mut link = Client::tcp(daemon.address(2));
    watcher.object("ATT");
    for byte in (0..3).flat_map(scaled) {
        link.send_bytes(&[byte]);
    }
    let ids: Vec<_> = (0..3)
        .map(|_| watcher.object("ATT")["id"].clone())
        .collect();
    assert_eq!(ids, ["SCALED_IMU2"; 3]);
    assert!(daemon.stop());
}

#[test]
fn attitudes_go_out_to_opentrack_and_to_a_slimevr_server_that_is_answered() {
    let (head, server) = (hearing(), hearing());
    let of = |scheme: &str, socket: &UdpSocket| {
        let address = socket.local_addr().unwrap();
        Output::parse(&format!("{scheme}://{address}")).unwrap()
    };
    let daemon = Daemon::start(Settings {
        outputs: vec![of("opentrack", &head), of("slimevr", &server)],
        ..listening(&[TCP])
    });
    let mut buffer = [0; 2048];
    // It greets before there is anything to say, and stops when it was answered.
    let (length, peer) = server.recv_from(&mut buffer).unwrap();
    assert_eq!(buffer[..4], 3u32.to_be_bytes());
    assert!(length > 40);
    server.send_to(b"\x03Hey OVR =D 5\0\0\0", peer).unwrap();
    let mut sender = Client::tcp(daemon.address(0));
    for n in 0..20 {
        sender.send(&format!(
            "{{\"id\":\"imu\",\"stamp_ms\":{},\"gyro\":[0,0,1]}}",
            10 * n
        ));
    }
    for n in 0..20 {
        let length = head.recv(&mut buffer).unwrap();
        assert_eq!(length, 48);
        let yaw = f64::from_le_bytes(buffer[24..32].try_into().unwrap());
        assert!(
            (yaw + (0.01 * f64::from(n)).to_degrees()).abs() < 1e-6,
            "{n}: {yaw}"
        );
    }
    let (mut info, mut rotations, mut pinged) = (0, 0, false);
    while rotations < 20 || !pinged {
        let length = server.recv(&mut buffer).unwrap();
        match u32::from_be_bytes(buffer[..4].try_into().unwrap()) {
            15 => {
                info += 1;
                let answer = [&15u32.to_be_bytes()[..], &[buffer[12], 1]].concat();
                server.send_to(&answer, peer).unwrap();
            }
            17 => {
                assert_eq!((length, buffer[12], buffer[13]), (31, 0, 1));
                rotations += 1;
                if rotations == 20 {
                    let ping = [&10u32.to_be_bytes()[..], &[0; 8], &[9, 8, 7, 6]].concat();
                    server.send_to(&ping, peer).unwrap();
                }
            }
            10 => {
                assert_eq!(buffer[12..16], [9, 8, 7, 6]);
                pinged = true;
            }
            _ => {}
        }
    }
    assert!(info >= 1);
    eventually("a sign of life", || {
        let length = server.recv(&mut buffer).unwrap();
        length == 12 && buffer[..4] == [0; 4]
    });
    assert!(daemon.stop());
}
