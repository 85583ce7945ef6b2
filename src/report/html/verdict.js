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
          element("span", {}, "Confidence in this verdict"),
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
