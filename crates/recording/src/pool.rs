//! The worker pool. Work is cut at fixed counts and combined in order, so that the number of
//! threads changes nothing but the time.

use crate::error::{Error, Result};
use rayon::prelude::*;
use std::sync::Arc;
use strapd_attitude::propagate::Executor;

/// A pool of workers shared by reading, integrating and writing.
#[derive(Clone, Debug)]
pub struct Pool {
    pool: Arc<rayon::ThreadPool>,
}

impl Pool {
    /// `threads` workers; 0 = one per core.
    ///
    /// # Errors
    /// [`Error::Threads`]: the operating system gives none.
    pub fn new(threads: usize) -> Result<Pool> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("strapd-{i}"))
            .build()
            .map(|pool| Pool {
                pool: Arc::new(pool),
            })
            .map_err(|source| Error::Threads { threads, source })
    }

    /// The pool itself.
    #[must_use]
    pub fn rayon(&self) -> &Arc<rayon::ThreadPool> {
        &self.pool
    }

    /// Number of workers.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }
}

impl Executor for Pool {
    fn map<T: Send, F: Fn(usize) -> T + Sync>(&self, n: usize, f: F) -> Vec<T> {
        if n <= 1 || self.threads() == 1 {
            return (0..n).map(f).collect();
        }
        self.pool
            .install(|| (0..n).into_par_iter().map(&f).collect())
    }

    fn threads(&self) -> usize {
        Pool::threads(self)
    }
}
