"use strict";
// Conditions, statements, parameters, data quality, provenance.

const shareBar = (share, mark, kind = "") =>
  element(
    "div",
    {class: "bar", "aria-hidden": "true"},
    element("span", {class: kind, style: {width: `${Math.min(100, 100 * share)}%`}}),
    known(mark) ? element("i", {style: {left: `${Math.min(99, 100 * mark)}%`}}) : null,
  );

function conditionTable(shares) {
  return table(
    "Shares of the error by condition",
    [
      "signal",
      "condition",
      {number: "of the error"},
      "bar: of the error; mark: of the time",
      {number: "of the time"},
      "90 % interval",
    ],
    shares.map((w) => [
      w.signal,
      w.condition,
      {number: percent(w.share_of_error)},
      shareBar(w.share_of_error, w.share_of_time, "share"),
      {number: percent(w.share_of_time)},
      known(w.low) && known(w.high) ? `${percent(w.low)} to ${percent(w.high)}` : "–",
    ]),
  );
}

function writeConditions(where) {
  const parts = where.flatMap(({title, shares}) => [title ? element("h3", {}, title) : null, conditionTable(shares)]);
  document.getElementById("conditions").append(...parts.filter(Boolean));
  if (where.length) show("where");
}

// Words and numbers as the program wrote them: the first cell names its row; of the others what begins with a digit or
// a sign stands to the right.
function writeTables(tables) {
  const cell = (text, i) => (i > 0 && /^[-+−]?[0-9]/.test(text) ? {number: text} : text);
  for (const {title, heads, rows, note} of tables) {
    show("tables").append(
      element("h2", {}, title),
      table(title, heads.map((h, i) => (rows[0] && typeof cell(rows[0][i], i) === "object" ? {number: h} : h)),
        rows.map((row) => row.map(cell))),
      note ? element("p", {class: "note"}, note) : "",
    );
  }
}

const answerTag = (answer) =>
  element("span", {class: `tag ${answer === "present" ? "good" : answer === "unseen" ? "warn" : ""}`}, answer);

// The likeliest; the others, of which a robot of many joints has hundreds, unfold.
function writeStatements(statements) {
  const most = 40;
  if (!statements.length) return;
  const cells = statements.map((s) => [
    s.title,
    answerTag(s.answer),
    {number: percent(s.probability)},
    shareBar(s.probability ?? 0, s.prior),
    ...[0, 1, 2].map((i) => ({number: s.gains ? number(s.gains[i], 2) : "–"})),
    {number: s.bound || "–"},
    s.why,
  ]);
  const heads = [
    "effect",
    "answer",
    {number: "probability"},
    "mark: prior",
    {number: "gain"},
    {number: "held out"},
    {number: "free run"},
    {number: "size, at most"},
    "why, or why not",
  ];
  const place = document.getElementById("statement-table");
  place.append(table("Statements", heads, cells.slice(0, most)));
  if (cells.length > most) {
    place.append(
      element("details", {}, element("summary", {}, `${cells.length - most} more, less likely`),
        table("More statements", heads, cells.slice(most))),
    );
  }
  place.append(
    element(
      "p",
      {class: "note"},
      "Gain: logarithm of the cost without the effect over the cost with it, all else refitted; on the fitted logs, on "
        + "logs held out, and over whole logs. Size, at most: with 95 % probability, of what is absent (of a limit "
        + "or a compliance: at least). Unseen: these logs cannot tell, for the reason in the last column.",
    ),
  );
  show("statements");
}

