"""Readers of other tools' formats: files made by each format's own library, and hostile ones."""

from __future__ import annotations

import contextlib
import json
import pickle
import shutil
import sqlite3
import sys
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest
from conftest import experiment_at
from gapscope.formats import Source, read_table

ROWS = 200
TIME = np.arange(ROWS) * 0.005 + 100.0
Q = np.sin(np.arange(ROWS) * 0.1)
U = np.random.default_rng(3).normal(size=(ROWS, 2))


def read(path: Path | str, **source: str | list[str]) -> gs.Log:
    """As gs.read, but in this process: faster."""
    return gs.Log.of_table(read_table(path, Source.of(source, "source")))


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
    same(read(path), time="time")
    io.savemat(path, {"data": np.vstack([TIME, Q, U.T])})  # To Host File: a column for each sample
    log = read(path)
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
    same(read(path))
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["time_s"], group["q"], group["u"] = TIME, Q, U
        file["short"] = Q[:7]
    log = read(path)
    assert np.array_equal(log["run/time_s"], TIME) and np.array_equal(log["run/u[1]"], U[:, 1])
    assert "short" not in log.columns and any("short" in finding for finding in log.findings)
    same(read(path, variable="run"))
    with pytest.raises(gs.InputError, match="'walk'.*run"):
        read(path, variable="walk")


def test_parquet_and_feather(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.feather as feather
    import pyarrow.parquet as parquet

    table = pa.table({"time_s": TIME, "q": Q, "u": list(U), "name": ["a"] * ROWS, "on": [True] * ROWS})
    parquet.write_table(table, tmp_path / "run.parquet")
    feather.write_feather(table, str(tmp_path / "run.feather"))
    for path in (tmp_path / "run.parquet", tmp_path / "run.feather"):
        log = read(path)
        same(log)
        assert "name" not in log.columns and log["on"][0] == 1
    stamps = (TIME * 1e9).astype("datetime64[ns]")
    table = pa.table({"stamp": pa.array(stamps, mask=np.arange(ROWS) == 7), "q": [None, *Q[1:]]})
    parquet.write_table(table, tmp_path / "run.parquet")
    log = read(tmp_path / "run.parquet")
    assert np.flatnonzero(np.isnan(log["stamp"])).tolist() == [7]
    assert log["stamp"][0] == 0 and log["stamp"][1] == pytest.approx(0.005) and np.isnan(log["q"][0])


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
    for path in (bag, shutil.copy(inner, tmp_path)):
        log = read(path)
        there = np.isfinite(log["/joint_states/arm/position"])
        assert np.array_equal(log["/joint_states/arm/position"][there], Q)
        assert np.array_equal(log["/joint_states/elbow/position"][there], 2 * Q)
        sent = np.isfinite(log["/commands/data[1]"])
        assert np.array_equal(log["/commands/data[1]"][sent], U[::2, 1]) and len(sent) == ROWS + ROWS // 2
        assert log["time_s"][sent][1] == pytest.approx(0.011, abs=1e-9)
        assert log.clock["/commands/data[0]"] == "receive" and log.clock["/joint_states/arm/position"] == "header"
        assert "mixed clocks" in log.findings[0]
    only = read(bag, topics=["/joint_states"])
    assert set(only.columns) == {"time_s", "/joint_states/arm/position", "/joint_states/elbow/position"}
    with pytest.raises(gs.InputError, match="/states.*/joint_states"):
        read(bag, topics=["/states"])


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
    log = read(path)
    assert np.array_equal(log["/q/data"], Q) and log["time_s"][-1] == pytest.approx(0.995)


def write_mcap_json(path: Path, messages: list[tuple[str, int, Any]]) -> None:
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channels: dict[str, int] = {}
        for topic, ns, message in messages:
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "json", 0)
            writer.add_message(channels[topic], ns, json.dumps(message).encode(), ns)
        writer.finish()


