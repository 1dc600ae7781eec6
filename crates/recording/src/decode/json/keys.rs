//! The keys of a JSON text, for choosing a topic and for messages to the user. Pure.

use super::find::MAX_SEARCH;
use super::scan::Scanner;
use crate::decode::Undecodable;
use crate::decode::select::names::{Meaning, meaning};

/// Most keys that are listed.
const MAX_KEYS: usize = 60;

/// Whether a JSON schema declares a body rate, and a stamp.
pub(crate) fn schema_keys(schema: &[u8]) -> (bool, bool) {
    let list = keys(schema);
    let mut found = (false, false);
    for key in &list {
        let name = key.strip_suffix(".type").unwrap_or(key);
        let name = name.rsplit('.').next().unwrap_or(name);
        match meaning(name) {
            Some(Meaning::Gyro { .. } | Meaning::DeltaAngle | Meaning::GyroAxis { .. }) => {
                found.0 = true
            }
            Some(Meaning::Stamp { .. }) => found.1 = true,
            _ => {}
        }
    }
    found
}

/// The keys of a message as paths, at most [`MAX_KEYS`].
pub(crate) fn keys(payload: &[u8]) -> Vec<String> {
    let mut list = Vec::new();
    if let Ok(mut scanner) = Scanner::new(payload) {
        // What is broken ends the list early, and so does a full one; no more.
        let _ = collect_keys(&mut scanner, &mut String::new(), 0, &mut list);
    }
    list
}

/// Why a list of keys ends.
struct EndOfKeys;

impl From<Undecodable> for EndOfKeys {
    fn from(_: Undecodable) -> EndOfKeys {
        EndOfKeys
    }
}

fn collect_keys(
    scanner: &mut Scanner<'_>,
    path: &mut String,
    depth: u32,
    list: &mut Vec<String>,
) -> Result<(), EndOfKeys> {
    if list.len() >= MAX_KEYS {
        return Err(EndOfKeys);
    }
    let first = &mut true;
    let length = path.len();
    match scanner.peek() {
        Some(b'{') if depth < MAX_SEARCH => {
            scanner.enter();
            while let Some(key) = scanner.key(first)? {
                if length > 0 {
                    path.push('.');
                }
                path.push_str(&crate::text::printable(&key));
                collect_keys(scanner, path, depth + 1, list)?;
                path.truncate(length);
            }
            Ok(())
        }
        Some(b'[') if depth < MAX_SEARCH => {
            scanner.enter();
            let mut index = 0;
            while scanner.element(first)? {
                match (index, scanner.peek()) {
                    (0, Some(b'{')) => {
                        path.push_str("[]");
                        collect_keys(scanner, path, depth + 1, list)?;
                        path.truncate(length);
                    }
                    _ => scanner.skip(depth)?,
                }
                index += 1;
            }
            if !path.is_empty() && !list.iter().any(|known| known.starts_with(path.as_str())) {
                list.push(path.clone());
            }
            Ok(())
        }
        _ => {
            if !path.is_empty() {
                list.push(path.clone());
            }
            Ok(scanner.skip(depth)?)
        }
    }
}
