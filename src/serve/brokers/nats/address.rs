//! `nats://HOST:PORT/SUBJECT?...` -> a server, what is read or written there, and how. Pure but for
//! reading secrets from files.

use crate::client::remote::{Place, encoded};
use crate::client::secret::Secret;
use crate::error::Result;
use crate::serve::brokers::query::{Query, Refusal};
use std::path::{Path, PathBuf};

/// The port of a server where none is written.
const PORT: u16 = 4222;
/// Most partitions that are told apart.
const MAX_PARTITION: u32 = 65_535;
const KNOWN_IN: &str = "nats://HOST:PORT/SUBJECT (imu.*; the last token names the sensor) with ?id=NAME, ?stream=NAME (JetStream), ?from=new|all|SEQUENCE, ?state=BUCKET&p=PARTITION, ?user=NAME&password-file=FILE, ?token-file=FILE, ?ca-file=FILE";
const KNOWN_OUT: &str = "nats://HOST:PORT/SUBJECT (att.{id}) with ?stream=NAME (JetStream), ?user=NAME&password-file=FILE, ?token-file=FILE, ?ca-file=FILE";

/// A subject of a server, and how to get to it.
#[derive(Clone, Debug)]
pub struct NatsAddress {
    /// The server.
    pub place: Place,
    /// Subject to subscribe to, wildcards and all; or to publish to, with `{id}` in it.
    pub subject: String,
    /// Login.
    pub login: Login,
    /// Path of the certificates that are believed; TLS is asked for then.
    pub ca_file: Option<PathBuf>,
    /// The stream of JetStream that holds the subject; else what is missed is gone.
    pub stream: Option<String>,
    /// Place in the stream to begin at.
    pub from: From,
    /// Id of the one sensor here, whatever its subject.
    pub id: Option<String>,
    /// Key under which the state is kept, so that one worker at a time has these sensors.
    pub lease: Option<LeaseKey>,
    /// The address, for people.
    pub name: String,
}

/// Login at a server.
#[derive(Clone, Debug, Default)]
pub enum Login {
    /// Nobody.
    #[default]
    Nobody,
    /// Name and password.
    User(String, Secret),
    /// Token.
    Token(Secret),
}

/// Place in a stream to begin at, where nothing is known of what was read before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum From {
    /// Next message.
    #[default]
    New,
    /// First message there is.
    All,
    /// Message with this number.
    Sequence(u64),
}

/// The key in a bucket under which a partition's state is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeaseKey {
    /// The bucket; made where it is not there.
    pub bucket: String,
    /// The key, `p.PARTITION`.
    pub key: String,
}

/// Direction of samples or attitudes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    In,
    Out,
}

impl NatsAddress {
    /// Reads an address from which samples come.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::error::Error::Usage) with what is known; a file of a secret cannot be read.
    pub fn source(text: &str) -> Result<NatsAddress> {
        NatsAddress::parse(text, Way::In)
    }

    /// Reads an address to which attitudes go.
    ///
    /// # Errors
    /// As [`NatsAddress::source`].
    pub fn output(text: &str) -> Result<NatsAddress> {
        NatsAddress::parse(text, Way::Out)
    }

    fn parse(text: &str, way: Way) -> Result<NatsAddress> {
        let (before, known) = match way {
            Way::In => ("serve", KNOWN_IN),
            Way::Out => ("-o", KNOWN_OUT),
        };
        let refusal = Refusal {
            before,
            text,
            known,
        };
        let refuse = |what: &str| refusal.say(what);
        let ours: &[&str] = match way {
            Way::In => &[
                "id",
                "stream",
                "from",
                "state",
                "p",
                "user",
                "password-file",
                "token-file",
                "ca-file",
            ],
            Way::Out => &["stream", "user", "password-file", "token-file", "ca-file"],
        };
        let (rest, query) = Query::split(refusal, "nats://", ours)?;
        let (authority, subject) = rest.split_once('/').unwrap_or((rest, ""));
        let place = refusal.place(authority, PORT)?;
        let login = match (query.user()?, query.of("token-file")?) {
            (None, None) => Login::Nobody,
            (Some((user, password)), None) => Login::User(user, password),
            (None, Some(file)) => Login::Token(Secret::of_others("token-file", Path::new(file))?),
            _ => return Err(refuse("?token-file= goes with no ?user=")),
        };
        let named = |name: &str| -> Result<Option<String>> {
            match query.of(name)? {
                Some(value) if !is_name(value) => Err(refuse(&format!(
                    "?{name}=: a name of letters, digits, - and _"
                ))),
                value => Ok(value.map(str::to_owned)),
            }
        };
        let stream = named("stream")?;
        let from = match query.of("from")? {
            None | Some("new") => From::New,
            Some("all") => From::All,
            Some(number) => From::Sequence(
                number
                    .parse()
                    .map_err(|_| refuse("?from= is new, all, or the number of a message"))?,
            ),
        };
        let partition = match query.of("p")? {
            None => None,
            Some(p) => Some(
                p.parse::<u32>()
                    .ok()
                    .filter(|p| *p <= MAX_PARTITION)
                    .ok_or_else(|| refuse("?p= is the number of a partition"))?,
            ),
        };
        let lease = match (named("state")?, partition) {
            (None, _) => None,
            (Some(_), None) => return Err(refuse("?state= needs ?p=, the partition it is of")),
            (Some(bucket), Some(p)) => Some(LeaseKey {
                bucket,
                key: format!("p.{p}"),
            }),
        };
        if stream.is_none() && (lease.is_some() || from != From::New) {
            return Err(refuse(
                "?state= and ?from= are of a stream: ?stream=NAME names it; without one, what is missed is gone",
            ));
        }
        let subject = match (subject.contains("{p}"), partition) {
            (true, None) => return Err(refuse("{p} in the subject needs ?p=")),
            (_, Some(p)) => subject.replace("{p}", &p.to_string()),
            (false, None) => subject.to_owned(),
        };
        check(&subject, way).map_err(refuse)?;
        let of_many = subject.contains(['*', '>']);
        let id =
            query.id(of_many.then_some("?id= names one sensor, and the subject may be of many"))?;
        let mut name = format!("nats://{place}/{subject}");
        query.show(&["stream", "id", "state", "p"], &mut name);
        Ok(NatsAddress {
            place,
            subject,
            login,
            ca_file: query.of("ca-file")?.map(PathBuf::from),
            stream,
            from,
            id,
            lease,
            name,
        })
    }

