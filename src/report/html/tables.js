"use strict";
// Conditions, candidates, parameters, data quality, provenance.

const shareBar = (share, mark, kind = "") => element("div", {class: "bar", "aria-hidden": "true"}, element("span", {class: kind, style: {width: `${Math.min(100, 100 * share)}%`}}),
  known(mark) ? element("i", {style: {left: `${Math.min(99, 100 * mark)}%`}}) : null);

function conditionTable(caption, shares, all) {
  const telling = shares.filter((w) => known(w.share_of_error)).map((w) => ({...w, excess: (w.low ?? w.share_of_error) - (w.share_of_time ?? 0)})).filter((w) => all || (w.excess > 0 && w.share_of_error > 0.1))
    .sort((a, b) => b.excess - a.excess).slice(0, 10);
  if (!telling.length) return null;
  return table(caption, ["signal", "condition", {number: "of the error"}, "bar: of the error; mark: of the time", {number: "of the time"}, "90 % interval"],
    telling.map((w) => [w.signal, w.condition, {number: percent(w.share_of_error)}, shareBar(w.share_of_error, w.share_of_time, "share"), {number: percent(w.share_of_time)},
      known(w.low) && known(w.high) ? `${percent(w.low)} to ${percent(w.high)}` : "–"]));
}

function writeConditions(result) {
  const parts = [conditionTable("Shares of the error by condition", result.where ?? result.logs?.[0]?.where ?? [], Boolean(result.where))];
  if (result.verdict === "unknown" && result.effects.length) {
    const left = conditionTable("Shares of what remains by condition", result.remains ?? [], true);
    if (left) parts.push(element("h3", {}, `Of what ${listed(result.effects.map(place))} ${result.effects.length > 1 ? "leave" : "leaves"}`), left);
  }
  document.getElementById("conditions").append(...parts.filter(Boolean));
  return parts.some(Boolean);
}

function writeCandidates(result) {
  if (!result.candidates?.length) return;
  const rows = [...result.candidates].sort((a, b) => (b.probability ?? 0) - (a.probability ?? 0));
  const cells = rows.slice(0, 24).map((c) => [place(c), {number: percent(c.probability)}, shareBar(c.probability ?? 0), {number: number(c.held_out_error, 3)}, c.reason ?? ""]);
  document.getElementById("candidate-table").append(table("Candidates", ["explanation", {number: "probability"}, "", {number: "held-out error"}, "why, or why not"], cells));
  if (rows.length > 24) document.getElementById("candidate-table").append(element("p", {class: "note"}, `${rows.length - 24} more, less likely ones are in result.json.`));
  show("candidates");
}

// Bounds as a line, the nominal value as a mark, the value with its interval as a dot on a bar.
function rangePicture(p) {
  if (!known(p.low) || !known(p.high) || !(p.high > p.low)) return "";
  const log = p.low > 0 && p.high / p.low > 20, scale = (x) => (log ? Math.log(x) : x);
  const x = (v) => Math.min(198, Math.max(2, 4 + (192 * (scale(Math.max(v, log ? p.low : -Infinity)) - scale(p.low))) / (scale(p.high) - scale(p.low))));
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 200 24");
  svg.setAttribute("class", "range");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", `bounds ${number(p.low, 3)} to ${number(p.high, 3)}${log ? ", logarithmic" : ""}; nominal ${number(p.nominal, 3)}; value ${number(p.value, 3)}`);
  const part = (tag, attributes) => { const made = document.createElementNS("http://www.w3.org/2000/svg", tag); Object.entries(attributes).forEach(([k, v]) => made.setAttribute(k, v)); svg.append(made); };
  part("line", {x1: 4, x2: 196, y1: 12, y2: 12, stroke: "var(--line)", "stroke-width": 4, "stroke-linecap": "round"});
  if (known(p.from) && known(p.to)) part("line", {x1: x(p.from), x2: x(p.to), y1: 12, y2: 12, stroke: "var(--accent)", "stroke-width": 6, "stroke-opacity": .55});
  if (known(p.nominal)) part("line", {x1: x(p.nominal), x2: x(p.nominal), y1: 3, y2: 21, stroke: "var(--faint)", "stroke-width": 2});
  if (known(p.value)) part("circle", {cx: x(p.value), cy: 12, r: 5, fill: "var(--accent)"});
  return svg;
}

