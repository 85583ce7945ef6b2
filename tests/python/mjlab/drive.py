"""Run by mjlab's own interpreter: drive.py FOLDER COMMANDS.npy OUT.npz.

mjlab builds the exported entity; MuJoCo 3.11 steps it, each command as late as the configuration says. COMMANDS: of the
first drive, one a step.
"""

import sys
from pathlib import Path

from entity import build

folder, commands_path, out = sys.argv[1:4]
_, entity, model = build(folder)

import mujoco  # noqa: E402
import numpy as np  # noqa: E402

drive = entity.actuators[0]
commands, lag = np.load(commands_path), drive.cfg.delay_min_lag
assert lag == drive.cfg.delay_max_lag
data = mujoco.MjData(model)
angles = np.empty((len(commands), model.nq))
for k in range(len(commands)):
    angles[k] = data.qpos
    data.ctrl[drive._mjs_actuators[0].id] = commands[max(0, k - lag)]
    mujoco.mj_step(model, data)
np.savez(Path(out), angles=angles, lag=lag, fields=np.array([a.command_field for a in entity.actuators]))