def test_mcap_of_json(tmp_path: Path) -> None:
    pytest.importorskip("mcap")
    messages: list[tuple[str, int, Any]] = []
    for k in range(ROWS):
        ns = 10**12 + k * 5_000_000
        stamp = {"sec": ns // 10**9, "nsec": ns % 10**9}
        joints = {"timestamp": stamp, "name": ["arm", "elbow"], "position": [Q[k], 2 * Q[k]], "mode": "on"}
        messages.append(("/joints", ns + 500_000, joints))
        if k % 2 == 0:
            messages.append(("/command", ns, {"u": list(U[k]), "on": True, "inner": {"x": 1}, "image": [0] * 100}))
    write_mcap_json(tmp_path / "run.mcap", messages)
    log = gs.read(tmp_path / "run.mcap")
    assert np.array_equal(log["/joints/arm/position"], Q) and np.array_equal(log["/joints/elbow/position"], 2 * Q)
    assert np.array_equal(log["/command/u[1]"][::2], U[::2, 1]) and np.isnan(log["/command/u[1]"][1::2]).all()
    assert log["/command/on"][0] == log["/command/inner/x"][0] == 1 and "/command/image[0]" not in log.columns
    assert log.clock["/joints/arm/position"] == "header" and log.clock["/command/on"] == "receive"
    assert log["time_s"][-1] == pytest.approx(0.995, abs=1e-12)
    only = gs.read(tmp_path / "run.mcap", {"model": "", "log": {"source": {"topics": ["/command"]}}}, joints=["a", "b"])
    assert np.array_equal(only["/command/u/b"], U[::2, 1]) and "/joints/arm/position" not in only.columns
    with pytest.raises(gs.InputError, match="/none.*/command, /joints"):
        gs.read(tmp_path / "run.mcap", topics=["/none"])


def write_mcap_protobuf(path: Path) -> None:
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
    from mcap_protobuf.writer import Writer

    file = descriptor_pb2.FileDescriptorProto(name="drive.proto", package="rig", syntax="proto3")
    file.dependency.append(timestamp_pb2.DESCRIPTOR.name)
    point = file.message_type.add(name="Point")
    point.field.add(name="x", number=1, type=1, label=1)
    drive = file.message_type.add(name="Drive")
    drive.field.add(name="timestamp", number=1, type=11, label=1, type_name=".google.protobuf.Timestamp")
    drive.field.add(name="q", number=2, type=1, label=1)
    drive.field.add(name="u", number=3, type=1, label=3)
    drive.field.add(name="at", number=4, type=11, label=1, type_name=".rig.Point")
    drive.field.add(name="note", number=5, type=9, label=1)
    pool = descriptor_pool.Default()
    pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("rig.Drive"))
    with path.open("wb") as stream, Writer(stream) as writer:
        for k in range(ROWS):
            message = kind(q=Q[k], u=U[k], note="text", at={"x": k} if k % 2 else None)
            message.timestamp.FromNanoseconds(10**12 + k * 5_000_000)
            writer.write_message("/drive", message, log_time=10**12 + k * 5_000_000 + 700)


def test_mcap_of_protobuf(tmp_path: Path) -> None:
    pytest.importorskip("mcap_protobuf")
    write_mcap_protobuf(tmp_path / "run.mcap")
    log = read(tmp_path / "run.mcap")
    assert np.array_equal(log["/drive/q"], Q) and np.array_equal(log["/drive/u[1]"], U[:, 1])
    assert log.clock["/drive/q"] == "header" and np.array_equal(log["/drive/at/x"][1::2], np.arange(1, ROWS, 2))
    assert np.isnan(log["/drive/at/x"][::2]).all() and log["time_s"][1] == pytest.approx(0.005, abs=1e-12)


