"""Reads MCAP files with the `mcap` package, in file order and through their index, and says what is in them.

    python read_recovered.py a.mcap b.mcap ...

One JSON line per file: the number of messages, a SHA-256 over topic, both times, sequence number and payload of every
message in file order, the number read through the index, and the attachments and metadata records.
Checksums are checked. Exit code 0 when every file could be read to its end both ways.

Made and last run with: Python 3.13, mcap 1.6.0.
"""

import hashlib
import json
import sys

from mcap.reader import NonSeekingReader, SeekingReader


def digest(messages):
    sha, count = hashlib.sha256(), 0
    for _, channel, message in messages:
        topic = channel.topic.encode()
        for number in (len(topic), message.log_time, message.publish_time, message.sequence, len(message.data)):
            sha.update(number.to_bytes(8, "little"))
        sha.update(topic)
        sha.update(message.data)
        count += 1
    return count, sha.hexdigest()


for path in sys.argv[1:]:
    with open(path, "rb") as file:
        count, sha = digest(NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False))
    with open(path, "rb") as file:
        reader = SeekingReader(file, validate_crcs=True)
        indexed, _ = digest(reader.iter_messages())
        summary = reader.get_summary()
        attachments = [[a.name, a.media_type, len(a.data)] for a in reader.iter_attachments()]
        metadata = [[m.name, m.metadata] for m in reader.iter_metadata()]
    print(
        json.dumps(
            {
                "messages": count,
                "sha256": sha,
                "indexed": indexed,
                "counted": summary.statistics.message_count,
                "attachments": attachments,
                "metadata": metadata,
            }
        )
    )