function parametersOf(result, declared) {
  const bounds = Object.fromEntries(declared.map((p) => [p.name, p])), fitted = {};
  if (Array.isArray(result.parameters)) {
    for (const p of result.parameters) fitted[p.name] = {value: p.value, from: p.identifiable === false ? null : p.low, to: p.identifiable === false ? null : p.high, at_bound: p.at_bound, open: p.identifiable === false};
  }
  for (const effect of Array.isArray(result.effects) ? result.effects : []) {
    for (const [key, v] of Object.entries(effect.parameters ?? {})) fitted[`${effect.name}@${effect.on}.${key}`] = {value: v.value, from: v.low, to: v.high};
  }
  const values = result.model?.values ?? {};
  const names = [...new Set([...Object.keys(fitted), ...declared.map((p) => p.name)])];
  return names.map((name) => ({name, unit: bounds[name]?.unit ?? "", doc: bounds[name]?.doc, nominal: bounds[name]?.nominal, low: bounds[name]?.low, high: bounds[name]?.high, frozen: bounds[name]?.frozen,
    value: fitted[name]?.value ?? values[name], from: fitted[name]?.from, to: fitted[name]?.to, at_bound: fitted[name]?.at_bound, open: fitted[name]?.open, fitted: name in fitted}));
}

function writeParameters(result, declared) {
  const all = parametersOf(result, declared).filter((p) => known(p.value) && (!p.frozen || p.fitted));
  if (!all.length) return;
  const rows = all.map((p) => {
    const notes = [p.open ? element("span", {class: "tag warn"}, "not known alone") : null, p.at_bound ? element("span", {class: "tag warn"}, "at its bound") : null];
    const interval = p.open || !known(p.from) ? "–" : `${number(p.from)} to ${number(p.to)}`;
    return [element("code", {title: p.doc ?? ""}, p.name), {number: number(p.nominal)}, {number: number(p.value)}, interval, p.unit, rangePicture(p), element("span", {}, ...notes)];
  });
  document.getElementById("parameter-table").append(table("Parameters", ["parameter", {number: "nominal"}, {number: "value"}, "95 % interval", "unit", "dot: value; mark: nominal; line: bounds", ""], rows));
  const notes = [...new Set((result.flat ?? []).map((f) => f.text)), ...(result.correlated ?? []).map((c) => `${listed(c.parameters)} go together (correlation ${number(c.correlation, 3)})`)];
  document.getElementById("parameter-notes").append(...notes.map((note) => element("li", {}, note)));
  show("parameters");
}

function writeNext(result) {
  const next = result.next_experiment;
  if (!next?.command) return;
  document.getElementById("next-text").append(element("p", {}, next.separates?.length ? `It tells ${listed(next.separates.map(words), "from")} apart.` : "It would tell more about what is left."), element("pre", {}, next.command));
  show("next");
}

function writeQuality(logs) {
  const rows = logs.map((log) => {
    const q = log.quality, rate = q.step_s > 0 ? 1 / q.step_s : null;
    const findings = q.findings.length ? element("ul", {}, ...q.findings.map((f) => element("li", {}, f))) : element("span", {class: "tag good"}, "nothing to report");
    return [element("code", {}, fileName(log.path)), log.held_out ? element("span", {class: "tag"}, "held out") : "", {number: String(q.rows)}, {number: `${number(q.duration_s)} s`}, {number: `${number(rate)} Hz`},
      {number: `${number(1e3 * q.jitter_s, 3)} ms`}, findings];
  });
  document.getElementById("quality").append(table("Data quality", ["log", "", {number: "rows"}, {number: "length"}, {number: "rate"}, {number: "jitter"}, "findings and repairs"], rows));
  show("data");
}

function writeProvenance(data) {
  const result = data.result, versions = result.versions ?? {};
  const list = element("dl", {});
  const add = (term, ...content) => list.append(element("dt", {}, term), element("dd", {}, ...content));
  add("versions", `gapscope ${versions.gapscope ?? "?"}, MuJoCo ${versions.mujoco ?? "?"}`);
  add("seed", String(result.seed ?? 0));
  const file = (f) => element("code", {}, `${f.path} `, element("br"), `sha256 ${f.sha256}`);
  add("experiment", file(data.experiment));
  add("model", file(data.model));
  for (const log of data.logs) add(log.held_out ? "log, held out" : "log", file(log));
  const parts = [list];
  if (data.command) parts.unshift(element("pre", {}, data.command));
  parts.push(element("p", {class: "note"}, "Charts: dygraphs 2.2, MIT licence."));
  document.getElementById("provenance").append(...parts);
}
