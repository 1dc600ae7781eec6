//! `cargo metadata` -> the crates that a binary is linked from. What the notices and the bill of materials both go by. I/O.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

pub(crate) type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Arguments of an example: `[--target TRIPLE] [MANIFEST...]`.
pub(crate) struct Asked {
    /// Platform of the binary; this machine's where none is named.
    pub(crate) target: Option<String>,
    /// Manifests of what is linked, `Cargo.toml` where none is named.
    pub(crate) manifests: Vec<String>,
}

/// The arguments of the process.
pub(crate) fn asked() -> Outcome<Asked> {
    let mut asked = Asked {
        target: None,
        manifests: Vec::new(),
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--target" {
            asked.target = Some(arguments.next().ok_or("--target needs a triple")?);
        } else {
            asked.manifests.push(argument);
        }
    }
    if asked.manifests.is_empty() {
        asked.manifests.push("Cargo.toml".to_owned());
    }
    Ok(asked)
}

/// The platform that `cargo` builds for unasked.
fn host() -> Outcome<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let version = Command::new(cargo).args(["-vV"]).output()?;
    let host = String::from_utf8(version.stdout)?
        .lines()
        .find_map(|line| line.strip_prefix("host: ").map(str::to_owned));
    Ok(host.ok_or("`cargo -vV` names no host")?)
}

/// The packages of a manifest and how they use each other, on one platform, as `cargo metadata` tells them.
pub(crate) fn metadata(manifest: &str, target: Option<&str>) -> Outcome<Value> {
    let target = target.map_or_else(host, |named| Ok(named.to_owned()))?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let out = Command::new(&cargo)
        .args(["metadata", "--locked", "--format-version", "1"])
        .args(["--filter-platform", &target])
        .args(["--manifest-path", manifest])
        .output()?;
    if !out.status.success() {
        return Err(String::from_utf8_lossy(&out.stderr).into());
    }
    Ok(serde_json::from_slice(&out.stdout)?)
}

/// The elements of a list, none where there is no such key.
pub(crate) fn list<'a>(value: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> {
    value[key].as_array().into_iter().flatten()
}

/// The text of a key, empty where there is none.
pub(crate) fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}

/// Every package the binary is linked from, our own among them: normal dependencies, all the way down.
pub(crate) fn linked(metadata: &Value) -> Outcome<Vec<&Value>> {
    let resolve = &metadata["resolve"];
    let nodes: BTreeMap<&str, &Value> =
        list(resolve, "nodes").map(|n| (text(n, "id"), n)).collect();
    let root = resolve["root"].as_str().ok_or("there is no root package")?;
    let mut seen = BTreeSet::new();
    let mut next = vec![root];
    while let Some(id) = next.pop() {
        if seen.insert(id) {
            let node = nodes.get(id).ok_or("a package without a node")?;
            next.extend(used(node));
        }
    }
    let linked: Vec<_> = list(metadata, "packages")
        .filter(|package| seen.contains(text(package, "id")))
        .collect();
    if linked.len() < seen.len() {
        return Err("a dependency is not among the packages".into());
    }
    Ok(linked)
}

/// The packages that one uses when it runs, by their identifiers.
pub(crate) fn used(node: &Value) -> impl Iterator<Item = &str> {
    list(node, "deps")
        .filter(|dep| list(dep, "dep_kinds").any(|kind| kind["kind"].is_null()))
        .map(|dep| text(dep, "pkg"))
}

/// Whether a package comes from a registry. What does not is ours.
pub(crate) fn is_of_others(package: &Value) -> bool {
    !package["source"].is_null()
}
