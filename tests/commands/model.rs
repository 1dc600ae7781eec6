//! Promise: the model library answers at the command line what it answers in Rust, one line a request.

mod inertia;
mod top;
