//! The truth a simulation sends -> whoever watches, as a stream of its own. Pure but for locks.
//!
//! It touches no estimate: it is passed on as it came, for who holds the sensors against it.

use super::{Client, Hub, lock, read};
use crate::serve::core::channel::{Channel, Items};
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::wire::{self, Reference, TRUTH};
use std::sync::Arc;

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
    /// Passes on what truly was, of one client at a time.
    ///
    /// # Errors
    /// `id_in_use`: another client sends it, or a sensor is called so; `bad_reference`: of other axes than before.
    pub fn refer(&self, client: u64, found: &Reference, text: &mut Vec<u8>) -> Result<(), Fault> {
        if read(&self.sensors.by_id).contains_key(TRUTH) {
            return Err(Fault::new(
                "id_in_use",
                "a sensor is called `truth`: its attitude is estimated, and no reference",
            ));
        }
        let mut truth = lock(&self.simulation.truth);
        let truth = truth.get_or_insert_with(|| Truth {
            channel: self.declare(&wire::reference_stream(found.world, found.body)),
            next: 0,
            owner: None,
        });
        if truth.owner.is_some_and(|owner| owner != client) {
            return Err(Fault::new("id_in_use", "another client sends `truth`"));
        }
        truth.owner = Some(client);
        let stream = truth.channel.stream();
        if stream.world_axes != found.world.to_string() || stream.body_axes != found.body {
            return Err(Fault::new(
                "bad_reference",
                format!(
                    "`truth` is of {} in {} here, until the daemon is started again",
                    stream.body_axes, stream.world_axes
                ),
            ));
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

    /// Lets others send the truth that this client has sent.
    pub(super) fn give_truth_back(&self, client: &Client) {
        if let Some(truth) = &mut *lock(&self.simulation.truth)
            && truth.owner == Some(client.number)
        {
            truth.owner = None;
        }
    }
}
