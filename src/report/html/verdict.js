"use strict";
// The result in a sentence, and the way the error went as a picture. All words come from the program.

function chainPicture(stages) {
  const most = Math.max(...stages.map((s) => s.error), 1e-12);
  const items = stages.map((stage) => {
    const part = `${Math.max(1, (100 * stage.error) / most)}%`;
    return element(
      "li",
      {class: stage.mark, style: {"--part": part}},
      element("div", {class: "column", "aria-hidden": "true"}, element("span", {style: {height: part}})),
      element(
        "div",
        {class: "what"},
        element("b", {class: "number"}, number(stage.error, 3)),
        element("br"),
        stage.name,
        element("span", {class: "drop"}, stage.change),
      ),
    );
  });
  return element("ol", {class: "chain", "aria-label": "Error, step by step"}, ...items);
}

function writeVerdict(headline) {
  document.getElementById("verdict-title").textContent = headline.title;
  document.getElementById("verdict-more").textContent = headline.sentences.join(" ");
  document.title = `${headline.title} - gapscope`;
  if (known(headline.confidence)) {
    document
      .getElementById("confidence")
      .append(
        element(
          "div",
          {class: "meter"},
          element("span", {}, headline.confidence_in),
          element(
            "div",
            {class: "bar", "aria-hidden": "true"},
            element("span", {style: {width: percent(headline.confidence).replace(" ", "")}}),
          ),
          element("b", {class: "number"}, percent(headline.confidence)),
        ),
      );
  }
  document.getElementById("explanation").textContent = headline.explanation;
  if (headline.stages.length > 1) document.getElementById("chain").append(chainPicture(headline.stages));
}

// A line a finding: what, how large, how sure.
function writeFindings(findings, gap) {
  const line = (f) => {
    const rest = [f.size, `${percent(f.share)} of what closes`, f.caveat].filter(Boolean).join(", ");
    const apart = f.told_apart ? [element("br"), f.told_apart] : [];
    return element(
      "li",
      {},
      element("b", {class: "number sure", title: "probability that it is there"}, percent(f.probability)),
      element("span", {}, element("strong", {}, f.what), element("br"), rest, ...apart),
    );
  };
  document.getElementById("findings").append(...findings.map(line));
  document.getElementById("gap").textContent = gap;
  document.getElementById("findings").hidden = !findings.length;
  document.getElementById("gap").hidden = !gap;
}

// Whose the misfit is that the retuned model leaves, as one bar; the mark is what a free-form torque would explain.
function writeRemainder(parts, reachable) {
  if (!parts.length) return;
  const kind = (part) => part.name.replace(" ", "-");
  const wide = (share) => `${Math.max(0, 100 * share)}%`;
  const bar = element(
    "div",
    {class: "parts", "aria-hidden": "true"},
    ...parts.map((part) => element("span", {class: kind(part), style: {width: wide(part.share)}})),
    known(reachable) ? element("i", {style: {left: wide(Math.min(0.995, reachable))}}) : null,
  );
  const keys = parts.map((part) => element("li", {class: kind(part)}, `${part.name} ${percent(part.share)}`));
  if (known(reachable)) keys.push(element("li", {class: "mark"}, `a free-form torque: ${percent(reachable)}`));
  document
    .getElementById("remainder")
    .append(
      element("h2", {}, "Whose the retuned model's misfit is"),
      bar,
      element("ul", {class: "parts-key", "aria-label": "Shares of the squared misfit"}, ...keys),
    );
}
