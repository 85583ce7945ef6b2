"""schemas/: every result of the program is described, and the dataclasses know what is described."""

from __future__ import annotations

import copy
import json
import re
import subprocess
import typing
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import gapscope as gs
import jsonschema
import pytest
from gapscope._json import keys_of
from gapscope._program import program
from gapscope._results import Open
from referencing import Registry, Resource

from conftest import ROOT
from test_converter import converter

Schema: typing.TypeAlias = dict[str, Any]
FILES = {path.name: path for path in sorted((ROOT / "schemas").iterdir())}
COMMON = "common.schema.json"
EXPERIMENT = "experiment.schema.json"  # test_experiment_schema.py
PLUGINS = {path.name for path in (ROOT / "src" / "plugins").iterdir()}  # gapscope.motor and so on are not results
NOT_DESCRIBED = {"log", "fleet"}  # files that are read: docs/reference/formats.md, docs/reference/fleet.md


def read(name: str) -> Schema:
    schema: Schema = json.loads(FILES[name].read_text(encoding="utf-8"))
    return schema


def closed(schema: Any) -> Any:
    """The schema without room for keys that it does not name: what is published has it, for newer programs."""
    if isinstance(schema, list):
        return [closed(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    strict = {key: closed(value) for key, value in schema.items()}
    if isinstance(schema.get("properties"), dict) and schema.get("type") == "object":
        strict["additionalProperties"] = False
    return strict


@cache
def validator(name: str) -> jsonschema.Draft202012Validator:
    registry = Registry().with_resource(COMMON, Resource.from_contents(closed(read(COMMON))))
    return jsonschema.Draft202012Validator(closed(read(name)), registry=registry)


def name_of(result: Mapping[str, Any]) -> str:
    """The file that describes a result, by what the result calls itself."""
    name = str(result["schema"]).removeprefix("gapscope.").removesuffix("/1")
    return ("identify" if name.startswith("identify.") else name) + ".schema.json"


def check(result: Mapping[str, Any], name: str) -> None:
    assert name_of(result) == f"{name}.schema.json"
    problems = [f"{error.json_path}: {error.message}" for error in validator(name_of(result)).iter_errors(result)]
    assert not problems


def ask(*words: str, status: int = 0) -> dict[str, Any]:
    done = subprocess.run([program(), *words, "--json"], check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == status, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


@pytest.mark.parametrize("name", FILES)
def test_a_schema_is_one(name: str) -> None:
    schema = read(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    for target in re.findall(r'"\$ref": "([^"]*)"', FILES[name].read_text()):
        file, _, place = target.partition("#/$defs/")
        assert place in (read(file) if file else schema)["$defs"], target
    assert name in (COMMON, EXPERIMENT) or "schema" in schema["required"]


def test_every_result_has_its_schema() -> None:
    """What the sources write under "schema"."""
    text = "".join(path.read_text() for folder in ("src", "replay") for path in (ROOT / folder).rglob("*.cc"))
    text += "".join(path.read_text() for path in (ROOT / "src").rglob("*.h"))
    written = set(re.findall(r'"gapscope\.([a-z_.]+?)\.?(?:/1)?"', text)) - {"", *PLUGINS}
    assert {f"{name}.schema.json" for name in written - NOT_DESCRIBED} == set(FILES) - {COMMON}


def test_a_replay_of_each_kind(experiment: str, demo: str, tmp_path: Path) -> None:
    upright = str(tmp_path / "upright.csv")
    rows = "".join(f"{0.002 * k},0,0,0.01,0.005,0,0\n" for k in range(800))
    Path(upright).write_text("t,target_theta,target_alpha,theta,alpha,feedforward,plant_input\n" + rows)
    friction = ("--with", "coulomb_friction@arm", "--set", "coulomb_friction@arm.friction_n_m=6e-4")
    check(ask("replay", experiment, demo, *friction), "replay")
    check(ask("replay", experiment, demo, "--mode", "windows"), "replay")
    loop = ask("replay", str(ROOT / "models/qube_koopman/experiment.yaml"), upright, "--mode", "closed_loop")
    assert loop["logs"][0]["statistics"]
    check(loop, "replay")
    diverges = ask("replay", experiment, demo, "--with", "torque_bias@arm", "--set", "torque_bias@arm.torque_n_m=1e6")
    assert diverges["logs"][0]["outcome"] == "diverged"
    check(diverges, "replay")


def test_what_a_result_becomes(experiment: str, short: str, tmp_path: Path) -> None:
    out = str(tmp_path / "out")
    freeze = [word for name in ("motor.resistance", "motor.km", "arm.mass") for word in ("--freeze", name)]
    check(ask("tune", experiment, short, *freeze, "--starts", "1", "--out", out), "tune")
    check(json.loads((tmp_path / "out" / "result.json").read_text()), "tune")
    check(ask("monitor", out, short), "monitor")
    native = tmp_path / "native"
    check(ask("export", out, "--to", "mujoco_native", "--draws", "5", "--out", str(native)), "fidelity")
    check(json.loads((native / "fidelity.json").read_text()), "fidelity")
    check(json.loads((native / "randomization.json").read_text()), "randomization")
    check(ask("apply", out, "--out", str(tmp_path / "robot.xml")), "apply")


def test_a_diagnosis_and_its_evidence(
    experiment: str, short: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = str(tmp_path / "out")
    bundle = str(tmp_path / "bundle.zip")
    found = ask("diagnose", experiment, short, "--effort", "quick", "--out", out, "--bundle", bundle)
    check(found, "diagnosis")
    with zipfile.ZipFile(bundle) as packed:
        check(json.loads(packed.read("bundle.json")), "bundle")
        assert packed.testzip() is None
    told = [statement for statement in found["statements"] if "numbers" in statement]
    assert told  # else the evidence is not looked at
    for number in {1, len(found["statements"])}:
        check(ask("explain", out, str(number)), "explain")
    monkeypatch.setenv("GAPSCOPE_CONVERT", converter(tmp_path)["GAPSCOPE_CONVERT"])
    views = ask("convert", out, "--to", "mcap", "--out", str(tmp_path / "views"))
    check(views, "convert")
    assert views["logs"][0]["rows"] > 50 and "/sim/joint_states/arm/position" in views["logs"][0]["columns"]


def test_logs(experiment: str, demo: str, tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("time_s,voltage_v,arm_rad,pendulum_rad\n0,1,0,0\n0,1,0,0\n0.1,1,,0\n0.3,1,0,0\n")
    check(ask("inspect", experiment, demo, str(bad)), "inspect")
    check(ask("inspect", demo), "inspect")
    check(ask("convert", demo, "--out", str(tmp_path)), "convert")
    check(ask("identify", "cable", experiment, demo), "identify")
    check(ask("render", experiment, demo, "--out", str(tmp_path / "still.png")), "render")


def test_a_plan_and_its_parts(experiment: str, short: str, tmp_path: Path) -> None:
    work = str(tmp_path / "work")
    plan = ask("plan", experiment, short, "--out", work)
    check(plan, "plan")
    check(ask("run", "--shard", "1/1", work), "run")
    check(ask("merge", work), "merge")

    fleet = tmp_path / "fleet.yaml"
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "1.csv").write_bytes(Path(short).read_bytes())
    (tmp_path / "a" / "2.csv").write_text("not a log\n")
    fleet.write_text(f"schema: gapscope.fleet/1\nexperiment: {experiment}\nlogs: '{{robot}}/{{day}}.csv'\nwhat: tune\n")
    plan = ask("fleet", "plan", str(fleet), "--out", work)
    check(plan, "plan")
    done = ask("fleet", "run", "--unit", plan["tasks"][0]["task"], work)
    check(done, "run")
    assert (done["units"], done["done"], done["failed"], done["there"]) == (1, 1, 0, 0)
    subprocess.run([program(), "fleet", "run", "--shard", "1/1", work], capture_output=True, check=False)
    check(ask("fleet", "merge", work, status=1), "merge")


def test_the_doctor() -> None:
    check(ask("doctor"), "doctor")


def test_designs(experiment: str, tmp_path: Path) -> None:
    short = ("--duration", "1", "--out", str(tmp_path / "input.csv"))
    check(ask("design", "sweep", experiment, *short), "design.input")
    effects = ("--separate", "cable_spring@arm", "--separate", "torque_bias@arm")
    check(ask("design", "optimal", experiment, *effects, *short), "design.optimal")
    check(ask("design", "lqr", experiment, "--q", "1,1,1,1"), "design.feedback")
    servo = ("--inertia-kg-m2", "0.16", "--natural-frequency-hz", "5", "--damping-ratio", "0.7,2")
    check(ask("design", "chirp", *servo, "--speed-limit-rpm", "116"), "design.chirp")


def test_what_is_not_as_described_is_seen(experiment: str, demo: str) -> None:
    whole = ask("inspect", experiment, demo)
    for change in ({"new": 1}, {"fit": "yes"}, {"log": None}):
        other = copy.deepcopy(whole)
        other["logs"][0].update(change)
        assert not validator("inspect.schema.json").is_valid(other)
    del whole["logs"][0]["time"]["rate_hz"]
    assert not validator("inspect.schema.json").is_valid(whole)


# What the dataclasses leave in `extra`: of the search and of files, for programs rather than for people.
OWN = {"out", "messages", "_keep", "extra", "json"}  # not of the JSON
MADE_BY = {"experiment", "seed", "versions"}
EXTRA = {
    "Replay": {*MADE_BY, "cost", "effects", "error_free_run", "error_nominal", "model"},
    "LogFit": {"spread"},
    "LogResult": {"diverged_at_s", "statistics", "windows"},
    "Tune": {*MADE_BY, "command_shift_s", "correlated", "cost", "effects", "force_shift_s", "left_frozen", "model"}
    | {"replays", "solve_s", "spread", "starts", "starts_agree", "time_step_s"},
    "Diagnosis": {*MADE_BY, "at_bounds", "budget", "candidates", "evidence", "left_out", "logs", "model", "policy"}
    | {"refit_model", "remainder", "remains", "time_step_s", "while", "windows"},
    "Interval": {"ratio"},
    "Gap": {"held_out"},
    "Statement": {"blocks", "evidence", "group", "numbers", "prior", "rivals", "seen_beside", "with", "without"},
    "NextExperiment": {"file", "if_absent", "if_present", "probability", "problem", "separates", "why"},
    "Exported": {"logs", "of_each_log", "result", "schema", "versions"},
    "Inspection": {"coverage", "delays", "excitation"},
    "Finding": {"first_row"},
    "Applied": {"result", "versions"},
    "Explanation": {"diagnosis", "versions", "with", "without"},
    "FeedbackDesign": {"versions"},
    "Identification": {"versions"},
    "InputDesign": {"versions"},
    "OptimalDesign": {"versions"},
}
KINDS: dict[str, type[Open]] = {
    "replay": gs.Replay,
    "tune": gs.Tune,
    "diagnosis": gs.Diagnosis,
    "fidelity": gs.Exported,
    "apply": gs.Applied,
    "explain": gs.Explanation,
    "identify": gs.Identification,
    "design.input": gs.InputDesign,
    "design.optimal": gs.OptimalDesign,
    "design.feedback": gs.FeedbackDesign,
}


def test_the_dataclasses_know_what_is_described() -> None:
    known: dict[type[Open], set[str]] = {}
    for name, kind in KINDS.items():
        whole = read(f"{name}.schema.json")
        gather(kind, whole, whole, known)
    inspect = read("inspect.schema.json")
    gather(gs.Inspection, inspect["$defs"]["log"], inspect, known)
    left = {}
    for kind, keys in known.items():
        fields = set(keys_of(kind).values()) - (OWN - keys)
        assert fields <= keys, kind
        left[kind.__name__] = keys - fields
    assert {name: keys for name, keys in left.items() if keys} == EXTRA


def gather(kind: type[Open], described: Schema, whole: Schema, known: dict[type[Open], set[str]]) -> None:
    """The keys that are described of each dataclass: one may stand for several places."""
    described, whole = resolved(described, whole)
    properties = described["properties"]
    known.setdefault(kind, set()).update(properties)
    hints = typing.get_type_hints(kind)
    for name, key in keys_of(kind).items():
        for inner in (hints[name], *typing.get_args(hints[name])):
            if isinstance(inner, type) and issubclass(inner, Open) and key in properties:
                value, place = resolved(properties[key], whole)
                gather(inner, value.get("items") or value.get("additionalProperties") or value, place, known)


def resolved(schema: Schema, whole: Schema) -> tuple[Schema, Schema]:
    while "$ref" in schema:
        file, _, name = schema["$ref"].partition("#/$defs/")
        whole = read(file) if file else whole
        schema = whole["$defs"][name]
    return schema, whole
