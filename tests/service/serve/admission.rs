//! Admission of clients.

use super::aiding::{aided, line};
use super::client::{Client, ask, get, rate};
use super::daemon::{Daemon, Process, TCP, UDP, WS, eventually, listening, strapd};
use std::io::{BufRead, BufReader, Read};
use std::net::{IpAddr, SocketAddr};
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Stdio};
use strapd::serve::guard::admission::{Token, Web};

const SECRET: &str = "correct horse battery";

#[test]
fn hosts_and_origins_are_admitted_by_list_in_every_combination() {
    let web = Web {
        hosts: vec!["robot.local".to_owned(), "lab.example:8765".to_owned()],
        origins: vec!["https://viewer.example".to_owned()],
    };
    let bound: IpAddr = [192, 168, 1, 7].into();
    let good_hosts = [
        "localhost",
        "127.0.0.1",
        "[::1]",
        "LOCALHOST",
        "192.168.1.7",
        "robot.local",
    ];
    let bad_hosts = [
        "evil.example",
        "localhost.evil.example",
        "127.0.0.1.evil.example",
        "robot.local.evil",
        "xrobot.local",
        "192.168.1.8",
        "127.0.0.2",
        "0.0.0.0",
        "",
        "[::1",
        "[::2]",
        "localhost:80:80",
        "localhost:",
        "localhost:8x",
        "localhost@evil.example",
        "127.1",
        "lab.example",
        "lab.example:1",
        "?",
    ];
    let ports = ["", ":8765", ":80"];
    let mut pairs = 0;
    let mut check = |host: &str, origin: Option<&str>, allowed: bool| {
        pairs += 1;
        assert_eq!(
            web.admit(bound, Some(host), origin).is_ok(),
            allowed,
            "Host {host}, Origin {origin:?}"
        );
    };
    let hosts = good_hosts
        .iter()
        .flat_map(|h| ports.iter().map(move |p| (format!("{h}{p}"), true)))
        .chain([("lab.example:8765".to_owned(), true)])
        .chain(bad_hosts.iter().map(|h| ((*h).to_owned(), false)));
    for (host, is_ours) in hosts {
        check(&host, None, is_ours);
        check(&host, Some("https://viewer.example"), is_ours);
        for scheme in ["http", "https"] {
            check(&host, Some(&format!("{scheme}://{host}")), is_ours);
        }
        for origin in [
            "null",
            "",
            "file://",
            "https://evil.example",
            "http://viewer.example",
            "https://viewer.example.evil",
            "https://viewer.example:8443",
            "http://localhost:1",
            "http://127.0.0.1:9999",
            "ftp://localhost",
            "chrome-extension://abc",
        ] {
            check(&host, Some(origin), false);
        }
        check(&host, Some(&format!("http://{host}.evil")), false);
        check(&host, Some(&format!("http://evil@{host}")), false);
        check(&host, Some(&format!("gopher://{host}")), false);
    }
    assert!(pairs > 600, "{pairs}");
    assert!(web.admit(bound, None, None).is_err(), "no Host at all");
    // Bound to every address, the address is none of ours by itself.
    assert!(
        Web::default()
            .admit([0, 0, 0, 0].into(), Some("0.0.0.0"), None)
            .is_err()
    );
}

