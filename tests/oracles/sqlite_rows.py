"""Makes recordings of ROS 2 in SQLite of every shape, and says what Python's own sqlite3 reads of them.

    python sqlite_rows.py FOLDER [FILE...]

Databases are written into FOLDER, one with its last pages in a file -wal beside it. For each of them, and for each FILE, a
JSON line: its name, what `PRAGMA integrity_check` says, the number of messages, and a SHA-256 over topic, time and
payload of each in the order of their rows. Exit code 0 when all could be read.

Made and last run with: Python 3.11, SQLite 3.40.
"""

import hashlib
import json
import random
import shutil
import sqlite3
import sys
from pathlib import Path

folder = Path(sys.argv[1])
TABLES = """
CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""
OTHER = """
CREATE TABLE "topics"(kind TEXT, [type] TEXT, "serialization_format" TEXT, id INTEGER PRIMARY KEY, name TEXT, CONSTRAINT one UNIQUE(name));
CREATE TABLE messages(data BLOB, "timestamp" INTEGER, more DECIMAL(10,5) DEFAULT (1), topic_id INTEGER, id INTEGER PRIMARY KEY);
"""


def make(name, seed, pragmas=(), tables=TABLES, lengths=(324,), count=700, after=()):
    path = folder / name
    rng = random.Random(seed)
    db = sqlite3.connect(path, isolation_level=None)
    for pragma in pragmas:
        db.execute("PRAGMA " + pragma)
    db.executescript(tables)
    db.execute("BEGIN")
    for topic in (1, 2, 300):
        db.execute(
            "INSERT INTO topics(id, name, type, serialization_format) VALUES(?, ?, 'sensor_msgs/msg/Imu', 'cdr')"
            if tables is OTHER
            else "INSERT INTO topics VALUES(?, ?, 'sensor_msgs/msg/Imu', 'cdr', '')",
            (topic, f"/imu_{topic}_\u00e4"),
        )
    for n in range(count):
        data = rng.randbytes(rng.choice(lengths))
        # A CDR message begins with 0, and what is packed does not.
        row = (rng.choice((1, 2, 300)), rng.choice((0, 1, n, 1_700_000_000_000_000_000 + n)), b"\0" + data[1:])
        db.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", row)
    db.execute("COMMIT")
    for statement in after:
        db.execute(statement)
    return db, path


made = []
for size in (512, 1024, 4096, 32768, 65536):
    # Rows that just fit into a page, and that just do not.
    lengths = (1, 24, 324, 4000, 90_000 if size < 4096 else 200, *range(size - 70, size - 20))
    made.append(make(f"page_{size}.db3", size, [f"page_size={size}"], lengths=lengths, count=900 if size <= 4096 else 200))
made.append(make("levels.db3", 5, ["page_size=512"], count=9000))
made.append(make("utf16le.db3", 6, ["encoding='UTF-16le'"]))
made.append(make("utf16be.db3", 7, ["encoding='UTF-16be'"]))
made.append(make("other_columns.db3", 8, tables=OTHER, lengths=(324, 9000)))
made.append(make("deleted.db3", 9, after=["DELETE FROM messages WHERE id % 3 = 0", "DELETE FROM messages WHERE id BETWEEN 100 AND 400"]))
made.append(make("vacuumed.db3", 10, ["auto_vacuum=FULL"], lengths=(324, 9000), after=["DELETE FROM messages WHERE id > 500", "VACUUM"]))
made.append(make("altered.db3", 11, after=["DROP INDEX timestamp_idx", "ALTER TABLE messages ADD COLUMN note TEXT", "UPDATE messages SET note = 'x' WHERE id % 5 = 0"]))
made.append(make("moved.db3", 12, after=["UPDATE messages SET id = id * 1000003 - 900000000"]))
made.append(make("empty.db3", 13, count=0))
for db, _ in made:
    db.close()
paths = [path for _, path in made]

# A recorder that is killed: what its file -wal had committed counts, and what it had not does not.
db, path = make("walking.db3", 14, ["journal_mode=WAL", "wal_autocheckpoint=40"])
killed = folder / "killed.db3"
shutil.copy(path, killed)
shutil.copy(f"{path}-wal", f"{killed}-wal")
db.execute("UPDATE messages SET data = zeroblob(300) WHERE id = 3")
db.close()
paths.append(killed)

for path in paths + [Path(name) for name in sys.argv[2:]]:
    # SQLite itself moves the pages of a file -wal into the database: a copy of its own.
    copy = folder / "copy.db"
    for end in ("", "-wal", "-shm"):
        Path(f"{copy}{end}").unlink(missing_ok=True)
        if Path(f"{path}{end}").exists():
            shutil.copy(f"{path}{end}", f"{copy}{end}")
    db = sqlite3.connect(copy)
    check = db.execute("PRAGMA integrity_check").fetchone()[0]
    sha, count = hashlib.sha256(), 0
    rows = "SELECT topics.name, timestamp, data FROM messages JOIN topics ON topic_id = topics.id ORDER BY messages.id"
    for topic, time, data in db.execute(rows):
        topic = topic.encode()
        for number in (len(topic), time, len(data)):
            sha.update(number.to_bytes(8, "little"))
        sha.update(topic)
        sha.update(data)
        count += 1
    db.close()
    print(json.dumps({"file": str(path), "check": check, "messages": count, "sha256": sha.hexdigest()}))
