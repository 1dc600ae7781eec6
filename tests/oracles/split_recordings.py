"""A recording of ROS in two files, as a recorder that begins a new one writes them.

    python split_recordings.py RECORDING.bag|.db3 FIRST SECOND

A bag is read and written by rosbags, its connections the other way round in the second file; a database is copied, and cut by
SQLite, which then has the pages of another file altogether. Half of the messages are in each.

Made and last run with: Python 3.13, rosbags 0.11.9.
"""

import shutil
import sqlite3
import sys
from pathlib import Path


def bag(log, parts):
    from rosbags.rosbag1 import Reader, Writer

    with Reader(log) as reader:
        messages = list(reader.messages())
        half = len(messages) // 2
        for n, share in enumerate([messages[:half], messages[half:]]):
            with Writer(parts[n]) as writer:
                connections = reader.connections[::-1] if n else reader.connections
                to = {
                    c.id: writer.add_connection(c.topic, c.msgtype, msgdef=c.msgdef.data, md5sum=c.digest)
                    for c in connections
                }
                for connection, stamp, data in share:
                    writer.write(to[connection.id], stamp, data)
    return len(messages)


def database(log, parts):
    count = 0
    for n, path in enumerate(parts):
        shutil.copy(log, path)
        with sqlite3.connect(path) as rows:
            (count,) = rows.execute("select count(*) from messages").fetchone()
            # In the order of their numbers, as they were recorded.
            half = f"(select id from messages order by id limit {count // 2})"
            rows.execute(f"delete from messages where id {'in' if n else 'not in'} {half}")
        rows.execute("vacuum")
        rows.close()
    return count


def main(log, *parts):
    split = bag if log.endswith(".bag") else database
    print(f"{split(log, [Path(part) for part in parts])} messages")


main(*sys.argv[1:])
