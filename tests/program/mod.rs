//! The binary, run in a directory, and how it ended.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::expect_used)]

mod bounded;

pub use bounded::ended;

use std::path::Path;
use std::process::Command;

/// Outcome of a command.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

/// `strapd` in `dir` with these arguments, split at spaces, and this on its standard input.
#[track_caller]
pub fn strapd_fed(dir: &Path, arguments: &str, stdin: impl Into<Vec<u8>>) -> Ran {
    let whole = whole_account(arguments);
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("strapd"));
    command
        .current_dir(dir)
        // The user's own settings must not decide a test.
        .env_remove("STRAPD_TIME")
        .env_remove("STRAPD_STAMPS")
        .env_remove("STRAPD_SAMPLE_KIND")
        .env_remove("STRAPD_LOG")
        // Tests of the integration: the gyro alone, unless one asks for more by --aid.
        .env("STRAPD_AID", "none")
        .env("NO_COLOR", "1")
        // Servers here are on loopback.
        .env("NO_PROXY", "127.0.0.1")
        .args(arguments.split_whitespace());
    if whole {
        command.arg("-v").env("STRAPD_LOG", "info");
    }
    let output = ended(&command, stdin);
    Ran {
        code: output.status.code(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Whether a test asks for all that a replay or a check has to print, and not for the few lines that fit a screen; its
/// log stays at its level.
fn whole_account(arguments: &str) -> bool {
    let mut words = arguments.split_whitespace();
    let is_long = matches!(words.next(), Some("replay" | "check"));
    is_long && !words.any(|word| matches!(word, "-q" | "--quiet" | "-v" | "--help"))
}

#[track_caller]
pub fn strapd(dir: &Path, arguments: &str) -> Ran {
    strapd_fed(dir, arguments, "")
}

impl Ran {
    #[track_caller]
    pub fn done(&self) -> &Ran {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }

    /// Ended with `code`, said each of these on stderr, nothing on stdout, and no panic.
    #[track_caller]
    pub fn refused(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_eq!(self.out, "", "an error belongs on stderr: {self:?}");
        assert!(self.err.starts_with("error: "), "{self:?}");
        assert!(!self.err.contains("panicked"), "{self:?}");
        for word in words {
            assert!(self.err.contains(word), "`{word}` is missing: {}", self.err);
        }
    }

    #[track_caller]
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.done().out).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }

    /// One JSON object a line.
    #[track_caller]
    pub fn lines(&self) -> Vec<serde_json::Value> {
        let read = |line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
        self.out.lines().map(read).collect()
    }
}
