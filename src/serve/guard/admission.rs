//! Rules of who may listen where, who may connect, who may speak. Pure.
//!
//! A gyro stream looks harmless, but a page in any browser can reach loopback: so names and
//! origins are checked, and beyond loopback a token is needed.

use super::failed_logins::Strangers;
use super::fault::Fault;
use crate::sink::UNAUTHORISED;
use sha2::{Digest, Sha256};
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use subtle::ConstantTimeEq;

/// The token clients must show. Only its hash is kept.
pub struct Token {
    hash: [u8; 32],
    strangers: Mutex<Strangers>,
}

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    /// Makes one from text.
    #[must_use]
    pub fn new(token: &str) -> Token {
        Token {
            hash: Sha256::digest(token.as_bytes()).into(),
            strangers: Mutex::default(),
        }
    }

    /// Whether this is it, shown by somebody at `from`. The time taken does not depend on what is right of
    /// it.
    ///
    /// # Errors
    /// What to answer with, and how long to wait before.
    pub fn judge(
        &self,
        shown: &str,
        from: IpAddr,
        now: Instant,
    ) -> std::result::Result<(), Denied> {
        let hash: [u8; 32] = Sha256::digest(shown.as_bytes()).into();
        if bool::from(hash.ct_eq(&self.hash)) {
            return Ok(());
        }
        let mut strangers = self
            .strangers
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        Err(Denied {
            fault: Fault::new(UNAUTHORISED, "the token is wrong"),
            delay: strangers.failed(from, now),
        })
    }
}

/// The answer to a wrong token.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Denied {
    /// Fault that is answered.
    pub fault: Fault,
    /// Delay before the answer, so that nobody tries fast.
    pub delay: Duration,
}

/// Whether an address is reached from this machine alone.
#[must_use]
pub fn is_loopback(ip: IpAddr) -> bool {
    match ip {
        IpAddr::V4(ip) => ip.is_loopback(),
        IpAddr::V6(ip) => {
            ip.is_loopback() || ip.to_ipv4_mapped().is_some_and(|ip| ip.is_loopback())
        }
    }
}

/// Why a request is not answered.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Foreign {
    /// Request without a Host.
    NoHost,
    /// Host that is none of ours: another's name may have been made to lead here.
    Host,
    /// Origin of somebody else's page.
    Origin,
}

impl Foreign {
    /// Reason in words, with the flag that helps.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Foreign::NoHost => "the request names no Host",
            Foreign::Host => "this Host is not one of ours; --allow-host NAME allows it",
            Foreign::Origin => {
                "pages of this Origin may not connect; --allow-origin ORIGIN allows them"
            }
        }
    }
}

/// The names a browser may use for us, and the pages that may talk to us.
#[derive(Clone, Debug, Default)]
pub struct Web {
    /// `--allow-host`: names beside loopback's and the bound address.
    pub hosts: Vec<String>,
    /// `--allow-origin`: origins beside those served from here.
    pub origins: Vec<String>,
}

impl Web {
    /// Whether a request may be answered: `host` and `origin` are its headers, `bound` the address
    /// it came in at.
    ///
    /// # Errors
    /// What is not allowed.
    pub fn admit(
        &self,
        bound: IpAddr,
        host: Option<&str>,
        origin: Option<&str>,
    ) -> std::result::Result<(), Foreign> {
        let host = host.ok_or(Foreign::NoHost)?;
        let name = host_name(host).unwrap_or_default();
        let is_bound = name
            .parse::<IpAddr>()
            .is_ok_and(|ip| ip == bound && !ip.is_unspecified());
        let known = ["localhost", "127.0.0.1", "::1"]
            .iter()
            .any(|known| name.eq_ignore_ascii_case(known))
            || is_bound
            // A name given without port is allowed at any.
            || self
                .hosts
                .iter()
                .any(|a| a.eq_ignore_ascii_case(host) || a.eq_ignore_ascii_case(name));
        if !known {
            return Err(Foreign::Host);
        }
        match origin {
            None => Ok(()),
            Some(origin) if self.origins.iter().any(|o| o.eq_ignore_ascii_case(origin)) => Ok(()),
            Some(origin) if Web::is_own(Some(host), Some(origin)) => Ok(()),
            Some(_) => Err(Foreign::Origin),
        }
    }

    /// Whether a page that says this `origin` came from the `host` it asks: no browser lets a page say so of
    /// itself that did not.
    #[must_use]
    pub fn is_own(host: Option<&str>, origin: Option<&str>) -> bool {
        let (Some(host), Some(origin)) = (host, origin) else {
            return false;
        };
        let authority = origin
            .split_once("://")
            .filter(|(scheme, _)| matches!(*scheme, "http" | "https"))
            .map(|(_, authority)| authority);
        authority.is_some_and(|a| a.eq_ignore_ascii_case(host))
    }
}

/// Host without port and brackets; `None` when it is neither name nor address.
fn host_name(host: &str) -> Option<&str> {
    if let Some(rest) = host.strip_prefix('[') {
        let (name, port) = rest.split_once(']')?;
        return (port.is_empty() || is_port(port.strip_prefix(':')?)).then_some(name);
    }
    match host.split_once(':') {
        None => Some(host),
        Some((name, port)) => is_port(port).then_some(name),
    }
}

fn is_port(text: &str) -> bool {
    !text.is_empty() && text.len() <= 5 && text.bytes().all(|b| b.is_ascii_digit())
}
