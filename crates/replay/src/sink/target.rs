//! The word after `-o` -> where the attitude goes, in which format. Pure.

use super::datagram::{Protocol, Recipient};
use super::format::Format;
use super::json::Profile;
use crate::address::Address;
use crate::error::{Error, Result};
use crate::sink::address::Listen;
use crate::sink::upload;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::{LISTEN, TOKEN_FILE};
use strapd_recording::remote_object::SCHEMES;

/// Target of the output.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Target {
    /// A file; the format follows its extension.
    File {
        /// Path of the file.
        path: PathBuf,
        /// Format of its contents.
        format: Format,
    },
    /// An object in a store; the format follows its extension.
    Store {
        /// Address.
        address: Address,
        /// Format of its contents.
        format: Format,
    },
    /// NDJSON on standard output. The reader hanging up ends it quietly.
    Stdout,
    /// Counted and discarded.
    Null,
    /// Whoever connects.
    Listen(Listen),
    /// NDJSON to somebody who listens at `HOST:PORT`. One who reads slowly slows the run down.
    Tcp(String),
    /// One object a datagram to `HOST:PORT`, whether or not somebody listens.
    Udp {
        /// HOST:PORT of the receiver.
        address: String,
        /// Form of the objects.
        profile: Profile,
    },
    /// Datagrams of a protocol that another program speaks, whether or not it listens.
    Protocol(Recipient),
}

/// The list every message about an unknown sink ends with.
fn known() -> String {
    let files = Format::files();
    format!(
        "known sinks: {files}, s3://BUCKET/KEY, gs://BUCKET/KEY, az://CONTAINER/KEY with such an ending (with the feature object-store), - (NDJSON on standard output), null: (discard), tcp-listen://HOST:PORT, unix-listen:///PATH, ws-listen://HOST:PORT (whoever connects), tcp://HOST:PORT, udp://HOST:PORT[?profile=plotjuggler] (somebody who listens), {}",
        Protocol::addresses()
    )
}

impl Target {
    /// Reads what the user wrote after `-o`.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the known sinks.
    pub fn parse(text: &str) -> Result<Target> {
        match text {
            "-" => return Ok(Target::Stdout),
            "null:" => return Ok(Target::Null),
            "" => {
                return Err(Error::usage(
                    Diagnostic::new("-o: the name is empty").help(known()),
                ));
            }
            _ => {}
        }
        match text.split_once("://") {
            Some((scheme, rest)) => Target::socket(text, &scheme.to_ascii_lowercase(), rest),
            None => Target::from_path(Path::new(text)),
        }
    }

    fn socket(text: &str, scheme: &str, rest: &str) -> Result<Target> {
        let refuse = |what: &str| {
            let shown = Address::from(text);
            Err(Error::usage(
                Diagnostic::new(format!("-o {shown}: {what}")).help(known()),
            ))
        };
        let (address, query) = match rest.split_once('?') {
            Some((address, query)) => (address, Some(query)),
            None => (rest, None),
        };
        let address = address.strip_suffix('/').unwrap_or(address);
        let is_complete = address.rsplit_once(':').is_some_and(|(host, port)| {
            !host.is_empty() && port.parse::<u16>().is_ok_and(|p| p > 0)
        });
        let recipient = Recipient::parse(scheme, address, query);
        let is_sent_to = matches!(scheme, "tcp" | "udp") || recipient.is_some();
        match (scheme, query) {
            ("tcp-listen" | "unix-listen" | "ws-listen", None) => {
                Listen::parse_from("-o", text).map(Target::Listen)
            }
            ("tcp-listen" | "unix-listen" | "ws-listen" | "tcp", Some(_)) => {
                refuse("nothing follows the address; a profile is for udp://")
            }
            ("udp-listen", _) => refuse(&format!(
                "takes samples in (strapd serve {LISTEN}); udp://HOST:PORT sends"
            )),
            (_, _) if is_sent_to && address.contains('@') => refuse(&format!(
                "no user or password goes into an address; strapd serve {TOKEN_FILE} shows a token"
            )),
            (_, _) if is_sent_to && !is_complete => refuse("HOST:PORT is needed"),
            ("tcp", None) => Ok(Target::Tcp(address.to_owned())),
            ("udp", query) => {
                let profile = match query {
                    None => Profile::Lines,
                    Some("profile=plotjuggler") => Profile::PlotJuggler,
                    Some(_) => return refuse("the only thing after ? is profile=plotjuggler"),
                };
                let address = address.to_owned();
                Ok(Target::Udp { address, profile })
            }
            (scheme, _) if upload::SCHEMES.contains(&scheme) => Target::store(text, rest),
            _ if SCHEMES.contains(&scheme) => refuse(
                "web servers are read, not written to: none says whether what came is whole. Write a file, and bring it there (curl -T FILE ADDRESS), or an object of a store (s3://, gs://, az://)",
            ),
            _ => match recipient {
                Some(Ok(recipient)) => Ok(Target::Protocol(recipient)),
                Some(Err(why)) => refuse(&why),
                None => refuse(&format!("unknown scheme `{scheme}`")),
            },
        }
    }

