// The WebSocket to the daemon: kept up, and said so when it is not. docs/protocol.md is its language.

// Takes the token out of a link of `strapd serve --lan`: behind # no browser sends it, and here nobody reads it over a
// shoulder or finds it in the history. Undefined where there is none.
export function invited() {
  const [, given] = /[#&]token=([^&]*)/.exec(location.hash) ?? [];
  if (!given) return undefined;
  history.replaceState(history.state, "", location.pathname + location.search);
  try {
    return decodeURIComponent(given);
  } catch {
    return given;
  }
}

const WAITS = [200, 400, 800, 1500];
// STATUS is asked for every second: this long without a word, and nobody is there.
const SILENCE = 6000;
const PATIENCE = 4000;

export class Link {
  // heard(message) for each object; changed(state, words) with connecting, open, closed, token.
  constructor(heard, changed) {
    this.heard = heard;
    this.changed = changed;
    this.failures = 0;
    const token = invited();
    if (token) sessionStorage.setItem("token", token);
    this.token = sessionStorage.getItem("token");
    this.watchdog = setInterval(() => this.check(), 1000);
    this.connect();
  }

  connect() {
    clearTimeout(this.again);
    this.changed("connecting", this.failures ? "connection lost, connecting again" : "connecting");
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/ws`);
    this.socket = socket;
    this.since = performance.now();
    this.last = 0;
    socket.onopen = () => {
      if (this.token) this.send({ class: "AUTH", token: this.token });
    };
    socket.onmessage = (event) => {
      this.last = performance.now();
      let message;
      try {
        message = JSON.parse(event.data);
      } catch {
        return;
      }
      if (message.class === "VERSION") this.failures = 0;
      // Greeted is not yet watching: from here on nothing is lost.
      if (message.class === "WATCH" && message.enable) this.changed("open", "connected");
      if (message.class === "ERROR" && /^(unauthorised|bad_auth)$/.test(message.code)) {
        if (this.refused) return;
        this.refused = true;
        this.changed("token", this.token ? "this is not the token of the daemon" : "a token is needed");
        this.token = null;
        sessionStorage.removeItem("token");
        return;
      }
      this.heard(message);
    };
    socket.onclose = () => this.lost(socket);
  }

  lost(socket) {
    if (socket !== this.socket) return;
    this.socket = null;
    if (this.refused) return;
    const wait = WAITS[Math.min(this.failures, WAITS.length - 1)];
    this.failures++;
    this.changed("closed", "connection lost, connecting again");
    this.again = setTimeout(() => this.connect(), wait);
  }

  check() {
    const socket = this.socket;
    if (!socket) return;
    const now = performance.now();
    const late =
      socket.readyState === WebSocket.OPEN
        ? now - Math.max(this.last, this.since) > SILENCE
        : now - this.since > PATIENCE;
    if (late) {
      socket.close();
      // A dead peer answers no close.
      this.lost(socket);
    }
  }

  authorise(token) {
    this.token = token;
    sessionStorage.setItem("token", token);
    this.refused = false;
    this.socket?.close();
    this.socket = null;
    this.connect();
  }

  get isOpen() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  close() {
    clearInterval(this.watchdog);
    clearTimeout(this.again);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }
}
