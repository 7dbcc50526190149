// Opens pages that are files in a headless browser, light, dark and on a phone. What it finds goes to standard output as JSON.
// Arguments: folder for pictures, and the pages.
const { chromium } = require("playwright-core");
const path = require("path");

const [, , pictures, ...files] = process.argv;
const LOOKS = {
  light: { viewport: { width: 1280, height: 800 }, colorScheme: "light" },
  dark: { viewport: { width: 1280, height: 800 }, colorScheme: "dark" },
  phone: { viewport: { width: 390, height: 844 }, colorScheme: "light" },
};

// How far the page is wider than the screen, pixels, and how light paper and ink are, 0 to 255.
function measure() {
  const lightness = (colour) => { const [r, g, b] = colour.match(/[\d.]+/g).map(Number); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const style = getComputedStyle(document.body), root = document.documentElement;
  const isClear = (colour) => colour === "rgba(0, 0, 0, 0)";
  // A page without a colour of its own has that of its scheme.
  const probe = document.createElement("div");
  probe.style.background = "Canvas";
  document.body.append(probe);
  const papers = [style, getComputedStyle(root), getComputedStyle(probe)].map((one) => one.backgroundColor);
  const found = { overflow: root.scrollWidth - root.clientWidth, paper: lightness(papers.find((one) => !isClear(one))), ink: lightness(style.color) };
  probe.remove();
  return found;
}

(async () => {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox"] });
  const report = {};
  try {
    for (const file of files) {
      const name = path.basename(file, ".html"), found = { complaints: [] };
      for (const [look, options] of Object.entries(LOOKS)) {
        const page = await browser.newPage(options);
        page.on("console", (message) => { if (["error", "warning"].includes(message.type())) found.complaints.push(message.text()); });
        page.on("pageerror", (error) => found.complaints.push(String(error)));
        await page.goto("file://" + path.resolve(file));
        await page.screenshot({ path: `${pictures}/${name}-${look}.png`, fullPage: true });
        found[look] = await page.evaluate(measure);
        await page.close();
      }
      report[name] = found;
    }
  } finally {
    await browser.close();
  }
  console.log(JSON.stringify(report));
})().catch((error) => { console.error(error.stack); process.exit(1); });
