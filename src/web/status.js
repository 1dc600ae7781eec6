// STATUS -> the line about the daemon, and what each source tells.

import { plain, say, whole } from "./numbers.js";
import { isReference, taken } from "./sensor.js";

let [last, lastAt] = [null, 0];

const sum = (list, field) => list.reduce((total, each) => total + (each[field] ?? 0), 0);

// Samples of all sensors so far: what they are held against is none.
export const samplesOf = (sources) => sources.reduce((total, each) => total + (isReference(each.id) ? 0 : taken(each)), 0);

// Seconds after which samples that were not used are no news.
const NEWS = 60;

// Streams of which nothing is used, the last first.
function refused(part, all) {
  const now = all.filter((loss) => loss.last_s_ago < NEWS);
  part.hidden = now.length === 0;
  const [last] = now;
  if (!last) return;
  const place = last.line ? `, first at line ${last.line}, column ${last.column}` : "";
  const more = now.length > 1 ? ` (and ${whole(now.length - 1)} more in STATUS)` : "";
  say(part, `${plain(last.source)}: ${whole(last.count)} samples not used${place}: ${plain(last.message)}${more}`);
}

// each(source, before, seconds): one source, and what it told that many seconds ago. null: nothing is known any more.
export function told(parts, now, each) {
  const [before, at] = [last, performance.now()];
  const elapsed = (at - lastAt) / 1000;
  [last, lastAt] = [now, at];
  refused(parts.refused, now?.refused ?? []);
  if (!now) {
    for (const name of ["total", "clients", "dropped", "queued", "uptime"]) say(parts[name], "–");
    return;
  }
  const { sources = [], clients = [] } = now;
  const rate = before ? Math.max(0, samplesOf(sources) - samplesOf(before.sources ?? [])) / elapsed : NaN;
  say(parts.total, Number.isFinite(rate) ? `${whole(Math.round(rate))} Hz` : "–");
  say(parts.clients, whole(clients.length));
  const dropped = sum(clients, "dropped");
  say(parts.dropped, whole(dropped));
  parts.dropped.closest("div").classList.toggle("bad", dropped > 0);
  const queued = sum(clients, "queued_bytes") / 1024;
  say(parts.queued, `${queued < 10 ? queued.toFixed(1) : queued.toFixed(0)} KiB`);
  say(parts.uptime, now.uptime_s < 120 ? `${now.uptime_s.toFixed(0)} s` : `${whole(Math.floor(now.uptime_s / 60))} min`);
  say(parts.recording, now.recording?.stopped ? "recording stopped" : now.recording ? "recording" : "");
  const earlier = new Map((before?.sources ?? []).map((source) => [source.id, source]));
  for (const source of sources) each(source, earlier.get(source.id), elapsed);
}
