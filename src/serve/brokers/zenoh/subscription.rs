//! Messages of keys -> a session. I/O.
//!
//! Of a robot (`?rmw`) the topic names its sensor, and its messages are read as those of a recording are;
//! elsewhere the last part of a message's key does, unless its lines do.

use super::address::ZenohAddress;
use super::connection::{connect, end, lost};
use super::rings::{KeyBatch, Message, Rings};
use super::robot::{Read, Robots};
use super::ros::{self, Key, Token};
use crate::serve::brokers::{self, MAX_PAYLOAD};
use crate::serve::core::hub::{Flood, Hub, count};
use crate::serve::core::outgoing::{Outgoing, TopicSeen};
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::{Session, Side};
use crate::serve::guard::log_throttle;
use crate::serve::guard::redial::Redial;
use crate::serve::guard::shutdown::Running;
use ::zenoh::key_expr::KeyExpr;
use ::zenoh::sample::{Sample, SampleKind};
use std::sync::Arc;
use std::time::{Duration, Instant};
use strapd_recording::decode::exact_name;
use strapd_recording::text::printable;
use tokio::pin;
use tokio::task::yield_now;
use tokio::time::sleep;

/// A connection that stood so long was a good one: the waits begin anew.
const STEADY: Duration = Duration::from_secs(1);
/// Time that the watchers may take to make room: meanwhile the rings fill, and nobody waits for us.
const PATIENCE: Duration = Duration::from_millis(300);

/// Reads until the daemon ends.
pub(in crate::serve) async fn keep(
    address: ZenohAddress,
    outgoing: Arc<Outgoing>,
    hub: Arc<Hub>,
    mut running: Running,
) {
    let side = Side::broker(address.id.clone());
    let mut reader = Reader {
        session: Session::with(&hub, address.name.clone(), side),
        robots: Robots::new(hub.decode_options()),
        rings: Arc::default(),
        flood: Flood::with_patience(PATIENCE),
        address,
        outgoing,
        hub,
    };
    let mut redial = Redial::default();
    loop {
        reader.outgoing.attempt();
        let began = Instant::now();
        let Some(why) = reader.read(&mut running).await else {
            return;
        };
        if began.elapsed() >= STEADY {
            redial = Redial::default();
        }
        brokers::lost(&reader.outgoing, &why);
        reader.outgoing.forget_topics();
        tokio::select! {
            () = sleep(redial.failed()) => {}
            () = running.asked() => return,
        }
    }
}

struct Reader {
    address: ZenohAddress,
    outgoing: Arc<Outgoing>,
    hub: Arc<Hub>,
    session: Session,
    robots: Result<Robots, String>,
    rings: Arc<Rings>,
    flood: Flood,
}

impl Reader {
    /// Connects, and reads until the connection is lost. Says why; `None`: the daemon ends.
    async fn read(&mut self, running: &mut Running) -> Option<String> {
        if let Err(why) = &self.robots
            && self.address.is_ros
        {
            return Some(why.clone());
        }
        let connected = tokio::select! {
            connected = connect(&self.address) => connected,
            () = running.asked() => return None,
        };
        let link = match connected {
            Ok(link) => link,
            Err(why) => return Some(why),
        };
        let why = match self.subscribe(&link).await {
            Ok(()) => {
                self.outgoing.connected(&self.address.place.to_string());
                let name = self.outgoing.name();
                log_throttle::info(&format!("{name} connected"), &format!("{name}: connected"));
                self.read_on(&link, running).await
            }
            Err(why) => Some(format!("cannot subscribe: {why}")),
        };
        end(link).await;
        if why.is_none() {
            // What has arrived is still taken; no more does.
            while let Some(turn) = self.rings.now() {
                self.take(turn).await;
            }
        }
        why
    }

    async fn read_on(&mut self, link: &zenoh::Session, running: &mut Running) -> Option<String> {
        let lost = lost(link, self.address.scouts);
        pin!(lost);
        loop {
            let turn = tokio::select! {
                biased;
                () = running.asked() => return None,
                turn = self.rings.next() => turn,
                () = &mut lost => return Some("the connection was lost".to_owned()),
            };
            self.take(turn).await;
        }
    }

    /// Both subscriptions live as long as the connection.
    async fn subscribe(&self, link: &zenoh::Session) -> zenoh::Result<()> {
        let (rings, outgoing) = (self.rings.clone(), self.outgoing.clone());
        let take = move |sample: Sample| bring(&rings, &outgoing, &sample);
        link.declare_subscriber(self.address.key.clone())
            .callback(take)
            .background()
            .await?;
        if self.address.is_ros {
            let wanted = KeyExpr::new(self.address.key.clone())?;
            let outgoing = self.outgoing.clone();
            link.liveliness()
                .declare_subscriber(ros::tokens(&self.address.key))
                .history(true)
                .callback(move |sample| meet(&outgoing, &wanted, &sample))
                .background()
                .await?;
        }
        Ok(())
    }

    async fn take(&mut self, turn: KeyBatch) {
        if turn.lost > 0 {
            let what = format!(
                "{}: {} messages were lost, they came faster than they are taken",
                printable(&turn.key),
                turn.lost
            );
            self.outgoing.lost_messages(turn.lost, &what);
        }
        match self.address.is_ros {
            true => {
                let bytes = turn.messages.iter().map(|m| m.payload.len()).sum();
                count(&self.hub.counters.bytes_in, bytes);
                self.take_ros(&turn);
                self.say(&turn.key);
                self.leave_room().await;
            }
            false => self.take_own(&turn).await,
        }
    }

