"""Closes the loop once: does a diagnosis make a better controller? scripts/close_loop [TWINS] prints the tables.

Twins of the Qube with dry friction and late commands are logged hanging, by gapscope_twin. A model of each is made in
four ways, one procedure (controller.py) makes controllers of each, and each drives the twin upright (plant.py).
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import gapscope as gs
import numpy as np
from controller import UPRIGHT, Controller, Linear, Weights, linearise
from plant import PERIOD_S, STEP_S, Floats, Truth, Twin

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENT = ROOT / "models/qube/experiment.yaml"
EFFECTS = ("coulomb_friction@arm", "command_delay@motor")
MODELS = ("nominal", "retuned", "diagnosed", "true")
DESIGNS = {  # the Qube report's weights, then angles alone, softest first
    "10, 10, 1, 10; 1": Weights((10, 10, 1, 10), 1),
    "10, 10, 0, 0; 1": Weights((10, 10, 0, 0), 1),
    "10, 10, 0, 0; 0.1": Weights((10, 10, 0, 0), 0.1),
    "10, 10, 0, 0; 0.01": Weights((10, 10, 0, 0), 0.01),
    "10, 10, 0, 0; 0.001": Weights((10, 10, 0, 0), 0.001),
}
STARTS, STAND_S, FOLLOW_S, SETTLE_S = 20, 3.0, 4.0, 1.0
FALLEN_RAD = 1.0


@dataclass(frozen=True)
class Made:
    """A twin, its models linearised, and how far its numpy code is from gapscope_twin."""

    truth: Truth
    models: dict[str, Linear]
    found: str
    apart_rad: float


def twin_program(truth: Truth | None, seed: int, out: Path, *words: str) -> None:
    """Without a truth the plant is the seed's own; base parameters always are."""
    effects = {} if truth is None else {k: v for k, v in truth.values.items() if "@" in k}
    given = [word for name, value in effects.items() for word in ("--set", f"{name}={value!r}")]
    command = [str(ROOT / "build/bin/gapscope_twin"), "--rig", "qube", "--seed", str(seed), "--out", str(out)]
    subprocess.run([*command, *given, *words], check=True)


def draw(seed: int, folder: Path) -> Truth:
    random = np.random.default_rng(seed)
    friction = 5e-4 * 3 ** random.uniform()
    delay = round(random.uniform(0.004, 0.016) / STEP_S) * STEP_S
    twin_program(None, seed, folder / "seed", "--excitation", "zero", "--label", str(folder / "label.json"))
    label = json.loads((folder / "label.json").read_text())
    return Truth({name: value["true"] for name, value in label["base"].items()}, friction, delay)


def apart(truth: Truth, seed: int, folder: Path) -> float:
    """The largest difference of an angle, rad, between Twin and gapscope_twin on four seconds of a chirp."""
    time = np.arange(2000) * PERIOD_S
    voltage = 1.5 * np.sin(2 * np.pi * (0.5 + 0.6 * time) * time)
    np.savetxt(folder / "drive.csv", np.c_[time, voltage], delimiter=",", header="time_s,voltage_v", comments="")
    words = ("--drive", str(folder / "drive.csv"), "--noise", "0")
    twin_program(truth, seed, folder / "exact", *words)
    exact = np.loadtxt(folder / "exact/log_0.csv", delimiter=",", skiprows=1)
    twin, worst = Twin([truth], np.zeros((4, 1))), 0.0
    for row in exact:
        worst = max(worst, float(np.abs(twin.state[:2, 0] - row[2:4]).max()))
        twin.hold(row[1:2])
    return worst


def make(seed: int, folder: Path) -> Made:
    folder.mkdir()
    truth = draw(seed, folder)
    shapes = [word for shape in ("chirp", "multisine", "steps") for word in ("--excitation", shape)]
    twin_program(truth, seed, folder / "logs", *shapes, "--duration", "6")
    logs = sorted((folder / "logs").glob("log_*.csv"))
    retuned = gs.tune(EXPERIMENT, logs, starts=1, out=folder / "tune")
    options = {"no-next-experiment": True}
    diagnosed = gs.diagnose(EXPERIMENT, logs, effort="quick", out=folder / "diagnose", options=options)
    known = gs.replay(EXPERIMENT, logs[0], with_=EFFECTS, set=truth.values, out=folder / "true")
    written = [ROOT / "models/qube/qube.xml"]
    for name, result in zip(MODELS[1:], (retuned, diagnosed, known)):
        written.append(Path(result.export("mujoco_native", folder / f"native_{name}").model))
    found = ", ".join(f"{e.name}@{e.on} {e.probability:.2f}" for e in diagnosed.effects) or "nothing"
    models = {name: linearise(mjcf) for name, mjcf in zip(MODELS, written)}
    return Made(truth, models, f"{diagnosed.verdict}: {found}", apart(truth, seed, folder))


