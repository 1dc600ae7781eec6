//! An address -> the one form in which it is printed. Pure.
//!
//! Apart from what is read, listened on or written to there, because errors hold addresses, too.

use std::fmt;

/// An address as somebody typed it, which may hold a password or a key. It is printed, logged and written in one form
/// alone: without user and password, and with `...` in the place of the values behind its `?`.
#[derive(Clone, PartialEq, Eq)]
pub struct Address(String);

impl Address {
    /// Text with everything, for who connects there.
    #[must_use]
    pub fn typed(&self) -> &str {
        &self.0
    }

    /// Scheme before `://`, in small letters; empty where there is none.
    #[must_use]
    pub fn scheme(&self) -> String {
        let scheme = self.0.split_once("://").map_or("", |(scheme, _)| scheme);
        scheme.to_ascii_lowercase()
    }

    /// Text as printed, without what stands behind its `?`: its last part then ends as a file's name does.
    #[must_use]
    pub fn place(&self) -> String {
        let printed = self.to_string();
        match printed.split_once('?') {
            Some((place, _)) => place.to_owned(),
            None => printed,
        }
    }

    /// Whether it names a user before its host.
    #[must_use]
    pub fn names_a_user(&self) -> bool {
        let rest = self.0.split_once("://").map_or("", |(_, rest)| rest);
        let host = rest.split(['/', '?', '#']).next();
        host.is_some_and(|host| host.contains('@'))
    }
}

impl<T: Into<String>> From<T> for Address {
    fn from(typed: T) -> Address {
        Address(typed.into())
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&without_secrets(&self.0))
    }
}

impl fmt::Debug for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

/// Work grows with the text.
fn without_secrets(text: &str) -> String {
    let text = crate::text::printable(text);
    let (scheme, rest) = match text.split_once("://") {
        Some((scheme, rest)) => (format!("{scheme}://"), rest),
        None => (String::new(), text.as_str()),
    };
    let (rest, query) = match rest.split_once(['?', '#']) {
        Some((rest, query)) => (rest, Some(query)),
        None => (rest, None),
    };
    // A password may hold any sign: all before the last `@` may be of it, of a query that is none too.
    let (rest, query) = match query.and_then(|query| query.rsplit_once('@')) {
        Some((_, host)) if !rest.contains('/') => {
            let (host, query) = host
                .split_once('?')
                .map_or((host, None), |(h, q)| (h, Some(q)));
            (format!("...@{host}"), query)
        }
        _ => match rest.rsplit_once('@') {
            Some((_, host)) => (format!("...@{host}"), query),
            None => (rest.to_owned(), query),
        },
    };
    let mut out = scheme + &rest;
    for (n, part) in query
        .unwrap_or_default()
        .split('&')
        .filter(|part| !part.is_empty())
        .enumerate()
    {
        out.push(if n == 0 { '?' } else { '&' });
        match part.split_once('=') {
            Some((name, _)) => {
                out.push_str(name);
                out.push_str("=...");
            }
            None => out.push_str("..."),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_printed_without_what_nobody_is_to_see() {
        for (text, printed) in [
            ("tcp://host:1", "tcp://host:1"),
            ("tcp://ada:s3cret@host:1", "tcp://...@host:1"),
            ("tcp://ada:s3/cr@et@host:1", "tcp://...@host:1"),
            ("tcp://ada:s3?cr=et@host:1", "tcp://...@host:1"),
            ("ada:s3cret@host:1", "...@host:1"),
            (
                "ws://h:1/a/b?type=x&key=s3cret",
                "ws://h:1/a/b?type=...&key=...",
            ),
            ("ws://h:1/a?s3cret", "ws://h:1/a?..."),
            ("ws://h:1/a#s3cret", "ws://h:1/a?..."),
            ("ws://u:s3cret@h:1/?k=s3cret", "ws://...@h:1/?k=..."),
            ("unix:///run/x.sock", "unix:///run/x.sock"),
            ("?=s3cret", "?=..."),
            ("", ""),
        ] {
            assert_eq!(Address::from(text).to_string(), printed, "{text}");
        }
        let address = Address::from("HTTPS://h/a%20b/c.csv?X-Signature=s3cret&x=1#y");
        assert_eq!(address.scheme(), "https");
        assert_eq!(address.place(), "HTTPS://h/a%20b/c.csv");
        for (text, names_one) in [
            ("https://ada@h/a", true),
            ("https://ada:s3cret@h:1?x", true),
            ("https://h/a@b.csv", false),
            ("s3://bucket/a?x=@", false),
        ] {
            assert_eq!(Address::from(text).names_a_user(), names_one, "{text}");
        }
        assert!(
            !Address::from("tcp://\u{1b}[31m:1")
                .to_string()
                .contains('\u{1b}')
        );
    }
}
