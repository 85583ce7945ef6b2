"""The notebooks of examples/ run; each holds its figures against what its twin was made of."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


@pytest.fixture(scope="module")
def environment() -> Path:
    """The folder of scripts/notebook_env's programs."""
    made = subprocess.run([ROOT / "scripts" / "notebook_env"], capture_output=True, text=True, check=True)
    return Path(made.stdout.strip()).parent


def test_there_are_some() -> None:
    assert NOTEBOOKS


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_holds_against_the_truth(notebook: Path, environment: Path, tmp_path: Path) -> None:
    code = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code), "kept without outputs"
    assert "assert abs(" in "".join(code[-1]["source"]), "ends with the truth"
    command = [environment / "jupyter-execute", notebook, "--timeout=600", f"--output={tmp_path / 'run.ipynb'}"]
    variables = {**os.environ, "TMPDIR": str(tmp_path), "IPYTHONDIR": str(tmp_path), "MPLCONFIGDIR": str(tmp_path)}
    done = subprocess.run(command, capture_output=True, text=True, env=variables, check=False)
    assert done.returncode == 0, done.stderr[-3000:]


def test_interrupting_a_cell_keeps_the_best_and_the_kernel(environment: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [environment / "python", ROOT / "tests" / "python" / "interrupt_kernel.py"],
        cwd=ROOT,
        env={**os.environ, "IPYTHONDIR": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.stdout.split("\n")[:3] == ["under way", "partial", "2"], done.stdout + done.stderr[-3000:]
