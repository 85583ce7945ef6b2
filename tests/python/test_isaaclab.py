"""What is exported for Isaac Lab, read by Python; its configurations are stood in for by the names that they have.

Sources: the wheels isaaclab 2.3.2.post1 and 3.0.0, actuators/actuator_base_cfg.py, actuator_pd_cfg.py and
actuator_pd.py; sim/simulation_cfg.py; managers/manager_term_cfg.py, managers/scene_entity_cfg.py, and
randomize_joint_parameters of envs/mdp/events.py. Their simulations need Isaac Sim or a GPU; their actuators run where
`scripts/engine_env isaaclab` and `isaaclab23` were run.
"""

import json
import os
import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import gapscope as gs
import numpy as np
import pytest
from conftest import (
    ROOT, changed_joint, geared_joint, interpreter, knowing, packages, servo_log, stock_motion,
)  # fmt: skip

OF_JOINT = {"joint_names_expr", "stiffness", "damping", "armature", "friction", "dynamic_friction", "viscous_friction"}
LIMITS = {
    "isaaclab": {"actuator_effort_limit", "actuator_velocity_limit", "joint_effort_limit", "joint_velocity_limit"},
    "isaaclab23": {"effort_limit", "velocity_limit", "effort_limit_sim", "velocity_limit_sim"},
}
# Which of them limits what Isaac Lab computes, and which what the physics engine does.
EXPLICIT = {"isaaclab": "actuator_effort_limit", "isaaclab23": "effort_limit"}
IMPLICIT = {"isaaclab": "joint_effort_limit", "isaaclab23": "effort_limit_sim"}


# Of SimulationCfg, beside dt and gravity, what takes actuators in Python.
IN_PYTHON = {"isaaclab": {"use_newton_actuators": False}, "isaaclab23": {}}

# Of randomize_joint_parameters, what may be in EventTermCfg's params.
EVENT = {"func", "mode", "params"}
PARAMS = {"asset_cfg", "operation", "distribution", "drive", "argument", "limits"} | {
    f"{name}_distribution_params" for name in ("friction", "armature", "lower_limit", "upper_limit")
}


class Made(dict[str, Any]):
    __getattr__ = dict.__getitem__

    def replace(self, **members: Any) -> "Made":
        return Made(self, **members)


def configuration(kind: str, allowed: set[str]) -> Any:
    def make(**members: Any) -> Made:
        assert set(members) <= allowed, members
        return Made(kind=kind, **members)

    return make


def read(monkeypatch: pytest.MonkeyPatch, target: str, folder: Path) -> dict[str, Any]:
    actuators, sim = ModuleType("isaaclab.actuators"), ModuleType("isaaclab.sim")
    members = OF_JOINT | LIMITS[target]
    actuators.ImplicitActuatorCfg = configuration("implicit", members)  # type: ignore[attr-defined]
    actuators.DelayedPDActuatorCfg = configuration(  # type: ignore[attr-defined]
        "delayed", members | {"min_delay", "max_delay"}
    )
    actuators.IdealPDActuator = actuators.IdealPDActuatorCfg = object  # type: ignore[attr-defined]
    utils, laws, torch = ModuleType("isaaclab.utils"), ModuleType("gapscope_torch"), ModuleType("torch")
    utils.configclass = lambda made: configuration(  # type: ignore[attr-defined]
        "law", members | {name for name in vars(made) if not name.startswith("_")} | {"law", "command"}
    )
    laws.Drive = object  # type: ignore[attr-defined]
    sim.SimulationCfg = configuration(  # type: ignore[attr-defined]
        "simulation", {"dt", "gravity", *IN_PYTHON[target]}
    )
    envs, managers = ModuleType("isaaclab.envs"), ModuleType("isaaclab.managers")
    envs.mdp = SimpleNamespace(randomize_joint_parameters="randomize_joint_parameters")  # type: ignore[attr-defined]
    managers.EventTermCfg = configuration("event", EVENT)  # type: ignore[attr-defined]
    managers.SceneEntityCfg = lambda name, joint_names=None: (name, joint_names)  # type: ignore[attr-defined]
    for module in (ModuleType("isaaclab"), actuators, sim, envs, managers, utils, laws, torch):
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
        "backlash@joint.gap_rad": 0.02,
        **({"command_delay@motor.delay_s": 0.0052} if late else {}),
    }
    effects = sorted({name.rpartition(".")[0] for name in values})
    result = gs.replay(*joint, with_=effects, set=values)
    lost = result.export(target, tmp_path / "to", timestep=0.001)
    forms = {e.name: e.form for e in lost.effects}
    assert forms.pop("command_delay", "approximated") == "approximated"
    assert forms == {"coulomb_friction": "exact", "torque_limit": "exact", "backlash": "dropped"}
    assert not (tmp_path / "to" / "gapscope_torch.py").exists()
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
BEST = {FRICTION: 2.0, DAMPING: 0.5}


