"""What is exported for BAM: the members of its parameter files (Rhoban/bam at 1b5a1ce, bam/model.py and its params)."""

import json
import math
from pathlib import Path

import gapscope as gs
import pytest
from conftest import ROOT

FAMILY = {"kt", "R", "armature", "friction_base", "friction_viscous", "model", "actuator"}
STRIBECK = {"friction_stribeck", "dtheta_stribeck", "alpha"}
LOAD = {f"load_friction_{side}{hump}" for side in ("motor", "external") for hump in ("", "_stribeck")}
MEMBERS = {"m1": FAMILY, "m2": FAMILY | STRIBECK, "m5": FAMILY | STRIBECK | LOAD}


@pytest.fixture
def log(tmp_path: Path) -> str:
    entries = [
        {
            "position": 0.5 * math.sin(3 * 0.005 * k),
            "speed": 0,
            "load": 0,
            "input_volts": 7.4,
            "temp": 30,
            "timestamp": 0.005 * k,
            "goal_position": 0.5 * math.sin(3 * 0.005 * k + 0.1),
            "torque_enable": True,
        }
        for k in range(600)
    ]
    path = tmp_path / "log.json"
    path.write_text(json.dumps({"mass": 0.4, "length": 0.1, "kp": 200, "vin": 7.4, "entries": entries}))
    return str(path)


def rig(name: str) -> str:
    return str(ROOT / "models" / name / "experiment.yaml")


@pytest.mark.parametrize("model", list(MEMBERS))
def test_members_and_laws(model: str, log: str, tmp_path: Path) -> None:
    values = {"motor.kt": 0.4, "motor.resistance": 5.0, "joint.friction": 0.01, "joint.damping": 0.02}
    effects = ["cogging@joint"]
    if model != "m1":
        effects += ["stribeck_friction@joint"]
        of_hump = {"friction_n_m": 0.005, "breakaway_n_m": 0.025, "stribeck_speed_rad_per_s": 0.1}
        values |= {f"stribeck_friction@joint.{key}": value for key, value in of_hump.items()}
    if model == "m5":
        effects += ["load_friction@joint"]
        values["load_friction@joint.coefficient"] = 0.15
    lost = gs.replay(rig("xl330"), log, with_=effects, set=values).export("bam", tmp_path / "to")
    assert {e.name: e.form for e in lost.effects if e.form != "exact"} == {"cogging": "dropped"}
    assert sorted(path.name for path in (tmp_path / "to").iterdir()) == ["bam_motor.json", "fidelity.json"]
    written = json.loads((tmp_path / "to" / "bam_motor.json").read_text())
    assert set(written) == MEMBERS[model]
    assert (written["model"], written["actuator"]) == (model, "xl330")
    assert (written["kt"], written["R"], written["friction_viscous"]) == (0.4, 5.0, 0.02)
    if model == "m1":
        assert written["friction_base"] == 0.01
        return
    # m2 at rest and far above the hump: base + stribeck, and base.
    assert written["friction_base"] == pytest.approx(0.015)
    assert written["friction_base"] + written["friction_stribeck"] == pytest.approx(0.025)
    assert (written["dtheta_stribeck"], written["alpha"]) == (0.1, 2)
    if model == "m5":
        assert written["load_friction_motor"] == 0.15 and written["load_friction_external"] == 0


def test_a_published_servo_is_written_as_published(log: str, tmp_path: Path) -> None:
    """The rig's nominal values are BAM's own m1 of this servo (models/sts3032/README.md)."""
    gs.replay(rig("sts3032"), log).export("bam", tmp_path / "to")
    written = json.loads((tmp_path / "to" / "bam_motor.json").read_text())
    assert written.pop("error_gain_ratio") == pytest.approx(0.9)
    assert written == {
        "kt": 0.4934,
        "R": 4.092,
        "armature": 0.001013,
        "friction_base": 0.0054,
        "friction_viscous": 0.00159,
        "model": "m1",
        "actuator": "sts3215",
    }


def test_other_drives_are_refused(experiment: str, demo: str, log: str, tmp_path: Path) -> None:
    with pytest.raises(gs.InputError, match="duty"):
        gs.replay(experiment, demo).export("bam", tmp_path / "to")
    limited = gs.replay(rig("xl330"), log, set={"motor.duty_limit": 0.5})
    with pytest.raises(gs.InputError, match="no family"):
        limited.export("bam", tmp_path / "to")
    with pytest.raises(gs.InputError, match="--draws"):
        gs.replay(rig("xl330"), log).export("bam", tmp_path / "to", draws=3)
    assert not (tmp_path / "to").exists()
