"use strict";
// Traces with linked zoom, residuals below each; frequency responses; the map of the missing torque.

const seriesColor = (label, i) => (label === "measured" ? color("--measured") : color(`--model-${i % 4}`));
let linked = null;  // what Dygraph.synchronize returned
let timeCharts = [];

function chartBox(parent, title, unit, keys, height) {
  const value = element("div", {class: "value", "aria-live": "off"});
  const plot = element("div", {
    class: "plot",
    style: {height: `${height}px`},
    role: "img",
    "aria-label": `${title}${unit ? `, ${unit}` : ""}: ${keys.map((k) => k.label).join(", ")}`,
  });
  const head = element(
    "div",
    {class: "chart-title"},
    element("h3", {}, title),
    unit ? element("span", {class: "note"}, unit) : null,
    ...keys.map((k) => element("span", {class: "key", style: {"--key": k.color}}, k.label)),
  );
  parent.append(element("div", {class: "chart"}, head, plot, value));
  return {plot, value};
}

function drawChart(box, rows, keys, options) {
  const chart = new Dygraph(
    box.plot,
    rows,
    Object.assign(
      {
        labels: ["x", ...keys.map((k) => k.label)],
        colors: keys.map((k) => k.color),
        series: Object.fromEntries(keys.map((k) => [k.label, {strokeWidth: k.width ?? 1.4}])),
        legend: "never",
        gridLineColor: color("--line"),
        axisLineColor: color("--line"),
        axisLabelFontSize: 12,
        highlightCircleSize: 3,
        rightGap: 8,
        connectSeparatedPoints: false,
        axes: {
          y: {axisLabelWidth: 58, axisLabelFormatter: (y) => number(y, 3)},
          x: {axisLabelFormatter: (x) => number(x, 5)},
        },
        highlightCallback: (event, x, points) => {
          if (options.onX) options.onX(x, chart);
          box.value.textContent =
            `${options.xName ?? "time"} ${number(x, 6)}${options.xUnit ?? " s"}   ` +
            points
              .filter((p) => known(p.yval))
              .map((p) => `${p.name} ${number(p.yval, 4)}`)
              .join("   ");
        },
        unhighlightCallback: () => {
          if (options.onX) options.onX(null, chart);
          box.value.textContent = "";
        },
      },
      options.dygraph ?? {},
    ),
  );
  return chart;
}

const predictions = (signal) =>
  signal.predicted.map((p, i) => ({label: p.label, color: seriesColor(p.label, i), values: p.values}));

function addTimeChart({title, unit, keys, time, columns, height, dygraph = {}}) {
  const box = chartBox(document.getElementById("charts"), title, unit, keys, height);
  const chart = drawChart(box, time.map((t, r) => [t, ...columns.map((c) => c[r])]), keys, {dygraph, onX: pointAt});
  chart.time = time;
  timeCharts.push(chart);
}

// The other charts show their row next to that time: each has rows of its own.
let pointing = false;
function pointAt(x, from) {
  if (pointing) return;
  pointing = true;
  for (const chart of timeCharts) {
    if (chart === from) continue;
    if (x === null) chart.clearSelection();
    else chart.setSelection(rowAt(chart.time, x), undefined, undefined, true);
  }
  pointing = false;
}

function rowAt(time, x) {
  let low = 0, high = time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle] <= x) low = middle;
    else high = middle - 1;
  }
  return low + 1 < time.length && time[low + 1] - x < x - time[low] ? low + 1 : low;
}

function drawSignal(signal) {
  const predicted = predictions(signal);
  addTimeChart({
    title: signal.name + (signal.scored ? "" : " (not scored)"),
    unit: signal.unit,
    keys: [{label: "measured", color: color("--measured"), width: 2.6}, ...predicted],
    time: signal.time,
    columns: [signal.measured, ...predicted.map((p) => p.values)],
    height: 190,
  });
  if (!predicted.length) return;
  addTimeChart({
    title: "measured less predicted",
    unit: signal.unit,
    keys: predicted.map(({label, color: c}) => ({label, color: c})),
    time: signal.time,
    columns: predicted.map((p) =>
      p.values.map((v, r) => (known(v) && known(signal.measured[r]) ? signal.measured[r] - v : null))),
    height: 90,
  });
}

// All signals of a log with few; else the one that is picked, with its command.
function drawTraces(log, picked) {
  if (linked) linked.detach();
  timeCharts.forEach((chart) => chart.destroy());
  timeCharts = [];
  document.getElementById("charts").replaceChildren();
  const {signals, commands} = log.traces, many = signals.length > data.few_signals;
  const shown = many ? [signals[picked]] : signals;
  shown.forEach(drawSignal);
  for (const command of commands) {
    if (many && command.number !== shown[0].command) continue;
    addTimeChart({
      title: `command ${command.name}`,
      unit: command.unit,
      keys: [{label: command.name, color: color("--command")}],
      time: command.time,
      columns: [command.values],
      height: 90,
      dygraph: {stepPlot: true},
    });
  }
  if (timeCharts.length > 1) linked = Dygraph.synchronize(timeCharts, {zoom: true, selection: false, range: false});
  const rows = log.quality.rows, drawn = Math.max(...shown.map((s) => s.time.length));
  document.getElementById("thinned").textContent =
    drawn < rows ? `${drawn} of ${rows} rows are drawn: of every stretch the extremes of each trace.` : "";
}

