"""Readers of other tools' formats: files made by each format's own library, and hostile ones."""

from __future__ import annotations

import json
import os
import pickle
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest
from gapscope._program import program

ROWS = 200
TIME = np.arange(ROWS) * 0.005 + 100.0
Q = np.sin(np.arange(ROWS) * 0.1)
U = np.random.default_rng(3).normal(size=(ROWS, 2))


def same(log: gs.Log, time: str = "time_s") -> None:
    """To the last bit."""
    assert np.array_equal(log[time], TIME)
    assert np.array_equal(log["q"], Q)
    assert np.array_equal(log["u[0]"], U[:, 0]) and np.array_equal(log["u[1]"], U[:, 1])


def test_mat(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    path = tmp_path / "run.mat"
    for version in ("4", "5"):
        io.savemat(path, {"time_s": TIME, "q": Q, "u": U}, format=version)
        same(gs.read(path))
        same(gs.Log(path))
    io.savemat(path, {"time_s": TIME, "q": Q, "u": U, "note": "a text", "p": 3.0}, do_compression=True)
    log = gs.read(path)
    same(log)
    assert any("note" in finding for finding in log.findings) and log.clock["q"] == "sampled" and log.name == "run"


def test_simulink_and_quarc(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    path = tmp_path / "scope.mat"
    signals = np.array([({"values": Q, "label": "q"}), ({"values": U, "label": "u"})], dtype=object)
    io.savemat(path, {"out": {"time": TIME, "signals": signals}})
    same(gs.read(path), time="time")
    io.savemat(path, {"data": np.vstack([TIME, Q, U.T])})  # To Host File: a column for each sample
    log = gs.read(path)
    assert np.array_equal(log["time_s"], TIME) and np.array_equal(log["data[0]"], Q)


def test_mat_73_and_hdf5(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:  # as MATLAB writes it: transposed, behind its own header
        for name, values in (("time_s", TIME[:, None]), ("q", Q[:, None]), ("u", U)):
            file[name] = values.T
    raw = bytearray(path.read_bytes())
    raw[:124] = b"MATLAB 7.3 MAT-file".ljust(124)
    path.write_bytes(bytes(raw))
    same(gs.read(path))
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["time_s"], group["q"], group["u"] = TIME, Q, U
        file["short"] = Q[:7]
    log = gs.read(path)
    assert np.array_equal(log["run/time_s"], TIME) and np.array_equal(log["run/u[1]"], U[:, 1])
    assert "short" not in log.columns and any("short" in finding for finding in log.findings)
    same(gs.read(path, variable="run"))
    with pytest.raises(gs.InputError, match="'walk'.*run"):
        gs.read(path, variable="walk")


def test_parquet_and_feather(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.feather as feather
    import pyarrow.parquet as parquet

    table = pa.table({"time_s": TIME, "q": Q, "u": list(U), "name": ["a"] * ROWS, "on": [True] * ROWS})
    parquet.write_table(table, tmp_path / "run.parquet")
    feather.write_feather(table, str(tmp_path / "run.feather"))
    for path in (tmp_path / "run.parquet", tmp_path / "run.feather"):
        log = gs.read(path)
        same(log)
        assert "name" not in log.columns and log["on"][0] == 1
    table = pa.table({"stamp": (TIME * 1e9).astype("datetime64[ns]"), "q": [None, *Q[1:]]})
    parquet.write_table(table, tmp_path / "run.parquet")
    log = gs.read(tmp_path / "run.parquet")
    assert log["stamp"][0] == 0 and log["stamp"][1] == pytest.approx(0.005) and np.isnan(log["q"][0])


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_lerobot(tmp_path: Path, version: str) -> None:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    names: Any = ["pan", "lift"] if version == "v3.0" else {"motors": ["pan", "lift"]}
    info = {"codebase_version": version, "fps": 30, "features": {"action": {"names": names, "shape": [2]}}}
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "info.json").write_text(json.dumps(info))
    folder = tmp_path / "data" / "chunk-000"
    folder.mkdir(parents=True)

    def episode(k: int) -> Any:
        stamps = (np.arange(ROWS) / 30).astype(np.float32)
        index = np.full(ROWS, k)
        return pa.table({"action": list(U.astype(np.float32) + k), "timestamp": stamps, "episode_index": index})

    if version == "v3.0":
        parquet.write_table(pa.concat_tables([episode(0), episode(1)]), folder / "file-000.parquet")
    else:
        for k in range(2):
            parquet.write_table(episode(k), folder / f"episode_{k:06d}.parquet")
    logs = gs.read_all(tmp_path)
    assert [log.name for log in logs] == [f"{tmp_path.name}#0", f"{tmp_path.name}#1"]
    assert np.array_equal(gs.read(f"{tmp_path}#1")["action/lift"], (U[:, 1].astype(np.float32) + 1).astype(float))
    assert logs[0].clock["action/pan"] == "synthetic" and "not measured" in logs[0].findings[0]
    assert len(gs.read_all(f"{tmp_path}#0:1")) == 1
    with pytest.raises(gs.InputError, match="no such episode.*#7"):
        gs.read(f"{tmp_path}#7")
    with pytest.raises(gs.InputError, match="several recordings"):
        gs.read(tmp_path)


def write_bag(path: Path, storage: str) -> None:
    """Joint states at 200 Hz, their names in changing order, and commands without a header at 100 Hz."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=8, storage_plugin=plugin) as writer:
        states = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        targets = writer.add_connection("/commands", "std_msgs/msg/Float64MultiArray", typestore=store)
        layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        for k in range(ROWS):
            ns = 10**12 + k * 5_000_000
            names, values = (["arm", "elbow"], [Q[k], 2 * Q[k]]) if k % 2 else (["elbow", "arm"], [2 * Q[k], Q[k]])
            stamp = types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
            message = types["sensor_msgs/msg/JointState"](
                header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=""),
                name=names,
                position=np.array(values),
                velocity=np.array([]),
                effort=np.array([]),
            )
            raw = store.serialize_cdr(message, "sensor_msgs/msg/JointState")
            writer.write(states, ns + 700_000, raw)
            if k % 2 == 0:
                command = types["std_msgs/msg/Float64MultiArray"](layout=layout, data=U[k].copy())
                writer.write(targets, ns + 1_000_000, store.serialize_cdr(command, "std_msgs/msg/Float64MultiArray"))


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_ros2_bag(tmp_path: Path, storage: str) -> None:
    pytest.importorskip("rosbags")
    bag = tmp_path / "bag"
    write_bag(bag, storage)
    inner = next(file for file in bag.iterdir() if file.suffix in (".mcap", ".db3"))
    for path in (bag, inner) if storage == "mcap" else (bag,):
        log = gs.read(path)
        there = np.isfinite(log["/joint_states/arm/position"])
        assert np.array_equal(log["/joint_states/arm/position"][there], Q)
        assert np.array_equal(log["/joint_states/elbow/position"][there], 2 * Q)
        sent = np.isfinite(log["/commands/data[1]"])
        assert np.array_equal(log["/commands/data[1]"][sent], U[::2, 1]) and len(sent) == ROWS + ROWS // 2
        assert log["time_s"][sent][1] == pytest.approx(0.011, abs=1e-9)
        assert log.clock["/commands/data[0]"] == "receive" and log.clock["/joint_states/arm/position"] == "header"
        assert "mixed clocks" in log.findings[0]
    only = gs.read(bag, topics=["/joint_states"])
    assert set(only.columns) == {"time_s", "/joint_states/arm/position", "/joint_states/elbow/position"}
    with pytest.raises(gs.InputError, match="/states.*/joint_states"):
        gs.read(bag, topics=["/states"])


def write_ros1_bag(path: Path) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        connection = writer.add_connection("/q", "std_msgs/msg/Float64", typestore=store)
        for k in range(ROWS):
            message = store.types["std_msgs/msg/Float64"](data=Q[k])
            writer.write(connection, 10**12 + k * 5_000_000, store.serialize_ros1(message, "std_msgs/msg/Float64"))


def test_ros1_bag(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    path = tmp_path / "run.bag"
    write_ros1_bag(path)
    log = gs.read(path)
    assert np.array_equal(log["/q/data"], Q) and log["time_s"][-1] == pytest.approx(0.995)


def test_two_rates_replay_as_the_csv_does(experiment: str, demo: str, tmp_path: Path) -> None:
    """The demo's commands and angles in one file, the angles at half its rate: what is there replays alike."""
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    table = np.genfromtxt(demo, delimiter=",", names=True)
    columns = {name: table[name].copy() for name in table.dtype.names}
    parquet.write_table(pa.table(columns), tmp_path / "run.parquet")
    assert gs.replay(experiment, tmp_path / "run.parquet").error == gs.replay(experiment, demo).error
    for name in ("arm_rad", "pendulum_rad"):
        columns[name][1::2] = np.nan
    parquet.write_table(pa.table(columns), tmp_path / "half.parquet")
    keep = Path(experiment).read_text().replace("log:", "log:\n  repair: {missing: keep}")
    kept = tmp_path / "experiment.yaml"
    kept.write_text(keep.replace("model: ", f"model: {Path(experiment).parent}/"))
    whole = gs.replay(experiment, demo).error
    assert gs.replay(kept, tmp_path / "half.parquet").error == pytest.approx(whole, rel=0.02)


def converter(folder: Path) -> dict[str, str]:
    """The environment in which the program finds this checkout's converter."""
    script = folder / "convert"
    package = Path(gs.__file__).parents[1]
    script.write_text(f"#!/bin/sh\nPYTHONPATH={package} exec {sys.executable} -m gapscope.formats \"$@\"\n")
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
    assert run.returncode == 2 and "pip install 'gapscope[mat]'" in run.stderr


def test_a_missing_library_names_its_cure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "run.parquet").write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(gs.InputError, match=r"pip install 'gapscope\[parquet\]'"):
        gs.read(tmp_path / "run.parquet")


def test_time_is_found_or_asked_for(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    parquet.write_table(pa.table({"clk": TIME, "q": Q}), tmp_path / "run.parquet")
    with pytest.raises(gs.InputError, match="time='NAME'"):
        gs.read(tmp_path / "run.parquet")
    assert gs.Log(tmp_path / "run.parquet", time="clk").time == "clk"
