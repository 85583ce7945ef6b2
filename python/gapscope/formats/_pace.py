"""PACE's recordings (.pt): a mapping of tensors, `time`, `dof_pos`, `des_dof_pos`, and `joint_order` where it is saved.

A .pt file is a pickle: it is read by torch alone, with weights_only=True, which makes tensors and plain values and
calls nothing that a file names.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import Floats, Format, Source, Table, claims, find_time, library, of_arrays, spread

_OLDEST = (2, 6)  # before, weights_only=True could be got round (CVE-2025-32434)


def _knows(path: Path) -> bool:
    return path.suffix.lower() in (".pt", ".pth")


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    torch = library("torch", "PACE's .pt files", "")
    version = tuple(int(n) for n in re.findall(r"\d+", torch.__version__)[:2])
    if version < _OLDEST:
        raise InputError(
            "torch is too old to read a stranger's file", str(path), torch.__version__, "2.6", "pip install -U torch"
        )
    whole = torch.load(path, map_location="cpu", weights_only=True)
    if not isinstance(whole, Mapping):
        raise InputError("no mapping of names to tensors", str(path), type(whole).__name__, "time, dof_pos, ...")
    names = whole.get("joint_order")
    labels = [str(name) for name in names] if isinstance(names, (list, tuple)) else None
    arrays: dict[str, Floats] = {}
    skipped = []
    for name, value in whole.items():
        if not hasattr(value, "numpy"):
            skipped.append(str(name))
            continue
        claims(path, str(name), value.shape)
        values = np.asarray(value.detach().to(torch.float64).numpy())
        arrays.update(spread(str(name), np.atleast_1d(values), labels))
    if not arrays:
        raise InputError("a file without tensors", str(path), ", ".join(skipped) or "nothing", "time, dof_pos, ...")
    skipped = [name for name in skipped if name != "joint_order"]
    return (of_arrays(path, arrays, find_time(path, arrays, source.time), skipped),)


FORMAT = Format("PACE recording", "", _knows, _read)
