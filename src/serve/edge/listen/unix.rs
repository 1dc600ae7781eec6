//! Unix socket -> sessions. I/O.

use super::duplex::{self, Duplex};
use super::{accept, initial_kind};
use crate::serve::core::context::Context;
use crate::serve::guard::peer::Peer;
use std::future::Future;
use std::io::{self, IoSlice};
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::io::Interest;
use tokio::net::{UnixListener, UnixStream};

/// A socket in the file system; its name goes when it does.
#[derive(Debug)]
pub struct Bound {
    listener: UnixListener,
    path: PathBuf,
    /// The name is ours to take away.
    owned: bool,
}

impl Bound {
    /// One that was opened for us: its name stays when we go.
    pub(super) fn passed(socket: std::os::unix::net::UnixListener) -> io::Result<(Bound, PathBuf)> {
        let listener = UnixListener::from_std(socket)?;
        let address = listener.local_addr()?;
        let path = address.as_pathname().unwrap_or(Path::new("/")).to_owned();
        let bound = Bound {
            listener,
            path: path.clone(),
            owned: false,
        };
        Ok((bound, path))
    }

    /// Listens at `path`, for the user who runs the daemon alone. The name left behind by a daemon
    /// that was killed is taken over; one that answers is not.
    pub(super) fn new(path: &Path) -> io::Result<Bound> {
        let is_left_behind = std::fs::symlink_metadata(path)
            .is_ok_and(|m| m.file_type().is_socket())
            && std::os::unix::net::UnixStream::connect(path)
                .is_err_and(|e| e.kind() == io::ErrorKind::ConnectionRefused);
        if is_left_behind {
            std::fs::remove_file(path)?;
        }
        let listener = UnixListener::bind(path)?;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600))?;
        Ok(Bound {
            listener,
            path: path.to_owned(),
            owned: true,
        })
    }
}

impl Drop for Bound {
    fn drop(&mut self) {
        if self.owned {
            // Somebody may have tidied up already.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

impl Duplex for UnixStream {
    fn readable(&self) -> impl Future<Output = io::Result<()>> + Send {
        UnixStream::readable(self)
    }
    fn writable(&self) -> impl Future<Output = io::Result<()>> + Send {
        UnixStream::writable(self)
    }
    fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        UnixStream::try_read(self, buffer)
    }
    fn try_write(&self, parts: &[IoSlice<'_>]) -> io::Result<usize> {
        self.try_write_vectored(parts)
    }
    fn end(&self) {
        duplex::shut(&socket2::SockRef::from(self));
    }
    fn is_closed(&self) -> bool {
        duplex::is_closed(self.ready(Interest::WRITABLE))
    }
    const SHOWS_CLOSE: bool = true;
    fn expect_notice(&self, _within: Duration) {}
}

pub(super) async fn serve(bound: Bound, context: Context) {
    let name = format!("unix://{}", bound.path.display());
    let kind = initial_kind(&context.hub);
    accept(
        context,
        kind,
        || bound.listener.accept(),
        |(stream, _), context, place| {
            // One whose user cannot be told shares with all such.
            let user = stream.peer_cred().map_or(u32::MAX, |who| who.uid());
            duplex::spawn(stream, Peer::user(name.clone(), user), context, place);
        },
        |(stream, _), context, words| duplex::spawn_dismissal(stream, &context, words),
    )
    .await;
}
