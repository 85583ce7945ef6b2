"""The changed MJCF in the user's own MuJoCo: the error that was promised comes out of the stock package alone."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapscope as gs

SIGNALS = ("arm_rad", "pendulum_rad")
REPLAY = Path(__file__).resolve().parents[1] / "replay" / "replay_in_python.py"
SIZES = {
    "cable_spring@arm.stiffness_n_m_per_rad": 1.2e-3,
    "cable_spring@arm.rest_rad": -0.4,
    "coulomb_friction@arm.friction_n_m": 6e-4,
}


# What MuJoCo has itself: springs beside a stop, and drag.
NATIVES = {
    "cable_spring@arm.stiffness_n_m_per_rad": 1.2e-3,
    "cable_spring@arm.stiffness_cubic_n_m_per_rad3": 1e-3,
    "coulomb_friction@arm.friction_n_m": 6e-4,
    "quadratic_drag@arm.drag_n_m_s2_per_rad2": 2e-5,
    "end_stop@arm.angle_rad": 0.3,
    "end_stop@arm.stiffness_n_m_per_rad": 0.02,
}


def later(time_s: np.ndarray, held: np.ndarray, late_s: float) -> np.ndarray:
    """What a command that is held from stamp to stamp is, in the mean from each to the next, where it acts later."""
    edges = np.append(time_s, 2 * time_s[-1] - time_s[-2])
    whole = np.append(0, np.cumsum(held * np.diff(edges)))
    before = abs(late_s)  # the first row's
    acted = np.interp(edges - late_s, np.append(edges[0] - before, edges), np.append(-held[0] * before, whole))
    return np.diff(acted) / np.diff(edges)


def stock_error(model: Path, log: str, time_step_s: float, run: dict[str, Any] | None = None) -> float:
    """The root mean square over the signals of each one's error over its standard deviation, in one free run: of the
    whole log from the model's own state, or a diagnosis' `evidence.free_runs` that begins with the log."""
    pytest.importorskip("mujoco")
    rows = np.genfromtxt(log, delimiter=",", names=True)
    commands, states, start = (model.with_suffix(suffix) for suffix in (".csv", ".states", ".json"))
    offsets = np.zeros(2)
    if run:
        rows = rows[rows["time_s"] - rows["time_s"][0] < run["until_s"] + 1e-9]
        rows["voltage_v"] = later(rows["time_s"], rows["voltage_v"], run["commands_late_s"])
        offsets += [run["offsets"][signal] for signal in SIGNALS]
        start.write_text(json.dumps(run))
    given = np.transpose([rows["time_s"], rows["voltage_v"]])
    np.savetxt(commands, given, "%.17g", ",", header="time_s,motor", comments="")
    replay = [sys.executable, REPLAY, gs.plugin_library(), model, commands, repr(time_step_s), states]
    subprocess.run(list(map(str, replay + [start] * bool(run))), check=True)
    predicted = np.fromfile(states).reshape(len(rows), -1)[:, :2] + offsets
    measured = np.transpose([rows[signal] for signal in SIGNALS])
    square = ((predicted - measured) ** 2).mean(axis=0) / measured.var(axis=0)
    return float(np.sqrt(square.mean()))


def test_the_applied_model_keeps_its_promise_in_stock_mujoco(experiment: str, demo: str, tmp_path: Path) -> None:
    """At the step that the promise was made with; the answer says how much longer the MJCF's own is."""
    promised = gs.replay(experiment, demo, with_=["cable_spring@arm", "coulomb_friction@arm"], set=SIZES)
    changed = promised.apply(tmp_path / "robot.xml")
    without = gs.replay(experiment, demo)
    without.apply(tmp_path / "nominal.xml")
    assert promised.error < 0.01 * without.error
    step_s = changed["time_step_s"]
    assert step_s == promised.json["time_step_s"] < changed["model_time_step_s"] == 0.002
    assert stock_error(tmp_path / "robot.xml", demo, step_s) == pytest.approx(promised.error, rel=0.01)
    assert stock_error(tmp_path / "nominal.xml", demo, step_s) == pytest.approx(without.error, rel=0.01)


def test_what_mujoco_has_itself_needs_no_plugin(experiment: str, demo: str, tmp_path: Path) -> None:
    effects = list(dict.fromkeys(name.partition(".")[0] for name in NATIVES))
    promised = gs.replay(experiment, demo, with_=effects, set=NATIVES)
    step_s = promised.apply(tmp_path / "robot.xml")["time_step_s"]
    text = (tmp_path / "robot.xml").read_text()
    assert "plugin" not in text and all(f"gapscope: {name}" in text for name in effects), text
    assert stock_error(tmp_path / "robot.xml", demo, step_s) == pytest.approx(promised.error, rel=1e-4)
    for effect in effects:  # each one counts
        kept = [one for one in effects if one != effect]
        sizes = {name: value for name, value in NATIVES.items() if not name.startswith(effect)}
        assert gs.replay(experiment, demo, with_=kept, set=sizes).error != pytest.approx(promised.error, rel=1e-3)


def test_an_applied_diagnosis_keeps_its_promise_in_stock_mujoco(
    experiment: str, demo: str, tmp_path: Path
) -> None:
    """The error of a log that was held out, in one run from where the fit says that it began."""
    header, *rows = Path(demo).read_text().splitlines(keepends=True)
    held_out, fitted = tmp_path / "held_out.csv", tmp_path / "fitted.csv"
    held_out.write_text("".join([header, *rows[:500]]))
    fitted.write_text("".join([header, *rows[500:1000]]))
    given, quick = ["cable_spring@arm", "coulomb_friction@arm"], {"no-next-experiment": True}
    found = gs.diagnose(experiment, fitted, hold_out=held_out, with_=given, effort="quick", options=quick)
    found.apply(tmp_path / "robot.xml")
    [run] = found.json["evidence"]["free_runs"]
    assert run["log"] == str(held_out) and run["from_s"] == 0 and run["error"] < 0.1
    error = stock_error(tmp_path / "robot.xml", str(held_out), found.json["time_step_s"], run)
    assert error == pytest.approx(run["error"], rel=0.005)
