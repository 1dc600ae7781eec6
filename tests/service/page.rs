//! Promise: what a browser shows is what the daemon said.
//!
//! A headless Chromium on real pages of a real daemon, everything on loopback.

pub(crate) mod browser;

mod admission;
mod controls;
mod drawing;
mod known;
mod late;
mod live_numbers;
mod model_top;
mod playback;
mod staying_up;
