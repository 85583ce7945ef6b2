"""Parquet and Feather (Arrow): flat columns; a column of lists of one length is spread."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import Floats, Format, Source, Table, claims, find_time, library, of_arrays, spread

_EXTRA = "parquet"
_PARQUET, _FEATHER = (".parquet", ".pq"), (".feather", ".arrow")


def _knows(path: Path) -> bool:
    return path.suffix.lower() in _PARQUET + _FEATHER


def load(path: Path, wanted: Sequence[str] = ()) -> tuple[Any, list[str]]:
    """The columns of numbers and of lists of them as an Arrow table, and the names of the others, which stay unread.

    Of a Parquet file only the ``wanted`` ones, if any are named.
    """
    if path.suffix.lower() in _PARQUET:
        parquet = library("pyarrow.parquet", "Parquet files", _EXTRA)
        with parquet.ParquetFile(path) as file:
            names, skipped = _numbers(file.schema_arrow)
            names = [name for name in names if name in wanted or not wanted]
            meta = file.metadata
            groups = [meta.row_group(k) for k in range(meta.num_row_groups)]
            held = sum(group.column(k).num_values for group in groups for k in range(group.num_columns))
            claims(path, "the table", (max(held, meta.num_rows * len(names)),))
            return file.read(columns=names), skipped
    ipc = library("pyarrow.ipc", "Feather files", _EXTRA)
    with path.open("rb") as file:
        whole = file.read(6) == b"ARROW1"
    with (ipc.open_file if whole else ipc.open_stream)(str(path)) as reader:
        names, skipped = _numbers(reader.schema)
        batches, rows = [], 0
        for batch in (reader.get_batch(k) for k in range(reader.num_record_batches)) if whole else reader:
            rows += batch.num_rows
            claims(path, "the table", (rows, max(len(names), 1)))
            batches.append(batch.select(names))
            batches[-1].validate(full=True)  # else rows beyond its buffers are read from whatever memory comes next
        arrow = library("pyarrow", "Feather files", _EXTRA)
        kept = arrow.schema([reader.schema.field(name) for name in names])
        return arrow.Table.from_batches(batches, kept), skipped


def _numbers(schema: Any) -> tuple[list[str], list[str]]:
    """Names of the columns of numbers, stamps or lists of numbers; of the others."""
    types = library("pyarrow", "Arrow tables", _EXTRA).types

    def plain(kind: Any) -> bool:
        return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind))

    def known(kind: Any) -> bool:
        if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
            return plain(kind.value_type)
        return plain(kind) or bool(types.is_timestamp(kind))

    names = [one.name for one in schema if known(one.type)]
    if len(set(names)) < len(names):
        raise InputError("two columns of one name", "the table", ", ".join(names[:40]), "each name once")
    return names, [one.name for one in schema if not known(one.type)]


def columns_of(path: Path, table: Any, labels: dict[str, Sequence[str]] | None = None) -> dict[str, Floats]:
    """Numeric columns of an Arrow table; ``labels`` names the elements of columns of lists."""
    types = library("pyarrow", "Arrow tables", _EXTRA).types
    arrays: dict[str, Floats] = {}
    for name in table.column_names:
        column = table.column(name)
        kind = column.type
        if types.is_timestamp(kind):
            stamps = column.cast("timestamp[ns]").to_numpy().astype("datetime64[ns]")
            there = ~np.isnat(stamps)
            arrays[name] = np.full(len(stamps), np.nan)
            arrays[name][there] = (stamps[there] - stamps[there][:1]).astype(np.int64) * 1e-9
        elif hasattr(kind, "value_type"):
            arrays.update(_of_lists(path, name, column, (labels or {}).get(name)))
        else:
            arrays[name] = np.asarray(column.cast("float64", safe=False).to_numpy(), dtype=np.float64)
    return arrays


def _of_lists(path: Path, name: str, column: Any, labels: Sequence[str] | None) -> dict[str, Floats]:
    whole = column.combine_chunks()
    rows = len(whole)
    flat = np.asarray(whole.flatten().to_numpy(zero_copy_only=False))
    if rows == 0 or len(flat) % rows or whole.null_count or len(set(whole.value_lengths().to_pylist())) > 1:
        raise InputError("lists whose lengths differ", f"{path}, column {name!r}", "", "one length in all rows")
    return spread(name, flat.reshape(rows, -1), labels)


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    table, skipped = load(path)
    arrays = columns_of(path, table)
    if not arrays:
        raise InputError("a table without numbers", str(path), ", ".join(skipped), "columns of numbers")
    dates = library("pyarrow", "Arrow tables", _EXTRA).types.is_timestamp
    units = {one.name: "s" for one in table.schema if dates(one.type)}
    return (of_arrays(path, arrays, find_time(path, arrays, source.time), skipped, units=units),)


FORMAT = Format("Parquet or Feather file", _EXTRA, _knows, _read)
