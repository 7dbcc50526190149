// Colours of the style sheet, light or dark, for what is drawn.
const INKS = {};

function readInks() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ink", "soft", "paper", "grid", "point", "ochre", "warn"]) INKS[name] = style.getPropertyValue("--" + name).trim();
}

readInks();
