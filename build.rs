//! What this machine has of what some tests need. A test that needs what is not here is ignored, and
//! says why; `.ci/run` has everything.
//!
//! Looked for when this is built: `touch build.rs` after something was installed.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    for variable in ["STRAPD_CHROMIUM", "STRAPD_ORACLES_PYTHON"] {
        println!("cargo::rerun-if-env-changed={variable}");
    }
    let is_set = |variable| env::var_os(variable).is_some();
    let is_program = |name: &str| {
        env::var_os("PATH")
            .is_some_and(|path| env::split_paths(&path).any(|folder| folder.join(name).is_file()))
    };
    let has = [
        ("has_shared", Path::new("../shared/logs").is_dir()),
        (
            "has_chromium",
            is_set("STRAPD_CHROMIUM")
                || ["chromium", "chromium-browser", "google-chrome"]
                    .into_iter()
                    .any(is_program),
        ),
        (
            "has_foxglove",
            is_program("node")
                && Path::new("target/foxglove/node_modules/@foxglove/ws-protocol").is_dir(),
        ),
        ("has_python", is_program("python3")),
        ("has_systemd", is_program("systemd-analyze")),
        ("has_oracles", is_set("STRAPD_ORACLES_PYTHON")),
    ];
    for (name, is_here) in has {
        println!("cargo::rustc-check-cfg=cfg({name})");
        if is_here {
            println!("cargo::rustc-cfg={name}");
        }
    }
}
