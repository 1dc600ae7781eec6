//! A file -> the lock of the one process that writes it. I/O.
//!
//! Apart from the outputs because a daemon writes its files in other ways, and whoever replaces a file has to see
//! that nobody is writing it. The system gives a lock back when its process ends, however that ends.

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::Path;
use std::thread;
use std::time::Duration;
use strapd_attitude::diagnostic::Diagnostic;

/// Time between two tries, and how many there are before the last.
const MOMENT: Duration = Duration::from_millis(10);
const TRIES: u32 = 3;

/// Locks an open file, for as long as it stays open.
///
/// # Errors
/// [`ErrorKind::ResourceBusy`]: another process has it ([`is_busy`]); any other: the file system has no locks.
pub(super) fn claim(file: &File) -> io::Result<()> {
    patiently(file, File::try_lock)
}

/// Locks a file that a daemon writes. A file system without locks is no reason to refuse: it is reported.
///
/// # Errors
/// [`ErrorKind::ResourceBusy`]: another process has it.
pub fn claim_or_warn(file: &File, path: &Path) -> io::Result<()> {
    match claim(file) {
        Err(e) if !is_busy(&e) => {
            tracing::warn!(
                "{}: cannot be locked ({e}): another daemon that writes it would not be noticed",
                path.display()
            );
            Ok(())
        }
        other => other,
    }
}

/// Sees that nobody writes the file of this name, and that nobody begins to while what is returned is kept.
///
/// # Errors
/// [`ErrorKind::ResourceBusy`]: another process writes it.
pub fn unclaimed(path: &Path) -> io::Result<Option<File>> {
    // To open a pipe is to wait for its other end.
    if !path.symlink_metadata().is_ok_and(|found| found.is_file()) {
        return Ok(None);
    }
    // One that may not be read may still be replaced.
    let Ok(file) = File::open(path) else {
        return Ok(None);
    };
    match patiently(&file, File::try_lock_shared) {
        Err(e) if is_busy(&e) => Err(e),
        _ => Ok(Some(file)),
    }
}

/// Whether another process has the file.
pub(super) fn is_busy(error: &io::Error) -> bool {
    error.kind() == ErrorKind::ResourceBusy
}

/// Locks a file, a moment later where it is locked: a process that another thread has just begun holds what this one has
/// closed, until it runs its own program.
fn patiently(
    file: &File,
    mut lock: impl FnMut(&File) -> Result<(), TryLockError>,
) -> io::Result<()> {
    for _ in 0..TRIES {
        match lock(file) {
            Err(TryLockError::WouldBlock) => thread::sleep(MOMENT),
            other => return told(file, other),
        }
    }
    told(file, lock(file))
}

fn told(file: &File, locked: Result<(), TryLockError>) -> io::Result<()> {
    match locked {
        Ok(()) => Ok(()),
        Err(TryLockError::Error(e)) => Err(e),
        Err(TryLockError::WouldBlock) => {
            let (who, which) = match holder(file) {
                Some(pid) => (format!("process {pid}"), format!("process {pid}")),
                None => ("another process".to_owned(), "it".to_owned()),
            };
            Err(io::Error::new(
                ErrorKind::ResourceBusy,
                Diagnostic::new(format!("{who} is writing it"))
                    .help(format!("end {which} first, or give this one another name")),
            ))
        }
    }
}

/// The process that has the lock, where the system tells.
#[cfg(target_os = "linux")]
fn holder(file: &File) -> Option<u32> {
    use std::io::Read;
    use std::os::unix::fs::MetadataExt;
    /// Bytes of the list that are looked at.
    const MOST: u64 = 4 << 20;
    let found = file.metadata().ok()?;
    let (device, inode) = (found.dev(), found.ino());
    let major = ((device >> 8) & 0xfff) | ((device >> 32) & !0xfff);
    let minor = (device & 0xff) | ((device >> 12) & !0xff);
    let place = format!("{major:02x}:{minor:02x}:{inode}");
    let mut locks = String::new();
    let list = File::open("/proc/locks").ok()?;
    list.take(MOST).read_to_string(&mut locks).ok()?;
    // 1: FLOCK  ADVISORY  WRITE 29544 fe:00:5783559 0 EOF
    locks.lines().find_map(|line| {
        let mut words = line.split_whitespace().skip(4);
        let pid = words.next()?.parse().ok().filter(|pid| *pid > 0);
        (words.next()? == place).then_some(pid)?
    })
}

#[cfg(not(target_os = "linux"))]
fn holder(_: &File) -> Option<u32> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_one_writer_and_its_process_is_named() -> io::Result<()> {
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("a");
        assert!(unclaimed(&path)?.is_none());
        let first = File::create(&path)?;
        claim(&first)?;
        let busy = |e: &io::Error| is_busy(e).then(|| e.to_string());
        let said = unclaimed(&path).err().as_ref().and_then(busy);
        assert!(said.is_some());
        if cfg!(target_os = "linux") {
            let pid = format!("process {}", std::process::id());
            assert!(said.is_some_and(|said| said.contains(&pid)));
        }
        assert!(claim(&File::open(&path)?).is_err());
        drop(first);
        let kept = unclaimed(&path)?;
        assert!(kept.is_some() && claim(&File::open(&path)?).is_err());
        drop(kept);
        claim(&File::open(&path)?)
    }

    #[test]
    fn a_lock_that_goes_in_a_moment_is_waited_for_and_no_longer() -> io::Result<()> {
        let file = tempfile::tempfile()?;
        let tried = |held: u32| {
            let mut tries = 0;
            let taken = patiently(&file, |_| {
                tries += 1;
                match tries > held {
                    true => Ok(()),
                    false => Err(TryLockError::WouldBlock),
                }
            });
            (taken.is_ok(), tries)
        };
        assert_eq!(tried(0), (true, 1));
        assert_eq!(tried(TRIES), (true, TRIES + 1));
        assert_eq!(tried(TRIES + 1), (false, TRIES + 1));
        Ok(())
    }
}
