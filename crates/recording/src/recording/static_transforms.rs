//! `/tf_static` of a recording -> how frames of a robot lie in each other. I/O.
//!
//! Apart from attitudes because these do not move: the sensor's mounting stands in them, which a user would otherwise
//! copy from the robot's description.

use super::channel_route::{Item, Route};
use super::log_channel::TF_STATIC;
use super::message_reader::MessageReader;
use super::opened::{AHEAD, Recording};
use crate::error::{Error, Result};
use crate::pool::Pool;
use crate::text::{named_few, snippet};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::ControlFlow;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::quaternion::Quaternion;

/// Most transforms that are kept: a robot has some hundred.
const MOST: usize = 10_000;

/// Returns a name without the slash that ROS 1 had before it.
fn plain(name: &str) -> &str {
    name.trim_start_matches('/')
}

/// Rotation between two frames, whose types no program knows beforehand.
type Turn = Quaternion<(), ()>;

/// Frames of a robot: of each child its parent, and the rotation of the child's vectors to the parent's.
#[derive(Clone, Debug, Default)]
pub struct StaticTransforms(BTreeMap<String, (String, Turn)>);

impl StaticTransforms {
    /// Reads them from a recording; of a child that is said several times the last counts.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn of(log: &Recording, pool: &Pool) -> Result<StaticTransforms> {
        let mut all = StaticTransforms::default();
        log.walk::<Error>(
            AHEAD,
            pool,
            |channel| {
                let is_theirs = plain(&channel.topic) == plain(TF_STATIC);
                is_theirs.then(|| Route::only_copied(channel.clone()))
            },
            |items| {
                for item in items.drain(..) {
                    let Item::Copy(message) = item else { continue };
                    let encoding = &message.channel.message_encoding;
                    let read = MessageReader::of(encoding, &message.data);
                    // A message that is cut says what stands before the cut.
                    let _: Option<()> = read.and_then(|mut reader| all.take(&mut reader));
                }
                Ok(ControlFlow::Continue(()))
            },
        )?;
        Ok(all)
    }

    /// Frame at the root of the tree that `frame` hangs in; `None` where it has no parent.
    #[must_use]
    pub fn root_of(&self, frame: &str) -> Option<&str> {
        let mut at = self.0.get(plain(frame))?.0.as_str();
        // Of a ring every frame is as good as any.
        for _ in 0..self.0.len() {
            match self.0.get(at) {
                Some((parent, _)) => at = parent,
                None => break,
            }
        }
        Some(at)
    }

    fn take(&mut self, reader: &mut MessageReader<'_>) -> Option<()> {
        for _ in 0..reader.word()? {
            let (parent, child, wxyz) = transform(reader)?;
            let turn = Turn::try_from_wxyz(wxyz).ok();
            if let Some(turn) = turn.filter(|_| self.0.len() < MOST) {
                self.0.insert(child, (parent, turn));
            }
        }
        Some(())
    }

    /// Rotation of a vector of `frame` to one of `base`, over whatever lies between.
    ///
    /// # Errors
    /// In words: they are not connected, or one of them is not there.
    pub fn rotation(&self, frame: &str, base: &str) -> std::result::Result<Turn, Diagnostic> {
        let (frame, base) = (plain(frame), plain(base));
        let mut beside: BTreeMap<&str, Vec<(&str, Turn)>> = BTreeMap::new();
        for (child, (parent, turn)) in &self.0 {
            // To the parent by the rotation, to the child by its inverse.
            beside.entry(child).or_default().push((parent, *turn));
            let back = turn.inverse();
            beside.entry(parent).or_default().push((child, back));
        }
        let mut known: BTreeSet<&str> = BTreeSet::from([frame]);
        let mut waiting = VecDeque::from([(frame, Turn::identity())]);
        while let Some((at, turn)) = waiting.pop_front() {
            if at == base {
                return Ok(turn.normalised());
            }
            for (next, step) in beside.get(at).into_iter().flatten() {
                if known.insert(next) {
                    waiting.push_back((next, *step * turn));
                }
            }
        }
        let names: BTreeSet<&str> = beside.keys().copied().collect();
        let names: Vec<&str> = names.into_iter().collect();
        let (frame, base) = (snippet(frame.as_bytes()), snippet(base.as_bytes()));
        Err(Diagnostic::new(match names.as_slice() {
            [] => format!("there is no {TF_STATIC} that says how {frame} lies in {base}"),
            _ => format!(
                "{TF_STATIC} does not say how {frame} lies in {base}; it holds {}",
                named_few(&names)
            ),
        }))
    }
}

