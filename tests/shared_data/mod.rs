//! Where the recordings and golden vectors lie. They are not part of this repository:
//! a test that needs them skips loudly on a machine without them, and must not skip in CI.

use std::path::PathBuf;

/// `../shared/<relative>` beside the checkout, or `None` (said on stderr) where it is absent.
///
/// # Panics
/// In CI (`CI` set) when it is absent: there a skip would be a test that can not fail.
#[allow(dead_code, unreachable_pub)]
pub fn shared(relative: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../shared")
        .join(relative);
    if path.exists() {
        return Some(path);
    }
    assert!(
        std::env::var_os("CI").is_none(),
        "{} is absent, and this is CI: the test must run",
        path.display()
    );
    eprintln!(
        "SKIPPED LOUDLY: {} is absent; this test proved nothing",
        path.display()
    );
    None
}
