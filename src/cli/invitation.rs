//! Addresses a daemon listens on -> links to its page for this network, and a QR code. I/O: asks for the interfaces.
//!
//! Apart from the daemon, which knows no interfaces and keeps no token: whoever reads the link has it.

use crate::client::remote::encoded;
use crate::client::secret::Secret;
use crate::serve::guard::admission::is_loopback;
use crate::sink::address::Listen;
use qrcodegen::{QrCode, QrCodeEcc};
use std::io::IsTerminal;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};

/// Light modules around a QR code, without which cameras do not find it.
const QUIET: i32 = 2;

/// Token that links to the page carry.
pub(super) struct Invitation {
    /// Token; `None` where the daemon asks for none.
    pub(super) token: Option<Secret>,
    /// Whether it was made for this run, and stands nowhere else.
    pub(super) is_made: bool,
}

/// Prints where a browser opens the page: with the token on standard output for an invitation, and else in the log for
/// listeners that others can reach.
pub(super) fn show(bound: &[Listen], invitation: Option<&Invitation>) {
    let pages = pages(bound, &own_addresses());
    let Some(invitation) = invitation else {
        let others = pages.iter().filter(|page| !is_loopback(page.ip()));
        let links: Vec<String> = others.map(|page| link(*page, None)).collect();
        if !links.is_empty() {
            tracing::info!("the page: {}", links.join(" "));
        }
        return;
    };
    let is_terminal = std::io::stdout().is_terminal();
    // A token of a file is not copied into whatever keeps the output.
    let token = invitation
        .token
        .as_ref()
        .filter(|_| is_terminal || invitation.is_made);
    let text = words(&pages, token.map(Secret::reveal), invitation, is_terminal);
    // The daemon serves whether somebody reads this or not.
    if let Err(e) = super::print(&text) {
        tracing::warn!("the links could not be printed: {e}");
    }
}

/// Text of an invitation.
fn words(
    pages: &[SocketAddr],
    token: Option<&str>,
    invitation: &Invitation,
    is_terminal: bool,
) -> String {
    let Some(first) = pages.first() else {
        return "No page to open: no listener is ws-listen://HOST:PORT\n".to_owned();
    };
    let mut text = if is_loopback(first.ip()) {
        "No network reaches this machine. Open here:\n".to_owned()
    } else {
        "Open on a phone or a computer of this network:\n".to_owned()
    };
    for page in pages {
        text.push_str(&format!("  {}\n", link(*page, token)));
    }
    if is_terminal && let Some(code) = code(&link(*first, token)) {
        text.push_str(&code);
    }
    text.push_str(match (&invitation.token, token) {
        (None, _) => "No token is asked for: everybody in this network can watch and send.\n",
        (Some(_), None) => "The page asks for the token of --token-file.\n",
        (Some(_), Some(_)) if invitation.is_made => {
            "The token holds until the daemon ends; --token-file FILE keeps it. Nothing is encrypted.\n"
        }
        (Some(_), Some(_)) => "The links hold the token of --token-file. Nothing is encrypted.\n",
    });
    text
}

/// Addresses at which a browser finds the page, those that others can reach first; `own` are this machine's, the likeliest
/// first.
fn pages(bound: &[Listen], own: &[IpAddr]) -> Vec<SocketAddr> {
    let mut pages: Vec<SocketAddr> = Vec::new();
    for listen in bound {
        let Listen::WebSocket(at) = listen else {
            continue;
        };
        if !at.ip().is_unspecified() {
            pages.push(*at);
            continue;
        }
        // Where all of IPv6 is listened on, IPv4 may not be.
        let fits = own.iter().filter(|ip| ip.is_ipv4() == at.is_ipv4());
        let before = pages.len();
        pages.extend(fits.map(|ip| SocketAddr::new(*ip, at.port())));
        if pages.len() == before {
            let here = IpAddr::from(Ipv4Addr::LOCALHOST);
            pages.push(SocketAddr::new(here, at.port()));
        }
    }
    pages.sort_by_key(|page| is_loopback(page.ip()));
    pages
}

/// Addresses of this machine in its networks; that of the way to everywhere else first.
fn own_addresses() -> Vec<IpAddr> {
    let found = if_addrs::get_if_addrs().unwrap_or_default();
    let mut own: Vec<IpAddr> = found
        .iter()
        .filter(|interface| interface.is_oper_up() && !interface.is_loopback())
        // An address with a zone is none that a browser takes.
        .filter(|interface| !interface.is_link_local())
        .map(if_addrs::Interface::ip)
        .collect();
    let outward = outward();
    own.sort_by_key(|ip| Some(*ip) != outward);
    own.dedup();
    own
}

