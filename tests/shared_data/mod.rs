//! Place of the recordings and golden vectors. They are not part of this repository: a test that
//! needs them is marked `#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]`
//! (`build.rs`), and is listed as ignored on a machine without them.

use std::path::{Path, PathBuf};

/// `../shared/<relative>` beside the checkout. Never `None`: who runs without it fails.
///
/// # Panics
/// When it is absent.
#[allow(dead_code, unreachable_pub)]
pub fn shared(relative: &str) -> Option<PathBuf> {
    // The checkout is where the lock file lies, in whichever crate this is compiled.
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .find(|folder| folder.join("Cargo.lock").is_file())?
        .join("../shared")
        .join(relative);
    assert!(
        path.exists(),
        "{} is absent: a recording of the maintainers, which no change needs (CONTRIBUTING.md). The test that asks for it is to be marked `#[cfg_attr(not(has_shared), ignore = \"needs ../shared (optional recordings)\")]`",
        path.display()
    );
    Some(path)
}
