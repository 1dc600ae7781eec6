//! Sockets, sources and browsers <-> sessions. I/O.
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`listen`] | sockets others come to -> sessions | I/O |
//! | `http`, `samples`, `resets` | requests -> pages, state, a WebSocket; samples and resets by `POST` -> hub | I/O |
//! | `page`, `top_page` | what a browser gets | pure |
//! | [`source`], [`connect`] | sockets others listen on: samples from there | I/O |
//! | [`output`], `forward` | attitudes to there | I/O |

pub mod connect;
pub(super) mod forward;
mod http;
pub mod listen;
pub mod output;
mod page;
mod resets;
mod samples;
pub mod source;
mod top_page;
