//! Finished bytes -> a file that is whole or absent, or a pipe. I/O.
//!
//! A stage of its own because everything that can go wrong with a disk is here, and nothing about
//! formats is. A regular file is written under a temporary name in the same directory, synced, and
//! given its name only when complete: a run that dies leaves no finished-looking file.

use super::claim::{claim, is_busy, unclaimed};
use super::socket::{Conversation, Tcp, Udp};
use super::target::Target;
use super::upload::Upload;
use crate::error::{Error, Result};
use crate::shell::quoted_file;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;

/// Name of standard output in messages.
pub(super) const STDOUT_NAME: &str = "standard output";

/// Whether whoever reads the output still wants more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[must_use]
pub enum Flow {
    /// Go on.
    Continue,
    /// The reader hung up (broken pipe): end quietly.
    Closed,
}

/// An open output.
#[derive(Debug)]
pub(super) enum Output {
    /// A regular file, not yet under its own name.
    Part(PartFile),
    /// Something that is not a regular file (a named pipe, a device): written in place.
    Direct {
        /// Path under which it is written.
        path: PathBuf,
        /// Open for writing.
        file: File,
    },
    /// An object in a store, not yet there.
    Upload(Upload),
    /// Standard output.
    Stdout(io::Stdout),
    /// Somebody who listens.
    Tcp(Tcp),
    /// Somebody who may listen.
    Udp(Udp),
    /// Another program, in its own protocol.
    Conversation(Conversation),
    /// Nowhere.
    Null,
}

impl Output {
    /// Opens `target`, after checking that it replaces nothing it should not.
    ///
    /// # Errors
    /// [`Error::OutputExists`], [`Error::OutputIsInput`], [`Error::Write`].
    pub(super) fn open(target: &Target, inputs: &[PathBuf], force: bool) -> Result<Output> {
        match target {
            // Who listens is served, not written to.
            Target::Null | Target::Listen(_) => Ok(Output::Null),
            Target::Tcp(address) => Tcp::connect(address).map(Output::Tcp),
            Target::Udp { address, .. } => {
                Udp::to(&format!("udp://{address}"), address).map(Output::Udp)
            }
            Target::Protocol(recipient) => Conversation::with(recipient).map(Output::Conversation),
            Target::Stdout => Ok(Output::Stdout(io::stdout())),
            Target::File { path, .. } => Output::file(path, inputs, force),
            Target::Store { address, .. } => Upload::begin(address, force).map(Output::Upload),
        }
    }

