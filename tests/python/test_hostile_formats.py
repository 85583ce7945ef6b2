"""Damaged and hostile files of other tools' formats: refused within a memory limit, and nothing in them is executed."""

from __future__ import annotations

import io
import json
import pickle
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest
from gapscope._program import program
from test_converter import converter
from test_formats import Q, ROWS, TIME, write_bag, write_mcap_protobuf, write_ros1_bag
from test_lerobot import write_lerobot

pytest.importorskip("scipy")
pa = pytest.importorskip("pyarrow")
h5py = pytest.importorskip("h5py")
pytest.importorskip("rosbags")
pytest.importorskip("mcap_protobuf")

# All files in one process of its own, with little memory: a line for each. It is what the converter does.
READS = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, 2 * (int(sys.argv.pop(1)) * 2**30,))
from gapscope import InputError
from gapscope.formats import read_tables
for path in sys.argv[1:]:
    try:
        table = read_tables(path)[0]
        print("read", len(table.columns[table.time]), "rows")
    except InputError as error:
        print("refused:", " ".join(str(error).split()))
"""


def outcomes(paths: list[Path], python: str = sys.executable, gigabytes: int = 3) -> list[str]:
    package = str(Path(gs.__file__).parents[1])
    command = [python, "-W", "ignore", "-c", READS, str(gigabytes), *map(str, paths)]
    run = subprocess.run(command, capture_output=True, text=True, cwd=package, timeout=120)
    lines = run.stdout.splitlines()
    assert run.returncode == 0, (run.returncode, paths[len(lines) : len(lines) + 1], lines[-1:], run.stderr[-800:])
    return lines


def refused(*paths: Path) -> list[str]:
    lines = outcomes(list(paths))
    read = [f"{path.name}: {line}" for path, line in zip(paths, lines) if not line.startswith("refused:")]
    assert not read
    return lines


def whole_files(folder: Path) -> list[Path]:
    """One file of each format."""
    import pyarrow.feather as feather
    import pyarrow.parquet as parquet
    import scipy.io
    from mcap.writer import Writer

    columns = {"time_s": TIME, "q": Q}
    scipy.io.savemat(folder / "v4.mat", columns, format="4")
    scipy.io.savemat(folder / "v5.mat", columns)
    scipy.io.savemat(folder / "v7.mat", columns, do_compression=True)
    with h5py.File(folder / "a.h5", "w") as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values, chunks=(50,), compression="gzip")
    parquet.write_table(pa.table(columns), folder / "a.parquet")
    feather.write_feather(pa.table(columns), str(folder / "a.feather"))
    for name, storage in (("ros.mcap", "mcap"), ("a.db3", "sqlite3")):
        write_bag(folder / storage, storage)
        next((folder / storage).glob(f"*{Path(name).suffix}")).rename(folder / name)
    write_mcap_protobuf(folder / "protobuf.mcap")
    write_ros1_bag(folder / "a.bag")
    with (folder / "json.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("q", "jsonschema", b"{}")
        channel = writer.register_channel("/q", "json", schema)
        for k in range(ROWS):
            writer.add_message(channel, k * 5_000_000, json.dumps({"q": Q[k]}).encode(), k * 5_000_000)
        writer.finish()
    return sorted(path for path in folder.iterdir() if path.is_file())


def test_truncated_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "whole").mkdir()
    whole = whole_files(tmp_path / "whole")
    assert outcomes(whole) == [f"read {300 if path.name in ('ros.mcap', 'a.db3') else ROWS} rows" for path in whole]
    cut = []
    for path in whole:
        raw = path.read_bytes()
        for share in (0.0, 0.02, 0.2, 0.5, 0.8, 0.97):
            cut.append(tmp_path / f"{share}_{path.name}")
            cut[-1].write_bytes(raw[: int(share * len(raw))])
    refused(*cut)


def cut_lerobot(dataset: Path, file: str, share: float) -> Path:
    """A dataset, one of whose files is cut."""
    write_lerobot(dataset, "v3.0")
    raw = (dataset / file).read_bytes()
    (dataset / file).write_bytes(raw[: int(share * len(raw))])
    return dataset


def test_a_dataset_with_a_truncated_file_is_refused(tmp_path: Path) -> None:
    files = ("meta/info.json", "data/chunk-000/file-001.parquet")
    cuts = [(file, share) for file in files for share in (0.0, 0.5, 0.97)]
    refused(*(cut_lerobot(tmp_path / str(k) / "set", *cut) for k, cut in enumerate(cuts)))


def test_damaged_bytes_end_in_a_log_or_a_refusal(tmp_path: Path) -> None:
    (tmp_path / "whole").mkdir()
    random, damaged = np.random.default_rng(5), []
    for path in whole_files(tmp_path / "whole"):
        raw = np.frombuffer(path.read_bytes(), dtype=np.uint8)
        for k in range(12):
            changed = raw.copy()
            changed[random.integers(len(raw), size=1 + 3 * (k % 4))] = random.integers(256)
            damaged.append(tmp_path / f"{k}_{path.name}")
            damaged[-1].write_bytes(changed.tobytes())
    assert len(outcomes(damaged)) == len(damaged)


def varint(number: int) -> bytes:
    """Thrift's compact form of a number of 64 bits."""
    number, out = 2 * number, b""
    while number > 127:
        out, number = out + bytes([number & 127 | 128]), number >> 7
    return out + bytes([number])


