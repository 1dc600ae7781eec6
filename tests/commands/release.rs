//! Promise: the files of a release agree with each other: one version, one list of pages, one place for each address.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    let path = root().join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

/// Names of the pages in a folder, as the book calls them.
fn pages(folder: &str) -> impl Iterator<Item = String> {
    let entries: Vec<_> = std::fs::read_dir(root().join("docs").join(folder))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let within = if folder.is_empty() {
        String::new()
    } else {
        format!("{folder}/")
    };
    entries
        .into_iter()
        .filter(|name| Path::new(name).extension().is_some_and(|e| e == "md"))
        .map(move |name| format!("{within}{name}"))
}

fn links(page: &str) -> Vec<&str> {
    page.split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .collect()
}

#[test]
fn the_book_has_every_page_once() {
    let summary = read("docs/SUMMARY.md");
    let listed = links(&summary);
    let once: BTreeSet<String> = listed.iter().map(|link| (*link).to_owned()).collect();
    assert_eq!(once.len(), listed.len(), "a page twice: {listed:?}");
    let there: BTreeSet<String> = pages("")
        .chain(pages("theory"))
        .filter(|name| name != "SUMMARY.md")
        .collect();
    assert_eq!(once, there);
}

/// The book is docs/ alone.
#[test]
fn no_page_of_the_book_leads_out_of_it() {
    for name in pages("").chain(pages("theory")) {
        let page = read(&format!("docs/{name}"));
        let depth = name.matches('/').count();
        for link in links(&page) {
            let up = link.matches("../").count();
            assert!(up <= depth, "docs/{name}: {link} is not in docs/");
        }
    }
}

/// Copies of the version drift from the one of Cargo.toml.
#[test]
fn the_version_is_the_same_wherever_it_has_to_stand() {
    let version = env!("CARGO_PKG_VERSION");
    let ours = |name: &str| -> Vec<(String, String)> {
        let lock: toml::Table = read(name).parse().unwrap();
        let packages = lock["package"].as_array().unwrap();
        packages
            .iter()
            .map(|p| (p["name"].as_str().unwrap(), p["version"].as_str().unwrap()))
            .filter(|(name, _)| name.starts_with("strapd") && *name != "strapd-fuzz")
            .map(|(name, version)| (name.to_owned(), version.to_owned()))
            .collect()
    };
    for lock in ["Cargo.lock", "fuzz/Cargo.lock", "python/Cargo.lock"] {
        let ours = ours(lock);
        assert!(ours.len() > 3, "{lock}: {ours:?}");
        for (name, locked) in ours {
            assert_eq!(locked, version, "{lock}: {name}");
        }
    }
    let newest = read("CHANGELOG.md")
        .lines()
        .filter_map(|line| line.strip_prefix("## [")?.split(']').next())
        .find(|heading| *heading != "Unreleased")
        .unwrap()
        .to_owned();
    assert_eq!(newest, version, "the newest heading of CHANGELOG.md");
    for name in [
        "packaging/compose.yaml",
        "packaging/kubernetes-job.yaml",
        "packaging/kubernetes-workers.yaml",
    ] {
        let text = read(name);
        let images = text
            .lines()
            .filter(|l| l.contains("image:") && l.contains("/strapd:"));
        for line in images {
            assert!(
                line.contains(&format!("strapd:{version}")),
                "{name}: {line}"
            );
        }
    }
}

/// Installers of other kinds get the archives that `packaging/release` makes.
#[test]
fn installers_fetch_what_the_release_makes() {
    let cargo: toml::Table = read("Cargo.toml").parse().unwrap();
    let released = read("packaging/release");
    let binstall = &cargo["package"]["metadata"]["binstall"];
    for (target, how) in binstall["overrides"].as_table().unwrap() {
        let address = how["pkg-url"].as_str().unwrap();
        let made = address
            .replace("{ target }", target)
            .split("{ version }-")
            .nth(1)
            .unwrap()
            .to_owned();
        let (made, zipped) = match made.strip_suffix(".zip") {
            Some(made) => (made.to_owned(), true),
            None => (made.trim_end_matches(".tar.gz").to_owned(), false),
        };
        assert!(released.contains(&made), "{target}: {made} is not released");
        assert_eq!(zipped, made.contains("windows"), "{target}: {address}");
    }
    for recipe in ["packaging/brew/strapd.rb", "packaging/conda/recipe.yaml"] {
        let text = read(recipe);
        assert!(
            text.contains("@VERSION@") && text.contains("@REPOSITORY@"),
            "{recipe}"
        );
        assert!(
            !text.contains(env!("CARGO_PKG_VERSION")),
            "{recipe}: a version of its own"
        );
    }
}

/// A path in an image or a package that nothing makes is found here, and not by who builds it.
#[test]
fn image_and_package_hold_what_the_release_makes() {
    let image = read("packaging/Containerfile");
    let released = read("packaging/release");
    let copied: Vec<&str> = image
        .lines()
        .filter_map(|line| line.strip_prefix("COPY --from=build /strapd/target/dist/"))
        .filter_map(|rest| rest.split(' ').next())
        .collect();
    assert_eq!(copied.len(), 2, "{copied:?}");
    for file in copied {
        assert!(released.contains(&format!("$dist/{file}")), "{file}");
    }

    let cargo: toml::Table = read("Cargo.toml").parse().unwrap();
    let archive = read("packaging/archive");
    let system = std::fs::read_dir(root().join("packaging")).unwrap();
    let system: BTreeSet<String> = system
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let assets = cargo["package"]["metadata"]["deb"]["assets"]
        .as_array()
        .unwrap();
    for asset in assets {
        let path = asset[0].as_str().unwrap();
        let laid = path.strip_prefix("target/dist/deb/").unwrap();
        let is_made = match laid.split_once('/') {
            Some(("system", unit)) => system.contains(unit),
            Some((folder, _)) => {
                archive.contains(&format!("$folder/{folder}"))
                    || archive.contains("{completions,man}")
            }
            None => laid == "strapd" || archive.contains(laid),
        };
        assert!(is_made, "{path}");
    }
}
