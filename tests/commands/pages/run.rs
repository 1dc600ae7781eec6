//! Commands as they stand in a page -> what a shell makes of them. I/O.

use super::fences::Command;
use super::root;
use crate::program::strapd;
use std::fmt::Write as _;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

/// Ports that stand in pages.
const PORTS: [&str; 7] = ["4550", "4551", "8765", "8766", "9870", "8000", "7000"];

/// Mark in front of a block: what does not end by itself is interrupted as soon as it is ready, as by Ctrl-C; what
/// runs beside it at the end is given some time to end, then ended.
const FRAME: &str = r#"
set -o pipefail
until_ctrl_c() {
    "$@" &
    local started=$!
    for ((n = 0; n < 600; n++)); do
        grep -q 'ready ' "$err" && break
        kill -0 $started 2>/dev/null || break
        sleep 0.1
    done
    kill -INT $started
    wait $started
}
end() {
    for ((n = 0; n < 50; n++)); do
        [ -n "$(jobs -pr)" ] || break
        sleep 0.1
    done
    kill $(jobs -pr) 2>/dev/null
}
trap end EXIT
"#;

/// `strapd` as a page calls it: where it would take its own ports, it gets those of this run.
const SHIM: &str = r#"#!/usr/bin/env bash
given=" $* "
words=()
for word in "$@"; do
    [ "$word" = --page ] && word=--page=127.0.0.1:8766
    words+=("$word")
