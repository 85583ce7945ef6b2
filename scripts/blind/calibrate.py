#!/usr/bin/env python3
"""What a probability should be, from banks of twin cases: logistic fits of "right" on the evidence.

    scripts/blind/calibrate.py out/blind/902 [out/blind/...]
    scripts/blind/calibrate.py --features largest_gain:-1:3,log_discrepancy:-1:6,smooth,clear:-3:2,dry out/blind/rough_1

Without --features: of verdicts, one fit for each kind. With: of statements, on the named members of each one's
`numbers` (missing: 0; NAME:LOW:HIGH clips; those of DERIVED are made of them): `ProbabilityPolicy` of
src/diagnose/policy.h. Prints weights, the AUC of every number alone, and the calibration error where each case, and
each rig, is judged by weights from the others. Judge either on banks of other seeds. Plain Newton steps with a Gaussian
prior on each weight, banks being small: around 0 with deviation 2, or where KNOWN says, from an earlier bank of 234
statements."""
import argparse, json, math, sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import score  # noqa: E402
import statements  # noqa: E402

PRIOR = (0.0, 2.0)
KNOWN = {"constant": (-3.65, 0.5), "log_discrepancy": (1.11, 0.5), "smooth": (-2.21, 0.5),
         "clear": (0.0, 1.0), "dry": (0.0, 1.5)}  # weights by mean and deviation; the constant where mimicry is 0
MEMBER = 0.03  # search.member of the policy


def largest_gain(n):
    unseen = [n[k] for k in ("gain_held_out", "gain_free") if n[k] is not None]
    return max(unseen) if unseen and max(unseen) < MEMBER else max([n["gain"], *unseen])


DERIVED = {  # as src/diagnose/probability.cc has them
    "largest_gain": largest_gain,
    "log_discrepancy": lambda n: math.copysign(math.log1p(abs(n["discrepancy"])), n["discrepancy"]),
}


def features(verdict):
    e = verdict["evidence"]
    left = math.log(max(e["floors_left"] or 1.0, 1.0))
    lead = min(max(e["rival_lead"] or 0.0, 0.0), 0.5)
    return {"none": [left], "effects": [left, lead, float(len(verdict["effects"]) > 1)], "ambiguous": [left],
            "unknown": [left, max(e["removed"] or 0.0, 0.0)]}[kind(verdict)]


def kind(verdict):
    return "none" if verdict["verdict"] in ("none", "parameters") else verdict["verdict"]


