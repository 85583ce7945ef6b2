#!/usr/bin/env python3
"""How well what a diagnosis says of its own logs foretells a log that it never had.

    scripts/blind/promise.py [--build build] out/blind/rough_1 [out/blind/...]

For each case of finished banks that names an effect: both models on every log, and the share of the error that goes
away. Prints a line a case, then how far each way to promise it is from what the withheld log shows; and how far apart
logs of one case are, a bound for every promise."""
import argparse, math, statistics, sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(Path(__file__).resolve().parent))
import replayed  # noqa: E402
import score  # noqa: E402
import statements  # noqa: E402


def closed(pair):
    return 1 - pair[1] / pair[0]


def pooled(pairs):
    return 1 - math.sqrt(sum(b * b for _, b in pairs) / sum(a * a for a, _ in pairs))


def logarithmic(pairs):
    return 1 - math.exp(statistics.mean(math.log(b / a) for a, b in pairs))


def by_median(pairs):
    return statistics.median(map(closed, pairs))


def by_mean(pairs):
    return statistics.mean(map(closed, pairs))


def measured(build, bank, case):
    """Errors by log of those that the program had, and of those it held out."""
    held_names = {Path(path).name for path in case.verdict["logs"]["held_out"]}
    seen, held = [], []
    for log in score.given(sorted((bank / "cases" / str(case.index)).glob("log_*.csv"))):
        errors = replayed.errors(build, 1, case.verdict["experiment"], log, case.verdict)
        if None in errors:
            continue
        seen.append(errors)
        if log.name in held_names:
            held.append(errors)
    return seen, held


def told(bank):
    """Cases of a bank that name an effect and have a log that the program was not given."""
    for case in score.load(bank, range(10000)):
        if case.kind != "ambiguous" and statements.Judged(case).sure and score.shrinkage_difference(case) is not None:
            yield case


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("banks", nargs="+", type=Path)
    parser.add_argument("--build", type=Path, default=ROOT / "build", help="folder with bin/")
    options = parser.parse_args()
    off, apart, cases = {}, [], 0
    for bank in options.banks:
        for case in told(bank):
            seen, held = measured(options.build, bank, case)
            if not held:
                continue
            gap, real = case.verdict["gap"], closed(case.verdict["check"]["withheld"])
            print(f"{bank.name} {case.index:3d} {case.rig:10s} withheld {real:5.2f}; seen",
                  *(f"{closed(e):5.2f}" for e in seen), flush=True)
            ways = {"as told (held out, pooled)": closed((gap["refit"], gap["final"])),
                    "held out, median": by_median(held), "held out, mean of logarithms": logarithmic(held),
                    "all seen, pooled": pooled(seen), "all seen, median": by_median(seen),
                    "all seen, mean": by_mean(seen)}
            left_out = [(e["refit"], e["final"]) for e in gap.get("by_log", [])
                        if e["refit"] is not None and e["final"] is not None]
            if len(left_out) > len(held):
                ways |= {"each log left out, pooled": pooled(left_out),
                         "each log left out, median": by_median(left_out)}
            for name, promise in ways.items():
                off.setdefault(name, []).append(promise - real)
            apart += [abs(closed(a) - by_median(seen[:k] + seen[k + 1:])) for k, a in enumerate(seen) if len(seen) > 1]
            cases += 1
    print(f"\n{cases} cases; difference from the withheld log's share: median of sizes, mean of sizes, mean")
    for name, differences in off.items():
        sizes = list(map(abs, differences))
        print(f"{name:30s} {statistics.median(sizes):.3f} {statistics.mean(sizes):.3f} "
              f"{statistics.mean(differences):+.3f}")
    print(f"a seen log and the median of the others: {statistics.median(apart):.3f} {statistics.mean(apart):.3f} "
          f"({len(apart)} logs)")


if __name__ == "__main__":
    sys.exit(main())