def wanted(time_s: float) -> float:
    """Of the arm: it stands, then follows a sine of 0.5 Hz."""
    return 0.5 * np.sin(np.pi * (time_s - STAND_S)) if time_s > STAND_S else 0.0


def drive(made: list[Made]) -> Iterator[tuple[float, Floats]]:
    """Time and state of every loop: columns by twin, model, design, start."""
    starts = np.zeros((4, STARTS))
    random = np.random.default_rng(0)
    starts[:2] = UPRIGHT[:, None] + random.uniform(-1, 1, (2, STARTS)) * np.array([[0.5], [0.2]])
    kinds = [(one, name, weights) for one in made for name in MODELS for weights in DESIGNS.values()]
    twin = Twin([one.truth for one, _, _ in kinds for _ in range(STARTS)], np.tile(starts, len(kinds)))
    loops = [Controller(one.models[name], weights, STARTS) for one, name, weights in kinds]
    for k in range(round((STAND_S + FOLLOW_S) / PERIOD_S)):
        yield k * PERIOD_S, twin.state
        read = np.split(twin.read(), len(kinds), axis=1)
        twin.hold(np.concatenate([loop.command(one, wanted(k * PERIOD_S)) for loop, one in zip(loops, read)]))


def judge(made: list[Made]) -> dict[str, Floats]:
    """Arrays of (twin, model, design, start): stands or not, and root mean squares, NaN where it fell."""
    states, times = [], []
    for time, state in drive(made):
        times.append(time)
        states.append(state[:2].astype(np.float32))
    at, angle = np.array(times), np.array(states, dtype=np.float64) - UPRIGHT[:, None]
    stands = (np.abs(angle[:, 1]) < FALLEN_RAD).all(0)
    still = (at > SETTLE_S) & (at <= STAND_S)
    follows = at > STAND_S + SETTLE_S
    error = angle[:, 0] - np.array([wanted(t) for t in times])[:, None]

    def rms(values: Floats) -> Floats:
        return np.where(stands, np.sqrt((values**2).mean(0)), np.nan)

    figures = {"stands": stands.astype(float), "pendulum": rms(angle[still, 1]), "arm": rms(error[still]),
               "sine": rms(error[follows])}
    shape = (len(made), len(MODELS), len(DESIGNS), STARTS)
    return {name: values.reshape(shape) for name, values in figures.items()}


def spread(by_twin: Floats, digits: int) -> str:
    """Median over twins of each twin's median over starts, and the range of those."""
    known = by_twin[np.isfinite(by_twin).any(-1)]
    if len(known) == 0:
        return "none stood"
    medians = np.nanmedian(known, axis=-1)
    return f"{np.median(medians):.{digits}f} ({medians.min():.{digits}f} .. {medians.max():.{digits}f})"


def table(title: str, cells: list[list[str]]) -> None:
    print(f"\n{title}\n\n| weights of states; voltage | {' | '.join(MODELS)} |\n{'|---' * (1 + len(MODELS))}|")
    for name, row in zip(DESIGNS, cells):
        print(f"| {name} | " + " | ".join(row) + " |")


def report(made: list[Made], figures: dict[str, Floats]) -> None:
    print("| twin | friction, V of command: true, diagnosed | delay, ms | verdict | twin's code apart, rad |")
    print("|---|---|---|---|---|")
    for number, one in enumerate(made, 1):
        true, found = one.models["true"], one.models["diagnosed"]
        print(f"| {number} | {true.friction_v:.4f}, {found.friction_v:.4f} | {true.delay_s * 1e3:.2f}, "
              f"{found.delay_s * 1e3:.2f} | {one.found} | {one.apart_rad:.1e} |")
    models, designs = range(len(MODELS)), range(len(DESIGNS))
    of = len(made) * STARTS
    stood = [[f"{figures['stands'][:, m, d].sum():.0f} ({figures['stands'][:, m, d].mean(1).min() * STARTS:.0f} "
              f".. {figures['stands'][:, m, d].mean(1).max() * STARTS:.0f})" for m in models] for d in designs]
    table(f"Stood, of {of} starts (of {STARTS} of one twin)", stood)
    for name, title in (("pendulum", "Pendulum's wobble while the arm shall stand, mrad"),
                        ("arm", "Arm's error while it shall stand, mrad"),
                        ("sine", "Arm's error behind a sine of 0.5 rad and 0.5 Hz, mrad")):
        table(title, [[spread(1e3 * figures[name][:, m, d], 1) for m in models] for d in designs])


def main() -> None:
    twins = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    with tempfile.TemporaryDirectory() as folder:
        made = []
        for seed in range(1, twins + 1):
            made.append(make(seed, Path(folder) / str(seed)))
            print(f"twin {seed}: {made[-1].found}", file=sys.stderr, flush=True)
    report(made, judge(made))


if __name__ == "__main__":
    main()