/// Parent, child and rotation of one `geometry_msgs/TransformStamped`.
fn transform(reader: &mut MessageReader<'_>) -> Option<(String, String, [f64; 4])> {
    let _stamp = reader.stamp()?;
    let [parent, child] = [reader.text()?, reader.text()?].map(|name| plain(&name).to_owned());
    let _translation = [reader.number()?, reader.number()?, reader.number()?];
    let [x, y, z, w] = [
        reader.number()?,
        reader.number()?,
        reader.number()?,
        reader.number()?,
    ];
    Some((parent, child, [w, x, y, z]))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use strapd_attitude::quaternion::RotationVector;

    fn about(axis: [f64; 3], angle: f64) -> Turn {
        Turn::from_rotation_vector(&RotationVector(Vector3::from(axis) * angle))
    }

    /// One message of ROS 1 with these transforms.
    fn message(transforms: &[(&str, &str, Turn)]) -> Vec<u8> {
        let mut out = (transforms.len() as u32).to_le_bytes().to_vec();
        for (parent, child, turn) in transforms {
            out.extend([0; 12]);
            for name in [parent, child] {
                out.extend((name.len() as u32).to_le_bytes());
                out.extend(name.as_bytes());
            }
            let [w, x, y, z] = turn.wxyz();
            for number in [1.0, 2.0, 3.0, x, y, z, w] {
                out.extend(number.to_le_bytes());
            }
        }
        out
    }

    #[test]
    fn a_rotation_goes_up_and_down_the_tree() {
        let (mast, imu, camera) = (
            about([0.0, 0.0, 1.0], 0.5),
            about([1.0, 0.0, 0.0], std::f64::consts::PI),
            about([0.0, 1.0, 0.0], -0.3),
        );
        let mut all = StaticTransforms::default();
        let said = [
            ("base_link", "mast", mast),
            ("/mast", "/imu_link", imu),
            ("base_link", "camera", camera),
        ];
        all.take(&mut MessageReader::ros1(&message(&said))).unwrap();
        let close = |found: Turn, expected: Turn| found.angle_to(&expected) < 1e-12;
        assert!(close(
            all.rotation("imu_link", "base_link").unwrap(),
            mast * imu
        ));
        assert!(close(all.rotation("/imu_link", "mast").unwrap(), imu));
        // Over the base and up another branch.
        let across = camera.inverse() * mast * imu;
        assert!(close(all.rotation("imu_link", "camera").unwrap(), across));
        assert!(close(
            all.rotation("imu_link", "imu_link").unwrap(),
            Turn::identity()
        ));
        let why = all.rotation("imu_link", "odom").unwrap_err().to_string();
        assert!(why.contains("odom") && why.contains("base_link"), "{why}");
    }

    #[test]
    fn a_ring_a_cut_and_what_is_no_rotation_end() {
        let turn = about([0.0, 0.0, 1.0], 0.1);
        let whole = message(&[("a", "b", turn), ("b", "a", turn), ("a", "c", turn)]);
        for length in 0..whole.len() {
            let mut all = StaticTransforms::default();
            let _ = all.take(&mut MessageReader::ros1(&whole[..length]));
            let _ = all.rotation("c", "nowhere");
        }
        let mut all = StaticTransforms::default();
        let none = Quaternion::assume_unit([0.0; 4]);
        all.take(&mut MessageReader::ros1(&message(&[("a", "b", none)])))
            .unwrap();
        assert!(all.rotation("b", "a").is_err());
    }
}
