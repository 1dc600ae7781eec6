//! The pages, packed by `build.rs` -> their text. Pure.
//!
//! Hand-written HTML, CSS and ES modules below `src/web/`: no framework, nothing fetched from elsewhere, no inline
//! script or style. Unpacked once, when the first is asked for.

use std::sync::LazyLock;

include!(concat!(env!("OUT_DIR"), "/web.rs"));

static TEXT: LazyLock<String> = LazyLock::new(|| {
    let packed = include_bytes!(concat!(env!("OUT_DIR"), "/web.zst"));
    let text = zstd::bulk::decompress(packed, LENGTH).unwrap_or_default();
    String::from_utf8(text).unwrap_or_default()
});

/// The text of a file, such as `live.js`.
#[must_use]
pub fn text(name: &str) -> Option<&'static str> {
    let (_, from, to) = PLACES.iter().find(|(known, ..)| *known == name)?;
    TEXT.get(*from..*to)
}

/// The files there are.
#[cfg(test)]
pub fn names() -> impl Iterator<Item = &'static str> {
    PLACES.iter().map(|(name, ..)| *name)
}
