//! Promise: the command line says what it does, what went wrong and which flag helps, on the right
//! stream and with the right exit code.

mod aiding;
mod bare_stamps;
mod flags;
mod inputs;
mod manual;
mod outputs;
mod paste;
mod summaries;

use std::path::Path;

/// How a command ended.
#[derive(Debug)]
struct Ran {
    code: Option<i32>,
    out: String,
    err: String,
}

/// `strapd` in `dir` with these arguments, split at spaces.
fn strapd(dir: &Path, arguments: &str) -> Ran {
    strapd_fed(dir, arguments, Vec::new())
}

fn strapd_fed(dir: &Path, arguments: &str, stdin: Vec<u8>) -> Ran {
    let output = assert_cmd::Command::cargo_bin("strapd")
        .unwrap()
        .current_dir(dir)
        // The user's own settings must not decide a test.
        .env_remove("STRAPD_TIME")
        .env_remove("STRAPD_LOG")
        .env("NO_COLOR", "1")
        .args(arguments.split_whitespace())
        .write_stdin(stdin)
        .timeout(std::time::Duration::from_secs(60))
        .output()
        .unwrap();
    Ran {
        code: output.status.code(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

impl Ran {
    /// Ended with `code`, said each of these on stderr, nothing on stdout, and no panic.
    #[track_caller]
    fn refused(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_eq!(self.out, "", "an error belongs on stderr: {self:?}");
        assert!(self.err.starts_with("error: "), "{self:?}");
        assert!(!self.err.contains("panicked"), "{self:?}");
        for word in words {
            assert!(self.err.contains(word), "`{word}` is missing: {}", self.err);
        }
    }

    #[track_caller]
    fn done(&self) -> &Ran {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }

    fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }
}

/// A directory with `log.mcap`: 300 samples, 3 s, on `/imu/data_raw`.
fn bench() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    crate::made_logs::written(dir.path(), "log.mcap", &crate::made_logs::motion(300));
    dir
}

/// The names in a directory, hidden ones too.
fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
