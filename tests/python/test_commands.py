"""The commands through Python: results, errors, interruption."""

from __future__ import annotations

import csv
import json
import math
import mmap
import os
import pickle
import re
import signal
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import gapscope as gs
import numpy as np
import pytest
from gapscope import fleet
from gapscope._commands import Feedback, Shape
from gapscope._json import from_json, keys_of

from conftest import ROOT, interrupt_after

EFFECTS = ["cable_spring@arm", "coulomb_friction@arm"]
TRUTH = {
    "cable_spring@arm.stiffness_n_m_per_rad": 0.0012,
    "cable_spring@arm.rest_rad": -0.4,
    "coulomb_friction@arm.friction_n_m": 0.0006,
}

FROZEN = [
    *("motor.resistance", "motor.kt", "motor.km", "arm.mass", "arm.damping"),
    *("pendulum.mass", "pendulum.length", "pendulum.damping"),
]


def short_log(demo: str, name: str) -> gs.Log:
    return gs.Log(np.genfromtxt(demo, delimiter=",", names=True)[:1000], name=name)


def holds(result: Any, data: dict[str, Any]) -> None:
    """Every number and text of the JSON is in the dataclass, as a field of its own or in `extra`."""
    names = {key: name for name, key in keys_of(type(result)).items()}
    for key, value in data.items():
        ours = result.extra[key] if key in result.extra else getattr(result, names[key])
        if isinstance(value, dict) and hasattr(ours, "extra"):
            holds(ours, value)
        elif isinstance(value, dict) and value and hasattr(next(iter(ours.values()), None), "extra"):
            for name, item in value.items():
                holds(ours[name], item)
        elif isinstance(value, list) and ours and hasattr(ours[0], "extra"):
            assert len(value) == len(ours)
            for one, item in zip(ours, value):
                holds(one, item)
        elif value is None:
            assert ours is None or math.isnan(ours)
        elif isinstance(value, list):
            assert list_of(ours) == list_of(value)
        else:
            assert ours == value


