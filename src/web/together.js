// The attitudes of all sensors shown, in one view.

import { Camera, Scene, steer, upright, worldNames } from "./body3d.js";
import { plain } from "./numbers.js";
import { rotate } from "./quaternion.js";
import { Surface } from "./surface.js";

// Lines that can be told apart; colours say which axis.
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3]];
// Longest name beside an axis.
const LONGEST = 18;

export class Together {
  constructor(canvas, moved) {
    this.canvas = canvas;
    this.camera = new Camera();
    this.moved = moved;
    this.surface = new Surface(canvas, moved);
    steer(canvas, this.camera, moved);
  }

  // Each where the cursor is, else its newest.
  draw(cards, view, colours) {
    if (!(this.surface.width > 0)) return;
    const scene = new Scene(this.surface, this.camera, colours);
    const some = cards.filter(({ sensor }) => sensor.last || sensor.whole);
    const worlds = [...new Set(some.map(({ sensor }) => sensor.world))];
    scene.world(worlds.length === 1 ? worldNames(worlds[0]) : []);
    const drawn = [];
    some.forEach(({ id, sensor, shown }, n) => {
      const cursor = view.cursor(sensor.clock);
      const { history } = sensor;
      const now = () => (Number.isFinite(cursor) ? history.attitudeAt(Math.min(cursor, history.newestTime)) : sensor.last?.q);
      const q = shown?.q ?? now();
      if (!q) return;
      const up = upright(sensor.world);
      const letters = [...plain(id)];
      const name = letters.length > LONGEST ? `${letters.slice(0, LONGEST / 2 - 1).join("")}…${letters.slice(-LONGEST / 2).join("")}` : letters.join("");
      scene.triad((v) => up(rotate(q, v)), { width: 2, dash: DASHES[n % DASHES.length], name });
      drawn.push(plain(id));
    });
    scene.label([]);
    this.drawn = drawn;
    this.canvas.setAttribute("aria-label", `Body axes of ${drawn.length} sensors: ${drawn.join(", ")}`);
  }
}
