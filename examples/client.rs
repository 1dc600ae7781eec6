//! A client of a running daemon, over a plain socket: sends a turn, prints where it ended.
//!
//! ```sh
//! strapd serve &
//! cargo run --example client            # or: -- 127.0.0.1:4550
//! ```
//!
//! The lines are those of `docs/protocol.md`; the same in Python is at its end.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::{SystemTime, UNIX_EPOCH};

/// Samples of a turn of 90 degrees in one second.
const SAMPLES: u64 = 1000;

fn main() -> Result<(), Box<dyn Error>> {
    let address = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "127.0.0.1:4550".to_owned());
    let mut socket = TcpStream::connect(&address)
        .map_err(|e| format!("{address}: {e}\n  help: is `strapd serve` running there?"))?;
    let lines = BufReader::new(socket.try_clone()?).lines();
    // The last attitude of an earlier run is not asked for.
    writeln!(socket, r#"{{"class":"WATCH","id":"example","last":false}}"#)?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs();
    for k in 0..=SAMPLES {
        let rate = std::f64::consts::FRAC_PI_2;
        let (sec, nsec) = (now + k / 1000, k % 1000 * 1_000_000);
        writeln!(
            socket,
            r#"{{"id":"example","stamp":{{"sec":{sec},"nsec":{nsec}}},"gyro":[0,0,{rate}]}}"#
        )?;
    }
    for line in lines {
        let line: serde_json::Value = serde_json::from_str(&line?)?;
        match line["class"].as_str() {
            Some("ATT") if line["stamp"]["sec"] == now + SAMPLES / 1000 => {
                println!("q_nb {}, sigma {} degrees", line["q"], line["sigma_deg"]);
                return Ok(());
            }
            Some("ERROR") => return Err(line.to_string().into()),
            _ => {}
        }
    }
    Err("the daemon closed the connection".into())
}
