"""Scores the statements of verdicts (contract.md, additions to diagnosis/1) against sealed labels: which effects are
told as present, whether they are, with what probability, interval and bound. A verdict without statements is read from
its `effects` and `ambiguous`.

Effects told together (the same `group`) are one finding: it counts once, is true where one member is true, and has the
largest probability of its members. The same effect on another place is another effect, and false."""
import math
from dataclasses import dataclass, field

import score

SURE = 0.5
NO_SIZE = ("rest", "periods", "phase")  # an offset's zero moves the first; the others are no sizes
SMALLER_IS_MORE = ("limit", "power", "ceiling")  # of these a bound is the least that it can be


@dataclass
class Finding:
    statements: list
    probability: float
    true: bool
    names: list = field(default_factory=list)


def told(verdict):
    """The verdict's statements."""
    if "statements" in verdict:
        return verdict["statements"]
    listed = [{**e, "answer": "present", "group": None} for e in verdict["effects"]]
    for number, group in enumerate(verdict["ambiguous"], 1):
        for name in sorted(group):
            entry = next((e for e in listed if e["name"] == name), None)
            if entry is None:  # where it was tried with most success
                tried = [c for c in verdict["candidates"] if c["name"] == name]
                best = max(tried, key=lambda c: c.get("probability") or 0, default={})
                entry = {"name": name, "on": best.get("on"), "answer": "present", "parameters": {}}
                listed.append(entry)
            entry.update(group=number, probability=verdict["probability"])
    return listed


def findings(case):
    """What is told as present, in the verdict's order, groups together."""
    found, groups = [], {}
    for s in told(case.verdict):
        if s["answer"] != "present":
            continue
        group = s.get("group")
        if group is not None and group in groups:
            finding = groups[group]
        else:
            finding = Finding([], 0.0, False)
            found.append(finding)
            if group is not None:
                groups[group] = finding
        finding.statements.append(s)
        finding.names.append((s["name"], s["on"]))
        finding.probability = max(finding.probability, s["probability"] or 0.0)
        finding.true = finding.true or finding.names[-1] in case.truth
    order = {(e["name"], e["on"]): i for i, e in enumerate(case.verdict["effects"])}
    return sorted(found, key=lambda f: min(order.get(n, len(order)) for n in f.names))


class Judged:
    """One case with what was told of it."""

    def __init__(self, case):
        self.case, self.all = case, findings(case)
        self.sure = [f for f in self.all if f.probability >= SURE]
        self.false = [f for f in self.sure if not f.true]
        self.clear = [t for t, e in zip(case.truth, case.label["effects"]) if stands_clear(case, e)]
        self.outside = case.label.get("outside", {}).get("name", "")

    def named(self, effect):
        return any(effect in f.names for f in self.sure)

    def first_right(self):
        return bool(self.sure) and self.sure[0].true

    def exact(self):
        return not self.false and all(self.named(e) for e in self.case.truth)

    def right(self):
        """Nothing false, all that stands clear named, and the verdict says so."""
        if self.false or not all(self.named(e) for e in self.clear):
            return False
        if not self.case.truth:
            return self.case.answer in self.case.label["expected_verdicts"]
        return self.case.answer in ("effects", "ambiguous") or not self.clear


def stands_clear(case, effect):
    """By the label's oracle (tests/twin/README.md) and visible in the logs that the program was given."""
    logs = effect.get("effect_to_floor_logs", [math.inf])[:len(score.given(case.label["logs"]))]
    shows = min(effect["effect_to_floor_refit"], max(logs)) >= score.STRONG
    return shows and not score.below_a_sample(case.label, effect) and effect.get("stands_clear", True)


def at_told_peak(effect, statement):
    """The effect's parameters; of a droop the loss at the peak torque that the statement is about."""
    true = effect["parameters"]
    of = (statement.get("with") or {}).get("values", {})
    scale = f"scale@{statement['on']}."
    peak = of.get(scale + "peak_n_m", of.get(scale + "torque_n_m"))
    twin = effect.get("twin_parameters", {})
    if "loss_at_peak" not in true or not peak or "peak_n_m" not in twin:
        return true
    return {**true, "loss_at_peak": true["loss_at_peak"] * (peak / twin["peak_n_m"]) ** twin["exponent"]}


def sizes(judged):
    """(true value, found entry) of every parameter of what is told surely and is true."""
    for j in judged:
        truth = {(e["name"], e["on"]): e for e in j.case.label["effects"]}
        for s in (s for f in j.sure for s in f.statements if (s["name"], s["on"]) in truth):
            for key, value in at_told_peak(truth[s["name"], s["on"]], s).items():
                entry = (s.get("parameters") or {}).get(key)
                if value and entry and entry.get("value") is not None and not any(n in key for n in NO_SIZE):
                    yield value, entry


def weighed(case):
    """(statement, whether it is true) of all that was judged by its `numbers`, present or absent; what is told together
    once, by its likeliest."""
    for finding in findings(case):
        best = max(finding.statements, key=lambda s: s["probability"] or 0)
        if best.get("numbers"):
            yield best, finding.true
    for s in told(case.verdict):
        if s["answer"] == "absent" and s.get("numbers"):
            yield s, (s["name"], s["on"]) in case.truth


