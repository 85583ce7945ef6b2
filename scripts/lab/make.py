"""The lab course of course/: scripts/course runs this. Exit status 0 done, 1 a difference (--check), 2 bad input."""

from __future__ import annotations

import argparse
import difflib
import os
import re
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path

from solve import BIN, ROOT, Solver
from system import BadCourse, System, check_handout, read_system

COURSE = ROOT / "course"
OF_A_RIG = ("README.md", "drawing.svg", "picture.png", "experiment.yaml", "*.xml")
DATE = (2000, 1, 1, 0, 0, 0)  # in the zip: the same files give the same bytes


def systems() -> list[str]:
    return sorted(path.parent.name for path in COURSE.glob("*/course.yaml"))


def arguments(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/course", description="Makes the logs of the course, its solutions "
                                     "and what is handed out: course/SYSTEM/solution.md, DIR/SYSTEM and "
                                     "DIR/SYSTEM.zip.", allow_abbrev=False)
    parser.add_argument("system", nargs="*", help=f"of {', '.join(systems())}; all without any")
    parser.add_argument("--check", action="store_true", help="write nothing; say whether the solutions are today's")
    parser.add_argument("--seed", type=int, help="a rig of other parameters: makes DIR/SYSTEM-N, its zip and "
                        "DIR/SYSTEM-N-solution.md, and leaves course/ alone")
    parser.add_argument("--out", type=Path, default=ROOT / "out/course", metavar="DIR", help="default: out/course")
    given = parser.parse_args(words)
    unknown = [name for name in given.system if name not in systems()]
    if unknown:
        parser.error(f"no system {unknown[0]!r} in {COURSE}; allowed: {', '.join(systems())}")
    if given.seed is not None and (given.check or given.seed < 0):
        parser.error(f"--seed {given.seed}: allowed: a whole number from 0, without --check; leave one out")
    if not given.check:
        try:
            given.out.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            parser.error(f"--out {given.out}: {problem.strerror}; allowed: a folder that can be written; take another")
    for program in ("gapscope", "gapscope_twin"):
        if not (BIN / program).is_file():
            parser.error(f"{BIN / program} is not there; build it: cmake --build build --target {program}")
    return given


def lay_out(system: System, to: Path) -> None:
    """What stands in the handout's folder beside inputs and logs."""
    text = (system.folder / "handout.md").read_text(encoding="utf-8").replace("](../../", "](")
    (to / "handout.md").write_text(text, encoding="utf-8")
    (to / "models" / "common").mkdir(parents=True)
    shutil.copy(ROOT / "models/common/scene.xml", to / "models/common")
    for rig in system.rigs:
        (to / "models" / rig).mkdir()
        for pattern in OF_A_RIG:
            for file in (ROOT / "models" / rig).glob(pattern):
                shutil.copy(file, to / "models" / rig)
    for name in system.extra:
        source = next((path for path in (system.folder / name, COURSE / name) if path.exists()), None)
        if source is None:
            raise BadCourse(f"{system.folder / 'course.yaml'}: extra: no {name} in {system.folder} or {COURSE}: "
                            "take it out of the list, or write it")
        (shutil.copytree if source.is_dir() else shutil.copy)(source, to / name)
    for target in re.findall(r"\]\(([^)#:]+)\)", text):
        if not (to / target).exists():
            raise BadCourse(f"{system.folder / 'handout.md'}: a link to {target}, which is not handed out; allowed: "
                            "pictures and READMEs of its rigs; name other pages without a link")


def zipped(folder: Path, to: Path) -> None:
    partial = to.with_name(to.name + ".partial")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(path for path in folder.rglob("*") if path.is_file()):
            entry = zipfile.ZipInfo(f"{folder.name}/{file.relative_to(folder)}", DATE)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, file.read_bytes())
    os.replace(partial, to)


def hand_out(system: System, work: Path, to: Path) -> None:
    """The folder and its zip: written beside, then renamed."""
    partial = to.with_name(to.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    lay_out(system, partial)
    for folder in ("inputs", "logs"):
        shutil.copytree(work / folder, partial / folder)
    shutil.rmtree(to, ignore_errors=True)
    os.replace(partial, to)
    zipped(to, to.with_name(to.name + ".zip"))


def written(path: Path, text: str) -> None:
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    os.replace(partial, path)


def make(name: str, given: argparse.Namespace) -> bool:
    """False where --check finds another text."""
    system = read_system(COURSE / name)
    check_handout(system)
    to = given.out.resolve() / (name if given.seed is None else f"{name}-{given.seed}")
    if to.exists() and ((to / "course.yaml").exists() or not (to / "handout.md").exists()):
        raise BadCourse(f"{to} is there and is no handout; allowed: none, or an older handout; choose another --out")
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        lay_out(system, work)
        text = Solver(system, system.seed if given.seed is None else given.seed, work).solve()
        path = system.folder / "solution.md"
        if given.check:
            old = path.read_text(encoding="utf-8") if path.is_file() else ""
            sys.stdout.writelines(difflib.unified_diff(old.splitlines(True), text.splitlines(True),
                                                       str(path.relative_to(ROOT)), "the program"))
            return old == text
        hand_out(system, work, to)
        written(path if given.seed is None else to.with_name(f"{to.name}-solution.md"), text)
    print(f"{to}.zip", file=sys.stderr)
    return True


def main() -> int:
    given = arguments(sys.argv[1:])
    try:
        same = [make(name, given) for name in given.system or systems()]
    except (BadCourse, OSError) as error:
        print(f"scripts/course: {error}", file=sys.stderr)
        return 2
    if not all(same):
        print("scripts/course: a solution is not what the program says today: scripts/course writes it anew",
              file=sys.stderr)
    return 0 if all(same) else 1


if __name__ == "__main__":
    sys.exit(main())
