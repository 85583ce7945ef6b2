"""Tables that are kept: found again, replaced where damaged, bounded, shared by processes."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import gapscope as gs
import numpy as np
import pytest
from gapscope._program import program
from gapscope.formats import Source, _cache
from gapscope.formats._cache import through_cache

from test_converter import converter
from test_formats import write_mcap_json


class Converter:
    """Writes the file's bytes as a table, and counts."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.calls = 0

    def __call__(self, out: Path) -> None:
        self.calls += 1
        gs.Log({"t": [0.0, 1.0], "x": np.frombuffer(self.path.read_bytes()[:2], dtype=np.uint8)}).save(out)

    def read(self, out: Path, source: Source = Source()) -> bytes:
        through_cache(self.path, source, ("numpy",), out, self)
        return gs.Log(out)["x"].astype(np.uint8).tobytes()


@pytest.fixture
def raw(tmp_path: Path) -> Path:
    path = tmp_path / "run.raw"
    path.write_bytes(b"ab" * 100)
    return path


def entries(cache: Path) -> list[Path]:
    return sorted((cache / "tables").iterdir())


def test_the_second_time_it_is_not_converted(raw: Path, tmp_path: Path, cache: Path) -> None:
    convert = Converter(raw)
    assert convert.read(tmp_path / "one.npz") == convert.read(tmp_path / "two.npz") == b"ab"
    assert convert.calls == 1 and len(entries(cache)) == 1
    moved = tmp_path / "elsewhere" / raw.name
    moved.parent.mkdir()
    raw.rename(moved)
    again = Converter(moved)
    assert again.read(tmp_path / "three.npz") == b"ab" and again.calls == 0


def test_whatever_else_is_converted_anew(raw: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    convert, out = Converter(raw), tmp_path / "out.npz"
    definitions = tmp_path / "src" / "rig" / "msg" / "Drive.msg"
    definitions.parent.mkdir(parents=True)
    definitions.write_text("float64 q")
    msgs = Source(msgs=str(tmp_path / "src"))

    def bytes_of_one_length() -> None:
        stat = raw.stat()
        raw.write_bytes(b"cd" * 100)
        os.utime(raw, ns=(stat.st_atime_ns, stat.st_mtime_ns))

    changes: list[Callable[[], object]] = [
        lambda: convert.read(out),
        lambda: convert.read(out, Source(topics=("/a",))),
        lambda: convert.read(out, msgs),
        lambda: definitions.write_text("float64 v") and convert.read(out, msgs),
        lambda: bytes_of_one_length() or convert.read(out),
        lambda: monkeypatch.setattr(_cache, "_version", lambda _: "0.1") or convert.read(out),
    ]
    for k, change in enumerate(changes):
        change()
        assert convert.calls == k + 1
    assert convert.read(out) == b"cd" and convert.calls == len(changes)


B = np.float64(ord("b")).tobytes()  # a value of the table


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-30], lambda b: b"", lambda b: b.replace(B, b"\xff" * 8), lambda b: b[9:]]
)
def test_what_is_damaged_is_replaced(
    damage: Callable[[bytes], bytes], raw: Path, tmp_path: Path, cache: Path
) -> None:
    convert = Converter(raw)
    convert.read(tmp_path / "out.npz")
    (entry,) = entries(cache)
    whole = entry.read_bytes()
    entry.write_bytes(damage(whole))
    assert entry.read_bytes() != whole
    for _ in range(2):
        assert convert.read(tmp_path / "out.npz") == b"ab" and convert.calls == 2
    assert entries(cache) == [entry]


def test_the_one_that_was_used_longest_ago_goes(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    converters = []
    for k in range(3):
        path = tmp_path / f"{k}.raw"
        path.write_bytes(bytes([k, k]))
        converters.append(Converter(path))
    first, second, third = converters
    first.read(tmp_path / "out.npz")
    size = entries(cache)[0].stat().st_size
    monkeypatch.setattr(_cache, "MOST_BYTES", 2 * size + 10)
    for convert in (second, first, third):
        convert.read(tmp_path / "out.npz")
    assert len(entries(cache)) == 2
    first.read(tmp_path / "out.npz")
    second.read(tmp_path / "out.npz")
    assert (first.calls, second.calls, third.calls) == (1, 2, 1)
    monkeypatch.setattr(_cache, "MOST_BYTES", size - 1)
    third.path.write_bytes(b"new")
    third.read(tmp_path / "out.npz")
    assert len(entries(cache)) == 2  # what is larger than all of it drives nothing out


def test_a_file_that_is_being_recorded_is_not_kept(raw: Path, tmp_path: Path, cache: Path) -> None:
    def convert(out: Path) -> None:
        raw.write_bytes(b"abc")
        gs.Log({"t": [0.0]}).save(out)

    through_cache(raw, Source(), (), tmp_path / "out.npz", convert)
    assert not (cache / "tables").exists()


def test_without_a_cache_it_works(raw: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("GAPSCOPE_CACHE_DIR", str(tmp_path / "file"))
    convert = Converter(raw)
    assert convert.read(tmp_path / "out.npz") == convert.read(tmp_path / "out.npz") == b"ab" and convert.calls == 2
    monkeypatch.delenv("GAPSCOPE_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    convert.read(tmp_path / "out.npz")
    assert len(list((tmp_path / "xdg" / "gapscope" / "tables").iterdir())) == 1


def test_program_and_package_share_it(tmp_path: Path, cache: Path) -> None:
    """What is kept is what is read: another table in its place shows."""
    pytest.importorskip("mcap")
    path = tmp_path / "run.mcap"
    write_mcap_json(path, [("/a", 10_000_000 * k, {"q": k}) for k in range(50)])
    assert np.array_equal(gs.read(path)["/a/q"], np.arange(50))
    (entry,) = entries(cache)
    gs.Log({"time_s": [0.0, 1.0], "/b": [7.0, 8.0]}).save(entry)
    assert gs.read(path).columns == ("time_s", "/b")
    assert [log.columns for log in gs.read_all(path)] == [("time_s", "/b")]
    (found,) = gs.inspect(path)  # a command
    assert [channel.name for channel in found.channels] == ["/b"] and entries(cache) == [entry]
    command = [str(program()), "convert", str(path), "--out", str(tmp_path / "tables")]
    subprocess.run(command, check=True, env=converter(tmp_path), capture_output=True)
    assert np.array_equal(gs.Log(tmp_path / "tables" / "run.npz")["/b"], [7, 8])
    entry.unlink()
    with ThreadPoolExecutor(4) as pool:  # each a process of its own, all at the same entry
        logs = list(pool.map(gs.read, [path] * 8))
    assert all(np.array_equal(log["/a/q"], np.arange(50)) for log in logs) and entries(cache) == [entry]