def solve(matrix, right):
    n = len(right)
    rows = [list(r) + [b] for r, b in zip(matrix, right)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(i + 1, n):
            f = rows[k][i] / rows[i][i]
            rows[k] = [a - f * b for a, b in zip(rows[k], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return x


def smoothed(y):
    """Laplace's rule keeps a kind that was never wrong from certainty."""
    return [(t * (len(y) + 1) + 0.5) / (len(y) + 2) for t in y]


def logistic(x, y, priors=None):
    """Weights, the constant first. `priors`: mean and deviation of each."""
    x = [[1.0] + row for row in x]
    n = len(x[0])
    priors = priors or [PRIOR] * n
    w = [mean for mean, _ in priors]
    for _ in range(50):
        p = [probability(w, row[1:]) for row in x]
        gradient = [sum((p[i] - y[i]) * x[i][j] for i in range(len(x))) + (w[j] - priors[j][0]) / priors[j][1]**2
                    for j in range(n)]
        hessian = [[sum(p[i] * (1 - p[i]) * x[i][j] * x[i][k] for i in range(len(x))) + (j == k) / priors[j][1]**2
                    for k in range(n)] for j in range(n)]
        w = [a - b for a, b in zip(w, solve(hessian, gradient))]
    return w


def probability(weights, row):
    x = weights[0] + sum(w * v for w, v in zip(weights[1:], row))
    return 1 / (1 + math.exp(-max(min(x, 500.0), -500.0)))


def auc(values, truth):
    """Probability that a true one's value is above a false one's; below 0.5 where less speaks for it."""
    ranks, ordered = {}, sorted(values)
    for i, v in enumerate(ordered):
        ranks.setdefault(v, []).append(i + 1)
    n = sum(truth)
    if n in (0, len(truth)):
        return math.nan
    above = sum(sum(ranks[v]) / len(ranks[v]) for v, t in zip(values, truth) if t) - n * (n + 1) / 2
    return above / (n * (len(truth) - n))


def read(features, numbers):
    row = []
    for feature in features:
        name, *limits = feature.split(":")
        value = DERIVED[name](numbers) if name in DERIVED else numbers.get(name)
        value = 0.0 if value is None or not math.isfinite(value) else float(value)
        row.append(min(max(value, float(limits[0])), float(limits[1])) if limits else value)
    return row


def of_statements(cases, features):
    told = [(at, case.rig, s["numbers"], float(true), s["probability"] or 0)
            for at, case in enumerate(cases) for s, true in statements.weighed(case)]
    if not told:
        sys.exit("calibrate.py: no statement with `numbers` in these banks")
    at, rigs, truth = [e[0] for e in told], [e[1] for e in told], [e[3] for e in told]
    print(f"{len(told)} statements of {len(cases)} cases, {sum(truth):.0f} true")
    for name in sorted({n for entry in told for n in entry[2]}):
        print(f"  AUC {auc([read([name], entry[2])[0] for entry in told], truth):.3f}  {name}")
    rows = [read(features, entry[2]) for entry in told]
    priors = [KNOWN.get(name.split(":")[0], PRIOR) for name in ["constant", *features]]
    weights = logistic(rows, truth, priors)
    print(f"x = {weights[0]:.3f} " + " ".join(f"{w:+.3f} {n}" for w, n in zip(weights[1:], features)))

    def by_others(groups):
        apart = [0.0] * len(rows)
        for group in set(groups):
            others = [i for i, g in enumerate(groups) if g != group]
            w = logistic([rows[i] for i in others], [truth[i] for i in others], priors)
            for i in (i for i, g in enumerate(groups) if g == group):
                apart[i] = probability(w, rows[i])
        return apart
    for name, given in (("as they were told", [entry[4] for entry in told]),
                        ("same statements", [probability(weights, row) for row in rows]),
                        ("each case by the others", by_others(at)), ("each rig by the others", by_others(rigs))):
        error, bins = statements.calibration(list(zip(given, truth)))
        sure = [t for p, t in zip(given, truth) if p >= statements.SURE]
        likely = sum(math.log(max(p if t else 1 - p, 1e-9)) for p, t in zip(given, truth))
        print(f"{name}: log likelihood {likely:.2f}, AUC {auc(given, truth):.3f}, calibration error {error:.3f}, "
              f"P >= 0.5 true {sum(sure):.0f}/{len(sure)}, found {sum(sure):.0f}/{sum(truth):.0f}; "
              + ", ".join(f"{b['stated']:.2f}:{b['right']:.2f}" for b in bins))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("banks", nargs="+", type=Path)
    parser.add_argument("--features", help="comma-separated members of a statement's `numbers`")
    options = parser.parse_args()
    cases = [c for folder in options.banks for c in score.load(folder, range(10000))]
    if options.features is not None:
        return of_statements([c for c in cases if c.kind != "ambiguous"], options.features.split(","))
    cases = [c for c in cases if c.strong]
    if not cases:
        parser.error("no verdict of a strong case in these banks")
    for name in ("none", "effects", "ambiguous", "unknown"):
        part = [c for c in cases if kind(c.verdict) == name]
        if part:
            weights = logistic([features(c.verdict) for c in part], smoothed([float(c.right()) for c in part]))
            print(f"{name:10s} {len(part):4d} cases, {sum(c.right() for c in part)} right; weights "
                  + ", ".join(f"{w:.2f}" for w in weights))


if __name__ == "__main__":
    main()
