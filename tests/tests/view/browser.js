// Opens the page in a headless browser and uses it as people do. What it finds goes to standard output as JSON.
// Arguments: address of the page, folder for pictures or "-", and "log" or "live".
const { chromium } = require("playwright-core");

const [, , url, pictures, kind] = process.argv;
const SIZES = { wide: { width: 1280, height: 800 }, phone: { width: 390, height: 844 } };

async function open(browser, size, complaints) {
  const page = await browser.newPage({ viewport: size });
  page.on("console", (message) => {
    if (message.type() === "error" || message.type() === "warning") complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("requestfailed", (request) => complaints.push("failed: " + request.url()));
  const start = Date.now();
  await page.goto(url);
  await page.waitForFunction(() => window.agv && window.agv.state().ready);
  return { page, opened_ms: Date.now() - start };
}

const state = (page) => page.evaluate(() => window.agv.state());
const seek = (page, time) => page.evaluate((time) => window.agv.seek(time), time);

async function useLog(page) {
  await page.waitForFunction(() => window.agv.state().complete, null, { timeout: 120000 });
  const { start_s, end_s } = await state(page);
  const found = { seeks: [] };
  // Forwards, backwards, and to where nobody has been yet.
  for (const share of [0.31, 0.9, 0.05, 0.62, 0.5, 0.77, 0.13, 0.99, 0.42, 0.21]) {
    found.seeks.push(await seek(page, start_s + share * (end_s - start_s)));
  }
  // The slider, as a hand moves it.
  const slider = await page.locator("#scrub").boundingBox();
  await page.mouse.move(slider.x + 0.2 * slider.width, slider.y + slider.height / 2);
  await page.mouse.down();
  await page.mouse.move(slider.x + 0.6 * slider.width, slider.y + slider.height / 2, { steps: 8 });
  await page.mouse.up();
  const hasSettled = () => { const now = window.agv.state(); return Math.abs(now.shown_s - now.time_s) < 1e-4; };
  await page.waitForFunction(hasSettled);
  found.dragged = await state(page);
  // Events by key; the first one of each kind by the list.
  await page.locator("#map").focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("n");
  await page.waitForFunction(() => window.agv.state().event !== null);
  await page.waitForFunction(hasSettled);
  found.next_event = await state(page);
  found.kinds = {};
  for (const name of ["lost", "relocalised", "correction"]) {
    const { events } = await page.evaluate((name) => window.agv.showKind(name), name);
    found.kinds[name] = { count: events.length, first: events[0] || null, jumped: null };
    if (events.length) found.kinds[name].jumped = await page.evaluate(() => window.agv.jump(0));
  }
  await page.evaluate(() => window.agv.showKind("worth"));
  // Play at ten times the speed for a while.
  await seek(page, start_s + 0.3 * (end_s - start_s));
  await page.locator("#speed").selectOption("10");
  found.before_play = await state(page);
  const begun = Date.now();
  await page.locator("#play").click();
  await page.waitForFunction((time) => window.agv.state().shown_s > time, found.before_play.time_s + 5);
  await page.locator("#play").click();
  found.played_s = (Date.now() - begun) / 1000;
  await page.waitForFunction(hasSettled);
  found.after_play = await state(page);
  await page.locator("#map").focus();
  await page.keyboard.press("a");
  await page.keyboard.press("+");
  found.after_keys = await state(page);
  await page.keyboard.press("f");
  return found;
}

async function useLive(page) {
  await page.waitForFunction(() => window.agv.state().pose !== null, null, { timeout: 60000 });
  const first = await state(page);
  await page.waitForFunction((time) => window.agv.state().shown_s > time + 3, first.shown_s, { timeout: 60000 });
  await page.waitForFunction(() => window.agv.state().drawn.scanPoints > 100);
  const second = await state(page);
  const scrubbed = await seek(page, first.shown_s);
  await page.locator("#map").focus();
  await page.keyboard.press("l");
  await page.waitForFunction((time) => window.agv.state().shown_s > time, second.shown_s);
  return { first, second, scrubbed, again: await state(page) };
}

(async () => {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox"] });
  const complaints = [], report = { sizes: {} };
  try {
    const { page, opened_ms } = await open(browser, SIZES.wide, complaints);
    report.opened_ms = opened_ms;
    report.found = kind === "live" ? await useLive(page) : await useLog(page);
    if (pictures !== "-") await page.screenshot({ path: `${pictures}/view-${kind}-wide.png` });
    await page.emulateMedia({ colorScheme: "dark" });
    await page.waitForFunction(() => INKS.paper === getComputedStyle(document.documentElement).getPropertyValue("--paper").trim());
    report.dark = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    if (pictures !== "-") await page.screenshot({ path: `${pictures}/view-${kind}-dark.png` });
    await page.emulateMedia({ colorScheme: "light" });
    report.sizes.wide = await overflow(page);
    const phone = await open(browser, SIZES.phone, complaints);
    if (kind === "log") {
      await phone.page.waitForFunction(() => window.agv.state().complete);
      await seek(phone.page, report.found.dragged.time_s);
    }
    await phone.page.waitForFunction(() => window.agv.state().drawn.scanPoints > 0);
    if (pictures !== "-") await phone.page.screenshot({ path: `${pictures}/view-${kind}-phone.png`, fullPage: true });
    report.sizes.phone = await overflow(phone.page);
    report.phone = await state(phone.page);
  } finally {
    await browser.close();
  }
  report.complaints = complaints;
  console.log(JSON.stringify(report));
})().catch((error) => { console.error(error.stack); process.exit(1); });

// How far the page is wider than the screen, pixels.
async function overflow(page) {
  return page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
}
