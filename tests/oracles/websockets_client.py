"""Another implementation's WebSocket against the daemon's: sends a turn of 90 degrees about z, watches it come back.

Needs websockets (benches/peers/requirements.txt). Usage: websockets_client.py ws://HOST:PORT/ws
"""

import json
import math
import sys

from websockets.sync.client import connect

with connect(sys.argv[1]) as link:
    assert json.loads(link.recv())["class"] == "VERSION"
    link.send(json.dumps({"class": "WATCH", "id": "peer"}))
    assert json.loads(link.recv())["class"] == "WATCH"
    count = 0
    for n in range(1001):
        stamp = {"sec": 1700000000 + n // 1000, "nsec": n % 1000 * 1000000}
        sample = json.dumps({"class": "RATE", "id": "peer", "stamp": stamp, "gyro": [0, 0, math.pi / 2]})
        # Text, binary and fragmented messages are all the same to it.
        link.send([sample.encode(), sample, [sample[:20], sample[20:]]][n % 3])
        att = json.loads(link.recv(timeout=60))
        assert (att["class"], att["id"], att["seq"]) == ("ATT", "peer", n), att
        count += 1
    pong = link.ping()
    assert pong.wait(60)
    link.send("x" * 70000)
    assert json.loads(link.recv(timeout=60))["code"] == "line_too_long"
    q = att["q"]
    yaw = math.degrees(2 * math.atan2(q["z"], q["w"]))
print("yaw %.6f deg after %d attitudes" % (yaw, count))
