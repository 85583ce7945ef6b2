"""Measured and predicted signals over time, as the program writes them (traces/*.csv)."""

from __future__ import annotations

import json
import math
import re
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._log import Floats, converted


@dataclass(frozen=True)
class Trace:
    """A signal of one log over time, SI, each of shape (rows,); NaN where the log has no value."""

    time_s: Floats
    measured: Floats
    predicted: Floats


class Traces(Mapping[str, Trace]):
    """The traces of one log by signal, arrays of shape (rows,) in SI; read from disk when the first is asked for.

    They are views of a memory map, and cannot be written to: `.copy()` can. They outlive the result and its files.
    """

    def __init__(self, path: Path, keep: Any = None) -> None:
        self.path = path
        self._keep = keep
        self._columns: dict[str, Floats] | None = None

    def _load(self) -> dict[str, Floats]:
        if self._columns is None:
            self._columns = _mapped(self.path)
        return self._columns

    def __getitem__(self, signal: str) -> Trace:
        columns = self._load()
        return Trace(columns["__time"], columns[f"measured/{signal}"], columns[f"predicted/{signal}"])

    def __iter__(self) -> typing.Iterator[str]:
        return (name.removeprefix("measured/") for name in self._load() if name.startswith("measured/"))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def commands(self) -> Mapping[str, Floats]:
        """What drove the model, by actuator: of shape (rows,), in the SI unit of its command."""
        return {
            name.removeprefix("command/"): values
            for name, values in self._load().items()
            if name.startswith("command/")
        }


def _mapped(path: Path) -> dict[str, Floats]:
    """The columns of a CSV file, which the program reads, each of shape (rows,), as views of one map that is read only.

    The mapped file is removed at once: the system keeps what it held until the last view is gone.
    """
    with converted(path) as table, np.load(table, allow_pickle=False) as archive:
        names: list[str] = json.loads(archive["meta"].tobytes())["names"]
        numbers = table.with_name("numbers")
        # Written, not mapped to be written: what a full disk does to a map ends the interpreter.
        with numbers.open("wb") as file:
            for k in range(len(names)):
                archive[f"c{k}"].tofile(file)
        whole = np.memmap(numbers, np.float64, mode="r").reshape(len(names), -1)
    return dict(zip(names, np.asarray(whole), strict=True))


@dataclass(frozen=True)
class Drawn:
    """What report.html draws of one signal of one log: ``measured`` and ``predicted`` of shape (points,), SI."""

    log: str
    from_s: float  #: of a part of a log: where it begins
    signal: str
    error: float  #: normalised, of the model that was found
    measured: Floats
    predicted: Floats


_DATA = re.compile(r'<script type="application/json" id="report-data">(.*?)</script>', re.DOTALL)


def judging(report: Path) -> tuple[Drawn, ...]:
    """The signals of the logs that judged a result, as its report draws them; of none where there is no report."""
    found = _DATA.search(report.read_text(encoding="utf-8")) if report.is_file() else None
    logs = [log for log in json.loads(found[1])["logs"] if "traces" in log] if found else []
    held_out = [log for log in logs if log["held_out"]]
    return tuple(
        Drawn(
            log["path"],
            log["from_s"],
            signal["name"],
            _float(signal["error"]),
            _floats(signal["measured"]),
            _floats(signal["predicted"][-1]["values"]),
        )
        for log in held_out or logs
        for signal in log["traces"]["signals"]
        if signal["predicted"]
    )


def _floats(values: list[float | None]) -> Floats:
    return np.array(values, dtype=np.float64)  # null: NaN


def _float(value: float | None) -> float:
    return math.nan if value is None else float(value)
