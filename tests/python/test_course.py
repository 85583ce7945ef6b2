"""The lab course: its handouts show the commands of course.yaml, and a solution is what the program says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "scripts" / "lab"))
from system import BadCourse, check_handout, read_system

SYSTEMS = sorted(path.parent for path in (ROOT / "course").glob("*/course.yaml"))
BIN = ROOT / "build" / "bin"
built = pytest.mark.skipif(
    not all((BIN / name).is_file() for name in ("gapscope", "gapscope_twin")), reason=f"no programs in {BIN}"
)


def make(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "scripts" / "lab" / "make.py"), *words]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def loop(*words: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    command = [sys.executable, "loop.py", "../models/qube/experiment.yaml", *words]
    return subprocess.run(command, cwd=ROOT / "course", capture_output=True, text=True, check=False, env=environment)


@pytest.mark.parametrize("folder", SYSTEMS, ids=lambda path: path.name)
def test_handout_shows_the_commands(folder: Path) -> None:
    system = read_system(folder)
    check_handout(system)
    solution = (folder / "solution.md").read_text()
    assert re.findall(r"^## \d+\. (.*)$", solution, re.MULTILINE) == [e.title for e in system.experiments]


@built
def test_a_solution_is_todays() -> None:
    done = make("--check", "flexible")  # the quickest of the three; scripts/course --check does all
    assert done.returncode == 0, done.stdout + done.stderr


@built
def test_another_rig_has_a_handout_of_its_own(tmp_path: Path) -> None:
    committed = (ROOT / "course/flexible/solution.md").read_text()
    done = make("--seed", "5", "--out", str(tmp_path), "flexible")
    assert done.returncode == 0, done.stderr
    made = sorted(path.name for path in tmp_path.iterdir())
    assert made == ["flexible-5", "flexible-5-solution.md", "flexible-5.zip"]
    assert "seed 5" in (tmp_path / "flexible-5-solution.md").read_text()
    assert not [path for path in (tmp_path / "flexible-5").rglob("*") if "solution" in path.name]
    assert (ROOT / "course/flexible/solution.md").read_text() == committed


@built
@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["cube"], "no system 'cube'"),
        (["--seed", "-1"], "--seed -1: allowed: a whole number from 0"),
        (["--check", "--seed", "2"], "without --check"),
        (["--out", "/proc/nothing"], "--out /proc/nothing: No such file or directory; allowed"),
        (["--out", str(ROOT / "course"), "flexible"], "is there and is no handout"),
    ],
)
def test_bad_arguments(words: list[str], says: str) -> None:
    done = make(*words)
    assert done.returncode == 2
    assert says in done.stderr


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("title: Resonance", "titel: Resonance", "unknown key 'titel' in an experiment; allowed: commands, design"),
        ("title: Resonance", "title: Peaks", "write '## N. TITLE' of each, in order"),
        ("identify resonance", "identify resonances", "write that"),
        ("seed: 7", "sead: 7", "unknown key 'sead' in course.yaml"),
        ("seed: 7", "seed: [7", "no YAML"),
    ],
)
def test_a_course_that_does_not_fit(tmp_path: Path, old: str, new: str, says: str) -> None:
    folder = tmp_path / "flexible"
    shutil.copytree(ROOT / "course" / "flexible", folder)
    text = (folder / "course.yaml").read_text()
    assert old in text
    (folder / "course.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(BadCourse, match=re.escape(says)):
        check_handout(read_system(folder))


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["qube/control/nothing.yaml"], "no such file: qube/control/nothing.yaml"),
        (["qube/control/upright_lqr.yaml", "--reference", "sine:1"], "--reference 1; allowed: 2 numbers"),
        (["qube/control/upright_lqr.yaml", "--start", "0,x"], "--start 0,x; allowed: 2 numbers"),
        (["qube/control/upright_lqr.yaml", "--seconds"], "--seconds without a value"),
    ],
)
def test_bad_loops(words: list[str], says: str) -> None:
    done = loop(*words)
    assert done.returncode == 2
    assert says in done.stderr


@built
def test_a_loop_that_holds_and_one_that_does_not(tmp_path: Path) -> None:
    law = (ROOT / "course/qube/control/upright_lqr.yaml").read_text()
    assert "pendulum_rad        3.14" in loop("qube/control/upright_lqr.yaml", "--start", "0,3.04").stdout
    (tmp_path / "turned.yaml").write_text(law.replace("-3.1623", "3.1623").replace("59.441", "-59.441"))
    assert "the loop does not hold: arm_rad passes" in loop(str(tmp_path / "turned.yaml"), "--start", "0,3.04").stdout