@pytest.mark.parametrize("target", list(LIMITS))
def test_events_draw_friction_by_factors(
    joint: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str
) -> None:
    freeze = ["motor.kp", "motor.kd", "joint.inertia"]
    fitted = gs.tune(*joint, with_="coulomb_friction@joint", freeze=freeze, starts=1, out=tmp_path / "fit")
    knowing(fitted, BEST, {FRICTION: 0.2}).export(target, tmp_path / "to", draws=3)
    made = read(monkeypatch, target, tmp_path / "to")
    (event,) = made["EVENTS"].values()
    assert (event["func"], event["mode"]) == ("randomize_joint_parameters", "startup")
    params = event["params"]
    assert set(params) <= PARAMS and params["asset_cfg"] == ("robot", ["joint"])
    assert (params["operation"], params["distribution"]) == ("scale", "uniform")
    assert params["friction_distribution_params"] == pytest.approx((1 - 0.196, 1 + 0.196), abs=1e-3)
    assert made["ACTUATORS"]["motor"]["friction"] == pytest.approx(2)
    # Damping of 0.5 is known to 5 %, which is less: one range for both.
    knowing(fitted, BEST, {FRICTION: 0.2, DAMPING: 0.025}).export(target, tmp_path / "to", draws=3)
    (event,) = read(monkeypatch, target, tmp_path / "to")["EVENTS"].values()
    assert event["params"]["friction_distribution_params"] == pytest.approx((1 - 0.098, 1 + 0.098), abs=1e-3)
    fitted.export(target, tmp_path / "to")
    assert "EVENTS" not in read(monkeypatch, target, tmp_path / "to")


# Each one a law of the drive that Isaac Lab has not.
LAWS = {
    "command_delay@motor.delay_s": 0.0071,
    "torque_delay@motor.delay_s": 0.0043,
    "torque_limit@motor.limit_n_m": 30,
    "torque_limit@motor.softness": 0.2,
    "actuator_lag@motor.time_constant_s": 0.004,
    "torque_speed_curve@motor.power_w": 25,
    "direction_asymmetry@motor.asymmetry": 0.2,
    "dead_zone@motor.half_width_n_m": 0.5,
    "torque_constant_droop@motor.loss_at_peak": 0.4,
    "cable_spring@joint.stiffness_n_m_per_rad": 20,
    "cable_spring@joint.stiffness_cubic_n_m_per_rad3": 60,
    "cable_spring@joint.rest_rad": 0.1,
    "gravity_offset@joint.torque_n_m": 4,
    "gravity_offset@joint.rest_rad": 0.3,
    "torque_bias@joint.torque_n_m": 2,
    "cogging@joint.amplitude_n_m": 1,
    "cogging@joint.phase_rad": 0.7,
}
VOLTS = {
    "command_delay@motor.delay_s": 0.0071,
    "dead_zone@motor.half_width_v": 0.5,
    "actuator_lag@motor.time_constant_s": 0.01,
    "torque_bias@arm.torque_n_m": 0.001,
    "end_stop@arm.stiffness_n_m_per_rad": 0.02,
    "end_stop@arm.angle_rad": 0.1,
}
STEP_S = 5e-4


def with_effects(experiment: str, log: gs.Log | str, values: dict[str, float]) -> gs.Replay:
    effects = list(dict.fromkeys(name.partition(".")[0] for name in values))
    return gs.replay(experiment, log, with_=effects, set=values)