/// Address from which packets to the outside leave. Nothing is sent for it.
fn outward() -> Option<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    // Of documentation: nobody has it.
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9)).ok()?;
    socket.local_addr().ok().map(|at| at.ip())
}

/// Link to the page at an address. What is behind `#` a browser keeps to itself.
fn link(page: SocketAddr, token: Option<&str>) -> String {
    match token {
        Some(token) => format!("http://{page}/#token={}", encoded(token, b"")),
        None => format!("http://{page}/"),
    }
}

/// QR code of a text for a terminal, two modules a character, dark on light whatever the theme; `None`: the text is too
/// long.
fn code(text: &str) -> Option<String> {
    let code = QrCode::encode_text(text, QrCodeEcc::Low).ok()?;
    let is_dark = |x, y| code.get_module(x, y);
    let span = || -QUIET..code.size() + QUIET;
    let mut out = String::new();
    for y in span().step_by(2) {
        out.push_str("\x1b[38;5;16;48;5;231m");
        out.extend(span().map(|x| match (is_dark(x, y), is_dark(x, y + 1)) {
            (false, false) => ' ',
            (true, false) => '▀',
            (false, true) => '▄',
            (true, true) => '█',
        }));
        out.push_str("\x1b[0m\n");
    }
    Some(out)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn at(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    #[test]
    fn a_listener_on_every_address_is_a_link_for_each_and_one_on_loopback_is_last() {
        let own: Vec<IpAddr> = ["192.168.1.5", "10.0.0.3", "2001:db8::7"]
            .map(|ip| ip.parse().unwrap())
            .into();
        let bound = [
            Listen::Tcp(at("0.0.0.0:4550")),
            Listen::WebSocket(at("127.0.0.1:8000")),
            Listen::WebSocket(at("0.0.0.0:8765")),
            Listen::WebSocket(at("[::]:8766")),
        ];
        let links: Vec<String> = pages(&bound, &own)
            .into_iter()
            .map(|page| link(page, Some("a+b c")))
            .collect();
        assert_eq!(
            links,
            [
                "http://192.168.1.5:8765/#token=a%2Bb%20c",
                "http://10.0.0.3:8765/#token=a%2Bb%20c",
                "http://[2001:db8::7]:8766/#token=a%2Bb%20c",
                "http://127.0.0.1:8000/#token=a%2Bb%20c"
            ]
        );
        // Without a network there is this machine.
        assert_eq!(pages(&bound[2..3], &[]), [at("127.0.0.1:8765")]);
        assert_eq!(pages(&bound[..1], &own), []);
    }

    #[test]
    fn a_code_in_characters_has_every_module_and_a_border() {
        let text = "http://192.168.1.5:8765/#token=0123456789abcdef0123456789abcdef";
        let drawn = code(text).unwrap();
        let wanted = QrCode::encode_text(text, QrCodeEcc::Low).unwrap();
        let rows: Vec<Vec<[bool; 2]>> = drawn
            .lines()
            .map(|line| {
                let line = line.strip_prefix("\x1b[38;5;16;48;5;231m").unwrap();
                let halves = |c| [matches!(c, '▀' | '█'), matches!(c, '▄' | '█')];
                line.strip_suffix("\x1b[0m")
                    .unwrap()
                    .chars()
                    .map(halves)
                    .collect()
            })
            .collect();
        let wide = wanted.size() + 2 * QUIET;
        for y in 0..wide {
            for x in 0..wide {
                let [row, column] = [y, x].map(|n| usize::try_from(n).unwrap());
                let is_dark = rows[row / 2][column][row % 2];
                assert_eq!(is_dark, wanted.get_module(x - QUIET, y - QUIET), "{x} {y}");
            }
        }
    }

    #[test]
    fn a_token_of_a_file_is_printed_to_a_terminal_alone() {
        let pages = [at("192.168.1.5:8765")];
        let secret = Secret::random().unwrap();
        let token = secret.reveal().to_owned();
        assert!(token.len() == 32, "{token}");
        let invitation = Invitation {
            token: Some(secret),
            is_made: false,
        };
        let hidden = words(&pages, None, &invitation, false);
        assert!(hidden.contains("http://192.168.1.5:8765/\n"), "{hidden}");
        assert!(hidden.contains("asks for the token"), "{hidden}");
        let shown = words(&pages, Some(&token), &invitation, true);
        assert!(shown.contains(&token) && shown.contains('▀'), "{shown}");
    }
}
