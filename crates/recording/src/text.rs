//! Outside text -> what a terminal may show. Pure.
//!
//! A stage of its own because every name in a log is somebody else's: what could move the cursor, hide or
//! reorder what is around it is escaped before it is printed, in one place.

/// Most bytes of what is bad that are repeated in what is said of it.
pub const MAX_NEAR: usize = 64;

/// `text` fit for a terminal: at most 255 bytes, control and other invisible characters escaped.
#[must_use]
pub fn printable(text: &str) -> String {
    escaped(text, 255)
}

/// Beginning of `text`, escaped: the whole characters that go into `most` bytes.
fn escaped(text: &str, most: usize) -> String {
    let mut out = String::with_capacity(text.len().min(most));
    for c in text.chars() {
        let start = out.len();
        if c.is_control() || is_invisible(c) {
            out.extend(c.escape_unicode());
        } else {
            out.push(c);
        }
        if out.len() > most {
            out.truncate(start);
            break;
        }
    }
    out
}

/// Whether every character of `text` can be shown as it is.
#[must_use]
pub fn is_printable(text: &str) -> bool {
    !text.chars().any(|c| c.is_control() || is_invisible(c))
}

/// Characters that reorder or hide the text around them.
fn is_invisible(c: char) -> bool {
    matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// The beginning of a hostile line, fit for a terminal: at most 64 bytes.
#[must_use]
pub fn snippet(bytes: &[u8]) -> String {
    let head = bytes.get(..bytes.len().min(MAX_NEAR)).unwrap_or_default();
    escaped(&String::from_utf8_lossy(head), MAX_NEAR)
}

/// Likeness of two names, 1 of equal ones, from which one is meant for the other.
const ALIKE: f64 = 0.75;

/// The nearest of `names` to one that is not among them; `None` where none is like it.
#[must_use]
pub fn nearest<T: AsRef<str>>(wanted: &str, names: impl Iterator<Item = T>) -> Option<T> {
    let length = wanted.chars().count();
    let alike = |name: T| {
        // One that is much longer or shorter is unlike, which saves comparing it letter by letter.
        let other = name.as_ref().chars().count();
        if (length.min(other) as f64) < ALIKE * length.max(other) as f64 {
            return None;
        }
        let likeness = strsim::normalized_damerau_levenshtein(wanted, name.as_ref());
        (likeness >= ALIKE).then_some((likeness, name))
    };
    let best = names.filter_map(alike).max_by(|(a, x), (b, y)| {
        // Of two as near the first by name, whatever the order they come in.
        a.total_cmp(b).then_with(|| y.as_ref().cmp(x.as_ref()))
    });
    best.map(|(_, name)| name)
}

/// A text without the byte order mark that spreadsheets put before it.
pub(crate) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// Names, fit for a terminal: the first ten, and how many more there are.
#[must_use]
pub fn named_few<T: AsRef<str>>(topics: &[T]) -> String {
    const FEW: usize = 10;
    let names: Vec<String> = topics
        .iter()
        .take(FEW)
        .map(|topic| printable(topic.as_ref()))
        .collect();
    let mut out = names.join(", ");
    if topics.len() > FEW {
        out.push_str(&format!(" and {} more", topics.len() - FEW));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_and_nothing_that_is_unlike() {
        let names = ["gyro-unit", "gyro-scale", "body", "world"];
        let of = |wanted: &str| nearest(wanted, names.into_iter());
        assert_eq!(of("gyro_unit"), Some("gyro-unit"));
        assert_eq!(of("worlds"), Some("world"));
        assert_eq!(of("gyro"), None);
        assert_eq!(of(""), None);
        assert_eq!(of(&"gyro-unit".repeat(100_000)), None);
    }

    #[test]
    fn a_snippet_is_whole_escaped_characters_of_the_beginning() {
        assert_eq!(snippet(b"1,2,3"), "1,2,3");
        assert_eq!(snippet(b"a\x1b[2J"), "a\\u{1b}[2J");
        assert_eq!(snippet(&[b'x'; 200]).len(), MAX_NEAR);
        // An escape that has no place any more is left out whole.
        let tail = [&[b'x'; 60][..], b"\x07\x07"].concat();
        assert_eq!(snippet(&tail), "x".repeat(60));
        assert_eq!(snippet("\u{202e}é".as_bytes()), "\\u{202e}é");
        // A character that the cut divides is a mark of its own, for which there is no place.
        let divided = [&[b'x'; 63][..], "é".as_bytes()].concat();
        assert_eq!(snippet(&divided), "x".repeat(63));
        assert_eq!(printable(&"\n".repeat(100)), "\\u{a}".repeat(51));
    }

    #[test]
    fn what_is_refused_takes_one_piece_of_memory() {
        // Half a million rows of a file of 11 kB are refused: of letters in strings of their own each took 3 us.
        let refused = snippet(&[b','; 40]);
        assert_eq!(refused.capacity(), refused.len());
    }
}
