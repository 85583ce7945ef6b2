"""HDF5: numeric datasets of one length, their paths as names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import MOST_ELEMENTS, Floats, Format, Source, Table, claims, find_time, library
from gapscope.formats._table import of_arrays, spread

_EXTRA = "hdf5"


def _knows(path: Path) -> bool:
    return path.suffix.lower() in (".h5", ".hdf5", ".hdf")


def _is_column(item: Any, matlab: bool) -> bool:
    """Numbers in this very file: an external or virtual dataset would read others."""
    if item.dtype.kind not in "buif" or item.ndim == 0 or item.external or item.is_virtual:
        return False
    if matlab:
        return "MATLAB_int_decode" not in item.attrs or item.attrs.get("MATLAB_class") == b"logical"
    return int(np.prod([float(n) for n in item.shape[1:]])) <= MOST_ELEMENTS


def read_as(path: Path, source: Source, what: str, extra: str, matlab: bool = False) -> tuple[Table, ...]:
    """Numeric datasets; those of MATLAB are transposed."""
    h5py = library("h5py", what + "s", extra)
    found: dict[str, Any] = {}
    skipped: list[str] = []

    def take(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):
            return
        if _is_column(item, matlab):
            found[name] = item
        else:
            skipped.append(name)

    with h5py.File(path, "r", locking=False) as file:
        group = file
        if source.variable:
            # Of the group itself only: a link into another file is not followed.
            if not isinstance(file.get(source.variable, getlink=True), h5py.HardLink):
                raise InputError("no such group", str(path), repr(source.variable), ", ".join(file))
            group = file[source.variable]
        if isinstance(group, h5py.Dataset):
            take(source.variable, group)
        else:
            group.visititems(take)
        claims(path, "all datasets", (sum(item.size for item in found.values()),))
        arrays, units = _columns(found, matlab)
    if not arrays:
        raise InputError(f"a {what} without numbers in arrays", str(path), ", ".join(skipped) or "nothing", "datasets")
    return (of_arrays(path, arrays, find_time(path, arrays, source.time), skipped, units=units),)


def _columns(found: dict[str, Any], matlab: bool) -> tuple[dict[str, Floats], dict[str, str]]:
    """The datasets' columns, and the units of those that state one."""
    arrays: dict[str, Floats] = {}
    units: dict[str, str] = {}
    for name, item in found.items():
        values = np.asarray(item[()], dtype=np.float64)
        columns = spread(name, np.atleast_1d(np.squeeze(values.T) if matlab else values))
        arrays.update(columns)
        unit = item.attrs.get("unit", item.attrs.get("units"))
        if isinstance(unit, str):
            units.update({column: unit for column in columns})
    return arrays, units


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    return read_as(path, source, FORMAT.name, _EXTRA)


FORMAT = Format("HDF5 file", _EXTRA, _knows, _read)
