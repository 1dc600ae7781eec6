//! Payloads in order -> messages with stamps. Pure.
//!
//! Apart from the samples because the time of a payload's samples shows only when the next one is known: they lie
//! evenly between the beginnings of both.

use super::stream::{Payload, Stream, What, payload};
use super::{Lasts, SECOND};
use crate::decode::known_definition;
use crate::records::imu;
use crate::records::transcript::Transcript;
use std::collections::{BTreeMap, VecDeque};

/// Largest distance of a stream's stamps from the time of its payload, and of the next payload; else they
/// are damage, ns.
const FAR: u64 = 5_000_000_000;

/// A recording under way.
#[derive(Debug, Default)]
pub(crate) struct Transcriber {
    waiting: Option<Timed>,
    /// Channels by device.
    channels: BTreeMap<u32, u16>,
    /// Samples that are not told yet, by channel.
    queues: BTreeMap<u16, Queue>,
    /// Time of the payloads so far by the beginnings of those that followed, ns, and their samples, by device and kind.
    so_far: BTreeMap<(u32, What), (u64, u64)>,
    /// A stamp of the camera's clock, us, and the time it stands for, ns.
    anchor: Option<(u64, u64)>,
    /// Name that a camera gives itself.
    pub(crate) camera: String,
    /// Why something of the payload that came last is not read, and bytes of it that are none.
    pub(crate) refused: Vec<&'static str>,
    pub(crate) rest: usize,
}

#[derive(Debug)]
struct Timed {
    /// Beginning, ns, and duration by the track.
    at: u64,
    lasts: Lasts,
    payload: Payload,
}

/// Rates and forces of a device, with their times, in order.
#[derive(Debug, Default)]
struct Queue {
    rates: VecDeque<(u64, u32, [f64; 3])>,
    forces: VecDeque<(u64, [f64; 3])>,
}

impl Queue {
    /// Tells the rates up to the time `until`, all where there is none, and the first `least` in any case, each with
    /// the last force since the rate before it.
    fn tell(&mut self, channel: u16, until: Option<u64>, least: usize, to: &mut Transcript) {
        let mut message = Vec::new();
        let mut told = 0;
        while let Some((time, nth, rate)) = self.rates.front().copied()
            && (told < least || until.is_none_or(|until| time <= until))
        {
            self.rates.pop_front();
            told += 1;
            let mut own = None;
            while let Some((at, force)) = self.forces.front().copied()
                && at <= time
            {
                self.forces.pop_front();
                own = Some(force);
            }
            imu::imu(&mut message, (time, FRAME), rate, own);
            to.message(channel, nth, time, &message);
        }
        if until.is_none() {
            self.forces.clear();
        }
    }
}

impl Transcriber {
    /// Takes the next payload; `at` and `lasts` are of the track, ns. Tells the one before.
    pub(crate) fn push(&mut self, at: u64, lasts: Lasts, bytes: &[u8], to: &mut Transcript) {
        let mut payload = payload(bytes);
        self.refused.append(&mut payload.refused);
        self.rest = payload.rest;
        if let Some((_, name)) = payload.devices.first()
            && self.camera.is_empty()
        {
            self.camera.clone_from(name);
        }
        let stamps = payload.streams.iter().filter_map(|stream| stream.stamp);
        if let (None, Some(first)) = (self.anchor, stamps.min()) {
            self.anchor = Some((first, at));
        }
        let next = Timed { at, lasts, payload };
        if let Some(now) = self.waiting.take() {
            self.tell(&now, Some(&next), to);
        }
        self.waiting = Some(next);
    }

    /// Tells the last.
    pub(crate) fn finish(&mut self, to: &mut Transcript) {
        if let Some(now) = self.waiting.take() {
            self.tell(&now, None, to);
        }
    }

    /// The clock of the payload that came last, ms.
    pub(crate) fn tick(bytes: &[u8]) -> Option<u64> {
        payload(bytes).tick
    }

