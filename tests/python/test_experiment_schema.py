"""schemas/experiment.schema.json: the experiments of this checkout are as it says, and what it refuses the program
refuses too, key by key."""

from __future__ import annotations

import copy
import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from gapscope._program import program
from ruamel.yaml import YAML

from conftest import ROOT

SCHEMA = json.loads((ROOT / "schemas/experiment.schema.json").read_text(encoding="utf-8"))
VALID = jsonschema.Draft202012Validator(SCHEMA)
FILES = sorted(path for folder in ("models", "examples") for path in (ROOT / folder).rglob("experiment*.yaml"))
CONTROLLERS = sorted((ROOT / "course").glob("*/control/*.yaml"))


def read(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


def problems(experiment: Any, schema: Any = VALID) -> list[str]:
    return [f"{error.json_path}: {error.message[:200]}" for error in schema.iter_errors(experiment)]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.parent.name)
def test_the_experiments_are_as_it_says(path: Path) -> None:
    assert problems(read(path.read_text(encoding="utf-8"))) == []


def test_so_are_the_controllers_of_the_course() -> None:
    schema = jsonschema.Draft202012Validator({**SCHEMA["$defs"]["controller"], "$defs": SCHEMA["$defs"]})
    assert CONTROLLERS
    for path in CONTROLLERS:
        assert problems(read(path.read_text(encoding="utf-8"))["controller"], schema) == [], path


def page() -> Any:
    """The example of docs/reference/experiment.md: it has nearly all keys."""
    text = (ROOT / "docs/reference/experiment.md").read_text(encoding="utf-8")
    return read(text.split("```yaml\n")[1].split("```")[0])


CONTROLLER: dict[str, Any] = {
    "actuator": "motor",
    "inputs": [{"name": "theta", "signal": "arm_rad"}],
    "terms": [{"input": "theta", "proportional": -6}],
    "observer": {"a": [[0]], "b": [1], "c": [[1]], "gain": [[1]], "feedback": [1]},
    "swing_up": {"input": "theta", "catch_rad": 0.3, "gain": 1, "inertia_kg_m2": 1e-4, "torque_n_m": 0.01},
}
TURN = {"signal": "turn", "body": "base", "columns_of_elements": ["qw", "qx", "qy", "qz"], "mount": ["a", "b", "c"]}
FILTER = {"cutoff_rad_per_s": "rod.mass", "damping_ratio": "rod.length"}


def whole() -> Any:
    """The page's example with the keys that it lacks."""
    experiment = page()
    experiment["controller"] = copy.deepcopy(CONTROLLER)
    experiment["log"]["source"] = {"topics": ["/joint_states"]}
    experiment["measured"][0]["filter"] = dict(FILTER)
    experiment["measured"].append(dict(TURN))
    return experiment


def test_the_page_is_as_it_says() -> None:
    assert problems(whole()) == []


