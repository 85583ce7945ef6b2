"""Scores verdicts of `gapscope diagnose` against sealed labels: the targets of docs/results/diagnosis.md, baselines,
confusions."""
import json, math, random
from collections import Counter

STRONG = 3.0  # effect over floor, after the base model's refit: the targets hold from here on


def given(logs):
    """The logs of a case that the program is given: all but the last, where that leaves three."""
    return logs[:-1] if len(logs) > 3 else logs


def load(folder, indices):
    cases = []
    for index in indices:
        label, verdict = folder / "sealed" / f"{index}.json", folder / "verdicts" / f"{index}.json"
        if label.exists() and verdict.exists():
            cases.append(Case(index, json.loads(label.read_text()), json.loads(verdict.read_text())))
    return cases


def below_a_sample(label, effect):
    return (effect["name"] == "command_delay"
            and effect["parameters"]["delay_s"] < 1 / min(l["rate_hz"] for l in label["logs"]))


class Case:
    def __init__(self, index, label, verdict):
        self.index, self.label, self.verdict = index, label, verdict
        self.kind, self.rig = label["kind"], label["rig"]
        self.truth = [(e["name"], e["on"]) for e in label["effects"]]
        # What only the log that is kept from the program shows, nobody can find.
        logs = len(given(label["logs"]))
        seen = [min(e["effect_to_floor_refit"], max(e.get("effect_to_floor_logs", [math.inf])[:logs]))
                for e in label["effects"]]
        self.strength = min(seen, default=label["effect_to_floor_refit"])
        # A delay below one sample is a nuisance of every model, by the contract: no severity makes it a finding.
        below = any(below_a_sample(label, e) for e in label["effects"])
        self.strong = self.kind in ("none", "ambiguous") or (self.strength >= STRONG and not below)
        self.named = [(e["name"], e["on"]) for e in verdict["effects"]]
        self.answer, self.probability = verdict["verdict"], verdict["probability"]
        self.groups = [set(g) for g in verdict["ambiguous"]]
        self.built = [set(m["name"] for m in g) for g in label["ambiguous"]]

    def first_right(self):
        return bool(self.named) and self.named[0] in self.truth and self.answer in ("effects", "ambiguous")

    def near(self):
        """The right effect within the verdict's group, or among the first two candidates."""
        names = {name for name, _ in self.truth}
        if any(group & names for group in self.groups) or any(e in self.truth for e in self.named[:2]):
            return True
        ranked = [(c["name"], c.get("on")) for c in self.verdict["candidates"] if c["name"] != "none"]
        return any(e in self.truth for e in ranked[:2])

    def right(self):
        """Whether the verdict as a whole is right."""
        if self.kind == "none":
            return self.answer in self.label["expected_verdicts"] and not self.named
        if self.kind == "unknown":
            return self.answer == "unknown"
        if self.kind == "ambiguous":
            return self.answer == "ambiguous" and any(len(g & b) >= 2 for g in self.groups for b in self.built)
        if self.answer == "ambiguous":  # true, if less than could be said
            names = {name for name, _ in self.truth}
            return len(self.truth) == 1 and any(g & names for g in self.groups)
        return self.answer == "effects" and set(self.named) == set(self.truth)


def wilson(hits, n, z=1.96):
    if n == 0:
        return math.nan, math.nan
    p, d = hits / n, 1 + z * z / n
    mid, half = (p + z * z / (2 * n)) / d, z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / d
    return max(0.0, mid - half), min(1.0, mid + half)


