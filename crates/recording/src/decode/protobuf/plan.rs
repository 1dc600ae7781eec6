//! [`Schema`] and [`Selection`] -> [`Program`]. Pure.

use super::{Action, Emit, MAX_COUNTERS, Node, Program};
use crate::decode::registers::Slot;
use crate::decode::schema::{Kind, Many, Number, Schema};
use crate::decode::select::{Batch, PathStep, Selection, path_text};
use std::collections::BTreeMap;

/// Compiles the plan that reads `selection`, and of the batch only the element of this child frame.
///
/// # Errors
/// A sentence, when a path cannot be read from protobuf.
pub(crate) fn samples(
    schema: &Schema,
    selection: &Selection,
    child: Option<&str>,
) -> Result<Program, String> {
    let child = child.filter(|_| selection.child.is_some());
    let mut builder = Builder::new(schema, selection.batch.as_ref(), child.is_some());
    for pick in &selection.picks {
        builder.number(&pick.path, pick.slot)?;
    }
    if let (Some(path), Some(_)) = (&selection.child, child) {
        builder.text(path, Action::Match)?;
    }
    builder.plan.form = selection.form;
    builder.plan.batched = selection.batch.is_some();
    builder.plan.child = child.map(Into::into);
    Ok(builder.plan)
}

/// Compiles the plan that finds one string.
///
/// # Errors
/// As [`samples`].
pub(crate) fn text(schema: &Schema, path: &[PathStep]) -> Result<Program, String> {
    let mut builder = Builder::new(schema, None, false);
    builder.text(path, Action::Capture)?;
    builder.plan.batched = true;
    Ok(builder.plan)
}

struct Builder<'a> {
    schema: &'a Schema,
    batch: Option<&'a Batch>,
    by_child: bool,
    plan: Program,
    /// Node of each path that has one.
    nodes: BTreeMap<Vec<PathStep>, usize>,
    counters: usize,
}

impl<'a> Builder<'a> {
    fn new(schema: &'a Schema, batch: Option<&'a Batch>, by_child: bool) -> Self {
        let plan = Program {
            nodes: vec![Node::default()],
            ..Program::default()
        };
        Builder {
            schema,
            batch,
            by_child,
            plan,
            nodes: BTreeMap::from([(Vec::new(), 0)]),
            counters: 0,
        }
    }

    /// Goes to the struct that holds the last field of `path`: its node and that field.
    fn descend(&mut self, path: &[PathStep]) -> Result<(usize, Leaf), String> {
        let unreadable = || format!("`{}` cannot be read", path_text(self.schema, path));
        let (mut structure, mut node) = (self.schema.root, 0);
        let mut walked = Vec::new();
        let mut steps = path.iter().peekable();
        while let Some(step) = steps.next() {
            let PathStep::Field(index) = step else {
                return Err(unreadable());
            };
            let field = self
                .schema
                .get(structure)
                .and_then(|s| s.fields.get(*index))
                .ok_or_else(unreadable)?;
            walked.push(*step);
            let array = walked.clone();
            let element = steps.next_if(|s| !matches!(s, PathStep::Field(_))).copied();
            walked.extend(element);
            match field.kind {
                Kind::Struct(inner) => {
                    structure = inner;
                    let emit = self.emit(&array);
                    // Of a repeated message outside the batch only one element could be meant, and
                    // protobuf merges them: the last wins, which nobody asked for.
                    if element.is_some() && emit == Emit::No && self.batch.is_some() {
                        return Err(unreadable());
                    }
                    node = self.child_node(node, field.number, &walked, emit);
                }
                Kind::Number(number) if steps.peek().is_none() => {
                    let element = match (element, field.many) {
                        (None, Many::One) => None,
                        (Some(PathStep::At(n)), Many::Sequence) => Some(n),
                        _ => return Err(unreadable()),
                    };
                    let leaf = Leaf {
                        field: field.number,
                        number: Some(number),
                        element,
                    };
                    return Ok((node, leaf));
                }
                Kind::Text if steps.peek().is_none() && element.is_none() => {
                    let leaf = Leaf {
                        field: field.number,
                        number: None,
                        element: None,
                    };
                    return Ok((node, leaf));
                }
                _ => return Err(unreadable()),
            }
        }
        Err(unreadable())
    }

    fn emit(&self, array: &[PathStep]) -> Emit {
        match self.batch.filter(|batch| batch.path == array) {
            None => Emit::No,
            Some(_) if self.by_child => Emit::FirstMatch,
            Some(Batch {
                element: PathStep::At(n),
                ..
            }) => Emit::At(*n),
            Some(_) => Emit::Each,
        }
    }

    fn child_node(&mut self, parent: usize, number: u32, path: &[PathStep], emit: Emit) -> usize {
        if let Some(&node) = self.nodes.get(path) {
            return node;
        }
        let node = self.plan.nodes.len();
        self.plan.nodes.push(Node {
            emit,
            name: path_text(self.schema, path).into(),
            ..Node::default()
        });
        self.nodes.insert(path.to_vec(), node);
        if let Some(parent) = self.plan.nodes.get_mut(parent) {
            parent.fields.push((number, Action::Into(node)));
        }
        node
    }

    fn number(&mut self, path: &[PathStep], slot: Slot) -> Result<(), String> {
        let (node, leaf) = self.descend(path)?;
        let number = leaf
            .number
            .ok_or_else(|| format!("`{}` is no number", path_text(self.schema, path)))?;
        let counter = self.counters;
        let Some(node) = self.plan.nodes.get_mut(node) else {
            return Ok(());
        };
        let Some(element) = leaf.element else {
            node.zeros |= slot.bits(1);
            node.fields.push((leaf.field, Action::Read(number, slot)));
            return Ok(());
        };
        let same = node.fields.iter_mut().find(|(n, _)| *n == leaf.field);
        if let Some((_, Action::Elements(_, wanted, _))) = same {
            wanted.push((element, slot));
            return Ok(());
        }
        if counter >= MAX_COUNTERS {
            return Err("too many repeated fields are wanted".to_owned());
        }
        self.counters += 1;
        let action = Action::Elements(number, vec![(element, slot)], counter);
        node.fields.push((leaf.field, action));
        Ok(())
    }

    fn text(&mut self, path: &[PathStep], action: Action) -> Result<(), String> {
        let (node, leaf) = self.descend(path)?;
        if leaf.number.is_some() {
            return Err(format!("`{}` is no text", path_text(self.schema, path)));
        }
        if let Some(node) = self.plan.nodes.get_mut(node) {
            node.fields.push((leaf.field, action));
        }
        Ok(())
    }
}

/// The field a path ends at.
struct Leaf {
    field: u32,
    number: Option<Number>,
    element: Option<u32>,
}
