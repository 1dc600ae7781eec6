//! An address with `*` in its key -> the addresses that it means. I/O.
//!
//! Apart from the reading because nothing is read yet, and because only stores can say what they have: a web server
//! is asked for what one knows.

use super::cloud::{Cloud, Keys};
use super::download::given_up;
use super::fault::Fault;
use super::patience::Patience;
use super::pattern::Pattern;
use super::{runtime, wait};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::address::Address;

/// Keys that are looked at, and those that may be meant: a store has millions.
const MOST_KEYS: usize = 1_000_000;
const MOST_MEANT: usize = 10_000;

/// Objects that an address means which may be a pattern, in the order of their names; `None` of one that is none.
///
/// # Errors
/// Nobody lists what is there, nothing is meant, or too much is; what the store says.
pub fn meant(address: &Address) -> Option<Result<Vec<String>, Diagnostic>> {
    let typed = address.typed();
    let rest = typed.split_once("://").map_or("", |(_, rest)| rest);
    let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
    let is_web = matches!(address.scheme().as_str(), "http" | "https");
    // Behind a `?` a star is none.
    let key = match is_web {
        true => key.split(['?', '#']).next().unwrap_or_default(),
        false => key,
    };
    let pattern = Pattern::of(key)?;
    if is_web {
        return Some(Err(Diagnostic::new(
            "a web server does not say what it has, so that a pattern means nothing there",
        )
        .help(
            "each address by itself; patterns are for s3://, gs:// and az:// (a star in a name is %2A)",
        )));
    }
    let place = format!("{}://{bucket}/", address.scheme());
    Some(list(&place, key, &pattern).map(|keys| {
        let address = |key: &String| format!("{place}{key}");
        keys.iter().map(address).collect()
    }))
}

fn list(place: &str, key: &str, pattern: &Pattern<'_>) -> Result<Vec<String>, Diagnostic> {
    let patience = Patience::default();
    let folder = pattern.folder();
    let cloud = Cloud::in_folder(&Address::from(format!("{place}{folder}")), patience)?;
    let runtime = runtime().map_err(|e| Diagnostic::new(format!("cannot start threads: {e}")))?;
    let key = key.to_owned();
    let (keys, cloud) = wait(runtime, async move {
        let pattern = Pattern::of(&key);
        let is_meant = |key: &str| pattern.as_ref().is_some_and(|own| own.means(key));
        let mut failed = 0;
        loop {
            match cloud.keys((MOST_KEYS, MOST_MEANT), is_meant).await {
                Err(Fault::Passing { what, asked }) => {
                    failed += 1;
                    if failed >= patience.tries {
                        return (Err(given_up(&what, failed)), cloud);
                    }
                    tokio::time::sleep(patience.pause(failed, asked)).await;
                }
                other => return (other, cloud),
            }
        }
    })
    .ok_or_else(|| Diagnostic::new("the request was given up"))?;
    let keys = keys.map_err(|fault| fault.told(|status| cloud.help(status)))?;
    let Keys {
        looked_at,
        wanted,
        kept: mut meant,
    } = keys;
    let is_all = looked_at < MOST_KEYS;
    meant.sort_unstable();
    let below = match folder.as_str() {
        "" => "the bucket".to_owned(),
        folder => format!("`{folder}/`"),
    };
    if !is_all {
        return Err(Diagnostic::new(format!(
            "{below} has {MOST_KEYS} objects or more, and no more are looked at"
        ))
        .help("a pattern with more folders before its first *"));
    }
    match wanted {
        0 => Err(Diagnostic::new(format!(
            "the pattern means none of the {looked_at} objects in {below}"
        ))
        .help("* is anything but a /, and ** any number of folders")),
        n if n > MOST_MEANT => Err(Diagnostic::new(format!(
            "the pattern means {n} objects, of at most {MOST_MEANT}"
        ))
        .help("a narrower one at a time")),
        _ => Ok(meant),
    }
}
