//! Promise: secrets in an address, or in the environment, are seen by nobody but the server they are for.

use super::fixture;
use super::server::{Manner, Server};
use crate::program::{Ran, ended};
use std::path::Path;
use std::process::Command;

const SECRET: &str = "s3cret";

fn strapd(dir: &Path, arguments: &str, variables: &[(&str, &str)]) -> Ran {
    let mut command = Command::new(env!("CARGO_BIN_EXE_strapd"));
    command
        .current_dir(dir)
        .env("NO_PROXY", "127.0.0.1")
        .envs(variables.iter().copied())
        .args(arguments.split_whitespace());
    let output = ended(&command, "");
    Ran {
        code: output.status.code(),
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

fn assert_hidden(what: &str, text: &[u8]) {
    let mut windows = text.windows(SECRET.len());
    let said = String::from_utf8_lossy(text);
    assert!(!windows.any(|w| w == SECRET.as_bytes()), "{what}: {said}");
}

#[test]
fn a_signature_stands_in_nothing_that_is_printed_or_written() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("xsens_mti.mcap");
    let query = format!("xsens_mti.mcap?X-Signature={SECRET}&x={SECRET}#{SECRET}");
    for (manner, succeeds) in [
        (Manner::Good, true),
        (Manner::NoRanges, true),
        (Manner::Refuse(403), false),
        (Manner::Busy(""), false),
        (Manner::ChangedAfter(1), false),
    ] {
        let server = Server::file(manner.clone(), &log);
        let there = server.url(&query);
        for command in [
            "info {} -vv",
            "info {} --json",
            "check {} -vv",
            "cat {} -n 3 -vv",
            "allan {} --json",
            "compare {} {} --plot c.svg --force",
            "compare {} {} --align none --max-angle -1",
            "report {} -o r.html --force --record-paths",
            "calibrate {} -o c.toml --force",
            "send {} tcp://127.0.0.1:9",
            "recover {} -o x.mcap",
            "replay --join {} {} -o null:",
            "replay {} {} -o x.csv",
            "replay {} {} -o {stem}.csv",
            "replay {} -o a.mcap -o a.csv -o a.ndjson --force --record-paths -vv --progress json",
            "replay {} -o {stem}.csv --force --save-calibration {stem}.toml",
            "replay {} -o out/ --force --loop",
        ] {
            // Who is busy is waited for, in one place for all commands.
            if matches!(manner, Manner::Busy(_)) && !command.contains("-vv") {
                continue;
            }
            let ran = strapd(dir.path(), &command.replace("{}", &there), &[]);
            assert_hidden(&format!("{manner:?} {command}"), ran.err.as_bytes());
            assert_hidden(&format!("{manner:?} {command}"), ran.out.as_bytes());
            let is_asked = succeeds && command.starts_with("replay {} -o a.mcap");
            assert!(
                ran.code == Some(0) || !is_asked,
                "{manner:?} {command}: {ran:?}"
            );
        }
        let mut seen = 0;
        for entry in std::fs::read_dir(dir.path()).unwrap().map(Result::unwrap) {
            let name = entry.file_name();
            assert_hidden("a name", name.as_encoded_bytes());
            if entry.path().is_file() {
                assert_hidden(
                    &name.to_string_lossy(),
                    &std::fs::read(entry.path()).unwrap(),
                );
            }
            seen += 1;
        }
        assert!(seen >= 5 || !succeeds, "{seen}");
        assert!(
            server.asked().iter().any(|head| head.contains(SECRET)),
            "it is for the server"
        );
    }
}

#[test]
fn a_redirect_is_followed_without_what_is_secret() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("xsens_mti.mcap");
    let there = Server::file(Manner::Good, &log);
    let here = Server::of(Manner::Elsewhere(there.url("b.mcap")), Vec::new());
    let from = here.url(&format!("a.mcap?sig={SECRET}"));
    let ran = strapd(dir.path(), &format!("replay {from} -o null:"), &[]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(!there.asked().is_empty());
    for head in there.asked() {
        assert_hidden("to another host", head.as_bytes());
        assert!(!head.to_lowercase().contains("referer"), "{head}");
    }
}

/// The environment of a store on loopback.
fn of_store(server: &Server) -> Vec<(&'static str, String)> {
    vec![
        ("AWS_ENDPOINT_URL", format!("http://{}", server.place)),
        ("AWS_ALLOW_HTTP", "true".to_owned()),
        ("AWS_ACCESS_KEY_ID", "ada".to_owned()),
        ("AWS_SECRET_ACCESS_KEY", SECRET.to_owned()),
        ("AWS_REGION", "eu-west-1".to_owned()),
    ]
}

fn in_store(dir: &Path, arguments: &str, server: &Server) -> Ran {
    let variables = of_store(server);
    let variables: Vec<(&str, &str)> = variables.iter().map(|(k, v)| (*k, v.as_str())).collect();
    strapd(dir, arguments, &variables)
}

#[test]
fn a_store_is_asked_with_a_signature_that_nobody_else_sees() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("xsens_mti.mcap");
    let store = Server::file(Manner::Good, &log);
    let run = "replay s3://bucket/2026/xsens_mti.mcap -o there.csv --force";
    let ran = in_store(dir.path(), run, &store);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let file = format!("replay {} -o file.csv", log.display());
    assert_eq!(strapd(dir.path(), &file, &[]).code, Some(0));
    let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    assert!(read("there.csv") == read("file.csv"));
    for head in store.asked() {
        assert!(
            head.starts_with("GET /bucket/2026/xsens_mti.mcap "),
            "{head}"
        );
        assert!(
            head.to_lowercase()
                .contains("authorization: aws4-hmac-sha256"),
            "{head}"
        );
        assert_hidden("the request", head.as_bytes());
    }
    // A signature is for one host.
    let other = Server::file(Manner::Good, &log);
    let leads_on = Server::of(Manner::Elsewhere(other.url("bucket/x.mcap")), Vec::new());
    let ran = in_store(dir.path(), run, &leads_on);
    ran.refused(1, &["s3://bucket/2026/xsens_mti.mcap", "302 Found"]);
    assert_eq!(other.asked().len(), 0);
}

#[test]
fn a_store_that_says_no_is_told_with_what_it_looks_at() {
    let dir = tempfile::tempdir().unwrap();
    for (status, words) in [
        (403, ["403 Forbidden", "AWS_ACCESS_KEY_ID"]),
        (404, ["404 Not Found", "s3://BUCKET/KEY"]),
        (
            503,
            ["503 Service Unavailable (5 times)", "try again later"],
        ),
    ] {
        let store = Server::of(Manner::Refuse(status), Vec::new());
        let ran = in_store(dir.path(), "info s3://bucket/a.mcap", &store);
        ran.refused(1, &words);
        assert_hidden("the error", ran.err.as_bytes());
    }
    let gone = Server::of(
        Manner::ChangedAfter(1),
        std::fs::read(fixture("constant_rate.db3")).unwrap(),
    );
    in_store(dir.path(), "info s3://bucket/a.db3", &gone)
        .refused(1, &["the object changed while it was read"]);
    let unsaid = strapd(dir.path(), "info s3://bucket/a.mcap?x=1", &[]);
    unsaid.refused(1, &["is no address of an object", "s3://BUCKET/KEY"]);
}
