"""Paths of the checkout; its own program and package."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    import gapscope as gs

# scripts/wheel, scripts/bench_python and the tests of notebooks run the first three, those of engines what is in the
# folders.
collect_ignore = ["try_wheel.py", "bench.py", "interrupt_kernel.py", "mjlab", "isaaclab", "engines"]
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))
signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell ignores in what it starts with "&"


@pytest.fixture(autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of its own for each test."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("GAPSCOPE_CACHE_DIR", str(folder))
    return folder


@pytest.fixture
def experiment() -> str:
    return str(ROOT / "models" / "qube" / "experiment.yaml")


@pytest.fixture
def demo() -> str:
    return str(ROOT / "demo" / "qube.csv")


@pytest.fixture(scope="session")
def tuned(tmp_path_factory: pytest.TempPathFactory) -> "gs.Tune":
    """A fit that every test of draws reads: of the first 7 s of the demo's log, most parameters frozen."""
    import gapscope as gs

    folder = tmp_path_factory.mktemp("tuned")
    log = folder / "log.csv"
    log.write_text("".join((ROOT / "demo" / "qube.csv").read_text().splitlines(keepends=True)[:3501]))
    return gs.tune(
        ROOT / "models" / "qube" / "experiment.yaml", log, starts=1, out=folder / "out",
        freeze=["motor.resistance", "motor.km", "arm.mass", "pendulum.mass"],
    )  # fmt: skip


@pytest.fixture
def short(demo: str, tmp_path: Path) -> str:
    """The first 300 rows of the demo's log, of which a diagnosis takes seconds."""
    path = tmp_path / "short.csv"
    path.write_text("".join(Path(demo).read_text().splitlines(keepends=True)[:301]))
    return str(path)


def servo_log(folder: Path, rows: int) -> str:
    """A log of models/joint: its target steps to 0.3 rad and back twice in 1000 rows, the joint goes a third of it."""
    path = folder / "log.csv"
    lines = [f"{0.002 * k:.3f},{0.3 * (k % 500 > 250)},{0.1 * (k % 500 > 260)}" for k in range(rows)]
    path.write_text("\n".join(["time_s,target_rad,position_rad", *lines]) + "\n")
    return str(path)


def shell_program(path: Path, body: str) -> str:
    """A program that stands in for gapscope's."""
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(0o755)
    return str(path)


JOINT = ROOT / "models" / "joint" / "experiment.yaml"


def experiment_at(
    target: Path, source: Path | str, columns: Mapping[str, str] | None = None, log: str = ""
) -> Path:
    """An experiment file's copy elsewhere: ``columns`` by other names, ``log`` the first lines of its log."""
    text = Path(source).read_text().replace("model: ", f"model: {Path(source).parent}/")
    for name, column in (columns or {}).items():
        text = text.replace(f"column: {name}", f"column: {column}")
    target.write_text(text.replace("log:", f"log:{log}"))
    return target


def interpreter(engine: str) -> str:
    """Python of an environment of scripts/engine_env; without it the test is skipped."""
    made = subprocess.run(
        [ROOT / "scripts" / "engine_env", engine, "--made"], capture_output=True, text=True, check=False
    )
    if made.returncode:
        pytest.skip(f"scripts/engine_env {engine} was not run")
    return made.stdout.strip()


def knowing(fitted: "gs.Tune", best: dict[str, float], deviations: dict[str, float]) -> "gs.Tune":
    """As if the fit had ended at `best`, had known these parameters so well, each alone, and the others not at all."""
    result = fitted.json
    result["model"]["values"] |= best
    result["correlated"], result["spread"]["logarithmic"] = [], [False for _ in result["parameters"]]
    known = [deviations.get(p["name"], 0) for p in result["parameters"]]
    for p, deviation in zip(result["parameters"], known, strict=True):
        p["identifiable"] = deviation > 0
    result["spread"]["covariance"] = [[a**2 * (i == j) for j in range(len(known))] for i, a in enumerate(known)]
    (fitted.out / "result.json").write_text(json.dumps(result))
    return fitted


def packages(engine: str) -> Path:
    """Of an environment as `interpreter` finds it: what another one reads as its own with PYTHONPATH."""
    return next(Path(interpreter(engine)).parents[1].glob("lib/python*/site-packages"))


def stock_motion(path: Path, commands: np.ndarray, beside: np.ndarray | None = None) -> np.ndarray:
    """The first joint's angles in stock MuJoCo, by the integrator of exports.

    ``commands`` of the first actuator, one a step, and those ``beside`` them of the second.
    """
    import gapscope as gs
    import mujoco

    gs.load_plugins()
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data, angles = mujoco.MjData(model), np.empty(len(commands))
    for k, sent in enumerate(commands):
        angles[k], data.ctrl[0] = data.qpos[0], sent
        if beside is not None:
            data.ctrl[1] = beside[k]
        mujoco.mj_step(model, data)
    return angles


def interrupt_when(ready: Callable[[], bool]) -> None:
    """Ctrl-C in a notebook: SIGINT for this process, from a thread of its own."""

    def kill() -> None:
        while not ready():
            time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=kill, daemon=True).start()


def interrupt_after(seconds: float) -> None:
    then = time.monotonic() + seconds
    interrupt_when(lambda: time.monotonic() >= then)


def geared_joint(folder: Path) -> str:
    """As `changed_joint`: its drive behind a gear of -3, its command and its force in ranges that both clip."""
    old = '''<position name="motor" joint="joint" kp="157.1451" kv="7.0729"/>
    <motor name="motor.feedforward" joint="joint"/>'''
    new = '''<position name="motor" joint="joint" kp="157.1451" kv="7.0729" gear="-3" ctrlrange="-0.3 0.2"
              forcerange="-14 14"/>
    <motor name="motor.feedforward" joint="joint" gear="-3"/>'''
    return changed_joint(folder, old, new)


def changed_joint(folder: Path, old: str, new: str) -> str:
    """The experiment file of a copy of the rig `joint` whose MJCF reads otherwise."""
    shutil.copytree(ROOT / "models", folder / "models")
    mjcf = folder / "models" / "joint" / "joint.xml"
    text = mjcf.read_text()
    assert old in text
    mjcf.write_text(text.replace(old, new))
    return str(folder / "models" / "joint" / "experiment.yaml")
