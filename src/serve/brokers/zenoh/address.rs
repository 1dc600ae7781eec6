//! `zenoh://tcp/HOST:PORT/KEY?...` -> an endpoint, what is read or written there, and how. Pure but for
//! reading secrets from files.

use super::ros;
use crate::client::remote::{Place, encoded};
use crate::client::secret::Secret;
use crate::error::Result;
use crate::serve::brokers::query::{Query, Refusal};
use ::zenoh::key_expr::keyexpr;
use std::path::PathBuf;

/// The port of a router where none is written.
const PORT: u16 = 7447;
/// Highest domain of ROS.
const MAX_DOMAIN: u32 = 232;
const KNOWN_IN: &str = "zenoh://tcp/HOST:PORT/KEY (tcp or tls; imu/*, whose last part names the sensor) with ?rmw (a ROS 2 robot: 0/** is all of domain 0), ?id=NAME, ?scout, ?user=NAME&password-file=FILE, ?ca-file=FILE";
const KNOWN_OUT: &str = "zenoh://tcp/HOST:PORT/KEY (tcp or tls; att/{id}) with ?rmw (to ROS 2: 0/{id}/attitude), ?scout, ?user=NAME&password-file=FILE, ?ca-file=FILE";

/// A key of a router, and how to get to it.
#[derive(Clone, Debug)]
pub struct ZenohAddress {
    /// `tcp` or `tls`.
    pub protocol: &'static str,
    /// The router.
    pub place: Place,
    /// Key to subscribe to, wildcards and all; or to publish to, with `{id}` in it.
    pub key: String,
    /// Messages are those of ROS 2.
    pub is_ros: bool,
    /// Others are looked for, and spoken with, too.
    pub scouts: bool,
    /// Login.
    pub login: Option<(String, Secret)>,
    /// Path of the certificates that are believed.
    pub ca_file: Option<PathBuf>,
    /// Id of the one sensor here, whatever its key.
    pub id: Option<String>,
    /// The address, for people.
    pub name: String,
}

/// Direction of samples or attitudes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    In,
    Out,
}

impl ZenohAddress {
    /// Reads an address from which samples come.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::error::Error::Usage) with what is known; a file of a secret cannot be read.
    pub fn source(text: &str) -> Result<ZenohAddress> {
        ZenohAddress::parse(text, Way::In)
    }

    /// Reads an address to which attitudes go.
    ///
    /// # Errors
    /// As [`ZenohAddress::source`].
    pub fn output(text: &str) -> Result<ZenohAddress> {
        ZenohAddress::parse(text, Way::Out)
    }

    fn parse(text: &str, way: Way) -> Result<ZenohAddress> {
        let (before, known) = match way {
            Way::In => ("serve", KNOWN_IN),
            Way::Out => ("-o", KNOWN_OUT),
        };
        let refusal = Refusal {
            before,
            text,
            known,
        };
        let mut ours = vec!["rmw", "scout", "user", "password-file", "ca-file"];
        ours.extend((way == Way::In).then_some("id"));
        let (rest, query) = Query::split(refusal, "zenoh://", &ours)?;
        let mut parts = rest.splitn(3, '/');
        let protocol = match parts.next() {
            Some("tcp") => "tcp",
            Some("tls") => "tls",
            _ => return Err(refusal.say("tcp/ or tls/ is to stand before the host")),
        };
        let authority = parts.next().unwrap_or_default();
        let place = refusal.place(authority, PORT)?;
        let key = parts.next().unwrap_or_default();
        let is_ros = query.has("rmw")?;
        check(key, way, is_ros).map_err(|what| refusal.say(&what))?;
        let ca_file = query.of("ca-file")?.map(PathBuf::from);
        if ca_file.is_some() && protocol == "tcp" {
            return Err(refusal.say("?ca-file= is of tls/, and this is tcp/"));
        }
        if let Some(path) = &ca_file {
            // What zenoh would not say.
            std::fs::File::open(path).map_err(|source| strapd_recording::Error::Open {
                path: path.clone(),
                source,
            })?;
        }
        let of_many = key.contains('*') || (way == Way::In && is_ros && key == "**");
        let id = query.id(of_many.then_some("?id= names one sensor, and the key may be of many"))?;
        let mut name = format!("zenoh://{protocol}/{place}/{key}");
        query.show(&["rmw", "scout", "id"], &mut name);
        Ok(ZenohAddress {
            protocol,
            key: match (way, is_ros) {
                (Way::In, true) => ros::subscription(key),
                _ => key.to_owned(),
            },
            is_ros,
            scouts: query.has("scout")?,
            login: query.user()?,
            ca_file,
            id,
            name,
            place,
        })
    }

    /// The key of this sensor's attitudes.
    #[must_use]
    pub fn key_of(&self, id: &str) -> String {
        let part = match self.is_ros {
            true => ros::topic_of(id),
            false => encoded(id, b""),
        };
        self.key.replace("{id}", &part)
    }
}

