"""LeRobot's datasets: an episode is a log, whichever files hold it."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest
from conftest import JOINT, experiment_at
from gapscope._program import program
from test_converter import converter
from test_formats import ROWS, U, read


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
    assert np.array_equal(read(f"{tmp_path}#1")["action/lift"], (U[:, 1].astype(np.float32) + 1).astype(float))
    assert logs[0].clock["action/pan"] == "synthetic" and "not measured" in logs[0].findings[0]
    assert len(gs.read_all(f"{tmp_path}#0:1")) == 1
    with pytest.raises(gs.InputError, match="no such episode.*#7"):
        read(f"{tmp_path}#7")
    with pytest.raises(gs.InputError, match="several recordings"):
        read(tmp_path)


# Files of a dataset, and the episodes in each.
LEROBOT_FILES = {
    "v2.1": {f"chunk-{k // 2:03d}/episode_{k:06d}": [k] for k in range(5)},
    "v3.0": {"chunk-000/file-000": [0, 1], "chunk-000/file-001": [2], "chunk-001/file-000": [3, 4]},
}


def write_lerobot(folder: Path, version: str) -> list[Path]:
    """Five episodes of models/joint, of 100 to 140 rows, in several files; a CSV of each, beside the folder."""
    import pyarrow as pa
    import pyarrow.parquet as parquet

    names: Any = ["joint"] if version == "v3.0" else {"motors": ["joint"]}
    feature = {"names": names, "shape": [1], "dtype": "float32"}
    info = {"codebase_version": version, "fps": 50, "features": {"action": feature, "observation.state": feature}}
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps(info))

    def episode(k: int) -> Any:
        stamps = (np.arange(100 + 10 * k) / 50).astype(np.float32)
        moves = {"action": np.sin((3 + k) * stamps) / 5, "observation.state": np.sin((3 + k) * stamps - 0.4) / 6}
        lists = {name: list(values.astype(np.float32)[:, None]) for name, values in moves.items()}
        rows = np.arange(len(stamps))
        return pa.table({**lists, "timestamp": stamps, "frame_index": rows, "episode_index": np.full(len(rows), k)})

    for name, held in LEROBOT_FILES[version].items():
        path = folder / "data" / f"{name}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(pa.concat_tables([episode(k) for k in held]), path)
    tables = []
    for k in range(5):
        table = episode(k)
        action, state = ([value for (value,) in table[name].to_pylist()] for name in ("action", "observation.state"))
        rows = zip(table["timestamp"].to_pylist(), action, state, strict=True)
        text = [f"{t!r},{u!r},{q!r}" for t, u, q in rows]
        tables.append(folder.with_name(f"episode_{k}.csv"))
        tables[-1].write_text("\n".join(["timestamp,action/joint,observation.state/joint", *text]) + "\n")
    return tables


@pytest.mark.parametrize("version", LEROBOT_FILES)
def test_a_lerobot_dataset_of_several_files_is_several_logs(tmp_path: Path, version: str) -> None:
    pytest.importorskip("pyarrow")
    tables = [gs.Log(path) for path in write_lerobot(tmp_path / "set", version)]
    logs = gs.read_all(tmp_path / "set")
    assert [log.name for log in logs] == [f"set#{k}" for k in range(5)]
    for log, table in zip(logs, tables, strict=True):
        assert set(log.columns) == set(table.columns)
        assert all(np.array_equal(log[name], table[name]) for name in table.columns), log.name
    across = gs.read_all(f"{tmp_path / 'set'}#1:4")  # of three files, in each chunk
    assert [log.name for log in across] == ["set#1", "set#2", "set#3"]
    assert np.array_equal(across[2]["action/joint"], tables[3]["action/joint"])
    with pytest.raises(gs.InputError, match="several recordings.*gs.read_all"):
        gs.read(tmp_path / "set")


@pytest.mark.parametrize("version", LEROBOT_FILES)
def test_commands_take_a_dataset_as_its_episodes(tmp_path: Path, version: str) -> None:
    pytest.importorskip("pyarrow")
    names = {"target_rad": "action/joint", "position_rad": "observation.state/joint", "time_s": "timestamp"}
    bound = experiment_at(tmp_path / "experiment.yaml", JOINT, names)
    tables, dataset = write_lerobot(tmp_path / "set", version), tmp_path / "set"
    whole = gs.replay(bound, dataset)
    expected = gs.replay(bound, tables)
    assert [Path(log.log).stem for log in whole.logs] == [f"set#{k}" for k in range(5)]
    errors = [log.signals["position_rad"].nrmse for log in expected.logs]
    assert len(set(errors)) == 5 and [log.signals["position_rad"].nrmse for log in whole.logs] == errors
    assert [one.time["rows"] for one in gs.inspect(dataset)] == [100, 110, 120, 130, 140]
    fit: dict[str, Any] = {"starts": 1, "free": ["joint.damping"]}
    parts = gs.tune(bound, f"{dataset}#0:3", hold_out=f"{dataset}#3:5", **fit)
    of_tables = gs.tune(bound, tables[:3], hold_out=tables[3:], **fit)
    assert [Path(log.log).stem for log in parts.held_out] == ["set#3", "set#4"] and len(parts.train) == 3
    assert parts["joint.damping"].value == of_tables["joint.damping"].value


def test_the_program_takes_a_dataset_as_its_episodes(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    names = {"target_rad": "action/joint", "position_rad": "observation.state/joint", "time_s": "timestamp"}
    bound = experiment_at(tmp_path / "experiment.yaml", JOINT, names)
    tables, dataset = write_lerobot(tmp_path / "set", "v3.0"), tmp_path / "set"

    def run(*words: object, status: int = 0) -> Any:
        call = [str(program()), *map(str, words), "--json"]
        done = subprocess.run(call, capture_output=True, text=True, env=converter(tmp_path))
        assert done.returncode == status, done.stderr
        return json.loads(done.stdout) if status == 0 else done.stderr

    whole = run("replay", bound, dataset)
    assert [log["log"] for log in whole["logs"]] == [f"{dataset}#{k}" for k in range(5)]
    assert whole["error"] == run("replay", bound, *tables)["error"]
    words = ["--hold-out", f"{dataset}#3:5", "--free", "joint.damping", "--starts", 1]
    parts = run("tune", bound, f"{dataset}#0:3", *words)
    assert [log["log"] for log in parts["train"]] == [f"{dataset}#{k}" for k in range(3)]
    assert [log["log"] for log in parts["held_out"]] == [f"{dataset}#{k}" for k in (3, 4)]
    assert [log["time"]["rows"] for log in run("inspect", f"{dataset}#1:3")["logs"]] == [110, 120]
    assert len(run("convert", dataset, "--out", tmp_path / "tables")["logs"]) == 5
    assert "no such episode" in run("replay", bound, f"{dataset}#7:9", status=2)
