// What ties the views together: time, and asking the server.
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 100];
const KINDS = { worth: ["lost", "relocalised", "correction", "fault", "pose_given", "damage"], all: Object.keys(EVENT_MARKS) };

const model = {
  status: { start_s: 0, end_s: 0, is_complete: false, is_live: false, happenings: 0, poses: 0 },
  description: { landmarks: [], parameters: [] }, path: { pieces: [], extent_m: null }, modeNames: [],
  overview: null, events: [], shownEvents: [], moment: null, time: 0,
};
const page = { isPlaying: false, speed: 1, isFollowing: true, isLive: false, isFitted: false, isReady: false,
  isAsking: false, wanted: null, seekMs: null, drawnMs: null, errors: [], waiting: [], event: null };
const map = new MapView(element("map")), curves = new CurveView(element("curves"));

async function ask(path, query = {}) {
  const text = new URLSearchParams(query).toString();
  const answer = await fetch("api/" + path + (text && "?" + text));
  if (!answer.ok) throw new Error(path + ": " + answer.status);
  return answer.json();
}

function clamp(time) { return Math.min(Math.max(time, model.status.start_s), model.status.end_s); }

function draw() { map.draw(model); curves.draw(model); }

let isDrawing = false;
function drawSoon() {
  if (isDrawing) return;
  isDrawing = true;
  requestAnimationFrame(() => { isDrawing = false; draw(); });
}

// Shows an instant. While one is on its way, only the newest wish is kept.
function seek(time) {
  model.time = clamp(time);
  showClock();
  return new Promise((resolve) => {
    page.waiting.push(resolve);
    page.wanted = model.time;
    if (!page.isAsking) fetchMoment();
  });
}

async function fetchMoment() {
  page.isAsking = true;
  while (page.wanted !== null) {
    const time = page.wanted, start = performance.now();
    page.wanted = null;
    const resolved = page.waiting;
    page.waiting = [];
    try {
      model.moment = await ask("moment", { time_s: time });
      if (page.isFollowing) centre();
      showPanel(model.moment);
      draw();
      page.seekMs = performance.now() - start;
    } catch (error) { report(error); }
    resolved.forEach((resolve) => resolve(state()));
  }
  page.isAsking = false;
}

function report(error) {
  page.errors.push(String(error));
  element("progress").textContent = "the server does not answer: " + error.message;
}

function centre() {
  const pose = model.moment && ((model.moment.pose && model.moment.pose.pose) || model.moment.truth);
  if (pose) { [map.camera.x, map.camera.y] = pose; askPathSoon(); }
}

function showClock() {
  const { start_s, end_s } = model.status;
  element("clock").textContent = `${(model.time - start_s).toFixed(2)} of ${(end_s - start_s).toFixed(1)} s`;
  const scrub = element("scrub");
  scrub.min = start_s; scrub.max = end_s; scrub.value = model.time;
}

// The way is asked for anew when the map shows another part, or another fineness.
let pathTimer = null, pathWindow = null;
function askPathSoon(isForced = false) {
  const wanted = map.window(), had = pathWindow;
  const isCovered = had && wanted.tolerance_m <= had.tolerance_m * 2 && wanted.tolerance_m >= had.tolerance_m / 2
    && Math.abs(wanted.x0 + wanted.x1 - had.x0 - had.x1) < (had.x1 - had.x0) / 2
    && Math.abs(wanted.y0 + wanted.y1 - had.y0 - had.y1) < (had.y1 - had.y0) / 2;
  if ((isCovered && !isForced) || pathTimer) return;
  pathTimer = setTimeout(async () => {
    pathTimer = null;
    pathWindow = map.window();
    try { model.path = await ask("path", pathWindow); } catch (error) { report(error); }
    fitOnce();
    drawSoon();
  }, 60);
}

function fitOnce() {
  const [width, height] = map.size();
  if (page.isFitted || !model.path.extent_m) return;
  page.isFitted = true;
  map.camera.fit(model.path.extent_m, width, height);
  // Near enough to see the vehicle, where it is followed.
  if (page.isFollowing) { map.camera.scale = Math.max(map.camera.scale, Math.min(width, height) / 30); centre(); }
  askPathSoon(true);
}

async function askOverview() {
  const { start_s, end_s } = model.status;
  // No interval is so short that it has no pose.
  const most = Math.max(1, Math.floor((end_s - start_s) / 0.05));
  model.overview = await ask("overview", { from_s: start_s, to_s: end_s, intervals: Math.min(curves.intervals(), most) });
  model.modeNames = model.overview.mode_names;
}

