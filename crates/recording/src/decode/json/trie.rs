//! The paths of `--field` as a tree of keys. Pure.

use crate::decode::fields::{FieldPath, FieldRole, Segment};
use crate::decode::registers::Slot;
use strapd_attitude::record::TimeUnit;

/// Nodes; 0 is the message.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trie {
    nodes: Vec<Node>,
    given: Vec<FieldRole>,
}

#[derive(Debug, Clone, Default)]
struct Node {
    children: Vec<(Segment, usize)>,
    target: Option<Target>,
}

/// Target of the value at the end of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// A whole vector or quaternion.
    Whole(FieldRole),
    /// One number.
    Number(Slot, TimeUnit),
    Stamp(TimeUnit),
}

impl Trie {
    pub(crate) fn new(fields: &[FieldPath]) -> Self {
        let mut trie = Trie {
            nodes: vec![Node::default()],
            given: fields.iter().map(|f| f.role).collect(),
        };
        for field in fields {
            let unit = field.unit.unwrap_or_default();
            let base = match field.role {
                FieldRole::Gyro => Slot::GYRO,
                FieldRole::Accel => Slot::ACCEL,
                FieldRole::Mag => Slot::MAG,
                FieldRole::Orientation => Slot::ORIENTATION,
                FieldRole::Stamp | FieldRole::Interval => Slot::INTERVAL,
                FieldRole::Temperature => Slot::TEMPERATURE,
            };
            for (n, path) in (0_u8..).zip(&field.paths) {
                let target = match field.role {
                    FieldRole::Stamp => Target::Stamp(unit),
                    FieldRole::Interval | FieldRole::Temperature => Target::Number(base, unit),
                    role if field.paths.len() == 1 => Target::Whole(role),
                    _ => Target::Number(base.plus(n), unit),
                };
                trie.insert(path, target);
            }
        }
        trie
    }

    fn insert(&mut self, path: &[Segment], target: Target) {
        let mut at = 0;
        for segment in path {
            let known = self.nodes.get(at).and_then(|node| {
                let child = node.children.iter().find(|(s, _)| s == segment);
                child.map(|(_, next)| *next)
            });
            at = known.unwrap_or_else(|| {
                let next = self.nodes.len();
                self.nodes.push(Node::default());
                if let Some(node) = self.nodes.get_mut(at) {
                    node.children.push((segment.clone(), next));
                }
                next
            });
        }
        if let Some(node) = self.nodes.get_mut(at) {
            node.target = Some(target);
        }
    }

    /// Whether `--field` gave this role, so that it is not looked for by name.
    pub(crate) fn gives(&self, role: FieldRole) -> bool {
        self.given.contains(&role)
    }

    /// The node behind a key.
    pub(crate) fn key(&self, at: Option<usize>, key: &str) -> Option<usize> {
        let node = self.nodes.get(at?)?;
        let child = node
            .children
            .iter()
            .find(|(s, _)| matches!(s, Segment::Name(name) if name == key));
        child.map(|(_, next)| *next)
    }

    /// The node behind an element, and whether it is one of a batch.
    pub(crate) fn element(&self, at: Option<usize>, index: u32) -> Option<(usize, bool)> {
        let node = self.nodes.get(at?)?;
        node.children.iter().find_map(|(s, next)| match s {
            Segment::At(n) if *n == index => Some((*next, false)),
            Segment::Each => Some((*next, true)),
            _ => None,
        })
    }

    pub(crate) fn target(&self, at: usize) -> Option<Target> {
        self.nodes.get(at)?.target
    }
}