@pytest.mark.parametrize("target", list(LIMITS))
def test_laws_of_a_drive_are_told_as_they_are(
    joint: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str
) -> None:
    sent, moved = np.loadtxt(joint[1], delimiter=",", skiprows=1), with_effects(*joint, LAWS).traces[0]
    log = {"time_s": sent[:, 0], "target_rad": sent[:, 1], "position_rad": moved["position_rad"].predicted}
    lost = with_effects(joint[0], gs.Log(log), LAWS).export(target, tmp_path / "to", timestep=STEP_S)
    assert {e.form for e in lost.effects} == {"exact"} and len(lost.effects) == 12
    errors = lost.held_out_error  # of the plugins, but for the integrator
    assert errors.model < 0.001 and errors.exported < 0.01 < 0.1 < errors.nominal
    own = Path(gs.__file__).with_name("torch.py").read_text()
    assert (tmp_path / "to" / "gapscope_torch.py").read_text().strip() == own.strip()
    made = read(monkeypatch, target, tmp_path / "to")
    assert made["SIMULATION"].items() >= IN_PYTHON[target].items()
    drive, law = made["ACTUATORS"]["motor"], made["LAWS"]["motor"]
    assert (drive["kind"], drive["command"], drive["law"]) == ("law", "joint_positions", law)
    assert law["spring"]["cogging_n_m"] == 1 and law["droop_at_peak"] == 0.4
    assert law["max_delay_s"] == pytest.approx(0.0114)


@pytest.mark.parametrize("target", list(LIMITS))
@pytest.mark.parametrize("rig", ["joint", "qube"])
def test_isaac_labs_own_actuator_moves_as_the_plugins(
    joint: tuple[str, str], demo: str, experiment: str, tmp_path: Path, target: str, rig: str
) -> None:
    """Step by step beside the plugins in stock MuJoCo, by the same integrator; both environments, reset alone."""
    values = LAWS if rig == "joint" else VOLTS
    run = joint if rig == "joint" else (experiment, demo)
    with_effects(*run, values).export(target, tmp_path / "to", timestep=STEP_S)
    times = STEP_S * np.arange(1500)
    commands = (0.5 if rig == "joint" else 5) * np.stack([np.sin(9 * times), np.cos(20 * times)], axis=1)
    beside = 3 * np.stack([np.cos(15 * times), np.sin(4 * times)], axis=1) * (rig == "joint")
    angles = drive(target, tmp_path, commands, beside)["angles"]
    assert np.array_equal(angles[0, :, 0], angles[1, :, 0])  # the other one went on
    for left_out in (None, *dict.fromkeys(name.partition(".")[0] for name in values)):
        kept = {name: value for name, value in values.items() if name.partition(".")[0] != left_out}
        model = Path(with_effects(*run, kept).export("mujoco", tmp_path / "own", timestep=STEP_S).model)
        for env in range(2):
            moved = stock_motion(model, commands[:, env], beside[:, env] if rig == "joint" else None)
            off = np.abs(moved - angles[0, :, env]).max()
            assert off < 1e-6 if left_out is None else off > 1e-4, (left_out, off)


# Of the drive, before its gear; the asymmetry lifts what its range of forces allows above that.
GEARED = {
    "torque_delay@motor.delay_s": 0.0043,
    "direction_asymmetry@motor.asymmetry": 0.4,
    "dead_zone@motor.half_width_n_m": 2,
    "cable_spring@joint.stiffness_n_m_per_rad": 20,
    "cable_spring@joint.rest_rad": 0.1,
}


@pytest.mark.parametrize("target", list(LIMITS))
def test_a_law_has_the_mjcfs_gear_and_ranges(tmp_path: Path, target: str) -> None:
    run = geared_joint(tmp_path), servo_log(tmp_path, 1000)
    lost = with_effects(*run, GEARED).export(target, tmp_path / "to", timestep=STEP_S)
    assert {e.form for e in lost.effects} == {"exact"}
    times = STEP_S * np.arange(1500)
    commands = 0.5 * np.stack([np.sign(np.sin(12 * times)), np.cos(20 * times)], axis=1)
    beside = 3 * np.stack([np.cos(15 * times), np.sin(4 * times)], axis=1)
    angles = drive(target, tmp_path, commands, beside)["angles"]
    model = Path(with_effects(*run, GEARED).export("mujoco", tmp_path / "own", timestep=STEP_S).model)
    text = model.read_text()
    for env in range(2):
        assert np.abs(stock_motion(model, commands[:, env], beside[:, env]) - angles[0, :, env]).max() < 1e-6
    for old, new in ((' gear="-3', ' gear="3'), ('ctrlrange="-0.3 0.2"', ""), ('forcerange="-14 14"', "")):
        assert old in text
        model.write_text(text.replace(old, new))
        assert np.abs(stock_motion(model, commands[:, 0], beside[:, 0]) - angles[0, :, 0]).max() > 1e-3


