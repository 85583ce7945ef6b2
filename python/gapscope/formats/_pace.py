"""PACE's recordings (.pt): a mapping of tensors, `time`, `dof_pos`, `des_dof_pos`, and `joint_order` where it is saved.

A .pt file is a pickle: it is read by torch alone, with weights_only=True, which makes tensors and plain values and
calls nothing that a file names.
"""

from __future__ import annotations

import pickle
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import Floats, Format, Source, Table, claims, find_time, library, of_arrays, spread

_OLDEST = (2, 6)  # before, weights_only=True could be got round (CVE-2025-32434)
_WIDEST = 8  # bytes of a number


def _knows(path: Path) -> bool:
    return path.suffix.lower() in (".pt", ".pth")


def _load(torch: Any, path: Path) -> Any:
    """What the file holds. Raises InputError: it claims too much, or holds what is no tensor, number or text."""
    if zipfile.is_zipfile(path):  # before 1.6 torch wrote none
        with zipfile.ZipFile(path) as archive:
            claims(path, "the archive", (sum(part.file_size for part in archive.infolist()) // _WIDEST,))
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        # Not its own advice, to read the file without that guard.
        named = re.search(r"GLOBAL ([\w.]*\w)", str(error))
        raise InputError(
            "a recording that holds more than tensors, numbers and texts",
            str(path),
            named[1] if named else "what torch does not make with weights_only=True",
            "time, dof_pos, ... as tensors",
            "torch.save({name: torch.as_tensor(values) ...}, FILE)",
        ) from None


def _is_plain(torch: Any, value: Any) -> bool:
    """Whether it is a tensor whose numbers are all there, and real."""
    return isinstance(value, torch.Tensor) and not (
        value.layout is not torch.strided
        or value.is_meta
        or value.is_nested
        or value.is_quantized
        or value.is_complex()
    )


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    torch = library("torch", "PACE's .pt files", "")
    version = tuple(int(n) for n in re.findall(r"\d+", torch.__version__)[:2])
    if version < _OLDEST:
        raise InputError(
            "torch is too old to read a stranger's file", str(path), torch.__version__, "2.6", "pip install -U torch"
        )
    whole = _load(torch, path)
    if not isinstance(whole, Mapping):
        raise InputError("no mapping of names to tensors", str(path), type(whole).__name__, "time, dof_pos, ...")
    names = whole.get("joint_order")
    labels = [str(name) for name in names] if isinstance(names, (list, tuple)) else None
    found = {str(name): value for name, value in whole.items() if _is_plain(torch, value)}
    skipped = [str(name) for name in whole if str(name) not in found and name != "joint_order"]
    # By their shapes: of a tensor that repeats itself the file holds less.
    claims(path, "all tensors", (sum(value.numel() for value in found.values()),))
    arrays: dict[str, Floats] = {}
    for name, value in found.items():
        values = np.asarray(value.detach().to(torch.float64).numpy())
        arrays.update(spread(name, np.atleast_1d(values), labels))
    if not arrays:
        raise InputError("a file without tensors", str(path), ", ".join(skipped) or "nothing", "time, dof_pos, ...")
    return (of_arrays(path, arrays, find_time(path, arrays, source.time), skipped),)


FORMAT = Format("PACE recording", "", _knows, _read)
