"""How far a long call has come, for people: a line in a terminal, an output that changes in a notebook."""

from __future__ import annotations

import html
import importlib
import math
import sys
import uuid
from dataclasses import dataclass
from typing import Any, TextIO

from gapscope._program import Progress


def bar(progress: Progress, stream: TextIO | None = None) -> None:
    """``gs.tune(..., progress=gs.bar)``: a bar, the stage, the best cost so far and the seconds.

    In a notebook one output of the cell, which changes; elsewhere, and where ``stream`` is given, a line of ``stream``
    (stderr) that is written over.
    """
    shell = _notebook() if stream is None else None
    if shell is not None:
        _show(shell, progress)
        return
    share = _share(progress)
    filled = "" if share is None else f"[{'#' * round(20 * share):<20}] "
    print(f"\r\033[K{filled}{_text(progress)}", end="", file=stream or sys.stderr, flush=True)


def _share(progress: Progress) -> float | None:
    """Of the whole; None: not known."""
    return min(progress.done / progress.total, 1.0) if progress.done is not None and progress.total else None


def _text(progress: Progress) -> str:
    text = progress.stage
    if progress.done is not None and not progress.total:
        text += f" {progress.done:g}"
    if progress.best is not None:
        text += f", cost {progress.best:.6g}"
    return f"{text}, {progress.elapsed_s:.0f} s"


def _notebook() -> Any:
    """The shell of a notebook's kernel; None: a terminal, or no IPython. It is there if its kernel imported it."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell if hasattr(shell, "kernel") else None


@dataclass
class _Output:
    """The output that the last call changed: its cell, its time, its name for the notebook."""

    cell: object = None
    elapsed_s: float = math.inf
    name: str = ""


_output = _Output()


def _show(shell: Any, progress: Progress) -> None:
    """Changes the output of this search; another cell, or a time that went back, is another search."""
    cell = getattr(shell, "execution_count", None)
    first = cell != _output.cell or progress.elapsed_s < _output.elapsed_s
    if first:
        _output.name = f"gapscope-{uuid.uuid4().hex}"
    _output.cell, _output.elapsed_s = cell, progress.elapsed_s
    text, share = _text(progress), _share(progress)
    element = "" if share is None else f'<progress max="1" value="{share:.3f}"></progress> '
    shown = {"text/plain": text, "text/html": f"{element}<code>{html.escape(text)}</code>"}
    importlib.import_module("IPython.display").display(shown, raw=True, display_id=_output.name, update=not first)
