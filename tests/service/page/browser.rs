//! Chromium by the DevTools protocol: JSON over a WebSocket, of which a dozen methods are needed here.
//!
//! The crates that wrap all of the protocol bring two hundred others and a megabyte of generated
//! code; this brings none.

use crate::serve::daemon::PATIENCE;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Browsers at a time: each waits for half of its time, and more share two cores badly.
const AT_ONCE: usize = 2;
static RUNNING: Mutex<usize> = Mutex::new(0);
static ENDED: Condvar = Condvar::new();

/// Right to run a browser, as so many.
struct Turn(usize);

impl Turn {
    fn wait(browsers: usize) -> Turn {
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        while *running + browsers > AT_ONCE {
            running = ENDED.wait(running).unwrap_or_else(PoisonError::into_inner);
        }
        *running += browsers;
        Turn(browsers)
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) -= self.0;
        ENDED.notify_all();
    }
}

/// A browser with one page.
pub(crate) struct Browser {
    child: Child,
    socket: WebSocket<TcpStream>,
    session: Option<String>,
    next: u64,
    /// Events of the page, as the browser told: `method` and `params`.
    pub(crate) events: Vec<Value>,
    _profile: tempfile::TempDir,
    _turn: Turn,
}

/// The programme. A test that needs it is marked `#[cfg_attr(not(has_chromium), ignore = "needs
/// chromium")]` (`build.rs`).
fn programme() -> String {
    let named = std::env::var("STRAPD_CHROMIUM").ok();
    let known = ["chromium", "chromium-browser", "google-chrome"].map(str::to_owned);
    let found = named.into_iter().chain(known).find(|name| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|v| v.status.success())
    });
    found.expect("no Chromium (apt-get install chromium, or STRAPD_CHROMIUM=PATH)")
}

impl Browser {
    /// Starts one with an empty page of 1280 x 1000 pixels. Without Chromium it fails.
    pub(crate) fn start() -> Browser {
        Browser::with(Turn::wait(1))
    }

    /// The same while no other runs: for what is measured in frames or seconds.
    pub(crate) fn start_alone() -> Browser {
        Browser::with(Turn::wait(AT_ONCE))
    }

    fn with(turn: Turn) -> Browser {
        let programme = programme();
        // One in thousands says nothing, and would be waited for without end.
        let mut begun = (0..3).filter_map(|_| Browser::begun(&programme));
        let (child, profile, address) = begun.next().expect("Chromium did not start");
        let host = address
            .trim_start_matches("ws://")
            .split('/')
            .next()
            .unwrap();
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client(&address, stream).unwrap();
        let mut browser = Browser {
            child,
            socket,
            session: None,
            next: 0,
            events: Vec::new(),
            _profile: profile,
            _turn: turn,
        };
        browser.page();
        browser
    }

