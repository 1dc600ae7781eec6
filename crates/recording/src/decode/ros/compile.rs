//! [`Schema`] and [`Selection`] -> [`Program`]. Pure.
//!
//! Fields of fixed size run together into blocks, so that an Imu is three steps: stamp, frame,
//! 37 doubles. The compiler knows the position modulo 8 as far as the layout fixes it, and leaves
//! to the walk only the alignments it cannot know, those behind a string or a sequence.

use super::read::Read;
use super::{Emit, Keep, Mark, Op, Program};
use crate::decode::registers::Slot;
use crate::decode::schema::{Field, Kind, Many, Number, Schema};
use crate::decode::select::{Batch, PathStep, Selection, path_text};

/// Deepest nesting, and most fields a message may have once its nested types are written out.
const MAX_DEPTH: usize = 32;
const MAX_FIELDS: usize = 50_000;

/// Layout of fields one behind the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Layout {
    /// Each number at a multiple of its size, up to 8.
    Cdr,
    /// Packed.
    Ros1,
}

/// Compiles the plan that reads `selection`, and of the batch only the element of this child frame.
///
/// # Errors
/// A sentence: what the schema leaves undefined, or is too much.
pub(crate) fn samples(
    schema: &Schema,
    selection: &Selection,
    child: Option<&str>,
    layout: Layout,
) -> Result<Program, String> {
    let mut wants: Vec<Want<'_>> = selection
        .picks
        .iter()
        .map(|pick| Want {
            path: &pick.path,
            what: What::Number(pick.slot),
        })
        .collect();
    let child = child.filter(|_| selection.child.is_some());
    wants.extend(
        selection
            .child
            .iter()
            .filter(|_| child.is_some())
            .map(|path| Want {
                path,
                what: What::Text(Keep::Match),
            }),
    );
    let mut compiler = Compiler::new(schema, selection.batch.as_ref(), layout);
    compiler.plan.form = selection.form;
    compiler.plan.child = child.map(Into::into);
    compiler.message(&wants)
}

/// Compiles the plan that finds one string.
pub(crate) fn text(schema: &Schema, path: &[PathStep], layout: Layout) -> Result<Program, String> {
    let want = Want {
        path,
        what: What::Text(Keep::Capture),
    };
    Compiler::new(schema, None, layout).message(&[want])
}

/// Something to take, and the rest of the way to it.
#[derive(Clone, Copy)]
struct Want<'a> {
    path: &'a [PathStep],
    what: What,
}

#[derive(Clone, Copy)]
enum What {
    Number(Slot),
    Text(Keep),
}

/// Why compiling stopped.
enum Halt {
    /// Position unknown: nothing can be found behind this field.
    Blind(String),
    /// Refusal: there is no plan.
    Refused(String),
}

struct Compiler<'a> {
    schema: &'a Schema,
    batch: Option<&'a Batch>,
    layout: Layout,
    plan: Program,
    /// Position modulo `modulus`, as far as it is known.
    residue: usize,
    modulus: usize,
    /// The block being filled: its length, where its reads and marks begin.
    block: Option<(usize, usize, usize)>,
    path: Vec<PathStep>,
    left: usize,
    fields: usize,
}

impl<'a> Compiler<'a> {
    fn new(schema: &'a Schema, batch: Option<&'a Batch>, layout: Layout) -> Self {
        Compiler {
            schema,
            batch,
            layout,
            plan: Program {
                cdr: layout == Layout::Cdr,
                batched: batch.is_some(),
                ..Program::default()
            },
            residue: 0,
            modulus: 8,
            block: None,
            path: Vec::new(),
            left: 0,
            fields: 0,
        }
    }

