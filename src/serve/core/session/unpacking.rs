//! Packed objects of a client -> samples, as its lines. Pure.

use super::{Scratch, Session, Side, first_line_must_be_auth};
use crate::serve::core::hub::count;
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::wire;
use strapd_attitude::record::Nanos;
use strapd_recording::decode::Line;
use strapd_recording::decode::packed::{self, Object};

impl Session {
    /// Binds this number of packed samples to what a line with this head would state, or refuses it.
    /// `said`: the line that says so, and its number.
    pub(super) fn bind_or_say(
        &mut self,
        stream: u32,
        head: Result<Line, Box<Fault>>,
        said: (u64, &[u8]),
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        let (number, line) = said;
        let most = self.hub.limits().sensors_of_client;
        if self.bound.len() >= most && !self.bound.contains_key(&stream) {
            if self.is_source_with_more() {
                return self.say(&Fault::too_many_sensors(most), number, line);
            }
            let fault = Fault::new(
                "bad_packed",
                format!(
                    "one connection binds at most {most} numbers; give one of them another meaning, or open another connection"
                ),
            );
            return self.bad(&fault, number, line, received, scratch);
        }
        self.errors_in_a_row = 0;
        if let Err(fault) = &head {
            self.say(fault, number, line);
        }
        self.bound.insert(stream, head);
    }

    /// A source that has more sensors than one connection may send: those that are not bound are refused as their
    /// lines would be, and nothing is held against it.
    fn is_source_with_more(&self) -> bool {
        matches!(self.side, Side::Source(_))
            && self.bound.len() >= self.hub.limits().sensors_of_client
    }

    /// Meaning of samples with this number; by default that of their subject, within its message.
    fn bound_or_of_subject(&mut self, stream: u32) -> Option<&Result<Line, Box<Fault>>> {
        if self.side.is_broker()
            && !self.bound.contains_key(&stream)
            && let Some(head) = self.head_of_subject()
        {
            self.bound.insert(stream, Ok(head));
        }
        self.bound.get(&stream)
    }

    /// A packed object: a sample as the line would be that says what its number was bound to.
    pub(super) fn packed(
        &mut self,
        number: u64,
        object: &[u8],
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        if !self.authorised {
            return self.refuse(&first_line_must_be_auth(), number);
        }
        let read = match packed::read(object, received) {
            Ok(Object::Rate {
                stream,
                seq,
                sample,
            }) => Ok((stream, seq, sample)),
            // Of a daemon before us the rates are the samples, as those of its lines are.
            Ok(Object::Att { stream, attitude }) if matches!(self.side, Side::Source(_)) => {
                let sample = attitude.as_sample(received);
                Ok((stream, Some(attitude.seq), sample))
            }
            Ok(Object::Att { .. }) => Err(Fault::new(
                "bad_packed",
                "packed kind 2 (ATT) is none a client sends",
            )),
            Err(why) => Err(wire::unreadable(&why)),
        };
        let fault = match read {
            Ok((stream, seq, sample)) => match self.bound_or_of_subject(stream) {
                Some(Ok(head)) => {
                    let before = scratch.run.samples.len();
                    // Most are of the run before them: nothing is cloned for those.
                    let begins = (!scratch.run.goes_on_in(head)).then(|| head.clone());
                    scratch.run.samples.push(sample);
                    if !self.hub.takes_samples() {
                        return self.not_taken((number, &[]), before, received, scratch);
                    }
                    self.errors_in_a_row = 0;
                    if let Some(head) = begins {
                        self.flush(received, scratch, before);
                        scratch.run.begin(head, (number, &[]));
                    }
                    return scratch.run.extend(seq);
                }
                Some(Err(fault)) => {
                    let fault = fault.clone();
                    count(&self.hub.counters.refused_samples, 1);
                    self.lose(&fault, number, &[]);
                    return self.say(&fault, number, &[]);
                }
                None => {
                    if self.is_source_with_more() {
                        let most = self.hub.limits().sensors_of_client;
                        count(&self.hub.counters.refused_samples, 1);
                        return self.say(&Fault::too_many_sensors(most), number, &[]);
                    }
                    Fault::new(
                        "unknown_stream",
                        format!(
                            "number {stream} is bound to no sensor; say {{\"class\":\"PACKED\",\"stream\":{stream},\"id\":\"imu0\"}} first"
                        ),
                    )
                }
            },
            Err(fault) => fault,
        };
        self.bad(&fault, number, &[], received, scratch);
    }
}
