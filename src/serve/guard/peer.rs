//! Peer at the other end. Pure.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Peer at the other end of a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer {
    /// Name for people.
    pub name: String,
    /// Origin, whose connections count together.
    pub origin: Origin,
}

/// Origin of a peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// An address.
    Address(IpAddr),
    /// A user of this machine, by id: over a Unix socket.
    #[cfg_attr(not(unix), expect(dead_code, reason = "no such sockets"))]
    User(u32),
    /// Whoever started the daemon chose it: a source, standard input.
    Own,
}

impl Peer {
    /// Somebody at an address.
    #[must_use]
    pub fn at(transport: &str, address: SocketAddr) -> Peer {
        Peer {
            name: format!("{transport}://{address}"),
            origin: Origin::Address(address.ip().to_canonical()),
        }
    }

    /// Address; of those on this machine without one, the unspecified one.
    #[must_use]
    pub fn address(&self) -> IpAddr {
        match self.origin {
            Origin::Address(ip) => ip,
            Origin::User(_) | Origin::Own => Ipv4Addr::UNSPECIFIED.into(),
        }
    }

    /// A user of this machine.
    #[cfg(unix)]
    #[must_use]
    pub fn user(name: String, id: u32) -> Peer {
        Peer {
            name,
            origin: Origin::User(id),
        }
    }
}

impl From<String> for Peer {
    /// Chosen by ourselves.
    fn from(name: String) -> Peer {
        Peer {
            name,
            origin: Origin::Own,
        }
    }
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}
