// Numbers beside the map. Text from a log is only ever set as text.
function element(id) { return document.getElementById(id); }

function setRows(body, rows) {
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach(({ cells, isBad }, k) => {
    const row = body.rows[k] || body.insertRow(-1);
    while (row.cells.length < cells.length) row.append(document.createElement(row.cells.length ? "td" : "th"));
    row.className = isBad ? "no" : "";
    cells.forEach((text, place) => { if (row.cells[place].textContent !== text) row.cells[place].textContent = text; });
  });
}

const row = (name, value, isBad = false) => ({ cells: [name, value], isBad });

function degrees(radians) { return (radians * 180 / Math.PI).toFixed(2) + "°"; }

function showPanel(moment) {
  const pose = moment.pose;
  const mode = pose ? pose.mode_name : "not localised";
  if (element("mode").textContent !== mode) element("mode").textContent = mode;
  element("mode").style.setProperty("--mode", MODE_COLOURS[mode]);
  element("reason").textContent = pose ? pose.reason_name : "";
  setRows(element("pose"), pose ? poseRows(pose, moment.truth) : []);
  const { drive, steering, is_bus_alive, is_laser_alive } = moment.health;
  const fault = (name, of) => row(name, of ? of.replaceAll("_", " ") : "sound", Boolean(of));
  setRows(element("health"), [
    row("laser", is_laser_alive ? "sound" : "silent", !is_laser_alive),
    row("odometry, bus", is_bus_alive ? "sound" : "silent", !is_bus_alive),
    fault("drive encoder", drive), fault("steering encoder", steering),
  ]);
  setRows(document.querySelector("#observations tbody"), sorted(moment.observations).slice(0, 40).map(observationRow));
}

function poseRows(pose, truth) {
  const [x, y, heading] = pose.pose, [xx, , yy, , , tt] = pose.covariance.map((value) => Math.max(value, 0));
  const [bound, turn] = pose.level;
  const rows = [
    row("x", `${x.toFixed(3)} m ± ${(1000 * Math.sqrt(xx)).toFixed(1)} mm`),
    row("y", `${y.toFixed(3)} m ± ${(1000 * Math.sqrt(yy)).toFixed(1)} mm`),
    row("heading", `${degrees(heading)} ± ${degrees(Math.sqrt(tt))}`),
    row("protection level", bound > 1000 ? "none" : `${(1000 * bound).toFixed(0)} mm, ${degrees(turn)}`, pose.alarm === "travel"),
    row("without a landmark since", pose.dead_reckoning_m.toFixed(2) + " m", pose.dead_reckoning_m > 0.5),
    row("accepted lately", (100 * pose.acceptance).toFixed(0) + " %", pose.acceptance < 0.5),
    row("normalised square, 2 expected", pose.normalised_square.toFixed(2), pose.normalised_square > 6),
    row("last correction", (1000 * pose.correction_m).toFixed(1) + " mm", pose.correction_m > 0.01),
  ];
  if (truth) {
    const error = Math.hypot(x - truth[0], y - truth[1]);
    rows.push(row("off the true place", (1000 * error).toFixed(1) + " mm", error > 0.02));
  }
  return rows;
}

// What has a landmark comes first.
function sorted(observations) {
  const order = ["gated", "ambiguous", "out_of_time", "accepted", "unknown"];
  return [...observations].sort((a, b) => order.indexOf(a.verdict) - order.indexOf(b.verdict));
}

function observationRow({ kind, landmark, verdict, residual, test_ratio }) {
  const second = kind === "reflector" ? degrees(residual[1]) : (1000 * residual[1]).toFixed(0) + " mm";
  return {
    cells: [
      kind.replace("_", " "), landmark ? landmark[0][0] + landmark[1] : "–",
      landmark ? `${(1000 * residual[0]).toFixed(0)} mm, ${second}` : "–",
      verdict === "accepted" || verdict === "gated" ? test_ratio.toFixed(2) : verdict.replaceAll("_", " "),
    ],
    isBad: verdict !== "accepted" && verdict !== "unknown",
  };
}

function showLegend(list) {
  list.replaceChildren();
  for (const [mark, name] of LEGEND) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 22;
    MARKS[mark](canvas.getContext("2d"), 11, 11, 5);
    const item = document.createElement("li");
    item.append(canvas, name);
    list.append(item);
  }
  for (const [name, colour] of Object.entries(MODE_COLOURS)) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 22;
    const c = canvas.getContext("2d");
    c.fillStyle = colour; c.fillRect(2, 6, 18, 10);
    const item = document.createElement("li");
    item.append(canvas, name);
    list.append(item);
  }
}
