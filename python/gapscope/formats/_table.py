"""What a reader gives, and what readers share: limits, names, the join of several rates."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gapscope._errors import InputError, import_needed

Floats = npt.NDArray[np.float64]

MOST_VALUES = 400_000_000  # numbers in one table, 3.2 GB: what a file claims beyond is refused before it is read
MOST_COLUMNS = 10_000  # as many as the program takes
MOST_ELEMENTS = 1_000  # of one row of an array: beyond it is an image or a cloud, which is left out
SAME_STAMP_NS = 20_000  # stamps of several rates closer than this are one row


@dataclass(frozen=True)
class Table:
    """Columns of equal length, shape (rows,), NaN where there is no value."""

    columns: Mapping[str, Floats]
    time: str
    name: str = ""
    header: Mapping[str, float | str] = field(default_factory=dict)
    #: of the columns whose unit the file states
    units: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[str, ...] = ()
    #: of each column: what its stamps are, "header" (of the message), "receive", "sampled" or "synthetic"
    clock: Mapping[str, str] = field(default_factory=dict)
    #: whether several rates were joined, so that NaN is no loss but another rate
    joined: bool = False


@dataclass(frozen=True)
class Source:
    """What to take of a file: the keys of ``log: {source: {...}}`` in an experiment.

    ``topics`` of a bag. ``msgs``: a folder of .msg files, for bags that do not hold their own definitions.
    ``variable`` of a MAT file, or a group of an HDF5 file. ``time`` names the column of stamps where its name does not
    say it. ``joints`` are the names of the elements of arrays of as many: q/NAME for q[0]. ``episodes`` of a dataset.
    """

    topics: tuple[str, ...] = ()
    msgs: str = ""
    variable: str = ""
    time: str = ""
    joints: tuple[str, ...] = ()
    episodes: str = ""

    @classmethod
    def of(cls, options: Any, where: str) -> Source:
        """From the keys of an experiment. Errors: not a mapping, an unknown key, a value of another kind."""
        if not isinstance(options, Mapping):
            raise InputError("'source' is no mapping", where, repr(options)[:80], "keys and values")
        known = {one.name: one.default for one in fields(cls)}
        taken: dict[str, Any] = {}
        for key, value in options.items():
            if key not in known:
                raise InputError("an unknown key of 'source'", where, repr(key), ", ".join(known))
            many = isinstance(known[key], tuple)
            values = [value] if isinstance(value, str) else value
            if not isinstance(values, (list, tuple)) or not all(isinstance(v, str) for v in values):
                raise InputError(f"'{key}' of 'source' is no text", where, repr(value)[:80], "texts")
            if not many and len(values) != 1:
                raise InputError(f"'{key}' of 'source' is no text", where, repr(value)[:80], "one text")
            taken[key] = tuple(values) if many else values[0]
        return replace(cls(), **taken)

    def of_episodes(self, episodes: str) -> Source:
        return replace(self, episodes=episodes)


@dataclass(frozen=True)
class Format:
    """A format: what a file of it is called, how it is known, and how it is read.

    Whatever ``read`` raises beside InputError is told as a file that cannot be read: its bytes are a stranger's.
    """

    name: str
    extra: str  # of pip install 'gapscope[EXTRA]'
    knows: Callable[[Path], bool]
    read: Callable[[Path, Source], tuple[Table, ...]]
    cure: str = "record it again"  # of a file that cannot be read
    slow: tuple[str, ...] = ()  # by these libraries, so that the table is kept (_cache.py)


def library(module: str, what: str, extra: str) -> Any:
    """A reader's library, when it is needed first."""
    install = f"'gapscope[{extra}]'" if extra else module
    return import_needed(module, f"the library that reads {what} is not installed", install)


