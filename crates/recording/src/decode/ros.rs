//! ROS messages, CDR (XCDR1, either endianness) and ROS 1 -> registers. Pure.
//!
//! The schema is compiled once per channel into a short list of steps over the payload
//! ([`compile`]): skip so many bytes, skip a string, align, read these numbers. A walk touches
//! only what is wanted and checks every length against the payload before it believes it.
//!
//! # Source
//! CDR: OMG, CORBA 3.3 part 2 (formal/2012-11-14) 9.3; encapsulation identifiers: OMG, DDS-RTPS 2.5
//! table 10.3 and DDS-XTypes 1.3 table 60. Alignment counts from the byte after the four of the
//! encapsulation. ROS 1: <http://wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes>.

pub(crate) mod compile;
pub(crate) mod fifo;
pub(crate) mod imu;
mod read;

use super::registers::{Form, Registers};
use super::{Decoded, Decoder, MAX_BATCH, Undecodable};
use read::{Read, bytes_of};
use strapd_attitude::record::{Nanos, RawSample};

/// Bytes after the last field that are still padding: writers round up to 4 or 8.
const MAX_PADDING: usize = 7;

impl Decoder {
    /// Returns the covariance of the orientation that a payload states, about the axes of its world, rad^2, row by row;
    /// `None` of messages other than `sensor_msgs/Imu`, and where the payload is cut.
    #[must_use]
    pub fn orientation_covariance(&self, payload: &[u8]) -> Option<[f64; 9]> {
        match &self.plan {
            super::Program::Ros(plan) if plan.imu => imu::orientation_covariance(payload, plan.cdr),
            _ => None,
        }
    }
}

