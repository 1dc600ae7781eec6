//! The truth a simulation sends -> whoever watches, as a stream of its own. Pure but for locks.
//!
//! It touches no estimate: it is passed on as it came, for who holds the sensors against it.

use super::{Client, Hub, lock, read};
use crate::serve::core::channel::{Channel, Items};
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::wire::{self, Reference};
use std::sync::Arc;
use strapd_recording::text::printable;

/// The truth there is.
#[derive(Debug)]
pub(super) struct Truth {
    channel: Arc<Channel>,
    /// Number of the next.
    next: u64,
    /// The client that sends it.
    owner: Option<u64>,
}

impl Hub {
    /// Passes on what truly was, of each `id` of one client at a time.
    ///
    /// # Errors
    /// `id_in_use`: another client sends it, or a sensor is called so; `bad_reference`: of other axes than before;
    /// `too_many_sensors`: there are as many as there may be sensors.
    pub fn refer(&self, client: u64, found: &Reference, text: &mut Vec<u8>) -> Result<(), Fault> {
        let id = &found.id;
        let refuse = |code: &'static str, why: String| {
            Err(Fault::new(code, format!("`{}` {why}", printable(id))))
        };
        if read(&self.sensors.by_id).contains_key(id.as_str()) {
            let why = "is a sensor here: its attitude is estimated, and no reference";
            return refuse("id_in_use", why.to_owned());
        }
        let mut truths = lock(&self.simulation.truths);
        if truths.len() >= self.limits.sensors && !truths.contains_key(id) {
            let why = format!("is one truth more than the {} that may be", truths.len());
            return refuse("too_many_sensors", why);
        }
        let truth = truths.entry(id.clone()).or_insert_with(|| Truth {
            channel: self.declare(&wire::reference_stream(found)),
            next: 0,
            owner: None,
        });
        if truth.owner.is_some_and(|owner| owner != client) {
            return refuse("id_in_use", "is sent by another client".to_owned());
        }
        truth.owner = Some(client);
        let stream = truth.channel.stream();
        if stream.world_axes != found.world.to_string() || stream.body_axes != found.body {
            let (body, world) = (&stream.body_axes, &stream.world_axes);
            let why = format!("is of {body} in {world} here, until the daemon is started again");
            return refuse("bad_reference", why);
        }
        let first = truth.next;
        truth.next += 1;
        self.distribute(
            &truth.channel,
            first,
            Items::Attitudes(&[found.sample]),
            text,
        );
        Ok(())
    }

    /// Lets others send the truths that this client has sent.
    pub(super) fn give_truth_back(&self, client: &Client) {
        for truth in lock(&self.simulation.truths).values_mut() {
            truth.owner = truth.owner.filter(|owner| *owner != client.number);
        }
    }
}