    /// An object in a store.
    fn store(text: &str, rest: &str) -> Result<Target> {
        let address = Address::from(text);
        let refuse = |what: &str, help: &str| {
            let said = Diagnostic::new(format!("-o {address}: {what}"));
            Err(Error::usage(said.help(help.to_owned())))
        };
        if !upload::is_possible() {
            return refuse(
                "addresses are written by a build with the feature object-store",
                "build it with that feature; or write a file, and bring it there (aws s3 cp, gcloud storage cp, azcopy)",
            );
        }
        let key = rest.split_once('/').map_or("", |(_, key)| key);
        if key.is_empty() || rest.contains(['?', '#', '*']) || address.names_a_user() {
            return refuse(
                "is no address of an object",
                "s3://BUCKET/KEY.mcap, without a query or a user",
            );
        }
        let format = match Target::from_path(Path::new(key)) {
            Ok(target) => target.format(),
            Err(Error::Usage(_)) => None,
            Err(other) => return Err(other),
        };
        match format {
            Some(format) => Ok(Target::Store { address, format }),
            None => refuse(
                "the ending of its key is no format that is written",
                &known(),
            ),
        }
    }

    /// Address on which it listens, if it does.
    #[must_use]
    pub fn listens(&self) -> Option<&Listen> {
        match self {
            Target::Listen(listen) => Some(listen),
            _ => None,
        }
    }

