"""MATLAB's MAT files: v4 to v7 by scipy, v7.3 (HDF5) by h5py.

Numeric variables are columns. A Simulink structure with time gives its signals by their labels; a QUARC "To Host File"
holds one matrix with a column for each sample, time in the first row. Objects (timeseries, table, Dataset) are opaque.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats import _hdf5
from gapscope.formats._table import Floats, Format, Source, Table, claims, find_time, library, of_arrays, spread

_EXTRA = "mat"


def _knows(path: Path) -> bool:
    return path.suffix.lower() == ".mat"


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    with path.open("rb") as file:
        head = file.read(128)
    if b"MATLAB 7.3" in head or head.startswith(b"\x89HDF"):
        return _hdf5.read_as(path, source, FORMAT.name, _EXTRA, matlab=True)
    io = library("scipy.io", "MAT files", _EXTRA)
    for name, shape, _ in io.whosmat(path):
        claims(path, name, shape)
    whole = io.loadmat(path, squeeze_me=True, struct_as_record=False, mat_dtype=True)
    variables = {name: value for name, value in whole.items() if not name.startswith("__")}
    if source.variable:
        if source.variable not in variables:
            raise InputError("no such variable", str(path), repr(source.variable), ", ".join(variables))
        variables = {source.variable: variables[source.variable]}
    arrays: dict[str, Floats] = {}
    skipped = []
    for name, value in variables.items():
        found = _columns(name, value, alone=len(variables) == 1)
        if not found:
            skipped.append(name)
        arrays.update(found)
    if not arrays:
        raise InputError(
            "a MAT file without numbers in arrays",
            str(path),
            ", ".join(skipped) or "nothing",
            "arrays, structures with time",
            "of a timeseries ts save struct(ts)",
        )
    return (of_arrays(path, arrays, find_time(path, arrays, source.time), skipped),)


def _columns(name: str, value: Any, alone: bool = False) -> dict[str, Floats]:
    if hasattr(value, "_fieldnames"):
        return _of_struct(name, value, alone)
    array = np.asarray(value)
    if array.dtype.kind not in "buif" or array.ndim == 0:
        return {}
    if array.ndim == 2 and array.shape[0] < array.shape[1]:
        array = array.T  # a matrix of few rows has its samples along them
    if alone and array.ndim == 2:
        return {"time_s": np.asarray(array[:, 0], float), **spread(name, array[:, 1:])}
    return spread(name, array)


def _of_struct(name: str, value: Any, alone: bool) -> dict[str, Floats]:
    fields = {key: getattr(value, key) for key in value._fieldnames}
    prefix = "" if alone else name + "/"
    columns: dict[str, Floats] = {}
    if "time" in fields and "signals" in fields:
        columns[prefix + "time"] = np.atleast_1d(np.asarray(fields["time"], dtype=np.float64))
        for k, signal in enumerate(np.atleast_1d(fields["signals"])):
            label = str(getattr(signal, "label", "") or f"signal_{k}")
            columns.update(spread(prefix + label, np.asarray(signal.values)))
        return columns
    for key, inner in fields.items():
        columns.update(_columns(prefix + key, inner))
    return columns


FORMAT = Format("MAT file", _EXTRA, _knows, _read, slow=("scipy", "h5py"))
