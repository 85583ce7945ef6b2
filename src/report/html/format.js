"use strict";
// Small helpers: numbers, elements. Texts go in as text, never as HTML: file names come from outside.

const known = (x) => typeof x === "number" && isFinite(x);
const number = (x, digits = 4) => (known(x) ? String(Number(x.toPrecision(digits))) : "–");
const percent = (x) => (known(x) ? `${Math.round(100 * x)} %` : "–");
const logName = (log) => log.name + (log.from_s > 0 ? `, from ${number(log.from_s)} s` : "");

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "style") {
      for (const [property, set] of Object.entries(value)) made.style.setProperty(property, set);
    } else if (value !== undefined && value !== null) {
      made.setAttribute(key, value);
    }
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

// rows: lists of cells, a cell being text, an element, or {number} for text set to the right.
function table(caption, heads, rows) {
  const cell = (tag, content) =>
    content && typeof content === "object" && "number" in content
      ? element(tag, {class: "number"}, content.number)
      : element(tag, {}, content ?? "");
  const head = element("tr", {}, ...heads.map((h) => { const th = cell("th", h); th.scope = "col"; return th; }));
  const made = element(
    "table",
    {"aria-label": caption},
    element("thead", {}, head),
    element("tbody", {}, ...rows.map((r) => element("tr", {}, ...r.map((c) => cell("td", c))))),
  );
  return element("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": caption}, made);
}

const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function show(id, ...children) {
  const section = document.getElementById(id);
  section.hidden = false;
  return section;
}
