"""The changed MJCF in the user's own MuJoCo: the error that was promised comes out of the stock package alone."""

import csv
from pathlib import Path

import numpy as np
import pytest

import gapscope as gs

SIZES = {
    "cable_spring@arm.stiffness_n_m_per_rad": 1.2e-3,
    "cable_spring@arm.rest_rad": -0.4,
    "coulomb_friction@arm.friction_n_m": 6e-4,
}


def stock_error(model_path: Path, log: str, time_step_s: float) -> float:
    """The root mean square over the signals of each one's error over its standard deviation, in one free run."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(model_path))
    # Dry friction written "as stiff as the step allows" (solreffriction="-1 ...") follows the step that is used.
    stiff = model.dof_solref[:, 0] == -1
    model.dof_solref[stiff, 1] = -0.9999 / time_step_s
    model.opt.timestep = time_step_s
    data = mujoco.MjData(model)
    with open(log, newline="") as file:
        rows = np.array(list(csv.reader(file))[1:], dtype=float)
    signals = ["arm", "pendulum"]
    predicted = np.empty((len(rows), len(signals)))
    for k, (now, volts, *_) in enumerate(rows):
        predicted[k] = [data.joint(name).qpos[0] for name in signals]
        data.ctrl[0] = volts
        last = rows[min(k + 1, len(rows) - 1), 0]
        for _ in range(round((last - now) / model.opt.timestep)):
            mujoco.mj_step(model, data)
    measured = rows[:, 2:4]
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
