//! Bytes of a client <-> what they say. Pure.
//!
//! | file | arrow |
//! |---|---|
//! | [`wire`] | lines and packed objects (cut by [`strapd_recording::decode::framing`]) -> requests; answers -> lines |
//! | [`upstream`] | lines of another daemon -> what it says of itself |
//! | [`foxglove`] | messages of Foxglove's viewers -> requests; answers -> messages |
//! | [`filter`], [`chunk`] | what a client wants to see; attitudes on their way to it |
//! | [`position`] | where a playback is, and what moves it |

pub mod chunk;
pub mod filter;
pub mod foxglove;
pub mod position;
pub mod upstream;
pub mod wire;
