//! Whoever has no business here takes no place from those who have: plain HTTP and those who have not
//! shown the token have places of their own, and who does nothing with a place gives it up.

use super::client::{Client, ask, get, rate};
use super::daemon::{Daemon, PATIENCE, TCP, WS, eventually, listening};
use serde_json::json;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};
use strapd::serve::guard::admission::Token;
use strapd::serve::guard::limits::Limits;
use tungstenite::client::IntoClientRequest;

const SECRET: &str = "correct horse battery";
const AUTH: &str = "{\"class\":\"AUTH\",\"token\":\"correct horse battery\"}";
const WRONG: &str = "{\"class\":\"AUTH\",\"token\":\"wrong horse battery\"}";

fn guarded(limits: Limits) -> Daemon {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.token = Some(Token::new(SECRET));
    settings.hub.limits = limits;
    Daemon::start(settings)
}

/// Has shown the token and was answered, or has found no place.
fn enter(address: SocketAddr) -> Option<Client> {
    let mut client = Client::tcp(address);
    client.try_send(format!("{AUTH}\n{{\"class\":\"POLL\"}}\n").as_bytes());
    while let Some(line) = client.line() {
        if line.contains("\"class\":\"STATUS\"") {
            return Some(client);
        }
    }
    None
}

/// The same, and watches.
fn enter_watching(address: SocketAddr) -> Client {
    let client = enter(address).unwrap_or_else(|| unreachable!("shut out"));
    client.watching("{\"class\":\"WATCH\"}")
}

/// Asks for a page again and again, and reads nothing.
fn pipeline(address: SocketAddr) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream
        .set_write_timeout(Some(Duration::from_millis(5)))
        .unwrap();
    let requests = "GET /page/live.js HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(1000);
    // As much as there is room for; it may be closed already.
    let _ = stream.write_all(requests.as_bytes());
    stream
}

#[test]
fn clients_that_pipeline_and_never_read_shut_nobody_out() {
    let daemon = guarded(Limits::default());
    let (lines, web) = (daemon.address(0), daemon.address(1));
    let mut sender = enter_watching(lines);
    let mut attackers: Vec<TcpStream> = (0..256).map(|_| pipeline(web)).collect();
    // The lines are not concerned at all.
    let mut others: Vec<Client> = (0..50).map(|_| enter_watching(lines)).collect();
    sender.send(&rate("a", 0, 1.0));
    for client in others.iter_mut().chain([&mut sender]) {
        assert_eq!(client.object("ATT")["id"], "a");
    }
    // And who asks now is answered: those who take nothing give way.
    for _ in 0..20 {
        let (status, body) = get(web, "/healthz", &[("Host", "localhost")]);
        assert_eq!(status, 200, "{body}");
        attackers.push(pipeline(web));
    }
    let mut request = format!("ws://{web}/ws").into_client_request().unwrap();
    let bearer = format!("Bearer {SECRET}").parse().unwrap();
    request.headers_mut().insert("Authorization", bearer);
    let stream = TcpStream::connect(web).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let (mut socket, _) = tungstenite::client(request, stream).unwrap();
    assert!(socket.read().unwrap().to_string().contains("VERSION"));
}

#[test]
fn an_answer_that_is_not_taken_ends() {
    let mut settings = listening(&[WS]);
    settings.hub.limits = Limits {
        no_progress: Duration::from_millis(500),
        // Nobody has to give way: each ends by itself.
        http: 1000,
        ..Limits::default()
    };
    let daemon = Daemon::start(settings);
    let mut attackers: Vec<TcpStream> = (0..64).map(|_| pipeline(daemon.address(0))).collect();
    eventually("all to be closed", || {
        attackers.retain_mut(|stream| still_there(&stream.write_all(b"GET / HTTP/1.1\r\n")));
        attackers.is_empty()
    });
}

/// Whether a peer is still there, by what became of a write.
fn still_there(written: &std::io::Result<()>) -> bool {
    use std::io::ErrorKind::{TimedOut, WouldBlock};
    match written {
        Ok(()) => true,
        Err(why) => matches!(why.kind(), TimedOut | WouldBlock),
    }
}

#[test]
fn who_has_not_shown_the_token_keeps_nobody_out_who_does() {
    let daemon = guarded(Limits {
        unproven: 8,
        ..Limits::default()
    });
    let (lines, web) = (daemon.address(0), daemon.address(1));
    let mut inside = enter_watching(lines);
    let mut silent = Vec::new();
    for round in 0..20 {
        for _ in 0..10 {
            silent.push(TcpStream::connect(lines).unwrap());
            silent.push(TcpStream::connect(web).unwrap());
        }
        let mut client = enter_watching(lines);
        let id = format!("of round {round}");
        client.send(&rate(&id, 0, 1.0));
        // After the last ones of those before it.
        while client.object("ATT")["id"] != id {}
        while inside.object("ATT")["id"] != id {}
    }
    // Those who were pushed out know it.
    let told = silent.into_iter().filter_map(|mut stream| {
        let mut said = String::new();
        stream
            .set_read_timeout(Some(Duration::from_millis(1)))
            .unwrap();
        let _ = stream.read_to_string(&mut said);
        said.contains("made_room").then_some(())
    });
    assert!(told.count() > 100);
}

