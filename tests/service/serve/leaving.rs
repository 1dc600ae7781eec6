//! Whoever leaves, however it leaves, gives back its place, its sensors and its file; whoever only ends its side is
//! served to the end.

use super::client::{Client, rate};
use super::daemon::{Daemon, Process, TCP, WS, eventually, listening, strapd};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use strapd::serve::guard::limits::Limits;

const WATCH: &str = "{\"class\":\"WATCH\"}";
const FROM_NOW: &str = "{\"class\":\"WATCH\",\"last\":false}";
/// The time in which a daemon notices those who have gone without a word.
const NOTICED: Duration = Duration::from_secs(30);

/// A daemon on TCP, WebSocket and the Unix socket at `path` that asks soon who is still there.
fn curious(path: &Path) -> Daemon {
    let unix = format!("unix-listen://{}", path.display());
    let mut settings = listening(&[TCP, WS, &unix]);
    settings.hub.limits.ping = Duration::from_millis(400);
    Daemon::start(settings)
}

/// The way a watcher leaves.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Leaving {
    /// A close after all was read: over TCP as if its side alone had ended.
    Closes,
    /// A close with something unread: over TCP a reset.
    Resets,
    /// An end of its side, a moment of watching, a close.
    EndsFirst,
}

trait Leave: Read + Write + Send {
    fn end(&self);
}

impl Leave for TcpStream {
    fn end(&self) {
        self.shutdown(Shutdown::Write).unwrap();
    }
}

impl Leave for UnixStream {
    fn end(&self) {
        self.shutdown(Shutdown::Write).unwrap();
    }
}

/// Watches, and leaves.
fn watch_and_leave(stream: impl Leave, leaving: Leaving) {
    let mut stream = BufReader::new(stream);
    writeln!(stream.get_mut(), "{WATCH}").unwrap();
    let mut answer = String::new();
    // Of a daemon without a place it is the last it hears.
    stream.read_line(&mut answer).unwrap();
    if leaving != Leaving::Resets {
        stream.read_line(&mut answer).unwrap();
    }
    if leaving == Leaving::EndsFirst {
        stream.get_ref().end();
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A hundred and fifty of every kind, over TCP and a Unix socket.
fn crowd_leaves(tcp: SocketAddr, unix: &Path) {
    std::thread::scope(|scope| {
        for n in 0..10 {
            scope.spawn(move || {
                for leaving in [Leaving::Closes, Leaving::Resets, Leaving::EndsFirst].repeat(5) {
                    match n % 2 {
                        0 => watch_and_leave(TcpStream::connect(tcp).unwrap(), leaving),
                        _ => watch_and_leave(UnixStream::connect(unix).unwrap(), leaving),
                    }
                }
            });
        }
    });
}

/// A client that ends its side and goes on watching.
fn half_closed(mut client: Client) -> Client {
    client.send(WATCH);
    client.next_of("WATCH");
    client.shut();
    client
}

#[test]
fn watchers_that_leave_a_quiet_daemon_keep_no_place_and_those_that_end_their_side_are_served() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let daemon = curious(&path);
    let tcp = daemon.address(0);
    let mut staying = [
        half_closed(Client::tcp(tcp)),
        half_closed(Client::unix(&path)),
    ];
    for _ in 0..2 {
        crowd_leaves(tcp, &path);
        let web: Vec<Client> = (0..20)
            .map(|_| Client::web(daemon.address(1)).watching(WATCH))
            .collect();
        drop(web);
    }
    let began = Instant::now();
    eventually("all who left to be gone", || daemon.hub.connected() == 2);
    assert!(began.elapsed() < NOTICED, "{:?}", began.elapsed());
    // Longer than it takes to be asked, twice.
    std::thread::sleep(Duration::from_millis(900));
    assert_eq!(daemon.hub.connected(), 2);
    let mut sender = Client::tcp(tcp);
    for n in 0..3 {
        sender.send(&rate("a", n, 1.0));
        for watcher in &mut staying {
            assert_eq!(watcher.next_of("ATT")["seq"], n);
        }
    }
    // Who is asked, and is there, is told what for; a Unix socket shows by itself who has gone.
    let [mut asked, mut other] = staying;
    assert_eq!(asked.next_of("NOTE")["code"], "heartbeat");
    sender.send(&rate("a", 3, 1.0));
    assert_eq!(other.object("ATT")["seq"], 3);
}

/// Whether nobody sends a sensor: then anybody may begin its attitude anew.
fn is_free(mut asker: Client, id: &str) -> bool {
    asker.send(&format!("{{\"class\":\"RESET\",\"id\":\"{id}\"}}"));
    loop {
        let line = asker.line().unwrap();
        if line.contains("\"class\":\"ERROR\"") {
            assert!(line.contains("id_in_use"), "{line}");
            return false;
        }
        if line.contains("\"class\":\"RESET\"") {
            return true;
        }
    }
}

#[test]
fn a_sensor_is_free_as_soon_as_its_sender_has_ended_its_side() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let daemon = curious(&path);
    let tcp = || Client::tcp(daemon.address(0));
    let unix = || Client::unix(&path);
    let web = || Client::web(daemon.address(1));
    let connect: [&dyn Fn() -> Client; 3] = [&tcp, &unix, &web];
    let mut n = 0;
    for (transport, connect) in connect.iter().enumerate() {
        // Again and again the same sensor, by somebody who watches it, reads all and leaves.
        for round in 0..6 {
            let mut sender = connect().watching(FROM_NOW);
            sender.send(&rate("demo", n, 1.0));
            assert_eq!(sender.object("ATT")["seq"], n);
            // A WebSocket whose side is ended is over.
            let stays = round % 2 == 1 && transport < 2;
            let mut first = stays.then(|| {
                sender.shut();
                sender
            });
            eventually("the sensor to be free", || is_free(connect(), "demo"));
            n += 1;
            if let Some(first) = &mut first {
                // It gets what another makes of its sensor.
                let mut second = connect().watching(FROM_NOW);
                second.send(&rate("demo", n, 1.0));
                assert_eq!(second.object("ATT")["seq"], n);
                assert_eq!(first.next_of("ATT")["seq"], n);
                drop(second);
                eventually("the sensor to be free", || is_free(connect(), "demo"));
                n += 1;
            }
        }
    }
}