/// Whether a router takes this key.
fn check(key: &str, way: Way, is_ros: bool) -> std::result::Result<(), String> {
    if key.is_empty() {
        return Err("a key is needed behind the router".to_owned());
    }
    let filled = key.replace("{id}", "id");
    keyexpr::new(filled.as_str()).map_err(|_| {
        "no key: parts between single /, without # ? and $; * is a whole part, and ** any number of them"
            .to_owned()
    })?;
    if way == Way::Out {
        if key.contains('*') {
            return Err("a wildcard can be subscribed to and not published".to_owned());
        }
        if !key.split('/').any(|part| part == "{id}") {
            return Err(
                "{id} is to be one part of the key, so that each sensor has its own".to_owned(),
            );
        }
    } else if key.contains("{id}") {
        return Err("{id} is of outputs".to_owned());
    }
    if is_ros {
        let (domain, topic) = key.split_once('/').unwrap_or((key, ""));
        let number = domain.parse::<u32>().ok().filter(|d| *d <= MAX_DOMAIN);
        if number.is_none() && !(way == Way::In && domain == "*") {
            return Err(format!(
                "with ?rmw the key begins with the domain, 0 to {MAX_DOMAIN}: 0/**"
            ));
        }
        if topic.is_empty() {
            return Err("with ?rmw the topic follows the domain: 0/imu/data, 0/**".to_owned());
        }
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_router_and_its_key_are_read_with_what_belongs_to_them() {
        let own = ZenohAddress::source("zenoh://tcp/router/imu/*").unwrap();
        assert_eq!(own.name, "zenoh://tcp/router:7447/imu/*");
        assert_eq!(
            (own.key.as_str(), own.is_ros, own.scouts),
            ("imu/*", false, false)
        );
        let ros = ZenohAddress::source("zenoh://tls/[::1]:7/0/**?rmw&scout").unwrap();
        assert_eq!(ros.key, "0/**/sensor_msgs::msg::dds_::Imu_/*");
        assert_eq!(ros.name, "zenoh://tls/[::1]:7/0/**?rmw&scout");
        assert!(ros.scouts && ros.protocol == "tls");
        let one = ZenohAddress::source("zenoh://tcp/h/7/imu/data?rmw&id=left").unwrap();
        assert_eq!(one.key, "7/imu/data/sensor_msgs::msg::dds_::Imu_/*");
        assert_eq!(one.id.as_deref(), Some("left"));
        let out = ZenohAddress::output("zenoh://tcp/h/0/{id}/attitude?rmw").unwrap();
        assert_eq!(out.key_of("/imu/data"), "0/imu/data/attitude");
        let out = ZenohAddress::output("zenoh://tcp/h/att/{id}").unwrap();
        assert_eq!(out.key_of("a*/b"), "att/a%2A%2Fb");
    }

    #[test]
    fn what_no_router_could_take_is_refused_with_what_is_known() {
        for (text, part) in [
            ("zenoh://h/a", "tcp/ or tls/"),
            ("zenoh://udp/h/a", "tcp/ or tls/"),
            ("zenoh://tcp/h", "a key is needed"),
            ("zenoh://tcp/h/", "a key is needed"),
            ("zenoh://tcp/h/a//b", "no key"),
            ("zenoh://tcp/h/a*", "no key"),
            ("zenoh://tcp/h/a#b", "no key"),
            ("zenoh://tcp/user:secret@h/a", "no user or password"),
            ("zenoh://tcp/h/a?x=1", "no ?x="),
            ("zenoh://tcp/h/a?rmw=1", "no value"),
            ("zenoh://tcp/h/a?rmw", "begins with the domain"),
            ("zenoh://tcp/h/**?rmw", "begins with the domain"),
            ("zenoh://tcp/h/0?rmw", "the topic follows"),
            ("zenoh://tcp/h/233/a?rmw", "0 to 232"),
            ("zenoh://tcp/h/a/*?id=b", "many"),
            ("zenoh://tcp/h/a?id=b&id=c", "twice"),
            ("zenoh://tcp/h/a?user=u", "?password-file="),
            ("zenoh://tcp/h/a?ca-file=f", "tls/"),
            ("zenoh://tcp/h/{id}", "of outputs"),
            ("zenoh://tcp/h:0x/a", "no port"),
        ] {
            let said = ZenohAddress::source(text).unwrap_err().to_string();
            assert!(
                said.contains(part) && said.contains("zenoh://tcp/HOST"),
                "{text}: {said}"
            );
            assert!(!said.contains("secret"), "{said}");
        }
        for (text, part) in [
            ("zenoh://tcp/h/att", "{id}"),
            ("zenoh://tcp/h/att.{id}", "{id}"),
            ("zenoh://tcp/h/*/{id}", "wildcard"),
            ("zenoh://tcp/h/*/{id}?rmw", "wildcard"),
            ("zenoh://tcp/h/{id}?rmw", "begins with the domain"),
            ("zenoh://tcp/h/att/{id}?id=a", "no ?id="),
        ] {
            let said = ZenohAddress::output(text).unwrap_err().to_string();
            assert!(said.contains(part), "{text}: {said}");
        }
    }
}