def test_what_claims_too_much_is_refused_before_it_is_read(tmp_path: Path) -> None:
    import pyarrow.parquet as parquet

    with h5py.File(tmp_path / "rows.h5", "w") as file:
        file.create_dataset("time_s", shape=(10**9,), dtype="f8", chunks=True)
    with h5py.File(tmp_path / "sum.h5", "w") as file:  # 3e8 rows each, a kilobyte in all
        for name in ("time_s", "q"):
            file.create_dataset(name, shape=(3 * 10**8,), dtype="u1", chunks=(10**6,), compression="gzip")
    (tmp_path / "rows.mat").write_bytes(struct.pack("<5i", 0, 10**9, 1, 0, 7) + b"time_s\0")  # v4: a header alone
    parquet.write_table(pa.table({"time_s": TIME}), tmp_path / "rows.parquet")
    raw = (tmp_path / "rows.parquet").read_bytes()
    (length,) = struct.unpack("<I", raw[-8:-4])
    footer = raw[-8 - length : -8].replace(b"\x16" + varint(ROWS), b"\x16" + varint(10**9))
    assert len(footer) > length
    path = tmp_path / "rows.parquet"
    path.write_bytes(raw[: -8 - length] + footer + struct.pack("<I", len(footer)) + b"PAR1")
    for line in refused(tmp_path / "rows.h5", tmp_path / "sum.h5", tmp_path / "rows.mat", path):
        assert "too large" in line, line


def claim_rows(feather: Path, rows: int) -> Path:
    """A file of two columns that says it has so many rows: in its batch, and in each column."""
    import pyarrow.feather

    pyarrow.feather.write_feather(pa.table({"time_s": TIME, "q": Q}), str(feather))
    raw, said = feather.read_bytes(), struct.pack("<q", ROWS)
    assert raw.count(said) == 3
    feather.write_bytes(raw.replace(said, struct.pack("<q", rows)))
    return feather


def test_rows_that_a_feather_file_has_not_are_refused(tmp_path: Path) -> None:
    """Else they are what the memory behind its own holds."""
    rows = (ROWS + 1, 10**7, 10**9, 2**62, -5)
    lines = refused(*(claim_rows(tmp_path / f"{k}.feather", k) for k in rows))
    assert ["too small" in line for line in lines[:2]] == ["too large" in line for line in lines[2:4]] == [True, True]


