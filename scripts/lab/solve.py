"""A system of the course done: inputs and logs made, the commands run as a student runs them, each result held against
what the twin is made of."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from system import BadCourse, Command, Experiment, System

ROOT = Path(__file__).resolve().parents[2]
BIN = ROOT / "build" / "bin"
NAME = re.compile(r"[a-z_]+(?:@[a-z_]+)?\.[a-z_][a-z_0-9]*")  # of a parameter: motor.kp, cable_spring@arm.rest_rad
NOTHING = re.compile(r"-?\d(?:\.\d+)?e-1[2-9]\b")  # what rounding leaves of a zero, other on another machine


def value_of(expression: Any, parameters: Mapping[str, float], values: Mapping[str, float]) -> float:
    """Of numbers, names of parameters (with a point) and of values (without), and functions of math."""
    try:
        text = NAME.sub(lambda m: f"({parameters[m[0]]!r})", str(expression))
        return float(eval(text, {"__builtins__": {}}, {"pi": math.pi, "sqrt": math.sqrt, **values}))
    except (KeyError, NameError, SyntaxError, TypeError, ArithmeticError) as error:
        raise BadCourse(f"{expression!r}: {error}; allowed: numbers, pi, sqrt, {', '.join([*parameters, *values])}: "
                        "mend it in course.yaml") from None


def at_path(result: Any, path: str) -> dict[str, Any]:
    """A value of a result: its name in 'values', or keys and numbers of a list with points between."""
    found = result.get("values", {}).get(path)
    if found is None:
        found = result
        try:
            for key in path.split("."):
                found = found[int(key)] if isinstance(found, list) else found[key]
        except (KeyError, IndexError, ValueError, TypeError):
            raise BadCourse(f"no value {path!r} in the result; allowed: {', '.join(result.get('values', result))}: "
                            "mend it in course.yaml") from None
    return found if isinstance(found, dict) else {"value": found}


def broken(command: str) -> str:
    """A command in lines that a page holds."""
    return " \\\n".join(textwrap.wrap(command, 116, subsequent_indent="    ", break_long_words=False,
                                    break_on_hyphens=False))


@dataclass
class Solver:
    """Works in a folder that looks like the handout's; `parts` is the solution's text."""

    system: System
    seed: int
    work: Path
    parts: list[str] = field(default_factory=list)
    truth: dict[str, dict[str, float]] = field(default_factory=dict)  # of each log
    nominal: dict[str, float] = field(default_factory=dict)
    found: dict[str, float] = field(default_factory=dict)
    inside: int = 0
    intervals: int = 0

    def shell(self, command: str) -> str:
        path = f"{BIN}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(["bash", "-c", command], cwd=self.work, capture_output=True, text=True, check=False,
                              env={**os.environ, "PATH": path})
        if done.returncode != 0:
            raise BadCourse(f"{self.system.folder / 'course.yaml'}: exit status {done.returncode}: {command}\n"
                            f"{done.stderr.strip()}")
        return NOTHING.sub("0", done.stdout)

    def show(self, command: str, output: str) -> None:
        lines = [line.rstrip() for line in output.strip("\n").splitlines()]
        self.parts.append("\n".join(["```text", broken(f"$ {command}"), *lines, "```"]))

    def write_levels(self, name: str, given: Mapping[str, Any]) -> None:
        rate, time, rows = given["rate_hz"], 0, []
        for hold in given["hold"]:
            first, last, step, seconds = hold if len(hold) == 4 else (hold[0], hold[0], 1, hold[1])
            for i in range(round((last - first) / step) + 1):
                rows += [f"{(time + k) / rate:.4f},{first + i * step:.6g}" for k in range(round(seconds * rate))]
                time = len(rows)
        rows.append(f"{time / rate:.4f},{rows[-1].split(',')[1]}")
        (self.work / "inputs" / f"{name}.csv").write_text(f"time_s,{given['column']}\n" + "\n".join(rows) + "\n")

    def make_log(self, name: str, line: str) -> str:
        """By the twin; returns the command that makes it."""
        rig, _, options = line.partition(" ")
        if rig not in self.system.rigs:
            raise BadCourse(f"{self.system.folder / 'course.yaml'}: log {name}: rig {rig!r}; allowed: "
                            f"{', '.join(self.system.rigs)}; begin the line with the rig")
        command = f"gapscope_twin --rig {rig} --seed {self.seed} {self.system.rigs[rig]} {options}"
        self.shell(f"{command} --out made --label made/label.json")
        made = sorted((self.work / "made").glob("log_*.csv"))
        for i, file in enumerate(made):
            file.rename(self.work / "logs" / (f"{name}_{i + 1}.csv" if len(made) > 1 else f"{name}.csv"))
        label = json.loads((self.work / "made" / "label.json").read_text())
        base = label["base"]
        shutil.rmtree(self.work / "made")
        self.nominal |= {parameter: entry["nominal"] for parameter, entry in base.items()}
        given = dict(item.split("=") for item in re.findall(r"--set (\S+=\S+)", command))
        effects = {parameter: float(number) for parameter, number in given.items() if parameter not in base}
        zeros = {f"{signal}.offset_rad": sensor["offset_rad"] for signal, sensor in label["sensors"].items()}
        self.truth[name] = {parameter: entry["true"] for parameter, entry in base.items()} | effects | zeros
        return f"{command} --out made"

    def table(self, command: Command, result: Any) -> str:
        truths = self.truth.get(command.log or next(reversed(self.truth), ""), {})
        lines = ["| value | found | 95 % interval | twin | off by | inside |", "|---|---|---|---|---|---|"]
        if command.against == "document":
            lines = ["| value | found | document | off by |", "|---|---|---|---|"]
        for name, given in {**command.table, **command.wrong}.items():
            path, expression = given if isinstance(given, list) else (name, given)
            truth, entry = value_of(expression, truths, {}), at_path(result, path)
            value, low, high = entry["value"], entry.get("low"), entry.get("high")
            off = f"{100 * (value / truth - 1):+.2f} %".replace("-0.00", "+0.00") if truth else ""
            if command.against == "document":
                lines.append(f"| {name} | {value:.8g} | {truth:.8g} | {off} |")
                continue
            interval = inside = ""
            if low is not None and high is not None:
                interval = f"{low:.6g} .. {high:.6g}"
                inside = "yes" if low <= truth <= high else "no"
                self.intervals += name in command.table
                self.inside += name in command.table and inside == "yes"
            mark = " (wrong model)" if name in command.wrong else ""
            lines.append(f"| `{name}`{mark} | {value:.6g} | {interval} | {truth:.6g} | {off} | {inside} |")
        return "\n".join(lines)

    def write_found(self) -> None:
        text = "".join(f"{name}: {value:.5g}\n" for name, value in self.found.items())
        (self.work / "found.yaml").write_text(text)

    def run(self, command: Command) -> None:
        self.show(command.run, self.shell(command.run))
        if not (command.table or command.wrong or command.found):
            return
        result = json.loads(self.shell(f"{command.run} --json --quiet"))
        if command.table or command.wrong:
            self.parts.append(self.table(command, result))
        values = {name: entry["value"] for name, entry in result.get("values", {}).items()}
        for name, expression in command.found.items():
            self.found[name] = float(f"{value_of(expression, self.found, values):.5g}")
        self.write_found()

    def experiment(self, number: int, experiment: Experiment) -> None:
        self.parts.append(f"## {number}. {experiment.title}")
        for name, given in experiment.levels.items():
            self.write_levels(name, given)
        for line in experiment.design:
            self.show(line, self.shell(line))
        made = [f"# logs/{log[0]}\n" + broken(f"$ {self.make_log(*log)}") for log in experiment.twin.items()]
        if made:
            self.parts.append("\n".join(["The twin makes:\n\n```text", *made, "```"]))
        for command in experiment.commands:
            self.run(command)

    def summary(self) -> str:
        """The parameters that were carried on, data sheet and twin beside them."""
        of_all = {name: value for truth in self.truth.values() for name, value in truth.items()}
        lines = ["| parameter | data sheet | found | twin | off by |", "|---|---|---|---|---|"]
        for name, value in self.found.items():
            first = next(truth for truth in [*self.truth.values(), of_all] if name in truth)
            off = f"{100 * (value / first[name] - 1):+.2f} %"
            sheet = f"{self.nominal[name]:.5g}" if name in self.nominal else ""
            lines.append(f"| `{name}` | {sheet} | {value:.5g} | {first[name]:.5g} | {off} |")
        return "\n".join(lines)

    def solve(self) -> str:
        for folder in ("inputs", "logs"):
            (self.work / folder).mkdir()
        self.write_found()
        for number, experiment in enumerate(self.system.experiments, 1):
            self.experiment(number, experiment)
        title = re.match(r"# (.*)", (self.system.folder / "handout.md").read_text())
        assert title
        head = [f"# Solution: {title[1]}",
                f"For the teacher. Made by `scripts/course`; the twin is that of seed {self.seed}.\n"
                f"Of {self.intervals} intervals {self.inside} hold the twin's value; those of a wrong model "
                "do not count.\n"
                "An interval is meant to hold it in 95 of 100 cases, if the model's other values are right."]
        tail = ["## What was found", "`found.yaml`, as the experiments leave it:", self.summary()]
        return "\n\n".join([*head, *self.parts, *(tail if self.found else [])]) + "\n"
