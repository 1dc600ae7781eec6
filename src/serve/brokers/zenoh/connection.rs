//! An address -> a connection, and when it is lost. I/O.

use super::address::ZenohAddress;
use ::zenoh::{Config, Session};
use serde_json::{Value, json};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// Time that a connection may take, and its end.
const PATIENCE: Duration = Duration::from_secs(5);
const END: Duration = Duration::from_secs(1);
/// Time without a word of us after which we are given up.
const LEASE: Duration = Duration::from_millis(500);
/// Bytes that zenoh puts together to a message; of a longer one nothing comes, and its number is missing.
const MAX_MESSAGE: usize = 8 << 20;
/// Interval of looking whether the router is still there.
const LOOK: Duration = Duration::from_millis(100);

/// Configuration for zenoh: this endpoint, nothing is listened on and nobody looked for, unless that is asked for.
fn config(address: &ZenohAddress) -> Value {
    let endpoint = format!("{}/{}", address.protocol, address.place);
    let mut config = json!({
        // A client speaks with its router alone, and others do not come to it.
        "mode": if address.scouts { "peer" } else { "client" },
        "connect": {
            "endpoints": [endpoint],
            "timeout_ms": if address.scouts { -1 } else { 0 },
            "exit_on_failure": !address.scouts,
        },
        "listen": { "endpoints": [] },
        // In the router's hands: when we say nothing for so long we are gone, and whoever publishes reliably
        // waits for us no longer.
        "transport": { "link": {
            "tx": { "lease": LEASE.as_millis() as u64, "keep_alive": 4 },
            "rx": { "max_message_size": MAX_MESSAGE },
        } },
        "scouting": {
            "multicast": { "enabled": address.scouts },
            "gossip": { "enabled": address.scouts },
        },
    });
    if let Some((user, password)) = &address.login {
        config["transport"]["auth"]["usrpwd"] =
            json!({ "user": user, "password": password.reveal() });
    }
    if let Some(file) = &address.ca_file {
        config["transport"]["link"]["tls"]["root_ca_certificate"] = json!(file);
    }
    config
}

/// Connects once.
///
/// # Errors
/// In words.
pub(super) async fn connect(address: &ZenohAddress) -> Result<Session, String> {
    // What cannot be read may hold the password.
    let config = Config::from_json5(&config(address).to_string())
        .map_err(|_| "zenoh does not take the address's parameters".to_owned())?;
    match timeout(PATIENCE, zenoh::open(config)).await {
        Ok(Ok(session)) => Ok(session),
        // Why not it says nowhere but in its own log, which nobody is to read: it has the password in it.
        _ => Err(why_not(address).await),
    }
}

/// Why nobody answers, as far as that can be seen from here.
async fn why_not(address: &ZenohAddress) -> String {
    let place = (address.place.host.as_str(), address.place.port);
    match timeout(END, TcpStream::connect(place)).await {
        Err(_) => "no answer".to_owned(),
        Ok(Err(why)) => why.to_string(),
        Ok(Ok(_)) => {
            let shown = match (&address.login, address.protocol) {
                (Some(_), _) => "the user and password, or has a certificate that is not believed",
                (None, "tls") => {
                    "a user and password, or its certificate is none that is believed (?ca-file=FILE)"
                }
                (None, _) => "a user and password (?user=NAME&password-file=FILE), or TLS (tls/)",
            };
            format!(
                "somebody answers and does not let us in: no router of zenoh, or one that refuses or wants {shown}"
            )
        }
    }
}

/// Waits until the router has gone. Where others are looked for, zenoh itself sees to it that some are there.
pub(super) async fn lost(session: &Session, scouts: bool) {
    let mut misses = 0;
    loop {
        sleep(LOOK).await;
        let info = session.info();
        let is_there = scouts
            || info.routers_zid().await.next().is_some()
            || info.peers_zid().await.next().is_some();
        misses = if is_there { 0 } else { misses + 1 };
        if misses > 1 || session.is_closed() {
            return;
        }
    }
}

/// Ends it, as far as the other side lets us.
pub(super) async fn end(session: Session) {
    let _ = timeout(END, session.close()).await;
}