    /// The subject of this sensor: of its name, what no token can hold is written `%XX`.
    #[must_use]
    pub fn subject_of(&self, id: &str) -> String {
        let token = encoded(id, b"").replace('.', "%2E");
        self.subject.replace("{id}", &token)
    }
}

fn is_name(text: &str) -> bool {
    text.bytes()
        .all(|b| b.is_ascii_alphanumeric() || b"-_".contains(&b))
}

/// Whether a server takes this subject.
fn check(subject: &str, way: Way) -> std::result::Result<(), &'static str> {
    if subject.is_empty() {
        return Err("a subject is needed behind the server");
    }
    let mut tokens = subject.split('.').peekable();
    while let Some(token) = tokens.next() {
        if token.is_empty() || token.chars().any(|c| c.is_whitespace() || c.is_control()) {
            return Err("the subject has a token that is empty or holds a blank");
        }
        match (way, token) {
            (Way::In, "*") => {}
            (Way::In, ">") if tokens.peek().is_none() => {}
            _ if token.contains(['*', '>']) => {
                return Err("a wildcard is a whole token of what is subscribed to, and > the last");
            }
            _ => {}
        }
    }
    if way == Way::Out && !subject.split('.').any(|token| token == "{id}") {
        return Err("{id} is to be one token of the subject, so that each sensor has its own");
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_server_and_its_subject_are_read_with_what_belongs_to_them() {
        let plain = NatsAddress::source("nats://broker/imu.*").unwrap();
        assert_eq!(plain.name, "nats://broker:4222/imu.*");
        assert_eq!((plain.from, plain.stream), (From::New, None));
        let whole =
            NatsAddress::source("nats://[::1]:7/imu.{p}.>?stream=IMU&from=12&state=STRAPD&p=3")
                .unwrap();
        assert_eq!(whole.subject, "imu.3.>");
        assert_eq!(whole.from, From::Sequence(12));
        assert_eq!(whole.lease.unwrap().key, "p.3");
        assert_eq!(
            whole.name,
            "nats://[::1]:7/imu.3.>?stream=IMU&state=STRAPD&p=3"
        );
        let out = NatsAddress::output("nats://:4222/att.{id}").unwrap();
        assert_eq!(out.subject_of("imu0"), "att.imu0");
        assert_eq!(out.subject_of("a.b *>\u{7}"), "att.a%2Eb%20%2A%3E%07");
    }

    #[test]
    fn what_no_server_could_take_is_refused_with_what_is_known() {
        for (text, part) in [
            ("nats://h", "a subject is needed"),
            ("nats://h/", "a subject is needed"),
            ("nats://h/a..b", "empty"),
            ("nats://h/a b", "blank"),
            ("nats://h/a.>.b", "wildcard"),
            ("nats://h/a*", "wildcard"),
            ("nats://user:secret@h/a", "no user or password"),
            ("nats://h/a?x=1", "no ?x="),
            ("nats://h/a?id=b&id=c", "twice"),
            ("nats://h/a.*?id=b", "many"),
            ("nats://h/a?from=all", "?stream="),
            ("nats://h/a?stream=S&state=B", "?p="),
            ("nats://h/a.{p}", "needs ?p="),
            ("nats://h/a?stream=S&state=B&p=x", "partition"),
            ("nats://h/a?stream=a.b", "letters"),
            ("nats://h/a?user=u", "?password-file="),
            ("nats://h:0x/a", "no port"),
        ] {
            let said = NatsAddress::source(text).unwrap_err().to_string();
            assert!(
                said.contains(part) && said.contains("nats://HOST"),
                "{text}: {said}"
            );
            assert!(!said.contains("secret"), "{said}");
        }
        for (text, part) in [
            ("nats://h/att", "{id}"),
            ("nats://h/att.x{id}", "{id}"),
            ("nats://h/att.{id}.*", "wildcard"),
            ("nats://h/att.{id}?from=all", "no ?from="),
        ] {
            let said = NatsAddress::output(text).unwrap_err().to_string();
            assert!(said.contains(part), "{text}: {said}");
        }
    }
}
