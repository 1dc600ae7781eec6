//! A key with `*` in it -> whether another is meant by it. Pure.
//!
//! Apart from the listing because a pattern costs no more than the product of its length and the key's, whatever it is.

/// A pattern of keys: `*` is anything but a `/`, `**` between two of them any number of folders.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Pattern<'p> {
    parts: Vec<&'p str>,
}

impl<'p> Pattern<'p> {
    /// The pattern that a key is; `None` of one that is a key.
    pub(super) fn of(key: &'p str) -> Option<Pattern<'p>> {
        key.contains('*').then(|| Pattern {
            parts: key.split('/').collect(),
        })
    }

    /// The folders that all that is meant lies in.
    pub(super) fn folder(&self) -> String {
        let whole = self.parts.iter().take_while(|part| !part.contains('*'));
        whole.copied().collect::<Vec<_>>().join("/")
    }

    /// Whether a key is meant.
    pub(super) fn means(&self, key: &str) -> bool {
        let names: Vec<&str> = key.split('/').collect();
        let is_any = |part: &&str| **part == *"**";
        let fits = |part: &&str, name: &&str| {
            let [part, name] = [part.as_bytes(), name.as_bytes()];
            meets(part, name, |sign| *sign == b'*', |a, b| a == b)
        };
        meets(&self.parts, &names, is_any, fits)
    }
}

/// Whether a list of signs, of which some stand for any number of things, is met by a list of things. What an earlier one of
/// these took is never looked at again: a later one can take as much.
fn meets<S, T>(
    signs: &[S],
    things: &[T],
    is_any: impl Fn(&S) -> bool,
    fits: impl Fn(&S, &T) -> bool,
) -> bool {
    let (mut sign, mut thing) = (0, 0);
    let mut last_any: Option<(usize, usize)> = None;
    while let Some(next) = things.get(thing) {
        match signs.get(sign) {
            Some(any) if is_any(any) => {
                last_any = Some((sign, thing));
                sign += 1;
            }
            Some(one) if fits(one, next) => (sign, thing) = (sign + 1, thing + 1),
            _ => {
                let Some((any, taken)) = last_any else {
                    return false;
                };
                last_any = Some((any, taken + 1));
                (sign, thing) = (any + 1, taken + 1);
            }
        }
    }
    signs.get(sign..).unwrap_or_default().iter().all(is_any)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stops_at_a_folder_and_two_of_them_do_not() {
        for (pattern, key, is_meant) in [
            ("a/*.mcap", "a/b.mcap", true),
            ("a/*.mcap", "a/b/c.mcap", false),
            ("a/*.mcap", "a/.mcap", true),
            ("a/*.mcap", "a/b.mcap.part", false),
            ("*", "a", true),
            ("*", "a/b", false),
            ("a/**/c.mcap", "a/c.mcap", true),
            ("a/**/c.mcap", "a/b/b/c.mcap", true),
            ("a/**", "a/b/c", true),
            ("**/*.mcap", "x/y/z.mcap", true),
            ("**/*.mcap", "z.mcap", true),
            ("a*c*e", "abcde", true),
            ("a*c*e", "abcd", false),
            ("2024-*/run_*.bag", "2024-05/run_1.bag", true),
            ("2024-*/run_*.bag", "2023-05/run_1.bag", false),
        ] {
            let found = Pattern::of(pattern).unwrap().means(key);
            assert_eq!(found, is_meant, "{pattern} {key}");
        }
        assert_eq!(Pattern::of("a/b.mcap"), None);
        assert_eq!(Pattern::of("a/b/c*/d").unwrap().folder(), "a/b");
        assert_eq!(Pattern::of("*.mcap").unwrap().folder(), "");
    }

    #[test]
    fn a_pattern_of_stars_costs_no_more_than_its_length_times_the_keys() {
        let (pattern, key) = ("*a".repeat(400) + "b", "a".repeat(4000));
        let compared = std::cell::Cell::new(0);
        let fits = |sign: &u8, thing: &u8| {
            compared.set(compared.get() + 1);
            sign == thing
        };
        let is_any = |sign: &u8| *sign == b'*';
        assert!(!meets(pattern.as_bytes(), key.as_bytes(), is_any, fits));
        assert!(compared.get() <= pattern.len() * key.len(), "{compared:?}");
    }
}
