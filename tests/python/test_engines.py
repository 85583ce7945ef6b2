"""What is exported for MJX, MuJoCo Warp and BAM, stepped by these engines themselves, on the processor.

Each needs its environment (scripts/engine_env NAME), which is too large to be made here; scripts/engines_check makes
all and runs this. The reference is stock MuJoCo on the written file, which tests/export/fidelity_test.cc holds against
our plugins; the reference of BAM is the result's model itself.
"""

import json
import math
import os
import subprocess
from pathlib import Path
from typing import Any

import gapscope as gs
import mujoco
import numpy as np
import pytest
from conftest import ROOT, interpreter

STEP_S, STEPS = 0.002, 500
# 0.5 to 1.7 Hz within the second.
TARGETS = 0.5 * np.sin(2 * np.pi * (0.5 + 0.6 * STEP_S * np.arange(STEPS)) * STEP_S * np.arange(STEPS))
Values = dict[str, dict[str, float]]
SPRING: Values = {"cable_spring@joint": {"stiffness_n_m_per_rad": 60, "rest_rad": 0.2}}
BIAS: Values = {"torque_bias@joint": {"torque_n_m": 8}}
FRICTION: Values = {"coulomb_friction@joint": {"friction_n_m": 4}}
HARD: Values = {"cable_spring@joint": {**SPRING["cable_spring@joint"], "stiffness_cubic_n_m_per_rad3": 300}}
HANG: Values = {"gravity_offset@joint": {"torque_n_m": 20, "rest_rad": 0.3}}
DRAG: Values = {"quadratic_drag@joint": {"drag_n_m_s2_per_rad2": 3}}
SOFT: Values = {"joint_compliance@joint": {"stiffness_n_m_per_rad": 300}}
LIMIT: Values = {"torque_limit@motor": {"limit_n_m": 5}}
STOP: Values = {"end_stop@joint": {"stiffness_n_m_per_rad": 400, "angle_rad": 0.2}}
GAP: Values = {"backlash@joint": {"gap_rad": 0.05}}


