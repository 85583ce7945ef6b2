"""HDF5: numeric datasets of one length, their paths as names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import Floats, Format, Source, Table, claims, find_time, library, of_arrays, spread
from gapscope.formats._table import unreadable

_WHAT, _EXTRA = "HDF5 file", "hdf5"


def _knows(path: Path) -> bool:
    return path.suffix.lower() in (".h5", ".hdf5", ".hdf")


def read_as(path: Path, source: Source, what: str, extra: str) -> tuple[Table, ...]:
    h5py = library("h5py", what + "s", extra)
    arrays: dict[str, Floats] = {}
    skipped: list[str] = []
    matlab = what != _WHAT

    def take(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#refs#"):
            return None
        if item.dtype.kind not in "buif" or item.ndim == 0 or (matlab and "MATLAB_int_decode" in item.attrs):
            skipped.append(name)
            return None
        claims(path, name, item.shape)
        values = np.asarray(item[()], dtype=np.float64)
        if matlab:
            values = np.squeeze(values.T)
        arrays.update(spread(name, np.atleast_1d(values)))
        return None

    try:
        with h5py.File(path, "r", locking=False) as file:
            group = file
            if source.variable:
                if source.variable not in file:
                    raise InputError("no such group", str(path), repr(source.variable), ", ".join(file))
                group = file[source.variable]
            group.visititems(take)
    except InputError:
        raise
    except Exception as error:
        raise unreadable(path, what, error) from None
    if not arrays:
        raise InputError(f"a {what} without numbers in arrays", str(path), ", ".join(skipped) or "nothing", "datasets")
    time = find_time(path, arrays, source.time)
    findings = [f"left out, being no array of numbers: {', '.join(skipped[:20])}"] if skipped else []
    return (of_arrays(path, arrays, time, findings=findings),)


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    return read_as(path, source, _WHAT, _EXTRA)


FORMAT = Format("HDF5", _EXTRA, _knows, _read)