def test_a_servo_behind_a_gear(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = gs.replay(geared_joint(tmp_path), servo_log(tmp_path, 100))
    result.export("isaaclab", tmp_path / "to")
    drive = read(monkeypatch, "isaaclab", tmp_path / "to")["ACTUATORS"]["motor"]
    assert (drive["stiffness"], drive["damping"]) == pytest.approx((9 * 157.1451, 9 * 7.0729))
    assert drive["joint_effort_limit"] == 42
    text = (tmp_path / "to" / "gapscope_isaaclab.py").read_text()
    assert "position target: -0.333333 times the command; clip commands to -0.3 .. 0.2" in text


def drive(
    target: str, folder: Path, commands: np.ndarray, beside: np.ndarray, *events: str
) -> dict[str, np.ndarray]:
    np.savez(folder / "commands.npz", commands=commands, beside=beside)
    run_beside_torch(target, "law.py", folder / "to", folder / "commands.npz", folder / "out.npz", *events)
    return dict(np.load(folder / "out.npz"))


WIDTH, LAG = "dead_zone@motor.half_width_n_m", "actuator_lag@motor.time_constant_s"


@pytest.mark.parametrize(
    ("target", "events"), [("isaaclab", "EVENTS"), ("isaaclab23", "EVENTS"), ("isaaclab", "DRAWS")]
)
def test_each_environment_has_a_law_of_its_own(
    joint: tuple[str, str], tmp_path: Path, target: str, events: str
) -> None:
    freeze = ["motor.kp", "motor.kd", "joint.inertia", DAMPING]
    effects = [WIDTH.partition(".")[0], LAG.partition(".")[0]]
    fitted = gs.tune(*joint, with_=effects, freeze=freeze, starts=1, out=tmp_path / "fit")
    best = {WIDTH: 2.0, LAG: 0.02}
    knowing(fitted, best, {WIDTH: 0.5, LAG: 0.004}).export(target, tmp_path / "to", draws=3, timestep=STEP_S)
    commands = np.repeat(0.5 * np.sin(9 * STEP_S * np.arange(1500))[:, None], 3, axis=1)
    done = drive(target, tmp_path, commands, np.zeros_like(commands), events)
    if events == "DRAWS":
        told = json.loads((tmp_path / "to" / "randomization.json").read_text())["parameters"]
        rows = np.load(tmp_path / "to" / "randomization.npz")["parameters"]
        rows = rows[:, [[p["name"] for p in told].index(name) for name in (WIDTH, LAG)]].astype(np.float32)
        drawn = np.stack([done["dead_zone"], done["time_constant_s"]], axis=1)
        assert len(set(drawn[:, 0])) > 1 and all(np.isclose(rows, row, rtol=1e-6).all(axis=1).any() for row in drawn)
    else:
        for name, low, high in (("dead_zone", 1.02, 2.98), ("time_constant_s", 0.0122, 0.0279)):
            assert len(set(done[name])) == 3 and low < done[name].min() < done[name].max() < high
    for env in range(3):
        own = {WIDTH: float(done["dead_zone"][env]), LAG: float(done["time_constant_s"][env])}
        model = with_effects(*joint, own).export("mujoco", tmp_path / "own", timestep=STEP_S).model
        assert np.abs(stock_motion(Path(model), commands[:, env]) - done["angles"][0, :, env]).max() < 1e-6


KT, ARM_DAMPING, MASS = "motor.kt", "arm.damping", "pendulum.mass"
DELAY, LENGTH, ARM_FRICTION = "command_delay@motor.delay_s", "pendulum.length", "coulomb_friction@arm.friction_n_m"
QUBE = {KT: 0.042, ARM_DAMPING: 1.5e-4, MASS: 0.024, DELAY: 0.012, ARM_FRICTION: 5e-4}
# The class that its articulations share, or are.
ARTICULATION = {"isaaclab": "base_articulation.py", "isaaclab23": "articulation.py"}


@pytest.mark.parametrize("target", list(LIMITS))
def test_a_draw_is_one_row_of_all_that_varies(demo: str, experiment: str, tmp_path: Path, target: str) -> None:
    """By the equations of models/qube/README.md, not by what else the program wrote."""
    log = tmp_path / "log.csv"
    log.write_text("".join(Path(demo).read_text().splitlines(keepends=True)[:1001]))
    fitted = gs.tune(
        experiment, log, with_=["command_delay", "coulomb_friction@arm"], starts=1, out=tmp_path / "fit",
        freeze=["motor.resistance", "motor.km", "arm.mass", "pendulum.damping"],
    )  # fmt: skip
    known = knowing(fitted, QUBE, {name: 0.1 * value for name, value in QUBE.items()})
    to = Path(known.export(target, tmp_path / "to", draws=30, seed=4).model).parent
    (source,) = Path(interpreter(target)).parents[1].glob(f"source/**/isaaclab/assets/*/{ARTICULATION[target]}")
    run_beside_torch(target, "draw.py", to, source, tmp_path / "out.npz")
    done = dict(np.load(tmp_path / "out.npz"))
    names = [p["name"] for p in json.loads((to / "randomization.json").read_text())["parameters"]]
    rows = np.load(to / "randomization.npz")["parameters"][done["rows"]]
    own = {name: rows[:, names.index(name)] for name in QUBE}
    assert set(names) == set(QUBE) and len(set(own[KT])) > 1
    assert done["damping"] == pytest.approx(own[KT] * 0.042 / 8.4, rel=1e-5)
    assert done["joint_friction_coeff.0"] == pytest.approx(own[ARM_FRICTION], rel=1e-5)
    assert done["joint_dynamic_friction_coeff.0"] == pytest.approx(own[ARM_FRICTION], rel=1e-5)
    assert done["joint_viscous_friction_coeff.0"] == pytest.approx(own[ARM_DAMPING], rel=1e-5)
    masses, inertias = done.get("masses.2"), done.get("inertias.2")
    if target == "isaaclab23":
        masses, inertias = done["masses"][:, 2], done["inertias"][:, 2]
        assert np.all(done["masses"][:, :2] == np.float32(0.024))
        assert np.all(done["inertias"][:, :2] == np.float32(2e-5))
    assert masses == pytest.approx(own[MASS], rel=1e-5)
    assert inertias == pytest.approx(np.tile((2e-5 * own[MASS] / 0.024)[:, None], 9), rel=1e-5)
    assert done["lags"][0] == pytest.approx(np.round(own[DELAY] / 0.002))
    assert np.array_equal(done["lags"][0], done["lags"][1])
    text = (to / "gapscope_isaaclab.py").read_text()
    assert "As it is" not in text and 'efforts of "motor" are actuator_gainprm[row, 0, 0] times' in text
    # A length moves a centre of mass, which no event draws: the body stays as it is, and that is said.
    known = knowing(fitted, QUBE | {LENGTH: 0.129}, {MASS: 0.002, LENGTH: 0.002})
    text = (Path(known.export(target, tmp_path / "to", draws=3).model).parent / "gapscope_isaaclab.py").read_text()
    assert f"# - {MASS}: body_inertia, body_mass" in text and f"# - {LENGTH}: body_inertia, body_ipos" in text


def run_beside_torch(target: str, script: str, *arguments: Path | str) -> None:
    call = [interpreter(target), ROOT / "tests" / "python" / "isaaclab" / script, *arguments]
    environment = {**os.environ, "PYTHONPATH": str(packages("torch"))}
    done = subprocess.run(call, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr


def test_a_spring_beside_a_drive_is_refused(joint: tuple[str, str], tmp_path: Path) -> None:
    result = gs.replay(changed_joint(tmp_path, 'damping="0.5"', 'damping="0.5" stiffness="1"'), joint[1])
    with pytest.raises(gs.InputError, match="spring"):
        result.export("isaaclab", tmp_path / "to")
    assert not (tmp_path / "to").exists()
