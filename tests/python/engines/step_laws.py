"""Run by the interpreter of scripts/engine_env torch: step_laws.py IN.npz OUT.npz.

gapscope.torch on the motions in IN.npz, arrays of (steps, envs, joints); parameters by name, of (joints,).
"""

import sys
from typing import Any

import numpy as np
import torch as pytorch
from gapscope import torch as laws

given = {name: pytorch.from_numpy(values) for name, values in np.load(sys.argv[1]).items()}


def of(prefix: str) -> dict[str, Any]:
    return {name.removeprefix(prefix): values for name, values in given.items() if name.startswith(prefix)}


def drive_of(parameters: dict[str, Any]) -> laws.Drive:
    """Of a name with a point the first word is the group."""
    grouped: dict[str, Any] = {}
    for name, value in parameters.items():
        group, _, key = name.rpartition(".")
        (grouped.setdefault(group, {}) if group else grouped)[key] = value
    return laws.Drive(**grouped)


step_s, out = float(given["step_s"]), {}
for kind, needed in (
    ("volts", {"gain", "kp", "kd"}),
    ("duty", {f"duty.{name}" for name in ("duty_gain", "supply_v", "kt", "ke", "resistance")}),
    ("drive", {"kp", "friction.slope_n_m_s_per_rad"}),  # the last one goes on below
):
    parameters = {"step_s": step_s, "max_delay_s": 0.05, **of(f"{kind}.")}
    motion = list(zip(*(given[f"{name} of {kind}"] for name in ("target", "angle", "speed")), strict=True))
    for left_out in ("", *of(f"{kind}.").keys() - needed):
        drive = drive_of({name: value for name, value in parameters.items() if name != left_out})
        out[f"{kind}.{left_out}"] = pytorch.stack([drive.step(*now) for now in motion]).numpy()
# From rest again, half of the environments alone.
drive = drive_of(parameters)
for now in motion[:7]:
    drive.step(*now)
drive.reset(pytorch.tensor([0]))
out["reset"] = pytorch.stack([drive.step(*now) for now in motion]).numpy()
# One joint with plain numbers, in single and in double precision.
numbers = {name: value if isinstance(value, float) else float(value[0]) for name, value in parameters.items()}
for kind in (pytorch.float64, pytorch.float32):
    drive = drive_of(numbers)
    torques = [drive.step(*(values[:, :1].to(kind) for values in now)) for now in motion]
    assert all(torque.dtype == kind for torque in torques)
    out[f"numbers.{str(kind)[-2:]}"] = pytorch.stack(torques).numpy()
# One joint whose second environment has a time constant and a spring of its own, beside drives with these alone.
springs_of = {"spring": {"stiffness": 3.0, "rest_rad": 0.1}, "stop": {"stiffness": 20.0, "stop_rad": 0.2}}
one_joint = [[values[..., :1] for values in now] for now in motion]
drive = drive_of({**numbers, **springs_of})
changed = {"time_constant_s": 0.03, "spring.stiffness": 5.0}
for name, value in changed.items():
    drive.vary(name, pytorch.tensor([value], dtype=pytorch.float64), [1], 2)
out["varied"] = pytorch.stack([drive.step(*now) for now in one_joint]).numpy()[..., 0]
for env, (stiffness, constant) in enumerate([(3.0, numbers["time_constant_s"]), (5.0, 0.03)]):
    drive = drive_of({**numbers, "time_constant_s": constant})
    torques = [drive.step(*(values[env : env + 1] for values in now)) for now in one_joint]
    for now, torque in zip(one_joint, torques, strict=True):
        angle = now[1][env : env + 1]
        torque += laws.spring_torque(angle, stiffness, 0.1) + laws.stop_torque(angle, **springs_of["stop"])
    out[f"alone.{env}"] = pytorch.stack(torques).numpy()[:, 0, 0]

hysteresis, state, springs = of("hysteresis."), pytorch.zeros_like(given["angle of drive"][0]), []
for k, angle in enumerate(given["angle of drive"]):
    if k:
        state = laws.bend(state, angle - given["angle of drive"][k - 1], hysteresis["rad"])
    torque = laws.spring_torque(angle, **of("spring.")) + laws.stop_torque(angle, **of("stop."))
    springs.append(torque - hysteresis["n_m"] * state)
out["spring"] = pytorch.stack(springs).numpy()
moved = {"load_n_m": given["load"], "free_speed": given["free_speed"]}
out["friction"] = laws.dry_level(given["speed of drive"], **moved, **of("friction.")).numpy()
volts = given["target of drive"]
out["winding"] = laws.winding(volts, given["speed of drive"], **of("winding.")).numpy()
speeds = pytorch.linspace(-12, 12, 97, dtype=pytorch.float64)[None]
out["table"] = laws.table_limit(speeds, given["speeds"], given["torques"]).numpy()
np.savez(sys.argv[2], **out)
