// Curves over time below the map.
const EVENT_MARKS = { lost: "▼", relocalised: "▲", correction: "◆", mode: "|", fault: "!", pose_given: "●", note: "·", damage: "×" };

class CurveView {
  constructor(canvas) { this.canvas = canvas; this.from = 0; this.to = 1; }

  intervals() { return Math.max(100, Math.min(2000, this.canvas.clientWidth)); }

  timeAt(x) { return this.from + (x / Math.max(this.canvas.clientWidth, 1)) * (this.to - this.from); }

  draw(model) {
    const { context: c, width, height } = fitCanvas(this.canvas);
    const overview = model.overview;
    if (!overview) return;
    this.from = overview.from_s; this.to = overview.to_s;
    const count = overview.modes.length, step = width / count;
    const strip = 14, marks = 16;
    this.modes(c, overview, step, strip);
    const top = strip + marks, rows = [
      ["σ position", overview.deviation_m, (v) => (100 * v).toFixed(1) + " cm", "#0072b2"],
      ["norm. square", overview.normalised_square, (v) => v.toFixed(1), INKS.ochre],
      ["correction", overview.correction_m, (v) => (100 * v).toFixed(1) + " cm", "#d55e00"],
    ];
    const room = (height - top) / rows.length;
    rows.forEach(([name, values, format, colour], k) => this.row(c, name, values, format, colour, top + k * room, room, step));
    c.font = "12px system-ui, sans-serif"; c.textAlign = "center";
    for (const { time_s, kind } of model.shownEvents) {
      const x = this.place(time_s, width);
      c.fillStyle = kind === "lost" || kind === "fault" || kind === "damage" ? INKS.warn : INKS.ink;
      c.fillText(EVENT_MARKS[kind] || "·", x, strip + 12);
    }
    c.textAlign = "left";
    const x = this.place(model.time, width);
    c.fillStyle = INKS.ink; c.fillRect(x - 1, 0, 2, height);
  }

  place(time, width) { return ((time - this.from) / Math.max(this.to - this.from, 1e-9)) * width; }

  // Graver modes fill more of the strip, so that it reads without colours, too.
  modes(c, overview, step, strip) {
    const heights = { "mixed": 0.3, "reflectors and contours": 0.3, "reflectors": 0.4, "features": 0.5, "contours": 0.5,
      "not localised": 0.6, "dead reckoning": 0.75, "degraded": 0.7, "without odometry": 0.85, "lost": 1 };
    overview.modes.forEach((mode, k) => {
      if (mode === null) return;
      const name = overview.mode_names[mode], height = strip * heights[name];
      c.fillStyle = MODE_COLOURS[name];
      c.fillRect(k * step, strip - height, Math.ceil(step), height);
    });
  }

  row(c, name, values, format, colour, top, room, step) {
    let largest = 0;
    for (const value of values) if (value !== null && value > largest) largest = value;
    const floor = top + room - 3;
    c.fillStyle = colour;
    values.forEach((value, k) => {
      if (value === null || !largest) return;
      const height = Math.max((value / largest) * (room - 6), 1);
      c.fillRect(k * step, floor - height, Math.max(step, 1), height);
    });
    const text = name + ", largest " + format(largest);
    c.font = "12px system-ui, sans-serif";
    c.fillStyle = INKS.paper; c.globalAlpha = 0.8; c.fillRect(0, top + 1, c.measureText(text).width + 8, 15); c.globalAlpha = 1;
    c.fillStyle = INKS.ink; c.fillText(text, 4, top + 13);
  }
}
