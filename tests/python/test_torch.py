"""gapscope.torch beside the plugins in MuJoCo: the same motion, step by step, in double precision."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import gapscope as gs
import mujoco
import numpy as np
import pytest
from conftest import ROOT, interpreter

STEP_S, STEPS, ENVS, JOINTS = 0.002, 500, 2, 3
Values = dict[str, list[float]]
DRIVE: Values = {
    "kp": [157, 90, 40],
    "kd": [7, 3, 1],
    "command_delay_s": [0.0213, 0.04, 0.0007],
    "torque_delay_s": [0.0043, 0.006, 0.0005],
    "command_asymmetry": [0.05, -0.1, 0.02],
    "second_time_constant_s": [0.003, 0.006, 0.0008],
    "time_constant_s": [0.004, 0.0005, 0.02],  # the second below one step
    "dead_zone": [0.5, 0.2, 0.1],
    "torque_limit_n_m": [30, 60, 12],
    "limit_softness": [0.2, 0.5, 0.1],
    "power_w": [90, 60, 25],
    "generating_power_w": [50, 40, 15],
    "peak_torque_n_m": [40, 25, 11],
    "rated_speed_rad_per_s": [1, 2, 1],
    "no_load_speed_rad_per_s": [9, 12, 6],
    "generating_factor": [0.5, 0.6, 0.7],
    "sag_fraction": [0.3, 0.5, 0.2],
    "sag_time_constant_s": [0.1, 0.05, 0.2],
    "droop_at_peak": [0.2, 0.1, 0.3],
    "droop_reference_n_m": [30, 40, 12],
    "droop_exponent": [1, 2, 1.5],
    "asymmetry": [0.1, -0.05, 0.2],
    "efficiency_drive": [0.9, 0.8, 0.95],
    "efficiency_backdrive": [1.1, 0.7, 1.05],
    "friction_slope_n_m_s_per_rad": [40, 20, 10],
    "friction_load_coefficient": [0.1, 0.2, 0.3],
    "friction_hump_n_m": [2, 1, 3],
    "friction_hump_speed_rad_per_s": [0.3, 0.5, 0.2],
}
# A drive in volts, by the plugin's keys of a native actuator's law.
VOLTS: Values = {
    "gain": [40, 25, 15],
    "bias0": [1, -0.5, 0.2],
    "bias2": [-4, -3, -1],
    "command_delay_s": [0.013, 0.002, 0.0311],
    "torque_delay_s": [0.002, 0.0051, 0],
    "dead_zone": [0.03, 0.05, 0.02],
    "command_asymmetry": [0.1, 0.02, -0.05],
    "time_constant_s": [0.01, 0.004, 0.0005],
    "second_time_constant_s": [0.005, 0.0007, 0.02],
}
# Those that gapscope.torch calls otherwise.
VOLTS_NAMES = {
    "bias0": "bias_n_m",
    "dead_zone": "command_dead_zone",
    "second_time_constant_s": "command_time_constant_s",
}
# A servo by its duty cycle, of which nothing but its supply limits the torque.
DUTY: Values = {
    "duty_gain": [2, 3, 1.5],
    "duty_damping": [0.05, 0.02, 0.1],
    "duty_limit": [0.9, 1, 0.8],
    "supply_v": [12, 7.4, 5],
    "kt": [2, 1.5, 4],
    "ke": [2.2, 1.5, 3],
    "resistance": [2, 1, 3],
    "gear": [1.5, -2, 1],
    "command_delay_s": [0.0113, 0.02, 0.0007],
    "torque_delay_s": [0.0043, 0.006, 0.0005],
    "command_asymmetry": [0.05, -0.1, 0.02],
    "time_constant_s": [0.004, 0.0005, 0.02],
    "second_time_constant_s": [0.003, 0.006, 0.0008],
    "dead_zone": [0.5, 0.2, 0.1],
    "sag_fraction": [0.3, 0.5, 0.2],
    "sag_time_constant_s": [0.1, 0.05, 0.2],
}
SPRING: Values = {
    "stiffness_n_m_per_rad": [20, 10, 4],
    "rest_rad": [0.1, -0.2, 0.3],
    "cubic_n_m_per_rad3": [30, 5, 2],
    "gravity_n_m": [2, 1, 3],
    "gravity_rest_rad": [0.3, 1, -0.4],
    "bias_n_m": [0.5, -0.2, 0.1],
    "cogging_n_m": [0.3, 0.2, 0.1],
    "cogging_periods_per_rev": [12, 7, 20],
    "cogging_phase_rad": [0.2, 1, 2],
    "cogging_second_n_m": [0.1, 0.05, 0.2],
    "cogging_second_phase_rad": [1, 0.3, 0],
    "stop_n_m_per_rad": [30, 20, 10],
    "stop_rad": [0.3, -0.2, 0.1],
    "hysteresis_n_m": [0.4, 0.3, 0.2],
    "hysteresis_rad": [0.05, 0.2, 0.01],
}
FRICTION: Values = {
    "friction_n_m": [0.3, 0.2, 0.1],
    "breakaway_n_m": [0.9, 0.5, 0.05],  # the last one below: no hump
    "stribeck_speed_rad_per_s": [0.3, 0.5, 0.2],
    "stribeck_exponent": [2, 1, 2],
    "load_coefficient": [0.05, 0.1, 0.02],
    "load_quadratic": [0.001, 0.002, 0.003],
    "friction_positive_n_m": [0.2, 0, 0.3],
    "friction_negative_n_m": [0.05, 0.3, 0.1],
}
# As gapscope.torch calls them.
NAMES = {
    "cogging_periods_per_rev": "cogging_periods",
    "stiffness_n_m_per_rad": "stiffness",
    "cubic_n_m_per_rad3": "cubic",
    "stribeck_speed_rad_per_s": "stribeck_speed",
    "friction_n_m": "coulomb_n_m",
    "friction_positive_n_m": "positive_n_m",
    "friction_negative_n_m": "negative_n_m",
    "stop_n_m_per_rad": "stiffness",
}
NEEDED_BY_DUTY = {"duty_gain", "supply_v", "kt", "ke", "resistance"}
SPEEDS, TORQUES = [1.0, 3.0, 8.0], [10.0, 7.0, 1.0]
WINDING = {"kt": 0.4, "ke": 0.3, "resistance": 5.0, "gear": 2.0}


def in_torch(name: str, others: dict[str, str] | None = None) -> str:
    """What `Drive` calls a parameter of the plugin: those of a group follow a point."""
    if name in DUTY and name not in DRIVE:
        return f"duty.{name}"
    return (others or {}).get(name, name.replace("friction_", "friction.", 1))


def extension(plugin: str, joint: int, values: Values, more: str = "") -> str:
    keys = "".join(f'<config key="{key}" value="{numbers[joint]}"/>' for key, numbers in values.items())
    name = plugin.rpartition(".")[2]
    return f'<plugin plugin="{plugin}"><instance name="{name}{joint}">{keys}{more}</instance></plugin>'


def rig(drive: Values, law: str) -> mujoco.MjModel:
    """Three joints that do not touch each other, each with a drive, a spring and friction, every stage in use."""
    gs.load_plugins()
    lags = sum(name in drive for name in ("time_constant_s", "second_time_constant_s", "sag_time_constant_s"))
    parts: dict[str, list[str]] = {"extension": [], "worldbody": [], "actuator": []}
    for k in range(JOINTS):
        parts["extension"].append(extension("gapscope.motor", k, drive, law + config_of({"max_delay_s": 0.05})))
        own = f'<config key="joint" value="j{k}"/>'
        parts["extension"].append(extension("gapscope.spring", k, SPRING, own))
        parts["extension"].append(extension("gapscope.friction", k, FRICTION, own))
        parts["worldbody"].append(
            f'<body><joint name="j{k}" axis="0 0 1" armature="0.16" frictionloss="1e-9"/>'
            '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-12 1e-12 1e-12"/>'
            f'<plugin plugin="gapscope.spring" instance="spring{k}"/>'
            f'<plugin plugin="gapscope.friction" instance="friction{k}"/></body>'
        )
        parts["actuator"].append(
            f'<plugin joint="j{k}" plugin="gapscope.motor" instance="motor{k}" actdim="{lags}"/>'
        )
    text = "".join(f"<{name}>{''.join(lines)}</{name}>" for name, lines in parts.items())
    return mujoco.MjModel.from_xml_string(f'<mujoco><option timestep="{STEP_S}"/>{text}</mujoco>')


def moved(drive: Values, law: str) -> dict[str, np.ndarray]:
    """What the plugins did: arrays of (steps, envs, joints)."""
    model = rig(drive, law)
    names = ("target", "angle", "speed", "force", "passive", "level", "free_speed")
    found = {name: np.empty((STEPS, ENVS, JOINTS)) for name in names}
    for env in range(ENVS):
        rng, data = np.random.default_rng(env), mujoco.MjData(model)
        data.qpos[:] = rng.normal(0, 0.2, JOINTS)
        for k in range(STEPS):
            if k % 40 == 0:
                held = rng.normal(0, 0.6, JOINTS)
            data.ctrl[:] = held + 0.05 * rng.normal(size=JOINTS)
            found["target"][k, env], found["angle"][k, env] = data.ctrl, data.qpos
            found["speed"][k, env] = data.qvel
            mujoco.mj_step(model, data)
            found["force"][k, env], found["passive"][k, env] = data.actuator_force, data.qfrc_passive
            found["free_speed"][k, env] = found["speed"][k, env] + STEP_S * data.qacc_smooth
            found["level"][k, env] = data.efc_frictionloss[data.ne : data.ne + data.nf]
    return found


def one_motor(config: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><extension><plugin plugin="gapscope.motor"><instance name="m">{config}</instance></plugin>'
        '</extension><worldbody><body><joint name="j" armature="1"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
        '</worldbody><actuator><plugin joint="j" plugin="gapscope.motor" instance="m"/></actuator></mujoco>'
    )
    return model, mujoco.MjData(model)


def config_of(values: dict[str, str | float]) -> str:
    return "".join(f'<config key="{key}" value="{value}"/>' for key, value in values.items())


def forces(config: str, commands: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    model, data = one_motor(config)
    found = np.empty(speeds.shape)
    for at in np.ndindex(speeds.shape):
        data.ctrl[0], data.qvel[0] = commands[at], speeds[at]
        mujoco.mj_forward(model, data)
        found[at] = data.actuator_force[0]
    return found


@pytest.fixture(scope="module")
def plugins() -> dict[str, np.ndarray]:
    return moved(DRIVE, config_of({"law": "position"}))


@pytest.fixture(scope="module")
def in_volts() -> dict[str, np.ndarray]:
    return moved(VOLTS, config_of({"law": "affine", "dead_zone_on": "command"}))


@pytest.fixture(scope="module")
def by_duty() -> dict[str, np.ndarray]:
    return moved(DUTY, config_of({"law": "duty"}))


@pytest.fixture(scope="module")
def laws(
    plugins: dict[str, np.ndarray],
    in_volts: dict[str, np.ndarray],
    by_duty: dict[str, np.ndarray],
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, np.ndarray]:
    python, folder = interpreter("torch"), tmp_path_factory.mktemp("laws")
    given: dict[str, object] = {"step_s": STEP_S, "speeds": SPEEDS, "torques": TORQUES, "load": plugins["force"]}
    given["free_speed"] = plugins["free_speed"]
    for prefix, motion in (("drive", plugins), ("volts", in_volts), ("duty", by_duty)):
        given |= {f"{name} of {prefix}": motion[name] for name in ("target", "angle", "speed")}
    given |= {f"drive.{in_torch(name)}": np.array(numbers, float) for name, numbers in DRIVE.items()}
    given |= {f"volts.{in_torch(name, VOLTS_NAMES)}": np.array(numbers) for name, numbers in VOLTS.items()}
    given |= {f"duty.{in_torch(name)}": np.array(numbers, float) for name, numbers in DUTY.items()}
    del given["volts.bias2"]  # it is -kd
    given |= {"volts.kp": np.zeros(JOINTS), "volts.kd": -np.array(VOLTS["bias2"])}
    for prefix, values in (("spring", SPRING), ("friction", FRICTION)):
        for name, numbers in values.items():
            whose, _, rest = name.partition("_")
            key = f"{prefix}.{NAMES.get(name, name)}"
            if whose in ("hysteresis", "stop"):
                key = f"{whose}.{NAMES.get(name, rest if whose == 'hysteresis' else name)}"
            given[key] = np.array(numbers, float)
    given |= {f"winding.{name}": np.array(value) for name, value in WINDING.items()}
    np.savez(folder / "given.npz", **given)
    script = ROOT / "tests" / "python" / "engines" / "step_laws.py"
    done = subprocess.run(
        [python, script, folder / "given.npz", folder / "out.npz"],
        capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(ROOT / "python")},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return dict(np.load(folder / "out.npz"))


DIGITS = 1e-11  # of torques of up to 40 N m
# The plugin's delays are by a clock that adds up steps; its rounding moves shares of a step: 5e-11 N m were measured.
ROUNDING = 1e-9


def test_a_drive_gives_the_plugins_torque(
    plugins: dict[str, np.ndarray],
    in_volts: dict[str, np.ndarray],
    by_duty: dict[str, np.ndarray],
    laws: dict[str, np.ndarray],
) -> None:
    assert np.abs(plugins["force"]).max(axis=(0, 1)).min() > 5
    for prefix, moved_by, values, needed, others in (
        ("drive", plugins, DRIVE, {"kp", "friction_slope_n_m_s_per_rad"}, {}),
        ("volts", in_volts, VOLTS, {"gain", "bias2"}, VOLTS_NAMES),
        ("duty", by_duty, DUTY, NEEDED_BY_DUTY, {}),
    ):
        assert np.abs(laws[f"{prefix}."] - moved_by["force"]).max() < ROUNDING
        for name in values.keys() - needed:  # each stage counts: without it the torque is another
            off = np.abs(laws[f"{prefix}.{in_torch(name, others)}"] - moved_by["force"]).max()
            assert off > 1e6 * ROUNDING, (prefix, name, off)


def test_parameters_may_be_numbers(plugins: dict[str, np.ndarray], laws: dict[str, np.ndarray]) -> None:
    first = plugins["force"][..., :1]
    assert np.abs(laws["numbers.64"] - first).max() < ROUNDING
    assert np.abs(laws["numbers.32"] - first).max() < 2e-3  # measured: 1.3e-4


def test_environments_have_numbers_of_their_own(laws: dict[str, np.ndarray]) -> None:
    for env in range(ENVS):
        assert np.abs(laws["varied"][:, env] - laws[f"alone.{env}"]).max() < DIGITS
    assert np.abs(laws["varied"][:, 1] - laws["varied"][:, 0]).max() > 1


def test_environments_are_reset_alone(plugins: dict[str, np.ndarray], laws: dict[str, np.ndarray]) -> None:
    off = np.abs(laws["reset"] - plugins["force"]).max(axis=(0, 2))
    assert off[0] < ROUNDING and off[1] > 1e6 * ROUNDING


def test_springs_and_friction_give_the_plugins_torque(
    plugins: dict[str, np.ndarray], laws: dict[str, np.ndarray]
) -> None:
    assert np.abs(laws["spring"] - plugins["passive"]).max() < DIGITS
    assert np.abs(laws["friction"] - plugins["level"]).max() < DIGITS
    assert plugins["passive"].std() > 0.1 and plugins["level"].std() > 0.01


def test_winding_and_table_give_the_plugins_torque(
    plugins: dict[str, np.ndarray], laws: dict[str, np.ndarray]
) -> None:
    volts, speed = plugins["target"][::50], plugins["speed"][::50]
    drive = forces(config_of({"law": "voltage", **WINDING}), volts, speed)
    assert np.abs(laws["winding"][::50] - drive).max() < DIGITS and drive.std() > 0.01
    table = {"speed_table": " ".join(map(str, SPEEDS)), "torque_table": " ".join(map(str, TORQUES))}
    speeds = np.linspace(-12, 12, 97)[None]
    expected = forces(config_of({"law": "torque", **table}), 1000 * np.sign(speeds), speeds)
    moving = speeds != 0  # at rest nothing is asked for here
    assert np.abs(laws["table"] - np.abs(expected))[moving].max() < DIGITS


def test_the_package_does_not_import_torch() -> None:
    code = "import sys, gapscope; sys.exit('torch' in sys.modules or 'gapscope.torch' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], cwd=Path(gs.__file__).parents[1], check=True)
