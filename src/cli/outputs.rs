//! `-o` as written -> one name per log. Pure but for asking whether a directory is there.

use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::remote_object;

/// Resolves every `-o` for one log of `logs`.
///
/// `{stem}` stands for the log's name without its directory and extension; an existing directory,
/// or a name that ends in `/`, means `<stem>.attitude.mcap` in it. With several logs a plain name
/// is refused: each would overwrite the last.
///
/// # Errors
/// [`Error::Usage`] for a plain name with several logs.
pub fn resolve(outputs: &[String], log: &str, logs: usize) -> Result<Vec<String>> {
    outputs
        .iter()
        .map(|output| resolve_one(output, log, logs))
        .collect()
}

/// Makes the folders of a log's outputs that were asked for as folders: by `{stem}`, or by a `/` at the end. That of a
/// plain name is not made, as it may be a slip of the hand.
///
/// # Errors
/// [`Error::Write`]: a folder cannot be made.
pub fn make_folders(outputs: &[String], names: &[String]) -> Result<()> {
    let made = outputs
        .iter()
        .zip(names)
        .filter(|(output, name)| is_pattern(output) && !name.contains("://"));
    made.map(|(_, name)| Path::new(name))
        .try_for_each(make_folder)
}

/// Makes the folder a file is to lie in.
///
/// # Errors
/// [`Error::Write`].
pub fn make_folder(file: &Path) -> Result<()> {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => {
            std::fs::create_dir_all(folder).map_err(|source| Error::Write {
                path: folder.to_owned(),
                source,
            })
        }
        _ => Ok(()),
    }
}

/// Whether it stands for the names of logs, or for a folder of them.
pub fn is_pattern(output: &str) -> bool {
    output.contains("{stem}") || output.ends_with('/')
}

/// Checks that no two logs of a run, and no two `-o`, lead to the same file.
///
/// All logs are looked at, those of other shards too: what one process would refuse, many must not
/// do to each other unseen.
///
/// # Errors
/// [`Error::Usage`] naming the file and who would write it.
pub fn check_distinct(outputs: &[String], logs: &[String]) -> Result<()> {
    if outputs.iter().filter(|name| *name == "-").count() > 1 {
        return Err(Error::usage("-o -: given twice".to_owned()));
    }
    let mut writers: BTreeMap<PathBuf, &String> = BTreeMap::new();
    for log in logs {
        for name in resolve(outputs, log, logs.len())? {
            if name == "-" || name == "null:" {
                continue;
            }
            let Some(other) = writers.insert(plain(&name), log) else {
                continue;
            };
            return Err(Error::usage(if other == log {
                Diagnostic::new(format!("-o {name}: given twice"))
            } else {
                Diagnostic::new(format!(
                    "-o {name}: both {} and {} would be written there",
                    shown(other),
                    shown(log)
                ))
                .help("give them different names, or run them one by one")
            }));
        }
    }
    Ok(())
}

/// Checks that a chart's name ends in `.svg`.
///
/// # Errors
/// [`Error::Usage`] with the way to another format.
pub fn check_chart(path: &Path) -> Result<()> {
    let is_svg = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("svg"));
    if is_svg || path == Path::new("-") {
        return Ok(());
    }
    Err(Error::usage(
        Diagnostic::new(format!(
            "--plot {}: charts are written as SVG alone",
            path.display()
        ))
        .help(format!(
            "--plot {}; a browser, Inkscape or rsvg-convert makes a PNG of it",
            path.with_extension("svg").display()
        )),
    ))
}

/// The path without `.` and double slashes, as far as that can be told without asking the disk.
fn plain(name: &str) -> PathBuf {
    Path::new(name)
        .components()
        .filter(|part| *part != Component::CurDir)
        .collect()
}