#[test]
fn a_page_from_elsewhere_gets_neither_numbers_nor_a_web_socket() {
    let daemon = Daemon::start(listening(&[WS]));
    let address = daemon.address(0);
    let host = address.to_string();
    let upgrade = [
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ];
    for path in ["/healthz", "/metrics", "/ws", "/"] {
        // A rebound name, a foreign page, two Hosts, none.
        for headers in [
            vec![("Host", "evil.example")],
            vec![("Host", &*host), ("Origin", "https://evil.example")],
            vec![("Host", &*host), ("Origin", "null")],
            vec![("Host", &*host), ("Host", "localhost")],
            vec![],
        ] {
            let headers: Vec<_> = headers.into_iter().chain(upgrade).collect();
            let (status, body) = get(address, path, &headers);
            assert!(
                matches!(status, 400 | 403),
                "{path} {headers:?}: {status} {body}"
            );
        }
    }
    let (status, body) = get(address, "/healthz", &[("Host", &host)]);
    assert_eq!((status, &*body), (200, "ok\n"));
    let (status, _) = get(address, "/ws", &[("Host", &host)]);
    assert_eq!(status, 426);
    let (status, _) = get(address, "/../etc/passwd", &[("Host", &host)]);
    assert_eq!(status, 404);
    // A target that names whom it is for is believed no more than Host is.
    for foreign in [
        "http://evil.example/metrics",
        "http://evil.example:80/samples",
        "http://localhost@evil.example/metrics",
        "http://evil@localhost/metrics",
        "//evil.example/metrics",
    ] {
        let (status, body) = get(address, foreign, &[("Host", &host)]);
        assert!(matches!(status, 403 | 404), "{foreign}: {status} {body}");
        assert!(!body.contains("strapd_"), "{foreign}: {body}");
        if foreign.starts_with("http:") {
            assert_eq!(status, 403, "{foreign}: {body}");
        }
    }
    let ours = format!("http://{host}/healthz");
    assert_eq!(get(address, &ours, &[("Host", &host)]).0, 200);
    assert_eq!(get(address, &ours, &[("Host", "evil.example")]).0, 403);
    // A page served from here would have this origin.
    let origin = format!("http://{host}");
    let (status, _) = get(address, "/metrics", &[("Host", &host), ("Origin", &origin)]);
    assert_eq!(status, 200);
}

fn guarded() -> Daemon {
    let mut settings = listening(&[TCP, WS, UDP]);
    settings.hub.token = Some(Token::new(SECRET));
    Daemon::start(settings)
}

#[test]
fn nobody_is_heard_before_the_token() {
    let daemon = guarded();
    let auth = format!("{{\"class\":\"AUTH\",\"token\":\"{SECRET}\"}}");
    let mut right = Client::tcp(daemon.address(0));
    right.send(&auth);
    let mut right = right.watching("{\"class\":\"WATCH\"}");
    for first in [
        "{\"class\":\"WATCH\"}".to_owned(),
        "{\"class\":\"POLL\"}".to_owned(),
        rate("evil", 0, 1.0),
        "{\"class\":\"AUTH\",\"token\":\"correct horse batterY\"}".to_owned(),
        "{\"class\":\"AUTH\"}".to_owned(),
        "garbage".to_owned(),
    ] {
        for mut client in [
            Client::tcp(daemon.address(0)),
            Client::web(daemon.address(1)),
        ] {
            client.object("VERSION");
            client.send(&first);
            let said = client.object("ERROR");
            assert!(said["code"] == "unauthorised", "{first}: {said}");
            assert!(!said.to_string().contains("horse"), "{said}");
            assert_eq!(client.line(), None, "{first}");
        }
    }
    let mut udp = Client::udp(daemon.address(2));
    udp.send(&rate("evil", 0, 1.0));
    right.send(&rate("good", 0, 1.0));
    assert_eq!(right.object("ATT")["id"], "good");
    let status = daemon.status();
    assert_eq!(status["sources"].as_array().unwrap().len(), 1, "{status}");
}

#[test]
fn over_http_the_token_is_a_bearer() {
    let daemon = guarded();
    let host = daemon.address(1).to_string();
    let ask = |path: &str, token: Option<&str>| {
        let bearer = token.map(|t| format!("Bearer {t}"));
        let mut headers = vec![("Host", &*host)];
        headers.extend(bearer.as_deref().map(|b| ("Authorization", b)));
        get(daemon.address(1), path, &headers).0
    };
    assert_eq!(ask("/healthz", None), 200);
    assert_eq!(ask("/metrics", None), 401);
    assert_eq!(ask("/metrics", Some(SECRET)), 200);
    assert_eq!(ask("/metrics", Some("wrong")), 401);
}

#[test]
fn no_wrong_token_delays_a_right_one() {
    let token = Token::new(SECRET);
    let (now, from) = (std::time::Instant::now(), IpAddr::from([127, 0, 0, 1]));
    for n in 0..10_000_u32 {
        let denied = token.judge("wrong", from, now).unwrap_err();
        assert_eq!(denied.fault.code, "unauthorised");
        assert!(n < 6 || denied.delay.as_secs() == 5, "{n}: {denied:?}");
        assert_eq!(token.judge(SECRET, from, now), Ok(()));
    }
}

