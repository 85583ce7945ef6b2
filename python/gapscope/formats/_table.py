"""What a reader gives, and what readers share: limits, names, the join of several rates."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gapscope._errors import InputError

Floats = npt.NDArray[np.float64]

MOST_VALUES = 400_000_000  # numbers in one table, 3.2 GB: what a file claims beyond is refused before it is read
SAME_STAMP_S = 20e-6  # stamps of several rates closer than this are one row


@dataclass(frozen=True)
class Table:
    """Columns of equal length, shape (rows,), NaN where there is no value."""

    columns: Mapping[str, Floats]
    time: str
    name: str = ""
    header: Mapping[str, float | str] = field(default_factory=dict)
    findings: tuple[str, ...] = ()
    #: of each column: what its stamps are, "header" (of the message), "receive", "sampled" or "synthetic"
    clock: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Source:
    """What to take of a file: topics of a bag, a variable or group of a MAT or HDF5 file, episodes of a dataset.

    ``time`` names the column of stamps where its name does not say it.
    """

    topics: tuple[str, ...] = ()
    variable: str = ""
    time: str = ""
    episodes: str = ""

    def of_episodes(self, episodes: str) -> Source:
        return replace(self, episodes=episodes)


@dataclass(frozen=True)
class Format:
    """A format: how it is known, and how it is read."""

    name: str
    extra: str  # of pip install 'gapscope[EXTRA]'
    knows: Callable[[Path], bool]
    read: Callable[[Path, Source], tuple[Table, ...]]


def library(module: str, what: str, extra: str) -> Any:
    """A reader's library, when it is needed first."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise InputError(
            f"the library that reads {what} is not installed",
            where=module,
            cure=f"pip install 'gapscope[{extra}]'",
        ) from None


def unreadable(path: Path, what: str, error: BaseException) -> InputError:
    reason = " ".join(str(error).split())[:200]
    return InputError(f"not a readable {what}", str(path), f"{type(error).__name__}: {reason}", cure="record it again")


def claims(path: Path, what: str, shape: Sequence[int]) -> None:
    """Refuses an array that is too large before it is read."""
    if np.prod([float(n) for n in shape]) > MOST_VALUES:
        raise InputError("a table too large", f"{path}, {what}", f"{tuple(shape)} numbers", f"{MOST_VALUES} in all")


def spread(name: str, values: npt.NDArray[Any], labels: Sequence[str] | None = None) -> dict[str, Floats]:
    """An array as columns: (rows,) is one; (rows, n) is NAME/LABEL of each, or NAME[0] ... NAME[n - 1]."""
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.ndim == 1:
        return {name: np.ascontiguousarray(numbers)}
    flat = numbers.reshape(len(numbers), -1)
    known = labels if labels is not None and len(labels) == flat.shape[1] else None
    names = [f"{name}[{k}]" if known is None else f"{name}/{known[k]}" for k in range(flat.shape[1])]
    return {column: np.ascontiguousarray(flat[:, k]) for k, column in enumerate(names)}


_TIMES = ("time_s", "time", "t", "timestamp", "stamp", "tout", "__time", "time_ms", "time_us", "time_ns")


def find_time(path: Path, names: Iterable[str], asked: str) -> str:
    """The column of stamps: the one that is asked for, else one that is called like a time, alone or behind a slash."""
    given = list(names)
    if asked:
        if asked not in given:
            raise InputError("no such column for the time", str(path), repr(asked), ", ".join(given[:40]))
        return asked
    for known in _TIMES:
        for name in given:
            if name.lower().rsplit("/", 1)[-1].rsplit(".", 1)[-1] == known:
                return name
    raise InputError(
        "no column is called like a time", str(path), ", ".join(given[:40]), ", ".join(_TIMES), "time='NAME'"
    )


def of_arrays(path: Path, arrays: Mapping[str, Floats], time: str, **rest: Any) -> Table:
    """Columns as long as the time's; others are left out and told."""
    rows = len(arrays[time])
    kept = {name: values for name, values in arrays.items() if len(values) == rows}
    left = [name for name in arrays if name not in kept]
    findings = tuple(rest.pop("findings", ())) + (
        (f"left out, being of other lengths than {time!r}: {', '.join(left[:20])}",) if left else ()
    )
    clock = {name: "sampled" for name in kept}
    return Table(kept, time, name=rest.pop("name", path.stem), findings=findings, clock=clock, **rest)


@dataclass(frozen=True)
class Series:
    """Columns of one rate: stamps in s and values of equal length."""

    stamps: Floats
    columns: Mapping[str, Floats]
    clock: str


def join(series: Sequence[Series]) -> tuple[Floats, dict[str, Floats]]:
    """All stamps, in order, from the first; each column NaN where its own series has no row (``missing: keep``)."""
    every = np.sort(np.concatenate([s.stamps for s in series]))
    starts = np.concatenate([[True], np.diff(every) > SAME_STAMP_S])
    rows = every[starts]
    columns: dict[str, Floats] = {}
    for one in series:
        at = np.searchsorted(rows, one.stamps, side="right") - 1
        for name, values in one.columns.items():
            column = np.full(len(rows), np.nan)
            column[at] = values
            columns[name] = column
    return rows - rows[0], columns