done
case $given in
" serve "*) [[ $given == *" --listen "* ]] || words+=(--listen tcp-listen://127.0.0.1:4550 --listen ws-listen://127.0.0.1:8765) ;;
" send "*) [[ $given == *://* ]] || words+=(tcp://127.0.0.1:4550) ;;
esac
exec PROGRAM "${words[@]}"
"#;

/// A folder to run in, and a folder of programs.
pub(super) struct Place {
    dir: tempfile::TempDir,
    bin: tempfile::TempDir,
    /// A free port for each of [`PORTS`].
    free: Vec<String>,
}

/// Outcome of a command.
#[derive(Debug)]
pub(super) struct Ran {
    pub(super) code: i32,
    pub(super) out: String,
    pub(super) err: String,
}

impl Place {
    /// Makes a place with `fixtures/`, and nothing else.
    pub(super) fn with_fixtures() -> Place {
        let dir = tempfile::tempdir().unwrap();
        for folder in ["fixtures", "fixtures/source"] {
            std::fs::create_dir(dir.path().join(folder)).unwrap();
            for entry in std::fs::read_dir(root().join(folder)).unwrap() {
                let path = entry.unwrap().path();
                if path.is_file() {
                    let name = path.file_name().unwrap();
                    std::fs::copy(&path, dir.path().join(folder).join(name)).unwrap();
                }
            }
        }
        // Held all at once, so that no two are the same.
        let held: Vec<TcpListener> = PORTS
            .iter()
            .map(|_| TcpListener::bind("127.0.0.1:0").unwrap())
            .collect();
        let free = held
            .iter()
            .map(|l| l.local_addr().unwrap().port().to_string())
            .collect();
        let place = Place {
            dir,
            bin: tempfile::tempdir().unwrap(),
            free,
        };
        let program = assert_cmd::cargo::cargo_bin("strapd");
        let shim = SHIM.replace("PROGRAM", &format!("'{}'", program.display()));
        place.program("strapd", &place.with_free_ports(&shim));
        place
    }

    /// Adds what the pages call their recordings: a sensor in a hand, with a magnetometer and rests, and its truth.
    pub(super) fn with_recordings() -> Place {
        let place = Place::with_fixtures();
        let simulated = "simulate hand --duration 12 --rate-hz 100 --noise consumer_imu --mag -o flight.mcap -o truth.csv";
        strapd(place.path(), simulated).done();
        for name in [
            "log.mcap",
            "calibrating.mcap",
            "monday.mcap",
            "tuesday.mcap",
            "new.mcap",
            "short.mcap",
            "turns.mcap",
        ] {
            std::fs::copy(place.path().join("flight.mcap"), place.path().join(name)).unwrap();
        }
        place
    }

    pub(super) fn path(&self) -> &Path {
        self.dir.path()
    }

    fn program(&self, name: &str, text: &str) {
        use std::os::unix::fs::PermissionsExt;
        let path = self.bin.path().join(name);
        std::fs::write(&path, text).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn with_free_ports(&self, text: &str) -> String {
        // In one pass, and only where a port stands alone: a free one may hold another's digits, and so may a stamp.
        let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
        let (mut out, mut rest) = (String::new(), text);
        while let Some(first) = rest.chars().next() {
            let stands_here = |port: &str| {
                let behind = rest.strip_prefix(port);
                !is_digit(out.chars().next_back())
                    && behind.is_some_and(|behind| !is_digit(behind.chars().next()))
            };
            let mut ports = PORTS.iter().zip(&self.free);
            let found = ports.find(|(port, _)| stands_here(port));
            let (given, taken) = match found {
                Some((port, free)) => (free.clone(), port.len()),
                None => (first.to_string(), first.len_utf8()),
            };
            out += &given;
            rest = &rest[taken..];
        }
        out
    }

    /// Whether a file, a folder or a file for each `{stem}` is there and not empty.
    pub(super) fn has(&self, name: &str) -> bool {
        let path = self.path().join(name.replace("{stem}", "flight"));
        if path.is_dir() {
            return std::fs::read_dir(path).unwrap().next().is_some();
        }
        std::fs::metadata(path).is_ok_and(|file| file.len() > 0)
    }

    fn bash(&self, script: &str, path: &str) -> std::process::Output {
        let file: PathBuf = self.bin.path().join("script");
        std::fs::write(&file, script).unwrap();
        let mut bash = std::process::Command::new("/bin/bash");
        for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("STRAPD_")) {
            bash.env_remove(name);
        }
        bash.arg(file)
            .current_dir(self.path())
            .env("NO_COLOR", "1")
            .env("PATH", path);
        crate::program::ended(&bash, "")
    }
}

/// Whether a command serves until somebody ends it.
fn is_endless(text: &str) -> bool {
    let serves =
        text.starts_with("strapd serve") || text.contains(" --page") || text.contains("-listen://");
    serves && !text.ends_with('&') && !text.contains("& ")
}

/// Runs the commands of a block, one shell for all of them; `anew`: what a command is to write is taken away first.
pub(super) fn run(place: &Place, commands: &[&Command], anew: bool) -> Vec<Ran> {
    let logs = tempfile::tempdir().unwrap();
    let log = |n: usize, kind: &str| logs.path().join(format!("{n}.{kind}"));
    let mut script = FRAME.to_owned();
    for (n, command) in commands.iter().enumerate() {
        let text =
            place.with_free_ports(&command.text.replace("cargo run --release -- ", "strapd "));
        let caller = if is_endless(&text) {
            "until_ctrl_c "
        } else {
            ""
        };
        let (out, err, code) = (log(n, "out"), log(n, "err"), log(n, "code"));
        // What a command reads as well stays.
        let is_read = |name: &String| {
            command
                .text
                .split_whitespace()
                .filter(|w| w == name)
                .count()
                > 1
        };
        let mut written: Vec<String> = command.outputs();
        written.retain(|name| !is_read(name));
        if anew && !written.is_empty() {
            let _ = writeln!(script, "rm -rf -- {}", written.join(" "));
        }
        let _ = writeln!(
            script,
            "err='{}'\n{{\n{caller}{text}\n}} >'{}' 2>\"$err\" </dev/null\necho $? >'{}'",
            err.display(),
            out.display(),
            code.display()
        );
    }
    let path = format!(
        "{}:{}",
        place.bin.path().display(),
        std::env::var("PATH").unwrap()
    );
    place.bash(&script, &path);
    let read = |path: PathBuf| {
        String::from_utf8_lossy(&std::fs::read(path).unwrap_or_default()).into_owned()
    };
    (0..commands.len())
        .map_while(|n| {
            Some(Ran {
                code: read(log(n, "code")).trim().parse().ok()?,
                out: read(log(n, "out")),
                err: read(log(n, "err")),
            })
        })
        .collect()
}

/// The words that each `strapd` in this text is called with, itself the first. Nothing else is run.
pub(super) fn words(text: &str) -> Vec<Vec<String>> {
    let place = Place {
        dir: tempfile::tempdir().unwrap(),
        bin: tempfile::tempdir().unwrap(),
        free: Vec::new(),
    };
    let calls = tempfile::tempdir().unwrap();
    let folder = calls.path().display();
    let fake = format!("#!/bin/bash\nprintf '%s\\0' strapd \"$@\" >'{folder}'/$$\n");
    place.program("strapd", &fake);
    let text = text.replace("cargo run --release -- ", "strapd ");
    // What was sent to the background may be late.
    let script = format!("{text}\nwait\n");
    place.bash(&script, &place.bin.path().display().to_string());
    let call = |file: std::io::Result<std::fs::DirEntry>| {
        let words = std::fs::read_to_string(file.unwrap().path()).unwrap();
        words.split_terminator('\0').map(str::to_owned).collect()
    };
    std::fs::read_dir(calls.path()).unwrap().map(call).collect()
}

/// A program that a command needs beside `strapd`, and that is not installed here.
pub(super) fn missing(text: &str) -> Option<&'static str> {
    let is_there = |name: &str| {
        let path = std::env::var_os("PATH").unwrap_or_default();
        std::env::split_paths(&path).any(|folder| folder.join(name).is_file())
    };
    ["jq", "curl", "python3"]
        .into_iter()
        .find(|name| text.contains(&format!("{name} ")) && !is_there(name))
}

/// Faults that a thread has found, or its panic.
pub(super) fn finish(thread: JoinHandle<Vec<String>>) -> Vec<String> {
    thread
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}
