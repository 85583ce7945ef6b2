"""What `gapscope fleet merge` wrote, as tables: SQLite, or DataFrames."""

from __future__ import annotations

import csv
import os
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gapscope._errors import InputError, import_needed

if TYPE_CHECKING:
    import pandas as pd

TABLES = ("units", "statements", "parameters")
# Others are texts: a robot called 007 stays that.
_NUMBERS = frozenset({"probability", "nominal", "left", "gap", "value", "low", "high"})


@dataclass(frozen=True)
class Fleet:
    """One row a unit; one a unit and effect; one a unit and parameter. They share `task` and the fleet's columns."""

    units: pd.DataFrame
    statements: pd.DataFrame
    parameters: pd.DataFrame


def read_fleet(work: str | os.PathLike[str]) -> Fleet:
    """The tables of a merged fleet as DataFrames.

    Raises InputError: it has not been merged. MissingLibrary: there is no pandas.
    """
    pandas = import_needed("pandas", "no pandas for DataFrames", "pandas")

    def table(name: str) -> pd.DataFrame:
        path = _table(work, name)
        with path.open(newline="") as file:
            texts = [column for column in next(csv.reader(file)) if column not in _NUMBERS]
        empty = dict.fromkeys(_NUMBERS, [""])
        frame: pd.DataFrame = pandas.read_csv(
            path, dtype=dict.fromkeys(texts, str), keep_default_na=False, na_values=empty
        )
        return frame

    return Fleet(*(table(name) for name in TABLES))


def to_sqlite(work: str | os.PathLike[str], path: str | os.PathLike[str] | None = None) -> Path:
    """The tables of a merged fleet as an SQLite file, by default WORK/fleet.sqlite; its path.

    Rows go through one at a time. The file is written under another name and renamed when it is whole.
    Raises InputError: the fleet has not been merged.
    """
    out = Path(work, "fleet.sqlite") if path is None else Path(path)
    tables = {name: _table(work, name) for name in TABLES}
    unfinished = out.with_name(f".{out.name}.{os.getpid()}")
    unfinished.unlink(missing_ok=True)
    try:
        base = sqlite3.connect(unfinished)
        with base:
            for name, source in tables.items():
                _copy(source, name, base)
        base.close()
        unfinished.replace(out)
    finally:
        unfinished.unlink(missing_ok=True)
    return out


def _table(work: str | os.PathLike[str], name: str) -> Path:
    path = Path(work, f"{name}.csv")
    if not path.is_file():
        raise InputError("no table of a fleet", str(path), "no such file", cure="gapscope fleet merge writes it")
    return path


def _copy(source: Path, name: str, base: sqlite3.Connection) -> None:
    with source.open(newline="", encoding="utf-8", errors="replace") as file:
        rows = csv.reader(file)
        head = next(rows)
        kinds = ["REAL" if column in _NUMBERS else "TEXT" for column in head]
        columns = ", ".join(f'"{column}" {kind}' for column, kind in zip(head, kinds, strict=True))
        base.execute(f"CREATE TABLE {name} ({columns})")

        def values() -> Iterator[list[float | str | None]]:
            for row in rows:
                yield [_value(kind, text) for kind, text in zip(kinds, row, strict=True)]

        base.executemany(f"INSERT INTO {name} VALUES ({', '.join('?' * len(head))})", values())
        base.execute(f"CREATE INDEX {name}_task ON {name} (task)")


def _value(kind: str, text: str) -> float | str | None:
    if kind == "TEXT":
        return text
    return float(text) if text else None
