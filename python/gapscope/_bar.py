"""How far a long call has come, for people: a line in a terminal, an output that changes in a notebook."""

from __future__ import annotations

import html
import importlib
import sys
from typing import TextIO

from gapscope._program import Progress


def bar(progress: Progress, stream: TextIO | None = None) -> None:
    """``gs.tune(..., progress=gs.bar)``: a bar, the stage, the best cost so far and the seconds.

    In a notebook one output of the cell, which the first report of a call begins and the others change. Elsewhere, and
    where ``stream`` is given, a line of ``stream`` (stderr) that is written over.
    """
    if stream is None and _is_notebook():
        _show(progress)
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


def _is_notebook() -> bool:
    """Whether the shell is a notebook's kernel, which has imported IPython; else a terminal, or no IPython."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


def _show(progress: Progress) -> None:
    """Begins the output of this call, or changes it."""
    text, share = _text(progress), _share(progress)
    element = "" if share is None else f'<progress max="1" value="{share:.3f}"></progress> '
    shown = {"text/plain": text, "text/html": f"{element}<code>{html.escape(text)}</code>"}
    display = importlib.import_module("IPython.display").display
    display(shown, raw=True, display_id=f"gapscope-{progress.call}", update=progress.number > 0)
