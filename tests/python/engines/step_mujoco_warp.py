"""Run by the interpreter of scripts/engine_env mujoco_warp: step_mujoco_warp.py MODEL.xml IN.npz OUT.npz.

As step_mjx.py. MuJoCo Warp computes in single precision; here on the processor.
"""

import sys

import mujoco
import mujoco_warp
import numpy as np
import warp

model_path, given_path, out = sys.argv[1:]
warp.config.quiet = True
given = np.load(given_path)
commands = given["commands"].astype(np.float32)
model = mujoco.MjModel.from_xml_path(model_path)
with warp.ScopedDevice("cpu"):
    there = mujoco_warp.put_model(model)
    data = mujoco_warp.make_data(model, nworld=len(commands))
    data.qpos.assign(given["qpos"].astype(np.float32))
    data.qvel.assign(given["qvel"].astype(np.float32))
    positions = np.empty((*commands.shape[:2], model.nq))
    for k in range(commands.shape[1]):
        positions[:, k] = data.qpos.numpy()
        data.ctrl.assign(commands[:, k])
        mujoco_warp.step(there, data)
np.savez(out, positions=positions, precision=str(data.qpos.numpy().dtype))
