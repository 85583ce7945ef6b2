"""PACE's recordings as PyTorch itself writes them (scripts/engine_env torch): read, or refused."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import gapscope as gs
import numpy as np
import pytest
from conftest import JOINT, ROOT, experiment_at, interpreter
from gapscope._program import program
from test_converter import converter
from test_hostile_formats import outcomes

ROWS = 1000
JOINTS = ("hip", "knee")


@pytest.fixture(scope="session")
def torch() -> str:
    return interpreter("torch")


@pytest.fixture(scope="session")
def saved(torch: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What engines/save_pace.py wrote, and csv/NAME.csv of the same numbers."""
    folder = tmp_path_factory.mktemp("pace")
    rng = np.random.default_rng(4)
    arrays = {
        "time": (0.002 * np.arange(ROWS)).astype(np.float32),
        "dof_pos": np.cumsum(rng.normal(size=(ROWS, 2)), axis=0).astype(np.float32),
        "des_dof_pos": np.cumsum(rng.normal(size=(ROWS, 2)), axis=0) * 1e-3,  # PACE has float32; both are read
    }
    np.savez(folder / "in.npz", **arrays)
    script = ROOT / "tests" / "python" / "engines" / "save_pace.py"
    done = subprocess.run([torch, script, folder / "in.npz", folder], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    columns = {"time": arrays["time"]}
    for name in ("dof_pos", "des_dof_pos"):
        columns.update({f"{name}/{joint}": arrays[name][:, k] for k, joint in enumerate(JOINTS)})
    rows = zip(*(column.astype(float).tolist() for column in columns.values()), strict=True)
    text = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    (folder / "run.csv").write_text("\n".join(text) + "\n")
    return folder


def test_a_file_of_torch_is_the_csv_to_the_last_bit(saved: Path, torch: str, tmp_path: Path) -> None:
    whole = sorted((saved / "whole").iterdir())
    command = [str(program()), "convert", *map(str, whole), "--out", str(tmp_path / "tables"), "--json"]
    run = subprocess.run(command, capture_output=True, text=True, env=converter(tmp_path, torch), check=False)
    assert run.returncode == 0, run.stderr
    assert run.stderr.count("left out") == 1 and "robot, complex, sparse" in run.stderr
    expected = gs.Log(saved / "run.csv")
    assert expected["time"].dtype == np.float64 and len(expected["time"]) == ROWS
    for path, log in zip(whole, json.loads(run.stdout)["logs"], strict=True):
        found = gs.Log(log["table"])
        assert found.columns == tuple(expected.columns), path
        assert all(np.array_equal(found[name], expected[name]) for name in found.columns), path


def test_it_replays_as_the_csv_does(saved: Path, torch: str, tmp_path: Path) -> None:
    names = {"target_rad": "des_dof_pos/knee", "position_rad": "dof_pos/knee", "time_s": "time"}
    bound = experiment_at(tmp_path / "experiment.yaml", JOINT, names)
    command = [str(program()), "replay", str(bound), str(saved / "whole" / "run.pt"), "--json"]
    run = subprocess.run(command, capture_output=True, text=True, env=converter(tmp_path, torch), check=False)
    assert run.returncode == 0, run.stderr
    error = gs.replay(bound, saved / "run.csv").error
    assert json.loads(run.stdout)["error"] == error and error > 0


SAYS = {
    "cut_*": "not a readable PACE recording",
    "evil*": "more than tensors, numbers and texts: .*exec",
    "numpy": "more than tensors, numbers and texts: .*_reconstruct",
    "list": "no mapping of names to tensors",
    "nothing": "a file without tensors",
    "wide": "a table too large",
    "sum": "a table too large",
    "unpacks": "a table too large",
    "rows*": "not a readable PACE recording",
    "short": "not a readable PACE recording",
}


def test_hostile_ones_are_refused_and_nothing_is_executed(
    saved: Path, torch: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It would take the guard off a call that does not ask for it.
    monkeypatch.setenv("TORCH_FORCE_NO_WEIGHTS_ONLY_LOAD", "1")
    paths = {path: says for names, says in SAYS.items() for path in sorted((saved / "hostile").glob(f"{names}.pt"))}
    assert set(paths) == set((saved / "hostile").iterdir())
    for (path, says), line in zip(paths.items(), outcomes(list(paths), torch, gigabytes=10), strict=True):
        assert re.search(f"refused: .*{says}", line) and path.name in line, (path, line)
        assert "weights_only to False" not in line
    run = subprocess.run(
        [str(program()), "convert", str(saved / "hostile" / "evil.pt"), "--out", str(tmp_path / "tables")],
        capture_output=True, text=True, env=converter(tmp_path, torch), cwd=tmp_path, check=False,
    )  # fmt: skip
    assert run.returncode == 2 and "evil.pt" in run.stderr and "exec" in run.stderr and run.stdout == ""
    places = (tmp_path, ROOT / "python")  # where these processes ran
    assert not [found for place in places for found in place.rglob("executed")]


def test_the_function_that_is_named_would_have_been_called(saved: Path, torch: str, tmp_path: Path) -> None:
    """Else the test above shows nothing."""
    code = "import sys, torch; torch.load(sys.argv[1], weights_only=False)"
    for name in ("evil", "evil_old"):
        path = saved / "hostile" / f"{name}.pt"
        subprocess.run([torch, "-c", code, path], cwd=tmp_path, capture_output=True, check=True)
        (tmp_path / "executed").unlink()