fn resolve_one(output: &str, log: &str, logs: usize) -> Result<String> {
    if output == "-" || output == "null:" {
        return Ok(output.to_owned());
    }
    if output.contains("://") && logs == 1 && !is_pattern(output) {
        return Ok(output.to_owned());
    }
    if let Some(other) = unknown_pattern(output) {
        let what = format!("-o {output}: {other} stands for nothing");
        return Err(Error::usage(
            Diagnostic::new(what).help("{stem} stands for the log's name"),
        ));
    }
    if output.ends_with('/') || Path::new(output).is_dir() {
        let dir = output.trim_end_matches('/');
        return Ok(format!("{dir}/{}.attitude.mcap", stem(log)));
    }
    if output.contains("{stem}") {
        return Ok(output.replace("{stem}", &stem(log)));
    }
    if logs > 1 {
        return Err(Error::usage(
            Diagnostic::new(format!(
                "-o {output}: each of the {logs} logs would be written there"
            ))
            .help("-o DIR/ or a name with {stem}, for example -o out/{stem}.mcap"),
        ));
    }
    Ok(output.to_owned())
}

/// A word in braces that stands for no part of a log's name, in that of a file. A folder may be called so, and addresses
/// have words of their own.
fn unknown_pattern(output: &str) -> Option<&str> {
    if output.contains("://") {
        return None;
    }
    let mut rest = output.rsplit('/').next()?;
    while let Some(at) = rest.find('{') {
        let opened = rest.get(at..)?;
        let word = opened.get(..=opened.find('}')?)?;
        if word != "{stem}" {
            return Some(word);
        }
        rest = opened.get(word.len()..)?;
    }
    None
}

/// A recording as it is printed.
pub(super) fn shown(log: &str) -> String {
    match remote_object::meant(log) {
        Some(address) => address.place(),
        None => log.to_owned(),
    }
}

/// The log's name without directory and extension; `stdin` for `-`.
pub(super) fn stem(log: &str) -> String {
    if log == "-" {
        return "stdin".to_owned();
    }
    Path::new(&shown(log))
        .file_stem()
        .map_or_else(|| "log".to_owned(), |s| s.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn one(output: &str, log: &str, logs: usize) -> Result<String> {
        resolve(&[output.to_owned()], log, logs).map(|v| v[0].clone())
    }

    #[test]
    fn each_log_gets_its_own_name() {
        assert_eq!(one("out/{stem}.csv", "/d/a.mcap", 2).unwrap(), "out/a.csv");
        assert_eq!(one("out/", "/d/a.mcap", 2).unwrap(), "out/a.attitude.mcap");
        assert_eq!(one("-", "/d/a.mcap", 2).unwrap(), "-");
        for kept in ["{/a.csv", "{mine}/a.csv"] {
            assert_eq!(one(kept, "a.mcap", 1).unwrap(), kept);
        }
        let of_a_broker = one("nats://h/{stem}.{id}", "a.mcap", 2).unwrap();
        assert_eq!(of_a_broker, "nats://h/a.{id}");
        for wrong in ["out/{stm}.csv", "{stem}/{topic}.csv"] {
            let error = one(wrong, "a.mcap", 1).unwrap_err().to_string();
            assert!(error.contains("{stem} stands for"), "{error}");
        }
        assert_eq!(one("x.mcap", "/d/a.mcap", 1).unwrap(), "x.mcap");
    }

    #[test]
    fn two_logs_of_one_name_do_not_replace_each_other() {
        let check = |outputs: &[&str], logs: &[&str]| {
            let owned = |list: &[&str]| list.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>();
            check_distinct(&owned(outputs), &owned(logs)).map_err(|e| e.to_string())
        };
        let error = check(&["out/"], &["a/x.mcap", "b/x.mcap"]).unwrap_err();
        assert!(
            error.contains("a/x.mcap") && error.contains("b/x.mcap"),
            "{error}"
        );
        assert!(check(&["a.csv", "./a.csv"], &["x.mcap"]).is_err());
        assert!(check(&["-", "null:", "a.csv", "a.mcap"], &["x.mcap"]).is_ok());
        assert!(check(&["-"], &["a/x.mcap", "b/x.mcap"]).is_ok());
        assert!(check(&["-", "-"], &["x.mcap"]).is_err());
        assert!(check(&["{stem}.csv"], &["a.mcap", "b.mcap"]).is_ok());
    }

    #[test]
    fn one_name_for_two_logs_is_refused_with_the_way_out() {
        let error = one("x.mcap", "a.mcap", 2).unwrap_err().to_string();
        assert!(error.contains("{stem}"), "{error}");
    }
}