function showEvents() {
  const kind = element("kinds").value, kinds = KINDS[kind] || [kind];
  model.shownEvents = model.events.filter((event) => kinds.includes(event.kind));
  const list = element("event");
  list.replaceChildren(...model.shownEvents.slice(0, 2000).map((event, k) => {
    const option = document.createElement("option");
    option.value = k;
    option.textContent = `${EVENT_MARKS[event.kind]} ${(event.time_s - model.status.start_s).toFixed(1)} s  ${event.text}`;
    return option;
  }));
  list.selectedIndex = page.event === null ? -1 : Math.min(page.event, model.shownEvents.length - 1);
}

function jump(index) {
  const event = model.shownEvents[index];
  if (!event) return Promise.resolve(state());
  page.event = index;
  element("event").selectedIndex = index;
  setLive(false);
  return seek(event.time_s);
}

function jumpBy(step) {
  const times = model.shownEvents.map((event) => event.time_s), epsilon = 1e-4;
  const index = step > 0 ? times.findIndex((time) => time > model.time + epsilon)
    : times.findLastIndex((time) => time < model.time - epsilon);
  return jump(index);
}

function setPressed(id, isPressed) { element(id).setAttribute("aria-pressed", String(isPressed)); }

function setPlaying(isPlaying) {
  page.isPlaying = isPlaying;
  setPressed("play", isPlaying);
  element("play").textContent = isPlaying ? "Pause" : "Play";
  if (isPlaying && model.time >= model.status.end_s) seek(model.status.start_s);
  lastFrame = null;
}

function setSpeed(speed) { page.speed = speed; element("speed").value = speed; }

function setFollowing(isFollowing) {
  page.isFollowing = isFollowing;
  setPressed("track", isFollowing);
  if (isFollowing) { centre(); drawSoon(); }
}

function setLive(isLive) { page.isLive = isLive && model.status.is_live; setPressed("live", page.isLive); }

let lastFrame = null;
function frame(now) {
  const passed = lastFrame === null ? 0 : Math.min((now - lastFrame) / 1000, 0.5);
  lastFrame = now;
  if (page.isPlaying && !page.isLive) {
    const time = model.time + passed * page.speed;
    if (time >= model.status.end_s && model.status.is_complete) setPlaying(false);
    if (passed) seek(time);
  }
  requestAnimationFrame(frame);
}

// What is new: while a log is read, and as long as a controller drives.
async function watch() {
  const before = model.status, status = await ask("status");
  model.status = status;
  if (status.landmarks !== before.landmarks || !model.description.software) {
    model.description = await ask("description");
    element("name").textContent = model.description.name;
    element("software").textContent = model.description.software;
    setRows(element("parameters"), model.description.parameters.map(([name, value]) => row(name, value)));
  }
  const hasGrown = status.end_s !== before.end_s || status.poses !== before.poses;
  if (status.happenings !== before.happenings) { model.events = await ask("happenings"); showEvents(); }
  if (hasGrown || !model.overview) { await askOverview(); askPathSoon(true); }
  const isFirst = !page.isReady && status.end_s > 0;
  if (isFirst) { element("live").hidden = !status.is_live; setLive(status.is_live); }
  element("progress").textContent = status.is_live ? (status.is_complete ? "the connection has ended" : "live")
    : status.is_complete ? "" : `reading ${(100 * status.progress).toFixed(0)} %`;
  if (page.isLive) await seek(status.end_s);
  else if (isFirst) await seek(status.start_s);
  else if (hasGrown) await seek(model.time);
  page.isReady = page.isReady || isFirst;
  drawSoon();
}

async function watchOn() {
  for (;;) {
    try { await watch(); } catch (error) { report(error); }
    if (model.status.is_complete && page.isReady) return;
    await new Promise((resolve) => setTimeout(resolve, page.isReady && !model.status.is_live ? 300 : 100));
  }
}

// The state of the page, for programs.
function state() {
  const moment = model.moment, pose = moment && moment.pose;
  return {
    ready: page.isReady, complete: model.status.is_complete, live: page.isLive, time_s: model.time,
    shown_s: moment ? moment.time_s : null, start_s: model.status.start_s, end_s: model.status.end_s,
    playing: page.isPlaying, speed: page.speed, following: page.isFollowing,
    pose: pose ? { time_s: pose.time_s, x_m: pose.pose[0], y_m: pose.pose[1], heading_rad: pose.pose[2] } : null,
    covariance: pose ? pose.covariance : null,
    level: pose ? pose.level : null, alarm: pose ? pose.alarm : null,
    truth: moment && moment.truth ? { x_m: moment.truth[0], y_m: moment.truth[1], heading_rad: moment.truth[2] } : null,
    mode: pose ? pose.mode : "not_localised", reason: pose ? pose.reason : null, health: moment ? moment.health : null,
    events: model.shownEvents, all_events: model.events.length, event: page.event, drawn: map.drawn,
    scale: map.camera.scale, seek_ms: page.seekMs, errors: page.errors,
  };
}