    /// Takes in what a payload holds, whose end is known now, and tells the rates to which no force can come any more.
    fn tell(&mut self, now: &Timed, next: Option<&Timed>, to: &mut Transcript) {
        for (device, name) in &now.payload.devices {
            let of = |what: What| {
                let mut streams = now.payload.streams.iter();
                streams.find(|s| s.device == *device && s.what == what)
            };
            let Some(rates) = of(What::Rate).filter(|rates| !rates.samples.is_empty()) else {
                continue;
            };
            let Some(channel) = self.channel(*device, name, rates, to) else {
                continue;
            };
            let rate_at = self.times(now, next, rates);
            let forces = of(What::Force);
            let force_at = forces.map(|forces| self.times(now, next, forces));
            let queue = self.queues.entry(channel).or_default();
            // Those that waited for forces of this payload wait no longer.
            let before = queue.rates.len();
            let timed = |nth: usize, rate: &[f64; 3]| (rate_at(nth), nth as u32, *rate);
            let rates = rates.samples.iter().enumerate();
            queue
                .rates
                .extend(rates.map(|(nth, rate)| timed(nth, rate)));
            let mut until = None;
            if let (Some(forces), Some(at)) = (forces, force_at) {
                let forces = forces.samples.iter().enumerate();
                queue
                    .forces
                    .extend(forces.map(|(nth, force)| (at(nth), *force)));
                until = queue.forces.back().map(|(time, _)| *time);
            }
            queue.tell(channel, until.filter(|_| next.is_some()), before, to);
        }
        if next.is_none() {
            for (channel, queue) in &mut self.queues {
                queue.tell(*channel, None, 0, to);
            }
        }
    }

    /// Times of the samples of a stream: evenly up to the next payload; where none follows, as long as the track
    /// says, or at the step of the payloads before.
    fn times(
        &mut self,
        now: &Timed,
        next: Option<&Timed>,
        of: &Stream,
    ) -> impl Fn(usize) -> u64 + use<> {
        let begin = self.begin(now, of);
        let follower = next.and_then(|next| {
            let mut streams = next.payload.streams.iter();
            let is_it = |s: &&Stream| s.device == of.device && s.what == of.what;
            let stream = streams.find(is_it)?;
            Some(self.begin(next, stream))
        });
        let end = follower.filter(|end| *end > begin && end - begin < FAR);
        let count = of.samples.len().max(1) as u64;
        let so_far = self.so_far.entry((of.device, of.what)).or_default();
        let lasts = match end {
            Some(end) => {
                let (took, samples) = *so_far;
                *so_far = (took.saturating_add(end - begin), samples + count);
                end - begin
            }
            None => {
                let at_that_step = match *so_far {
                    (_, 0) => None,
                    (took, samples) => {
                        let lasts = u128::from(took) * u128::from(count) / u128::from(samples);
                        u64::try_from(lasts).ok()
                    }
                };
                match (now.lasts, at_that_step) {
                    (Lasts::Own(lasts), _) | (Lasts::Alike(lasts), None) => lasts,
                    // As it was where nothing shows that it was cut.
                    (Lasts::Alike(lasts), Some(step)) if lasts.abs_diff(step) < lasts / 10 => lasts,
                    (_, Some(step)) => step,
                    (Lasts::Unsaid, None) => SECOND,
                }
            }
        };
        move |nth| {
            let part = u128::from(lasts) * nth as u128 / u128::from(count);
            begin.saturating_add(u64::try_from(part).unwrap_or(u64::MAX))
        }
    }

    /// Time of the first sample of a stream: by its own stamp, if that can be, else with its payload.
    fn begin(&self, now: &Timed, of: &Stream) -> u64 {
        let own = self.anchor.zip(of.stamp).map(|((stamp, time), own)| {
            let since = i128::from(own) - i128::from(stamp);
            u64::try_from(i128::from(time) + since * 1000).unwrap_or(u64::MAX)
        });
        own.filter(|own| own.abs_diff(now.at) < FAR)
            .unwrap_or(now.at)
    }

    fn channel(
        &mut self,
        device: u32,
        name: &str,
        rates: &Stream,
        to: &mut Transcript,
    ) -> Option<u16> {
        if let Some(known) = self.channels.get(&device) {
            return Some(*known);
        }
        let number = u16::try_from(self.channels.len()).ok()?;
        if number == 0 {
            let text = known_definition(imu::TYPE).unwrap_or_default();
            to.schema(1, imu::TYPE, "ros2msg", text.as_bytes());
        }
        let topic = match number {
            0 => "gopro/imu".to_owned(),
            _ => format!("gopro/imu/{device}"),
        };
        let clock = match rates.stamp {
            Some(_) => "the camera's own stamps, from the payload's time at the first",
            None => "the payload's time",
        };
        let said = [
            ("device", name),
            ("columns", rates.axes.as_str()),
            ("clock", clock),
        ];
        to.channel(number, 1, &topic, "cdr", &said);
        self.channels.insert(device, number);
        Some(number)
    }
}

/// Frame of the axes.
const FRAME: &str = "camera";
