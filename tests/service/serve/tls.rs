//! Promise: `packaging/nginx.conf` puts TLS in front of the daemon: page, HTTP and WebSocket under one name, the token
//! asked for as without it, and a page of another origin refused.

use super::daemon::{Daemon, WS, listening};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use strapd::serve::guard::admission::Token;

const SECRET: &str = "correct horse battery staple";

/// Speaks by `websockets` and `ssl` alone.
const CLIENT: &str = r#"
import json, socket, ssl, sys
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
port, certificate, secret = int(sys.argv[1]), sys.argv[2], sys.argv[3]
known = ssl.create_default_context(cafile=certificate)
name = f"robot.example:{port}"

def link(origin):
    way = socket.create_connection(("127.0.0.1", port))
    return connect(f"wss://{name}/ws", sock=way, ssl=known, server_hostname="robot.example", origin=origin)

def ask(path, bearer=None):
    way = known.wrap_socket(socket.create_connection(("127.0.0.1", port)), server_hostname="robot.example")
    head = f"GET {path} HTTP/1.1\r\nHost: {name}\r\nConnection: close\r\n"
    head += f"Authorization: Bearer {bearer}\r\n" if bearer else ""
    way.sendall((head + "\r\n").encode())
    answer = b""
    while more := way.recv(65536):
        answer += more
    return int(answer.split()[1])

with link(f"https://{name}") as mine:
    assert json.loads(mine.recv())["class"] == "VERSION"
    mine.send(json.dumps({"class": "AUTH", "token": secret}))
    mine.send(json.dumps({"class": "WATCH"}))
    assert json.loads(mine.recv(timeout=30))["class"] == "WATCH"
    sample = {"class": "RATE", "id": "a", "stamp": {"sec": 1700000000, "nsec": 0}, "gyro": [0, 0, 1]}
    mine.send(json.dumps(sample))
    assert json.loads(mine.recv(timeout=30))["class"] == "ATT"
try:
    link("https://evil.example")
    raise SystemExit("another origin got a socket")
except InvalidStatus as refused:
    assert refused.response.status_code == 403
print(ask("/"), ask("/metrics"), ask("/metrics", secret))
"#;

/// A process that ends with the test.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // Its workers end with their master, which a signal asks to.
        let pid = self.0.id().to_string();
        let _ = Command::new("kill").args(["-TERM", &pid]).status();
        let _ = self.0.wait();
    }
}

fn certificate(at: &Path) {
    let made = Command::new("openssl")
        .current_dir(at)
        .args("req -x509 -newkey rsa:2048 -nodes -keyout key.pem -out cert.pem -days 2".split(' '))
        .args("-subj /CN=robot.example -addext subjectAltName=DNS:robot.example".split(' '))
        .output()
        .unwrap();
    assert!(made.status.success(), "{made:?}");
}

/// Starts nginx with our configuration, its ports and paths those of this test.
fn nginx(at: &Path, port: u16, daemon: &str) -> Ended {
    let ours = Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging/nginx.conf");
    let ours = std::fs::read_to_string(ours).unwrap();
    let here = at.display().to_string();
    let mut text = ours;
    for (stated, made) in [
        ("listen 443 ssl", format!("listen 127.0.0.1:{port} ssl")),
        ("/etc/strapd/tls", here.clone()),
        ("http://127.0.0.1:8765;", format!("http://{daemon};")),
    ] {
        assert!(text.contains(stated), "{stated}");
        text = text.replace(stated, &made);
    }
    std::fs::write(at.join("strapd.conf"), text).unwrap();
    let folders = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"];
    let folders = folders
        .map(|of| format!("{of}_temp_path {here}/{of};"))
        .concat();
    let whole = format!(
        "pid {here}/nginx.pid; error_log {here}/error.log; daemon off; worker_processes 1;\nevents {{}}\nhttp {{ access_log off; {folders} include {here}/strapd.conf; }}\n"
    );
    std::fs::write(at.join("nginx.conf"), whole).unwrap();
    let started = Command::new("nginx")
        .args(["-p", &here, "-c", &format!("{here}/nginx.conf")])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    Ended(started)
}

#[test]
#[cfg_attr(
    not(all(has_nginx, has_oracles)),
    ignore = "without nginx, openssl and STRAPD_ORACLES_PYTHON"
)]
fn nginx_in_front_speaks_tls_for_the_daemon() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    certificate(at);
    let mut settings = listening(&[WS]);
    settings.hub.token = Some(Token::new(SECRET));
    settings.web.hosts = vec!["robot.example".to_owned()];
    let daemon = Daemon::start(settings);
    let port = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port();
    let _nginx = nginx(at, port, &daemon.address(0).to_string());
    let begun = std::time::Instant::now();
    while std::net::TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(begun.elapsed().as_secs() < 60, "nginx does not listen");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let output = Command::new(python)
        .args(["-c", CLIENT, &port.to_string()])
        .arg(at.join("cert.pem"))
        .arg(SECRET)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "200 401 200\n");
}