def within_bound(case, statement):
    """Whether an effect told as absent is absent, or smaller than the bound."""
    truth = next((e["parameters"] for e in case.label["effects"]
                  if (e["name"], e["on"]) == (statement["name"], statement["on"])), None)
    if truth is None:
        return True

    def below(key, bound):
        less = any(n in key for n in SMALLER_IS_MORE) or (statement["name"] == "joint_compliance" and "stiff" in key)
        return abs(truth[key]) >= abs(bound) if less else abs(truth[key]) <= abs(bound)
    bounds = {k: b for k, b in (statement.get("bound") or {}).items() if k in truth and b is not None}
    return bool(bounds) and all(below(k, b) for k, b in bounds.items())


def calibration(pairs, bins=5):
    """Calibration error of (probability, truth), and per bin of equal count: stated, true, count."""
    ranked, rows, error = sorted(pairs), [], 0.0
    for b in range(bins):
        part = ranked[b * len(ranked) // bins:(b + 1) * len(ranked) // bins]
        if part:
            stated, true = sum(p for p, _ in part) / len(part), sum(t for _, t in part) / len(part)
            rows.append({"stated": stated, "right": true, "cases": len(part)})
            error += abs(stated - true) * len(part) / len(ranked)
    return (error if ranked else math.nan), rows


def figures(cases, seed):
    judged = [Judged(c) for c in cases if c.kind != "ambiguous"]  # there the group is built, and no effect the truth
    empty = [j for j in judged if not j.case.truth]
    held = [j for j in judged if j.clear]
    two = [j for j in judged if len(j.case.truth) == 2 and len(j.clear) == 2]
    sure = [f for j in judged for f in j.sure]
    pairs = [(f.probability, f.true) for j in judged for f in j.all]
    found = list(sizes(judged))
    spans = [(v, e) for v, e in found if e.get("low") is not None and e.get("high") is not None]
    absent = [(j.case, s) for j in judged for s in told(j.case.verdict) if s["answer"] == "absent"]
    board = score.Board()

    def share(name, target, better, told_true):
        board.share(name, target, better, sum(told_true), len(told_true))

    share("named where only roughness is", 0.05, "lower", [bool(j.sure) for j in empty if not j.outside])
    share("named where the cause is outside the list", None, "lower", [bool(j.sure) for j in empty if j.outside])
    share("statements with P >= 0.5 that are true", 0.90, "higher", [f.true for f in sure])
    share("statements with P >= 0.9 that are true", None, "higher",
                [f.true for f in sure if f.probability >= 0.9])
    share("effects that stand clear, named", 0.70, "higher", [j.named(e) for j in judged for e in j.clear])
    share("all effects, named", None, "higher", [j.named(e) for j in judged for e in j.case.truth])
    error, bins = calibration(pairs)
    board.rows.append({"name": "calibration error of statements", "target": 0.06, "better": "lower", "value": error,
                       "low": math.nan, "high": math.nan, "cases": len(pairs)})
    all_pairs = [(s["probability"] or 0.0, float(true)) for j in judged for s, true in weighed(j.case)]
    board.rows.append({"name": "... of all that was judged, present or absent", "target": 0.06, "better": "lower",
                       "value": calibration(all_pairs)[0], "low": math.nan, "high": math.nan, "cases": len(all_pairs)})
    share("95 % intervals that hold the truth (88 to 98)", 0.88, "higher",
                [e["low"] <= v <= e["high"] for v, e in spans])
    board.number("effect parameter, median error", 0.05, "lower", [abs(e["value"] / v - 1) for v, e in found])
    share("first right, where an effect stands clear", None, "higher", [j.first_right() for j in held])
    share("first right, where that and any is named", 0.95, "higher", [j.first_right() for j in held if j.sure])
    share("two effects that stand clear: exact set", 0.80, "higher", [j.exact() for j in two])
    share("verdict right", 0.93, "higher", [j.right() for j in judged])
    differences = [score.shrinkage_difference(j.case) for j in judged if j.sure]
    board.number("predicted against realised shrinkage, median difference", 0.05, "lower",
                 [d for d in differences if d is not None])
    share("absent statements that are true", 0.90, "higher", [within_bound(c, s) for c, s in absent])
    return {"seed": seed, "cases": len(judged), "rows": board.rows, "calibration": bins}


def confusions(cases):
    """What was wrong, case by case: effects that do not stand clear in brackets, false statements marked."""
    judged = [Judged(c) for c in cases if c.kind != "ambiguous"]
    wrong = [j for j in judged if not j.right()]
    lines = [f"Wrong verdicts ({len(wrong)} of {len(judged)}); [effects] that do not stand clear; * false:", "",
             "| case | rig | roughness | holds | said | statements with P >= 0.5 |", "|---|---|---|---|---|---|"]
    for j in sorted(wrong, key=lambda j: (j.case.rig, j.case.index)):
        label = {(e["name"], e["on"]): e["effect_to_floor_refit"] for e in j.case.label["effects"]}
        holds = " + ".join(f"{n}@{o} {label[n, o]:.0f}" if (n, o) in j.clear else f"[{n}@{o} {label[n, o]:.0f}]"
                           for n, o in j.case.truth) or (f"outside: {j.outside}" if j.outside else "nothing")
        sure = ", ".join(f"{'' if f.true else '*'}{' or '.join(f'{n}@{o}' for n, o in f.names)} {f.probability:.2f}"
                         for f in j.sure)
        rough = j.case.label.get("roughness_to_floor_refit", 0)
        lines.append(f"| {j.case.index} | {j.case.rig} | {rough:.1f} | {holds} | {j.case.answer} | {sure} |")
    return "\n".join(lines) + "\n"