def test_names_are_those_of_plotjuggler(tmp_path: Path) -> None:
    pytest.importorskip("mcap")
    point = {"positions": [1.0, 2.0], "velocities": [3.0, 4.0], "time_from_start": {"sec": 0, "nanosec": 0}}
    stamp = {"header": {"stamp": {"sec": 5, "nanosec": 7}, "frame_id": ""}, "joint_names": ["arm", "elbow"]}
    values = [{"interface_names": ["effort", "temperature"], "values": [k, 30 + k]} for k in range(2)]
    pose = {"position": {"x": 0.5}, "orientation": {"w": 1}}
    messages = [
        ("/ctrl", 1, {**stamp, "reference": point, "feedback": point, "output": {"effort": [9.0]}}),
        ("/dynamic_joint_states", 2, {**stamp, "interface_values": values}),
        ("/mocap", 3, {"header": {"stamp": {"sec": 0, "nanosec": 0}}, "pose": pose}),
        ("/lowstate", 4, {"motor_state": [{"q": 0.1}, {"q": 0.2}]}),
    ]
    write_mcap_json(tmp_path / "run.mcap", messages)
    log = read(tmp_path / "run.mcap")
    held = {name: float(log[name][np.isfinite(log[name])][0]) for name in log.columns}
    expected = {
        "/ctrl/elbow/reference/positions": 2,
        "/ctrl/arm/feedback/velocities": 3,
        "/dynamic_joint_states/elbow/temperature": 31,
        "/mocap/pose/position/x": 0.5,
        "/lowstate/motor_state[1]/q": 0.2,
    }
    assert {name: held.get(name) for name in expected} == expected
    assert log.clock["/ctrl/arm/reference/positions"] == "header" and log.clock["/mocap/pose/position/x"] == "receive"
    assert not [name for name in log.columns if "header" in name or "output" in name]


def test_goals_are_no_commands(tmp_path: Path) -> None:
    pytest.importorskip("mcap")
    points = [{"positions": [0.0]}, {"positions": [1.0]}]
    messages = [("/goal", 10**9 * k, {"joint_names": ["arm"], "points": points}) for k in range(3)]
    path = tmp_path / "run.mcap"
    write_mcap_json(path, [*messages, *(("/q", 10**9 * k, {"x": k}) for k in range(3))])
    log = read(path)
    assert log.columns == ("time_s", "/q/x") and "goals of several points: /goal" in log.findings[0]
    with pytest.raises(gs.InputError, match="goals of several points.*record the controller's state"):
        read(path, topics=["/goal"])
    write_mcap_json(path, [(t, ns, {**m, "points": points[1:]}) for t, ns, m in messages])
    assert np.array_equal(read(path)["/goal/arm/positions"], [1, 1, 1])


def test_stamps_of_several_rates(tmp_path: Path) -> None:
    """Closer than 20 us is one row; a burst within it is told; one rate alone keeps all of its rows."""
    pytest.importorskip("mcap")
    a = [("/a", k * 1_000_000, {"x": k}) for k in range(10)]
    b = [("/b", k * 1_000_000 + 15_000 * (k % 3), {"y": k}) for k in range(10)]
    write_mcap_json(tmp_path / "run.mcap", a + b)
    log = read(tmp_path / "run.mcap")
    assert len(log["time_s"]) == 13 and np.isfinite(log["/a/x"]).sum() == np.isfinite(log["/b/y"]).sum() == 10
    write_mcap_json(tmp_path / "run.mcap", a + [("/b", 5_000 * k, {"y": k}) for k in range(10)])
    log = read(tmp_path / "run.mcap")
    assert np.array_equal(log["time_s"][:3], [0, 25e-6, 1e-3]) and np.array_equal(log["/b/y"][:2], [4, 9])
    assert "8 messages of /b share their stamp" in log.findings[0]
    write_mcap_json(tmp_path / "run.mcap", [("/b", 5_000 * k, {"y": k}) for k in range(10)])
    assert np.array_equal(read(tmp_path / "run.mcap")["/b/y"], np.arange(10))


