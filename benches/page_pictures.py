#!/usr/bin/env python3
"""Takes the pictures of the pages for docs/pictures in Chromium: the replay of the README, a live sensor with the pointer
on a plot, twelve sensors, a phone, the top.

    cargo build
    pip install websockets pillow
    benches/page_pictures.py [NAME..]      STRAPD=target/debug/strapd
"""

import base64
import contextlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import urllib.request

from PIL import Image
from websockets.sync.client import connect

HERE = os.path.dirname(os.path.abspath(__file__))
STRAPD = os.path.abspath(os.environ.get("STRAPD", os.path.join(HERE, "../target/debug/strapd")))
PICTURES = os.path.join(HERE, "../docs/pictures")
RECORDING = os.path.join(HERE, "../fixtures/xsens_mti.mcap")
COLOURS = 128


class Page:
    """A page of a browser, by the DevTools protocol."""

    def __init__(self, socket):
        self.socket, self.number = socket, 0

    def call(self, method, **params):
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": params}))
        while True:
            answer = json.loads(self.socket.recv(timeout=60))
            if answer.get("id") == self.number:
                return answer["result"]

    def eval(self, script):
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        return found["result"].get("value")

    def until(self, script, seconds=60):
        end = time.monotonic() + seconds
        while not self.eval(script):
            if time.monotonic() > end:
                sys.exit(f"waited in vain: {script}")
            time.sleep(0.1)

    def go(self, url, width, height, *, dark=False, phone=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.call("Page.navigate", url=url)
        self.until("document.readyState === 'complete'")

    def keep(self, name):
        taken = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        picture = Image.open(io.BytesIO(taken)).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
        picture.save(os.path.join(PICTURES, f"{name}.png"), optimize=True)
        print(f"{name}.png  {picture.width} x {picture.height}")


@contextlib.contextmanager
def running(*arguments):
    """A command in the background, and the addresses that it is ready on."""
    child = subprocess.Popen([STRAPD, *arguments], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    try:
        line = next((line for line in child.stderr if "ready" in line), "")
        yield re.findall(r"(\w+)-listen://(\S+)", line)
    finally:
        child.terminate()
        child.wait()


@contextlib.contextmanager
def browser():
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-port=0"]
        child = subprocess.Popen(["chromium", *flags, f"--user-data-dir={profile}", "about:blank"], stderr=subprocess.PIPE, text=True)
        try:
            port = next(re.search(r"ws://([^/]+)/", line)[1] for line in child.stderr if "DevTools listening" in line)
            with urllib.request.urlopen(f"http://{port}/json") as found:
                pages = json.load(found)
            address = next(page["webSocketDebuggerUrl"] for page in pages if page["type"] == "page")
            with connect(address, max_size=None) as socket:
                yield Page(socket)
        finally:
            child.terminate()
            child.wait()


def replay(page):
    with running("replay", RECORDING, "--page=127.0.0.1:0") as [(_, address)]:
        page.go(f"http://{address}/", 1180, 1000)
        sensor = "__strapd.sensors['/imu/data']"
        page.until(f"window.__strapd?.state === 'open' && {sensor}?.plotted?.points > 100 && {sensor}.whole?.samples > 0")
        seek = "document.querySelector('[data-testid=seek]')"
        page.eval(f"{seek}.value = '12.3'; {seek}.dispatchEvent(new Event('change'))")
        page.until(f"Math.abs({sensor}.time - 12.3) < 0.1")
        page.eval("document.querySelector('[data-testid=fold][aria-expanded=true]').blur()")
        time.sleep(1)
        page.keep("page-replay")


@contextlib.contextmanager
def sensors(count):
    """A daemon, and as many bodies that move."""
    with running("serve", "--listen", "tcp-listen://127.0.0.1:0", "--listen", "ws-listen://127.0.0.1:0") as found:
        of = dict(found)
        names = ["thigh_left", "thigh_right", "shank_left", "shank_right", "foot_left", "foot_right"]
        names += ["pelvis", "chest", "upper_arm", "forearm", "wrist", "head"]
        with contextlib.ExitStack() as all_of_them:
            for seed, name in enumerate(names[-count:] if count < len(names) else names):
                moved = ["simulate", "hand", "--seed", str(seed), "--noise", "consumer_imu", "--rate-hz", "100", "--speed", "1", "--duration", "600"]
                child = subprocess.Popen([STRAPD, *moved, "-o", f"tcp://{of['tcp']}?id={name}", "-q"])
                all_of_them.callback(child.wait)
                all_of_them.callback(child.terminate)
            yield of["ws"]


def live(page):
    with sensors(1) as address:
        page.go(f"http://{address}/", 1180, 1000)
        page.until("__strapd.sensors?.head?.plotted?.points > 100")
        time.sleep(12)
        at = page.eval("(({left, top, width}) => [left + 0.6 * width, top + 60])(document.querySelector('[data-testid=plot-attitude]').getBoundingClientRect())")
        page.call("Input.dispatchMouseEvent", type="mouseMoved", x=at[0], y=at[1])
        time.sleep(0.5)
        page.keep("page-live")


def phone(page):
    with sensors(1) as address:
        page.go(f"http://{address}/", 390, 900, dark=True, phone=True)
        page.until("__strapd.sensors?.head?.plotted?.points > 100")
        time.sleep(12)
        page.keep("page-phone")


def fleet(page):
    with sensors(12) as address:
        page.go(f"http://{address}/", 1180, 900)
        page.until("Object.keys(__strapd.sensors ?? {}).length >= 8")
        time.sleep(12)
        page.keep("page-fleet")


def top(page):
    with running("serve", "--listen", "ws-listen://127.0.0.1:0") as [(_, address)]:
        page.go(f"http://{address}/top", 1240, 1000)
        time.sleep(8)
        page.keep("page-top")


def main():
    scenes = {"replay": replay, "live": live, "phone": phone, "fleet": fleet, "top": top}
    with browser() as page:
        page.call("Page.enable")
        for name in sys.argv[1:] or scenes:
            scenes[name](page)


main()
