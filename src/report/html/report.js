"use strict";
// Puts the page together.

const data = JSON.parse(document.getElementById("report-data").textContent);
let current = 0, picked = 0;

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  document.getElementById("theme").textContent = theme === "dark" ? "Light" : "Dark";
  document
    .getElementById("theme")
    .setAttribute("aria-label", theme === "dark" ? "Switch to light colours" : "Switch to dark colours");
}

function drawLog() {
  const log = data.logs[current];
  if (!log?.traces) return;
  drawTraces(log, picked);
  drawTiles(log, picked, pick);
  drawResponses(log);
  drawCurves(data.curves);
  const maps = document.getElementById("maps");
  maps.replaceChildren();
  const figures = (log.maps ?? []).map(drawMap).filter(Boolean);
  if (figures.length) {
    show("where");
    maps.append(
      element("div", {class: "maps"}, ...figures),
      element(
        "p",
        {class: "note"},
        "A jump where the speed changes sign is dry friction, a slope across the angle a spring, a slope "
          + "across the speed damping. Speed and acceleration come from the log by local fits over 20 ms to each side."
          + (log.traces.signals.length > figures.length ? " Of the joints with the largest errors." : ""),
      ),
    );
  }
}

// Signals of the log to pick from, where there are many.
function listSignals() {
  const log = data.logs[current], signals = log?.traces?.signals ?? [];
  document.getElementById("picker").hidden = signals.length <= data.few_signals;
  document.getElementById("signal").replaceChildren(
    ...signals.map((s, i) => element("option", {value: i}, `${s.name} (${number(s.error, 2)})`)));
  picked = 0;
}

function pick(signal) {
  picked = signal;
  document.getElementById("signal").value = signal;
  drawTraces(data.logs[current], picked);
  document.querySelectorAll(".tile").forEach((tile, i) => tile.setAttribute("aria-pressed", String(i === picked)));
  const traces = document.getElementById("traces");
  if (traces.getBoundingClientRect().top < 0) traces.scrollIntoView();
}

function choosers() {
  const select = document.getElementById("log");
  data.logs.forEach((log, i) => {
    const name = logName(log) + (log.held_out ? ` (${log.held_out})` : "");
    if (log.traces) select.append(element("option", {value: i}, name));
  });
  select.addEventListener("change", () => {
    current = Number(select.value);
    listSignals();
    drawLog();
  });
  document.getElementById("signal").addEventListener("change", (event) => pick(Number(event.target.value)));
  document
    .querySelectorAll("[data-zoom]")
    .forEach((button) => button.addEventListener("click", () => zoom(button.dataset.zoom)));
  const keys = {"+": "in", "=": "in", "-": "out", ArrowLeft: "left", ArrowRight: "right", 0: "all"};
  document.getElementById("charts").addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey || event.altKey) return;
    zoom(keys[event.key]);
    event.preventDefault();
  });
  document.getElementById("theme").addEventListener("click", () => {
    setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
    drawLog();
  });
}

function contents() {
  const titles = {
    verdict: "Result",
    tables: "Evidence",
    video: "Video",
    traces: "Traces",
    where: "Where",
    why: "Why",
    statements: "Effects",
    parameters: "Parameters",
    response: "Frequency",
    next: "Next",
    data: "Data",
    reproduce: "Reproduce",
  };
  for (const [id, title] of Object.entries(titles)) {
    if (document.getElementById(id).hidden) continue;
    document.getElementById("contents").append(element("li", {}, element("a", {href: `#${id}`}, title)));
  }
}

setTheme(window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
document.getElementById("subject").textContent = data.subject;
writeVerdict(data.headline);
writeFindings(data.findings, data.gap);
writeRemainder(data.remainder, data.reachable);
writeTables(data.tables);
const video = document.getElementById("video");
if (video.dataset.video) {
  document.getElementById("player").src = video.dataset.video;
  video.hidden = false;
}
if (data.logs.some((log) => log.traces)) show("traces");
writeConditions(data.where);
choosers();
listSignals();
drawLog();
writeStatements(data.statements);
writeParameters(data.parameters, data.headline.notes);
writeNext(data.next);
writeQuality(data.logs);
writeProvenance(data);
writeWords(data.glossary);
contents();
