// What the daemon is asked for: attitudes of what is drawn, and beside it a few of all others, for the table.

import { Link } from "./link.js";

// Attitudes a second asked for in all, shared among the sensors drawn: every sample of one at
// 1 kHz, and of an 8 kHz one every eighth.
const BUDGET = 1000;
// Asked for while nobody looks, and of the sensors that are in the table alone.
const FEW_HZ = 2;

const watching = (rate_hz, ids) => ({ class: "WATCH", enable: true, streams: ["ATT"], rate_hz, ids });

export class Asking {
  // page: cards; only, the ids of the address; rate, its attitudes a second; heardBeside(att) of those not drawn.
  constructor(page) {
    this.page = page;
    this.asked = "";
    this.beside = null;
  }

  // A new connection has been asked for nothing yet.
  forget() {
    this.asked = "";
  }

  watch(link) {
    if (!link?.isOpen) return;
    const { cards, only, rate } = this.page;
    const share = Math.max(50, Math.floor(BUDGET / Math.max(1, cards.size)));
    const ids = only ?? (cards.left.size ? [...cards.keys()] : undefined);
    const request = watching(document.hidden ? FEW_HZ : rate > 0 ? rate : share, ids);
    const text = JSON.stringify(request);
    if (text !== this.asked) link.send(request);
    this.asked = text;
    if (cards.left.size) this.beside ??= new Link((message) => this.heard(message), () => {});
  }

  heard(message) {
    const { cards, heardBeside } = this.page;
    if (message.class === "VERSION") this.beside.send(watching(FEW_HZ));
    if (message.class !== "ATT" || cards.has(message.id)) return;
    cards.left.add(message.id);
    heardBeside(message);
  }
}