#[test]
fn who_sends_and_watches_nothing_gives_way_when_places_are_short_and_not_before() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.limits = Limits {
        connections: 4,
        idle: Duration::from_millis(1500),
        ..Limits::default()
    };
    let daemon = Daemon::start(settings);
    let address = daemon.address(0);
    let mut watcher = Client::tcp(address).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(address);
    let poll = |client: &mut Client| {
        client.send("{\"class\":\"POLL\"}");
        client.next_of("STATUS")
    };
    let mut oldest = Client::web(daemon.address(1));
    poll(&mut oldest);
    let mut other = Client::tcp(address);
    poll(&mut other);
    let mut n = 0;
    let mut send = |sender: &mut Client, watcher: &mut Client| {
        sender.send(&rate("a", n, 1.0));
        assert_eq!(watcher.object("ATT")["seq"], n);
        n += 1;
    };
    let began = Instant::now();
    let mut newcomer = loop {
        send(&mut sender, &mut watcher);
        let mut newcomer = Client::tcp(address);
        let said = newcomer.line().unwrap();
        if said.contains("VERSION") {
            break newcomer;
        }
        assert!(said.contains("too_many_clients"), "{said}");
        assert!(began.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(20));
    };
    assert!(
        began.elapsed() > Duration::from_millis(1000),
        "{:?}",
        began.elapsed()
    );
    assert_eq!(oldest.object("ERROR")["code"], "made_room");
    assert_eq!(oldest.line(), None);
    // The others are served as ever.
    poll(&mut newcomer);
    poll(&mut other);
    send(&mut sender, &mut watcher);
    // While there is room nobody goes, however idle.
    drop((newcomer, sender));
    eventually("two places", || daemon.hub.connected() == 2);
    std::thread::sleep(Duration::from_millis(1600));
    poll(&mut other);
}

#[test]
fn a_wrong_token_is_answered_ever_later_and_a_right_one_at_once() {
    let daemon = guarded(Limits::default());
    let (lines, web) = (daemon.address(0), daemon.address(1));
    let host = web.to_string();
    for wait in [100, 200, 400, 800] {
        let began = Instant::now();
        if wait == 800 {
            // Over HTTP it is the same address.
            let headers = [
                ("Host", &*host),
                ("Authorization", "Bearer wrong horse battery"),
            ];
            assert_eq!(get(web, "/metrics", &headers).0, 401);
        } else {
            let mut client = Client::tcp(lines);
            client.send(WRONG);
            assert_eq!(client.rest().last().unwrap()["code"], "unauthorised");
        }
        assert!(
            began.elapsed() >= Duration::from_millis(wait),
            "{:?}",
            began.elapsed()
        );
    }
    // Four more, not waited for: the last waits 5 s.
    let waiting: Vec<Client> = (0..4)
        .map(|_| {
            let mut client = Client::tcp(lines);
            client.send(WRONG);
            client
        })
        .collect();
    for _ in 0..10 {
        let began = Instant::now();
        assert!(enter(lines).is_some());
        let headers = [
            ("Host", &*host),
            ("Authorization", "Bearer correct horse battery"),
        ];
        assert_eq!(get(web, "/metrics", &headers).0, 200);
        // Less than any of those that wait.
        assert!(
            began.elapsed() < Duration::from_millis(1600),
            "{:?}",
            began.elapsed()
        );
    }
    drop(waiting);
}

#[test]
fn a_storm_of_wrong_tokens_keeps_no_right_one_out() {
    let daemon = guarded(Limits::default());
    let (lines, web) = (daemon.address(0), daemon.address(1));
    let (over, tried) = (AtomicBool::new(false), AtomicU32::new(0));
    std::thread::scope(|scope| {
        for n in 0..4 {
            let (over, tried) = (&over, &tried);
            scope.spawn(move || {
                let mut open = Vec::new();
                while !over.load(Ordering::Relaxed) {
                    let address = if n % 2 == 0 { lines } else { web };
                    // Without ports to connect from there is a moment's peace.
                    let Ok(mut stream) = TcpStream::connect(address) else {
                        continue;
                    };
                    let shown = if n % 2 == 0 {
                        format!("{WRONG}\n")
                    } else {
                        "GET /metrics HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer wrong horse battery\r\n\r\n".to_owned()
                    };
                    let _ = stream.write_all(shown.as_bytes());
                    tried.fetch_add(1, Ordering::Relaxed);
                    open.push(stream);
                    if open.len() > 200 {
                        open.clear();
                    }
                }
            });
        }
        let began = Instant::now();
        let (mut right, mut got_in) = (0, 0);
        while began.elapsed() < Duration::from_secs(3) || right < 50 {
            right += 1;
            got_in += usize::from(enter(lines).is_some());
        }
        let each = began.elapsed() / u32::try_from(right).unwrap();
        let answered = ask(
            web,
            "GET /metrics",
            &[
                ("Host", "localhost"),
                ("Authorization", "Bearer correct horse battery"),
            ],
            b"",
        );
        over.store(true, Ordering::Relaxed);
        let tried = tried.load(Ordering::Relaxed);
        eprintln!(
            "{got_in} of {right} right tokens got in among {tried} wrong ones, {each:?} each"
        );
        assert!(tried > 100, "{tried}");
        // A machine under load may let one wait for so long that a storm pushes it out.
        assert!(got_in + right / 20 >= right, "{got_in} of {right}");
        assert_eq!(answered.0, 200, "{}", answered.1);
    });
    let status = daemon.status();
    assert_eq!(status["sources"], json!([]), "{status}");
}