def list_of(value: Any) -> Any:
    """Tuples as lists, unknown numbers as None, at any depth."""
    if isinstance(value, (list, tuple)):
        return [list_of(one) for one in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def test_replay_mirrors_the_json(experiment: str, demo: str, tmp_path: Path) -> None:
    result = gs.replay(experiment, demo, with_=EFFECTS, set=TRUTH, out=tmp_path / "out")
    assert result.error < 0.01
    holds(result, result.json)
    assert result.logs[0].signals["arm_rad"].nrmse == result.json["logs"][0]["signals"]["arm_rad"]["nrmse"]
    trace = result.traces[0]["arm_rad"]
    rmse = np.sqrt(np.mean((trace.predicted - trace.measured) ** 2))
    assert rmse == pytest.approx(result.logs[0].signals["arm_rad"].rmse, rel=1e-3)
    assert set(result.traces[0]) == {"arm_rad", "pendulum_rad"} and "motor" in result.traces[0].commands
    assert result.model.effects == tuple(EFFECTS)
    assert "springref" in result.model.xml() and "srcdoc" in result.report()._repr_html_()
    shown = result._repr_html_()
    assert "<svg" in shown and "arm_rad" in shown
    assert pickle.loads(pickle.dumps(result)).error == result.error
    with pytest.raises(AttributeError):
        result.error = 0  # type: ignore[misc]


def test_a_newer_program_and_unknown_numbers() -> None:
    score = from_json(gs.SignalScore, {"rmse": None, "mae": 1, "new": {"a": 1}})
    assert math.isnan(score.rmse) and score.mae == 1 and score.extra == {"new": {"a": 1}}


def test_files_of_a_temporary_result_live_as_long(experiment: str, demo: str) -> None:
    result = gs.replay(experiment, demo)
    out, model, traces = result.out, result.model, result.traces
    del result
    assert model.xml() and len(traces[0]["arm_rad"].time_s) == 5001
    del model, traces
    assert not out.exists()


def mapped(array: np.ndarray) -> mmap.mmap | None:
    """The map that an array is a view of."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return base if isinstance(base, mmap.mmap) else None


def test_traces_are_a_map_that_outlives_its_files(
    experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    result = gs.replay(experiment, demo)
    (out,) = tmp_path.iterdir()
    assert out == result.out
    with (out / "traces" / "qube.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    expected = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    (traces,) = result.traces
    arrays = {"__time": traces["arm_rad"].time_s, "command/motor": traces.commands["motor"]}
    for name in traces:
        arrays |= {f"measured/{name}": traces[name].measured, f"predicted/{name}": traces[name].predicted}
    assert set(arrays) == set(expected)
    (whole,) = {mapped(array) for array in arrays.values()}
    assert whole is not None and len(whole) == 8 * 5001 * len(expected)
    assert list(tmp_path.iterdir()) == [out]  # what is mapped has no name any more
    del result, traces
    assert not list(tmp_path.iterdir())
    for name, array in arrays.items():
        assert np.array_equal(array, expected[name]) and array.flags.aligned and array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_errors_are_fields(experiment: str, demo: str, tmp_path: Path) -> None:
    with pytest.raises(gs.InputError) as raised:
        gs.replay(experiment, demo, with_="cable_sprin@arm")
    assert "cable_sprin" in str(raised.value) and "cable_spring" in str(raised.value)
    still = [0, 0, 0]
    log = gs.Log({"time_s": [0, 0.1, 0.2], "voltage": [0, 1, 2], "arm_rad": still, "pendulum_rad": still}, name="run")
    with pytest.raises(gs.InputError) as raised:
        gs.replay(experiment, log)
    error = raised.value
    assert error.where == "run" and "voltage_v" in error.what and error.cure == "did you mean 'voltage'?"
    assert pickle.loads(pickle.dumps(error)).cure == error.cure
    with pytest.raises(gs.InputError, match="no such experiment"):
        gs.replay("gone.yaml", demo)
    with pytest.raises(gs.InputError, match="names that differ"):
        gs.replay(experiment, gs.Log({"t": [0, 1]}, name="a/b"))
    bad = tmp_path / "run.yaml"
    bad.write_text("model: 1\n")
    with pytest.raises(gs.InputError, match="run.yaml"):
        gs.inspect(bad, demo)


def test_a_library_that_is_not_there_names_its_cure(
    experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = gs.replay(experiment, demo, out=tmp_path)
    for table in fleet.TABLES:
        (tmp_path / f"{table}.csv").write_text("task\n1\n")
    calls: dict[Callable[[], object], str] = {
        gs.Log({"t": [0, 1]}).to_pandas: "pandas",
        lambda: fleet.read_fleet(tmp_path): "pandas",
        gs.load_plugins: "mujoco",
        gs.plugin_library: "mujoco",
        result.model.mujoco: "mujoco",
    }
    for call, library in calls.items():
        monkeypatch.setitem(sys.modules, library, None)
        with pytest.raises(gs.InputError) as raised:
            call()
        error = raised.value
        assert isinstance(error, gs.MissingLibrary) and isinstance(error, ModuleNotFoundError)
        assert error.cure == f"pip install {library}" and error.what and error.where == library
        assert pickle.loads(pickle.dumps(error)).cure == error.cure and error.cure in str(error)


def test_inspect(experiment: str, demo: str) -> None:
    (found,) = gs.inspect(experiment, [demo])
    assert found.fit and found.channels[0].name == "motor" and found.time["rows"] == 5001
    assert "fit for use" in found._repr_html_()


def test_inspect_without_an_experiment(experiment: str, demo: str, short: str) -> None:
    first, second = gs.inspect([demo, gs.read(short)])
    assert [c.name for c in first.channels] == ["voltage_v", "arm_rad", "pendulum_rad"] and second.time["rows"] == 300
    (alone,) = gs.inspect(demo)
    assert alone.time == first.time
    for words in ((experiment,), (gs.Experiment(experiment),)):
        with pytest.raises(gs.InputError, match="no log"):
            gs.inspect(*words)


def test_an_experiment_from_memory(experiment: str, demo: str) -> None:
    keys = {
        "model": "qube.xml",
        "commands": [{"actuator": "motor", "column": "voltage_v", "unit": "V"}],
        "measured": [{"signal": name, "column": f"{name}_rad", "joint": name} for name in ("arm", "pendulum")],
    }
    result = gs.replay(gs.Experiment(keys, base=Path(experiment).parent), demo)
    assert result.error == pytest.approx(gs.replay(experiment, demo).error, rel=0.01)
    assert json.loads((result.out / "experiment.yaml").read_text())["commands"] == keys["commands"]
    with pytest.raises(gs.InputError, match="tolist"):
        gs.replay({**keys, "doc": np.zeros(3)}, demo)


def test_tune_with_progress_and_files_in_out(experiment: str, demo: str, tmp_path: Path) -> None:
    seen: list[gs.Progress] = []
    result = gs.tune(
        experiment,
        short_log(demo, "half"),
        with_="cable_spring@arm",
        freeze=FROZEN,
        starts=1,
        out=tmp_path,
        progress=seen.append,
    )
    holds(result, _named(result))
    stiffness = result["cable_spring@arm.stiffness_n_m_per_rad"]
    assert stiffness.low < 0.0012 < stiffness.high or abs(stiffness.value - 0.0012) < 4e-4
    assert result.termination == "converged" and result.error.held_out < 0.7 * result.error.nominal
    assert seen and seen[-1].stage == "fit" and seen[-1].best is not None and seen[-1].total is None
    assert (tmp_path / "logs" / "half.npz").is_file() and (tmp_path / "report.html").is_file()
    assert "cable_spring@arm" in result._repr_html_()
    with pytest.raises(KeyError, match="cable_spring@arm.rest_rad"):
        result["motor.k"]


def _named(result: gs.Tune) -> dict[str, Any]:
    text = json.dumps(result.json).replace(str(result.out / "logs" / "half.npz"), "half")
    data: dict[str, Any] = json.loads(text)
    return data


def test_ctrl_c_gives_the_best_so_far(experiment: str, demo: str) -> None:
    started = threading.Event()

    def first(_: gs.Progress) -> None:
        if not started.is_set():
            started.set()
            interrupt_after(0.2)

    with pytest.raises(KeyboardInterrupt) as raised:
        gs.tune(experiment, short_log(demo, "half"), with_=EFFECTS, freeze=FROZEN, starts=1000, progress=first)
    partial = raised.value.partial  # type: ignore[attr-defined]
    assert isinstance(raised.value, gs.Interrupted) and isinstance(partial, gs.Tune)
    assert partial.termination == "interrupted" and math.isfinite(partial.error.held_out)
    assert (partial.out / "model.xml").is_file()


def test_ctrl_c_while_a_result_is_read(experiment: str, short: str, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[object] = []

    def interrupted_once(*words: Any, **fields: Any) -> Any:
        calls.append(words)
        if len(calls) == 1:
            raise KeyboardInterrupt
        return from_json(*words, **fields)

    monkeypatch.setattr("gapscope._commands.from_json", interrupted_once)
    with pytest.raises(gs.Interrupted) as raised:
        gs.tune(experiment, short, freeze=FROZEN, starts=1)
    assert isinstance(raised.value.partial, gs.Tune) and raised.value.partial.termination == "converged"


def test_an_interrupted_diagnosis_goes_on(experiment: str, short: str, tmp_path: Path) -> None:
    """Ctrl-C at the first stage of the search: a verdict so far, and a journal to go on from."""
    stages: list[str] = []

    def first(progress: gs.Progress) -> None:
        stages.append(progress.stage)
        if len(stages) == 2:
            os.kill(os.getpid(), signal.SIGINT)

    quick: dict[str, Any] = {"effort": "quick", "out": tmp_path, "options": {"no-next-experiment": True}}
    log = gs.Log(np.genfromtxt(short, delimiter=",", names=True), name="half")
    with pytest.raises(gs.Interrupted) as raised:
        gs.diagnose(experiment, log, progress=first, **quick)
    partial = raised.value.partial
    assert isinstance(partial, gs.Diagnosis) and partial.termination == "interrupted"
    assert math.isfinite(partial.gap.refit) and "interrupted" in partial._repr_html_()
    assert (tmp_path / "diagnosis.journal").is_dir()
    whole = gs.diagnose(experiment, log, resume=True, **quick)
    assert whole.termination != "interrupted" and not (tmp_path / "diagnosis.journal").exists()


def test_a_diagnosis_shows_its_logs_and_what_is_absent(experiment: str, demo: str, tmp_path: Path) -> None:
    only: dict[str, Any] = {"effort": "quick", "out": tmp_path, "options": {"no-next-experiment": True}}
    log = np.genfromtxt(demo, delimiter=",", names=True)[:400]
    found = gs.diagnose(experiment, gs.Log(log, name="monday"), **only)
    shown = found._repr_html_()
    # Every third window of both its parts judged it, and two signals are drawn of each.
    assert shown.count("<svg") == 4 and "arm_rad" in shown
    assert shown.count(">monday</td>") == 2 == shown.count(">monday, from ")
    bounded = sum(1 for s in found.statements if s.answer == "absent" and s.bound)
    unseen = sum(1 for s in found.statements if s.answer == "unseen")
    assert bounded and f"{bounded} absent beyond a bound" in shown
    assert (f"{unseen} unseen in these logs" in shown) == bool(unseen)
    still = found.video(tmp_path / "still.png", log="monday", options={"size": "320x240", "at": 0.1})
    assert still.frames == 1
    (tmp_path / "report.html").unlink()
    assert "<svg" not in found._repr_html_() and found.verdict in found._repr_html_()


def test_an_exception_in_the_callback_ends_the_program(experiment: str, demo: str) -> None:
    class Enough(Exception):
        pass

    def refuse(_: gs.Progress) -> None:
        raise Enough

    with pytest.raises(Enough):
        gs.tune(experiment, demo, with_=EFFECTS, starts=1000, progress=refuse)


def test_threads(experiment: str, demo: str) -> None:
    errors: list[float] = []
    threads = [threading.Thread(target=lambda: errors.append(gs.replay(experiment, demo).error)) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(errors) == 3 and len(set(errors)) == 1


def test_export_tells_what_is_lost(experiment: str, demo: str, tmp_path: Path) -> None:
    values = {"coulomb_friction@arm.friction_n_m": 0.0006, "dead_zone@motor.half_width_v": 0.1}
    log = short_log(demo, "short")
    result = gs.replay(experiment, log, with_=["coulomb_friction@arm", "dead_zone@motor"], set=values)
    lost = result.export("mujoco_native", tmp_path / "native", timestep=0.001)
    assert [(e.name, e.form) for e in lost.effects] == [("coulomb_friction", "exact"), ("dead_zone", "host")]
    assert lost.time_step_s == 0.001
    assert lost.held_out_error.exported == pytest.approx(lost.held_out_error.model, rel=0.01)
    assert "gapscope." not in Path(lost.model).read_text()
    holds(lost, json.loads((tmp_path / "native" / "fidelity.json").read_text()))
    mujoco = pytest.importorskip("mujoco")
    assert mujoco.MjModel.from_xml_path(lost.model).opt.timestep == 0.001
    with pytest.raises(gs.InputError, match="--to"):
        result.export("mjy", tmp_path / "other")
    plain, _ = result.model.mujoco(native=True)
    assert plain.nplugin == 0 and plain.dof_frictionloss[0] == pytest.approx(0.0006, rel=1e-4)


def test_an_older_mujoco_without_an_element_of_the_native_form(
    experiment: str, demo: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As 3.11 says it of `<dcmotor input="none">`."""
    mujoco = pytest.importorskip("mujoco")
    model = gs.replay(experiment, demo).model

    def refuse(_: str) -> None:
        raise ValueError("XML Error: invalid keyword: 'none'\nElement 'general', line 76\n")

    monkeypatch.setattr(mujoco, "MjModel", SimpleNamespace(from_xml_path=refuse))
    monkeypatch.setattr(mujoco, "mj_versionString", lambda: "3.11.0")
    with pytest.raises(gs.InputError) as raised:
        model.mujoco(native=True)
    error = raised.value
    assert "native=True" in error.where and "4.0.0 or newer" in error.allowed and error.what and error.cure
    assert error.actual == "mujoco 3.11.0, XML Error: invalid keyword: 'none' Element 'general', line 76"
    monkeypatch.setattr(mujoco, "mj_versionString", lambda: "4.0.1")  # what it lacks there is our mistake
    with pytest.raises(ValueError, match="XML Error") as told:
        model.mujoco(native=True)
    assert not isinstance(told.value, gs.InputError)


def test_what_the_host_sends_goes_beside_an_actuator_with_a_state(
    experiment: str, demo: str, tmp_path: Path
) -> None:
    values = {"dead_zone@motor.half_width_v": 0.3, "actuator_lag@motor.time_constant_s": 0.01}
    log = short_log(demo, "short")
    result = gs.replay(experiment, log, with_=["dead_zone@motor", "actuator_lag@motor"], set=values)
    lost = result.export("mujoco_native", tmp_path / "native")
    assert [(e.name, e.form) for e in lost.effects] == [("dead_zone", "host"), ("actuator_lag", "approximated")]
    assert lost.unmeasured == "" and lost.held_out_error.exported == pytest.approx(lost.held_out_error.model, rel=0.1)


def test_a_tune_is_drawn_from(tuned: gs.Tune, tmp_path: Path) -> None:
    """What stock MuJoCo makes of a draw is the draw: the arrays are named and shaped as its own."""
    out = Path(tuned.export("mujoco_native", tmp_path / "native", draws=20, seed=4).model).parent
    told = json.loads((out / "randomization.json").read_text())
    drawn = np.load(out / "randomization.npz")
    varied = [parameter["name"] for parameter in told["parameters"]]
    assert varied == [parameter.name for parameter in tuned.parameters if parameter.name in varied]
    assert {"actuator_gainprm", "body_ipos", "dof_damping"} <= set(told["fields"])
    again = tuned.samples(20, seed=4)
    assert set(again) == set(drawn.files)
    np.testing.assert_array_equal(again["parameters"], drawn["parameters"])
    assert drawn["parameters"].shape == (20, len(told["parameters"]))
    assert {name: list(drawn[name].shape) for name in told["fields"]} == told["fields"]
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(out / "model.xml"))
    for name, shape in told["fields"].items():
        assert np.shape(getattr(model, name)) == tuple(shape[1:]), name
    for number in (number for parameter in told["parameters"] for number in parameter["numbers"]):
        row, column = number["index"]
        loaded = np.reshape(getattr(model, number["field"])[row], -1)[column]
        assert loaded == pytest.approx(number["value"], rel=1e-5)


