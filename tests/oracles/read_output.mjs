// Reads an MCAP written by strapd as Foxglove and Lichtblick do, and compares it with the NDJSON of the same run.
//
//     npm install @mcap/core @mcap/support @mcap/nodejs @foxglove/rosmsg @foxglove/rosmsg2-serialization
//     node .../read_output.mjs out.mcap out.ndjson          (from the directory of that install; run by hand)
//
// The indexed reader finds every message through chunk and message indexes, in the order of log time; schemas are
// parsed from the file's own text. Quaternions must be the same bits.
//
// Made and last run with: @mcap/core 2.2.2, @mcap/support 1.1.0, @mcap/nodejs 1.0.2, @foxglove/rosmsg 5.0.5,
// @foxglove/rosmsg2-serialization 3.1.0.
import { createRequire } from "node:module";
import { open, readFile } from "node:fs/promises";
import { join } from "node:path";
import process from "node:process";

const require = createRequire(join(process.cwd(), "x.js"));
const { McapIndexedReader } = require("@mcap/core");
const { FileHandleReadable } = require("@mcap/nodejs");
const { loadDecompressHandlers } = require("@mcap/support");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

function fail(text) {
  console.error(text);
  process.exit(1);
}

const [mcapPath, ndjsonPath] = process.argv.slice(2);
const lines = (await readFile(ndjsonPath, "utf8")).trim().split("\n").map((line) => JSON.parse(line));
const same = (a, b) => a.sec === b.sec && a.nsec === b.nsec;
const transforms = lines.filter((line, n) => n === 0 || !same(line.stamp, lines[n - 1].stamp));
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(await open(mcapPath)),
  decompressHandlers: await loadDecompressHandlers(),
});

const decoders = new Map();
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  const text = new TextDecoder().decode(schema.data);
  if (channel.messageEncoding === "json") {
    JSON.parse(text);
    decoders.set(channel.id, (data) => JSON.parse(new TextDecoder().decode(data)));
  } else {
    const cdr = new MessageReader(parse(text, { ros2: true }));
    decoders.set(channel.id, (data) => cdr.readMessage(data));
  }
}

const counts = { attitude: 0, transform: 0 };
for await (const message of reader.readMessages()) {
  const topic = reader.channelsById.get(message.channelId).topic;
  const m = decoders.get(message.channelId)(message.data);
  let line, stamp, q;
  if (topic === "/tf") {
    line = transforms[counts.transform++];
    const t = m.transforms?.[0];
    stamp = m.timestamp ?? { sec: t.header.stamp.sec, nsec: t.header.stamp.nanosec };
    q = m.rotation ?? t.transform.rotation;
  } else {
    line = lines[counts.attitude++];
    stamp = m.stamp ?? { sec: m.header.stamp.sec, nsec: m.header.stamp.nanosec };
    q = m.q ?? m.orientation;
  }
  if (!same(stamp, line.stamp)) fail(`${topic} seq ${line.seq}: stamp ${JSON.stringify(stamp)}`);
  for (const axis of ["w", "x", "y", "z"]) {
    if (!Object.is(q[axis], line.q[axis])) fail(`${topic} seq ${line.seq}: ${axis} ${q[axis]} is not ${line.q[axis]}`);
  }
}
if (counts.attitude !== lines.length || counts.transform !== transforms.length) fail(JSON.stringify(counts));
if (reader.statistics.messageCount !== BigInt(lines.length + transforms.length)) fail("statistics");
console.log(`${counts.attitude} attitudes, ${counts.transform} transforms: the same bits`);
