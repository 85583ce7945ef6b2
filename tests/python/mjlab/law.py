"""Run by mjlab's own interpreter, with PyTorch on its path: law.py FOLDER COMMANDS.npy OUT.npy.

mjlab's own classes drive the exported entity in MuJoCo 3.11, where a law in PyTorch makes the torque. COMMANDS: one a
step. Twice, with a reset between.
"""

import sys
from types import SimpleNamespace

import pretend
from entity import build

pretend.ABSENT.discard("torch")
folder, commands_path, out = sys.argv[1:4]
_, entity, model = build(folder)

import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import torch  # noqa: E402
from mjlab.actuator.actuator import ActuatorCmd  # noqa: E402

law = entity.actuators[0]
law.entity = SimpleNamespace(indexing=SimpleNamespace(ctrl_ids=torch.arange(model.nu)))
law.initialize(model, None, SimpleNamespace(nworld=1), "cpu")
commands = np.load(commands_path)
angles = np.empty((2, len(commands)))
for run in range(2):
    data = mujoco.MjData(model)
    law.reset(None if run == 0 else torch.tensor([0]))
    for k, sent in enumerate(commands):
        angles[run, k] = data.qpos[0]
        now = (float(sent), data.qpos[0], data.qvel[0])
        position, angle, speed = (torch.tensor([[x]], dtype=torch.float64) for x in now)
        nothing = torch.zeros_like(angle)
        command = ActuatorCmd(position, nothing, nothing, angle, speed)
        data.ctrl[law.ctrl_ids[0]] = law.compute(law.apply_delay(command))[0, 0].item()
        mujoco.mj_step(model, data)
np.save(out, angles)
