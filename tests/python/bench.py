"""Times beside each other: bench.py EXPERIMENT LOG. scripts/bench_python runs it."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gapscope as gs
import numpy as np
import pandas as pd
from gapscope._program import program

ROWS, COLUMNS = 1_000_000, 20


def least_ms(call: Callable[[], object]) -> float:
    times = []
    for _ in range(7):
        begin = time.perf_counter()
        call()
        times.append(1e3 * (time.perf_counter() - begin))
    return min(times)


def row(what: str, ours: float, other: str, theirs: float) -> None:
    print(f"| {what} | {ours:.0f} | {other} | {theirs:.0f} | {ours / theirs:.2f} | {ours - theirs:.0f} |", flush=True)


def main(experiment: str, log: str) -> None:
    print("| | ms | beside it | ms | ratio | more, ms |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        command = [program(), "replay", experiment, log, "--json", "--out", folder]
        bare = least_ms(lambda: subprocess.run(command, check=True, capture_output=True))
        row("gs.replay", least_ms(lambda: gs.replay(experiment, log)), "the program alone", bare)

        table = {f"c{k}": np.random.default_rng(k).normal(size=ROWS) for k in range(COLUMNS)}
        frame = pd.DataFrame({"time_s": np.arange(ROWS) * 1e-3, **table})
        target = Path(folder) / "log.npz"
        saved = least_ms(lambda: np.savez(target, frame.to_numpy()))
        what = f"a DataFrame of {ROWS:.0e} rows x {COLUMNS} columns to the program's file"
        row(what, least_ms(lambda: gs.Log(frame).save(target)), "numpy.savez of its array", saved)


if __name__ == "__main__":
    main(*sys.argv[1:])
