"""gs.bar in a terminal, and in a notebook by a stand-in for IPython."""

from __future__ import annotations

import io
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import gapscope as gs
import pytest

from conftest import shell_program

HALF = gs.Progress("fit", 5, 10, 0.25, 3.2)
NOT_KNOWN = gs.Progress("<search>", 5, None, None, 4)


class StandIn:
    """IPython as far as `bar` needs it: what was displayed, by the name of its output."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, kernel: bool) -> None:
        self.shell = SimpleNamespace(**({"kernel": object()} if kernel else {}))
        self.shown: list[tuple[str, bool, dict[str, str]]] = []
        ipython, display = ModuleType("IPython"), ModuleType("IPython.display")
        setattr(ipython, "get_ipython", lambda: self.shell)
        setattr(display, "display", self.display)
        monkeypatch.setitem(sys.modules, "IPython", ipython)
        monkeypatch.setitem(sys.modules, "IPython.display", display)

    def display(self, data: dict[str, str], *, raw: bool, display_id: str, update: bool) -> None:
        assert raw
        self.shown.append((display_id, update, data))


def test_a_line_in_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    gs.bar(HALF)
    gs.bar(NOT_KNOWN)
    said = capsys.readouterr().err.split("\r\033[K")
    assert said == ["", f"[{'#' * 10:<20}] fit, cost 0.25, 3 s", "<search> 5, 4 s"]
    ipython = StandIn(monkeypatch, kernel=False)
    gs.bar(HALF)
    assert "fit" in capsys.readouterr().err and not ipython.shown


def test_one_output_a_search_in_a_notebook(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ipython = StandIn(monkeypatch, kernel=True)
    gs.bar(replace(HALF, call="a"))
    gs.bar(replace(NOT_KNOWN, call="a", number=1))
    (first, begun, half), (second, went_on, unknown) = ipython.shown
    assert first == second and (begun, went_on) == (False, True)
    assert 'value="0.500"' in half["text/html"] and half["text/plain"] == "fit, cost 0.25, 3 s"
    assert "<progress" not in unknown["text/html"] and "&lt;search&gt; 5" in unknown["text/html"]
    assert not capsys.readouterr().err
    line = io.StringIO()
    gs.bar(HALF, line)
    assert "fit" in line.getvalue() and len(ipython.shown) == 2


def test_calls_at_once_have_an_output_each(
    experiment: str, short: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Searches in two threads of one cell, which report in turn; and the batch that a third one runs."""
    ipython = StandIn(monkeypatch, kernel=True)
    line = '{"stage": "fit", "done": 1, "total": 2, "best": null, "elapsed_s": 1}'
    says = f"for k in 1 2 3; do echo '{line}' >&2; done; exit 2"
    monkeypatch.setenv("GAPSCOPE_PROGRAM", shell_program(tmp_path / "reports", says))
    in_turn = threading.Barrier(2, timeout=60)

    def progress(report: gs.Progress) -> None:
        in_turn.wait()
        gs.bar(report)

    def search(_: int) -> None:
        with pytest.raises(gs.Bug):
            gs.tune(experiment, short, progress=progress)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(search, range(2)))
    gs.diagnose_many(experiment, {"a": short, "b": short}, progress=gs.bar)
    updates: dict[str, list[bool]] = {}
    for name, update, _ in ipython.shown:
        updates.setdefault(name, []).append(update)
    assert list(updates.values()) == [[False, True, True], [False, True, True], [False, True]]


def test_a_search_calls_it(experiment: str, short: str, monkeypatch: pytest.MonkeyPatch) -> None:
    ipython = StandIn(monkeypatch, kernel=True)
    options: dict[str, Any] = {"starts": 1, "budget_s": 1, "jobs": 1}
    gs.tune(experiment, short, progress=gs.bar, **options)
    assert len({name for name, _, _ in ipython.shown}) == 1 and "fit" in ipython.shown[-1][2]["text/plain"]
