"""Run by mjlab's own interpreter, with PyTorch on its path: law.py FOLDER COMMANDS.npy OUT.npz.

mjlab's own classes drive the exported entity in MuJoCo 3.11, where a law in PyTorch makes the torque. COMMANDS: one a
step. Twice, with a reset between. Where the export draws, three environments have each what the event gives them. OUT:
`angles`, of (runs, steps, environments), and what was drawn, by argument.
"""

import sys
from types import SimpleNamespace

import pretend
from entity import build

pretend.ABSENT.discard("torch")
folder, commands_path, out = sys.argv[1:4]
exported, entity, model = build(folder)

import mujoco  # noqa: E402
import numpy as np  # noqa: E402
import torch  # noqa: E402
from mjlab.actuator.actuator import ActuatorCmd  # noqa: E402

envs = 3 if hasattr(exported, "draws") else 1
law = entity.actuators[0]
law.entity = SimpleNamespace(indexing=SimpleNamespace(ctrl_ids=torch.arange(model.nu)))
law.initialize(model, None, SimpleNamespace(nworld=envs), "cpu")
if envs > 1:
    np.random.seed(2)
    event = exported.draws()["gapscope"]
    robot = SimpleNamespace(actuators=entity.actuators)
    env = SimpleNamespace(scene={"robot": robot}, num_envs=envs, device="cpu", sim=SimpleNamespace(model=None))
    event.func(env, None, **event.params)
commands = np.load(commands_path)
angles = np.empty((2, len(commands), envs))
for run in range(2):
    worlds = [mujoco.MjData(model) for _ in range(envs)]
    law.reset(None if run == 0 else torch.arange(envs))
    for k, sent in enumerate(commands):
        angles[run, k] = [data.qpos[0] for data in worlds]
        now = [[(float(sent), data.qpos[0], data.qvel[0])] for data in worlds]
        position, angle, speed = torch.tensor(now, dtype=torch.float64).unbind(-1)
        nothing = torch.zeros_like(angle)
        command = ActuatorCmd(position, nothing, nothing, angle, speed)
        torque = law.compute(law.apply_delay(command))
        for env_id, data in enumerate(worlds):
            data.ctrl[law.ctrl_ids[0]] = torque[env_id, 0].item()
            mujoco.mj_step(model, data)
drawn = {name: values for name, values in vars(law.drive).items() if isinstance(values, torch.Tensor)}
drawn = {name: values[:, 0].numpy() for name, values in drawn.items() if not name.startswith("_")}
np.savez(out, angles=angles, **drawn)
