//! Keys with `*`: the store says what it has, a page at a time, and what is meant is read in the order of its names.

use super::fixture;
use super::server::asked_range;
use crate::program::{Ran, ended};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};

/// Keys on a page of a listing.
const PAGE: usize = 3;

/// A store with one bucket, as S3 answers; its first `busy` listings are refused for now.
struct Store {
    place: String,
    asked: Arc<Mutex<Vec<String>>>,
}

impl Store {
    fn of(objects: BTreeMap<String, Vec<u8>>, mut busy: usize, refused: Option<u16>) -> Store {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let place = listener.local_addr().unwrap().to_string();
        let asked = Arc::new(Mutex::new(Vec::new()));
        let heads = Arc::clone(&asked);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let mut reader = BufReader::new(stream.try_clone().unwrap());
                let mut head = String::new();
                while reader.read_line(&mut head).unwrap() > 2 {}
                let is_listing = head.contains("list-type=2");
                heads.lock().unwrap().push(head.clone());
                let _ = match refused {
                    _ if is_listing && busy > 0 => {
                        busy -= 1;
                        answer(stream, "503 Slow Down", "", b"")
                    }
                    Some(status) => answer(stream, &status.to_string(), "", b""),
                    None if is_listing => listing(stream, &head, &objects),
                    None => object(stream, &head, &objects),
                };
            }
        });
        Store { place, asked }
    }

    /// One that answers each request by `answers`.
    fn by(answers: impl Fn(TcpStream) -> std::io::Result<()> + Send + 'static) -> Store {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let place = listener.local_addr().unwrap().to_string();
        let asked = Arc::new(Mutex::new(Vec::new()));
        let heads = Arc::clone(&asked);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let mut reader = BufReader::new(stream.try_clone().unwrap());
                let mut head = String::new();
                while reader.read_line(&mut head).unwrap() > 2 {}
                heads.lock().unwrap().push(head);
                // Who asked may have enough before the end.
                let _ = answers(stream);
            }
        });
        Store { place, asked }
    }

    fn run(&self, dir: &Path, arguments: &str) -> Ran {
        let mut command = Command::new(env!("CARGO_BIN_EXE_strapd"));
        command
            .current_dir(dir)
            .env("NO_PROXY", "127.0.0.1")
            .env("AWS_ENDPOINT_URL", format!("http://{}", self.place))
            .env("AWS_ALLOW_HTTP", "true")
            .env("AWS_ACCESS_KEY_ID", "ada")
            .env("AWS_SECRET_ACCESS_KEY", "s3cret")
            .env("AWS_REGION", "eu-west-1")
            .args(arguments.split_whitespace());
        let output = ended(&command, "");
        Ran {
            code: output.status.code(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    fn listings(&self) -> usize {
        let asked = self.asked.lock().unwrap();
        asked
            .iter()
            .filter(|head| head.contains("list-type=2"))
            .count()
    }
}

fn answer(mut to: TcpStream, status: &str, said: &str, body: &[u8]) -> std::io::Result<()> {
    let length = body.len();
    write!(
        to,
        "HTTP/1.1 {status}\r\nConnection: close\r\nContent-Length: {length}\r\n{said}\r\n"
    )?;
    to.write_all(body)
}

/// A value of the query of a request.
fn asked_for(head: &str, name: &str) -> Option<String> {
    let path = head.split(' ').nth(1)?;
    let (_, query) = path.split_once('?')?;
    let mut pairs = query.split('&').filter_map(|pair| pair.split_once('='));
    let (_, value) = pairs.find(|(key, _)| *key == name)?;
    Some(value.replace("%2F", "/"))
}

fn listing(to: TcpStream, head: &str, objects: &BTreeMap<String, Vec<u8>>) -> std::io::Result<()> {
    let prefix = asked_for(head, "prefix").unwrap_or_default();
    let from = asked_for(head, "continuation-token").map_or(0, |token| token.parse().unwrap());
    // Stores list in the order of names; that nothing relies on it, this one does not.
    let all = objects
        .iter()
        .rev()
        .filter(|(key, _)| key.starts_with(&prefix));
    let page: Vec<_> = all.clone().skip(from).take(PAGE).collect();
    let contents: String = page
        .iter()
        .map(|(key, bytes)| {
            let size = bytes.len();
            format!("<Contents><Key>{key}</Key><LastModified>2026-11-24T20:00:00.000Z</LastModified><ETag>&quot;1&quot;</ETag><Size>{size}</Size></Contents>")
        })
        .collect();
    let more = match from + PAGE < all.count() {
        true => format!(
            "<NextContinuationToken>{}</NextContinuationToken>",
            from + PAGE
        ),
        false => String::new(),
    };
    let body =
        format!("<?xml version=\"1.0\"?><ListBucketResult>{contents}{more}</ListBucketResult>");
    answer(
        to,
        "200 OK",
        "Content-Type: application/xml\r\n",
        body.as_bytes(),
    )
}

fn object(to: TcpStream, head: &str, objects: &BTreeMap<String, Vec<u8>>) -> std::io::Result<()> {
    let key = head
        .split(' ')
        .nth(1)
        .and_then(|path| path.strip_prefix("/bucket/"));
    let Some(bytes) = key.and_then(|key| objects.get(key)) else {
        return answer(to, "404 Not Found", "", b"");
    };
    let size = bytes.len();
    let range = asked_range(head).unwrap();
    let range = range.start..range.end.min(size);
    let said = format!(
        "Content-Range: bytes {}-{}/{size}\r\nETag: \"1\"\r\nLast-Modified: Tue, 24 Nov 2026 20:00:00 GMT\r\n",
        range.start,
        range.end - 1
    );
    answer(to, "206 Partial Content", &said, &bytes[range])
}

fn objects() -> BTreeMap<String, Vec<u8>> {
    let log = |name: &str| std::fs::read(fixture(name)).unwrap();
    [
        ("2024/05/b.mcap", log("constant_rate.mcap")),
        ("2024/05/a.mcap", log("xsens_mti.mcap")),
        ("2024/05/notes.txt", b"no log".to_vec()),
        ("2024/06/c.mcap", log("constant_rate.mcap")),
        ("2024/c.mcap", log("constant_rate.mcap")),
        ("2025/d.mcap", b"not to be read".to_vec()),
        ("x.mcap", b"not to be read".to_vec()),
    ]
    .map(|(key, bytes)| (key.to_owned(), bytes))
    .into()
}

#[test]
fn a_pattern_is_the_recordings_that_it_means_in_the_order_of_their_names() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let store = Store::of(objects(), 2, None);
    let run = "replay s3://bucket/2024/05/*.mcap -o {stem}.csv --sample-kind average";
    let ran = store.run(at, run);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    // Refused twice, then in pages.
    assert_eq!(store.listings(), 3, "{:?}", store.asked.lock().unwrap());
    for (stem, log) in [("a", "xsens_mti.mcap"), ("b", "constant_rate.mcap")] {
        let log = fixture(log);
        let file = format!(
            "replay {} -o file.csv --force --sample-kind average",
            log.display()
        );
        assert_eq!(store.run(at, &file).code, Some(0));
        let read = |name: &str| std::fs::read(at.join(name)).unwrap();
        assert!(read(&format!("{stem}.csv")) == read("file.csv"), "{stem}");
    }
    for (pattern, meant) in [
        (
            "2024/**/*.mcap",
            &[
                "2024/05/a.mcap",
                "2024/05/b.mcap",
                "2024/06/c.mcap",
                "2024/c.mcap",
            ][..],
        ),
        ("2024/0*/c.mcap", &["2024/06/c.mcap"]),
    ] {
        let ran = store.run(at, &format!("info s3://bucket/{pattern}"));
        let mut places = Vec::new();
        for line in ran.out.lines().filter(|line| line.starts_with("file")) {
            places.push(line.split_whitespace().nth(1).unwrap().to_owned());
        }
        let meant: Vec<String> = meant
            .iter()
            .map(|key| format!("s3://bucket/{key}"))
            .collect();
        assert_eq!(places, meant, "{ran:?}");
    }
}

#[test]
fn a_pattern_that_means_nothing_or_can_not_be_asked_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let store = Store::of(objects(), 0, None);
    for (arguments, words) in [
        (
            "info s3://bucket/2024/05/*.bag",
            &[
                "s3://bucket/2024/05/*.bag",
                "none of the 3 objects in `2024/05/`",
                "** any number",
            ][..],
        ),
        (
            "cat s3://bucket/2024/05/*.mcap",
            &["a pattern may mean several objects", "replay, info"],
        ),
        (
            "replay http://127.0.0.1:9/a/*.mcap?sig=s3cret -o null:",
            &["does not say what it has", "%2A"],
        ),
    ] {
        let ran = store.run(at, arguments);
        ran.refused(1, words);
        assert!(!ran.err.contains("s3cret"), "{}", ran.err);
    }
    let no = Store::of(objects(), 0, Some(403));
    no.run(at, "check s3://bucket/*.mcap")
        .refused(1, &["403 Forbidden", "AWS_ACCESS_KEY_ID"]);
    let busy = Store::of(objects(), 9, None);
    busy.run(at, "check s3://bucket/*.mcap")
        .refused(1, &["503 Service Unavailable"]);
    assert_eq!(busy.listings(), 5);
}

