//! Addresses as outputs: an object is there when it is whole, with the bytes of the file, and nothing of it where it
//! is not.

use super::fixture;
use crate::program::Ran;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Manner of a store.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Manner {
    Good,
    /// Every third request is refused for now.
    BusyEveryThird,
    /// Every third connection ends without an answer, before anything was done.
    CutsEveryThird,
    /// Store that makes the object, and whose answer is lost.
    LosesTheLastAnswer,
    /// Store that answers 200, and in the body that it failed.
    NeverCompletes,
    /// Store that takes no second part.
    RefusesTheSecondPart,
    /// A part takes long.
    Slow,
}

#[derive(Default)]
struct Held {
    objects: BTreeMap<String, Vec<u8>>,
    uploads: BTreeMap<String, BTreeMap<u32, Vec<u8>>>,
    requests: Vec<String>,
    begun: usize,
}

/// A store of objects on loopback, as S3 speaks.
struct Store {
    place: String,
    held: Arc<Mutex<Held>>,
}

impl Store {
    fn of(manner: Manner) -> Store {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let place = listener.local_addr().unwrap().to_string();
        let held: Arc<Mutex<Held>> = Arc::default();
        let by = Arc::clone(&held);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let by = Arc::clone(&by);
                std::thread::spawn(move || drop(answer(&stream, manner, &by)));
            }
        });
        Store { place, held }
    }

    fn command(&self, at: &Path, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_strapd"));
        command
            .current_dir(at)
            .args(arguments.split_whitespace())
            .env("AWS_ENDPOINT_URL", format!("http://{}", self.place))
            .env("AWS_ALLOW_HTTP", "true")
            .env("AWS_ACCESS_KEY_ID", "ada")
            .env("AWS_SECRET_ACCESS_KEY", "s3cret")
            .env("AWS_REGION", "eu-west-1")
            .env("NO_PROXY", "127.0.0.1")
            .env("NO_COLOR", "1")
            .env("STRAPD_AID", "none")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn run(&self, at: &Path, arguments: &str) -> Ran {
        let output = self.command(at, arguments).output().unwrap();
        Ran {
            code: output.status.code(),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }

    fn object(&self, key: &str) -> Option<Vec<u8>> {
        self.held.lock().unwrap().objects.get(key).cloned()
    }

    fn keys(&self) -> Vec<String> {
        self.held.lock().unwrap().objects.keys().cloned().collect()
    }

    /// Uploads that were begun, and those that are open.
    fn uploads(&self) -> (usize, usize) {
        let held = self.held.lock().unwrap();
        (held.begun, held.uploads.len())
    }
}

fn answer(stream: &TcpStream, manner: Manner, held: &Mutex<Held>) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let mut head = String::new();
    while reader.read_line(&mut head)? > 2 {}
    let value = |name: &str| {
        let mut lines = head.lines().filter_map(|line| line.split_once(": "));
        let found = lines.find(|(known, _)| known.eq_ignore_ascii_case(name));
        found.map(|(_, value)| value.trim().to_owned())
    };
    let length = value("content-length").map_or(0, |n| n.parse().unwrap());
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    let mut words = head.split_whitespace();
    let (method, target) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let key = path.trim_start_matches("/bucket/").to_owned();
    let of = |name: &str| {
        let mut pairs = query
            .split('&')
            .map(|pair| pair.split_once('=').unwrap_or((pair, "")));
        pairs
            .find(|(known, _)| *known == name)
            .map(|(_, value)| value.to_owned())
    };
    let number = {
        let mut held = held.lock().unwrap();
        held.requests.push(format!("{method} {target}"));
        held.requests.len()
    };
    let mut to = stream.try_clone()?;
    let mut say = |status: &str, more: &str, body: &str| {
        let length = body.len();
        write!(
            to,
            "HTTP/1.1 {status}\r\nConnection: close\r\n{more}Content-Length: {length}\r\n\r\n{body}"
        )
    };
    match manner {
        Manner::BusyEveryThird if number.is_multiple_of(3) => {
            return say("503 Slow Down", "", "");
        }
        Manner::CutsEveryThird if number.is_multiple_of(3) => return Ok(()),
        _ => {}
    }
    let upload = of("uploadId");
    match (method, upload) {
        ("HEAD", _) => match held.lock().unwrap().objects.get(&key) {
            // A length without a body.
            Some(object) => {
                let length = object.len();
                write!(
                    stream.try_clone()?,
                    "HTTP/1.1 200 OK\r\nConnection: close\r\nContent-Length: {length}\r\nETag: \"1\"\r\nLast-Modified: Tue, 24 Nov 2026 20:00:00 GMT\r\n\r\n"
                )
            }
            None => say("404 Not Found", "", ""),
        },
        ("POST", None) => {
            let mut held = held.lock().unwrap();
            held.begun += 1;
            let id = format!("u{}", held.begun);
            held.uploads.insert(id.clone(), BTreeMap::new());
            let told = format!(
                "<InitiateMultipartUploadResult><Bucket>bucket</Bucket><Key>{key}</Key><UploadId>{id}</UploadId></InitiateMultipartUploadResult>"
            );
            say("200 OK", "", &told)
        }
        ("PUT", Some(id)) => {
            let part: u32 = of("partNumber").unwrap().parse().unwrap();
            if manner == Manner::Slow {
                std::thread::sleep(Duration::from_secs(20));
            }
            if manner == Manner::RefusesTheSecondPart && part == 2 {
                return say(
                    "403 Forbidden",
                    "",
                    "<Error><Code>AccessDenied</Code></Error>",
                );
            }
            match held.lock().unwrap().uploads.get_mut(&id) {
                Some(parts) => drop(parts.insert(part, body)),
                None => return say("404 Not Found", "", ""),
            }
            say("200 OK", &format!("ETag: \"p{part}\"\r\n"), "")
        }
        ("PUT", None) => {
            held.lock().unwrap().objects.insert(key, body);
            say("200 OK", "ETag: \"1\"\r\n", "")
        }
        ("POST", Some(id)) => {
            if manner == Manner::NeverCompletes {
                return say(
                    "200 OK",
                    "",
                    "<Error><Code>InternalError</Code><Message>no</Message></Error>",
                );
            }
            let Some(parts) = held.lock().unwrap().uploads.remove(&id) else {
                return say(
                    "404 Not Found",
                    "",
                    "<Error><Code>NoSuchUpload</Code></Error>",
                );
            };
            let whole = parts.into_values().flatten().collect();
            held.lock().unwrap().objects.insert(key, whole);
            if manner == Manner::LosesTheLastAnswer {
                return Ok(());
            }
            say(
                "200 OK",
                "",
                "<CompleteMultipartUploadResult><Bucket>bucket</Bucket><Key>k</Key><ETag>\"9\"</ETag></CompleteMultipartUploadResult>",
            )
        }
        ("DELETE", Some(id)) => {
            held.lock().unwrap().uploads.remove(&id);
            say("204 No Content", "", "")
        }
        _ => say("405 Method Not Allowed", "", ""),
    }
}

