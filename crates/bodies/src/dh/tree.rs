//! Frames known by name at run time -> velocity of one relative to another, resolved in a third. Pure.
//!
//! Beside [`RelativeMotion`], for frames that come from a file or a user. What the types refuse there
//! is an error here.

use super::{RelativeMotion, Transform};
use std::fmt;
use strapd_attitude::frames::{Dcm, In};

/// The root of a tree of named frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Root {}
/// The frame a new one is hung on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Parent {}
/// The new frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Child {}

/// The frame whose axes an answer is resolved in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Asked {}

/// Question for a velocity: the three names it needs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Question<'a> {
    /// Name of the frame whose velocity is asked for.
    pub of: &'a str,
    /// Name of the frame on which the observer rides.
    pub relative_to: &'a str,
    /// Name of the frame in whose axes the components are.
    pub resolved_in: &'a str,
}

/// Frames by name, each hung on one that is there already.
#[derive(Clone, Debug)]
pub struct FrameTree {
    frames: Vec<(String, RelativeMotion<Root, Child>)>,
}

impl FrameTree {
    /// A tree of one frame.
    #[must_use]
    pub fn new(root: &str) -> Self {
        let still = RelativeMotion::at_rest(Transform::identity());
        Self {
            frames: vec![(root.to_owned(), still)],
        }
    }

    /// Hangs `name` on `parent`, with its motion relative to that.
    ///
    /// # Errors
    /// [`FrameTreeError::Unknown`] parent, [`FrameTreeError::Twice`] when the name is taken.
    pub fn add(
        &mut self,
        name: &str,
        parent: &str,
        motion: RelativeMotion<Parent, Child>,
    ) -> Result<(), FrameTreeError> {
        let p = self.find(parent)?;
        if self.find(name).is_ok() {
            return Err(FrameTreeError::Twice {
                name: name.to_owned(),
            });
        }
        self.frames.push((name.to_owned(), as_parent(&p) * motion));
        Ok(())
    }

    /// Velocity in m/s and angular rate in rad/s of `of` relative to `relative_to`, both resolved in
    /// `resolved_in`.
    ///
    /// # Errors
    /// [`FrameTreeError::Unknown`] for a name not in the tree.
    pub fn velocity(&self, asked: Question<'_>) -> Result<(In<Asked>, In<Asked>), FrameTreeError> {
        let of = self.find(asked.of)?;
        let observer = as_parent(&self.find(asked.relative_to)?);
        let axes = self.find(asked.resolved_in)?.pose().rotation().transpose();
        let axes = Dcm::<Asked, Root>::assume(*axes.as_matrix());
        let seen = observer.inverse() * of;
        let c = axes * observer.pose().rotation();
        Ok((seen.velocity_in(c), seen.rate_in(c)))
    }

    fn find(&self, name: &str) -> Result<RelativeMotion<Root, Child>, FrameTreeError> {
        let found = self.frames.iter().find(|(n, _)| n == name);
        found.map(|(_, m)| *m).ok_or_else(|| {
            let known: Vec<&str> = self.frames.iter().map(|(n, _)| n.as_str()).collect();
            FrameTreeError::Unknown {
                name: name.to_owned(),
                known: known.join(", "),
            }
        })
    }
}

/// The same frame, now as one that others hang on.
fn as_parent(m: &RelativeMotion<Root, Child>) -> RelativeMotion<Root, Parent> {
    let c = Dcm::assume(*m.pose().rotation().as_matrix());
    let pose = Transform::new(c, m.pose().translation());
    RelativeMotion::new(pose, m.velocity(), m.rate())
}

/// A name that does not fit the tree.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum FrameTreeError {
    /// Unknown frame.
    Unknown {
        /// Name that was asked for.
        name: String,
        /// Names of the frames that exist.
        known: String,
    },
    /// Second frame of the same name.
    Twice {
        /// Name that was given twice.
        name: String,
    },
}

impl fmt::Display for FrameTreeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { name, known } => write!(f, "no frame `{name}`; known: {known}"),
            Self::Twice { name } => write!(f, "there is a frame `{name}` already"),
        }
    }
}

impl std::error::Error for FrameTreeError {}
