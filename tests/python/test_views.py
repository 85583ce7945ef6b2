"""Results as MCAP files of joint states: written by the program and the converter, read back by two other readers."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import gapscope as gs
import numpy as np
import pytest
from gapscope._program import program
from gapscope.formats import Table, _joint_states, read_table

from conftest import JOINT, experiment_at
from test_converter import converter


@pytest.fixture(autouse=True)
def own_converter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAPSCOPE_CONVERT", converter(tmp_path)["GAPSCOPE_CONVERT"])


@pytest.fixture(scope="module")
def joint_result(tmp_path_factory: pytest.TempPathFactory) -> gs.Replay:
    """Of a log with position, velocity and torque, some of which are missing."""
    folder = tmp_path_factory.mktemp("joint")
    time_s = 0.005 * np.arange(400)
    columns = {
        "time_s": time_s,
        "target_rad": 0.2 * np.sin(6 * time_s),
        "position_rad": 0.2 * np.sin(6 * time_s - 0.1),
        "velocity_rad_per_s": 1.2 * np.cos(6 * time_s - 0.1),
        "torque_n_m": 3 * np.sin(6 * time_s),
    }
    for name in ("position_rad", "velocity_rad_per_s", "torque_n_m"):
        columns[name][100:110] = np.nan
    bound = experiment_at(folder / "experiment.yaml", JOINT, log="\n  repair: {missing: keep}")
    return gs.replay(bound, gs.Log(columns, name="run.1"))


KINDS = {"position": "position_rad", "velocity": "velocity_rad_per_s", "effort": "torque_n_m"}


def test_joint_states_are_the_traces(joint_result: gs.Replay, tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    (joint_result.out / "traces" / "of_an_earlier_run.csv").write_text("__time\n0\n")
    (path,) = joint_result.mcap(tmp_path / "views")
    assert path == tmp_path / "views" / "run.1.mcap" and list(path.parent.iterdir()) == [path]
    table, (traces,) = read_table(path), joint_result.traces
    for kind, signal in KINDS.items():
        trace = traces[signal]
        assert np.abs(table.columns["time_s"] - trace.time_s).max() < 1e-9
        assert np.array_equal(table.columns[f"/real/joint_states/joint/{kind}"], trace.measured, equal_nan=True)
        assert np.array_equal(table.columns[f"/sim/joint_states/joint/{kind}"], trace.predicted, equal_nan=True)
    assert np.isnan(traces["position_rad"].measured[105]) and np.isfinite(traces["position_rad"].predicted[105])


def test_other_readers_see_joint_states(joint_result: gs.Replay, tmp_path: Path) -> None:
    """Those of rosbags and mcap, which PlotJuggler, Foxglove and Rerun read the like of."""
    highlevel, mcap = pytest.importorskip("rosbags.highlevel"), pytest.importorskip("mcap.reader")
    (path,) = joint_result.mcap(tmp_path / "views")
    with highlevel.AnyReader([path]) as reader:
        assert {c.topic: (c.msgtype, c.msgcount) for c in reader.connections} == {
            "/real/joint_states": ("sensor_msgs/msg/JointState", 390),
            "/sim/joint_states": ("sensor_msgs/msg/JointState", 400),
        }
        connection, stamp, raw = next(reader.messages())
        message = reader.deserialize(raw, connection.msgtype)
        assert message.name == ["joint"] and len(message.effort) == 1 and stamp == 0
    with path.open("rb") as file:
        summary = mcap.make_reader(file).get_summary()
    assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
    said = subprocess.run([program(), "inspect", str(path)], check=True, capture_output=True, text=True).stdout
    assert "/real/joint_states/joint/position" in said and "/sim/joint_states/joint/velocity" in said


def test_a_joint_without_a_velocity_has_none(experiment: str, short: str, tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    (path,) = gs.replay(experiment, short).mcap(tmp_path / "views")
    names = {f"/{side}/joint_states/{joint}/position" for side in ("real", "sim") for joint in ("arm", "pendulum")}
    assert set(read_table(path).columns) == {"time_s", *names}


def test_a_joint_may_be_called_by_a_path(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    columns = {f"/real/joint_states/{joint}/effort": np.array([1.0, np.nan, 3.0]) for joint in ("robot/arm", "hand")}
    table = Table({"__time": np.array([0.5, 0.6, 0.7]), "voltage": np.ones(3), **columns}, "__time")
    _joint_states.write(table, tmp_path / "run.mcap")
    read = read_table(tmp_path / "run.mcap")
    assert set(read.columns) == {"time_s", *columns} and read.clock["/real/joint_states/hand/effort"] == "header"
    assert all(read.columns[name].tolist() == [1.0, 3.0] for name in columns), "a row without a value is no message"


def test_without_rosbags_nothing_is_written(joint_result: gs.Replay, tmp_path: Path) -> None:
    gone = tmp_path / "gone" / "rosbags"
    gone.mkdir(parents=True)
    (gone / "__init__.py").write_text("raise ImportError\n")
    script, package = tmp_path / "convert_without", Path(gs.__file__).parents[1]
    path = f"{gone.parent}:{package}"
    script.write_text(f"#!/bin/sh\nPYTHONPATH={path} exec {sys.executable} -m gapscope.formats \"$@\"\n")
    script.chmod(0o755)
    call = [program(), "convert", str(joint_result.out), "--to", "mcap", "--out", str(tmp_path / "views")]
    run = subprocess.run(call, capture_output=True, text=True, env={"GAPSCOPE_CONVERT": str(script)})
    assert run.returncode == 2 and "pip install 'gapscope[ros]'" in run.stderr, run.stderr
    run = subprocess.run(call, capture_output=True, text=True, env={"GAPSCOPE_CONVERT": str(tmp_path / "none")})
    assert run.returncode == 2 and "gapscope-*.whl)[all]" in run.stderr, run.stderr
    assert not (tmp_path / "views").exists()


def test_what_has_no_joint_states_is_refused(joint_result: gs.Replay, demo: str, tmp_path: Path) -> None:
    to = ("--to", "mcap", "--out", str(tmp_path / "views"))
    for words, said in {
        (demo,): "not JSON",
        (str(joint_result.out), str(joint_result.out)): "two logs of one name",
        (str(joint_result.out), "--source", json.dumps({"topics": ["/a"]})): "--source",
    }.items():
        run = subprocess.run([program(), "convert", *words, *to], capture_output=True, text=True)
        assert run.returncode == 2 and said in run.stderr, run.stderr
    assert not (tmp_path / "views").exists()