    /// A file whose extension, in any case, names the format.
    ///
    /// # Errors
    /// [`Error::Usage`] when the extension is missing or unknown.
    pub fn from_path(path: &Path) -> Result<Target> {
        let refuse = |what: String, help: String| {
            let what = format!("-o {}: {what}", path.display());
            Err(Error::usage(Diagnostic::new(what).help(help)))
        };
        let Some(ending) = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase())
        else {
            let what = "no extension, so the format is unknown".to_owned();
            return refuse(what, known());
        };
        let Some(format) = Format::of_ending(&ending) else {
            let files = format!("files: {}", Format::files());
            let help = match Format::like(&ending) {
                Some(like) => format!("-o {}? {files}", path.with_extension(like).display()),
                None => files,
            };
            return refuse(format!("unknown extension `.{ending}`"), help);
        };
        if let Some(feature) = format.missing() {
            let (instead, readers) = feature.instead;
            return refuse(
                format!("this strapd was built without the feature {}", feature.name),
                format!(
                    "build it with that feature, or write -o {}, which {readers} read",
                    path.with_extension(instead).display()
                ),
            );
        }
        Ok(Target::File {
            path: path.to_path_buf(),
            format,
        })
    }

    /// Format of its contents; `None` for [`Target::Null`] and for what listens: that is not a
    /// [`Sink`](super::Sink).
    #[must_use]
    pub fn format(&self) -> Option<Format> {
        match self {
            Target::File { format, .. } | Target::Store { format, .. } => Some(*format),
            Target::Stdout | Target::Tcp(_) | Target::Udp { .. } | Target::Protocol(_) => {
                Some(Format::Ndjson)
            }
            Target::Null | Target::Listen(_) => None,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_in_any_case_names_the_format() {
        for (text, format) in [
            ("a.mcap", Format::Mcap),
            ("dir.csv/a.MCAP", Format::Mcap),
            ("a.ndjson", Format::Ndjson),
            ("a.b.jsonl", Format::Ndjson),
            ("./x/a.CSV", Format::Csv),
            ("run.tum", Format::Tum),
        ] {
            let target = Target::parse(text).unwrap();
            assert_eq!(target.format(), Some(format), "{text}");
        }
        assert_eq!(Target::parse("-").unwrap(), Target::Stdout);
        assert_eq!(Target::parse("null:").unwrap(), Target::Null);
    }

    #[test]
    fn what_is_not_a_sink_is_refused_with_the_list_of_those_that_are() {
        for text in ["", "out", "out.bag", "http://h/x.mcap", ".mcap", "x.mcap/"] {
            match Target::parse(text) {
                Err(Error::Usage(message)) => {
                    let help = message.helping().unwrap_or_default();
                    // Who wrote an ending wants a file.
                    let begins = if text == "out.bag" {
                        "files: "
                    } else {
                        "known sinks: "
                    };
                    assert!(help.starts_with(&format!("{begins}FILE.mcap")), "{message}");
                }
                // Path::extension reads `x.mcap/` as `x.mcap`: a file name with a slash is the
                // opener's business.
                other => assert_eq!(text, "x.mcap/", "{other:?}"),
            }
        }
    }

    #[test]
    fn an_ending_that_is_nearly_one_is_answered_with_it() {
        for (text, like) in [
            ("x.json", "x.jsonl? "),
            ("a.b.JSON", "a.b.jsonl? "),
            ("x.csvx", "x.csv? "),
        ] {
            let said = Target::parse(text).unwrap_err().to_string();
            assert!(said.contains(&format!("-o {like}")), "{said}");
            assert!(said.len() < 400, "{said}");
        }
    }

    #[test]
    fn without_a_way_to_stores_the_feature_is_named() {
        let said = Target::parse("s3://b/x.mcap").unwrap_err().to_string();
        for words in ["-o s3://b/x.mcap", "feature object-store", "aws s3 cp"] {
            assert!(said.contains(words), "{said}");
        }
    }

    #[test]
    fn a_socket_is_listened_on_or_written_to() {
        for text in [
            "tcp-listen://127.0.0.1:0",
            "ws-listen://[::1]:9",
            "unix-listen:///x",
        ] {
            let target = Target::parse(text).unwrap();
            assert_eq!(target.listens().unwrap().to_string(), text);
        }
        assert_eq!(
            Target::parse("tcp://host:1").unwrap(),
            Target::Tcp("host:1".to_owned())
        );
        for (text, profile) in [
            ("udp://host:1", Profile::Lines),
            ("udp://host:1?profile=plotjuggler", Profile::PlotJuggler),
        ] {
            let address = "host:1".to_owned();
            assert_eq!(
                Target::parse(text).unwrap(),
                Target::Udp { address, profile }
            );
        }
        for text in [
            "tcp://host",
            "tcp://:1",
            "udp://host:0",
            "udp://host:1?profile=rerun",
            "tcp://host:1?profile=plotjuggler",
            "udp-listen://127.0.0.1:1",
            "ws://host:1",
            "unix-listen://relative",
            "https://h/x.mcap",
        ] {
            let said = Target::parse(text).unwrap_err().to_string();
            let shown = Address::from(text);
            assert!(
                said.contains(&shown.to_string()) && said.contains("help: known"),
                "{said}"
            );
        }
    }
}