/// A recording whose attitudes take more than two parts as lines.
fn long(at: &Path) {
    let store = Store::of(Manner::Good);
    let ran = store.run(
        at,
        "simulate random --rate-hz 1000 --duration 45 -q -o long.mcap",
    );
    ran.done();
}

#[test]
fn every_format_is_there_with_the_bytes_of_the_file_when_it_is_whole() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    long(at);
    let store = Store::of(Manner::Good);
    let endings = ["mcap", "csv", "ndjson", "tum", "parquet"];
    let outputs: Vec<String> = endings
        .iter()
        .map(|e| format!("-o s3://bucket/day/{{stem}}.{e} -o here.{e}"))
        .collect();
    store
        .run(at, &format!("replay long.mcap -q {}", outputs.join(" ")))
        .done();
    for ending in endings {
        let there = store.object(&format!("day/long.{ending}"));
        let here = std::fs::read(at.join(format!("here.{ending}"))).unwrap();
        assert!(there.as_ref() == Some(&here), "{ending}");
        assert_eq!(
            here.len() > 8 << 20,
            ["csv", "ndjson"].contains(&ending),
            "{ending}"
        );
    }
    assert_eq!(store.uploads(), (2, 0));
    // As a folder, and of several.
    store
        .run(at, "replay long.mcap -q -o s3://bucket/all/")
        .done();
    std::fs::copy(at.join("long.mcap"), at.join("more.mcap")).unwrap();
    store
        .run(
            at,
            "replay long.mcap more.mcap -q -o s3://bucket/two/{stem}.tum",
        )
        .done();
    let keys = store.keys();
    for key in ["all/long.attitude.mcap", "two/long.tum", "two/more.tum"] {
        assert!(keys.contains(&key.to_owned()), "{keys:?}");
    }
    // It replaces nothing unless it is asked to, and that is said before the work.
    let again = "replay long.mcap -q -o s3://bucket/two/long.tum";
    store
        .run(at, again)
        .refused(1, &["s3://bucket/two/long.tum: already exists", "--force"]);
    store.run(at, &format!("{again} --force")).done();
}

