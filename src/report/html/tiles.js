"use strict";
// Small pictures of many signals, the worst first. One is drawn when it comes into view; a press picks its signal.

const FIRST_TILES = 12, EXCERPT_S = 8;
let tileWatch = null;

// A name that may be broken after its underlines.
const breakable = (name) => name.split(/(?<=_)/).flatMap((part) => [part, element("wbr")]);

// The rows around the largest error: of a minute nothing could be seen in so small a picture.
function excerpt(signal) {
  const time = signal.time, last = signal.predicted.at(-1)?.values;
  let worst = 0, most = -1;
  signal.measured.forEach((m, r) => {
    const error = last && known(m) && known(last[r]) ? Math.abs(m - last[r]) : -1;
    if (error > most) [worst, most] = [r, error];
  });
  const begin = Math.max(time[0], Math.min(time[worst] - EXCERPT_S / 2, time.at(-1) - EXCERPT_S));
  return [rowAt(time, begin), rowAt(time, begin + EXCERPT_S) + 1];
}

function paintTile(canvas, signal) {
  const scale = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * scale;
  canvas.height = height * scale;
  const rows = excerpt(signal), time = signal.time.slice(...rows), measured = signal.measured.slice(...rows);
  const draw = canvas.getContext("2d"), first = time[0], length = time.at(-1) - first || 1;
  const lines = [{color: color("--measured"), values: measured, width: 2.4}];
  for (const p of predictions(signal)) lines.push({...p, values: p.values.slice(...rows)});
  // What runs away does not squeeze the measured trace.
  const own = measured.filter(known), low = Math.min(...own), high = Math.max(...own);
  const room = 0.25 * (high - low) || 1, y = (v) => ((high + room - v) / (high - low + 2 * room)) * height;
  draw.scale(scale, scale);
  for (const line of lines) {
    draw.strokeStyle = line.color;
    draw.lineWidth = line.width ?? 1.2;
    draw.beginPath();
    let down = false;
    line.values.forEach((v, r) => {
      if (!known(v)) return void (down = false);
      const x = ((time[r] - first) / length) * width;
      if (down) draw.lineTo(x, y(v));
      else draw.moveTo(x, y(v));
      down = true;
    });
    draw.stroke();
  }
}

function drawTiles(log, picked, pick) {
  const {signals} = log.traces, many = signals.length > data.few_signals;
  const place = document.getElementById("tiles"), more = document.getElementById("more-tiles");
  document.getElementById("all-signals").hidden = !many;
  if (tileWatch) tileWatch.disconnect();
  if (!many) return place.replaceChildren();
  document.getElementById("tiles-title").textContent =
    `All ${signals.length} signals, the worst first`;
  const all = place.childElementCount > FIRST_TILES;
  tileWatch = new IntersectionObserver(
    (seen) => seen.filter((e) => e.isIntersecting).forEach(({target}) => {
      paintTile(target, signals[target.dataset.signal]);
      tileWatch.unobserve(target);
    }),
    {rootMargin: "200px"},
  );
  const add = (from, to) => {
    signals.slice(from, to).forEach((signal, k) => {
      const canvas = element("canvas", {"data-signal": from + k, "aria-hidden": "true"});
      const tile = element(
        "button",
        {type: "button", class: "tile", "aria-pressed": String(from + k === picked)},
        element("span", {class: "name"}, ...breakable(signal.name)),
        element("span", {class: "error"}, number(signal.error, 2)),
        canvas,
      );
      tile.addEventListener("click", () => pick(from + k));
      place.append(tile);
      tileWatch.observe(canvas);
    });
    more.hidden = place.childElementCount >= signals.length;
  };
  place.replaceChildren();
  add(0, all ? signals.length : FIRST_TILES);
  more.textContent = `Show all ${signals.length}`;
  more.onclick = () => add(place.childElementCount, signals.length);
}
