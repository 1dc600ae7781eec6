//! Quaternion <-> its four numbers in a saved state. Pure.
//!
//! Not an implementation of serde's traits: nothing is checked here, and whoever reads a state asks
//! [`is_unit`](crate::plausible::is_unit) before it is used.

use super::Quaternion;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(crate) fn serialize<To, From, S: Serializer>(
    q: &Quaternion<To, From>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    q.wxyz().serialize(serializer)
}

pub(crate) fn deserialize<'de, To, From, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Quaternion<To, From>, D::Error> {
    <[f64; 4]>::deserialize(deserializer).map(Quaternion::assume_unit)
}