def run(engine: str, script: str, *arguments: str | Path) -> None:
    done = subprocess.run(
        [interpreter(engine), ROOT / "tests" / "python" / "engines" / script, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def hold(of: str, engine: str, found: float, allowed: float) -> None:
    """Fails where more than `allowed` was found; scripts/engines_check prints what was."""
    if table := os.environ.get("GAPSCOPE_ENGINES_TABLE"):
        with open(table, "a") as file:
            file.write(f"| {engine} | {of} | {found:.1e} | {allowed:.1e} |\n")
    assert found < allowed


def names_of(values: Values) -> str:
    return ", ".join(effect.split("@")[0] for effect in values)


def effects_of(values: Values) -> dict[str, Any]:
    flat = {f"{effect}.{key}": value for effect, keys in values.items() for key, value in keys.items()}
    return {"with_": list(values), "set": flat}


@pytest.fixture
def joint(tmp_path: Path) -> tuple[str, str]:
    log = tmp_path / "log.csv"
    rows = [f"{STEP_S * k:.3f},{target:.9f},0" for k, target in enumerate(TARGETS)]
    log.write_text("\n".join(["time_s,target_rad,position_rad", *rows]) + "\n")
    return str(ROOT / "models" / "joint" / "experiment.yaml"), str(log)


def written(joint: tuple[str, str], values: Values, target: str, to: Path) -> tuple[str, dict[str, str]]:
    """The exported MJCF, and the form of each effect."""
    lost = gs.replay(*joint, **effects_of(values)).export(target, to)
    return str(lost.model), {effect.name: effect.form for effect in lost.effects}


def driven(model: mujoco.MjModel, commands: np.ndarray) -> dict[str, np.ndarray]:
    """One row, from rest, its first control driven."""
    controls = np.zeros((1, len(commands), model.nu))
    controls[0, :, 0] = commands
    return {"qpos": model.qpos0[None], "qvel": np.zeros((1, model.nv)), "commands": controls}


def stock(model: mujoco.MjModel, given: dict[str, np.ndarray]) -> np.ndarray:
    positions = np.empty((*given["commands"].shape[:2], model.nq))
    for row, controls in enumerate(given["commands"]):
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = given["qpos"][row], given["qvel"][row]
        for k, control in enumerate(controls):
            positions[row, k] = data.qpos
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
    return positions


def stepped(engine: str, path: str, given: dict[str, np.ndarray], folder: Path, *precision: str) -> np.ndarray:
    np.savez(folder / "given.npz", **given)
    run(engine, f"step_{engine}.py", path, folder / "given.npz", folder / "stepped.npz", *precision)
    found = np.load(folder / "stepped.npz")
    assert found["precision"] == ("float64" if precision else "float32")
    return found["positions"]


def rms(of: np.ndarray) -> float:
    return float(np.sqrt(np.mean(of**2)))


def rounding(positions: np.ndarray) -> float:
    """How far single precision may go in a second, rad: each step rounds angle and speed by half of 1.2e-7 of them.

    All errors of one sign, none damped. What the solver leaves of a constraint comes on top; the rigs here have smooth
    ones, and stay far below.
    """
    speed = np.abs(np.gradient(positions, STEP_S, axis=1)).max()
    seconds = STEP_S * positions.shape[1]
    return float(positions.shape[1] * np.finfo(np.float32).eps / 2 * (np.abs(positions).max() + speed * seconds))


# Without each, the motion is off by more than ten times what is allowed.
@pytest.mark.parametrize(
    ("engine", "values", "allowed"),
    [
        ("mujoco_warp", HARD | HANG | BIAS | DRAG | FRICTION, None),
        ("mujoco_warp", SOFT | LIMIT, None),
        ("mujoco_warp", STOP, None),
        # Stiff ends of a gap amplify what is rounded: measured 4.4e-5, by MJX in single precision as well, whose law is
        # the same to 1e-16 in double. Without the gap it is 0.02 rad off.
        ("mujoco_warp", GAP, 1e-4),
        ("mjx", SPRING | BIAS | FRICTION, None),
        ("mjx", SOFT | LIMIT, None),
        ("mjx", STOP, None),
        ("mjx", GAP, None),
    ],
)
def test_native_laws_move_as_in_mujoco(
    engine: str, values: Values, allowed: float | None, joint: tuple[str, str], tmp_path: Path
) -> None:
    interpreter(engine)
    path, forms = written(joint, values, engine, tmp_path / "to")
    assert set(forms.values()) == {"exact"}
    model = mujoco.MjModel.from_xml_path(path)
    given = driven(model, TARGETS)
    expected = stock(model, given)
    # MJX is asked in double precision, where its laws show; MuJoCo's solver ends at 1e-8 of its cost.
    precision = ("64",) if engine == "mjx" else ()
    tolerance = allowed or (1e-8 if precision else rounding(expected))
    off = np.abs(stepped(engine, path, given, tmp_path, *precision) - expected).max()
    hold(f"{names_of(values)}: most, rad", " ".join([engine, *precision]), off, tolerance)
    for left_out in values:
        kept = {name: keys for name, keys in values.items() if name != left_out}
        other, _ = written(joint, kept, engine, tmp_path / "without")
        without = mujoco.MjModel.from_xml_path(other)
        assert rms(stock(without, driven(without, TARGETS))[..., -1] - expected[..., -1]) > 10 * tolerance, left_out


def test_what_mjx_ignores_it_ignores_without_a_word(joint: tuple[str, str], tmp_path: Path) -> None:
    """Why the export for it leaves these out: a stiffness's and a damping's polynomial, an actuator's delay."""
    interpreter("mjx")
    values = HARD | DRAG | {"command_delay@motor": {"delay_s": 0.02}}
    path, _ = written(joint, values, "mujoco_native", tmp_path / "to")
    model = mujoco.MjModel.from_xml_path(path)
    given = driven(model, TARGETS)
    whole = stock(model, given)
    expected_path, forms = written(joint, values, "mjx", tmp_path / "mjx")
    assert forms == {"cable_spring": "approximated", "quadratic_drag": "dropped", "command_delay": "host"}
    expected = stock(mujoco.MjModel.from_xml_path(expected_path), given)
    moved = stepped("mjx", path, given, tmp_path, "64")
    assert np.abs(moved - expected).max() < 1e-8 and rms(moved - whole) > 0.01
    motors, _ = written(joint, HANG, "mujoco_native", tmp_path / "motors")
    with pytest.raises(AssertionError, match="Error"):
        stepped("mjx", motors, given, tmp_path)


@pytest.mark.parametrize("engine", ["mujoco_warp", "mjx"])
def test_a_late_command_is_late_by_its_whole_steps(engine: str, joint: tuple[str, str], tmp_path: Path) -> None:
    """MuJoCo Warp's Runge-Kutta keeps the time of a step's begin in all stages; MuJoCo's last one reads a step early.

    So the actuator's own delay is exact there. For MJX the host sends later, which is exact too.
    """
    interpreter(engine)
    steps = 10
    values = SPRING | {"command_delay@motor": {"delay_s": steps * STEP_S}}
    path, forms = written(joint, values, engine, tmp_path / "to")
    assert forms["command_delay"] == ("host" if engine == "mjx" else "exact")
    late = np.concatenate([np.full(steps, TARGETS[0]), TARGETS[:-steps]])
    at_once, _ = written(joint, SPRING, engine, tmp_path / "at_once")
    reference = mujoco.MjModel.from_xml_path(at_once)
    expected = stock(reference, driven(reference, late))
    model = mujoco.MjModel.from_xml_path(path)
    sent = late if engine == "mjx" else TARGETS
    moved = stepped(engine, path, driven(model, sent), tmp_path)
    hold("a late command: most, rad", engine, np.abs(moved - expected).max(), rounding(expected))


@pytest.mark.parametrize("engine", ["mujoco_warp", "mjx"])
def test_the_promised_error_is_kept(engine: str, experiment: str, demo: str, tmp_path: Path) -> None:
    """In windows of the log, in single precision: what the engine adds to the promised error is a hundredth of it."""
    interpreter(engine)
    values: Values = {
        "coulomb_friction@arm": {"friction_n_m": 0.0006},
        "cable_spring@arm": {"stiffness_n_m_per_rad": 0.0012, "rest_rad": -0.4},
        "cogging@arm": {"amplitude_n_m": 0.0002},
    }
    lost = gs.replay(experiment, demo, **effects_of(values)).export(engine, tmp_path / "to")
    assert {effect.name: effect.form for effect in lost.effects}["cogging"] == (
        "dropped" if engine == "mjx" else "exact"
    )
    model = mujoco.MjModel.from_xml_path(str(lost.model))
    table = np.genfromtxt(demo, delimiter=",", names=True)
    measured = np.column_stack([table["arm_rad"], table["pendulum_rad"]])[: 10 * STEPS]
    given = {
        "qpos": measured[::STEPS],
        "qvel": np.gradient(measured, STEP_S, axis=0)[::STEPS],
        "commands": table["voltage_v"][: 10 * STEPS].reshape(10, STEPS, 1),
    }
    assert model.nu == 1
    expected = stock(model, given)
    added = (stepped(engine, str(lost.model), given, tmp_path) - expected) / measured.std(axis=0)
    promised = lost.held_out_error.exported
    hold(
        f"demo log, beside a held-out error of {promised:.4g}",
        engine,
        np.sqrt(np.mean(added**2, axis=(0, 1))).max(),
        0.01 * promised,
    )


def test_playground_draws_rows_for_mjx(tuned: gs.Tune, tmp_path: Path) -> None:
    interpreter("mjx")
    tuned.export("mjx", tmp_path / "to", draws=10, seed=4)
    run("mjx", "draw_mjx.py", tmp_path / "to", tmp_path / "drawn.npz")
    found, drawn = np.load(tmp_path / "drawn.npz"), np.load(tmp_path / "to" / "randomization.npz")
    mapped = list(found["mapped"])
    assert "dof_damping" in mapped and "qpos0" not in mapped
    chosen = [int(np.abs(drawn["dof_damping"] - row).sum(axis=1).argmin()) for row in found["dof_damping"]]
    assert len(set(chosen)) > 1
    for name in mapped:
        np.testing.assert_allclose(found[name], drawn[name][chosen], rtol=1e-6)
    assert len({tuple(speeds) for speeds in found["speeds"]}) == len(set(chosen))


HUMP: Values = {
    "stribeck_friction@joint": {"friction_n_m": 0.005, "breakaway_n_m": 0.025, "stribeck_speed_rad_per_s": 0.1}
}
LOAD: Values = {"load_friction@joint": {"coefficient": 0.15}}


@pytest.mark.parametrize(("name", "values"), [("m1", {}), ("m2", HUMP), ("m5", HUMP | LOAD)])
def test_bam_moves_its_bench_as_the_model(name: str, values: Values, tmp_path: Path) -> None:
    """BAM's simulator on the exported file beside our plugins on MuJoCo."""
    interpreter("bam")
    facts: dict[str, Any] = {"mass": 0.4, "length": 0.1, "kp": 200, "vin": 7.4}
    still = {"position": 0, "speed": 0, "load": 0, "input_volts": 7.4, "temp": 30, "torque_enable": True}
    entries = [{**still, "timestamp": 0.005 * k, "goal_position": 0.1 * math.sin(0.1 * k)} for k in range(400)]
    log = tmp_path / "log.json"
    log.write_text(json.dumps({**facts, "entries": entries}))
    known = {"motor.kt": 0.4, "motor.resistance": 5.0, "joint.friction": 0.01, "joint.damping": 0.02}
    bench = {"position.offset": 0.0, "pendulum.gravity": 9.80665}
    effects = effects_of(values)
    effects["set"] |= known | bench
    result = gs.replay(ROOT / "models" / "xl330" / "experiment.yaml", log, **effects)
    result.export("bam", tmp_path / "to")
    assert json.loads((tmp_path / "to" / "bam_motor.json").read_text())["model"] == name
    step_s = 5e-4
    times = step_s * np.arange(4000)
    targets = 0.8 * np.sin(2 * np.pi * (0.3 + 0.4 * times) * times)
    np.savez(
        tmp_path / "given.npz", mass=0.4, length=0.1, kp=200, volts=7.4, step_s=step_s, targets=targets
    )
    run("bam", "step_bam.py", tmp_path / "to" / "bam_motor.json", tmp_path / "given.npz", tmp_path / "out.npz")
    model, data = result.model.mujoco()
    model.opt.timestep = step_s
    expected = np.empty(len(times))
    for k, target in enumerate(targets):
        expected[k] = data.qpos[0]
        data.ctrl[:3] = target, 7.4, 1
        mujoco.mj_step(model, data)
    # BAM's rule for the angle is of first order: off by 1.4 mrad here, half of that at half the step.
    off = rms(np.load(tmp_path / "out.npz")["positions"] - expected)
    hold(f"{name} on BAM's bench: RMS, rad", "bam", off, 0.01 * float(np.std(expected)))
