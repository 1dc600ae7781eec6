//! The pages, packed; and what this machine has of what some tests need. A test that needs what is not
//! here is ignored, and says why; `.ci/run` has everything.
//!
//! Looked for when this is built: `touch build.rs` after something was installed.

use std::path::Path;
use std::{env, fs, io};

/// The files of the pages -> one text, packed, and where each begins and ends in it. A quarter of their size in the
/// command.
fn pack() -> io::Result<()> {
    println!("cargo::rerun-if-changed=src/web");
    let mut files = fs::read_dir("src/web")?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<io::Result<Vec<_>>>()?;
    files.sort();
    let (mut text, mut places) = (String::new(), String::new());
    for file in files {
        let begins = text.len();
        text += &fs::read_to_string(&file)?;
        let name = file.file_name().unwrap_or_default();
        places += &format!("({:?}, {begins}, {}),\n", name, text.len());
    }
    let out = env::var("OUT_DIR").map_err(io::Error::other)?;
    let out = Path::new(&out);
    fs::write(
        out.join("web.zst"),
        zstd::bulk::compress(text.as_bytes(), 22)?,
    )?;
    let places = format!(
        "/// Name, and from where to where in the text.\nconst PLACES: &[(&str, usize, usize)] = &[\n{places}];\nconst LENGTH: usize = {};\n",
        text.len()
    );
    fs::write(out.join("web.rs"), places)
}

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    pack()?;
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
        ("has_cxx", is_program("c++")),
        ("has_nginx", is_program("nginx") && is_program("openssl")),
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
    Ok(())
}
