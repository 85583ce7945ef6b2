"""The program as a child process: its errors, its crashes, one that cannot be started, Ctrl-C at its end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import gapscope as gs
import pytest
from gapscope import _program

from conftest import ROOT, interrupt_when, shell_program


def test_an_error_of_a_newer_program(
    experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    says = json.dumps({"error": {"what": "it is wrong", "where": "run.csv", "cure": "mend it", "new": {"a": 1}}})
    monkeypatch.setenv("GAPSCOPE_PROGRAM", shell_program(tmp_path / "newer", f"echo '{says}' >&2; exit 2"))
    with pytest.raises(gs.InputError) as raised:
        gs.replay(experiment, demo)
    assert raised.value.args == ("it is wrong", "run.csv", "", "", "mend it")


def test_a_crash_of_the_program_is_a_bug_not_the_end(
    experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAPSCOPE_PROGRAM", shell_program(tmp_path / "broken", "echo it fell >&2\nkill -SEGV $$"))
    with pytest.raises(gs.Bug, match="it fell") as raised:
        gs.replay(experiment, demo)
    assert "replay" in raised.value.command
    monkeypatch.setenv("GAPSCOPE_PROGRAM", str(tmp_path / "gone"))
    with pytest.raises(gs.InputError, match="the program is not there"):
        gs.replay(experiment, demo)


LOADERS = {
    "echo \"$0: /lib/libm.so.6: version \\`GLIBC_2.35' not found (required by $0)\" >&2\nexit 1": "GLIBC_2.35",
    "echo \"$0: error while loading shared libraries: libz.so.1: no such file\" >&2\nexit 127": "libz.so.1",
}


@pytest.mark.parametrize("body", LOADERS)
def test_a_program_that_cannot_be_loaded(
    body: str, experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAPSCOPE_PROGRAM", shell_program(tmp_path / "old", body))
    with pytest.raises(gs.InputError, match="does not run on this machine") as raised:
        gs.replay(experiment, demo)
    error = raised.value
    assert LOADERS[body] in error.actual and error.where == str(tmp_path / "old") and error.cure


def test_a_program_of_another_platform(
    experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Path(shell_program(tmp_path / "other", ""))
    other.write_bytes(b"\x7fELF" + bytes(60))
    no_loader = shell_program(tmp_path / "no_loader", "")
    Path(no_loader).write_text("#!/no/such/loader\n")
    for path in (str(other), no_loader):
        monkeypatch.setenv("GAPSCOPE_PROGRAM", path)
        with pytest.raises(gs.InputError, match="does not run on this machine") as raised:
            gs.replay(experiment, demo)
        assert raised.value.where == path and "glibc" in raised.value.allowed
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "python")}
        command = [sys.executable, "-m", "gapscope", "--version"]
        run = subprocess.run(command, capture_output=True, text=True, env=environment)
        assert run.returncode == 2 and "does not run on this machine" in run.stderr, run.stderr
        assert "Traceback" not in run.stderr


def test_ctrl_c_when_the_program_has_said_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its stderr is closed, and it writes its result yet."""
    said = tmp_path / "said"
    body = f"trap '' INT; exec 2>&-; touch {said}; sleep 1; echo whole"
    monkeypatch.setenv("GAPSCOPE_PROGRAM", shell_program(tmp_path / "late", body))
    interrupt_when(said.exists)
    assert _program.run(["tune"]) == _program.Finished("whole\n", (), True)
