"""What is exported for mjlab, built by mjlab's own wheel and stepped by the MuJoCo that it pins.

Torch, warp and the GPU are pretended (mjlab/pretend.py): mjlab's entities and configurations are its own code.
"""

import json
import math
import os
import subprocess
from pathlib import Path

import gapscope as gs
import numpy as np
import pytest
from conftest import ROOT, changed_joint, geared_joint, knowing, packages, servo_log, stock_motion
from scipy.integrate import solve_ivp

STEP_S = 2e-4
TORCH = Path(gs.__file__).with_name("torch.py")
# The servo's equation (models/joint/README.md), and what is added to it.
KP, KD, INERTIA, DAMPING = 157.1451, 7.0729, 0.159221308, 0.5
SPRING, REST, CUBIC, HANG, HANG_REST, BIAS, DRAG, DELAY = 60.0, 0.2, 300.0, 20.0, 0.3, 8.0, 3.0, 0.0213
EFFECTS = {
    "cable_spring@joint": {
        "stiffness_n_m_per_rad": SPRING,
        "rest_rad": REST,
        "stiffness_cubic_n_m_per_rad3": CUBIC,
    },
    "gravity_offset@joint": {"torque_n_m": HANG, "rest_rad": HANG_REST},
    "torque_bias@joint": {"torque_n_m": BIAS},
    "quadratic_drag@joint": {"drag_n_m_s2_per_rad2": DRAG},
    "command_delay@motor": {"delay_s": DELAY},
}


def target(t: float) -> float:
    return 0.5 * math.sin(2 * math.pi * (0.5 * t + 0.6 * t * t))


@pytest.fixture(scope="session")
def mjlab() -> Path:
    made = subprocess.run([ROOT / "scripts" / "engine_env", "mjlab"], capture_output=True, text=True, check=True)
    return Path(made.stdout.strip())


@pytest.fixture
def joint(tmp_path: Path) -> tuple[str, str]:
    log = tmp_path / "log.csv"
    rows = [f"{t:.4f},{target(t):.9f},0" for t in np.arange(0, 3, 0.002)]
    log.write_text("\n".join(["time_s,target_rad,position_rad", *rows]) + "\n")
    return str(ROOT / "models" / "joint" / "experiment.yaml"), str(log)


