//! An outbox -> messages, each sensor under its own key. I/O.

use super::address::ZenohAddress;
use super::connection::{connect, end, lost};
use super::ros::{self, Attachment, Gid};
use crate::serve::brokers::{TAKE, gathered, warn};
use crate::serve::core::context::Context;
use crate::serve::core::hub::{Client, ClientProtocol, Hub, count};
use crate::serve::core::read_buffer::now;
use crate::serve::guard::redial::Redial;
use crate::serve::guard::shutdown::Running;
use crate::serve::protocol::chunk::Chunk;
use crate::serve::protocol::filter::Filter;
use ::zenoh::liveliness::LivelinessToken;
use ::zenoh::pubsub::Publisher;
use ::zenoh::qos::CongestionControl;
use ::zenoh::{Session, Wait};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;
use tokio::pin;
use tokio::task::block_in_place;
use tokio::time::sleep;

/// Sensors whose publishers are kept; beyond, all are declared anew.
const MOST: usize = 10_000;
/// Time that the last message gets to leave before the connection is ended.
const LAST: Duration = Duration::from_millis(100);

/// Publishes every attitude until the daemon ends.
pub(in crate::serve) async fn send(address: ZenohAddress, context: Context) {
    let Context {
        hub, mut running, ..
    } = context;
    let shape = match address.is_ros {
        true => ClientProtocol::Messages,
        false => ClientProtocol::Lines(Default::default()),
    };
    let watcher = hub.join_as(address.name.clone(), shape);
    hub.watch(&watcher, Some(Filter::default()));
    let mut redial = Redial::default();
    loop {
        let connected = tokio::select! {
            connected = connect(&address) => connected,
            () = running.asked() => break,
        };
        let why = match connected {
            Ok(link) => {
                redial = Redial::default();
                let ended = publish(&address, &link, &hub, &watcher, &mut running).await;
                end(link).await;
                match ended {
                    Ok(()) => break,
                    Err(why) => why,
                }
            }
            Err(why) => why,
        };
        warn(&address.name, &why);
        tokio::select! {
            () = sleep(redial.failed()) => {}
            () = running.asked() => break,
        }
    }
    hub.leave(&watcher, &[]);
}

/// Publishes until the daemon ends.
///
/// # Errors
/// Why no more can be published over this connection.
async fn publish(
    address: &ZenohAddress,
    link: &Session,
    hub: &Hub,
    watcher: &Client,
    running: &mut Running,
) -> Result<(), String> {
    let mut topics = Topics {
        address,
        link,
        name: link.zid().to_string(),
        node: None,
        known: HashMap::new(),
        keys: HashMap::new(),
        declared: 0,
    };
    let (mut asked, mut chunks) = (None, Vec::new());
    let lost = lost(link, address.scouts);
    pin!(lost);
    loop {
        let bytes = watcher.outbox.take_chunks(TAKE, &mut chunks);
        if chunks.is_empty() {
            if asked == Some(true) {
                sleep(LAST).await;
                return Ok(());
            }
            tokio::select! {
                () = &mut lost => return Err("the connection was lost".to_owned()),
                () = watcher.outbox.filled() => {}
                () = running.asked_further(asked.is_some()) => {
                    asked = Some(asked.is_some());
                    running.has_read();
                }
            }
            continue;
        }
        let chunks = std::mem::take(&mut chunks);
        // A router that takes nothing holds this thread up, for some seconds at most; then zenoh gives the
        // connection up.
        let put = block_in_place(|| topics.put(chunks));
        watcher.outbox.written(bytes);
        count(&hub.counters.bytes_out, put?);
    }
}

/// Topics published over one connection.
struct Topics<'a> {
    address: &'a ZenohAddress,
    link: &'a Session,
    /// The connection's.
    name: String,
    /// Says that our node is there.
    node: Option<LivelinessToken>,
    known: HashMap<Arc<str>, Option<Topic>>,
    /// Sensors by key.
    keys: HashMap<String, Arc<str>>,
    declared: u32,
}

/// The attitudes of one sensor.
struct Topic {
    publisher: Publisher<'static>,
    gid: Gid,
    /// Says that we publish them.
    _token: Option<LivelinessToken>,
}

impl Topics<'_> {
    /// Publishes them. Says how many bytes.
    fn put(&mut self, chunks: Vec<Chunk>) -> Result<usize, String> {
        let mut put = 0;
        if self.address.is_ros {
            for chunk in chunks {
                // As many as there were are missing where an outbox has lost some.
                let sequence = i64::try_from(chunk.first_seq).unwrap_or(i64::MAX);
                let Some(topic) = self.topic(&chunk.id)? else {
                    continue;
                };
                let attachment = Attachment {
                    sequence: sequence.saturating_add(1),
                    sent: now(),
                    gid: topic.gid,
                };
                put += chunk.bytes.len();
                let message = topic.publisher.put(chunk.bytes);
                let message = message.attachment(attachment.to_bytes().as_slice());
                message.wait().map_err(|why| why.to_string())?;
            }
        } else {
            for (id, bytes) in gathered(chunks) {
                let Some(topic) = self.topic(&id)? else {
                    continue;
                };
                put += bytes.len();
                topic
                    .publisher
                    .put(bytes)
                    .wait()
                    .map_err(|why| why.to_string())?;
            }
        }
        Ok(put)
    }

    /// `None`: another sensor has its key.
    fn topic(&mut self, id: &Arc<str>) -> Result<Option<&Topic>, String> {
        if !self.known.contains_key(id) {
            if self.known.len() >= MOST {
                self.known.clear();
                self.keys.clear();
            }
            let topic = self.declare(id).map_err(|why| why.to_string())?;
            self.known.insert(id.clone(), topic);
        }
        Ok(self.known.get(id).and_then(Option::as_ref))
    }

    fn declare(&mut self, id: &Arc<str>) -> zenoh::Result<Option<Topic>> {
        let key = self.address.key_of(id);
        let owner = self.keys.entry(key.clone()).or_insert_with(|| id.clone());
        if owner != id {
            warn(
                &self.address.name,
                &format!(
                    "the attitudes of {id} would go to {key}, as those of {owner} do: they are left out"
                ),
            );
            return Ok(None);
        }
        self.declared = self.declared.saturating_add(1);
        let number = self.declared;
        let is_ros = self.address.is_ros;
        if is_ros && self.node.is_none() {
            let domain = key.split('/').next().unwrap_or_default();
            let token = ros::node_token(domain, &self.name);
            self.node = Some(self.link.liveliness().declare_token(token).wait()?);
        }
        let token = match is_ros {
            false => None,
            true => {
                let token = ros::publisher_token(&key, &self.name, number);
                Some(self.link.liveliness().declare_token(token).wait()?)
            }
        };
        let key = match is_ros {
            true => ros::key_of(&key),
            false => key,
        };
        let publisher = self
            .link
            .declare_publisher(key)
            .congestion_control(CongestionControl::Block);
        Ok(Some(Topic {
            publisher: publisher.wait()?,
            gid: ros::gid(&self.name, number),
            _token: token,
        }))
    }
}
