//! A ZIP archive -> a folder that goes with this process. I/O.
//!
//! Apart from the folder because an archive is data from outside: its directory may lie about names, sizes and their
//! number. Phones export a folder of tables as one archive; unpacked it is that folder.

use super::input::MOST as MOST_BYTES;
use crate::error::{Error, Result};
use crate::format::open;
use crate::recognise::zip::{MARK, MOST as MOST_MEMBERS};
use crate::text::printable;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use tempfile::TempDir;
use zip::ZipArchive;
use zip::result::ZipError;

/// Bytes that one byte unpacks to at most: deflate reaches 1032. Members that share their bytes would exceed it.
const MOST_RATIO: u64 = 1032;

/// Folder with the members of an archive; removed with the last of its users.
#[derive(Debug)]
pub(super) struct Unpacked {
    folder: TempDir,
}

impl Unpacked {
    /// The folder.
    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Name of a file of the folder for messages: `phone.zip/Gyroscope.csv`.
    pub(super) fn name_of(&self, archive: &Path, file: &Path) -> PathBuf {
        file.strip_prefix(self.folder.path())
            .map_or_else(|_| archive.to_owned(), |inside| archive.join(inside))
    }
}

/// Whether a file begins as an archive does.
pub(super) fn is_zip(path: &Path) -> bool {
    let mut head = [0; 4];
    File::open(path)
        .and_then(|mut file| file.read_exact(&mut head))
        .is_ok_and(|()| &head == MARK)
}

/// Unpacks the files of the topmost folder that has any. Names with `..`, a drive or a root are left out.
///
/// # Errors
/// It is no whole archive, holds no file, has a password, unpacks to more than 8 GiB, or there is no room for it.
pub(super) fn unpack(path: &Path) -> Result<Unpacked> {
    let refuse = |what: Diagnostic| Error::unsupported(path, what);
    let file = open(path)?;
    let size = file.metadata().map_or(0, |found| found.len());
    let mut archive = ZipArchive::new(file).map_err(|e| refuse(broken(&e)))?;
    if archive.len() > MOST_MEMBERS {
        return Err(refuse(
            Diagnostic::new(format!("a ZIP archive of {} members", archive.len()))
                .help("unpack it, and name the folder of one recording"),
        ));
    }
    let members = topmost(&mut archive).map_err(|e| refuse(broken(&e)))?;
    if members.is_empty() {
        return Err(refuse(Diagnostic::new("a ZIP archive without a file")));
    }
    let no_room = |e: &io::Error| {
        refuse(
            Diagnostic::new(format!(
                "a ZIP archive is unpacked to {}: {e}",
                std::env::temp_dir().display()
            ))
            .help("TMPDIR=FOLDER with room, or unpack it first and name the folder"),
        )
    };
    let folder = tempfile::tempdir().map_err(|e| no_room(&e))?;
    // Whatever the archive says of its sizes.
    let most = MOST_BYTES.min(size.saturating_mul(MOST_RATIO));
    let mut left = most;
    for (name, index) in members {
        let mut member = archive.by_index(index).map_err(|e| refuse(broken(&e)))?;
        let mut into = File::create(folder.path().join(&name)).map_err(|e| no_room(&e))?;
        // One byte more than there is room for tells that there is more.
        let copied = io::copy(&mut (&mut member).take(left + 1), &mut into).map_err(|e| {
            let shown = printable(&name);
            refuse(Diagnostic::new(format!(
                "a ZIP archive whose {shown} cannot be unpacked: {e}"
            )))
        })?;
        left = left.checked_sub(copied).ok_or_else(|| {
            refuse(
                Diagnostic::new(format!(
                    "a ZIP archive of more than {} GiB",
                    MOST_BYTES >> 30
                ))
                .help("unpack it, and name the log inside"),
            )
        })?;
    }
    Ok(Unpacked { folder })
}

/// Files of the topmost folder that has any, by their names; of two of one name the first.
fn topmost<R: Read + io::Seek>(
    archive: &mut ZipArchive<R>,
) -> std::result::Result<BTreeMap<String, usize>, ZipError> {
    let mut folders: BTreeMap<(usize, PathBuf), BTreeMap<String, usize>> = BTreeMap::new();
    for index in 0..archive.len() {
        let member = archive.by_index_raw(index)?;
        let Some(place) = member.enclosed_name().filter(|_| member.is_file()) else {
            continue;
        };
        let parts: Vec<_> = place.components().collect();
        let is_hidden = |part: &Component<'_>| {
            let name = part.as_os_str().to_string_lossy();
            name.starts_with('.') || name == "__MACOSX"
        };
        let name = place
            .file_name()
            .map(|name| name.to_string_lossy().into_owned());
        if let Some(name) = name.filter(|_| !parts.iter().any(is_hidden)) {
            let folder = place.parent().unwrap_or(Path::new("")).to_owned();
            let files = folders.entry((parts.len(), folder)).or_default();
            files.entry(name).or_insert(index);
        }
    }
    Ok(folders.into_values().next().unwrap_or_default())
}