def test_bombs_are_refused(tmp_path: Path) -> None:
    """Twenty megabytes that unpack to ten gigabytes."""
    deflate = zlib.compressobj(9)
    block = deflate.compress(bytes(2**24)) + deflate.flush(zlib.Z_FULL_FLUSH)  # may be repeated
    packed = block + 639 * block[2:]
    mat = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x100, b"IM")
    element = zlib.compressobj(9)
    first = struct.pack("<II", 14, 10 * 2**30 & 0xFFFFFFFF) + struct.pack("<4I", 6, 8, 6, 0)
    first += struct.pack("<4I", 5, 8, 5 * 2**28, 1) + struct.pack("<I4s", 1 << 16 | 1, b"t")
    first += struct.pack("<II", 9, 2**31)
    inner = element.compress(first) + element.flush(zlib.Z_FULL_FLUSH) + 640 * block[2:]
    (tmp_path / "junk.mat").write_bytes(mat + struct.pack("<II", 15, len(packed)) + packed)
    (tmp_path / "t.mat").write_bytes(mat + struct.pack("<II", 15, len(inner)) + inner)
    # A frame of zstd: its size, then blocks of one byte repeated.
    blocks = 80 * 2**10
    frame = struct.pack("<IBQ", 0xFD2FB528, 0xE0, blocks * 2**17)
    frame += (blocks - 1) * (struct.pack("<I", 2**17 << 3 | 2)[:3] + b"\0")
    frame += struct.pack("<I", 2**17 << 3 | 3)[:3] + b"\0"
    body = struct.pack("<QQQI", 0, 1, blocks * 2**17, 0) + struct.pack("<I", 4) + b"zstd"
    body += struct.pack("<Q", len(frame)) + frame
    end = b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0) + b"\x89MCAP0\r\n"
    for name, profile in (("ros.mcap", b"ros2"), ("json.mcap", b"")):
        head = struct.pack("<I", len(profile)) + profile + struct.pack("<I", 0)
        head = b"\x89MCAP0\r\n\x01" + struct.pack("<Q", len(head)) + head
        (tmp_path / name).write_bytes(head + b"\x06" + struct.pack("<Q", len(body)) + body + end)
    paths = [tmp_path / name for name in ("junk.mat", "t.mat", "ros.mcap", "json.mcap")]
    assert sum(path.stat().st_size for path in paths) < 2**25
    refused(*paths)


class Evil:
    def __reduce__(self) -> Any:
        return (exec, ("open('executed', 'w')",))


def test_nothing_that_is_read_is_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pyarrow.parquet as parquet
    import scipy.io
    from rosbags.rosbag2 import StoragePlugin, Writer

    monkeypatch.chdir(tmp_path)
    evil = pickle.dumps(Evil())
    paths = [tmp_path / f"evil{suffix}" for suffix in (".mat", ".h5", ".parquet", ".feather", ".bag", ".mcap", ".db3")]
    for path in paths:
        path.write_bytes(evil)
    with h5py.File(tmp_path / "object.h5", "w") as file:
        file["time_s"] = np.array([evil])
    scipy.io.savemat(tmp_path / "object.mat", {"time_s": np.array([evil], dtype=object)})
    parquet.write_table(pa.table({"time_s": [evil]}), tmp_path / "object.parquet")
    # A ROS type whose name or definition is Python: rosbags makes code of definitions.
    for k, (name, text) in enumerate(
        [
            ("a/msg/B:\n  open('executed','w')\nclass C", "float64 x\n"),
            ("a/msg/B", "float64 x\nstring S=\"'+open('executed','w')+'\"\n"),
            ("a/msg/B", "float64 x=open('executed','w')\n"),
            ("a/msg/B", "float64[open('executed','w')] x\n"),
            ("a/msg/B'+open('executed','w')+'", "float64 x\n"),
        ]
    ):
        folder = tmp_path / f"ros{k}"
        with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            connection = writer.add_connection("/b", name, msgdef=text, rihs01="RIHS01_0")
            writer.write(connection, 1, b"\0\1\0\0" + bytes(8))
        paths.append(next(folder.glob("*.mcap")))
    assert outcomes([paths.pop(-4)]) == ["read 1 rows"]  # a text that stays one
    lines = refused(*paths, tmp_path / "object.h5", tmp_path / "object.mat", tmp_path / "object.parquet")
    assert not list(tmp_path.rglob("executed")), lines
    np.savez(tmp_path / "evil.npz", time_s=TIME, q=np.array([Evil()] * ROWS, dtype=object))
    with pytest.raises(gs.InputError, match="object"):
        gs.Log(tmp_path / "evil.npz").columns
    assert not list(tmp_path.rglob("executed"))