def is_both(result: Any, kind: type) -> None:
    """A frozen dataclass, and the dict of the JSON that it was before it had fields."""
    assert type(result) is kind and issubclass(kind, dict)
    holds(result, result.json)
    assert result == result.json == dict(result) == json.loads(json.dumps(result)) and "versions" in result
    again = pickle.loads(pickle.dumps(result))
    assert again == result and again.json == dict(again) == result.json
    with pytest.raises(AttributeError):
        result.schema = ""


def test_identify(experiment: str, demo: str) -> None:
    pull = gs.identify("cable", experiment, demo)
    is_both(pull, gs.Identification)
    assert pull["schema"] == pull.schema == "gapscope.identify.cable/1"
    stiffness = pull.parameters["stiffness"]
    assert stiffness.value == pull["values"]["stiffness"]["value"] and stiffness.unit == "N m/rad"
    assert stiffness.low < 0.0012 < stiffness.high and math.isnan(pull.parameters["rest_spread"].low)
    assert pull["values"]["rest_spread"]["low"] is None and list(pull.values())[0] == pull.schema
    assert np.shape(pull.tables["repeats"].rows) == (4, len(pull.tables["repeats"].columns))
    with pytest.raises(gs.InputError, match="--signal"):
        gs.identify("cable", experiment, demo, options={"signal": "pendulum_rad"})


