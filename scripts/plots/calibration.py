#!/usr/bin/env python3
"""Draws stated probability against share of verdicts that were right, from `scripts/blind_check --json FILE`.

    python3 -m venv V && V/bin/pip install matplotlib && V/bin/python scripts/plots/calibration.py FIGURES.json
        docs/pictures/calibration.png
"""
import json
import math
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def main():
    with open(sys.argv[1]) as f:
        figures = json.load(f)
    stated = [b["stated"] for b in figures["calibration"]]
    right = [b["right"] for b in figures["calibration"]]
    spread = [1.96 * math.sqrt(max(p * (1 - p), 0.02) / b["cases"]) for p, b in zip(right, figures["calibration"])]
    figure, axes = plt.subplots(figsize=(4.6, 4.2), layout="constrained")
    axes.plot([0, 1], [0, 1], color="0.7", linewidth=1)
    axes.errorbar(stated, right, yerr=spread, fmt="o", color="tab:blue", capsize=3)
    axes.set(xlim=(0, 1.02), ylim=(0, 1.02), xlabel="stated probability of the verdict", ylabel="share right",
             title=f"{figures['cases']} cases of seed {figures['seed']}, five equal bins")
    figure.savefig(sys.argv[2], dpi=130)


if __name__ == "__main__":
    main()
