"""What is exported for Isaac Lab, read by Python; its configurations are stood in for by the names that they have.

Sources: isaac-sim/IsaacLab, source/isaaclab/isaaclab/actuators, actuator_base_cfg.py and actuator_pd_cfg.py;
managers/manager_term_cfg.py, managers/scene_entity_cfg.py, and randomize_joint_parameters of envs/mdp/events.py; 2.3 as
of e579469, 3.0 as of develop in 2026. Its own packages need Isaac Sim.
"""

import json
import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import gapscope as gs
import pytest
from conftest import ROOT, changed_joint, servo_log

OF_JOINT = {"joint_names_expr", "stiffness", "damping", "armature", "friction", "dynamic_friction", "viscous_friction"}
LIMITS = {
    "isaaclab": {"actuator_effort_limit", "actuator_velocity_limit", "joint_effort_limit", "joint_velocity_limit"},
    "isaaclab23": {"effort_limit", "velocity_limit", "effort_limit_sim", "velocity_limit_sim"},
}
# Which of them limits what Isaac Lab computes, and which what the physics engine does.
EXPLICIT = {"isaaclab": "actuator_effort_limit", "isaaclab23": "effort_limit"}
IMPLICIT = {"isaaclab": "joint_effort_limit", "isaaclab23": "effort_limit_sim"}


# Of randomize_joint_parameters, what may be in EventTermCfg's params.
EVENT = {"func", "mode", "params"}
PARAMS = {"asset_cfg", "operation", "distribution"} | {
    f"{name}_distribution_params" for name in ("friction", "armature", "lower_limit", "upper_limit")
}


def configuration(kind: str, allowed: set[str]) -> Any:
    def make(**members: Any) -> dict[str, Any]:
        assert set(members) <= allowed, members
        return {"kind": kind, **members}

    return make


def read(monkeypatch: pytest.MonkeyPatch, target: str, folder: Path) -> dict[str, Any]:
    actuators, sim = ModuleType("isaaclab.actuators"), ModuleType("isaaclab.sim")
    members = OF_JOINT | LIMITS[target]
    actuators.ImplicitActuatorCfg = configuration("implicit", members)  # type: ignore[attr-defined]
    actuators.DelayedPDActuatorCfg = configuration(  # type: ignore[attr-defined]
        "delayed", members | {"min_delay", "max_delay"}
    )
    sim.SimulationCfg = configuration("simulation", {"dt", "gravity"})  # type: ignore[attr-defined]
    envs, managers = ModuleType("isaaclab.envs"), ModuleType("isaaclab.managers")
    envs.mdp = SimpleNamespace(randomize_joint_parameters="randomize_joint_parameters")  # type: ignore[attr-defined]
    managers.EventTermCfg = configuration("event", EVENT)  # type: ignore[attr-defined]
    managers.SceneEntityCfg = lambda name, joint_names: (name, joint_names)  # type: ignore[attr-defined]
    for module in (ModuleType("isaaclab"), actuators, sim, envs, managers):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return runpy.run_path(str(folder / "gapscope_isaaclab.py"))


@pytest.fixture
def joint(tmp_path: Path) -> tuple[str, str]:
    return str(ROOT / "models" / "joint" / "experiment.yaml"), servo_log(tmp_path, 1000)


@pytest.mark.parametrize("target", list(LIMITS))
@pytest.mark.parametrize("late", [True, False])
def test_a_servo(
    joint: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str, late: bool
) -> None:
    values = {
        "coulomb_friction@joint.friction_n_m": 3.0,
        "torque_limit@motor.limit_n_m": 40.0,
        "gravity_offset@joint.torque_n_m": 5.0,
        "backlash@joint.gap_rad": 0.02,
        **({"command_delay@motor.delay_s": 0.0052} if late else {}),
    }
    effects = sorted({name.rpartition(".")[0] for name in values})
    result = gs.replay(*joint, with_=effects, set=values)
    lost = result.export(target, tmp_path / "to", timestep=0.001)
    forms = {e.name: e.form for e in lost.effects}
    assert forms.pop("command_delay", "approximated") == "approximated"
    assert forms == {
        "coulomb_friction": "exact",
        "torque_limit": "exact",
        "gravity_offset": "host",
        "backlash": "dropped",
    }
    made = read(monkeypatch, target, tmp_path / "to")
    assert made["SIMULATION"]["dt"] == 0.001 and made["SIMULATION"]["gravity"] == (0, 0, -9.81)
    drive = made["ACTUATORS"]["motor"]
    assert drive["kind"] == ("delayed" if late else "implicit") and drive["joint_names_expr"] == ["joint"]
    assert (drive["stiffness"], drive["damping"], drive["viscous_friction"]) == (157.1451, 7.0729, 0.5)
    assert drive["friction"] == drive["dynamic_friction"] == pytest.approx(3)
    assert drive[EXPLICIT[target] if late else IMPLICIT[target]] == 40
    assert not late or drive["min_delay"] == drive["max_delay"] == 5