function zoom(how) {
  if (!timeCharts.length) return;
  const chart = timeCharts[0],
    [first, last] = chart.xAxisExtremes(),
    [a, b] = chart.xAxisRange(),
    middle = (a + b) / 2,
    half = (b - a) / 2;
  const ranges = {
    in: [middle - half / 2, middle + half / 2],
    out: [middle - 2 * half, middle + 2 * half],
    left: [a - half, b - half],
    right: [a + half, b + half],
    all: [first, last],
  };
  let [from, to] = ranges[how];
  const width = Math.min(to - from, last - first);
  from = Math.min(Math.max(from, first), last - width);
  chart.updateOptions({dateWindow: how === "all" ? [first, last] : [from, from + width]});
}

// Torque over a joint's angle and speed: what an effect adds, and what is missing without it.
function drawCurves(curves) {
  const parent = document.getElementById("curves");
  parent.replaceChildren();
  if (!curves.length) return;
  show("why");
  for (const curve of curves) {
    const keys = [
      {label: "missing", color: color("--measured"), width: 2.6},
      {label: "what it adds", color: color("--model-1")},
    ];
    const box = chartBox(parent, `${curve.title}: torque over ${curve.over}`, "N m", keys, 160);
    const rows = curve.at.map((x, i) => {
      const missing = [curve.low[i], curve.missing[i], curve.high[i]];
      return [x, missing, [curve.effect[i], curve.effect[i], curve.effect[i]]];
    });
    drawChart(box, rows, keys, {xName: curve.over, xUnit: ` ${curve.unit}`, dygraph: {customBars: true}});
  }
}

function drawResponses(log) {
  const parent = document.getElementById("responses");
  parent.replaceChildren();
  // First: a chart takes its width from the page.
  document.getElementById("response").hidden = log.responses.length === 0;
  for (const response of log.responses) {
    const figure = element("div", {});
    parent.append(element("h3", {}, `${response.signal} over command ${response.command}`), figure);
    const keys = [
      {label: "measured", color: color("--measured"), width: 2.6},
      {label: log.response_of, color: color("--model-0")},
    ];
    const db = (x) => (x > 0 ? 20 * Math.log10(x) : null);
    const x = {
      axes: {
        y: {axisLabelWidth: 58, axisLabelFormatter: (y) => number(y, 3)},
        x: {logscale: true, axisLabelFormatter: (f) => number(f, 2)},
      },
    };
    const gain = chartBox(figure, "gain", "dB", keys, 180);
    const a = drawChart(
      gain,
      response.points.map((p) => [p[0], db(p[1]), db(p[2])]),
      keys,
      {xName: "frequency", xUnit: " Hz", dygraph: x},
    );
    const phase = chartBox(figure, "phase", "degrees; below: frequency, Hz", keys, 150);
    const b = drawChart(
      phase,
      response.points.map((p) => [p[0], p[3], p[4]]),
      keys,
      {xName: "frequency", xUnit: " Hz", dygraph: x},
    );
    Dygraph.synchronize([a, b], {zoom: true, selection: true, range: false});
  }
  if (log.responses.length) parent.append(
    element(
      "p",
      {class: "note"},
      "Where the command has power and the measured signal follows it (square coherence at least 0.5). "
        + "Under feedback both curves are biased alike.",
    ),
  );
}

// Blue: the real mechanism is held back against positive motion; orange: it is driven.
function mapColor(share) {
  const ends = share < 0 ? [31, 102, 179] : [194, 65, 12], strength = Math.min(1, Math.abs(share));
  return `rgb(${ends.map((end) => Math.round(243 + (end - 243) * strength)).join(",")})`;
}

function drawMap(map) {
  const columns = map.angle.length - 1,
    rows = map.speed.length - 1,
    sorted = map.torque
      .filter(known)
      .map(Math.abs)
      .sort((a, b) => a - b);
  if (!sorted.length) return null;
  const most = sorted[Math.floor(0.97 * (sorted.length - 1))] || 1e-12;
  const canvas = element("canvas", {width: columns * 20, height: rows * 20, role: "img",
    "aria-label": `Missing torque on ${map.joint} over angle (across) and speed (up), up to ${number(most, 2)} N m`});
  const draw = canvas.getContext("2d");
  map.torque.forEach((torque, i) => {
    if (!known(torque)) return;
    draw.fillStyle = mapColor(torque / most);
    draw.fillRect((i % columns) * 20, (rows - 1 - Math.floor(i / columns)) * 20, 20, 20);
  });
  const value = element("p", {class: "value"});
  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect(),
      x = Math.floor(((event.clientX - box.left) / box.width) * columns),
      y = rows - 1 - Math.floor(((event.clientY - box.top) / box.height) * rows),
      i = y * columns + x;
    value.textContent = known(map.torque[i])
      ? `angle ${number(map.angle[x], 3)} rad, speed ${number(map.speed[y], 3)} rad/s: `
        + `${number(map.torque[i], 3)} N m (${map.rows[i]} rows)`
      : "no data";
  });
  return element(
    "figure",
    {class: "map"},
    element(
      "figcaption",
      {},
      element("b", {}, map.joint),
      `: torque that the ${data.map_of} lacks, over angle (across) and speed `
        + `(up, ${number(map.speed[0], 3)} to ${number(map.speed[rows], 3)} rad/s)`,
    ),
    canvas,
    element(
      "div",
      {class: "axis"},
      element("span", {}, `${number(map.angle[0], 3)} rad`),
      element("span", {}, `${number(map.angle[columns], 3)} rad`),
    ),
    element(
      "div",
      {class: "scale"},
      element("span", {}, `${number(-most, 2)} N m`),
      element("i", {}),
      element("span", {}, `${number(most, 2)} N m`),
    ),
    value,
  );
}
