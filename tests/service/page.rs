//! Promise: what a browser shows is what the daemon said.
//!
//! A headless Chromium on real pages of a real daemon, everything on loopback.

pub(crate) mod browser;

mod admission;
mod controls;
mod drawing;
mod fleet;
mod known;
mod late;
mod layout;
mod live_numbers;
mod looking;
mod model_top;
mod playback;
mod printing;
mod saving;
mod staying_up;
mod whole;
