//! `cargo metadata`, `Cargo.lock` -> the bill of materials of the binary, as CycloneDX 1.5. I/O.
//!
//! ```sh
//! cargo run --example bill_of_materials > strapd.cdx.json
//! cargo run --example bill_of_materials -- --target x86_64-pc-windows-gnu    # of the binary for another platform
//! ```
//!
//! The crates the binary is linked from, each with its version, licence, address and checksum, and which uses which. There is
//! no time and no random number in it: the same sources give the same bytes. `packaging/release` ships the result.

#[path = "linked_crates/metadata.rs"]
mod linked_crates;

use linked_crates::{Outcome, asked, is_of_others, linked, list, metadata, text, used};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Write;

/// Checksums of the lock file, by name and version.
type Checksums = BTreeMap<(String, String), String>;

fn main() -> Outcome<()> {
    let asked = asked()?;
    let [manifest] = asked.manifests.as_slice() else {
        return Err("one manifest has one bill".into());
    };
    let metadata = metadata(manifest, asked.target.as_deref())?;
    let bill = bill(&metadata, &checksums()?)?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", serde_json::to_string_pretty(&bill)?)?;
    Ok(())
}

fn checksums() -> Outcome<Checksums> {
    let lock: toml::Table = std::fs::read_to_string("Cargo.lock")?.parse()?;
    let packages = lock.get("package").and_then(toml::Value::as_array);
    let of = |package: &toml::Value, key: &str| {
        package
            .get(key)
            .and_then(toml::Value::as_str)
            .map(str::to_owned)
    };
    Ok(packages
        .into_iter()
        .flatten()
        .filter_map(|p| Some(((of(p, "name")?, of(p, "version")?), of(p, "checksum")?)))
        .collect())
}

fn bill(metadata: &Value, checksums: &Checksums) -> Outcome<Value> {
    let linked = linked(metadata)?;
    let root = text(&metadata["resolve"], "root");
    let addresses: BTreeMap<&str, String> = linked
        .iter()
        .map(|package| (text(package, "id"), address(package)))
        .collect();
    let mut main = None;
    let mut components = Vec::new();
    for package in &linked {
        if text(package, "id") == root {
            main = Some(component(package, "application", checksums)?);
        } else {
            components.push(component(package, "library", checksums)?);
        }
    }
    let main = main.ok_or("the root package is not among the linked ones")?;
    let by_address = |value: &Value| text(value, "bom-ref").to_owned();
    components.sort_by_key(by_address);
    let mut dependencies = Vec::new();
    for node in list(&metadata["resolve"], "nodes") {
        if let Some(address) = addresses.get(text(node, "id")) {
            let mut on: Vec<&String> = used(node).filter_map(|id| addresses.get(id)).collect();
            on.sort_unstable();
            on.dedup();
            dependencies.push(json!({"ref": address, "dependsOn": on}));
        }
    }
    dependencies.sort_by_key(|value| text(value, "ref").to_owned());
    Ok(json!({
        "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": main},
        "components": components,
        "dependencies": dependencies,
    }))
}

/// A package's address in the form of package URLs, which tells it apart in the bill, too.
fn address(package: &Value) -> String {
    let (name, version) = (text(package, "name"), text(package, "version"));
    // The one character of a version that such an address escapes.
    format!("pkg:cargo/{name}@{}", version.replace('+', "%2B"))
}

fn component(package: &Value, kind: &str, checksums: &Checksums) -> Outcome<Value> {
    let (name, version) = (text(package, "name"), text(package, "version"));
    let mut component = json!({
        "type": kind,
        "bom-ref": address(package),
        "name": name,
        "version": version,
        "purl": address(package),
    });
    // Of before SPDX had expressions.
    let licence = text(package, "license").replace('/', " OR ");
    if !licence.is_empty() {
        component["licenses"] = json!([{"expression": licence}]);
    }
    match checksums.get(&(name.to_owned(), version.to_owned())) {
        Some(sum) => component["hashes"] = json!([{"alg": "SHA-256", "content": sum}]),
        None if is_of_others(package) => {
            return Err(format!("{name} {version} has no checksum in Cargo.lock").into());
        }
        None => {}
    }
    Ok(component)
}
