//! Faults of servers: they pass and nobody sees them, or they are reported.

use super::fixture;
use super::server::{Manner, Server};
use crate::program::{Ran, strapd};
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};
use strapd::address::Address;
use strapd::store::{patience::Patience, reach_with};
use strapd_recording::remote_object::RemoteSource;

/// A log of several requests: 2 MB, of which nothing is left out.
fn log(dir: &Path) -> String {
    let made =
        "simulate coning --rate-hz 1000 --duration 20 --compression none -o log.mcap -q --force";
    strapd(dir, made).done();
    strapd(dir, "replay log.mcap -o file.csv --force").done();
    "log.mcap".to_owned()
}

fn replayed(dir: &Path, server: &Server) -> Ran {
    strapd(
        dir,
        &format!("replay {} -o there.csv --force", server.url("log.mcap")),
    )
}

#[test]
fn what_passes_is_waited_for_and_cut_bodies_are_gone_on_with() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(dir.path().join(log(dir.path()))).unwrap();
    for manner in [
        Manner::Slow,
        Manner::Cut(bytes.len() / 5),
        Manner::BusyEveryThird,
        Manner::WrongLength,
        Manner::Endless,
    ] {
        let server = Server::of(manner.clone(), bytes.clone());
        let ran = replayed(dir.path(), &server);
        assert_eq!(ran.code, Some(0), "{manner:?}: {ran:?}");
        let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
        assert!(read("there.csv") == read("file.csv"), "{manner:?}");
        assert!(server.asked().len() > 2, "{manner:?}");
        assert!(
            server.sent() <= bytes.len(),
            "{manner:?}: {}",
            server.sent()
        );
    }
}

#[test]
fn an_object_that_changes_ends_the_run() {
    let dir = tempfile::tempdir().unwrap();
    let name = log(dir.path());
    let server = Server::file(Manner::ChangedAfter(2), &dir.path().join(name));
    let ran = replayed(dir.path(), &server);
    ran.refused(
        1,
        &["log.mcap", "the object changed while it was read", "help: "],
    );
    assert!(!dir.path().join("there.csv").exists());
}

#[test]
fn a_short_object_is_damaged_as_a_file_is() {
    let dir = tempfile::tempdir().unwrap();
    let name = log(dir.path());
    let mut bytes = std::fs::read(dir.path().join(name)).unwrap();
    bytes.truncate(bytes.len() / 2);
    std::fs::write(dir.path().join("short.mcap"), &bytes).unwrap();
    let file = strapd(dir.path(), "replay short.mcap -o file.csv --force");
    assert_eq!(file.code, Some(3), "{file:?}");
    for manner in [Manner::Good, Manner::NoRanges] {
        let ran = replayed(dir.path(), &Server::of(manner, bytes.clone()));
        assert_eq!(ran.code, Some(3), "{ran:?}");
        let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
        assert!(read("there.csv") == read("file.csv"));
    }
}

#[test]
fn who_says_no_is_told_by_address_and_number() {
    let dir = tempfile::tempdir().unwrap();
    for (manner, words) in [
        (Manner::Refuse(404), ["404 Not Found", "log.mcap"]),
        (
            Manner::Refuse(403),
            ["403 Forbidden", "help: a signed address"],
        ),
        (
            Manner::Refuse(500),
            ["500 Internal Server Error (5 times)", "try again later"],
        ),
        (
            Manner::Busy("Retry-After: 1\r\n"),
            ["503 Service Unavailable (5 times)", "try again"],
        ),
        (Manner::Packed, ["packed", "save it to a file"]),
        (
            Manner::Elsewhere("/round".to_owned()),
            ["leads on more than", "log.mcap"],
        ),
        (Manner::NoRangesCut, [" bytes", "after "]),
    ] {
        let asked_to_wait = matches!(manner, Manner::Busy(_));
        let begun = Instant::now();
        let said = format!("{manner:?}");
        let server = Server::file(manner, &fixture("xsens_mti.mcap"));
        let ran = replayed(dir.path(), &server);
        ran.refused(1, &words);
        assert!(
            ran.err.contains(&server.url("log.mcap")),
            "{said}: {}",
            ran.err
        );
        // Four pauses, as the server asked.
        assert!(
            begun.elapsed() > Duration::from_secs(4) || !asked_to_wait,
            "{said}"
        );
    }
    let gone = {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        listener.local_addr().unwrap()
    };
    strapd(dir.path(), &format!("info http://{gone}/log.mcap"))
        .refused(1, &["log.mcap", "refused", "(5 times)"]);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

/// Reads all of it, or what that failed with.
fn all(server: &Server, patience: Patience) -> Result<usize, String> {
    let address = Address::from(server.url("log.mcap"));
    match reach_with(&address, patience).map_err(|e| e.to_string())? {
        RemoteSource::Stream(mut stream) => {
            let mut bytes = Vec::new();
            stream.read_to_end(&mut bytes).map_err(|e| e.to_string())
        }
        RemoteSource::Object(object) => {
            let mut bytes = vec![0; object.size() as usize];
            object.read_at(&mut bytes, 0).map_err(|e| e.to_string())
        }
    }
}

#[test]
fn who_says_nothing_or_next_to_nothing_is_not_waited_for() {
    let patience = Patience {
        tries: 2,
        silence: Duration::from_millis(300),
        spell: Duration::from_millis(400),
        ..Patience::default()
    };
    for (manner, word) in [
        (Manner::Silent, "no answer within 0.3 s"),
        (Manner::Dripping, "bytes came within 0.4 s"),
    ] {
        let begun = Instant::now();
        let server = Server::of(manner.clone(), vec![7; 1 << 20]);
        let said = all(&server, patience).unwrap_err();
        assert!(said.contains(word), "{manner:?}: {said}");
        assert!(begun.elapsed() < Duration::from_secs(20), "{manner:?}");
    }
    let server = Server::of(Manner::Good, vec![7; 1 << 20]);
    assert_eq!(all(&server, patience), Ok(1 << 20));
}

#[test]
fn bytes_are_those_of_the_object_wherever_it_is_read_and_each_is_fetched_once() {
    let object: Vec<u8> = (0..5_000_000_u32).map(|n| (n * 7 / 3) as u8).collect();
    let server = Server::of(Manner::Cut(400_000), object.clone());
    let address = Address::from(server.url("a"));
    let Ok(RemoteSource::Object(found)) = reach_with(&address, Patience::default()) else {
        panic!("it knows ranges");
    };
    assert_eq!(found.size(), object.len() as u64);
    let mut state = 1;
    let places: Vec<usize> = (0..60)
        .map(|_| crate::mcap_logs::random(&mut state) as usize % object.len())
        .collect();
    let read = |at: usize, length: usize| {
        let mut bytes = vec![0; length];
        let n = found.read_at(&mut bytes, at as u64).unwrap();
        assert_eq!(n, length.min(object.len() - at));
        assert!(bytes[..n] == object[at..at + n], "{length} at {at}");
    };
    for at in &places[..20] {
        read(*at, 1000);
    }
    found.expect(vec![3_000_000..4_000_000, 0..200_000], 1 << 20);
    for at in &places[20..] {
        read(*at, 30_000);
    }
    // On many threads, and as a whole.
    std::thread::scope(|scope| {
        for at in &places {
            scope.spawn(|| read(*at, 200_000));
        }
    });
    read(0, object.len() + 10);
    assert_eq!(server.sent(), object.len());
    assert_eq!(found.read_at(&mut [0; 4], 1 << 40).unwrap(), 0);
}
