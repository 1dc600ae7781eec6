// Canvases: sharp on every screen, and in the colours of the style sheet.

const NAMES = [
  "surface", "text", "muted", "line", "grid", "x", "y", "z", "other", "rate", "box", "tip",
  "sky", "ground", "error", "method", "momentum",
];

// The colours as they are now, by name.
export function palette() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

export const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

export class Surface {
  constructor(canvas, resized = () => {}) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.width = 0;
    this.height = 0;
    this.fit();
    this.observer = new ResizeObserver(() => {
      if (this.fit()) resized();
    });
    this.observer.observe(canvas);
  }

  gone() {
    this.observer.disconnect();
  }

  fit() {
    const ratio = Math.min(3, devicePixelRatio || 1);
    const { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
    const changed = width !== this.canvas.width || height !== this.canvas.height;
    if (changed && width > 0 && height > 0) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.width = clientWidth;
    this.height = clientHeight;
    this.ratio = ratio;
    return changed;
  }

  // Cleared, in CSS pixels.
  begin() {
    const { context } = this;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    context.globalAlpha = 1;
    context.lineCap = "round";
    context.lineJoin = "round";
    context.setLineDash([]);
    return context;
  }
}