#[test]
fn what_waits_for_the_unit_of_its_stamps_is_used_when_its_sender_ends_its_side() {
    let daemon = Daemon::tcp();
    let mut sender = Client::tcp(daemon.address(0)).watching(FROM_NOW);
    let began = Instant::now();
    for n in 0..3 {
        sender.send(&format!(
            "{{\"id\":\"bare\",\"stamp\":1700000000.0{n},\"gyro\":[0,0,1]}}"
        ));
    }
    sender.shut();
    for n in 0..3 {
        assert_eq!(sender.object("ATT")["seq"], n);
    }
    // By itself it waits for two seconds.
    assert!(
        began.elapsed() < Duration::from_millis(1500),
        "{:?}",
        began.elapsed()
    );
}

#[test]
fn the_truth_and_the_share_of_a_sender_that_has_ended_its_side_are_given_back() {
    let mut settings = listening(&[TCP]);
    // One peer may send three of six sensors.
    settings.hub.limits = Limits {
        sensors: 6,
        sensors_of_client: 2,
        ..Limits::default()
    };
    let daemon = Daemon::start(settings);
    let mut watchers = Vec::new();
    for round in 0..5 {
        let mut sender = Client::tcp(daemon.address(0)).watching(FROM_NOW);
        sender.send(&format!(
            "{{\"class\":\"ATT\",\"id\":\"truth\",\"stamp\":{{\"sec\":{round},\"nsec\":0}},\"q\":{{\"w\":1,\"x\":0,\"y\":0,\"z\":0}},\"world\":\"enu\",\"body\":\"flu\"}}"
        ));
        let ids = ["a", "b"].map(|id| format!("{id}{round}"));
        for id in &ids {
            sender.send(&rate(id, 0, 1.0));
        }
        // An error of any of them would come first.
        let seen = [0; 3].map(|_| sender.object("ATT")["id"].as_str().unwrap().to_owned());
        assert_eq!(seen, ["truth", &*ids[0], &*ids[1]]);
        sender.shut();
        watchers.push(sender);
        let asker = || Client::tcp(daemon.address(0));
        eventually("its sensors to be free", || is_free(asker(), &ids[1]));
    }
    assert!(daemon.hub.connected() >= 5);
}

#[test]
fn who_has_ended_its_side_gives_way_first_the_one_silent_longest_before_the_others() {
    let mut settings = listening(&[TCP]);
    settings.hub.limits = Limits {
        connections: 4,
        ..Limits::default()
    };
    let daemon = Daemon::start(settings);
    let tcp = daemon.address(0);
    let mut watcher = Client::tcp(tcp).watching(FROM_NOW);
    let mut sender = Client::tcp(tcp);
    sender.send(&rate("a", 0, 1.0));
    watcher.object("ATT");
    let mut halves = Vec::new();
    for _ in 0..2 {
        halves.push(half_closed(Client::tcp(tcp)));
        std::thread::sleep(Duration::from_millis(50));
    }
    for half in &mut halves {
        eventually("a place for one more", || {
            let mut newcomer = Client::tcp(tcp);
            let said = newcomer.line().unwrap();
            if said.contains("VERSION") {
                // It leaves its place to nobody: it asks, and goes on asking.
                poll(&mut newcomer);
                std::mem::forget(newcomer);
                return true;
            }
            assert!(said.contains("too_many_clients"), "{said}");
            false
        });
        let said = half.next_of("ERROR");
        assert_eq!(said["code"], "made_room", "{said}");
        assert!(said.to_string().contains("had ended its side"), "{said}");
        assert_eq!(half.line(), None);
    }
    // Nobody else has to go.
    assert_eq!(Client::tcp(tcp).object("ERROR")["code"], "too_many_clients");
    sender.send(&rate("a", 1, 1.0));
    assert_eq!(watcher.object("ATT")["seq"], 1);
}

