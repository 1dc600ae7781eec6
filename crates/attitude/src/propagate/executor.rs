//! Independent pieces of work -> their results, in order. Pure.
//!
//! The propagator does not know about threads. It cuts its work at fixed sample counts and combines
//! the results in order, so one thread or many give the same bits.

/// Something that can compute `f(0) .. f(n - 1)`, on as many threads as it likes.
pub trait Executor {
    /// The results, in the order of their arguments.
    fn map<T: Send, F: Fn(usize) -> T + Sync>(&self, n: usize, f: F) -> Vec<T>;

    /// Number of tasks that run at once.
    fn threads(&self) -> usize {
        1
    }
}

/// One after another, on the calling thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequential;

impl Executor for Sequential {
    fn map<T: Send, F: Fn(usize) -> T + Sync>(&self, n: usize, f: F) -> Vec<T> {
        (0..n).map(f).collect()
    }
}
