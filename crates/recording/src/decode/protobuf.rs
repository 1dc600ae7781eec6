//! Protobuf -> registers. Pure.
//!
//! The descriptor set is compiled once per channel into a tree of the wanted field numbers; a walk
//! goes down only where something is wanted and skips the rest by its length.
//!
//! proto3 leaves out fields that are zero: inside a vector or a stamp that is present, a component
//! that is not there is zero; a vector that is not there is absent.

pub(crate) mod plan;
pub(crate) mod wire;

use super::registers::{Form, Registers, Slot};
use super::schema::Number;
use super::{Decoded, MAX_BATCH, Undecodable};
use strapd_attitude::record::{Nanos, RawSample};
use wire::{Broken, Reader, Value};

/// A message type as a tree of what is wanted of it; the root is node 0.
#[derive(Debug, Clone, Default)]
pub(crate) struct Program {
    nodes: Vec<Node>,
    /// Form as compiled; what a message taught of it is the caller's.
    form: Form,
    batched: bool,
    child: Option<Box<str>>,
}

/// Node of the tree of fields wanted of one message.
#[derive(Debug, Clone, Default)]
struct Node {
    /// Actions by field number, few.
    fields: Vec<(u32, Action)>,
    /// Slots that are zero, not absent, when this message is present.
    zeros: u32,
    /// Whether the end of this message ends a sample.
    emit: Emit,
    /// The field that leads here.
    name: Box<str>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Emit {
    #[default]
    No,
    Each,
    At(u32),
    FirstMatch,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Action {
    /// A message: go down to this node.
    Into(usize),
    /// A number.
    Read(Number, Slot),
    /// A repeated number: element and slot of those wanted; the counter of its elements.
    Elements(Number, Vec<(u32, Slot)>, usize),
    /// The string asked for.
    Capture,
    /// Compare with the child frame asked for.
    Match,
}

/// Counters of repeated numbers that are read by element.
const MAX_COUNTERS: usize = 8;

struct Walk<'a, 'o> {
    plan: &'a Program,
    form: &'a Form,
    registers: Registers,
    counters: [u32; MAX_COUNTERS],
    text: Option<&'a [u8]>,
    matched: bool,
    turn: u32,
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
        let before = out.len();
        let result = self
            .walk(form, payload, log, publish, out)
            .map(|(outcome, _)| outcome);
        if result.is_err() {
            out.truncate(before);
        }
        result
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
        let before = out.len();
        let mut walk = Walk {
            plan: self,
            form,
            registers: Registers::default(),
            counters: [0; MAX_COUNTERS],
            text: None,
            matched: self.child.is_none(),
            turn: 0,
            log,
            publish,
            outcome: Decoded::default(),
            out,
        };
        walk.message(0, payload, 0)?;
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
}

impl<'a> Walk<'a, '_> {
    /// Reads one message; as deep as the plan, which is bounded.
    fn message(&mut self, node: usize, bytes: &'a [u8], base: usize) -> Result<(), Undecodable> {
        let Some(node) = self.plan.nodes.get(node) else {
            return Ok(());
        };
        if node.emit == Emit::No {
            return self.fields(node, bytes, base);
        }
        // What one element of a batch holds is nothing to the next.
        let outside = (self.registers, self.counters);
        self.counters = [0; MAX_COUNTERS];
        self.matched = self.plan.child.is_none();
        self.fields(node, bytes, base)?;
        self.emit_turn(node)?;
        (self.registers, self.counters) = outside;
        Ok(())
    }

    fn fields(&mut self, node: &'a Node, bytes: &'a [u8], base: usize) -> Result<(), Undecodable> {
        self.zero(node.zeros);
        let mut reader = Reader::new(bytes, base);
        while let Some((number, value)) = reader.next()? {
            let action = node.fields.iter().find(|(n, _)| *n == number);
            let Some((_, action)) = action else { continue };
            let end = reader.offset();
            match (action, value) {
                (Action::Into(inner), Value::Bytes(bytes)) => {
                    self.message(*inner, bytes, end - bytes.len())?;
                }
                (Action::Capture, Value::Bytes(text)) => {
                    self.text.get_or_insert(text);
                }
                (Action::Match, Value::Bytes(text)) => {
                    self.matched = self
                        .plan
                        .child
                        .as_deref()
                        .is_some_and(|c| c.as_bytes() == text);
                }
                (Action::Read(number, slot), value) => {
                    // A value of another wire type is an unknown field, as protobuf has it.
                    self.put(*number, *slot, value);
                }
                (Action::Elements(number, wanted, counter), value) => {
                    self.elements(*number, wanted, *counter, value, end)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Marks slots as seen with the value zero, where no value came before.
    fn zero(&mut self, slots: u32) {
        let mut fresh = slots & !self.registers.seen;
        while fresh != 0 {
            let slot = Slot(fresh.trailing_zeros() as u8);
            self.registers.integer(slot, 0);
            fresh &= fresh - 1;
        }
    }

    fn put(&mut self, number: Number, slot: Slot, value: Value<'_>) {
        match (number, value) {
            (Number::F64, Value::Fixed64(b)) => self.registers.float(slot, f64::from_le_bytes(b)),
            (Number::F32, Value::Fixed32(b)) => {
                self.registers.float(slot, f64::from(f32::from_le_bytes(b)));
            }
            (Number::U64, Value::Fixed64(b)) => {
                let value = i64::try_from(u64::from_le_bytes(b)).unwrap_or(i64::MAX);
                self.registers.integer(slot, value);
            }
            (Number::I64, Value::Fixed64(b)) => self.registers.integer(slot, i64::from_le_bytes(b)),
            (Number::U32, Value::Fixed32(b)) => {
                self.registers
                    .integer(slot, i64::from(u32::from_le_bytes(b)));
            }
            (Number::I32, Value::Fixed32(b)) => {
                self.registers
                    .integer(slot, i64::from(i32::from_le_bytes(b)));
            }
            (Number::Varint, Value::Varint(v)) => self.registers.integer(slot, v as i64),
            (Number::VarintUnsigned, Value::Varint(v)) => {
                let value = i64::try_from(v).unwrap_or(i64::MAX);
                self.registers.integer(slot, value);
            }
            (Number::ZigZag, Value::Varint(v)) => {
                self.registers
                    .integer(slot, (v >> 1) as i64 ^ -((v & 1) as i64));
            }
            _ => {}
        }
    }

    /// A repeated number: one element by itself, or many packed.
    fn elements(
        &mut self,
        number: Number,
        wanted: &[(u32, Slot)],
        counter: usize,
        value: Value<'_>,
        end: usize,
    ) -> Result<(), Undecodable> {
        let Value::Bytes(bytes) = value else {
            self.element(number, wanted, counter, value);
            return Ok(());
        };
        let last = wanted.iter().map(|(n, _)| *n).max().unwrap_or(0);
        let mut packed = Reader::new(bytes, end - bytes.len());
        while !packed.is_done() {
            let value = match number {
                Number::F64 | Number::I64 | Number::U64 => Value::Fixed64(packed.fixed()?),
                Number::F32 | Number::I32 | Number::U32 => Value::Fixed32(packed.fixed()?),
                _ => Value::Varint(packed.varint()?),
            };
            self.element(number, wanted, counter, value);
            if self.counters.get(counter).is_none_or(|n| *n > last) {
                break;
            }
        }
        Ok(())
    }

    fn element(
        &mut self,
        number: Number,
        wanted: &[(u32, Slot)],
        counter: usize,
        value: Value<'_>,
    ) {
        let Some(count) = self.counters.get_mut(counter) else {
            return;
        };
        let at = *count;
        *count = count.saturating_add(1);
        for (_, slot) in wanted.iter().filter(|(n, _)| *n == at) {
            self.put(number, *slot, value);
        }
    }

    fn emit_turn(&mut self, node: &Node) -> Result<(), Undecodable> {
        let turn = self.turn;
        self.turn = turn.saturating_add(1);
        let now = match node.emit {
            Emit::No => false,
            Emit::Each => true,
            Emit::At(n) => turn == n,
            Emit::FirstMatch => self.matched && self.outcome.samples == 0,
        };
        if now {
            if self.outcome.samples >= MAX_BATCH {
                return Err(Undecodable::TooMany {
                    limit: MAX_BATCH as u64,
                    field: crate::text::printable(&node.name),
                });
            }
            self.emit();
        }
        Ok(())
    }

    fn emit(&mut self) {
        let sample = self
            .form
            .sample(&self.registers, self.log, self.publish, &mut self.outcome);
        self.out.push(sample);
        self.outcome.samples += 1;
    }
}

impl From<Broken> for Undecodable {
    fn from(broken: Broken) -> Self {
        Undecodable::Protobuf {
            offset: broken.offset as u64,
            what: broken.what,
        }
    }
}