#[test]
fn a_listing_that_never_ends_or_is_none_is_named_for_what_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let xml = "Content-Type: application/xml\r\n";
    let run = "info s3://bucket/2024/*.mcap";
    // There is always more, and never a key.
    let store = Store::by(move |to| {
        let body = "<?xml version=\"1.0\"?><ListBucketResult><IsTruncated>true</IsTruncated><NextContinuationToken>1</NextContinuationToken></ListBucketResult>";
        answer(to, "200 OK", xml, body.as_bytes())
    });
    let ran = store.run(dir.path(), run);
    assert_ne!(ran.code, Some(0), "{ran:?}");
    assert!(
        ran.err
            .contains("100 pages of the listing in a row had no key"),
        "{ran:?}"
    );
    assert_eq!(store.listings(), 100);

    // A page of 200 MB is not kept.
    let store = Store::by(move |mut to| {
        write!(
            to,
            "HTTP/1.1 200 OK\r\nConnection: close\r\nContent-Length: 200000000\r\n{xml}\r\n"
        )?;
        to.write_all(b"<?xml version=\"1.0\"?><ListBucketResult>")?;
        (0..200).try_for_each(|_| to.write_all(&[b' '; 1_000_000]))
    });
    let ran = store.run(dir.path(), run);
    assert!(
        ran.err
            .contains("a page of the listing has more than 16 MiB"),
        "{ran:?}"
    );
    assert_eq!(store.listings(), 1);

    // A page for people is no fault of the credentials.
    let store = Store::by(|to| {
        answer(
            to,
            "200 OK",
            "Content-Type: text/html\r\n",
            b"<html><p>Sign in to the network",
        )
    });
    let ran = store.run(dir.path(), run);
    assert!(
        ran.err.contains("(text/html) is not what a store says"),
        "{ran:?}"
    );
    assert!(!ran.err.contains("credentials"), "{ran:?}");
}

#[test]
fn a_size_that_no_object_has_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for size in [u64::MAX, i64::MAX as u64, 1 << 51] {
        let store = Store::by(move |to| {
            let said = format!(
                "Content-Range: bytes 0-9/{size}\r\nETag: \"1\"\r\nLast-Modified: Tue, 24 Nov 2026 20:00:00 GMT\r\n"
            );
            answer(to, "206 Partial Content", &said, b"0123456789")
        });
        let run = format!("info http://{}/a.mcap", store.place);
        let ran = store.run(dir.path(), &run);
        assert!(
            ran.err.contains("and no store takes one of more than"),
            "{run}: {ran:?}"
        );
        // Asked as a store it is refused, too, for what else its answer is not.
        let ran = store.run(dir.path(), "info s3://bucket/a.mcap");
        assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""), "{ran:?}");
    }
}
