"""One system of the course: what its course.yaml and handout.md say, read and held against each other."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

KEYS = {
    "course.yaml": {"seed", "rigs", "extra", "experiments"},
    "an experiment": {"title", "levels", "design", "twin", "commands"},
    "a command": {"run", "log", "against", "table", "wrong", "found"},
    "a list of levels": {"column", "rate_hz", "hold"},
}


class BadCourse(Exception):
    """What, where, what was there, what is allowed, the cure."""


@dataclass(frozen=True)
class Command:
    run: str
    log: str = ""  # whose truth the table is held against; the last one without
    against: str = "twin"  # or "document"
    table: dict[str, Any] = field(default_factory=dict)  # value: what it should be; or label: [value, ...]
    wrong: dict[str, Any] = field(default_factory=dict)  # the same of values that a wrong model gives
    found: dict[str, Any] = field(default_factory=dict)  # parameter for found.yaml: expression of the values


@dataclass(frozen=True)
class Experiment:
    title: str
    levels: dict[str, dict[str, Any]]
    design: list[str]
    twin: dict[str, str]
    commands: list[Command]


@dataclass(frozen=True)
class System:
    folder: Path
    seed: int
    rigs: dict[str, str]
    extra: list[str]
    experiments: list[Experiment]


def _known(path: Path, what: str, given: Any) -> dict[str, Any]:
    if not isinstance(given, dict):
        raise BadCourse(f"{path}: {what} is {given!r}; allowed: a map of {', '.join(sorted(KEYS[what]))}")
    unknown = sorted(set(given) - KEYS[what])
    if unknown:
        raise BadCourse(f"{path}: unknown key {unknown[0]!r} in {what}; allowed: {', '.join(sorted(KEYS[what]))}")
    return given


def _command(path: Path, given: Any) -> Command:
    if isinstance(given, str):
        return Command(given)
    entry = _known(path, "a command", given)
    if "run" not in entry:
        raise BadCourse(f"{path}: a command without 'run': {given!r}; give the command's line as 'run'")
    if entry.get("against", "twin") not in ("twin", "document"):
        raise BadCourse(f"{path}: against: {entry['against']}; allowed: twin, document")
    return Command(**entry)


def _experiment(path: Path, given: Any) -> Experiment:
    entry = _known(path, "an experiment", given)
    if "title" not in entry:
        raise BadCourse(f"{path}: an experiment without 'title': {given!r}; give it one")
    levels = entry.get("levels", {})
    for name, level in levels.items():
        missing = KEYS["a list of levels"] - set(_known(path, "a list of levels", level))
        if missing:
            raise BadCourse(f"{path}: levels of {name} without {sorted(missing)[0]!r}; give it")
    commands = [_command(path, command) for command in entry.get("commands", [])]
    return Experiment(entry["title"], levels, entry.get("design", []), entry.get("twin", {}), commands)


def read_system(folder: Path) -> System:
    path = folder / "course.yaml"
    try:
        entry = _known(path, "course.yaml", yaml.safe_load(path.read_text(encoding="utf-8")))
    except yaml.YAMLError as error:
        raise BadCourse(f"{path}: no YAML: {str(error).replace(chr(10), ' ')}; mend the file") from None
    missing = KEYS["course.yaml"] - {"extra"} - set(entry)
    if missing:
        raise BadCourse(f"{path}: without {sorted(missing)[0]!r}; give it")
    experiments = [_experiment(path, given) for given in entry["experiments"]]
    return System(folder, entry["seed"], entry["rigs"], entry.get("extra", []), experiments)


def _one_line(command: str) -> str:
    return " ".join(command.replace("\\\n", " ").split())


def check_handout(system: System) -> None:
    """Its headings are the experiments, and its blocks of commands are theirs, in order."""
    path = system.folder / "handout.md"
    parts = re.split(r"^## \d+\. (.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    titles, texts = parts[1::2], parts[2::2]
    wanted = [experiment.title for experiment in system.experiments]
    if titles != wanted:
        raise BadCourse(f"{path}: headings {titles}; course.yaml has {wanted}: write '## N. TITLE' of each, in order")
    for experiment, text in zip(system.experiments, texts, strict=True):
        blocks = "\n".join(re.findall(r"^```sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
        shown = [_one_line(line) for line in re.split(r"(?<!\\)\n", blocks) if line.strip()]
        given = [_one_line(line) for line in [*experiment.design, *(c.run for c in experiment.commands)]]
        for here, there in zip([*shown, *[""] * len(given)], given, strict=False):
            if here != there:
                raise BadCourse(f"{path}: {experiment.title}: command {here!r}; course.yaml has {there!r}: write that")
        if len(shown) > len(given):
            raise BadCourse(f"{path}: {experiment.title}: {shown[len(given)]!r} is not in course.yaml: add it there")
