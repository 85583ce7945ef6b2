"""How logs differ: fits to each log alone, and draws of that, on logs of twins whose damping is known."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest
from gapscope._program import home

from conftest import ROOT
from test_schemas import check

EXPERIMENT = str(ROOT / "models" / "joint" / "experiment.yaml")
TRUE = {"a": 1.0, "b": 2.0, "c": 2.5, "d": 3.0, "e": 4.0, "held": 2.5}  # N m s/rad
BOUND = 5.0
DAMPING = "joint.damping"


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A log of each of six joints that differ in damping alone."""
    folder = tmp_path_factory.mktemp("twins")
    for seed, (name, damping) in enumerate(TRUE.items()):
        words = f"--rig joint --nominal --seed {seed} --excitation multisine --duration 1.5 --rate 200"
        command = [str(home() / "bin" / "gapscope_twin"), *words.split(), "--set", f"{DAMPING}={damping}"]
        subprocess.run([*command, "--out", str(folder / name)], check=True, capture_output=True)
        shutil.move(folder / name / "log_0.csv", folder / f"{name}.csv")
    return {name: str(folder / f"{name}.csv") for name in TRUE}


def tune(logs: dict[str, str], names: str, out: Path, budget_s: float | None = None) -> gs.Tune:
    return gs.tune(
        EXPERIMENT,
        [logs[name] for name in names],
        hold_out=logs["held"],
        freeze=["motor.kp", "motor.kd", "joint.inertia"],
        starts=1,
        budget_s=budget_s,
        out=out,
        options={"each-log": True},
    )


def randomization(result: gs.Tune, out: Path) -> tuple[dict[str, Any], Any]:
    result.export("mujoco_native", out, draws=200)
    return json.loads((out / "randomization.json").read_text()), np.load(out / "randomization.npz")


