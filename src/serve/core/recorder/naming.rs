//! The name given -> the names of the files. I/O (looks at the folder).

use super::Split;
use std::path::{Path, PathBuf};

/// Names in the order in which files are begun.
#[derive(Debug)]
pub(super) struct Names {
    path: PathBuf,
    numbered: bool,
    next: u64,
}

impl Names {
    pub(super) fn new(path: &Path, split: Option<Split>) -> Names {
        Names {
            path: path.to_owned(),
            numbered: split.is_some(),
            next: 0,
        }
    }

    /// The next name. Numbered names go on behind whatever is there; the plain name comes first,
    /// whether it is there or not, and later again once somebody has moved the file away.
    pub(super) fn next(&mut self) -> PathBuf {
        if !self.numbered && (self.next == 0 || !self.path.exists()) {
            self.next = self.next.max(1);
            return self.path.clone();
        }
        loop {
            let name = self.number(self.next);
            self.next += 1;
            if name.symlink_metadata().is_err() {
                return name;
            }
        }
    }

    /// Whether there are others to go on to behind this name.
    pub(super) fn is_numbered(&self, name: &Path) -> bool {
        name != self.path
    }

    fn number(&self, n: u64) -> PathBuf {
        let mut name = self.path.file_stem().unwrap_or_default().to_owned();
        name.push(format!("_{n:04}."));
        name.push(self.path.extension().unwrap_or("mcap".as_ref()));
        self.path.with_file_name(name)
    }
}