/// The number of connections that ever got a place, by a `STATUS`.
fn accepted(status: &Value) -> u64 {
    status["counters"]["connections_accepted"].as_u64().unwrap()
}

/// `strapd cat URL ARGS`.
fn cat(address: SocketAddr, args: &[&str]) -> Child {
    Command::new(strapd())
        .args(["-q", "cat", &format!("tcp://{address}")])
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Watchers that are processes: some end by themselves, some are killed, some are stopped before.
fn processes_leave(address: SocketAddr, each: u64, mut accepted: impl FnMut() -> u64) {
    let mut leaving: Vec<Child> = (0..each).map(|_| cat(address, &["-x", "0.1"])).collect();
    leaving
        .iter_mut()
        .for_each(|cat| assert!(cat.wait().unwrap().success()));
    let before = accepted();
    let mut killed: Vec<Child> = (0..2 * each).map(|_| cat(address, &[])).collect();
    eventually("all to be there", || accepted() >= before + 2 * each);
    for (n, cat) in killed.iter_mut().enumerate() {
        if n % 2 == 0 {
            let pid = cat.id().to_string();
            assert!(
                Command::new("kill")
                    .args(["-STOP", &pid])
                    .status()
                    .unwrap()
                    .success()
            );
        }
        cat.kill().unwrap();
        cat.wait().unwrap();
    }
}

#[test]
fn watchers_that_are_processes_keep_no_place_whether_they_end_or_are_killed() {
    let dir = tempfile::tempdir().unwrap();
    let daemon = curious(&dir.path().join("s"));
    processes_leave(daemon.address(0), 4, || accepted(&daemon.status()));
    let began = Instant::now();
    eventually("all to be gone", || daemon.hub.connected() == 0);
    assert!(began.elapsed() < NOTICED, "{:?}", began.elapsed());
}

/// The number of files a process has open.
#[cfg(target_os = "linux")]
fn files(pid: u32) -> usize {
    let open = std::fs::read_dir(format!("/proc/{pid}/fd")).unwrap();
    open.count()
}

fn poll(asker: &mut Client) -> Value {
    asker.send("{\"class\":\"POLL\"}");
    asker.next_of("STATUS")
}

/// The number of clients of a daemon, but for the one that asks.
#[cfg(target_os = "linux")]
fn others(asker: &mut Client) -> usize {
    poll(asker)["clients"].as_array().unwrap().len() - 1
}

#[test]
#[cfg(target_os = "linux")]
fn three_hundred_watchers_that_leave_at_once_leave_no_file_open() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let unix = format!("unix-listen://{}", path.display());
    let mut process = Process::start(&["--listen", TCP, "--listen", &unix]);
    let mut asker = Client::tcp(process.address(0));
    assert_eq!(others(&mut asker), 0);
    let before = files(process.child.id());
    let began = Instant::now();
    for _ in 0..300 {
        watch_and_leave(
            TcpStream::connect(process.address(0)).unwrap(),
            Leaving::Resets,
        );
        watch_and_leave(UnixStream::connect(&path).unwrap(), Leaving::EndsFirst);
    }
    eventually("all to be gone", || others(&mut asker) == 0);
    eventually("the files to be closed", || {
        files(process.child.id()) <= before
    });
    assert!(began.elapsed() < NOTICED, "{:?}", began.elapsed());
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}

/// The times are those of the documentation: nobody is asked before 15 s have passed.
#[test]
#[cfg(target_os = "linux")]
#[ignore = "takes a minute: 300 processes, and 30 s until all are noticed"]
fn half_a_minute_after_three_hundred_watchers_of_every_kind_have_left_all_is_as_before() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let unix = format!("unix-listen://{}", path.display());
    let process = Process::start(&["--listen", TCP, "--listen", &unix, "--max-clients", "1000"]);
    let mut asker = Client::tcp(process.address(0));
    assert_eq!(others(&mut asker), 0);
    let before = files(process.child.id());
    let mut staying = half_closed(Client::tcp(process.address(0)));
    for _ in 0..5 {
        processes_leave(process.address(0), 20, || accepted(&poll(&mut asker)));
    }
    for n in 0..4 {
        let mut sender = Client::tcp(process.address(0)).watching(FROM_NOW);
        sender.send(&rate(&format!("s{n}"), 0, 1.0));
        sender.object("ATT");
    }
    for _ in 0..2 {
        crowd_leaves(process.address(0), &path);
    }
    let began = Instant::now();
    eventually("all to be gone", || others(&mut asker) == 1);
    println!(
        "all were noticed {:.1} s after the last had left",
        began.elapsed().as_secs_f64()
    );
    assert!(began.elapsed() < NOTICED, "{:?}", began.elapsed());
    assert!(files(process.child.id()) <= before + 1);
    for n in 0..4 {
        assert!(is_free(Client::tcp(process.address(0)), &format!("s{n}")));
    }
    asker.send(&rate("late", 0, 1.0));
    while staying.next_of("ATT")["id"] != "late" {}
}