@pytest.fixture(scope="module")
def fitted(logs: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> gs.Tune:
    return tune(logs, "abcde", tmp_path_factory.mktemp("fit"))


def test_each_log_has_its_own_value(fitted: gs.Tune, tmp_path: Path) -> None:
    assert [Path(fit.log).stem for fit in fitted.per_log] == list("abcde")
    for fit in fitted.per_log:
        assert fit[DAMPING].identifiable and fit[DAMPING].value == pytest.approx(TRUE[Path(fit.log).stem], rel=0.03)
    check(fitted.json, "tune")
    told, drawn = randomization(fitted, tmp_path / "to")
    check(told, "randomization")
    assert (told["from"], told["fitted_alone"], told["not_of_each"]) == ("logs", 5, [])
    # Its bounds are positive, so that its logarithm is what is normal.
    true = np.log([TRUE[name] for name in "abcde"])
    (of_damping,) = told["parameters"]
    assert of_damping["value"] == pytest.approx(np.exp(true.mean()), rel=0.03)
    assert of_damping["low"] == pytest.approx(np.exp(true.mean() - 1.96 * true.std(ddof=1)), rel=0.06)
    assert of_damping["high"] == BOUND
    below = np.log(drawn["parameters"][drawn["parameters"] < BOUND])
    assert drawn["parameters"].max() == BOUND and np.median(below) == pytest.approx(true.mean(), abs=0.1)
    assert np.array_equal(drawn["dof_damping"][:, 0], drawn["parameters"][:, 0])


def with_fits(fitted: gs.Tune, out: Path, values: list[float], deviation: float) -> gs.Tune:
    """The result as if each log's fit had said this, known so well (standard deviation of its logarithm)."""
    changed = fitted.json
    for fit, value in zip(changed["per_log"], values, strict=True):
        fit["parameters"][0]["value"] = value
        fit["spread"] = {"logarithmic": [True], "covariance": [[deviation**2]]}
    out.mkdir()
    (out / "result.json").write_text(json.dumps(changed))
    return dataclasses.replace(fitted, out=out)


def test_what_each_fit_leaves_open_is_no_difference(fitted: gs.Tune, tmp_path: Path) -> None:
    values = [2.0, 2.2, 2.5, 2.8, 3.1]
    logs = np.log(values)
    told, _ = randomization(with_fits(fitted, tmp_path / "known", values, 0.1), tmp_path / "a")
    (of_damping,) = told["parameters"]
    assert told["alike"] == []
    between = np.sqrt(logs.var(ddof=1) - 0.1**2)
    assert of_damping["low"] == pytest.approx(np.exp(logs.mean() - 1.96 * between), rel=1e-3)
    assert of_damping["high"] == pytest.approx(np.exp(logs.mean() + 1.96 * between), rel=1e-3)
    with pytest.raises(gs.InputError, match="differ no more than each leaves open"):
        randomization(with_fits(fitted, tmp_path / "open", values, 0.3), tmp_path / "b")


def test_the_user_chooses_what_the_draws_are_of(fitted: gs.Tune, tmp_path: Path) -> None:
    fits = np.array([fit[DAMPING].value for fit in fitted.per_log])
    drawn = fitted.samples(7, draws_from="fits")["parameters"][:, 0]
    assert drawn == pytest.approx(fits[[0, 1, 2, 3, 4, 0, 1]])
    fitted.export("mujoco_native", tmp_path / "to", draws=7, draws_from="fits")
    told = json.loads((tmp_path / "to" / "randomization.json").read_text())
    check(told, "randomization")
    assert (told["from"], told["fitted_alone"], told["alike"]) == ("fits", 5, [])
    assert told["parameters"][0]["value"] == pytest.approx(np.exp(np.log(fits).mean()))
    # Of the fit of all logs: far narrower than they differ, and with ends.
    best, deviation = fitted[DAMPING].value, np.sqrt(fitted.json["spread"]["covariance"][0][0])
    one = np.log(fitted.samples(400, draws_from="covariance")["parameters"][:, 0] / best) / deviation
    assert one.std() == pytest.approx(1, abs=0.15) and np.abs(one).max() > 2.3
    ends = np.log(fitted.samples(400, draws_from="interval")["parameters"][:, 0] / best) / deviation
    assert ends.std() == pytest.approx(1.96 / np.sqrt(3), abs=0.1) and 1.9 < np.abs(ends).max() <= 1.96
    assert np.array_equal(fitted.samples(9, draws_from="logs")["parameters"], fitted.samples(9)["parameters"])


@pytest.mark.parametrize(("wanted", "logs_there", "needed"), [("logs", 3, "4 logs"), ("fits", 1, "2 logs")])
def test_draws_that_the_result_has_not_are_refused(
    fitted: gs.Tune, tmp_path: Path, wanted: str, logs_there: int, needed: str
) -> None:
    fewer = fitted.json
    fewer["per_log"] = fewer["per_log"][:logs_there]
    (tmp_path / "result.json").write_text(json.dumps(fewer))
    with pytest.raises(gs.InputError, match=f"needs fits to each log alone(.|\n)*of {logs_there} logs(.|\n)*{needed}"):
        dataclasses.replace(fitted, out=tmp_path).samples(3, draws_from=wanted)
    with pytest.raises(gs.InputError, match="add --draws N"):
        fitted.export("mujoco_native", tmp_path / "to", draws_from=wanted)
    with pytest.raises(gs.InputError, match="covariance, interval, logs, fits"):
        fitted.samples(3, draws_from="log")
    assert not (tmp_path / "to").exists()


def test_few_logs_say_what_the_fit_leaves_open(fitted: gs.Tune, tmp_path: Path) -> None:
    three = fitted.json
    three["per_log"] = three["per_log"][:3]
    (tmp_path / "result.json").write_text(json.dumps(three))
    told, _ = randomization(dataclasses.replace(fitted, out=tmp_path), tmp_path / "to")
    assert (told["from"], told["fitted_alone"]) == ("covariance", 0)
    (of_damping,) = told["parameters"]
    assert of_damping["value"] == fitted[DAMPING].value
    assert of_damping["low"] == pytest.approx(fitted[DAMPING].low, rel=0.2)


def test_no_fit_that_was_cut_short_is_told(logs: dict[str, str], tmp_path: Path) -> None:
    fitted = tune(logs, "abcd", tmp_path / "fit", budget_s=0.001)
    assert fitted.per_log == () and any("time was up" in message for message in fitted.messages)


def test_one_log_differs_from_none(logs: dict[str, str], tmp_path: Path) -> None:
    with pytest.raises(gs.InputError, match="--each-log"):
        tune(logs, "a", tmp_path / "fit")
    assert not (tmp_path / "fit" / "result.json").exists()
