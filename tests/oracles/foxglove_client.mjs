// Foxglove's own client against our WebSocket: what it is told and what it receives, one JSON object a line.
//
//   NODE_PATH=.../node_modules node foxglove_client.mjs ws://127.0.0.1:PORT COUNT
//
// Subscribes to every channel; when they are subscribed to, a plain client asks to play. Ends after COUNT
// messages of sensor_msgs/msg/Imu, or when the server closes.
import { createRequire } from "node:module";

const require = createRequire(process.env.NODE_PATH + "/");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { parse } = require("@foxglove/rosmsg");
const WebSocket = require("ws");

const [url, wanted] = [process.argv[2], Number(process.argv[3])];
const say = (object) =>
  console.log(JSON.stringify(object, (_, v) => (typeof v === "bigint" ? String(v) : ArrayBuffer.isView(v) ? [...v] : v)));

const socket = new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const client = new FoxgloveClient({ ws: socket });
const readers = new Map();
let [received, times] = [0, 0];

client.on("error", (error) => {
  console.error(String(error));
  process.exit(1);
});
client.on("serverInfo", (info) => say({ op: "serverInfo", protocol: socket.protocol, ...info }));
client.on("status", (status) => say(status));
client.on("time", () => times++);
client.on("advertise", (channels) => {
  for (const channel of channels) {
    const definition = parse(channel.schema, { ros2: true });
    readers.set(client.subscribe(channel.id), { channel, reader: new MessageReader(definition) });
  }
  say({ op: "advertised", channels: channels.map(({ id, topic, encoding, schemaName, schemaEncoding }) => ({ id, topic, encoding, schemaName, schemaEncoding })) });
  // Not a request there is: answered, not closed.
  client.getParameters(["x"], "1");
  if (channels.some((channel) => channel.id !== 1)) {
    const plain = new WebSocket(url);
    plain.on("open", () => plain.send('{"class":"PLAYBACK","action":"play"}'));
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { channel, reader } = readers.get(subscriptionId);
  say({ topic: channel.topic, timestamp, message: reader.readMessage(data) });
  if (channel.schemaName === "sensor_msgs/msg/Imu" && ++received === wanted) finish();
});
client.on("close", () => finish());

function finish() {
  say({ op: "done", received, times });
  process.exit(0);
}