def test_a_library_that_crashes_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As scipy 1.17 does on some damaged MAT files."""
    (tmp_path / "h5py.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "run.h5").write_bytes(b"?")
    with pytest.raises(gs.InputError, match="crashes.*signal 11"):
        gs.read(tmp_path / "run.h5")


def test_a_file_of_the_working_folder_is_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "json.py").write_text("open('executed', 'w')\n")
    (tmp_path / "numpy.py").write_text("open('executed', 'w')\n")
    with h5py.File("run.h5", "w") as file:
        file["time_s"] = TIME
    assert np.array_equal(gs.read("run.h5")["time_s"], TIME) and not (tmp_path / "executed").exists()


def test_hdf5_reads_no_other_file(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_bytes(TIME.tobytes())
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("time_s", (ROWS,), "f8", external=[(str(secret), 0, 8 * ROWS)])
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["time_s"] = TIME
    with h5py.File(tmp_path / "b.h5", "w") as file:
        layout = h5py.VirtualLayout((ROWS,), "f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "time_s", (ROWS,))
        file.create_virtual_dataset("time_s", layout)
        file["link"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "time_s")
    refused(tmp_path / "a.h5", tmp_path / "b.h5")
    with pytest.raises(gs.InputError, match="no such group"):
        gs.read(tmp_path / "b.h5", variable="link")


def test_the_program_refuses_with_status_2(experiment: str, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "rows.h5", "w") as file:
        file.create_dataset("time_s", shape=(10**9,), dtype="f8", chunks=True)
    (tmp_path / "cut.mcap").write_bytes(b"\x89MCAP0\r\n")
    for path in whole_files(tmp_path):
        if path.name in ("a.db3", "protobuf.mcap"):
            path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    claim_rows(tmp_path / "rows.feather", 10**7)
    cut_lerobot(tmp_path / "set", "data/chunk-000/file-001.parquet", 0.5)
    for name in ("rows.h5", "cut.mcap", "a.db3", "protobuf.mcap", "rows.feather", "set"):
        command = [str(program()), "replay", experiment, str(tmp_path / name)]
        run = subprocess.run(command, capture_output=True, text=True, env=converter(tmp_path))
        assert run.returncode == 2 and name in run.stderr and run.stdout == "", run.stderr
        assert "not a readable" in run.stderr or "too large" in run.stderr, run.stderr


def test_json_that_grows_without_end_is_refused(tmp_path: Path) -> None:
    from mcap.writer import Writer

    def write(name: str, messages: list[bytes]) -> Path:
        stream = io.BytesIO()
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/q", "json", 0)
        for k, data in enumerate(messages):
            writer.add_message(channel, k, data, k)
        writer.finish()
        (tmp_path / name).write_bytes(stream.getvalue())
        return tmp_path / name

    wide = write("wide.mcap", [json.dumps({f"k{j}": 1 for j in range(11_000)}).encode()])
    deep = write("deep.mcap", [b'{"a":' * 100_000 + b"1" + b"}" * 100_000])
    huge = write("huge.mcap", [b'{"a": 1' + b"0" * 400 + b"}"])
    none = write("none.mcap", [b'"text"'])
    lines = refused(wide, deep, huge, none)
    assert "too large" in lines[0] and "without numbers" in lines[3]