#[test]
fn the_log_names_what_was_refused_and_the_flag_that_allows_it() {
    let mut process = Process::start(&["--listen", WS]);
    let address = process.address(0);
    let page = "http://localhost:18080";
    for _ in 0..5 {
        let host = [("Host", "localhost"), ("Origin", page)];
        assert_eq!(get(address, "/ws", &host).0, 403);
        assert_eq!(get(address, "/", &[("Host", "robot.local")]).0, 403);
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let log: Vec<String> = process.log.by_ref().lines().map(Result::unwrap).collect();
    let said = |words: &str| log.iter().filter(|line| line.contains(words)).count();
    assert_eq!(
        said(&format!("--allow-origin {page} allows them")),
        1,
        "{log:?}"
    );
    assert_eq!(
        said("robot.local was refused; --allow-host allows it"),
        1,
        "{log:?}"
    );
    assert_eq!(said("WARN"), 2, "{log:?}");
}

#[test]
fn the_metrics_say_of_each_number_what_is_counted_and_count_that() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let host = daemon.address(1).to_string();
    let mut client = Client::tcp(daemon.address(0));
    let line = rate("a", 0, 1.0);
    client.send(&line);
    client.send("{}");
    client.object("VERSION");
    client.object("ERROR");
    let body = rate("b", 0, 1.0);
    let json = ("Content-Type", "application/json");
    let posted = ask(
        daemon.address(1),
        "POST /samples",
        &[("Host", &host), json],
        body.as_bytes(),
    );
    assert_eq!(posted.0, 200);
    assert_eq!(
        get(daemon.address(1), "/", &[("Host", "evil.example")]).0,
        403
    );
    let (status, text) = get(daemon.address(1), "/metrics", &[("Host", &host)]);
    assert_eq!(status, 200);
    let helps: Vec<&str> = text.lines().filter(|l| l.starts_with("# HELP")).collect();
    let words: std::collections::BTreeSet<&str> = helps
        .iter()
        .map(|l| l.splitn(4, ' ').nth(3).unwrap())
        .collect();
    assert_eq!(words.len(), helps.len(), "no two say the same: {helps:?}");
    assert!(
        words
            .iter()
            .all(|help| help.ends_with('.') && help.len() > 15),
        "{words:?}"
    );
    let value = |name: &str| {
        let line = text
            .lines()
            .find(|l| l.starts_with(&format!("strapd_{name} ")));
        line.unwrap_or_else(|| unreachable!("{name}: {text}"))
            .rsplit(' ')
            .next()
            .unwrap()
            .parse::<usize>()
            .unwrap()
    };
    // The client and the address that posted; plain HTTP is none of them.
    assert_eq!(value("connections"), 2);
    assert_eq!(value("connections_accepted_total"), 4);
    assert_eq!(value("connections_refused_total"), 1);
    assert_eq!(value("lines_total"), 3);
    assert_eq!(value("bytes_in_total"), line.len() + 1 + 3 + body.len());
    assert_eq!(value("faults_total"), 1);
    assert_eq!((value("samples_total"), value("attitudes_total")), (2, 2));
}

#[test]
fn the_metrics_have_age_rate_and_sigma_of_each_sensor() {
    let mut settings = listening(&[TCP, WS]);
    settings.hub.plan = aided();
    let daemon = Daemon::start(settings);
    let mut sender = Client::tcp(daemon.address(0));
    let lines: Vec<String> = (0..300).map(line).collect();
    sender.send(&lines.join("\n"));
    eventually("all was taken", || {
        daemon.status()["sources"][0]["attitudes"] == 300
    });
    let address = daemon.address(1);
    let host = address.to_string();
    let value = |name: &str| -> f64 {
        let text = get(address, "/metrics", &[("Host", &host)]).1;
        let found = text.lines().find_map(|l| l.strip_prefix(name));
        let found = found.unwrap_or_else(|| unreachable!("{name}: {text}"));
        found.trim().parse().unwrap()
    };
    let rate = value("strapd_sensor_rate_hertz{id=\"imu0\"}");
    assert!((rate - 100.0).abs() < 1e-6, "{rate}");
    let sigma = &daemon.status()["sources"][0]["attitude"]["sigma_deg"];
    for of in ["tilt", "heading"] {
        let name = format!("strapd_sensor_sigma_degrees{{id=\"imu0\",of=\"{of}\"}}");
        assert_eq!(Some(value(&name)), sigma[of].as_f64(), "{of}");
    }
    let age = || value("strapd_sensor_age_seconds{id=\"imu0\"}");
    let before = age();
    eventually("it ages", || age() >= before + 1.0);
    // Its next sample makes it young again.
    sender.send(&line(300));
    eventually("it is young", || age() < before + 1.0);
}

