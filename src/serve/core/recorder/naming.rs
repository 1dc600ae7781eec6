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
        // One in the middle may have been moved away: it would come before those that are older.
        self.next = self.next.max(self.behind_all());
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

    /// The number behind all that are in the folder.
    fn behind_all(&self) -> u64 {
        let folder = match self.path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let number = |name: &str| {
            let digits = name.strip_prefix(&*stem)?.strip_prefix('_')?;
            let number = digits.split('.').next()?.parse::<u32>().ok()?.into();
            (self.number(number).file_name()?.to_str()? == name).then_some(number)
        };
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let numbers = entries.filter_map(|entry| number(entry.file_name().to_str()?));
        numbers.max().map_or(0, |last| last.saturating_add(1))
    }

    fn number(&self, n: u64) -> PathBuf {
        let mut name = self.path.file_stem().unwrap_or_default().to_owned();
        name.push(format!("_{n:04}."));
        name.push(self.path.extension().unwrap_or("mcap".as_ref()));
        self.path.with_file_name(name)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn numbers_go_on_behind_the_last_though_one_before_it_was_moved_away() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rec.mcap");
        let split = Some(Split::Every(Duration::from_secs(60)));
        for there in [
            "rec_0001.mcap",
            "rec_0007.txt",
            "rec_8.mcap",
            "rec_x.mcap",
            "other_0009.mcap",
        ] {
            std::fs::write(folder.path().join(there), []).unwrap();
        }
        let mut names = Names::new(&path, split);
        let name = names.next();
        assert_eq!(name.file_name().unwrap(), "rec_0002.mcap");
        std::fs::write(name, []).unwrap();
        assert_eq!(names.next().file_name().unwrap(), "rec_0003.mcap");
    }
}