def test_design(experiment: str, tmp_path: Path) -> None:
    sweep = gs.design("sweep", experiment, out=tmp_path / "sweep.csv", options={"duration": 2})
    is_both(sweep, gs.InputDesign)
    assert (tmp_path / "sweep.csv").is_file() and sweep["schema"].startswith("gapscope.design")
    assert sweep.duration_s == 2 and all(limit.reached <= limit.limit for limit in sweep.limits)
    arm = {"parameter": "arm.damping", "duration": 1}
    best = gs.design("optimal", experiment, out=tmp_path / "best.csv", options=arm)
    is_both(best, gs.OptimalDesign)
    assert best.targets == ("arm.damping",) and best.inputs[0].score >= best.inputs[-1].score
    upright = {"at": "pendulum=3.141592653589793", "q": "10,10,1,10"}
    lqr = gs.design("lqr", experiment, options=upright)
    is_both(lqr, gs.FeedbackDesign)
    assert len(lqr.gain) == len(lqr["gain"]) == len(lqr.states) == 4
    assert max(real for real, _ in lqr.open_loop_poles) > 0 > max(real for real, _ in lqr.closed_loop_poles)
    poles = {"at": upright["at"], "poles": "-8,-9,-10,-11"}
    assert len(gs.design("poles", experiment, options=poles).gain) == 4