def claims(path: Path, what: str, shape: Sequence[int]) -> None:
    """Refuses an array that is too large before it is read."""
    if np.prod([float(n) for n in shape]) > MOST_VALUES:
        raise InputError("a table too large", f"{path}, {what}", f"{tuple(shape)} numbers", f"{MOST_VALUES} in all")


def spread(name: str, values: npt.NDArray[Any], labels: Sequence[str] | None = None) -> dict[str, Floats]:
    """An array as columns: (rows,) and (rows, 1) are one; (rows, n) is NAME/LABEL of each, or NAME[0] ...

    None of an image or a cloud, of more than MOST_ELEMENTS a row.
    """
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.ndim == 1:
        return {name: np.ascontiguousarray(numbers)}
    elements = int(np.prod(numbers.shape[1:]))
    if elements > MOST_ELEMENTS:
        return {}
    flat = numbers.reshape(len(numbers), elements)
    known = labels if labels is not None and len(labels) == elements else None
    if elements == 1 and known is None:
        return {name: np.ascontiguousarray(flat[:, 0])}
    names = [f"{name}[{k}]" if known is None else f"{name}/{known[k]}" for k in range(elements)]
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


def of_arrays(path: Path, arrays: Mapping[str, Floats], time: str, skipped: Sequence[str], **rest: Any) -> Table:
    """Columns as long as the time's; others, and what was skipped before, are left out and told."""
    rows = len(arrays[time])
    kept = {name: values for name, values in arrays.items() if len(values) == rows}
    left = [name for name in arrays if name not in kept]
    findings = []
    if skipped:
        findings.append(f"left out, being no columns of numbers: {', '.join(skipped[:20])}")
    if left:
        findings.append(f"left out, being of other lengths than {time!r}: {', '.join(left[:20])}")
    clock = {name: "sampled" for name in kept}
    return Table(kept, time, name=path.stem, findings=tuple(findings), clock=clock, **rest)


_ELEMENT = re.compile(r"(.*)\[(\d+)\]")


def named_elements(table: Table, joints: Sequence[str]) -> Table:
    """Elements q[0] ... of arrays of as many as there are joints, by the joints' names: q/NAME."""
    arrays: dict[str, set[int]] = {}
    for name in table.columns:
        if found := _ELEMENT.fullmatch(name):
            arrays.setdefault(found[1], set()).add(int(found[2]))
    wanted = {array for array, elements in arrays.items() if elements == set(range(len(joints)))}

    def renamed(name: str) -> str:
        found = _ELEMENT.fullmatch(name)
        return f"{found[1]}/{joints[int(found[2])]}" if found and found[1] in wanted else name

    return replace(
        table,
        columns={renamed(name): values for name, values in table.columns.items()},
        units={renamed(name): unit for name, unit in table.units.items()},
        clock={renamed(name): clock for name, clock in table.clock.items()},
    )


@dataclass(frozen=True)
class Series:
    """Columns of one rate: stamps in ns and values of equal length."""

    stamps: npt.NDArray[np.int64]
    columns: Mapping[str, Floats]
    clock: str


def join(path: Path, series: Sequence[Series]) -> tuple[Floats, dict[str, Floats]]:
    """All stamps, in order, in s from the first; each column NaN where its own series has no row: `missing: keep`."""
    same_ns = SAME_STAMP_NS if len(series) > 1 else 0
    every = np.unique(np.concatenate([s.stamps for s in series]))
    kept = [int(every[0])]
    for stamp in every.tolist():
        if stamp - kept[-1] > same_ns:
            kept.append(stamp)
    rows = np.array(kept, dtype=np.int64)
    claims(path, "all rates joined", (len(rows), sum(len(s.columns) for s in series)))
    columns: dict[str, Floats] = {}
    for one in series:
        at = np.searchsorted(rows, one.stamps, side="right") - 1
        for name, values in one.columns.items():
            column = np.full(len(rows), np.nan)
            column[at] = values
            columns[name] = column
    return (rows - rows[0]) * 1e-9, columns