def median(values):
    values = sorted(v for v in values if v is not None and math.isfinite(v))
    return values[len(values) // 2] if values else math.nan


def median_interval(values):
    values = sorted(v for v in values if v is not None and math.isfinite(v))
    n = len(values)
    if n < 6:
        return math.nan, math.nan
    half = 0.98 * math.sqrt(n)
    return values[max(0, int(n / 2 - half))], values[min(n - 1, int(n / 2 + half))]


class Board:
    """Rows of a table: shares with Wilson intervals, medians with theirs."""

    def __init__(self):
        self.rows = []

    def share(self, name, target, better, hits, n):
        low, high = wilson(hits, n)
        self.rows.append({"name": name, "target": target, "better": better, "value": hits / n if n else math.nan,
                          "low": low, "high": high, "hits": hits, "cases": n})

    def number(self, name, target, better, values):
        low, high = median_interval(values)
        self.rows.append({"name": name, "target": target, "better": better, "value": median(values), "low": low,
                          "high": high, "cases": len(values)})


def parameter_errors(case):
    """Relative errors of the found effect's parameters; angles of rest, whose zero a sensor's offset moves, and counts
    of periods are left out."""
    truth, found = case.label["effects"][0]["parameters"], case.verdict["effects"][0]["parameters"]
    for name, value in truth.items():
        if name in found and "rest" not in name and "periods" not in name and value:
            yield abs(found[name]["value"] / value - 1)


def calibration(cases, bins=5):
    """Expected calibration error, and per bin: mean probability, share right, count. Bins of equal counts."""
    ranked = sorted((c.probability, c.right()) for c in cases)
    rows, error = [], 0.0
    for b in range(bins):
        part = ranked[b * len(ranked) // bins:(b + 1) * len(ranked) // bins]
        if part:
            stated, right = sum(p for p, _ in part) / len(part), sum(r for _, r in part) / len(part)
            rows.append({"stated": stated, "right": right, "cases": len(part)})
            error += abs(stated - right) * len(part) / len(ranked)
    return error, rows


def figures(cases, seed):
    none = [c for c in cases if c.kind == "none"]
    single = [c for c in cases if c.kind == "single" and c.strong]
    pair = [c for c in cases if c.kind == "pair" and c.strong]
    outside = [c for c in cases if c.kind == "unknown" and c.strong]
    ambiguous = [c for c in cases if c.kind == "ambiguous"]
    judged = none + single + pair + outside + ambiguous
    found = [c for c in single if c.first_right()]
    board = Board()
    rows, share, number = board.rows, board.share, board.number
    share("effect named where there is none", 0.02, "lower", sum(bool(c.named) for c in none), len(none))
    gaps = single + pair
    share("gap detected", 0.97, "higher", sum(c.answer in ("effects", "ambiguous", "unknown") for c in gaps), len(gaps))
    share("right effect first, single", 0.90, "higher", len(found), len(single))
    share("right effect within group or first two", 0.97, "higher", sum(c.near() for c in single), len(single))
    share("two effects: exact set", 0.65, "higher", sum(set(c.named) == set(c.truth) for c in pair), len(pair))
    share("wrong with probability >= 0.9", 0.02, "lower", sum(c.probability >= 0.9 and not c.right() for c in judged),
          len(judged))
    share("`unknown` recalled", 0.75, "higher", sum(c.answer == "unknown" for c in outside), len(outside))
    share("built ambiguity named", None, "higher", sum(c.right() for c in ambiguous), len(ambiguous))
    share("ambiguity where none was built", 0.10, "lower", sum(c.answer == "ambiguous" for c in none + gaps),
          len(none + gaps))
    error, bins = calibration(judged)
    rows.append({"name": "calibration error", "target": 0.05, "better": "lower", "value": error, "low": math.nan,
                 "high": math.nan, "cases": len(judged)})
    number("effect parameter, median error", 0.10, "lower", [e for c in found for e in parameter_errors(c)])
    number("held-out gap to floor closed, median", 0.80, "higher", [c.verdict["gap"]["closed"] for c in found])
    number("predicted against realised shrinkage, median difference", 0.10, "lower",
           [shrinkage_difference(c) for c in found if shrinkage_difference(c) is not None])
    number("wall time of a case, s", None, "lower", [c.verdict.get("check", {}).get("wall_s") for c in cases])
    share("verdict right as a whole", None, "higher", sum(c.right() for c in judged), len(judged))
    # Baselines on the single cases: what they would put first.
    draw = random.Random(seed)
    for name, pick in (("largest error drop", lambda c: min(tried(c), key=lambda e: e["held_out_error"], default=None)),
                       ("raw BIC", lambda c: min(tried(c), key=lambda e: e.get("bic", math.inf), default=None)),
                       ("random", lambda c: draw.choice([e for e in c.verdict["candidates"] if e["name"] != "none"]))):
        share(f"baseline {name}: right effect first, single", None, "higher", sum(is_truth(pick(c), c) for c in single),
              len(single))
        share(f"baseline {name}: effect named where there is none", None, "lower",
              sum(names_one(pick, name, c) for c in none), len(none))
    return {"seed": seed, "cases": len(cases), "rows": rows, "calibration": bins}


def tried(case):
    return [e for e in case.verdict["candidates"] if e["name"] != "none" and e["held_out_error"] is not None]


def is_truth(entry, case):
    return entry is not None and (entry["name"], entry.get("on")) in case.truth


def names_one(pick, name, case):
    entry = pick(case)
    none = next((e for e in case.verdict["candidates"] if e["name"] == "none"), None)
    if entry is None or none is None:
        return False
    if name == "raw BIC":
        return entry.get("bic", math.inf) < none.get("bic", math.inf)
    return name == "random" or entry["held_out_error"] < none["held_out_error"]


def shrinkage_difference(case):
    """Share of the error that goes away, held out by the program against measured on the log it never had."""
    refit, final = case.verdict.get("check", {}).get("withheld", [None, None])
    gap = case.verdict["gap"]
    if not refit or final is None or not gap["refit"]:
        return None
    return abs((1 - gap["final"] / gap["refit"]) - (1 - final / refit))


def table(figures):
    lines = [f"{figures['cases']} cases of seed {figures['seed']}; targets hold for severities of "
             f"{STRONG:g} floors and more", "",
             "| metric | value | 95 % interval | cases | target | reached |", "|---|---|---|---|---|---|"]
    for row in figures["rows"]:
        percent = row.get("hits") is not None
        number = (lambda v: f"{100 * v:.1f} %") if percent else (lambda v: f"{v:.3g}")
        text = lambda v: "-" if v is None or math.isnan(v) else number(v)
        reached = ""
        if row["target"] is not None and not math.isnan(row["value"]):
            better = (row["value"] <= row["target"]) == (row["better"] == "lower")
            reached = "yes" if better or row["value"] == row["target"] else "no"
        sign = "" if row["target"] is None else "<= " if row["better"] == "lower" else ">= "
        count = f"{row['hits']} of {row['cases']}" if percent else str(row["cases"])
        lines.append(f"| {row['name']} | {text(row['value'])} | {text(row['low'])} .. {text(row['high'])} | {count} | "
                     f"{sign}{text(row['target']) if row['target'] is not None else ''} | {reached} |")
    lines += ["", "| stated probability | right | cases |", "|---|---|---|"]
    lines += [f"| {b['stated']:.2f} | {b['right']:.2f} | {b['cases']} |" for b in figures["calibration"]]
    return "\n".join(lines) + "\n"


def said(case):
    names = " + ".join(f"{n}@{o}" for n, o in case.named)
    if case.answer == "ambiguous":
        return "ambiguous: " + " | ".join(", ".join(sorted(g)) for g in case.groups)
    return case.answer + (f": {names}" if names else "")


def was(case):
    if case.kind == "ambiguous":
        return "ambiguous: " + " | ".join(", ".join(sorted(g)) for g in case.built)
    outside = "outside: " + case.label.get("outside", {}).get("name", "")
    return {"none": "none", "unknown": outside}.get(case.kind) or " + ".join(f"{n}@{o}" for n, o in case.truth)


def confusions(cases):
    wrong = [c for c in cases if not c.right()]
    lines = [f"What was confused with what ({len(wrong)} of {len(cases)}, weak cases included):", "",
             "| case | rig | over floor | was | said | probability |", "|---|---|---|---|---|---|"]
    for c in sorted(wrong, key=lambda c: (c.kind, c.rig, c.index)):
        lines.append(f"| {c.index} | {c.rig} | {c.strength:.1f} | {was(c)} | {said(c)} | {c.probability:.2f} |")
    counts = Counter((c.kind, c.right()) for c in cases)
    lines.append("")
    lines += [f"{kind}: {counts[kind, True]} right, {counts[kind, False]} wrong"
              for kind in sorted({k for k, _ in counts})]
    return "\n".join(lines) + "\n"