def test_a_voltage_drive_and_a_joint_without_one(
    experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The back-EMF is damping: kt km / R (models/qube/README.md)."""
    spring = {"cable_spring@pendulum.stiffness_n_m_per_rad": 0.002, "cable_spring@pendulum.rest_rad": 0.3}
    result = gs.replay(experiment, demo, with_="cable_spring@pendulum", set=spring)
    (effect,) = result.export("isaaclab", tmp_path / "to").effects
    assert effect.form == "exact"
    made = read(monkeypatch, "isaaclab", tmp_path / "to")
    motor, pendulum = made["ACTUATORS"]["motor"], made["ACTUATORS"]["pendulum"]
    assert motor["stiffness"] == 0 and motor["damping"] == pytest.approx(0.042 * 0.042 / 8.4)
    assert pendulum["stiffness"] == 0.002 and pendulum["viscous_friction"] == 3e-5
    text = (tmp_path / "to" / "gapscope_isaaclab.py").read_text()
    assert "0.005 N m for each unit of the command" in text and "0.3 rad" in text


FRICTION, DAMPING = "coulomb_friction@joint.friction_n_m", "joint.damping"


def knowing(fitted: gs.Tune, deviations: dict[str, float]) -> gs.Tune:
    """As if the fit had ended at 2 N m and 0.5 N m s/rad, and known them so well."""
    result = fitted.json
    result["model"]["values"] |= {FRICTION: 2.0, DAMPING: 0.5}
    result["correlated"], result["spread"]["logarithmic"] = [], [False for _ in result["parameters"]]
    known = [deviations.get(p["name"], 0) for p in result["parameters"]]
    for p, deviation in zip(result["parameters"], known):
        p["identifiable"] = deviation > 0
    result["spread"]["covariance"] = [[a**2 * (i == j) for j in range(len(known))] for i, a in enumerate(known)]
    (fitted.out / "result.json").write_text(json.dumps(result))
    return fitted


@pytest.mark.parametrize("target", list(LIMITS))
def test_events_draw_friction_by_factors(
    joint: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str
) -> None:
    freeze = ["motor.kp", "motor.kd", "joint.inertia"]
    fitted = gs.tune(*joint, with_="coulomb_friction@joint", freeze=freeze, starts=1, out=tmp_path / "fit")
    knowing(fitted, {FRICTION: 0.2}).export(target, tmp_path / "to", draws=3)
    made = read(monkeypatch, target, tmp_path / "to")
    (event,) = made["EVENTS"].values()
    assert (event["func"], event["mode"]) == ("randomize_joint_parameters", "startup")
    params = event["params"]
    assert set(params) <= PARAMS and params["asset_cfg"] == ("robot", ["joint"])
    assert (params["operation"], params["distribution"]) == ("scale", "uniform")
    assert params["friction_distribution_params"] == pytest.approx((1 - 0.196, 1 + 0.196), abs=1e-3)
    assert made["ACTUATORS"]["motor"]["friction"] == pytest.approx(2)
    # Damping of 0.5 is known to 5 %, which is less: one range for both.
    knowing(fitted, {FRICTION: 0.2, DAMPING: 0.025}).export(target, tmp_path / "to", draws=3)
    (event,) = read(monkeypatch, target, tmp_path / "to")["EVENTS"].values()
    assert event["params"]["friction_distribution_params"] == pytest.approx((1 - 0.098, 1 + 0.098), abs=1e-3)
    fitted.export(target, tmp_path / "to")
    assert "EVENTS" not in read(monkeypatch, target, tmp_path / "to")


def test_a_spring_beside_a_drive_is_refused(joint: tuple[str, str], tmp_path: Path) -> None:
    result = gs.replay(changed_joint(tmp_path, 'damping="0.5"', 'damping="0.5" stiffness="1"'), joint[1])
    with pytest.raises(gs.InputError, match="spring"):
        result.export("isaaclab", tmp_path / "to")
    assert not (tmp_path / "to").exists()