    /// Says in the log what was wrong with what a key brought.
    fn say(&mut self, key: &str) {
        if let Some(complaint) = self.session.complaints().first() {
            let what = complaint.fault.in_words();
            self.outgoing
                .complain(&format!("{}: {what}", printable(key)));
        }
    }

    /// Lines or packed objects.
    async fn take_own(&mut self, turn: &KeyBatch) {
        let part = turn.key.rsplit('/').next().unwrap_or_default();
        let name = match &self.address.id {
            Some(id) => Ok(id.clone()),
            None => exact_name(part).map_err(|why| why.to_string()),
        };
        let name = match name {
            Ok(name) => name,
            Err(why) => {
                self.session.unused(&why);
                return self.say(&turn.key);
            }
        };
        for message in &turn.messages {
            self.session.of_subject(&name);
            with_read_buffer(|_, scratch| self.session.message(&message.payload, now(), scratch));
            self.say(&turn.key);
            self.leave_room().await;
            while self.session.is_held() {
                yield_now().await;
                with_read_buffer(|_, scratch| self.session.go_on(scratch));
                self.say(&turn.key);
                self.leave_room().await;
            }
        }
    }

    /// Waits until what was made has room in the outboxes.
    async fn leave_room(&mut self) {
        self.flood.hold();
        self.flood.wait(&self.hub).await;
    }

    /// Messages of one topic of ROS.
    fn take_ros(&mut self, turn: &KeyBatch) {
        let Some(key) = Key::read(&turn.key) else {
            return self.session.unused("no key of ROS 2");
        };
        let id = match &self.address.id {
            Some(id) => id.clone(),
            None => match exact_name(&key.topic) {
                Ok(id) => id,
                Err(why) => return self.session.unused(&why.to_string()),
            },
        };
        let (session, Ok(robots)) = (&mut self.session, &mut self.robots) else {
            return;
        };
        let times = (now(), Instant::now());
        let (mut samples, mut messages) = (Vec::new(), Vec::new());
        let hand_over = |session: &mut Session, messages: &mut Vec<_>, samples: &mut Vec<_>| {
            with_read_buffer(|_, scratch| {
                session.samples(&id, messages, samples, times.0, scratch)
            });
            messages.clear();
            samples.clear();
        };
        for message in &turn.messages {
            match robots.read((&key, &id), message, times, &mut samples) {
                Read::Samples(number, wrong) => {
                    messages.push((number, samples.len()));
                    if let Some(wrong) = wrong {
                        session.complain(&wrong);
                    }
                }
                Read::Ours => {}
                Read::Undecodable(what) => {
                    hand_over(session, &mut messages, &mut samples);
                    session.unreadable(&id, &what);
                }
                Read::Others(what) => {
                    session.refused();
                    self.outgoing.complain_of("publishers", &what);
                }
            }
        }
        hand_over(session, &mut messages, &mut samples);
    }
}

/// A message has come, on a thread of zenoh's, which is not to wait.
fn bring(rings: &Rings, outgoing: &Outgoing, sample: &Sample) {
    let payload = sample.payload();
    if sample.kind() != SampleKind::Put {
        return;
    }
    let attachment = sample.attachment();
    let longest = payload.len().max(attachment.map_or(0, |a| a.len()));
    if longest > MAX_PAYLOAD {
        return outgoing.refused_message(&format!(
            "{}: a payload of {longest} bytes, at most {MAX_PAYLOAD} are read",
            printable(sample.key_expr().as_str())
        ));
    }
    // Copied: to keep it would keep the whole buffer it was received in.
    let message = Message {
        payload: payload.to_bytes().into_owned().into(),
        attachment: attachment.map(|a| a.to_bytes().into_owned().into()),
    };
    rings.push(sample.key_expr().as_str(), message);
}

/// A publisher has come or gone.
fn meet(outgoing: &Outgoing, wanted: &KeyExpr<'_>, sample: &Sample) {
    let text = sample.key_expr().as_str();
    let Some(token) = Token::read(text).filter(|token| !token.is_ours()) else {
        return;
    };
    let is_wanted = KeyExpr::new(token.key.as_str()).is_ok_and(|key| wanted.intersects(&key));
    if !is_wanted {
        return;
    }
    let is_there = sample.kind() == SampleKind::Put;
    let name = outgoing.name();
    let Token {
        domain,
        node,
        topic,
        ..
    } = token;
    let seen = TopicSeen {
        topic: topic.clone(),
        node: node.clone(),
        domain: domain.clone(),
    };
    if !outgoing.topic(text, is_there.then_some(seen)) {
        return;
    }
    let what = format!("{topic} of {node}, domain {domain}");
    let what = match is_there {
        true => format!("{name}: {what}, is there"),
        false => format!("{name}: {what}, has gone"),
    };
    match (outgoing.may_say_topic(Instant::now()), is_there) {
        (true, true) => tracing::info!("{what}"),
        (true, false) => tracing::warn!("{what}"),
        // `STATUS` lists them all.
        (false, _) => log_throttle::info(&format!("{name} topics"), &what),
    }
}