    fn message(mut self, wants: &[Want<'_>]) -> Result<Program, String> {
        self.left = wants.len();
        match self.structure(self.schema.root, wants) {
            Ok(()) => {}
            Err(Halt::Blind(_)) if self.left == 0 => self.plan.open = true,
            Err(Halt::Blind(why) | Halt::Refused(why)) => return Err(why),
        }
        self.flush();
        Ok(self.plan)
    }

    fn structure(&mut self, index: usize, wants: &[Want<'_>]) -> Result<(), Halt> {
        if self.path.len() > 2 * MAX_DEPTH {
            return Err(Halt::Refused(format!(
                "the schema nests more than {MAX_DEPTH} deep"
            )));
        }
        let Some(structure) = self.schema.get(index) else {
            return Err(Halt::Refused(
                "the schema refers to a type it lacks".to_owned(),
            ));
        };
        for (n, field) in structure.fields.iter().enumerate() {
            self.fields += 1;
            if self.fields > MAX_FIELDS {
                return Err(Halt::Refused(format!(
                    "the schema spells out to more than {MAX_FIELDS} fields"
                )));
            }
            let inner: Vec<Want<'_>> = wants
                .iter()
                .filter_map(|want| match want.path.split_first() {
                    Some((PathStep::Field(i), path)) if *i == n => Some(Want { path, ..*want }),
                    _ => None,
                })
                .collect();
            self.path.push(PathStep::Field(n));
            self.field(field, &inner)?;
            self.path.pop();
        }
        Ok(())
    }

    fn field(&mut self, field: &Field, wants: &[Want<'_>]) -> Result<(), Halt> {
        match (field.kind, field.many) {
            (Kind::Number(number), Many::One) => self.numbers(number, 1, wants),
            (Kind::Number(number), Many::Array(n)) => self.numbers(number, n, wants),
            (Kind::Number(number), Many::Sequence) => self.sequence(number, wants),
            (Kind::Text, Many::One) => {
                self.text(wants);
                Ok(())
            }
            (Kind::Struct(index), Many::One) => self.structure(index, wants),
            (Kind::Text | Kind::Struct(_), many) => self.repeated(field.kind, many, wants),
            (Kind::WideText, _) => Err(Halt::Blind(format!(
                "`{}` is a wide string, whose layout DDS implementations disagree on, and a wanted field lies behind it",
                path_text(self.schema, &self.path)
            ))),
            (Kind::Undefined, _) => Err(Halt::Blind(format!(
                "the schema text does not define the type of `{}`",
                path_text(self.schema, &self.path)
            ))),
        }
    }

    /// Numbers in a row: part of a block.
    fn numbers(&mut self, number: Number, n: u32, wants: &[Want<'_>]) -> Result<(), Halt> {
        let size = number.size() as usize;
        let len = size
            .checked_mul(n as usize)
            .filter(|len| *len <= isize::MAX as usize / 2);
        let len = len
            .ok_or_else(|| Halt::Refused("the schema has an array beyond any memory".to_owned()))?;
        if len == 0 {
            return Ok(());
        }
        self.align(size.min(8));
        let name = self.name();
        let reads = self.plan.reads.len();
        let marks = self.plan.marks.len();
        let (start, reads, _) = *self.block.get_or_insert((0, reads, marks));
        for want in wants {
            let element = match want.path {
                [] if n == 1 => 0,
                [PathStep::At(k)] if *k < n => *k as usize,
                _ => continue,
            };
            self.read(reads, start + element * size, number, want);
        }
        let end = start.saturating_add(len);
        self.plan.marks.push(Mark { end, name });
        if let Some(block) = &mut self.block {
            block.0 = end;
        }
        self.advance(len);
        Ok(())
    }

    /// One more number; joined to the one before when both lie in a row, from read `first` on.
    fn read(&mut self, first: usize, at: usize, number: Number, want: &Want<'_>) {
        let What::Number(slot) = want.what else {
            return;
        };
        self.left -= 1;
        let mergeable = self.plan.reads.len() > first;
        if let Some(last) = self.plan.reads.last_mut().filter(|_| mergeable) {
            let next = last.at + usize::from(last.n) * number.size() as usize;
            if last.number == number && next == at && last.slot.plus(last.n) == slot {
                last.n += 1;
                return;
            }
        }
        self.plan.reads.push(Read {
            at,
            number,
            slot,
            n: 1,
        });
    }

    fn sequence(&mut self, number: Number, wants: &[Want<'_>]) -> Result<(), Halt> {
        self.flush();
        let size = number.size() as usize;
        let from = self.plan.reads.len();
        let mut need = 0;
        for want in wants {
            if let [PathStep::At(k)] = want.path {
                need = need.max(*k as usize + 1);
                self.read(from, *k as usize * size, number, want);
            }
        }
        let name = self.name();
        let reads = (from as u32, self.plan.reads.len() as u32);
        let align = if self.layout == Layout::Cdr {
            size.min(8)
        } else {
            1
        };
        self.plan.ops.push(Op::Run {
            size,
            align,
            need,
            reads,
            name,
        });
        self.forget();
        Ok(())
    }

    fn text(&mut self, wants: &[Want<'_>]) {
        self.flush();
        let keep = wants.iter().find_map(|want| match (want.what, want.path) {
            (What::Text(keep), []) => Some(keep),
            _ => None,
        });
        self.left -= usize::from(keep.is_some());
        let name = self.name();
        let keep = keep.unwrap_or(Keep::No);
        self.plan.ops.push(Op::Text { name, keep });
        self.forget();
    }

    /// Strings or structs in a row.
    fn repeated(&mut self, kind: Kind, many: Many, wants: &[Want<'_>]) -> Result<(), Halt> {
        self.flush();
        let element = wants.first().and_then(|w| w.path.first()).copied();
        let one_way = wants.iter().all(|w| w.path.first() == element.as_ref());
        if !one_way {
            return Err(Halt::Refused(format!(
                "only one element of `{}` can be read",
                path_text(self.schema, &self.path)
            )));
        }
        let inner: Vec<Want<'_>> = wants
            .iter()
            .filter_map(|w| {
                Some(Want {
                    path: w.path.get(1..)?,
                    ..*w
                })
            })
            .collect();
        let emit = self.emit();
        let count = match many {
            Many::Array(n) => Some(n),
            _ => None,
        };
        let name = self.name();
        let at = self.plan.ops.len();
        let body = 0;
        self.plan.ops.push(Op::Loop {
            count,
            body,
            min: 1,
            emit,
            name,
        });
        self.forget();
        self.path.push(element.unwrap_or(PathStep::Each));
        let compiled = match kind {
            Kind::Struct(index) => self.structure(index, &inner),
            _ => {
                self.text(&inner);
                Ok(())
            }
        };
        if let Err(halt) = compiled {
            // Half a loop is no step; what came before it still is.
            self.plan.ops.truncate(at);
            self.block = None;
            return Err(match halt {
                Halt::Blind(why) if !wants.is_empty() => Halt::Refused(why),
                halt => halt,
            });
        }
        self.path.pop();
        self.flush();
        self.close_loop(at, count, emit, name);
        Ok(())
    }

    /// Rule by which a repetition at this path gives samples.
    fn emit(&self) -> Emit {
        match self.batch.filter(|batch| batch.path == self.path) {
            None => Emit::No,
            Some(_) if self.plan.child.is_some() => Emit::FirstMatch,
            Some(Batch {
                element: PathStep::At(n),
                ..
            }) => Emit::At(*n),
            Some(_) => Emit::Each,
        }
    }

    /// Completes the loop that begins at step `at`, now that its steps are known.
    fn close_loop(&mut self, at: usize, count: Option<u32>, emit: Emit, name: u32) {
        let steps = self.plan.ops.get(at + 1..).unwrap_or(&[]);
        let min = least(steps);
        let body = steps.len() as u32;
        self.forget();
        let empty = Op::Run {
            size: 0,
            align: 1,
            need: 0,
            reads: (0, 0),
            name,
        };
        let done = match (min, count) {
            // Elements without bytes (an empty ROS 1 message): only the count is there.
            (0, None) => Some(empty),
            (0, Some(_)) | (_, Some(0)) => None,
            _ => Some(Op::Loop {
                count,
                body,
                min,
                emit,
                name,
            }),
        };
        if min == 0 || count == Some(0) {
            self.plan.ops.truncate(at);
            self.plan.ops.extend(done);
        } else if let (Some(slot), Some(op)) = (self.plan.ops.get_mut(at), done) {
            *slot = op;
        }
    }

    /// Brings the position to a multiple of `to`, now if it is known, else during the walk.
    fn align(&mut self, to: usize) {
        if self.layout == Layout::Ros1 || to == 1 {
            return;
        }
        if to > self.modulus {
            self.flush();
            self.plan.ops.push(Op::Align(to));
            self.modulus = to;
            self.residue = 0;
            return;
        }
        let gap = self.residue.next_multiple_of(to) - self.residue;
        if gap > 0 {
            match &mut self.block {
                Some(block) => block.0 += gap,
                None => self.plan.ops.push(Op::Align(to)),
            }
            self.advance(gap);
        }
    }

    fn advance(&mut self, len: usize) {
        self.residue = (self.residue + len) % self.modulus;
    }

    /// Forgets the position, which is unknown after something of unknown length.
    fn forget(&mut self) {
        self.modulus = 1;
        self.residue = 0;
    }

    /// Ends the block being filled.
    fn flush(&mut self) {
        if let Some((len, reads, marks)) = self.block.take() {
            self.plan.ops.push(Op::Block {
                len,
                reads: (reads as u32, self.plan.reads.len() as u32),
                marks: (marks as u32, self.plan.marks.len() as u32),
            });
        }
    }

    fn name(&mut self) -> u32 {
        let name = crate::text::printable(&path_text(self.schema, &self.path));
        self.plan.names.push(name.into());
        self.plan.names.len() as u32 - 1
    }
}

/// Fewest bytes these steps take.
fn least(steps: &[Op]) -> usize {
    let mut sum = 0_usize;
    let mut at = 0;
    while let Some(op) = steps.get(at) {
        at += 1;
        sum = sum.saturating_add(match *op {
            Op::Align(_) => 0,
            Op::Block { len, .. } => len,
            Op::Text { .. } | Op::Run { .. } => 4,
            Op::Loop {
                count, body, min, ..
            } => {
                at += body as usize;
                count.map_or(4, |n| (n as usize).saturating_mul(min))
            }
        });
    }
    sum
}