#[test]
fn what_passes_is_tried_again_and_the_object_is_whole() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    long(at);
    for manner in [
        Manner::BusyEveryThird,
        Manner::CutsEveryThird,
        Manner::LosesTheLastAnswer,
    ] {
        let store = Store::of(manner);
        let run = "replay long.mcap -q -o s3://bucket/a.csv -o a.csv --force";
        let ran = store.run(at, run);
        assert_eq!(ran.code, Some(0), "{manner:?}: {ran:?}");
        let here = std::fs::read(at.join("a.csv")).unwrap();
        assert!(store.object("a.csv") == Some(here), "{manner:?}");
        assert_eq!(store.uploads().1, 0, "{manner:?}");
    }
}

#[test]
fn what_fails_leaves_nothing_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    long(at);
    for (manner, words) in [
        (
            Manner::NeverCompletes,
            "did not make an object of the parts",
        ),
        (Manner::RefusesTheSecondPart, "403 Forbidden"),
    ] {
        let store = Store::of(manner);
        let ran = store.run(at, "replay long.mcap -q -o s3://bucket/a.csv");
        ran.refused(1, &["s3://bucket/a.csv: cannot write", words]);
        assert!(!ran.err.contains("s3cret"), "{}", ran.err);
        assert_eq!(
            (store.keys().len(), store.uploads()),
            (0, (1, 0)),
            "{manner:?}"
        );
    }
    // A run that fails itself, before anything was brought.
    let store = Store::of(Manner::Good);
    let bad = fixture("README.md");
    let ran = store.run(
        at,
        &format!("replay {} -q -o s3://bucket/a.csv", bad.display()),
    );
    assert_eq!(
        (ran.code, store.keys().len(), store.uploads().0),
        (Some(1), 0, 0),
        "{ran:?}"
    );
    for (output, words) in [
        ("https://h/a.csv", "web servers are read, not written to"),
        ("s3://bucket/a.bag", "no format that is written"),
        ("s3://bucket/", "cannot write"),
        ("s3://bucket/a.csv?x=s3cret", "is no address of an object"),
        ("s3://ada:s3cret@bucket/a.csv", "is no address of an object"),
    ] {
        let ran = store.run(at, &format!("replay long.mcap -q -o {output}"));
        let said = ran.err.contains(words) || output.ends_with('/');
        assert!(said && !ran.err.contains("s3cret"), "{output}: {ran:?}");
    }
}

#[cfg(unix)]
fn until(what: &str, is_so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        let waited = begun.elapsed();
        assert!(waited < Duration::from_secs(60), "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[cfg(unix)]
fn signal(child: &std::process::Child, name: &str) {
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-s", name, &id]).status();
    assert!(sent.unwrap().success());
}

#[cfg(unix)]
#[test]
fn who_is_interrupted_gives_the_parts_up() {
    use std::os::unix::process::ExitStatusExt;
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    long(at);
    for (name, number) in [("INT", 2), ("TERM", 15)] {
        let store = Store::of(Manner::Slow);
        let mut child = store
            .command(at, "replay long.mcap -q -o s3://bucket/a.csv")
            .spawn()
            .unwrap();
        until("it begins", || store.uploads() == (1, 1));
        signal(&child, name);
        let asked = Instant::now();
        let status = child.wait().unwrap();
        assert!(
            asked.elapsed() < Duration::from_secs(10),
            "{:?}",
            asked.elapsed()
        );
        assert_eq!(status.signal(), Some(number));
        let mut said = String::new();
        child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut said)
            .unwrap();
        assert!(
            said.contains("s3://bucket/a.csv: interrupted: nothing is there"),
            "{said}"
        );
        assert_eq!((store.keys().len(), store.uploads()), (0, (1, 0)));
    }
}

/// Checks that what is served after the upload ends in order, as it does where the output is a file.
#[cfg(unix)]
#[test]
fn a_page_that_stays_after_the_upload_ends_in_order() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    long(at);
    for name in ["INT", "TERM"] {
        let store = Store::of(Manner::Good);
        let served = "replay long.mcap --page=127.0.0.1:0 --speed max -o s3://bucket/a.csv";
        let mut child = store.command(at, served).spawn().unwrap();
        until("an object comes", || !store.keys().is_empty());
        // Its end is told, and nothing follows it.
        std::thread::sleep(Duration::from_millis(300));
        signal(&child, name);
        assert_eq!(child.wait().unwrap().code(), Some(0), "{name}");
        assert_eq!(store.keys().len(), 1);
    }
}
