"""LeRobot datasets, v2.1 and v3.0, by their own meta/info.json: an episode is a log.

Stamps are frame_index / fps, not measured: the clock is "synthetic", and a delay found in such a log may be the
recorder's. Units are the dataset's own (degrees, or -100 .. 100 of the calibrated range).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
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


def _labels(info: dict[str, Any]) -> dict[str, Sequence[str]]:
    found: dict[str, Sequence[str]] = {}
    for name, feature in info.get("features", {}).items():
        names = feature.get("names") if isinstance(feature, dict) else None
        if isinstance(names, dict):  # {"motors": [...]} in v2
            names = next((value for value in names.values() if isinstance(value, list)), None)
        if isinstance(names, list):
            found[name] = [str(one) for one in names]
    return found


def _asked(path: Path, episodes: str) -> tuple[int, int | None]:
    if not episodes:
        return 0, None
    first, colon, last = episodes.partition(":")
    low = int(first or 0)
    high = (int(last) if last else None) if colon else low + 1
    if high is not None and high <= low:
        raise InputError("no episode between these", str(path), f"#{episodes}", "#3, #0:20")
    return low, high


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    try:
        info = json.loads((path / "meta" / "info.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError("a dataset whose meta/info.json is not JSON", str(path), str(error)[:200]) from None
    low, high = _asked(path, source.episodes)
    labels, tables = _labels(info if isinstance(info, dict) else {}), []
    for file in sorted((path / "data").glob("**/*.parquet")):
        table = _arrow.load(file)
        if "episode_index" not in table.column_names or "timestamp" not in table.column_names:
            there = ", ".join(table.column_names)
            raise InputError("a data file without episode_index and timestamp", str(file), there)
        arrays = _arrow.columns_of(file, table, labels)
        for episode in np.unique(arrays["episode_index"]).astype(int):
            if episode < low or (high is not None and episode >= high):
                continue
            rows = arrays["episode_index"] == episode
            columns = {name: values[rows] for name, values in arrays.items() if name not in _BOOKKEEPING}
            clock = {name: "synthetic" for name in columns}
            name = f"{path.name}#{episode}"
            tables.append((episode, Table(columns, "timestamp", name=name, findings=(_STAMPS,), clock=clock)))
    if not tables:
        raise InputError("no such episode", str(path), f"#{source.episodes}" if source.episodes else "no data files")
    return tuple(table for _, table in sorted(tables, key=lambda entry: entry[0]))


FORMAT = Format("LeRobot", _arrow.FORMAT.extra, _knows, _read)
