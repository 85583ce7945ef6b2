"""What is exported for Isaac Lab, read by Python; its configurations are stood in for by the names that they have.

Sources: isaac-sim/IsaacLab, source/isaaclab/isaaclab/actuators, actuator_base_cfg.py and actuator_pd_cfg.py; 2.3 as of
e579469, 3.0 as of develop in 2026. Its own packages need Isaac Sim.
"""

import runpy
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import gapscope as gs
import pytest
from conftest import ROOT, changed_joint

OF_JOINT = {"joint_names_expr", "stiffness", "damping", "armature", "friction", "dynamic_friction", "viscous_friction"}
LIMITS = {
    "isaaclab": {"actuator_effort_limit", "actuator_velocity_limit", "joint_effort_limit", "joint_velocity_limit"},
    "isaaclab23": {"effort_limit", "velocity_limit", "effort_limit_sim", "velocity_limit_sim"},
}
# Which of them limits what Isaac Lab computes, and which what the physics engine does.
EXPLICIT = {"isaaclab": "actuator_effort_limit", "isaaclab23": "effort_limit"}
IMPLICIT = {"isaaclab": "joint_effort_limit", "isaaclab23": "effort_limit_sim"}


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
    for module in (ModuleType("isaaclab"), actuators, sim):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return runpy.run_path(str(folder / "gapscope_isaaclab.py"))


@pytest.fixture
def joint(tmp_path: Path) -> tuple[str, str]:
    log = tmp_path / "log.csv"
    rows = [f"{0.002 * k:.3f},{0.3 * (k % 500 > 250)},{0.1 * (k % 500 > 260)}" for k in range(1000)]
    log.write_text("\n".join(["time_s,target_rad,position_rad", *rows]) + "\n")
    return str(ROOT / "models" / "joint" / "experiment.yaml"), str(log)


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


def test_a_spring_beside_a_drive_is_refused(joint: tuple[str, str], tmp_path: Path) -> None:
    result = gs.replay(changed_joint(tmp_path, 'damping="0.5"', 'damping="0.5" stiffness="1"'), joint[1])
    with pytest.raises(gs.InputError, match="spring"):
        result.export("isaaclab", tmp_path / "to")
    assert not (tmp_path / "to").exists()