def test_what_design_makes_has_a_type() -> None:
    """Its words in the types are the command's; "chirp" is of no experiment, which every call here has."""
    promised = (ROOT / "tests" / "docs" / "promised_names.txt").read_text()
    words = set(re.findall(r"^command design ([a-z]+)$", promised, re.MULTILINE))
    assert {*get_args(Shape), *get_args(Feedback), "optimal", "chirp"} == words


def test_apply_and_explain(experiment: str, demo: str, short: str, tmp_path: Path) -> None:
    result = gs.replay(experiment, demo, with_="coulomb_friction@arm", set={"coulomb_friction@arm.friction_n_m": 6e-4})
    changed = result.apply(tmp_path / "robot.xml")
    is_both(changed, gs.Applied)
    assert changed.out == str(tmp_path / "robot.xml") and "frictionloss" in Path(changed.out).read_text()
    loss = next(change for change in changed.changes if change.attribute == "frictionloss")
    assert loss.before == "" and float(loss.after) == pytest.approx(6e-4, rel=1e-5)
    assert changed["changes"][0]["element"] == changed.changes[0].element and not changed.not_in_model
    found = gs.diagnose(experiment, short, effort="quick", options={"no-next-experiment": True})
    told = next(statement for statement in found.statements if "numbers" in statement.extra)
    why = found.explain(f"{told.name}@{told.on}" if told.on else told.name)
    is_both(why, gs.Explanation)
    assert (why.name, why.answer, why.probability) == (told.name, told.answer, told.probability)
    assert 1 / (1 + math.exp(-sum(term.adds for term in why.terms))) == pytest.approx(why.evidence)