def maps(value: Any, schema: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Where an experiment has maps of stated keys, and what the schema says of each; once for each definition."""
    schema = SCHEMA["$defs"][schema["$ref"].rsplit("/", 1)[1]] if "$ref" in schema else schema
    if "properties" in schema:
        yield at, schema
    if isinstance(value, dict):
        named = schema.get("additionalProperties")
        for key, item in value.items():
            inner = schema.get("properties", {}).get(key, named if isinstance(named, dict) else {})
            yield from maps(item, inner, (*at, key))
    if isinstance(value, list) and "items" in schema:
        for k, item in enumerate(value):
            yield from maps(item, schema["items"], (*at, k))


def places() -> dict[str, tuple[tuple[Any, ...], Any]]:
    found: dict[str, tuple[tuple[Any, ...], Any]] = {}
    for at, schema in maps(whole(), SCHEMA):
        kind = ".".join(str(part) for part in at if not isinstance(part, int)) or "top"
        found.setdefault(re.sub(r"(values|parameters)\.[\w.]+$", r"\1", kind), (at, schema))
    return found


PLACES = places()


def with_key(at: tuple[Any, ...], key: str, value: Any) -> Any:
    experiment = whole()
    place = experiment
    for part in at:
        place = place[part]
    place[key] = value
    return experiment


def said(experiment: Any, folder: Path) -> str:
    """What the program says of it. A controller is read for a closed loop alone, which needs a rig and a log."""
    path, log = folder / "experiment.yaml", ROOT / "demo/qube.csv"
    command = ["inspect"]
    if experiment.get("controller", CONTROLLER) != CONTROLLER:
        rig = read((ROOT / "models/qube/experiment.yaml").read_text(encoding="utf-8"))
        rig.update(model=str(ROOT / "models/qube/qube.xml"), controller=experiment["controller"])
        experiment, command = rig, ["replay", "--mode", "closed_loop"]
    path.write_text(json.dumps(experiment), encoding="utf-8")
    done = subprocess.run([program(), *command, str(path), str(log)], capture_output=True, text=True, check=False)
    return done.stderr


def test_all_maps_are_looked_at() -> None:
    described = json.dumps(SCHEMA).count('"additionalProperties": false')
    reached = {id(schema) for _, schema in maps(whole(), SCHEMA)}
    assert len(reached) == described == len({id(schema) for _, schema in PLACES.values()})


@pytest.mark.parametrize("place", PLACES)
def test_a_key_is_one_that_the_program_knows(place: str, tmp_path: Path) -> None:
    at, schema = PLACES[place]
    known: set[str] = set()
    for where in (at, ("measured", -1)) if place == "measured" else (at,):  # an orientation has keys of its own
        experiment = with_key(where, "zzz", 1)
        assert problems(experiment)
        message = said(experiment, tmp_path)
        assert "unknown key" in message, message
        allowed = re.search(r"'zzz', allowed: ([^;\n]*)", message)
        assert allowed is not None
        known.update(allowed[1].split(", "))
    assert known == set(schema["properties"])


WRONG: list[tuple[tuple[Any, ...], str, Any]] = [
    ((), "schema", "gapscope.experiment/2"),
    ((), "model", ""),
    ((), "measured", []),
    ((), "hold", "base"),
    ((), "hold", ["base", "base"]),
    (("log",), "format", "xls"),
    (("log", "time"), "unit", "min"),
    (("log", "repair"), "missing", "guess"),
    (("log", "repair"), "gap_factor", 1),
    (("log", "companions", 0), "find", ""),
    (("values", "log.kp"), "column", "both"),
    (("values", "log.kp"), "scale", 0),
    (("values",), "pi", {"header": "kp"}),
    (("actuators", 0), "kind", "servo"),
    (("actuators", 0), "kind", "torque"),  # with the gains of a position servo
    (("actuators", 0), "kp", 0),
    (("actuators", 0), "kd", -1),
    (("actuators", 0), "force_limit_n_m", 0),
    (("commands", 0), "scale", 0),
    (("measured", 0), "kind", "power"),
    (("measured", 0), "kind", "torque"),  # of a joint
    (("measured", 0), "actuator", "motor"),  # and a joint
    (("measured", 0), "resolution", -1),
    (("measured", 0), "wrap", 0),
    (("measured", 0), "filter", {"cutoff_rad_per_s": "rod.mass"}),
    (("measured", 0), "score", "yes"),
    (("measured", 0), "element", 0),  # of a joint
    (("measured", 0), "start", True),  # likewise
    (("measured", 0), "order", "xyzw"),  # likewise
    (("measured", -1), "element", -1),
    (("measured", -1), "scale", 2),  # of an orientation
    (("measured", -1), "mount", ["a"]),
    (("measured", -1), "columns_of_elements", "q"),
    (("parameters", "rod.mass"), "bounds", [0.1]),
    (("parameters", "rod.mass"), "nominal", "0.2 kg"),
    (("parameters", "rod.length"), "frozen", False),  # and no bounds
    (("parameters",), "2nd", {"unit": "1", "nominal": 1, "frozen": True}),
    (("candidates", 0), "name", "gear-eccentricity"),
    (("candidates", 0), "set", {"body/rod/mass": "1"}),  # and a torque
    (("candidates", 0), "config", {"a": "1"}),  # of no plugin
    (("candidates", 0, "parameters", "amplitude_n_m"), "role", "magnitude"),
    (("limits", 0), "joint", "hinge"),  # and an actuator
    (("limits", 0), "angle_rad", 1),  # of an actuator
    (("limits", 1), "speed_rad_per_s", -1),
    (("controller",), "limit", -1),
    (("controller", "terms", 0), "filter_rad_per_s", 0),
    (("controller", "swing_up"), "catch_rad", 0),
    (("controller", "swing_up"), "arm_speed", 1),  # of no arm
    (("replay",), "mode", "closed_loop"),
    (("replay",), "window_s", 0),
]
MISSING: list[tuple[tuple[Any, ...], str]] = [
    ((), "model"),
    ((), "measured"),
    (("log", "companions", 0), "replace"),
    (("values", "log.kp"), "header"),
    (("actuators", 0), "joint"),
    (("actuators", 0), "kp"),
    (("commands", 0), "column"),
    (("measured", 0), "signal"),
    (("measured", 0), "joint"),
    (("measured", -1), "body"),
    (("parameters", "rod.mass"), "unit"),
    (("parameters", "rod.mass"), "bounds"),
    (("candidates", 0), "parameters"),
    (("candidates", 0), "joint"),
    (("candidates", 0, "parameters", "amplitude_n_m"), "bounds"),
    (("limits", 1), "joint"),
    (("controller", "observer"), "feedback"),
    (("controller", "swing_up"), "torque_n_m"),
]


@pytest.mark.parametrize(("at", "key", "value"), WRONG)
def test_what_it_refuses_the_program_refuses(at: tuple[Any, ...], key: str, value: Any, tmp_path: Path) -> None:
    experiment = with_key(at, key, value)
    assert problems(experiment)
    message = said(experiment, tmp_path)
    assert message.startswith(f"gapscope: {tmp_path}/experiment.yaml:"), message


@pytest.mark.parametrize(("at", "key"), MISSING)
def test_so_does_what_must_be_there(at: tuple[Any, ...], key: str, tmp_path: Path) -> None:
    experiment = with_key(at, key, None)
    place = experiment
    for part in at:
        place = place[part]
    del place[key]
    assert problems(experiment)
    message = said(experiment, tmp_path)
    assert message.startswith(f"gapscope: {tmp_path}/experiment.yaml:"), message
