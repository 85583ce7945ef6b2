// A fleet's page: what changed, a heat map of robots and time, and one robot at a time in full.
const FLEET = JSON.parse(document.getElementById("fleet-data").textContent);
const FIRST_ROWS = 100, ROW = 20;
const [TIME, GAP, NOMINAL, LEFT, ID, REPORT, PROBLEM] = [0, 1, 2, 3, 4, 5, 6];
const MEASURES = [
  {at: GAP, name: "gap: base model's error, refitted, over the sensors' floor"},
  {at: NOMINAL, name: "error of the nominal model"},
  {at: LEFT, name: "error left, held out"},
].filter((m) => FLEET.robots.some((r) => r.units.some((u) => known(u[m.at]))));
const SVG = "http://www.w3.org/2000/svg";
let measure = MEASURES[0], rows = FIRST_ROWS, picked = 0;
const timeAt = new Map(FLEET.times.map((time, i) => [time, i]));
const byId = (id) => document.getElementById(id);

function drawn(tag, attributes, text) {
  const made = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

// From blue over grey to orange, told apart without red and green; by logarithm between the 2nd and 98th of a hundred.
let range = [1, 10];
function setRange() {
  if (!measure) return;
  const values = FLEET.robots.flatMap((r) => r.units.map((u) => u[measure.at])).filter((x) => known(x) && x > 0);
  values.sort((a, b) => a - b);
  if (!values.length) return;
  range = [values[Math.floor(0.02 * (values.length - 1))], values[Math.ceil(0.98 * (values.length - 1))]];
  if (!(range[1] > range[0] * 1.05)) range = [range[0] / 1.5, range[0] * 1.5];
}
const shade = (share) => `hsl(${share < 0.5 ? 210 : 28} ${Math.round(20 + 150 * Math.abs(share - 0.5))}% `
  + `${Math.round(72 - 30 * Math.abs(2 * share - 1))}%)`;
function shareOf(value) {
  const share = Math.log(Math.max(value, 1e-12) / range[0]) / Math.log(range[1] / range[0]);
  return Math.round(20 * Math.min(1, Math.max(0, share))) / 20;
}

// Neighbouring cells of one color are one rectangle.
function strip(robot, cell) {
  const width = cell * FLEET.times.length;
  const svg = drawn("svg", {width, height: ROW - 2, viewBox: `0 0 ${width} ${ROW - 2}`, "aria-hidden": "true"});
  const path = new Map();
  const at = (u) => cell * (timeAt.get(u[TIME]) ?? 0);
  let last = null;
  for (const u of robot.units) {
    const value = measure ? u[measure.at] : null;
    const fill = known(value) ? shade(shareOf(value)) : "none";
    if (fill === "none") {
      svg.append(drawn("path", {d: `M${at(u) + 1} 3l${cell - 2} ${ROW - 8}`, stroke: color("--faint")}));
      last = null;
    } else if (last && last.fill === fill && last.end === at(u)) {
      last.end += cell;
    } else {
      last = {fill, begin: at(u), end: at(u) + cell};
      path.set(last, fill);
    }
  }
  for (const [run, fill] of path)
    svg.append(drawn("rect", {x: run.begin, width: run.end - run.begin, y: 0, height: ROW - 2, fill}));
  for (const change of robot.changes) {
    const x = at(robot.units[change[1]]);
    svg.append(drawn("path", {d: `M${x} 0v${ROW - 2}`, stroke: color("--ink"), "stroke-width": 2}));
  }
  return svg;
}

function drawMap() {
  const cell = Math.max(4, Math.min(28, Math.floor(900 / Math.max(1, FLEET.times.length))));
  const body = element("tbody");
  FLEET.robots.slice(0, rows).forEach((robot, i) => {
    const button = element("button", {type: "button", title: robot.name}, robot.name);
    const strips = element("td", {}, strip(robot, cell));
    for (const target of [button, strips]) target.addEventListener("click", () => pick(i));
    body.append(element("tr", {class: i === picked ? "picked" : ""}, element("th", {scope: "row"}, button), strips));
  });
  const ends = FLEET.times.length
    ? `${FLEET.times[0]} to ${FLEET.times[FLEET.times.length - 1]}` : "";
  const head = element("thead", {}, element("tr", {}, element("th", {scope: "col"}, "robot"),
                                            element("th", {scope: "col"}, `${FLEET.time}: ${ends}`)));
  byId("map-area").replaceChildren(element("table", {class: "map", "aria-label": "Robots and time"}, head, body));
  const more = byId("more-robots");
  more.hidden = rows >= FLEET.robots.length;
  more.textContent = `Show all ${FLEET.robots.length}`;
  byId("key-low").textContent = number(range[0], 3);
  byId("key-high").textContent = number(range[1], 3);
  byId("key-bar").style.background = `linear-gradient(90deg,${[0, 0.25, 0.5, 0.75, 1].map(shade).join(",")})`;
}

// One parameter of one robot over time, with its intervals and the changes.
function plot(robot, [index, points]) {
  const name = FLEET.series[index], width = 320, height = 120, left = 8, right = 8, top = 14, bottom = 16;
  const all = points.flatMap((p) => p.slice(1)).filter(known);
  let low = Math.min(...all), high = Math.max(...all);
  if (!(high > low)) [low, high] = [low - Math.abs(low) * 0.1 - 1e-9, high + Math.abs(high) * 0.1 + 1e-9];
  const last = Math.max(1, robot.units.length - 1);
  const x = (i) => left + (width - left - right) * i / last;
  const y = (value) => height - bottom - (height - top - bottom) * (value - low) / (high - low);
  const svg = drawn("svg", {viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${name} over time`});
  for (const p of points) {
    if (p.length > 2 && known(p[2]) && known(p[3]))
      svg.append(drawn("path", {class: "interval", d: `M${x(p[0])} ${y(p[2])}V${y(p[3])}`}));
    svg.append(drawn("circle", {class: "point", cx: x(p[0]), cy: y(p[1]), r: 2.5}));
  }
  for (const change of robot.changes.filter((c) => c[0] === name))
    svg.append(drawn("path", {class: "step", d: `M${x(change[1] - 0.5)} ${top}V${height - bottom}`}));
  const label = (at, text) => svg.append(drawn("text", at, text));
  label({x: left, y: 10}, number(high, 3));
  label({x: left, y: height - bottom}, number(low, 3));
  label({x: left, y: height - 3}, robot.units[0][TIME]);
  label({x: width - right, y: height - 3, "text-anchor": "end"}, robot.units[robot.units.length - 1][TIME]);
  const unit = FLEET.unitOf[index];
  return element("figure", {}, element("figcaption", {}, unit ? `${name} (${unit})` : name), svg);
}

function changeRow(robot, change) {
  const [name, first, before, after, chance] = change;
  return [name, robot.units[first][TIME], {number: number(before)}, {number: number(after)},
          {number: number(chance, 2)}];
}
const CHANGE_HEADS = ["what", "since", {number: "before"}, {number: "after"}, {number: "chance"}];

function drawRobot() {
  const robot = FLEET.robots[picked];
  byId("robot-title").textContent = `Robot ${robot.name}`;
  byId("robot-changes").replaceChildren(robot.changes.length
    ? table("Changes", CHANGE_HEADS, robot.changes.map((c) => changeRow(robot, c)))
    : element("p", {}, "No change."));
  byId("robot-said").replaceChildren(robot.said.length
    ? table("Statements", ["present", {number: "probability, last"}, {number: "units"}],
            robot.said.map(([name, last, present, of]) =>
              [name, {number: percent(last)}, {number: `${present} of ${of}`}]))
    : "");
  const changed = new Set(robot.changes.map((c) => c[0]));
  const sizes = [...robot.sizes].sort((a, b) => changed.has(FLEET.series[b[0]]) - changed.has(FLEET.series[a[0]]));
  byId("robot-sizes").replaceChildren(element("div", {class: "plots"}, ...sizes.map((s) => plot(robot, s))));
  byId("robot-units").replaceChildren(table(
    "Units", [FLEET.time, {number: "nominal error"}, {number: "error left"}, {number: "gap"}, "result"],
    robot.units.map((u) => [
      u[TIME], {number: number(u[NOMINAL])}, {number: number(u[LEFT])}, {number: number(u[GAP], 3)},
      u[PROBLEM] ?? (u[REPORT] ? element("a", {href: u[REPORT]}, "report") : element("code", {}, u[ID])),
    ])));
}

function pick(i, scroll = true) {
  picked = i;
  byId("pick").value = String(i);
  byId("map-area").querySelectorAll("tbody tr").forEach((row, k) => { row.className = k === i ? "picked" : ""; });
  drawRobot();
  if (scroll) byId("robot").scrollIntoView();
}

function drawChanges() {
  const some = FLEET.robots.flatMap((robot, i) => robot.changes.map((change) => {
    const name = element("a", {href: "#robot"}, robot.name);
    name.addEventListener("click", (event) => { event.preventDefault(); pick(i); });
    return [name, ...changeRow(robot, change)];
  }));
  byId("changes").hidden = some.length === 0;
  byId("change-table").replaceChildren(table("Changes", ["robot", ...CHANGE_HEADS], some.slice(0, 200)));
}

function begin() {
  const robots = FLEET.robots, units = robots.flatMap((r) => r.units.map((u) => [r.name, u]));
  const changed = robots.filter((r) => r.changes.length).length, failed = units.filter(([, u]) => u[PROBLEM]);
  byId("subject").textContent = FLEET.experiment;
  byId("title").textContent = changed === 0 ? `None of ${robots.length} robots changed`
    : `${changed} of ${robots.length} robots changed`;
  byId("more").textContent = `${units.length} units, each ${FLEET.what === "tune" ? "tuned" : "diagnosed"} by itself; `
    + `${failed.length} without a result. ${FLEET.version}.`;
  byId("measure").replaceChildren(...MEASURES.map((m, i) => element("option", {value: i}, m.name)));
  byId("measure").addEventListener("change", (e) => { measure = MEASURES[e.target.value]; setRange(); drawMap(); });
  byId("pick").replaceChildren(...robots.map((r, i) => element("option", {value: i}, r.name)));
  byId("pick").addEventListener("change", (event) => pick(Number(event.target.value), false));
  byId("more-robots").addEventListener("click", () => { rows = robots.length; drawMap(); });
  byId("theme").addEventListener("click", () => {
    setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
    drawMap();
  });
  byId("failed").hidden = failed.length === 0;
  if (failed.length)
    byId("failed-table").replaceChildren(table("Without a result", ["robot", FLEET.time, "why"],
      failed.slice(0, 500).map(([name, u]) => [name, u[TIME], u[PROBLEM]])));
  setRange();
  drawChanges();
  drawMap();
  if (robots.length) pick(0, false);
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  byId("theme").textContent = theme === "dark" ? "Light" : "Dark";
}

setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
begin();