function listenToKeys() {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || element("keys").open) return;
    // Lists keep the keys that move in them.
    const isList = event.target.tagName === "SELECT";
    const step = event.shiftKey ? 10 : 0.125;
    const actions = {
      " ": () => setPlaying(!page.isPlaying), ArrowRight: () => { setLive(false); seek(model.time + step); },
      ArrowLeft: () => { setLive(false); seek(model.time - step); },
      n: () => jumpBy(1), p: () => jumpBy(-1), Home: () => { setLive(false); seek(model.status.start_s); },
      End: () => seek(model.status.end_s), f: () => setFollowing(!page.isFollowing), a: showAll, l: () => setLive(true),
      "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), "?": () => element("keys").showModal(),
    };
    const action = actions[event.key] || actions[event.key.toLowerCase()];
    const speed = /^[1-9]$/.test(event.key) ? SPEEDS[Number(event.key) - 1] : null;
    if (isList && event.key.startsWith("Arrow")) return;
    if (speed) setSpeed(speed);
    else if (action) action();
    else return;
    event.preventDefault();
  });
}

function zoom(factor) { map.camera.zoom(factor); askPathSoon(); drawSoon(); }

function showAll() {
  setFollowing(false);
  if (model.path.extent_m) map.camera.fit(model.path.extent_m, ...map.size());
  askPathSoon();
  drawSoon();
}

function listenToMap() {
  const canvas = element("map"), fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    const now = [event.clientX, event.clientY];
    if (other) {
      const distance = ([x, y]) => Math.hypot(x - other[1][0], y - other[1][1]);
      zoom(distance(now) / Math.max(distance(before), 1));
    } else {
      setFollowing(false);
      map.camera.x -= (now[0] - before[0]) / map.camera.scale;
      map.camera.y += (now[1] - before[1]) / map.camera.scale;
      askPathSoon();
      drawSoon();
    }
    fingers.set(event.pointerId, now);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY / 400)); }, { passive: false });
}

function listenToControls() {
  element("play").onclick = () => { setLive(false); setPlaying(!page.isPlaying); };
  element("before").onclick = () => jumpBy(-1);
  element("after").onclick = () => jumpBy(1);
  element("track").onclick = () => setFollowing(!page.isFollowing);
  element("all").onclick = showAll;
  element("nearer").onclick = () => zoom(1.4);
  element("farther").onclick = () => zoom(1 / 1.4);
  element("live").onclick = () => setLive(!page.isLive);
  element("help").onclick = () => element("keys").showModal();
  element("scrub").oninput = (event) => { setLive(false); seek(Number(event.target.value)); };
  element("speed").append(...SPEEDS.map((speed) => new Option(speed + " ×", speed)));
  element("speed").onchange = (event) => setSpeed(Number(event.target.value));
  setSpeed(1);
  const names = { worth: "what matters", all: "everything", lost: "lost", relocalised: "relocalised", correction: "corrections over 1 cm",
    fault: "encoder faults", mode: "modes", pose_given: "poses given", note: "notes", damage: "damage" };
  element("kinds").append(...Object.entries(names).map(([kind, name]) => new Option(name, kind)));
  element("kinds").onchange = () => { page.event = null; showEvents(); drawSoon(); };
  element("event").onchange = (event) => jump(event.target.selectedIndex);
  const canvas = element("curves");
  const scrub = (event) => { setLive(false); seek(curves.timeAt(event.offsetX)); };
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); scrub(event); });
  canvas.addEventListener("pointermove", (event) => { if (event.buttons) scrub(event); });
  new ResizeObserver(async () => {
    if (model.overview) { try { await askOverview(); } catch (error) { report(error); } }
    askPathSoon();
    drawSoon();
  }).observe(document.body);
}

window.agv = { state, seek: (time) => { setLive(false); return seek(time); }, jump, play: () => setPlaying(true), pause: () => setPlaying(false),
  setSpeed, showKind: (kind) => { element("kinds").value = kind; page.event = null; showEvents(); return state(); } };

function takeScheme() { readInks(); showLegend(element("key")); drawSoon(); }

takeScheme();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", takeScheme);
listenToKeys();
listenToMap();
listenToControls();
requestAnimationFrame(frame);
watchOn();