fn broken(why: &ZipError) -> Diagnostic {
    match why {
        ZipError::UnsupportedArchive(what) if *what == ZipError::PASSWORD_REQUIRED => {
            Diagnostic::new("a ZIP archive with a password").help("unpack it, and name the folder")
        }
        other => Diagnostic::new(format!("a ZIP archive that cannot be read: {other}"))
            .help("unzip FILE -d FOLDER says more; a download that broke off has lost its end"),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::io::Write;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    /// An archive of these members on disk.
    fn archive(members: &[(&str, &[u8])]) -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("phone.zip");
        let mut writer = ZipWriter::new(File::create(&path).unwrap());
        for (name, bytes) in members {
            writer
                .start_file(*name, SimpleFileOptions::default())
                .unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap();
        (folder, path)
    }

    fn names(unpacked: &Unpacked) -> Vec<String> {
        let files = std::fs::read_dir(unpacked.path()).unwrap();
        let mut names: Vec<String> = files
            .map(|file| file.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn the_topmost_files_are_unpacked_and_nothing_leaves_the_folder() {
        let (folder, path) = archive(&[
            ("run/Gyroscope.csv", b"time,z,y,x\n"),
            ("run/Accelerometer.csv", b"a"),
            ("run/meta/device.csv", b"b"),
            ("__MACOSX/run.csv", b"c"),
            (".DS_Store", b"d"),
            ("../../outside.csv", b"e"),
        ]);
        assert!(is_zip(&path));
        let unpacked = unpack(&path).unwrap();
        assert_eq!(names(&unpacked), ["Accelerometer.csv", "Gyroscope.csv"]);
        let inside = unpacked.path().join("Gyroscope.csv");
        assert_eq!(std::fs::read(&inside).unwrap(), b"time,z,y,x\n");
        assert_eq!(unpacked.name_of(&path, &inside), path.join("Gyroscope.csv"));
        assert!(!folder.path().join("../outside.csv").exists());
        let place = unpacked.path().to_owned();
        drop(unpacked);
        assert!(!place.exists(), "it goes with its last user");
    }

    #[test]
    fn an_archive_without_a_file_and_one_that_is_cut_are_refused() {
        let (_folder, path) = archive(&[("__MACOSX/a.csv", b"1")]);
        assert!(
            unpack(&path)
                .unwrap_err()
                .to_string()
                .contains("without a file")
        );
        let (_folder, path) = archive(&[("a.csv", &[b'1'; 5000])]);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 30]).unwrap();
        let said = unpack(&path).unwrap_err().to_string();
        assert!(
            said.contains("cannot be read") && said.contains("lost its end"),
            "{said}"
        );
    }

    #[test]
    fn changed_archives_neither_panic_nor_unpack_to_more_than_their_bytes_can_hold() {
        let table: Vec<u8> = (0..3000)
            .flat_map(|n: u32| format!("{n},0.1,0.2\n").into_bytes())
            .collect();
        let (_folder, path) =
            archive(&[("Gyroscope.csv", &table), ("a/b.csv", b"1"), ("c.csv", b"")]);
        let whole = std::fs::read(&path).unwrap();
        let mut seed = 1_u64;
        let mut random = |below: usize| {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as usize % below
        };
        let mut unpacked_some = 0;
        for _ in 0..2000 {
            let mut changed = whole.clone();
            for _ in 0..=random(3) {
                // Half of the changes in the directory at the end, where sizes and names are.
                let from = if random(2) == 0 { 0 } else { whole.len() - 250 };
                let at = from + random(whole.len() - from);
                changed[at] = random(256) as u8;
            }
            std::fs::write(&path, &changed).unwrap();
            if let Ok(unpacked) = unpack(&path) {
                unpacked_some += 1;
                let sizes = std::fs::read_dir(unpacked.path()).unwrap();
                let total: u64 = sizes.map(|f| f.unwrap().metadata().unwrap().len()).sum();
                assert!(total <= MOST_RATIO * changed.len() as u64);
            }
        }
        assert!(unpacked_some > 100, "{unpacked_some}");
    }
}