    /// Opens the file `path`, whatever it is filled with.
    ///
    /// # Errors
    /// As [`Output::open`].
    pub(super) fn file(path: &Path, inputs: &[PathBuf], force: bool) -> Result<Output> {
        let write_error = |source| Error::Write {
            path: path.to_path_buf(),
            source,
        };
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => {
                return Err(write_error(io::Error::new(
                    ErrorKind::IsADirectory,
                    "is a directory; name a file in it",
                )));
            }
            Ok(found) => {
                if is_one_of(path, &found, inputs) {
                    return Err(Error::OutputIsInput {
                        path: path.to_path_buf(),
                    });
                }
                if !found.is_file() {
                    let file = OpenOptions::new()
                        .write(true)
                        .open(path)
                        .map_err(write_error)?;
                    return Ok(Output::Direct {
                        path: path.to_path_buf(),
                        file,
                    });
                }
                if !force {
                    return Err(Error::OutputExists {
                        path: path.to_path_buf(),
                    });
                }
            }
            // A dangling link is somebody's name too.
            Err(_) if fs::symlink_metadata(path).is_ok() && !force => {
                return Err(Error::OutputExists {
                    path: path.to_path_buf(),
                });
            }
            Err(_) => {}
        }
        // Through a link the file it points to is replaced, not the link.
        let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        unclaimed(&place).map_err(write_error)?;
        PartFile::create(path, &place, inputs, force).map(Output::Part)
    }

    /// The file's name, if it has one.
    pub(super) fn path(&self) -> Option<&Path> {
        match self {
            Output::Part(part) => Some(&part.shown),
            Output::Direct { path, .. } => Some(path),
            Output::Upload(upload) => Some(&upload.shown),
            Output::Stdout(_)
            | Output::Tcp(_)
            | Output::Udp(_)
            | Output::Conversation(_)
            | Output::Null => None,
        }
    }

    /// Whether it is a connection to somebody.
    pub(super) fn is_socket(&self) -> bool {
        matches!(
            self,
            Output::Tcp(_) | Output::Udp(_) | Output::Conversation(_)
        )
    }

    /// Hands all of `bytes` over.
    ///
    /// # Errors
    /// [`Error::Write`], but for a broken pipe.
    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<Flow> {
        let result = match self {
            Output::Part(part) => part.file.write_all(bytes),
            Output::Direct { file, .. } => file.write_all(bytes),
            Output::Upload(upload) => upload.write(bytes),
            Output::Stdout(stdout) => stdout.write_all(bytes),
            Output::Tcp(tcp) => tcp.write(bytes),
            Output::Udp(udp) => udp.write(bytes),
            Output::Conversation(talk) => talk.write(bytes),
            Output::Null => Ok(()),
        };
        self.judge(result)
    }

    /// Pushes out what the operating system has not been given yet.
    ///
    /// # Errors
    /// [`Error::Write`], but for a broken pipe.
    pub(super) fn flush(&mut self) -> Result<Flow> {
        let result = match self {
            Output::Stdout(stdout) => stdout.flush(),
            // The others are unbuffered.
            _ => Ok(()),
        };
        self.judge(result)
    }

    /// Everything is written: make it durable and give it its name.
    ///
    /// # Errors
    /// [`Error::Write`]; [`Error::OutputExists`] when somebody else created the file meanwhile.
    pub(super) fn finish(mut self) -> Result<Flow> {
        let flow = self.flush()?;
        if let Output::Tcp(tcp) = &self {
            return self.judge(tcp.finish());
        }
        match self {
            Output::Part(part) => part.publish()?,
            Output::Upload(upload) => upload.finish()?,
            Output::Udp(udp) => udp.finish(),
            Output::Conversation(talk) => talk.finish(),
            Output::Direct { .. } | Output::Stdout(_) | Output::Tcp(_) | Output::Null => {}
        }
        Ok(flow)
    }

    fn judge(&self, result: io::Result<()>) -> Result<Flow> {
        let socket = match self {
            Output::Tcp(tcp) => Some(tcp.name()),
            Output::Udp(udp) => Some(udp.name()),
            Output::Conversation(talk) => Some(talk.name()),
            _ => None,
        };
        if let (Some(name), Err(why)) = (socket, &result) {
            // Whoever else is written to is not to suffer for it.
            tracing::error!("{name}: {why}; nothing more is sent there");
            return Ok(Flow::Closed);
        }
        match result {
            Ok(()) => Ok(Flow::Continue),
            Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(Flow::Closed),
            Err(source) => Err(Error::Write {
                path: self.path().unwrap_or(Path::new(STDOUT_NAME)).into(),
                source,
            }),
        }
    }
}

/// A file under its temporary name `.<name>.part`. Dropped before [`PartFile::publish`], it is removed.
#[derive(Debug)]
pub(super) struct PartFile {
    file: File,
    part: PathBuf,
    /// Path at which it will lie, links resolved.
    place: PathBuf,
    /// The name the user gave, for messages.
    shown: PathBuf,
    force: bool,
    published: bool,
}

impl PartFile {
    fn create(shown: &Path, place: &Path, inputs: &[PathBuf], force: bool) -> Result<PartFile> {
        let write_error = |source| Error::Write {
            path: shown.to_path_buf(),
            source,
        };
        let Some(name) = place.file_name() else {
            return Err(write_error(io::Error::new(
                ErrorKind::InvalidInput,
                "names no file",
            )));
        };
        let mut part_name = std::ffi::OsString::from(".");
        part_name.push(name);
        part_name.push(".part");
        let part = place.with_file_name(part_name);

        let file = Self::open_and_lock(&part, inputs).map_err(|error| match error {
            PartError::IsInput => Error::OutputIsInput { path: part.clone() },
            PartError::Io(e) if e.kind() == ErrorKind::NotFound => {
                write_error(no_folder(place.parent().unwrap_or(Path::new("."))))
            }
            PartError::Io(e) => write_error(e),
        })?;
        Ok(PartFile {
            file,
            part,
            place: place.to_path_buf(),
            shown: shown.to_path_buf(),
            force,
            published: false,
        })
    }

    /// Takes over what a killed run has left behind, but not what a living run is writing.
    fn open_and_lock(part: &Path, inputs: &[PathBuf]) -> std::result::Result<File, PartError> {
        // A few rounds: between opening and locking the other run may finish and rename its file.
        for _ in 0..8 {
            if fs::symlink_metadata(part).is_ok_and(|m| !m.is_file()) {
                return Err(PartError::Io(io::Error::new(
                    ErrorKind::AlreadyExists,
                    format!("{} is in the way and is no regular file", part.display()),
                )));
            }
            let file = OpenOptions::new()
                .create(true)
                .truncate(false)
                .write(true)
                .open(part)?;
            // A file system without locks: then there is no such protection.
            if let Err(e) = claim(&file)
                && is_busy(&e)
            {
                return Err(PartError::Io(e));
            }
            let opened = file.metadata()?;
            if is_named(&opened, part) {
                if is_one_of(part, &opened, inputs) {
                    return Err(PartError::IsInput);
                }
                file.set_len(0)?;
                return Ok(file);
            }
        }
        Err(PartError::Io(io::Error::new(
            ErrorKind::ResourceBusy,
            format!("other runs keep writing it (as {})", part.display()),
        )))
    }

