"""Parquet and Feather (Arrow): flat columns; a column of lists of one length is spread."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import Floats, Format, Source, Table, claims, find_time, library, of_arrays, spread
from gapscope.formats._table import unreadable

_EXTRA = "parquet"
_PARQUET, _FEATHER = (".parquet", ".pq"), (".feather", ".arrow")


def _knows(path: Path) -> bool:
    return path.suffix.lower() in _PARQUET + _FEATHER


def load(path: Path) -> Any:
    """The Arrow table of a file."""
    try:
        if path.suffix.lower() in _PARQUET:
            parquet = library("pyarrow.parquet", "Parquet files", _EXTRA)
            with parquet.ParquetFile(path) as file:
                claims(path, "the table", (file.metadata.num_rows, file.metadata.num_columns))
                return file.read()
        feather = library("pyarrow.feather", "Feather files", _EXTRA)
        return feather.read_table(path)
    except InputError:
        raise
    except Exception as error:
        raise unreadable(path, "table of Arrow", error) from None


def columns_of(path: Path, table: Any, labels: dict[str, Sequence[str]] | None = None) -> dict[str, Floats]:
    """Numeric columns of an Arrow table; ``labels`` names the elements of columns of lists."""
    types = library("pyarrow", "Arrow tables", _EXTRA).types
    arrays: dict[str, Floats] = {}
    for name in table.column_names:
        column = table.column(name)
        kind = column.type
        if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
            arrays.update(_of_lists(path, name, column, (labels or {}).get(name)))
        elif types.is_timestamp(kind):
            stamps = column.cast("timestamp[ns]").to_numpy().astype("datetime64[ns]")
            arrays[name] = (stamps - stamps[0]).astype(np.int64) * 1e-9
        elif types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind):
            arrays[name] = np.asarray(column.cast("float64").to_numpy(), dtype=np.float64)
    return arrays


def _of_lists(path: Path, name: str, column: Any, labels: Sequence[str] | None) -> dict[str, Floats]:
    whole = column.combine_chunks()
    rows = len(whole)
    flat = np.asarray(whole.flatten().to_numpy(zero_copy_only=False))
    if flat.dtype.kind not in "buif":
        return {}
    if rows == 0 or len(flat) % rows or whole.null_count or len(set(whole.value_lengths().to_pylist())) > 1:
        raise InputError("lists whose lengths differ", f"{path}, column {name!r}", "", "one length in all rows")
    return spread(name, flat.reshape(rows, -1), labels)


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    arrays = columns_of(path, load(path))
    if not arrays:
        raise InputError("a table without numbers", str(path))
    return (of_arrays(path, arrays, find_time(path, arrays, source.time)),)


FORMAT = Format("Parquet or Feather", _EXTRA, _knows, _read)
