//! Promise: what a browser shows is what the daemon said.
//!
//! A headless Chromium on real pages of a real daemon, everything on loopback.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[allow(dead_code)]
#[path = "serve/client.rs"]
mod client;
#[allow(dead_code)]
#[path = "serve/daemon.rs"]
mod daemon;
mod page {
    pub(crate) mod browser;

    mod admission;
    mod controls;
    mod drawing;
    mod late;
    mod live_numbers;
    mod model_top;
    mod playback;
    mod staying_up;
}
