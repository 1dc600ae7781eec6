//! `cargo metadata` -> the licences of everything in the binary, as one text. I/O.
//!
//! ```sh
//! cargo run --example third_party_notices > THIRD-PARTY-NOTICES.txt
//! cargo run --example third_party_notices -- Cargo.toml python/Cargo.toml    # of all that these are linked from
//! cargo run --example third_party_notices -- --target x86_64-pc-windows-gnu  # of the binary for another platform
//! ```
//!
//! Permissive licences ask for one thing: that their text goes with the binary. So the text is taken
//! from the very sources the binary is built from, and a crate that has none fails the run unless it at
//! least names its licence. Texts that are alike stand once. `packaging/release` ships the result, and `python/build`.

#[path = "linked_crates/metadata.rs"]
mod linked_crates;

use linked_crates::{Outcome, asked, is_of_others, linked, list, metadata, text};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Names of licence files, in any case and with any ending. `COPYING` stands beside one and names
/// what else could be chosen (zstd: the GPL).
const NAMES: [&str; 4] = ["LICENSE", "LICENCE", "NOTICE", "UNLICENSE"];

/// A crate of the binary: its name, version, what it says of its licence and authors, and the texts.
struct Notice {
    name: String,
    licence: String,
    authors: String,
    texts: Vec<String>,
}

fn main() -> Outcome<()> {
    let asked = asked()?;
    // By name and version, so that what is in both halves of a wheel stands once.
    let mut notices = BTreeMap::new();
    for manifest in &asked.manifests {
        let metadata = metadata(manifest, asked.target.as_deref())?;
        for package in linked(&metadata)?.into_iter().filter(|p| is_of_others(p)) {
            let notice = notice(package)?;
            notices.insert(notice.name.clone(), notice);
        }
    }
    let notices: Vec<Notice> = notices.into_values().collect();
    write(&notices, &mut std::io::stdout().lock())
}

fn notice(package: &Value) -> Outcome<Notice> {
    let name = format!("{} {}", text(package, "name"), text(package, "version"));
    let licence = text(package, "license").to_owned();
    let folder = Path::new(text(package, "manifest_path"))
        .parent()
        .ok_or("a manifest without a folder")?;
    // Bundled C has its licence a folder deeper.
    let mut files = Vec::new();
    for inside in std::fs::read_dir(folder)? {
        let inside = inside?.path();
        if inside.is_dir() {
            for deeper in std::fs::read_dir(&inside)? {
                files.push(deeper?.path());
            }
        } else {
            files.push(inside);
        }
    }
    files.retain(|path| {
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let file = file.to_uppercase();
        NAMES.iter().any(|name| file.starts_with(name)) && path.is_file()
    });
    files.sort();
    let texts = files
        .iter()
        .map(|path| {
            Ok(std::fs::read_to_string(path)?
                .replace("\r\n", "\n")
                .trim_end()
                .to_owned())
        })
        .collect::<Outcome<Vec<_>>>()?;
    if licence.is_empty() && texts.is_empty() {
        return Err(format!("{name} neither names a licence nor holds one").into());
    }
    let authors = list(package, "authors").filter_map(Value::as_str);
    Ok(Notice {
        name,
        licence,
        authors: authors.collect::<Vec<_>>().join(", "),
        texts,
    })
}

fn write(notices: &[Notice], out: &mut impl std::io::Write) -> Outcome<()> {
    writeln!(
        out,
        "strapd is made with the {} crates below, each under its own licence.\n",
        notices.len()
    )?;
    let mut texts: BTreeMap<&str, usize> = BTreeMap::new();
    for notice in notices {
        write!(out, "{}: {}", notice.name, notice.licence)?;
        for text in &notice.texts {
            let number = texts.len() + 1;
            write!(out, " [{}]", texts.entry(text).or_insert(number))?;
        }
        if notice.texts.is_empty() {
            write!(out, " (ships no text; by {})", notice.authors)?;
        }
        writeln!(out)?;
    }
    let mut numbered: Vec<_> = texts
        .into_iter()
        .map(|(text, number)| (number, text))
        .collect();
    numbered.sort_unstable();
    for (number, text) in numbered {
        write!(out, "\n{:=<100}\n[{number}]\n\n{text}\n", "")?;
    }
    Ok(())
}