def run(mjlab: Path, script: str, *arguments: str | Path, beside: Path | None = None) -> None:
    call = [mjlab, ROOT / "tests" / "python" / "mjlab" / script, *arguments]
    environment = {**os.environ, **({"PYTHONPATH": str(beside)} if beside else {})}
    done = subprocess.run(call, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr


def motions(times: np.ndarray, lag_s: float, without: tuple[str, ...]) -> np.ndarray:
    """The equation itself, integrated by scipy: a row with all effects, then one without each of `without`."""
    names = np.array(["", *without])
    bias, spring, cubic, hang, drag = (
        np.where(names == name, 0.0, value)
        for name, value in [
            ("torque_bias", BIAS),
            ("cable_spring", SPRING),
            ("cable_spring", CUBIC),
            ("gravity_offset", HANG),
            ("quadratic_drag", DRAG),
        ]
    )

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        q, w = state.reshape(2, -1)
        sent = target(max(0.0, math.floor((t - lag_s) / STEP_S + 1e-6) * STEP_S))
        torque = KP * (sent - q) - (KD + DAMPING) * w + bias - spring * (q - REST) - cubic * (q - REST) ** 3
        torque -= hang * np.sin(q - HANG_REST) + drag * w * abs(w)
        return np.concatenate([w, torque / INERTIA])

    still = np.zeros(2 * len(names))
    # Within 3e-5 rad of what rtol=1e-7 gives, a tenth of what is judged; that takes 14 s on steps of the command.
    found = solve_ivp(rate, (0, times[-1]), still, t_eval=times, max_step=2e-3, rtol=1e-5, atol=1e-7)
    return found.y[: len(names)]


def test_what_mjlab_builds_moves_as_the_equation(joint: tuple[str, str], mjlab: Path, tmp_path: Path) -> None:
    values = {f"{effect}.{key}": value for effect, keys in EFFECTS.items() for key, value in keys.items()}
    result = gs.replay(*joint, with_=list(EFFECTS), set=values)
    lost = result.export("mjlab", tmp_path / "to", timestep=STEP_S)
    assert {e.name: e.form for e in lost.effects} == {
        "cable_spring": "exact",
        "gravity_offset": "exact",
        "torque_bias": "exact",
        "quadratic_drag": "exact",
        "command_delay": "approximated",
    }
    times = STEP_S * np.arange(15000)
    np.save(tmp_path / "commands.npy", [target(t) for t in times])
    run(mjlab, "drive.py", tmp_path / "to", tmp_path / "commands.npy", tmp_path / "moved.npz")
    moved = np.load(tmp_path / "moved.npz")
    assert moved["lag"] == round(DELAY / STEP_S) and list(moved["fields"]) == ["position"]
    effects = ("cable_spring", "gravity_offset", "torque_bias", "quadratic_drag")
    expected, *others = motions(times, int(moved["lag"]) * STEP_S, effects)
    off = np.sqrt(np.mean((moved["angles"][:, 0] - expected) ** 2))
    nothing_lost = 2e-3 * np.std(expected)
    assert off < nothing_lost
    for other in others:
        assert np.sqrt(np.mean((other - expected) ** 2)) > 10 * nothing_lost


# Each one a law of the drive that MuJoCo has not, and what it is without the effect.
LAWS = {
    "command_delay@motor.delay_s": 0.0071,
    "torque_delay@motor.delay_s": 0.0043,
    "torque_limit@motor.limit_n_m": 8,
    "torque_limit@motor.softness": 0.2,
    "actuator_lag@motor.time_constant_s": 0.004,
    "direction_asymmetry@motor.asymmetry": 0.2,
    "dead_zone@motor.half_width_n_m": 0.5,
    "torque_constant_droop@motor.loss_at_peak": 0.4,
}


def test_laws_that_mujoco_lacks_are_pytorchs(joint: tuple[str, str], mjlab: Path, tmp_path: Path) -> None:
    """Beside the plugins in stock MuJoCo, by the same integrator and step."""
    torch = packages("torch")
    effects = list(dict.fromkeys(name.partition(".")[0] for name in LAWS))
    sent, moved = np.loadtxt(joint[1], delimiter=",", skiprows=1), gs.replay(*joint, with_=effects, set=LAWS).traces[0]
    log = {"time_s": sent[:, 0], "target_rad": sent[:, 1], "position_rad": moved["position_rad"].predicted}
    result = gs.replay(joint[0], gs.Log(log), with_=effects, set=LAWS)
    lost = result.export("mjlab", tmp_path / "to", timestep=STEP_S)
    assert {e.form for e in lost.effects} == {"exact"} and len(lost.effects) == len(effects)
    assert (tmp_path / "to" / "gapscope_torch.py").read_text().strip() == TORCH.read_text().strip()
    errors = lost.held_out_error  # but for the integrator
    assert errors.model < 0.001 and errors.exported < 0.01 < 0.1 < errors.nominal
    times = STEP_S * np.arange(8000)
    np.save(tmp_path / "commands.npy", commands := np.array([target(t) for t in times]))
    run(mjlab, "law.py", tmp_path / "to", tmp_path / "commands.npy", tmp_path / "moved.npz", beside=torch)
    first, again = np.load(tmp_path / "moved.npz")["angles"][..., 0]
    assert np.array_equal(first, again)
    for left_out in (None, *effects):
        kept = [effect for effect in effects if effect != left_out]
        sizes = {name: value for name, value in LAWS.items() if name.partition(".")[0] != left_out}
        model = gs.replay(*joint, with_=kept, set=sizes).export("mujoco", tmp_path / "own", timestep=STEP_S).model
        off = np.abs(stock_motion(Path(model), commands) - first).max()
        assert off < 1e-6 if left_out is None else off > 1e-4, (left_out, off)


def test_a_law_takes_friction_that_the_solver_lacks(joint: tuple[str, str], mjlab: Path, tmp_path: Path) -> None:
    values = {
        "torque_delay@motor.delay_s": 0.0043,
        "load_friction@joint.coefficient": 0.2,
        "stribeck_friction@joint.friction_n_m": 2,
        "stribeck_friction@joint.breakaway_n_m": 6,
        "stribeck_friction@joint.stribeck_speed_rad_per_s": 0.5,
    }
    effects = list(dict.fromkeys(name.partition(".")[0] for name in values))
    lost = gs.replay(*joint, with_=effects, set=values).export("mjlab", tmp_path / "to", timestep=STEP_S)
    assert {e.name: e.form for e in lost.effects} == {
        "torque_delay": "exact",
        "load_friction": "approximated",
        "stribeck_friction": "approximated",
    }
    np.save(tmp_path / "commands.npy", commands := np.array([target(t) for t in STEP_S * np.arange(8000)]))
    run(mjlab, "law.py", tmp_path / "to", tmp_path / "commands.npy", tmp_path / "moved.npz", beside=packages("torch"))
    moved = np.load(tmp_path / "moved.npz")["angles"][0, :, 0]

    def off(law: str, without: tuple[str, ...]) -> float:
        left = {name: 0 if name in without else value for name, value in values.items()}
        result = gs.replay(*joint, with_=effects, set=left)
        model = Path(result.export("mujoco", tmp_path / law, timestep=STEP_S).model)
        return float(np.sqrt(np.mean((stock_motion(model, commands) - moved) ** 2)))

    of_all = off("own", ())
    for name in ("load_friction@joint.coefficient", "stribeck_friction@joint.breakaway_n_m"):
        assert off("less", (name,)) > 5 * of_all, name


def test_a_law_has_the_mjcfs_gear_and_ranges(mjlab: Path, tmp_path: Path) -> None:
    values = {"torque_delay@motor.delay_s": 0.0043, "direction_asymmetry@motor.asymmetry": 0.4}
    effects = [name.partition(".")[0] for name in values]
    result = gs.replay(geared_joint(tmp_path), servo_log(tmp_path, 1000), with_=effects, set=values)
    lost = result.export("mjlab", tmp_path / "to", timestep=STEP_S)
    assert {e.form for e in lost.effects} == {"exact"}
    np.save(tmp_path / "commands.npy", commands := 0.5 * np.sign(np.sin(12 * STEP_S * np.arange(4000))))
    run(mjlab, "law.py", tmp_path / "to", tmp_path / "commands.npy", tmp_path / "moved.npz", beside=packages("torch"))
    angles = np.load(tmp_path / "moved.npz")["angles"][0, :, 0]
    model = Path(result.export("mujoco", tmp_path / "own", timestep=STEP_S).model)
    assert np.abs(stock_motion(model, commands) - angles).max() < 1e-6
    for old, new in ((' gear="-3', ' gear="3'), ('ctrlrange="-0.3 0.2"', ""), ('forcerange="-14 14"', "")):
        assert old in (text := model.read_text())
        (changed := model.with_name("changed.xml")).write_text(text.replace(old, new))
        assert np.abs(stock_motion(changed, commands) - angles).max() > 1e-3


# Of a law's numbers, what varies: the plugin's own terms, a delay, and the gain that the law has of the servo.
BEST = {
    "dead_zone@motor.half_width_n_m": 2.0,
    "actuator_lag@motor.time_constant_s": 0.02,
    "command_delay@motor.delay_s": 0.01,
    "motor.kp": KP,
}
ARGUMENTS = ("dead_zone", "time_constant_s", "command_delay_s", "kp")


def test_each_environment_has_a_law_of_its_own(joint: tuple[str, str], mjlab: Path, tmp_path: Path) -> None:
    """A row of the draws each; it moves as the plugins do with that row."""
    effects = [name.partition(".")[0] for name in BEST if "@" in name]
    freeze = ["motor.kd", "joint.inertia", "joint.damping"]
    fitted = gs.tune(*joint, with_=effects, freeze=freeze, starts=1, out=tmp_path / "fit")
    known = knowing(fitted, BEST, {name: 0.1 * value for name, value in BEST.items()})
    to = Path(known.export("mjlab", tmp_path / "to", draws=30, seed=4, timestep=STEP_S).model).parent
    np.save(tmp_path / "commands.npy", commands := np.array([target(t) for t in STEP_S * np.arange(3000)]))
    run(mjlab, "law.py", to, tmp_path / "commands.npy", tmp_path / "moved.npz", beside=packages("torch"))
    moved = dict(np.load(tmp_path / "moved.npz"))
    drawn = np.load(to / "randomization.npz")["parameters"]
    names = [p["name"] for p in json.loads((to / "randomization.json").read_text())["parameters"]]
    assert set(names) == set(BEST)
    rows = drawn[:, [names.index(name) for name in BEST]]
    for env in range(3):
        own = np.array([moved[argument][env] for argument in ARGUMENTS])
        row = rows[np.argmin(np.abs(rows / own - 1).max(axis=1))]
        assert own == pytest.approx(row, rel=1e-5) and moved["gain"][env] == pytest.approx(own[-1])
        sizes = dict(zip(BEST, own.tolist(), strict=True))
        model = gs.replay(*joint, with_=effects, set=sizes).export("mujoco", tmp_path / "own", timestep=STEP_S).model
        assert np.abs(stock_motion(Path(model), commands) - moved["angles"][0, :, env]).max() < 1e-5
    assert len(set(moved["kp"])) == 3


def test_a_draw_is_one_row_of_all_that_varies(demo: str, experiment: str, mjlab: Path, tmp_path: Path) -> None:
    """By the equations of models/qube/README.md, not by what else the program wrote."""
    log = tmp_path / "log.csv"
    log.write_text("".join(Path(demo).read_text().splitlines(keepends=True)[:3501]))
    tuned = gs.tune(
        experiment, log, with_=["command_delay"], starts=1,
        freeze=["motor.resistance", "motor.km", "arm.mass", "pendulum.mass"],
    )  # fmt: skip
    to = Path(tuned.export("mjlab", tmp_path / "to", draws=30, seed=4).model).parent
    run(mjlab, "draw.py", to, tmp_path / "drawn.json")
    made = json.loads((tmp_path / "drawn.json").read_text())
    told = {p["name"]: p for p in json.loads((to / "randomization.json").read_text())["parameters"]}
    rows = [dict(zip(told, row, strict=True)) for row in np.load(to / "randomization.npz")["parameters"]]
    fields, fitted = made["fields"], {p.name: p.value for p in tuned.parameters}
    pendulum = made["names"]["joint"].index("pendulum")
    body = made["bodies"][made["names"]["body"].index("pendulum")]
    chosen = []
    for env in range(len(fields["actuator_gainprm"])):
        gain = fields["actuator_gainprm"][env][0][0]
        row = min(rows, key=lambda r: abs(r["motor.kt"] / 8.4 - gain))
        chosen.append(row["motor.kt"])
        assert gain == pytest.approx(row["motor.kt"] / 8.4, rel=1e-4)
        assert fields["actuator_biasprm"][env][0][2] == pytest.approx(-row["motor.kt"] * 0.042 / 8.4, rel=1e-4)
        damping = fields["dof_damping"][env][made["dofs"][pendulum]]
        assert damping == pytest.approx(row.get("pendulum.damping", fitted["pendulum.damping"]), rel=1e-4)
        assert fields["body_ipos"][env][body][2] == pytest.approx(-row["pendulum.length"] / 2, rel=1e-4)
        assert made["lags"]["arm"][env] == round(row["command_delay@motor.delay_s"] / 0.002)
    assert len(set(chosen)) > 1
    alone = {name for name, p in told.items() if not p["conditional"] and name.endswith(".damping")}
    assert alone and set(made["terms"]) == alone
    for name, (function, joint, low, high) in made["terms"].items():
        assert (function, f"{joint}.damping") == ("joint_damping", name)
        assert (low, high) == pytest.approx((told[name]["low"], told[name]["high"]))


def test_air_is_refused_before_anything_is_written(joint: tuple[str, str], tmp_path: Path) -> None:
    changed = changed_joint(tmp_path, 'timestep="0.002"', 'timestep="0.002" density="1.2"')
    result = gs.replay(changed, joint[1])
    with pytest.raises(gs.InputError, match="density"):
        result.export("mjlab", tmp_path / "to")
    assert not (tmp_path / "to").exists()
