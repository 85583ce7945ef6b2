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

from gapscope._log import Floats


@dataclass(frozen=True)
class Trace:
    """A signal of one log over time, SI, each of shape (rows,); NaN where the log has no value."""

    time_s: Floats
    measured: Floats
    predicted: Floats


class Traces(Mapping[str, Trace]):
    """The traces of one log by signal, arrays of shape (rows,) in SI; read from disk when the first is asked for."""

    def __init__(self, path: Path, keep: Any = None) -> None:
        self.path = path
        self._keep = keep
        self._columns: dict[str, Floats] | None = None

    def _load(self) -> dict[str, Floats]:
        if self._columns is None:
            with self.path.open(encoding="utf-8") as file:
                names = file.readline().rstrip("\n").split(",")
                start = file.tell()
                try:
                    table = np.loadtxt(file, delimiter=",", ndmin=2)
                except ValueError:  # a value that is not there: an empty field
                    file.seek(start)
                    table = np.loadtxt(file, delimiter=",", ndmin=2, converters=_number)
            self._columns = {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(names)}
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


def _number(text: str) -> float:
    return float(text) if text.strip() else math.nan
