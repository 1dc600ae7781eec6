//! Query of a broker's address -> values. Pure but for reading secrets from files.

use crate::address::Address;
use crate::client::remote::{Parameter, Place, parameters};
use crate::client::secret::Secret;
use crate::error::{Error, Result};
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::decode::exact_name;
use strapd_recording::text::printable;

/// Longer than any address.
const MAX_BYTES: usize = 2048;

/// Words in which an address is refused: where it stands, what it is, and what would do.
#[derive(Clone, Copy, Debug)]
pub(in crate::serve) struct Refusal<'a> {
    /// `serve` or `-o`.
    pub(in crate::serve) before: &'a str,
    /// The address as it was given.
    pub(in crate::serve) text: &'a str,
    /// Keys that exist.
    pub(in crate::serve) known: &'a str,
}

impl Refusal<'_> {
    /// The error that says so.
    pub(in crate::serve) fn say(&self, what: &str) -> Error {
        let shown = Address::from(self.text);
        let said = Diagnostic::new(format!("{} {shown}: {what}", self.before));
        Error::usage(said.help(self.known))
    }

    /// Host and port; `port` where none is given.
    pub(in crate::serve) fn place(&self, authority: &str, port: u16) -> Result<Place> {
        let has_port = match authority.rsplit_once(']') {
            Some((_, port)) => port.starts_with(':'),
            None => authority.contains(':'),
        };
        let full = match has_port {
            true => authority.to_owned(),
            false => format!("{authority}:{port}"),
        };
        Place::parse(&full).map_err(|what| self.say(&what))
    }
}

/// An address cut at its `?`.
#[derive(Debug)]
pub(in crate::serve) struct Query<'a> {
    refusal: Refusal<'a>,
    given: Vec<Parameter>,
}

impl<'a> Query<'a> {
    /// Splits an address into what stands between `scheme` and the `?`, and the query, of which `ours` are known.
    pub(in crate::serve) fn split(
        refusal: Refusal<'a>,
        scheme: &str,
        ours: &[&str],
    ) -> Result<(&'a str, Query<'a>)> {
        let text = refusal.text;
        let rest = text
            .strip_prefix(scheme)
            .filter(|_| text.len() <= MAX_BYTES && !text.chars().any(char::is_control))
            .ok_or_else(|| refusal.say(&format!("is no address {scheme}...")))?;
        let (rest, query) = rest.split_once('?').unwrap_or((rest, ""));
        let given =
            parameters(query).ok_or_else(|| refusal.say("a `%` needs two digits after it"))?;
        if let Some((other, _)) = given.iter().find(|(n, _)| !ours.contains(&n.as_str())) {
            return Err(refusal.say(&format!("there is no ?{}=", printable(other))));
        }
        Ok((rest, Query { refusal, given }))
    }

    fn only(&self, name: &str) -> Result<Option<&str>> {
        let mut values = self.given.iter().filter(|(n, _)| n == name);
        match (values.next(), values.next()) {
            (Some(_), Some(_)) => Err(self.refusal.say(&format!("?{name}= is given twice"))),
            (value, _) => Ok(value.map(|(_, v)| v.as_str())),
        }
    }

    /// The value of a parameter, if it is given.
    pub(in crate::serve) fn of(&self, name: &str) -> Result<Option<&str>> {
        match self.only(name)? {
            Some("") => Err(self.refusal.say(&format!("?{name}= is empty"))),
            value => Ok(value),
        }
    }

    /// Whether a parameter that has no value is given.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn has(&self, name: &str) -> Result<bool> {
        match self.only(name)? {
            None => Ok(false),
            Some("") => Ok(true),
            Some(_) => Err(self.refusal.say(&format!("?{name} takes no value"))),
        }
    }

    /// `?user=NAME&password-file=FILE`.
    pub(in crate::serve) fn user(&self) -> Result<Option<(String, Secret)>> {
        match (self.of("user")?, self.of("password-file")?) {
            (None, None) => Ok(None),
            (Some(user), Some(file)) => {
                let password = Secret::of_others("password-file", Path::new(file))?;
                Ok(Some((user.to_owned(), password)))
            }
            _ => Err(self.refusal.say("?user= goes with ?password-file=")),
        }
    }

    /// `?id=NAME`, of one sensor; `of_many`: there may be more.
    pub(in crate::serve) fn id(&self, of_many: Option<&str>) -> Result<Option<String>> {
        let Some(id) = self.of("id")? else {
            return Ok(None);
        };
        if let Some(why) = of_many {
            return Err(self.refusal.say(why));
        }
        let id = exact_name(id).map_err(|why| self.refusal.say(&format!("?id=: {why}")))?;
        Ok(Some(id))
    }

    /// Appends these parameters to a name for people, where they are given.
    pub(in crate::serve) fn show(&self, shown: &[&str], name: &mut String) {
        for said in shown {
            if let Some((_, value)) = self.given.iter().find(|(n, _)| n == said) {
                name.push(if name.contains('?') { '&' } else { '?' });
                name.push_str(said);
                if !value.is_empty() {
                    name.push_str(&format!("={}", printable(value)));
                }
            }
        }
    }
}
