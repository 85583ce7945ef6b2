#!/usr/bin/env python3
"""What a verdict's probability should be, from banks of twin cases: logistic fits of "right" on the verdict's evidence,
one for each kind of verdict.

    scripts/blind/calibrate.py out/blind/902 [out/blind/...]

Prints the constants of `Confidence` in src/diagnose/verdict.cc. Judge them on banks of other seeds. Plain Newton steps
with a Gaussian prior of deviation 2 on each weight: banks are small."""
import json, math, sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import score  # noqa: E402

PRIOR = 2.0


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


def logistic(x, y):
    """Weights, the constant first; Laplace's rule keeps a kind that was never wrong from certainty."""
    x = [[1.0] + row for row in x]
    n = len(x[0])
    y = [(t * (len(y) + 1) + 0.5) / (len(y) + 2) if len(y) else t for t in y]
    w = [0.0] * n
    for _ in range(50):
        p = [1 / (1 + math.exp(-sum(a * b for a, b in zip(w, row)))) for row in x]
        gradient = [sum((p[i] - y[i]) * x[i][j] for i in range(len(x))) + w[j] / PRIOR**2 for j in range(n)]
        hessian = [[sum(p[i] * (1 - p[i]) * x[i][j] * x[i][k] for i in range(len(x))) + (j == k) / PRIOR**2
                    for k in range(n)] for j in range(n)]
        w = [a - b for a, b in zip(w, solve(hessian, gradient))]
    return w


def main():
    cases = [c for folder in sys.argv[1:] for c in score.load(Path(folder), range(10000)) if c.strong]
    if not cases:
        sys.exit(__doc__)
    for name in ("none", "effects", "ambiguous", "unknown"):
        part = [c for c in cases if kind(c.verdict) == name]
        if part:
            weights = logistic([features(c.verdict) for c in part], [float(c.right()) for c in part])
            print(f"{name:10s} {len(part):4d} cases, {sum(c.right() for c in part)} right; weights "
                  + ", ".join(f"{w:.2f}" for w in weights))


if __name__ == "__main__":
    main()