    /// Syncs the file, gives it its name, syncs the directory.
    fn publish(mut self) -> Result<()> {
        let write_error = |source| Error::Write {
            path: self.shown.clone(),
            source,
        };
        self.file.sync_all().map_err(write_error)?;
        if self.force {
            // Somebody may have begun to write there meanwhile.
            let _kept = unclaimed(&self.place).map_err(write_error)?;
            fs::rename(&self.part, &self.place).map_err(write_error)?;
        } else {
            // A link, unlike a rename, never replaces a file that appeared while we were writing.
            match fs::hard_link(&self.part, &self.place) {
                Ok(()) => fs::remove_file(&self.part).map_err(write_error)?,
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                    return Err(Error::OutputExists {
                        path: self.shown.clone(),
                    });
                }
                // A file system without hard links: look, then rename.
                Err(_) if fs::symlink_metadata(&self.place).is_ok() => {
                    return Err(Error::OutputExists {
                        path: self.shown.clone(),
                    });
                }
                Err(_) => fs::rename(&self.part, &self.place).map_err(write_error)?,
            }
        }
        sync_directory(&self.place).map_err(write_error)?;
        self.published = true;
        Ok(())
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        if !self.published {
            // Nobody is left to tell; the name says what it is.
            let _ = fs::remove_file(&self.part);
        }
    }
}

enum PartError {
    IsInput,
    Io(io::Error),
}

impl From<io::Error> for PartError {
    fn from(e: io::Error) -> PartError {
        PartError::Io(e)
    }
}

/// The folder of an output is not there. It is not made: its name may be a slip of the hand.
#[must_use]
pub fn no_folder(folder: &Path) -> io::Error {
    let name = folder.display();
    let scheme = folder.to_str().and_then(|text| text.split_once(':'));
    let is_address = scheme.is_some_and(|(scheme, rest)| {
        let is_word = scheme.len() > 1 && scheme.bytes().all(|b| b.is_ascii_alphanumeric());
        is_word && (rest.is_empty() || rest.starts_with("//"))
    });
    let said = if is_address {
        Diagnostic::new("this is written to a file, not to an address")
            .help("name a file, and copy it there; attitudes alone go to s3://, gs:// and az:// by themselves")
    } else {
        Diagnostic::new(format!("the directory {name} does not exist"))
            .help(format!("make it: mkdir -p {}", quoted_file(folder)))
    };
    io::Error::new(ErrorKind::NotFound, said)
}

/// A renamed file survives a power cut only when its directory is on the disk too.
pub fn sync_directory(file: &Path) -> io::Result<()> {
    #[cfg(unix)]
    {
        let parent = match file.parent() {
            Some(p) if !p.as_os_str().is_empty() => p,
            _ => Path::new("."),
        };
        match File::open(parent).and_then(|d| d.sync_all()) {
            // Some network file systems cannot.
            Err(e) if matches!(e.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {}
            // A directory one may write to but not list; the file itself is synced.
            Err(e) if e.kind() == ErrorKind::PermissionDenied => {}
            other => return other,
        }
    }
    let _ = file;
    Ok(())
}

/// Whether `path` is one of `inputs`, by whatever name.
fn is_one_of(path: &Path, metadata: &Metadata, inputs: &[PathBuf]) -> bool {
    let canonical = fs::canonicalize(path).ok();
    inputs.iter().any(|input| {
        let same_name = canonical.is_some() && fs::canonicalize(input).ok() == canonical;
        same_name || fs::metadata(input).is_ok_and(|m| is_same_file(&m, metadata))
    })
}

/// Whether an open file still has this name; where the system does not tell, any file of that name is taken for it.
#[must_use]
pub fn is_named(opened: &Metadata, path: &Path) -> bool {
    let named = fs::symlink_metadata(path);
    named.is_ok_and(|named| !cfg!(unix) || is_same_file(opened, &named))
}

/// Device and inode agree: hard links are the same file.
#[cfg(unix)]
fn is_same_file(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    a.dev() == b.dev() && a.ino() == b.ino()
}

#[cfg(not(unix))]
fn is_same_file(_: &Metadata, _: &Metadata) -> bool {
    false
}
