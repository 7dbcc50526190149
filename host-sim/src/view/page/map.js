// The map: everything that has a place. Lengths are in m, on the screen in CSS pixels.
const MODE_COLOURS = {
  "not localised": "#999999", "reflectors": "#0072b2", "features": "#009e73", "contours": "#009e73",
  "mixed": "#56b4e9", "reflectors and contours": "#56b4e9",
  "dead reckoning": "#e69f00", "degraded": "#f0e442", "without odometry": "#cc79a7", "lost": "#d55e00",
};

class Camera {
  constructor() { this.x = 0; this.y = 0; this.scale = 20; }
  fit([x0, y0, x1, y1], width, height) {
    this.x = (x0 + x1) / 2; this.y = (y0 + y1) / 2;
    this.scale = 0.9 * Math.min(width / Math.max(x1 - x0, 1), height / Math.max(y1 - y0, 1));
  }
  zoom(factor) { this.scale = Math.min(2000, Math.max(0.5, this.scale * factor)); }
}

function fitCanvas(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

// Marks differ in shape, not only in colour.
const MARKS = {
  reflector(c, x, y, r) { c.beginPath(); c.arc(x, y, r, 0, 2 * Math.PI); c.fillStyle = "#0072b2"; c.fill(); },
  corner(c, x, y, r) { c.fillStyle = "#009e73"; c.fillRect(x - r, y - r, 2 * r, 2 * r); },
  end_point(c, x, y, r) {
    c.beginPath(); c.moveTo(x, y - r * 1.2); c.lineTo(x + r * 1.1, y + r); c.lineTo(x - r * 1.1, y + r); c.closePath();
    c.fillStyle = INKS.ink; c.fill();
  },
  found(c, x, y, r) { c.strokeStyle = "#009e73"; c.lineWidth = 2; c.strokeRect(x - r, y - r, 2 * r, 2 * r); },
  used(c, x, y, r) { c.beginPath(); c.arc(x, y, r * 1.9, 0, 2 * Math.PI); c.strokeStyle = "#0072b2"; c.lineWidth = 2; c.stroke(); },
  refused(c, x, y, r) {
    const k = r * 1.5;
    c.beginPath(); c.moveTo(x - k, y - k); c.lineTo(x + k, y + k); c.moveTo(x + k, y - k); c.lineTo(x - k, y + k);
    c.strokeStyle = "#d55e00"; c.lineWidth = 2.5; c.stroke();
  },
  unknown(c, x, y, r) {
    c.beginPath(); c.moveTo(x - r, y); c.lineTo(x + r, y); c.moveTo(x, y - r); c.lineTo(x, y + r);
    c.strokeStyle = "#999"; c.lineWidth = 1.5; c.stroke();
  },
  scan(c, x, y) { c.fillStyle = INKS.point; c.fillRect(x - 1, y - 1, 2, 2); },
};

const LEGEND = [["reflector", "reflector"], ["corner", "corner"], ["end_point", "end point"], ["found", "found while driving"],
  ["used", "observation that corrected the pose"], ["refused", "observation that fits no landmark"], ["unknown", "observation without a landmark near"], ["scan", "scan"]];

const VERDICT_MARKS = { accepted: "used", gated: "refused", ambiguous: "refused", out_of_time: "refused", unknown: "unknown" };

class MapView {
  constructor(canvas) { this.canvas = canvas; this.camera = new Camera(); this.drawn = {}; }

  size() { return [this.canvas.clientWidth, this.canvas.clientHeight]; }

  // The part of the map that is seen, somewhat widened, and how finely it needs to be drawn.
  window() {
    const [width, height] = this.size(), { x, y, scale } = this.camera;
    const w = width / scale, h = height / scale;
    return { tolerance_m: 2 / scale, x0: x - w, y0: y - h, x1: x + w, y1: y + h };
  }

  draw(model) {
    const { context: c, width, height } = fitCanvas(this.canvas);
    const { x: cx, y: cy, scale } = this.camera;
    const sx = (x) => width / 2 + (x - cx) * scale, sy = (y) => height / 2 - (y - cy) * scale;
    this.drawn = { landmarks: 0, scanPoints: 0, pathPoints: 0, observations: 0, vehicle: null };
    this.grid(c, width, height, sx, sy);
    this.path(c, model, sx, sy);
    const moment = model.moment;
    if (moment && moment.scan) this.scan(c, moment.scan.points_mm, sx, sy);
    this.landmarks(c, model, sx, sy, width, height);
    if (!moment) return;
    this.observations(c, moment.observations, sx, sy);
    if (moment.truth) this.outline(c, moment.truth, sx, sy, scale, INKS.ink, [5, 4]);
    if (moment.pose) {
      this.level(c, moment.pose, sx, sy, scale);
      this.ellipse(c, moment.pose, sx, sy, scale);
      this.vehicle(c, moment.pose.pose, sx, sy, scale, MODE_COLOURS[moment.pose.mode_name]);
      this.drawn.vehicle = { x: moment.pose.pose[0], y: moment.pose.pose[1], heading: moment.pose.pose[2],
        screen: [sx(moment.pose.pose[0]), sy(moment.pose.pose[1])] };
    }
  }

  grid(c, width, height, sx, sy) {
    const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];
    const step = steps.find((one) => one * this.camera.scale >= 60) || 1000;
    const { x, y, scale } = this.camera;
    c.strokeStyle = INKS.grid; c.lineWidth = 1; c.beginPath();
    for (let k = Math.ceil((x - width / 2 / scale) / step); k * step < x + width / 2 / scale; k++) {
      c.moveTo(sx(k * step), 0); c.lineTo(sx(k * step), height);
    }
    for (let k = Math.ceil((y - height / 2 / scale) / step); k * step < y + height / 2 / scale; k++) {
      c.moveTo(0, sy(k * step)); c.lineTo(width, sy(k * step));
    }
    c.stroke();
    c.fillStyle = c.strokeStyle = INKS.ink; c.lineWidth = 2; c.font = "13px system-ui, sans-serif";
    c.beginPath(); c.moveTo(width - 12 - step * scale, height - 12); c.lineTo(width - 12, height - 12); c.stroke();
    c.textAlign = "right"; c.fillText(step + " m", width - 12, height - 18); c.textAlign = "left";
  }

  path(c, model, sx, sy) {
    c.lineWidth = 1.5; c.lineJoin = "round";
    for (const [mode, points] of model.path.pieces) {
      c.strokeStyle = MODE_COLOURS[model.modeNames[mode]] || "#999";
      c.setLineDash(["lost", "dead reckoning", "without odometry"].includes(model.modeNames[mode]) ? [6, 4] : []);
      c.beginPath();
      for (let k = 0; k < points.length; k += 2) {
        const x = sx(points[k] / 1000), y = sy(points[k + 1] / 1000);
        if (k) c.lineTo(x, y); else c.moveTo(x, y);
      }
      c.stroke();
      this.drawn.pathPoints += points.length / 2;
    }
    c.setLineDash([]);
  }

  scan(c, points, sx, sy) {
    c.fillStyle = INKS.point;
    for (let k = 0; k < points.length; k += 2) c.fillRect(sx(points[k] / 1000) - 1, sy(points[k + 1] / 1000) - 1, 2, 2);
    this.drawn.scanPoints = points.length / 2;
  }

  landmarks(c, model, sx, sy, width, height) {
    const isNear = this.camera.scale > 14;
    c.font = "12px system-ui, sans-serif";
    const one = (mark, x, y, hits, name) => {
      if (x < -20 || y < -20 || x > width + 20 || y > height + 20) return;
      c.globalAlpha = hits ? 1 : 0.45;
      MARKS[mark](c, x, y, mark === "reflector" ? 5 : 4);
      c.globalAlpha = 1;
      if (isNear && name !== undefined) { c.fillStyle = INKS.soft; c.fillText(name, x + 8, y + 4); }
      this.drawn.landmarks += 1;
    };
    const hits = model.moment ? model.moment.hits : [];
    model.description.landmarks.forEach(([kind, id, x, y], k) => one(kind, sx(x), sy(y), hits[k] || 0, id));
    for (const { position: [x, y], hits } of model.moment ? model.moment.found : []) one("found", sx(x), sy(y), hits);
  }

  observations(c, observations, sx, sy) {
    for (const { located: [x, y], verdict } of observations) {
      MARKS[VERDICT_MARKS[verdict]](c, sx(x), sy(y), 5);
      this.drawn.observations += 1;
    }
  }

  // The protection level of the position, at its true size: within the alert limit of docking, of travelling, or above.
  level(c, { pose: [x, y], level: [bound], alarm }, sx, sy, scale) {
    const colour = { none: "#009e73", docking: "#e69f00", travel: "#d55e00" }[alarm];
    this.drawn.level = null;
    if (!colour || bound > 1000) return;
    c.beginPath(); c.arc(sx(x), sy(y), Math.max(bound * scale, 2), 0, 2 * Math.PI);
    c.strokeStyle = colour; c.lineWidth = 2; c.stroke();
    this.drawn.level = { m: bound, colour };
  }

  // Three standard deviations; magnified where it would be too small to be seen, which is then written beside it.
  ellipse(c, { pose: [x, y], covariance: [xx, xy, yy] }, sx, sy, scale) {
    const mean = (xx + yy) / 2, spread = Math.hypot((xx - yy) / 2, xy);
    const a = 3 * Math.sqrt(Math.max(mean + spread, 0)), b = 3 * Math.sqrt(Math.max(mean - spread, 0));
    const magnification = [1, 10, 100].find((k) => a * k * scale > 14) || 100;
    const angle = 0.5 * Math.atan2(2 * xy, xx - yy);
    c.beginPath();
    c.ellipse(sx(x), sy(y), Math.max(a * magnification * scale, 1), Math.max(b * magnification * scale, 1), -angle, 0, 2 * Math.PI);
    c.fillStyle = "rgba(230,159,0,.25)"; c.fill(); c.strokeStyle = INKS.ochre; c.lineWidth = 1.5; c.stroke();
    if (magnification > 1) {
      c.fillStyle = INKS.ochre; c.font = "12px system-ui, sans-serif";
      c.fillText("3σ × " + magnification, sx(x) + a * magnification * scale + 4, sy(y) - 6);
    }
  }

  shape(c, [x, y, heading], sx, sy, scale) {
    const length = Math.max(1.2 * scale, 16), width = length * 0.6;
    c.save(); c.translate(sx(x), sy(y)); c.rotate(-heading); c.beginPath();
    c.moveTo(length * 0.8, 0); c.lineTo(length * 0.35, width / 2); c.lineTo(-length * 0.3, width / 2);
    c.lineTo(-length * 0.3, -width / 2); c.lineTo(length * 0.35, -width / 2); c.closePath(); c.restore();
  }

  vehicle(c, pose, sx, sy, scale, colour) {
    this.shape(c, pose, sx, sy, scale);
    c.fillStyle = colour || "#999"; c.globalAlpha = 0.75; c.fill(); c.globalAlpha = 1;
    c.strokeStyle = INKS.ink; c.lineWidth = 2; c.stroke();
    c.beginPath(); c.arc(sx(pose[0]), sy(pose[1]), 2.5, 0, 2 * Math.PI); c.fillStyle = INKS.ink; c.fill();
  }

  outline(c, pose, sx, sy, scale, colour, dash) {
    this.shape(c, pose, sx, sy, scale);
    c.setLineDash(dash); c.strokeStyle = colour; c.lineWidth = 1.5; c.stroke(); c.setLineDash([]);
  }
}
