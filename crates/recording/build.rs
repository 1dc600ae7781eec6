//! Whether the recordings and golden vectors some tests need lie beside the checkout.

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(has_shared)");
    if Path::new("../../../shared/logs").is_dir() {
        println!("cargo::rustc-cfg=has_shared");
    }
}
