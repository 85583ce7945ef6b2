"""Reading in a process of its own: whatever a library does with a stranger's bytes, the interpreter lives on."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import Bug, InputError
from gapscope.formats._table import Source, Table

_REFUSED = 2


def convert(path: str | os.PathLike[str], source: Source, *, every: bool) -> tuple[Table, ...]:
    """The recordings of a file or folder; with ``every`` False it must be one.

    Raises InputError: as `read_tables`; the library crashed, or took more memory than there is. Bug: the converter's.
    """
    with tempfile.TemporaryDirectory(prefix="gapscope_") as folder:
        target = Path(folder) if every else Path(folder) / "table.npz"
        # By its file: of a module the working folder, which may be a stranger's too, would come first on the path.
        command = [sys.executable, str(Path(__file__).with_name("__main__.py")), "--out", str(target)]
        command += ["--options", json.dumps(asdict(source)), *(["--all"] if every else []), "--", os.fspath(path)]
        paths = [str(Path(__file__).resolve().parents[2]), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
        run = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", env=environment
        )
        if run.returncode == _REFUSED and run.stdout.count("\n") == 5:
            raise InputError(*run.stdout.splitlines())
        if run.returncode < 0:
            raise InputError(
                "a file on which the library of its format crashes",
                os.fspath(path),
                f"signal {-run.returncode}",
                cure="record it again",
            )
        if run.returncode != 0:
            raise Bug(f"the converter ended with status {run.returncode}", command, run.stderr)
        return tuple(load_table(file) for file in sorted(Path(folder).iterdir()))


def load_table(path: Path) -> Table:
    """A file that `Log.save` or the program wrote."""
    with np.load(path, allow_pickle=False) as archive:
        meta: dict[str, Any] = json.loads(archive["meta"].tobytes())
        names: list[str] = meta["names"]
        return Table(
            {name: archive[f"c{k}"] for k, name in enumerate(names)},
            meta.get("time", ""),
            name=meta.get("name", ""),
            header=meta["header"],
            units={name: unit for name, unit in zip(names, meta["units"]) if unit},
            findings=tuple(finding["text"] for finding in meta["findings"]),
            clock=dict(zip(names, meta.get("clock", ()))),
            joined=meta.get("missing") == "keep",
        )
