//! Names of recordings -> the same, an address with `*` in the place of those that it means. I/O.
//!
//! Apart from the commands because a shell does this for files, and all that take several recordings do it alike.

use crate::error::Result;
use std::path::{Path, PathBuf};
use strapd_recording::remote_object;

/// The names with those that patterns mean, each pattern's in the order of their keys.
pub(super) fn filled<N>(names: Vec<N>) -> Result<Vec<N>>
where
    N: From<String> + AsRef<Path>,
{
    let mut all = Vec::new();
    for name in names {
        let address = name.as_ref().to_str().and_then(remote_object::meant);
        let meant = address
            .as_ref()
            .and_then(|address| Some((address, crate::store::listed::meant(address)?)));
        match meant {
            None => all.push(name),
            Some((address, meant)) => {
                let unreached = |what| strapd_recording::Error::Unreached {
                    path: PathBuf::from(address.place()),
                    what,
                };
                all.extend(meant.map_err(unreached)?.into_iter().map(N::from));
            }
        }
    }
    Ok(all)
}
