//! Samples of a simulation that a page is shown -> what the daemon would make of them. Pure but for handing them out.
//!
//! A page of a simulation without an estimate would show the truth beside nothing.

use crate::serve::core::channel::{Channel, Items};
use crate::serve::core::hub::Hub;
use crate::serve::core::stream::{SensorStream, live_plan};
use std::sync::Arc;
use strapd_attitude::estimate::{Aid, EstimationSettings};
use strapd_attitude::record::{RawSample, SampleKind};
use strapd_recording::decode::Line;

/// The estimate of one stream of samples.
#[derive(Debug, Default)]
pub(super) struct Estimated {
    /// Channel as clients know it, over all runs.
    channel: Option<Arc<Channel>>,
    run: Option<(EstimationSettings, SensorStream)>,
    /// Whether it failed: logged once, and not tried again.
    failed: bool,
}

impl Estimated {
    /// The run begins anew.
    pub(super) fn begin(&mut self) {
        self.run = None;
        if let Some(channel) = &self.channel {
            channel.begin_anew();
        }
    }

    /// Takes samples of sensor `id`, and hands out what is made of them.
    pub(super) fn take(
        &mut self,
        (hub, id): (&Hub, &Arc<str>),
        kind: SampleKind,
        samples: &[RawSample],
        shown: bool,
        text: &mut Vec<u8>,
    ) {
        if self.failed {
            return;
        }
        if self.run.is_none() {
            match self.made(hub, id, kind, samples) {
                Ok(made) => self.run = Some(made),
                Err(why) => {
                    self.failed = true;
                    tracing::warn!("{id}: the page shows no estimate: {why}");
                }
            }
        }
        let Some((plan, stream)) = &mut self.run else {
            return;
        };
        stream.take(plan, None, samples);
        let health = stream.health();
        let (first, attitudes, channel) = stream.attitudes();
        channel.known(health);
        if shown && !attitudes.is_empty() {
            hub.distribute(channel, first, Items::Attitudes(attitudes), text);
        }
    }

    fn made(
        &mut self,
        hub: &Hub,
        id: &Arc<str>,
        kind: SampleKind,
        samples: &[RawSample],
    ) -> Result<(EstimationSettings, SensorStream), String> {
        let plan = live_plan(&EstimationSettings {
            aid: Aid::Auto,
            ..EstimationSettings::default()
        })
        .map_err(|why| why.to_string())?;
        let stated = Line {
            sample_kind: Some(kind),
            ..Line::default()
        };
        let channel = &mut self.channel;
        let stream = SensorStream::new(
            &plan,
            id.clone(),
            &stated,
            samples,
            (None, false),
            |labels| channel.get_or_insert_with(|| hub.declare(labels)).clone(),
        );
        Ok((plan, stream.map_err(|fault| fault.message)?))
    }
}