    /// A programme that said in time at which address it listens.
    fn begun(programme: &str) -> Option<(Child, tempfile::TempDir, String)> {
        let profile = tempfile::tempdir().unwrap();
        let mut child = Command::new(programme)
            .args(["--headless", "--no-sandbox", "--disable-gpu"])
            .args(["--no-first-run", "--disable-extensions", "--disable-sync"])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
            ])
            .args(["--disable-dev-shm-usage", "--hide-scrollbars"])
            .arg("--remote-debugging-port=0")
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stderr.take().unwrap()).lines();
        let (tell, told) = std::sync::mpsc::channel();
        // It goes on talking, and must not wait for a reader.
        std::thread::spawn(move || {
            for line in said.map_while(Result::ok) {
                if let Some(address) = line.strip_prefix("DevTools listening on ") {
                    let _ = tell.send(address.to_owned());
                }
            }
        });
        let Ok(address) = told.recv_timeout(PATIENCE) else {
            let _ = child.kill();
            let _ = child.wait();
            return None;
        };
        Some((child, profile, address))
    }

    /// A new page, from now on the one spoken to.
    pub(crate) fn page(&mut self) {
        self.session = None;
        self.events.clear();
        let made = self.call("Target.createTarget", json!({"url": "about:blank"}));
        let attached = self.call(
            "Target.attachToTarget",
            json!({"targetId": made["targetId"], "flatten": true}),
        );
        self.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Network", "Log"] {
            self.call(&format!("{domain}.enable"), json!({}));
        }
        self.call(
            "Page.addScriptToEvaluateOnNewDocument",
            json!({"source": "window.__violations = []; addEventListener('securitypolicyviolation', (e) => __violations.push(e.violatedDirective + ' ' + e.blockedURI));"}),
        );
        self.size(1280, 1000);
    }

    /// The page's size in pixels.
    pub(crate) fn size(&mut self, width: u32, height: u32) {
        self.call(
            "Emulation.setDeviceMetricsOverride",
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false}),
        );
    }

    /// Calls a method; events that come before its answer are kept.
    pub(crate) fn call(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let mut request = json!({"id": self.next, "method": method, "params": params});
        if let Some(session) = &self.session {
            request["sessionId"] = json!(session);
        }
        self.socket
            .send(Message::text(request.to_string()))
            .unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else {
                continue;
            };
            let mut answer: Value = serde_json::from_str(text.as_str()).unwrap();
            if answer["id"] == self.next {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].take();
            }
            if !answer["method"].is_null() {
                self.events.push(answer);
            }
        }
    }

    pub(crate) fn go(&mut self, address: SocketAddr, path: &str) {
        let url = format!("http://{address}{path}");
        let gone = self.call("Page.navigate", json!({"url": url}));
        assert!(gone["errorText"].is_null(), "{url}: {gone}");
        self.until("the page is loaded", "document.readyState === 'complete'");
    }

    /// The value of an expression, promises awaited.
    pub(crate) fn eval(&mut self, expression: &str) -> Value {
        let mut answer = self.call(
            "Runtime.evaluate",
            json!({"expression": expression, "returnByValue": true, "awaitPromise": true}),
        );
        let thrown = &answer["exceptionDetails"];
        assert!(thrown.is_null(), "{expression}: {thrown}");
        answer["result"]["value"].take()
    }

    pub(crate) fn number(&mut self, expression: &str) -> f64 {
        let value = self.eval(expression);
        value
            .as_f64()
            .unwrap_or_else(|| unreachable!("{expression} is {value}"))
    }

    /// Waits until an expression holds.
    pub(crate) fn until(&mut self, what: &str, expression: &str) {
        let start = Instant::now();
        // While a page is being replaced there is nothing to ask.
        let guarded = format!(
            "(() => {{ try {{ return Boolean({expression}); }} catch {{ return false; }} }})()"
        );
        while self.eval(&guarded) != true {
            assert!(
                start.elapsed() < PATIENCE,
                "waited in vain: {what}: {expression}; the page says: {}; thrown: {:?}",
                self.eval("document.body.innerText.slice(0, 600)"),
                self.thrown()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits for the connection.
    pub(crate) fn until_open(&mut self) {
        self.until("connected", "__strapd.state === 'open'");
    }

    /// The middle of an element, in pixels of the window, and its width; scrolled to.
    pub(crate) fn place(&mut self, selector: &str) -> [f64; 3] {
        let found = self.eval(&format!(
            "(() => {{ const e = document.querySelector(`{selector}`); e.scrollIntoView({{ block: 'center' }}); const r = e.getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2, r.width]; }})()"
        ));
        [0, 1, 2].map(|n| found[n].as_f64().unwrap())
    }

    /// Moves the mouse: `mouseMoved`, `mousePressed`, `mouseReleased`, `mouseWheel`.
    pub(crate) fn mouse(&mut self, kind: &str, at: [f64; 2], more: Value) {
        let mut event = json!({"type": kind, "x": at[0], "y": at[1], "pointerType": "mouse"});
        if let (Some(event), Some(more)) = (event.as_object_mut(), more.as_object()) {
            event.extend(more.clone());
        }
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Moves fingers: `touchStart`, `touchMove`, `touchEnd`; where those are that are on the screen.
    pub(crate) fn fingers(&mut self, kind: &str, at: &[[f64; 2]]) {
        let points: Vec<Value> = at
            .iter()
            .enumerate()
            .map(|(id, [x, y])| json!({"id": id, "x": x, "y": y}))
            .collect();
        let event = json!({"type": kind, "touchPoints": points});
        self.call("Input.dispatchTouchEvent", event);
    }

    /// A key, pressed where the focus is.
    pub(crate) fn press(&mut self, key: &str) {
        let mut down = json!({"type": "keyDown", "key": key, "code": key});
        if key.len() == 1 {
            down["text"] = json!(key);
        }
        self.call("Input.dispatchKeyEvent", down);
        self.call(
            "Input.dispatchKeyEvent",
            json!({"type": "keyUp", "key": key, "code": key}),
        );
    }

    /// A picture, as base64 of a PNG.
    pub(crate) fn screenshot(&mut self) -> String {
        let taken = self.call("Page.captureScreenshot", json!({"format": "png"}));
        taken["data"].as_str().unwrap().to_owned()
    }

    /// The whole value behind a number on the page.
    pub(crate) fn shown(&mut self, testid: &str) -> f64 {
        let value = self.eval(&format!(
            "document.querySelector('[data-testid={testid}]').value"
        ));
        let text = value.as_str().unwrap();
        text.parse()
            .unwrap_or_else(|_| unreachable!("{testid} shows {text:?}"))
    }

    pub(crate) fn text(&mut self, testid: &str) -> String {
        let value = self.eval(&format!(
            "document.querySelector('[data-testid={testid}]').textContent"
        ));
        value.as_str().unwrap().to_owned()
    }

    /// Everything that was asked of the network.
    pub(crate) fn requests(&self) -> Vec<String> {
        let of = |event: &Value| match event["method"].as_str()? {
            "Network.requestWillBeSent" => event["params"]["request"]["url"]
                .as_str()
                .map(str::to_owned),
            "Network.webSocketCreated" => event["params"]["url"].as_str().map(str::to_owned),
            _ => None,
        };
        self.events.iter().filter_map(of).collect()
    }

    /// Asserts that no script threw, and nothing was refused by the policy.
    pub(crate) fn is_unharmed(&mut self) {
        assert_eq!(self.eval("window.__violations"), json!([]));
        assert_eq!(self.thrown(), [&Value::Null; 0]);
    }

    /// Exceptions of the page, and what its rules refused.
    fn thrown(&self) -> Vec<&Value> {
        let is_harm = |event: &&Value| {
            let source = &event["params"]["entry"]["source"];
            event["method"] == "Runtime.exceptionThrown"
                || source == "security"
                || source == "javascript"
        };
        self.events.iter().filter(is_harm).collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The socket may be gone, and so may the browser.
        self.session = None;
        let close = json!({"id": 0, "method": "Browser.close"});
        let _ = self.socket.send(Message::text(close.to_string()));
        for _ in 0..100 {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
