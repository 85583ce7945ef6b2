"use strict";
// The result in a sentence, and the way the error went as a picture.

function replayVerdict(result) {
  const error = result.error;
  const diverged = result.logs.filter((log) => log.outcome === "diverged").length;
  const worst = result.logs.flatMap((log) => Object.entries(log.signals).map(([name, s]) => ({name, log: log.log, nrmse: s.nrmse}))).sort((a, b) => (b.nrmse ?? Infinity) - (a.nrmse ?? Infinity))[0];
  const effects = (result.effects ?? []).map(place);
  const model = effects.length ? `The model with ${listed(effects)}` : "The model";
  const how = diverged ? "runs away" : error < 0.05 ? "follows the measured motion closely" : error < 0.2 ? "follows the measured motion" : error < 0.6 ? "is clearly off the measured motion" : "hardly follows the measured motion";
  const more = [`Error ${number(error, 3)}: root mean square of measured less predicted, over the motion's own spread.`];
  if (worst && known(worst.nrmse)) more.push(`Largest in ${worst.name} (${number(worst.nrmse, 3)}).`);
  const windows = result.error_windows, free = result.error_free_run;
  if (known(windows)) more.push(`In windows that each start from the log it is ${number(windows, 3)}.`);
  if (known(free)) more.push(`In one free run over the log it is ${number(free, 3)}.`);
  const stages = known(result.error_nominal) ? [{name: "nominal", error: result.error_nominal, kind: ""}, {name: effects.length ? `with ${listed(effects)}` : "with the values given", error, kind: error < result.error_nominal ? "best" : ""}] : [];
  return {title: `${model} ${how}.`, more: more.join(" "), stages, probability: null};
}

function tuneVerdict(result) {
  const {nominal, train, held_out} = result.error;
  const count = result.parameters.length, open = result.parameters.filter((p) => !p.identifiable).length;
  const gain = nominal > 0 ? 1 - held_out / nominal : NaN;
  const title = gain > 0.05 ? `Tuning ${count} parameters cuts the held-out error by ${percent(gain)}.` : `Tuning ${count} parameters does not help on held-out data.`;
  const more = [`From ${number(nominal, 3)} to ${number(held_out, 3)} on data that the fit did not see (${result.held_out_by}); ${number(train, 3)} on what it saw.`];
  if (open) more.push(`${open} of them cannot be known from these logs alone.`);
  if (result.starts_agree === false) more.push("The starting points end in different places: a better fit may exist.");
  return {title, more: more.join(" "), stages: [{name: "nominal", error: nominal, kind: ""}, {name: "tuned", error: held_out, kind: "best"}], probability: null};
}

function diagnosisVerdict(result) {
  const found = result.effects.map(place), gap = result.gap;
  const titles = {
    none: "Nothing is missing: the model explains these logs down to what the sensors can show.",
    parameters: "No effect is missing: other parameter values close the gap.",
    effects: `The model lacks ${listed(found)}.`,
    ambiguous: `The model lacks ${listed((result.ambiguous ?? []).map((group) => listed(group.map(words), "or")))}: these logs cannot tell which.`,
    unknown: found.length ? `The model lacks ${listed(found)}, and something that no known effect explains.` : "Something is missing that no known effect explains.",
  };
  const more = [`Held-out error ${number(gap.nominal, 3)} with nominal parameters, ${number(gap.refit, 3)} with the best parameters, ${number(gap.final, 3)} with what was found.`];
  if (known(gap.closed) && result.verdict !== "none") more.push(`That closes ${percent(gap.closed)} of the gap down to the floor of ${number(gap.floor, 3)}.`);
  const stages = [{name: "nominal", error: gap.nominal, kind: ""}, {name: "best parameters", error: gap.refit, kind: ""}];
  result.effects.forEach((effect, i) => {
    const last = i === result.effects.length - 1;
    stages.push({name: `with ${place(effect)}`, error: last && known(gap.final) ? gap.final : effect.error_after, kind: last ? "best" : "", share: effect.share_of_gap});
  });
  if (!result.effects.length && known(gap.final) && gap.final !== gap.refit) stages.push({name: "final", error: gap.final, kind: "best"});
  stages.push({name: "floor of the sensors", error: gap.floor, kind: "floor"});
  return {title: titles[result.verdict] ?? result.verdict, more: more.join(" "), stages, probability: result.probability, explanation: result.explanation};
}

function chainPicture(stages) {
  const shown = stages.filter((s) => known(s.error)), most = Math.max(...shown.map((s) => s.error), 1e-12);
  const items = shown.map((stage, i) => {
    const part = `${Math.max(1, (100 * stage.error) / most)}%`;
    const before = i > 0 ? shown[i - 1].error : null;
    const change = before && stage.kind !== "floor" ? stage.error / before - 1 : null;
    const drop = change === null || Math.abs(change) < 0.005 ? null : change < -0.9 ? `${number(before / stage.error, 2)} times smaller` : `${change < 0 ? "−" : "+"}${Math.round(100 * Math.abs(change))} %`;
    return element("li", {class: stage.kind, style: {"--part": part}},
      element("div", {class: "column", "aria-hidden": "true"}, element("span", {style: {height: part}})),
      element("div", {class: "what"}, element("b", {class: "number"}, number(stage.error, 3)), element("br"), stage.name,
        element("span", {class: "drop"}, [drop, known(stage.share) ? `${percent(stage.share)} of the gap` : null].filter(Boolean).join(", "))));
  });
  return element("ol", {class: "chain", "aria-label": "Error, step by step"}, ...items);
}

function writeVerdict(result) {
  const makers = {"gapscope.replay/1": replayVerdict, "gapscope.tune/1": tuneVerdict, "gapscope.diagnosis/1": diagnosisVerdict};
  const verdict = makers[result.schema](result);
  document.getElementById("verdict-title").textContent = verdict.title;
  document.getElementById("verdict-more").textContent = verdict.more;
  document.title = `${verdict.title} - gapscope`;
  if (known(verdict.probability)) {
    document.getElementById("confidence").append(element("div", {class: "meter"}, element("span", {}, "Confidence in this verdict"),
      element("div", {class: "bar", "aria-hidden": "true"}, element("span", {style: {width: percent(verdict.probability).replace(" ", "")}})), element("b", {class: "number"}, percent(verdict.probability))));
  }
  if (verdict.explanation) document.getElementById("explanation").textContent = verdict.explanation;
  if (verdict.stages.length > 1) document.getElementById("chain").append(chainPicture(verdict.stages));
}
