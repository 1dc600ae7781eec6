//! Selection of samples of a recording, and how its messages are read. Pure.
//!
//! Apart from the recording because it is asked for before there is one.

use crate::decode::{self, FieldPath};

/// Selection of samples of a recording, and how its messages are read.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// `--topic`.
    pub topic: Option<String>,
    /// `--field`, `--ignore-covariance-flag`.
    pub decode: decode::Options,
    /// `--accel-topic`.
    pub accel: Option<TopicBeside>,
    /// `--mag-topic`.
    pub mag: Option<TopicBeside>,
}

/// A topic whose specific forces, or magnetic fields, belong to the samples of another.
#[derive(Clone, Debug)]
pub struct TopicBeside {
    /// Name.
    pub topic: String,
    /// Path of the vector: the `--field` of its role.
    pub fields: Vec<FieldPath>,
}
