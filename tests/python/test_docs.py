"""Every block of docs/reference/python.md runs, and its types hold."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT


def blocks() -> list[str]:
    page = (ROOT / "docs" / "reference" / "python.md").read_text()
    return re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("demo", "models"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    assert len(blocks()) >= 7
    names: dict[str, object] = {}
    for block in blocks():
        exec(compile(block, "docs/reference/python.md", "exec"), names)
    assert (tmp_path / "out" / "monday" / "report.html").is_file()


def test_types(tmp_path: Path) -> None:
    """Of the package, then of the page, as one module that imports it."""
    page = tmp_path / "page.py"
    page.write_text("\n".join(blocks()))
    mypy = [sys.executable, "-m", "mypy", "--cache-dir", str(ROOT / "build" / "mypy")]
    environment = {**os.environ, "MYPYPATH": "python"}
    for files in ([], [str(page)]):
        done = subprocess.run([*mypy, *files], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
