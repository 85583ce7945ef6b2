"""The program with the package's converter: logs of other tools replayed, inspected, converted; its doctor."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest
from conftest import experiment_at
from gapscope._program import program
from test_formats import write_mcap_json


def converter(folder: Path, python: str = sys.executable) -> dict[str, str]:
    """The environment in which the program finds this checkout's converter, run by ``python``."""
    script = folder / "convert"
    package = Path(gs.__file__).parents[1]
    script.write_text(f"#!/bin/sh\nPYTHONPATH={package} exec {python} -m gapscope.formats \"$@\"\n")
    script.chmod(0o755)
    return {**os.environ, "GAPSCOPE_CONVERT": str(script)}


def test_the_program_starts_the_converter_by_itself(experiment: str, demo: str, tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    table = np.genfromtxt(demo, delimiter=",", names=True)
    path = tmp_path / "run.mat"
    io.savemat(path, {**{name: table[name] for name in table.dtype.names}, "note": "left out"})
    command = [str(program()), "replay", experiment, str(path), "--json"]
    run = subprocess.run(command, capture_output=True, text=True, env=converter(tmp_path))
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["error"] == gs.replay(experiment, demo).error and "note" in run.stderr
    path.write_bytes(path.read_bytes()[:900])
    run = subprocess.run(command, capture_output=True, text=True, env=converter(tmp_path))
    assert run.returncode == 2 and "not a readable MAT file" in run.stderr and run.stdout == ""
    gone = {**os.environ, "GAPSCOPE_CONVERT": str(tmp_path / "gone")}
    run = subprocess.run(command, capture_output=True, text=True, env=gone)
    assert run.returncode == 2 and "gapscope-*.whl)[all]" in run.stderr


def test_the_doctor_asks_the_converter_for_its_extras(tmp_path: Path) -> None:
    there = tmp_path / "there"
    there.mkdir()
    (there / "torch.py").touch()  # found, never imported
    env = converter(tmp_path)
    script = Path(env["GAPSCOPE_CONVERT"])
    script.write_text(script.read_text().replace("PYTHONPATH=", f"PYTHONPATH={there}:"))
    command = [str(program()), "doctor", "--json"]
    checks = json.loads(subprocess.run(command, capture_output=True, text=True, env=env).stdout)["checks"]
    found = next(check for check in checks if check["name"] == "converter")
    assert found["good"] == (found["cure"] == "") and "torch" not in found["found"]
    lacking = "hdf5" if importlib.util.find_spec("h5py") is None else "all extras"
    assert lacking in found["found"]


def split_demo(demo: str, path: Path) -> None:
    """The demo as two topics of their own rates: commands at 500 Hz, angles at half of it."""
    table = np.genfromtxt(demo, delimiter=",", names=True)
    messages: list[tuple[str, int, Any]] = []
    for k, row in enumerate(table):
        messages.append(("/drive", round(1e9 * row["time_s"]), {"voltage": row["voltage_v"]}))
        if k % 2 == 0:
            angles = {"arm": row["arm_rad"], "pendulum": row["pendulum_rad"]}
            messages.append(("/angles", round(1e9 * row["time_s"]) + 4_000, angles))
        messages.append(("/noise", round(1e9 * row["time_s"]) + 900_000, {"x": 0}))
    write_mcap_json(path, messages)


def of_topics(experiment: str, target: Path, more: str = "") -> Path:
    """The demo's experiment, for `split_demo`."""
    names = {"voltage_v": "/drive/voltage", "arm_rad": "/angles/arm", "pendulum_rad": "/angles/pendulum"}
    return experiment_at(target, experiment, names, log="\n  source: {topics: [/drive, /angles]}" + more)


def test_two_rates_in_a_bag_replay_as_the_csv_does(experiment: str, demo: str, tmp_path: Path) -> None:
    """By the program with its converter, and by the package: commands held, angles compared where they are."""
    pytest.importorskip("mcap")
    bag, bound = tmp_path / "run.mcap", of_topics(experiment, tmp_path / "experiment.yaml")
    split_demo(demo, bag)
    command = [str(program()), "replay", str(bound), str(bag), "--json"]
    run = subprocess.run(command, capture_output=True, text=True, env=converter(tmp_path))
    assert run.returncode == 0, run.stderr
    whole = gs.replay(experiment, demo)
    assert json.loads(run.stdout)["error"] == pytest.approx(whole.error, rel=0.02)
    pytest.importorskip("ruamel.yaml")
    assert gs.replay(bound, bag).error == json.loads(run.stdout)["error"]
    held = of_topics(experiment, tmp_path / "held.yaml", "\n  repair: {missing: hold}")
    assert gs.replay(held, bag).error != json.loads(run.stdout)["error"]


def test_the_program_converts_and_inspects(demo: str, tmp_path: Path) -> None:
    pytest.importorskip("mcap")
    bag = tmp_path / "run.mcap"
    split_demo(demo, bag)
    environment = converter(tmp_path)
    call = [str(program()), "inspect", str(bag)]
    run = subprocess.run(call, capture_output=True, text=True, env=environment)
    assert run.returncode == 0 and "250 Hz, receive stamps: /angles/arm, /angles/pendulum" in run.stdout, run.stdout
    assert "fit for use" in run.stdout and "NOT fit" not in run.stdout
    source = json.dumps({"topics": ["/angles"]})
    call = [str(program()), "convert", str(bag), demo, "--out", str(tmp_path / "tables"), "--source", source, "--json"]
    run = subprocess.run(call, capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
    tables = {Path(log["table"]).name: log for log in json.loads(run.stdout)["logs"]}
    assert tables["run.npz"]["columns"] == ["time_s", "/angles/arm", "/angles/pendulum"]
    table = np.genfromtxt(demo, delimiter=",", names=True)
    same = gs.Log(tmp_path / "tables" / "qube.npz")
    assert all(np.array_equal(same[name], table[name]) for name in table.dtype.names)
    assert np.array_equal(gs.Log(tmp_path / "tables" / "run.npz")["/angles/arm"], table["arm_rad"][::2])
    call = [str(program()), "convert", str(bag), "--out", str(tmp_path), "--source", '{"topic": "/angles"}']
    run = subprocess.run(call, capture_output=True, text=True, env=environment)
    assert run.returncode == 2 and "'topic'" in run.stderr and "topics" in run.stderr
