"""Paths of the checkout; its own program and package."""

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

import pytest

if TYPE_CHECKING:
    import gapscope as gs

# scripts/wheel and scripts/bench_python run the first two, test_mjlab.py and test_engines.py what is in the folders.
collect_ignore = ["try_wheel.py", "bench.py", "mjlab", "engines"]
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))


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


def changed_joint(folder: Path, old: str, new: str) -> str:
    """The experiment file of a copy of the rig `joint` whose MJCF reads otherwise."""
    shutil.copytree(ROOT / "models", folder / "models")
    mjcf = folder / "models" / "joint" / "joint.xml"
    text = mjcf.read_text()
    assert old in text
    mjcf.write_text(text.replace(old, new))
    return str(folder / "models" / "joint" / "experiment.yaml")
