"""Run by Isaac Lab's own interpreter, with PyTorch on its path: law.py FOLDER COMMANDS.npz OUT.npz [EVENTS].

Isaac Lab's own actuator classes make the torque, as its articulation would call them; MuJoCo steps the first joint.
COMMANDS: `commands` and `beside`, the efforts beside them, of (steps, environments). Twice, with a reset of the first
environment alone between. OUT: `angles`, of (runs, steps, environments), and what the events drew, by argument.
"""

import sys
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import torch
from stand_in import pretend_isaac_sim

folder, given_path, out = sys.argv[1:4]
pretend_isaac_sim(folder)
import gapscope_isaaclab as exported  # noqa: E402
from isaaclab.actuators import IdealPDActuator  # noqa: E402
from isaaclab.utils.types import ArticulationActions  # noqa: E402

given = np.load(given_path)
steps, envs = given["commands"].shape
cfg = exported.ACTUATORS["motor"].copy()
law = cfg.class_type(cfg=cfg, joint_names=["joint"], joint_ids=slice(None), num_envs=envs, device="cpu")
assert isinstance(law, IdealPDActuator) and not law.is_implicit_model
robot = SimpleNamespace(actuators={"motor": law})
scene = type("Scene", (dict,), {"num_envs": envs})(robot=robot)
torch.manual_seed(3)
np.random.seed(3)
for event in getattr(exported, (*sys.argv[4:], "EVENTS")[0], {}).values():
    if event.func is not None:
        event.func(SimpleNamespace(scene=scene, device="cpu"), None, **event.params)
spec = mujoco.MjSpec.from_file(str(Path(folder) / "model.xml"))
for actuator in spec.actuators:  # efforts act on the joint there, as they are
    actuator.set_to_motor()
    actuator.gear[0] = 1
    actuator.ctrllimited = actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_FALSE
model = spec.compile()
assert model.opt.timestep == exported.SIMULATION.dt == cfg.step_s
angles = np.empty((2, steps, envs))
worlds = [mujoco.MjData(model) for _ in range(envs)]
for run in range(2):
    if run == 0:
        law.reset(slice(None))
    else:
        mujoco.mj_resetData(model, worlds[0])
        law.reset([0])
    for k in range(steps):
        motion = [torch.tensor([[getattr(d, of)[0]] for d in worlds]) for of in ("qpos", "qvel")]
        angles[run, k] = motion[0][:, 0]
        command, beside = (torch.from_numpy(given[name][k])[:, None] for name in ("commands", "beside"))
        targets = dict.fromkeys(("joint_positions", "joint_velocities"), torch.zeros_like(command))
        action = ArticulationActions(**{**targets, "joint_efforts": beside, cfg.command: command})
        action = law.compute(action, *motion)
        assert action.joint_positions is None and action.joint_velocities is None
        assert law.applied_effort.shape == law.computed_effort.shape == (envs, 1)
        for data, torque in zip(worlds, action.joint_efforts[:, 0], strict=True):
            data.ctrl[0] = torque.item()
            mujoco.mj_step(model, data)
drawn = {name: values for name, values in vars(law.drive).items() if isinstance(values, torch.Tensor) and values.dim()}
drawn = {name: values[:, 0].numpy() for name, values in drawn.items() if not name.startswith("_")}
np.savez(out, angles=angles, **drawn)