/// Words and exit code of `strapd serve ARGS`, which must not start.
fn refused(args: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(strapd())
        .arg("serve")
        .args(args)
        .output()
        .unwrap();
    (
        output.status.code(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

#[test]
fn an_address_others_can_reach_needs_a_token() {
    for uri in [
        "tcp-listen://0.0.0.0:0",
        "ws-listen://0.0.0.0:0",
        "udp-listen://0.0.0.0:0",
        "tcp-listen://[::]:0",
    ] {
        let (code, said) = refused(&["--listen", uri]);
        assert_eq!(code, Some(2), "{uri}: {said}");
        assert!(said.contains("--allow-insecure-remote"), "{said}");
    }
    for (uri, guarded) in [
        ("tcp-listen://0.0.0.0:0", true),
        ("udp-listen://0.0.0.0:0", false),
    ] {
        let mut settings = listening(&[uri]);
        settings.hub.token = Some(Token::new(SECRET));
        let bound = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap()
            .block_on(strapd::serve::Server::bind(settings));
        assert_eq!(bound.is_ok(), guarded, "{uri}");
    }
}

/// Links that `strapd serve --lan ARGS` prints at an address of loopback, and the place it listens at.
fn invited(args: &[&str]) -> (Vec<String>, SocketAddr) {
    let mut command = Command::new(strapd());
    command
        .args(["serve", "--lan", "--listen", "ws-listen://127.0.0.2:0"])
        .args(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut links = Vec::new();
    for line in lines.map(Result::unwrap) {
        match line.strip_prefix("  ") {
            Some(link) => links.push(link.to_owned()),
            None if !links.is_empty() => break,
            None => {}
        }
    }
    let address = links[0].trim_start_matches("http://").split('/').next();
    let address: SocketAddr = address.unwrap().parse().unwrap();
    let token = links[0].rsplit_once("#token=").map(|(_, token)| token);
    // Nobody gets in without it.
    let host = address.to_string();
    let asked = |shown: &str| {
        let shown = format!("Bearer {shown}");
        get(
            address,
            "/metrics",
            &[("Host", &host), ("Authorization", &shown)],
        )
        .0
    };
    assert_eq!(get(address, "/metrics", &[("Host", &host)]).0, 401);
    assert_eq!(asked("0123456789abcdef0123456789abcdef"), 401);
    if let Some(token) = token {
        assert_eq!(asked(token), 200);
    }
    let _ = child.kill();
    let _ = child.wait();
    (links, address)
}

#[test]
fn a_network_is_given_a_link_with_a_token_of_the_run_or_of_a_file() {
    let tokens = [(), ()].map(|()| {
        let (links, address) = invited(&[]);
        let token = links[0]
            .strip_prefix(&format!("http://{address}/#token="))
            .unwrap();
        assert_eq!((links.len(), token.len()), (1, 32), "{links:?}");
        token.to_owned()
    });
    assert_ne!(tokens[0], tokens[1]);
    // A file that does not exist is made, and is not printed where output is kept.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("phone.token");
    let (links, address) = invited(&["--token-file", path.to_str().unwrap()]);
    assert_eq!(links, [format!("http://{address}/")]);
    let made = std::fs::read_to_string(&path).unwrap();
    assert_eq!(made.trim().len(), 32);
    assert_eq!(
        std::fs::metadata(&path).unwrap().permissions().mode() & 0o777,
        0o600
    );
    invited(&["--token-file", path.to_str().unwrap()]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), made, "it is kept");
}

#[test]
fn a_token_file_others_can_read_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("token");
    for (mode, text, complaint) in [
        (0o644, SECRET, "chmod 600"),
        (0o640, SECRET, "chmod 600"),
        (0o600, "short\n", "at least 16"),
        (0o600, "", "at least 16"),
    ] {
        std::fs::write(&path, text).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
        let (code, said) = refused(&["--token-file", path.to_str().unwrap(), "--listen", TCP]);
        assert_eq!(code, Some(2), "{mode:o}: {said}");
        assert!(said.contains(complaint), "{said}");
        assert!(text.is_empty() || !said.contains(text.trim()), "{said}");
    }
    let missing = dir.path().join("none");
    let (code, _) = refused(&["--token-file", missing.to_str().unwrap(), "--listen", TCP]);
    assert_eq!(code, Some(1));
}
