"""LeRobot datasets, v2.1 and v3.0, by their own meta/info.json: an episode is a log.

Stamps are frame_index / fps, not measured: the clock is "synthetic", and a delay found in such a log may be the
recorder's. Units are the dataset's own (degrees, or -100 .. 100 of the calibrated range).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats import _arrow
from gapscope.formats._table import Format, Source, Table

_STAMPS = "stamps are frame / fps, not measured: a delay in this log may be the recorder's"
_BOOKKEEPING = ("frame_index", "episode_index", "index", "task_index")


def _knows(path: Path) -> bool:
    return path.is_dir() and (path / "meta" / "info.json").is_file()


def _labels(info: Any) -> dict[str, Sequence[str]]:
    found: dict[str, Sequence[str]] = {}
    for name, feature in info["features"].items():
        names = feature.get("names")
        if isinstance(names, dict):  # {"motors": [...]} in v2
            names = next((value for value in names.values() if isinstance(value, list)), None)
        if isinstance(names, list):
            found[name] = [str(one) for one in names]
    return found


def _asked(path: Path, episodes: str) -> tuple[int, float]:
    """The first episode that is asked for, and the first behind them."""
    if not episodes:
        return 0, math.inf
    first, colon, last = episodes.partition(":")
    low = int(first or 0)
    high = (int(last) if last else math.inf) if colon else low + 1
    if high <= low:
        raise InputError("no episode between these", str(path), f"#{episodes}", "#3, #0:20")
    return low, high


def _files(path: Path, low: int, high: float) -> Iterator[Path]:
    """Data files; of v2.1, which has one an episode, those that are asked for."""
    for file in sorted((path / "data").glob("**/*.parquet")):
        own = re.fullmatch(r"episode_(\d+)", file.stem)
        if own is None or low <= int(own[1]) < high:
            yield file


def episodes(path: Path, asked: str) -> list[int]:
    """Numbers of the episodes that are there of those that are asked for ("", "3", "0:20")."""
    low, high = _asked(path, asked)
    found: set[int] = set()
    for file in _files(path, low, high):
        table, _ = _arrow.load(file, ("episode_index",))
        _check(file, table.column_names, "episode_index")
        found.update(np.unique(_arrow.columns_of(file, table)["episode_index"]).astype(int).tolist())
    return _some(path, asked, sorted(one for one in found if low <= one < high))


def _check(file: Path, there: Iterable[str], *needed: str) -> None:
    if not set(needed) <= set(there):
        raise InputError(f"a data file without {' and '.join(needed)}", str(file), ", ".join(there))


def _some(path: Path, asked: str, found: list[int]) -> list[int]:
    if not found:
        raise InputError("no such episode", str(path), f"#{asked}" if asked else "no data files")
    return found


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    labels = _labels(json.loads((path / "meta" / "info.json").read_text(encoding="utf-8")))
    low, high = _asked(path, source.episodes)
    tables: dict[int, Table] = {}
    for file in _files(path, low, high):
        table, _ = _arrow.load(file)
        arrays = _arrow.columns_of(file, table, labels)
        _check(file, arrays, "episode_index", "timestamp")
        for episode in np.unique(arrays["episode_index"]).astype(int).tolist():
            if not low <= episode < high:
                continue
            if episode in tables:
                raise InputError("an episode in two files", str(file), f"#{episode}", "each in one")
            rows = arrays["episode_index"] == episode
            columns = {name: values[rows] for name, values in arrays.items() if name not in _BOOKKEEPING}
            clock = {name: "synthetic" for name in columns}
            name = f"{path.resolve().name}#{episode}"
            units = {"timestamp": "s"}
            tables[episode] = Table(columns, "timestamp", name, units=units, findings=(_STAMPS,), clock=clock)
    return tuple(tables[episode] for episode in _some(path, source.episodes, sorted(tables)))


FORMAT = Format("LeRobot dataset", _arrow.FORMAT.extra, _knows, _read)