/// A message type as steps over its bytes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Program {
    ops: Vec<Op>,
    reads: Vec<Read>,
    marks: Vec<Mark>,
    names: Vec<Box<str>>,
    /// The schema goes on behind what could be walked, so the end is not checked.
    open: bool,
    batched: bool,
    cdr: bool,
    /// The layout is that of `sensor_msgs/Imu`.
    imu: bool,
    /// Form as compiled; what a message taught of it is the caller's.
    form: Form,
    child: Option<Box<str>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Op {
    /// Advance to the next multiple of 2, 4 or 8.
    Align(usize),
    /// Bytes of fixed layout, and the numbers wanted of them (ranges in `reads` and `marks`).
    Block {
        len: usize,
        reads: (u32, u32),
        marks: (u32, u32),
    },
    /// A string: count, bytes.
    Text { name: u32, keep: Keep },
    /// A sequence of numbers: count, then elements of this size, at least `need` of them; the
    /// numbers wanted of them.
    Run {
        size: usize,
        align: usize,
        need: usize,
        reads: (u32, u32),
        name: u32,
    },
    /// The next `body` steps, `count` times or as often as a count in the payload says.
    Loop {
        count: Option<u32>,
        body: u32,
        /// Fewest bytes of one turn, at least 1: a count the payload cannot hold ends the walk.
        min: usize,
        emit: Emit,
        name: u32,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Keep {
    No,
    /// The string asked for.
    Capture,
    /// Compare with the child frame asked for.
    Match,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Emit {
    No,
    Each,
    At(u32),
    FirstMatch,
}

/// End of a field in a block, for the message about one that does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Mark {
    end: usize,
    name: u32,
}

/// Fault at which a walk ended.
#[derive(Clone, Copy)]
enum Fault {
    /// Bytes that would have been needed, and for what.
    Short {
        need: usize,
        name: u32,
    },
    TooMany {
        name: u32,
    },
}

/// One walk through one payload.
struct Walk<'a, 'o> {
    plan: &'a Program,
    form: &'a Form,
    /// The payload without its encapsulation.
    data: &'a [u8],
    pos: usize,
    registers: Registers,
    text: Option<&'a [u8]>,
    matched: bool,
    log: Nanos,
    publish: Nanos,
    outcome: Decoded,
    out: &'o mut Vec<RawSample>,
}

impl Program {
    /// Reads one payload, its registers as `form` says; pushes nothing when it fails.
    pub(crate) fn decode(
        &self,
        form: &Form,
        payload: &[u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<Decoded, Undecodable> {
        if self.imu {
            let mut outcome = Decoded::default();
            let read = if self.cdr { imu::cdr } else { imu::ros1 };
            if let Some(sample) = read(payload, form, log, publish, &mut outcome) {
                out.push(sample);
                return Ok(outcome);
            }
        }
        let before = out.len();
        let result = self
            .walk(form, payload, log, publish, out)
            .map(|(outcome, _)| outcome);
        if result.is_err() {
            out.truncate(before);
        }
        result
    }

    /// The same plan, on the short way where its layout has one.
    pub(crate) fn recognised(self) -> Self {
        let imu = imu::is_imu(&self);
        Program { imu, ..self }
    }

    /// Form by which registers become samples.
    pub(crate) fn form(&self) -> Form {
        self.form
    }

    /// The string this plan was compiled to capture.
    pub(crate) fn text<'a>(&'a self, payload: &'a [u8]) -> Option<&'a [u8]> {
        let mut none = Vec::new();
        self.walk(&self.form, payload, Nanos(0), Nanos(0), &mut none)
            .ok()?
            .1
    }

    fn walk<'a>(
        &'a self,
        form: &'a Form,
        payload: &'a [u8],
        log: Nanos,
        publish: Nanos,
        out: &mut Vec<RawSample>,
    ) -> Result<(Decoded, Option<&'a [u8]>), Undecodable> {
        let (big, head) = if self.cdr {
            (encapsulation(payload)?, 4)
        } else {
            (false, 0)
        };
        let before = out.len();
        let mut walk = Walk {
            plan: self,
            form,
            data: payload.get(head..).unwrap_or(&[]),
            pos: 0,
            registers: Registers::default(),
            text: None,
            matched: self.child.is_none(),
            log,
            publish,
            outcome: Decoded::default(),
            out,
        };
        let end = if big {
            walk.run::<true>(&self.ops)
        } else {
            walk.run::<false>(&self.ops)
        };
        if let Err(fault) = end {
            return Err(self.explain(fault, payload.len(), head));
        }
        let left = walk.data.len().saturating_sub(walk.pos);
        if left > MAX_PADDING && !self.open {
            return Err(Undecodable::Long {
                have: payload.len() as u64,
                used: (payload.len() - left) as u64,
            });
        }
        if !self.batched {
            walk.emit();
        } else if form.stamp_outside {
            let stamp = form.stamp(&walk.registers, &mut walk.outcome);
            for sample in walk.out.iter_mut().skip(before) {
                sample.header = stamp;
            }
        }
        Ok((walk.outcome, walk.text))
    }

    #[cold]
    fn explain(&self, fault: Fault, have: usize, head: usize) -> Undecodable {
        let field = |name: u32| {
            let name = self.names.get(name as usize).map_or("", |n| n);
            crate::text::printable(name)
        };
        match fault {
            Fault::Short { need, name } => Undecodable::Short {
                have: have as u64,
                need: need.saturating_add(head) as u64,
                field: field(name),
            },
            Fault::TooMany { name } => Undecodable::TooMany {
                limit: MAX_BATCH as u64,
                field: field(name),
            },
        }
    }
}

/// Whether the payload is big-endian.
fn encapsulation(payload: &[u8]) -> Result<bool, Undecodable> {
    match payload {
        [0, 1, _, _, ..] => Ok(false),
        [0, 0, _, _, ..] => Ok(true),
        [a, b, _, _, ..] => Err(Undecodable::Encapsulation {
            found: [*a, *b],
            what: match (a, b) {
                (0, 2 | 3) => "a parameter list (PL_CDR)",
                (0, 6 | 7) => "plain XCDR2",
                (0, 8 | 9) => "delimited XCDR2",
                (0, 0x0a | 0x0b) => "a parameter list (PL_CDR2)",
                _ => "none this format knows",
            },
        }),
        _ => Err(Undecodable::Short {
            have: payload.len() as u64,
            need: 4,
            field: "the CDR encapsulation".to_owned(),
        }),
    }
}

impl<'a> Walk<'a, '_> {
    fn run<const BIG: bool>(&mut self, ops: &'a [Op]) -> Result<(), Fault> {
        let mut at = 0;
        while let Some(op) = ops.get(at) {
            at += 1;
            match *op {
                Op::Align(to) => self.pos = self.pos.next_multiple_of(to),
                Op::Block { len, reads, marks } => {
                    let Some(bytes) = self.ahead(len) else {
                        return Err(self.short_in(marks));
                    };
                    for read in range(&self.plan.reads, reads) {
                        read.apply::<BIG>(bytes, &mut self.registers);
                    }
                    self.pos += len;
                }
                Op::Text { name, keep } => {
                    let len = self.count::<BIG>(name)?;
                    let bytes = self.take(len, name)?;
                    if keep != Keep::No {
                        self.keep(bytes, keep);
                    }
                }
                Op::Run {
                    size,
                    align,
                    need,
                    reads,
                    name,
                } => {
                    let count = self.count::<BIG>(name)?;
                    if count > 0 && align > 1 {
                        self.pos = self.pos.next_multiple_of(align);
                    }
                    let bytes = self.take(count.saturating_mul(size), name)?;
                    if count < need {
                        let more = (need - count).saturating_mul(size);
                        return Err(Fault::Short {
                            need: self.pos.saturating_add(more),
                            name,
                        });
                    }
                    for read in range(&self.plan.reads, reads) {
                        read.apply::<BIG>(bytes, &mut self.registers);
                    }
                }
                Op::Loop {
                    count,
                    body,
                    min,
                    emit,
                    name,
                } => {
                    let turns = match count {
                        Some(count) => count as usize,
                        None => self.count::<BIG>(name)?,
                    };
                    let least = turns.saturating_mul(min);
                    if least > self.data.len().saturating_sub(self.pos) {
                        return Err(Fault::Short {
                            need: self.pos.saturating_add(least),
                            name,
                        });
                    }
                    let steps = ops.get(at..at + body as usize).unwrap_or(&[]);
                    at += body as usize;
                    for turn in 0..turns {
                        self.run::<BIG>(steps)?;
                        self.emit_turn(emit, turn, name)?;
                    }
                }
            }
        }
        Ok(())
    }

    #[inline]
    fn ahead(&self, len: usize) -> Option<&'a [u8]> {
        self.data.get(self.pos..self.pos.checked_add(len)?)
    }

    fn take(&mut self, len: usize, name: u32) -> Result<&'a [u8], Fault> {
        let need = self.pos.saturating_add(len);
        let bytes = self.ahead(len).ok_or(Fault::Short { need, name })?;
        self.pos = need;
        Ok(bytes)
    }

    fn count<const BIG: bool>(&mut self, name: u32) -> Result<usize, Fault> {
        if self.plan.cdr {
            self.pos = self.pos.next_multiple_of(4);
        }
        let bytes = self.take(4, name)?;
        Ok(bytes_of::<4>(bytes, 0).map_or(0, |b| {
            if BIG {
                u32::from_be_bytes(b)
            } else {
                u32::from_le_bytes(b)
            }
        }) as usize)
    }

    #[cold]
    fn short_in(&self, marks: (u32, u32)) -> Fault {
        let left = self
            .data
            .len()
            .saturating_sub(self.pos.min(self.data.len()));
        let mark = range(&self.plan.marks, marks)
            .iter()
            .find(|mark| mark.end > left || self.pos > self.data.len());
        let (end, name) = mark.map_or((1, 0), |mark| (mark.end, mark.name));
        Fault::Short {
            need: self.pos.saturating_add(end),
            name,
        }
    }

    fn keep(&mut self, bytes: &'a [u8], keep: Keep) {
        // CDR counts the terminator, ROS 1 has none.
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        if keep == Keep::Capture {
            self.text.get_or_insert(bytes);
        } else if let Some(child) = &self.plan.child {
            self.matched = bytes == child.as_bytes();
        }
    }

    fn emit_turn(&mut self, emit: Emit, turn: usize, name: u32) -> Result<(), Fault> {
        let now = match emit {
            Emit::No => return Ok(()),
            Emit::Each => true,
            Emit::At(n) => turn == n as usize,
            Emit::FirstMatch => self.matched && self.outcome.samples == 0,
        };
        if now {
            if self.outcome.samples >= MAX_BATCH {
                return Err(Fault::TooMany { name });
            }
            self.emit();
        }
        Ok(())
    }

    #[inline]
    fn emit(&mut self) {
        let sample = self
            .form
            .sample(&self.registers, self.log, self.publish, &mut self.outcome);
        self.out.push(sample);
        self.outcome.samples += 1;
    }
}

fn range<T>(items: &[T], (from, to): (u32, u32)) -> &[T] {
    items.get(from as usize..to as usize).unwrap_or(&[])
}