// Bounds as a line, the nominal value as a mark, the value with its interval as a dot on a bar.
function rangePicture(p) {
  if (!known(p.low) || !known(p.high) || !(p.high > p.low)) return "";
  const log = p.low > 0 && p.high / p.low > 20, scale = (x) => (log ? Math.log(x) : x);
  const x = (v) =>
    Math.min(
      198,
      Math.max(
        2,
        4 + (192 * (scale(Math.max(v, log ? p.low : -Infinity)) - scale(p.low))) / (scale(p.high) - scale(p.low)),
      ),
    );
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 200 24");
  svg.setAttribute("class", "range");
  svg.setAttribute("role", "img");
  svg.setAttribute(
    "aria-label",
    `bounds ${number(p.low, 3)} to ${number(p.high, 3)}${log ? ", logarithmic" : ""}; `
      + `nominal ${number(p.nominal, 3)}; value ${number(p.value, 3)}`,
  );
  const part = (tag, attributes) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    Object.entries(attributes).forEach(([k, v]) => made.setAttribute(k, v));
    svg.append(made);
  };
  part("line", {x1: 4, x2: 196, y1: 12, y2: 12, stroke: "var(--line)", "stroke-width": 4, "stroke-linecap": "round"});
  if (known(p.from) && known(p.to)) part("line", {
    x1: x(p.from),
    x2: x(p.to),
    y1: 12,
    y2: 12,
    stroke: "var(--accent)",
    "stroke-width": 6,
    "stroke-opacity": 0.55,
  });
  if (known(p.nominal)) {
    part("line", {x1: x(p.nominal), x2: x(p.nominal), y1: 3, y2: 21, stroke: "var(--faint)", "stroke-width": 2});
  }
  if (known(p.value)) part("circle", {cx: x(p.value), cy: 12, r: 5, fill: "var(--accent)"});
  return svg;
}

const FIRST_PARAMETERS = 24;
function writeParameters(parameters, notes) {
  if (!parameters.length) return;
  const rows = parameters.map((p) => {
    const open = p.identifiable === false;
    const tags = [
      open ? element("span", {class: "tag warn"}, "not known alone") : null,
      p.at_bound ? element("span", {class: "tag warn"}, "at its bound") : null,
    ];
    const interval = known(p.from) ? `${number(p.from)} to ${number(p.to)}` : "–";
    return [
      element("code", {title: p.doc ?? ""}, p.name),
      {number: number(p.nominal)},
      {number: number(p.value)},
      interval,
      p.unit,
      rangePicture(p),
      element("span", {}, ...tags),
    ];
  });
  const heads = [
    "parameter",
    {number: "nominal"},
    {number: "value"},
    "95 % interval",
    "unit",
    "dot: value; mark: nominal; line: bounds",
    "",
  ];
  const place = document.getElementById("parameter-table");
  place.append(table("Parameters", heads, rows.slice(0, FIRST_PARAMETERS)));
  if (rows.length > FIRST_PARAMETERS) {
    const more = table("More parameters", heads, rows.slice(FIRST_PARAMETERS));
    place.append(
      element("details", {}, element("summary", {}, `${rows.length - FIRST_PARAMETERS} more parameters`), more));
  }
  document.getElementById("parameter-notes").append(...notes.map((note) => element("li", {}, note)));
  show("parameters");
}

function writeNext(next) {
  if (!next.text) return;
  const text = document.getElementById("next-text");
  text.append(element("p", {}, next.text));
  if (next.command) text.append(element("pre", {}, next.command));
  show("next");
}

function writeQuality(logs) {
  const rows = logs.map((log) => {
    const q = log.quality, rate = q.step_s > 0 ? 1 / q.step_s : null;
    const findings = q.findings.length
      ? element("ul", {}, ...q.findings.map((f) => element("li", {}, f)))
      : element("span", {class: "tag good"}, "nothing to report");
    return [
      element("code", {}, logName(log)),
      log.held_out ? element("span", {class: "tag"}, log.held_out) : "",
      {number: String(q.rows)},
      {number: `${number(q.duration_s)} s`},
      {number: `${number(rate)} Hz`},
      {number: `${number(1e3 * q.jitter_s, 3)} ms`},
      findings,
    ];
  });
  document
    .getElementById("quality")
    .append(
      table(
        "Data quality",
        ["log", "", {number: "rows"}, {number: "length"}, {number: "rate"}, {number: "jitter"}, "findings and repairs"],
        rows,
      ),
    );
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
  for (const log of data.logs) add(log.held_out ? `log, ${log.held_out}` : "log", file(log));
  const parts = [list];
  if (data.command) parts.unshift(element("pre", {}, data.command));
  parts.push(element("p", {class: "note"}, "Charts: dygraphs 2.2, MIT licence."));
  document.getElementById("provenance").append(...parts);
}