def test_definitions_that_a_bag_lacks(tmp_path: Path) -> None:
    """As bags in .db3 up to Humble do."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    text = "float64 q\n"
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, "rig/msg/Drive"))
    with Writer(tmp_path / "bag", version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/drive", "rig/msg/Drive", typestore=store)
        for k in range(ROWS):
            data = store.serialize_cdr(store.types["rig/msg/Drive"](q=Q[k]), "rig/msg/Drive")
            writer.write(connection, 10**12 + k * 5_000_000, data)
    database = next((tmp_path / "bag").glob("*.db3"))
    with contextlib.closing(sqlite3.connect(database)) as connection, connection:
        connection.execute("DELETE FROM message_definitions")
    with pytest.raises(gs.InputError, match="rig/msg/Drive.*msgs: FOLDER"):
        read(tmp_path / "bag")
    with pytest.raises(gs.InputError, match="without .msg files"):
        read(tmp_path / "bag", msgs=str(tmp_path / "bag"))
    folder = tmp_path / "src" / "rig" / "msg"
    folder.mkdir(parents=True)
    (folder / "Drive.msg").write_text(text)
    assert np.array_equal(read(tmp_path / "bag", msgs=str(tmp_path / "src"))["/drive/q"], Q)


def test_pace_is_read_with_weights_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.pt"
    path.write_bytes(pickle.dumps({"time": 0}))
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(gs.InputError, match="pip install torch"):
        read_table(path)

    class Torch:
        __version__ = "2.5.1"

        @staticmethod
        def load(path: Path, *, map_location: str, weights_only: bool) -> Any:
            assert weights_only and map_location == "cpu"
            raise pickle.UnpicklingError("Weights only load failed")

    monkeypatch.setitem(sys.modules, "torch", Torch)
    with pytest.raises(gs.InputError, match="too old"):
        read_table(path)
    Torch.__version__ = "2.6.0+cpu"
    with pytest.raises(gs.InputError, match="more than tensors"):
        read_table(path)


def test_what_a_source_says_is_checked(tmp_path: Path) -> None:
    bad: list[tuple[Any, str]] = [({"topic": "a"}, "'topic'"), ({"topics": 3}, "topics"), ([], "no mapping")]
    for options, says in [*bad, ({"time": ["a", "b"]}, "one text")]:
        with pytest.raises(gs.InputError, match=says):
            Source.of(options, "here")
    assert Source.of({"topics": "/a", "variable": "x"}, "here") == Source(topics=("/a",), variable="x")
    experiment = tmp_path / "experiment.yaml"
    experiment.write_text("model: a.xml\nlog:\n  source: {variable: run}\n")
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file["run/time_s"], file["walk/time_s"], file["run/q"] = TIME, TIME, Q
        file["run/q"].attrs["unit"] = "deg"
    assert gs.read(path, experiment).columns == ("q", "time_s")
    assert gs.read(path, experiment, variable="walk").columns == ("time_s",)
    saved = gs.Log(gs.read(path, experiment).save(tmp_path / "run.npz"))
    assert np.array_equal(saved["q"], Q) and saved.to_pandas().columns.tolist() == ["q", "time_s"]


def test_images_stay_unread(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["time_s"], file["q"] = TIME, Q
        file.create_dataset("image", (ROWS, 480, 640, 3), "u1", chunks=(1, 480, 640, 3))
    log = read(tmp_path / "run.h5")
    assert log.columns == ("q", "time_s") and "image" in log.findings[0]


def test_what_the_program_reads_itself(tmp_path: Path) -> None:
    """A SAGE folder, whose two files have stamps of their own, and a CSV: their columns through the program."""
    (tmp_path / "joint_list.txt").write_text("hip\nknee\n")
    (tmp_path / "state_motor.csv").write_text('time,positions\n0,"[1, 2]"\n1,"[3, 4]"\n2,"[5, 6]"\n')
    (tmp_path / "control.csv").write_text('time,positions\n0.5,"[7, 8]"\n1.5,"[9, 10]"\n')
    log = gs.read(tmp_path)
    assert log.columns == ("time", "positions/hip", "positions/knee", "control/positions/hip", "control/positions/knee")
    assert np.array_equal(log["control/positions/knee"], [np.nan, 8, 10], equal_nan=True)
    assert gs.Log(log.save(tmp_path / "run.npz"))["positions/hip"].tolist() == [1, 3, 5]


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
    kept = experiment_at(tmp_path / "experiment.yaml", experiment, log="\n  repair: {missing: keep}")
    whole = gs.replay(experiment, demo).error
    assert gs.replay(kept, tmp_path / "half.parquet").error == pytest.approx(whole, rel=0.02)


def test_a_missing_library_names_its_cure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "run.parquet").write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(gs.InputError, match=r"pip install 'gapscope\[parquet\]'"):
        read_table(tmp_path / "run.parquet")


def test_time_is_found_or_asked_for(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    parquet.write_table(pa.table({"clk": TIME, "q": Q}), tmp_path / "run.parquet")
    with pytest.raises(gs.InputError, match="time='NAME'"):
        gs.read(tmp_path / "run.parquet")
    assert gs.Log(tmp_path / "run.parquet", time="clk").time == "clk"
