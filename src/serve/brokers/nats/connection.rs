//! An address -> a connection that comes back. I/O.

use super::address::{Login, NatsAddress};
use crate::serve::guard::redial::Redial;
use crate::serve::guard::shutdown::Running;
use async_nats::{Client, ConnectOptions, Event};
use std::time::Duration;
use tokio::time::sleep;

/// Time that a connection may take, and a request.
const PATIENCE: Duration = Duration::from_secs(5);
/// The first wait before a connection that was lost is tried again, and the longest.
const FIRST_WAIT: Duration = Duration::from_millis(100);
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// Messages that wait here for us; more are dropped, and counted as such.
const WAITING: usize = 65_536;

/// Connects once; a connection that is lost later comes back by itself, which `heard` is told.
///
/// # Errors
/// In words.
async fn connect(
    address: &NatsAddress,
    heard: impl Fn(&Event) + Send + Sync + Clone + 'static,
) -> Result<Client, String> {
    let mut options = ConnectOptions::new()
        .name("strapd")
        .connection_timeout(PATIENCE)
        .request_timeout(Some(PATIENCE))
        .subscription_capacity(WAITING)
        .max_reconnects(None)
        // Where else there are servers is not for a server to say: we chose this one.
        .ignore_discovered_servers()
        .reconnect_delay_callback(|failures| {
            let doublings = u32::try_from(failures).unwrap_or(u32::MAX).min(6);
            (FIRST_WAIT * (1 << doublings)).min(LONGEST_WAIT)
        })
        .event_callback(move |event| {
            heard(&event);
            std::future::ready(())
        });
    options = match &address.login {
        Login::Nobody => options,
        Login::User(user, password) => {
            options.user_and_password(user.clone(), password.reveal().to_owned())
        }
        Login::Token(token) => options.token(token.reveal().to_owned()),
    };
    if let Some(file) = &address.ca_file {
        options = options
            .add_root_certificates(file.clone())
            .require_tls(true);
    }
    let server = format!("nats://{}", address.place);
    options.connect(server).await.map_err(|e| in_words(&e))
}

/// The same, again and again until it is there; `said` is told why it is not. `None`: the daemon ends.
pub(super) async fn keep_connecting(
    address: &NatsAddress,
    heard: impl Fn(&Event) + Send + Sync + Clone + 'static,
    mut said: impl FnMut(&str),
    running: &mut Running,
) -> Option<Client> {
    let mut redial = Redial::default();
    loop {
        let connected = tokio::select! {
            connected = connect(address, heard.clone()) => connected,
            () = running.asked() => return None,
        };
        match connected {
            Ok(client) => return Some(client),
            Err(why) => said(&why),
        }
        tokio::select! {
            () = sleep(redial.failed()) => {}
            () = running.asked() => return None,
        }
    }
}

/// An error with what caused it.
pub(super) fn in_words(error: &(dyn std::error::Error + 'static)) -> String {
    let mut words = error.to_string();
    let mut cause = error.source();
    while let Some(next) = cause {
        let said = next.to_string();
        if !words.contains(&said) {
            words.push_str(": ");
            words.push_str(&said);
        }
        cause = next.source();
    }
    words
}
