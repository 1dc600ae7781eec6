//! Client that asks servers: TLS by `ring`, redirects within bounds, nothing waited for without end. I/O.
//!
//! Apart from the requests because what must not happen is said here once: no credentials to another host, no step
//! down from https to http, no address handed on to whom a redirect leads.

use super::fault::Fault;
use super::patience::Patience;
use reqwest::redirect::{Action, Attempt, Policy};
use reqwest::{Client, ClientBuilder};
use std::error::Error;
use strapd_attitude::diagnostic::Diagnostic;

/// Redirects that are followed.
const MOST_REDIRECTS: usize = 5;

/// Makes one for addresses, which hold all there is to be known. Where the system has no certificates, plain http is
/// spoken all the same.
pub(super) fn of_web(is_plain: bool, patience: &Patience) -> Result<Client, Diagnostic> {
    let client = || plain(patience).redirect(Policy::custom(followed));
    built(client()).or_else(|why| match is_plain {
        true => built(client().tls_certs_only([])),
        false => Err(why),
    })
}

/// Makes one for signed requests, which are for one host alone.
pub(super) fn of_cloud(patience: &Patience) -> Result<Client, Diagnostic> {
    built(plain(patience).redirect(Policy::none()))
}

fn plain(patience: &Patience) -> ClientBuilder {
    // Whoever was first: there is one for the process.
    let _ = rustls::crypto::ring::default_provider().install_default();
    Client::builder()
        .user_agent(concat!("strapd/", env!("CARGO_PKG_VERSION")))
        // It would tell the next host the address of this one, with what is secret in it.
        .referer(false)
        .connect_timeout(patience.connect)
        .read_timeout(patience.silence)
}

fn built(client: ClientBuilder) -> Result<Client, Diagnostic> {
    client.build().map_err(|e| {
        Diagnostic::new(format!("cannot speak TLS: {}", innermost(&e)))
            .help("SSL_CERT_FILE names the certificates to trust, where the system has none")
    })
}

fn followed(attempt: Attempt<'_>) -> Action {
    let from_https = attempt.previous().iter().any(|url| url.scheme() == "https");
    if from_https && attempt.url().scheme() != "https" {
        return attempt.error("it leads from https to http, which is not followed");
    }
    if attempt.previous().len() > MOST_REDIRECTS {
        return attempt.error(format!("it leads on more than {MOST_REDIRECTS} times"));
    }
    attempt.follow()
}

/// Fault with which a request failed.
pub(super) fn fault(why: &reqwest::Error, patience: &Patience) -> Fault {
    if why.is_redirect() {
        return Diagnostic::new(innermost(why)).into();
    }
    if why.is_timeout() {
        let most = match why.is_connect() {
            true => patience.connect,
            false => patience.silence,
        };
        let most = most.as_secs_f64();
        return Fault::passing(format!("no answer within {most} s"));
    }
    Fault::passing(innermost(why))
}

/// The first cause, which says what happened and not to which address.
pub(super) fn innermost(why: &(dyn Error + 'static)) -> String {
    let mut cause = why;
    while let Some(next) = cause.source() {
        cause = next;
    }
    match cause.downcast_ref::<reqwest::Error>() {
        // Its text has the address in it.
        Some(own) if own.url().is_some() => "the request failed".to_owned(),
        _ => strapd_recording::text::printable(&cause.to_string()),
    }
}