def test_a_result_is_drawn(experiment: str, demo: str, tmp_path: Path) -> None:
    """Beside its logs, of files and of memory."""
    small: dict[str, object] = {"size": "320x240", "at": 0.5}
    result = gs.replay(experiment, [demo, short_log(demo, "monday")], out=tmp_path / "out")
    still = result.video(tmp_path / "still.png", log="monday", options=small)
    assert (still.path, still.frames, still.width, still.height) == (tmp_path / "still.png", 1, 320, 240)
    assert "data:image/png" in still._repr_html_()
    tuned = gs.tune(experiment, short_log(demo, "tuned"), freeze=FROZEN[1:], starts=1, budget_s=1)
    moving = tuned.video(compare=["nominal", result], options={"size": "320x240", "from": 0.5, "to": 0.7, "fps": 10})
    assert moving.path == tuned.out / "video.mp4" and moving.frames == 3
    del tuned
    assert moving.path.is_file()
    with pytest.raises(gs.InputError, match="gone.csv"):
        result.video(tmp_path / "none.png", log="gone.csv", options=small)


def test_the_model_steps_in_the_users_mujoco(experiment: str, demo: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    spring = {name: value for name, value in TRUTH.items() if name.startswith("cable_spring")}
    model, data = gs.replay(experiment, demo, with_=[EFFECTS[0], "dead_zone@motor"], set=spring).model.mujoco()
    assert model.nplugin > 0
    gs.load_plugins()
    while data.time < 0.5:
        mujoco.mj_step(model, data)
    assert float(data.joint("arm").qpos[0]) < -0.1  # on its way to where the cable rests
    assert gs.plugin_library().is_file()
