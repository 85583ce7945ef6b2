"""Run by Isaac Lab's own interpreter, with PyTorch on its path: draw.py FOLDER SOURCE.py OUT.npz.

The events of DRAWS, as Isaac Lab's manager would call them: on its own actuators, and on an articulation that keeps
what is written to it. Of that, names and arguments must be those of the class in SOURCE, which needs Isaac Sim. OUT:
what each of four environments has; lags after a reset of all and after one of two of them alone.
"""

import ast
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from stand_in import pretend_isaac_sim

folder, source, out = sys.argv[1:4]
pretend_isaac_sim(folder)
import gapscope_isaaclab as exported  # noqa: E402
import torch  # noqa: E402

ENVIRONMENTS = 4
JOINTS, BODIES = ["arm", "pendulum"], ["base", "arm", "pendulum"]
MASSES, INERTIAS = torch.full((ENVIRONMENTS, 3), 0.024), torch.full((ENVIRONMENTS, 3, 9), 2e-5)
arguments = {
    f.name: {a.arg for a in [*f.args.args, *f.args.kwonlyargs]}
    for f in ast.walk(ast.parse(Path(source).read_text()))
    if isinstance(f, ast.FunctionDef)
}
written: dict[str, np.ndarray] = {}


class View:
    """What 2.3 writes masses by; the tensors that it gives are copies."""

    def get_masses(self) -> Any:
        return MASSES.clone()

    def get_inertias(self) -> Any:
        return INERTIAS.clone()

    def set_masses(self, values: Any, rows: Any) -> None:
        written["masses"] = values[rows].numpy()

    def set_inertias(self, values: Any, rows: Any) -> None:
        written["inertias"] = values[rows].numpy()


class Asset:
    joint_names, body_names, root_physx_view = JOINTS, BODIES, View()
    data = SimpleNamespace(body_mass=SimpleNamespace(torch=MASSES), body_inertia=SimpleNamespace(torch=INERTIAS))

    def __init__(self) -> None:
        self.actuators = {}
        for name, cfg in exported.DRAWN_ACTUATORS.items():
            made = dict(cfg=cfg, joint_names=[name], joint_ids=slice(None), num_envs=ENVIRONMENTS, device="cpu")
            self.actuators[name] = cfg.class_type(**made)

    def __getattr__(self, name: str) -> Any:
        def write(**given: Any) -> None:
            assert set(given) <= arguments[name], (name, given)
            assert torch.equal(given.pop("env_ids"), torch.arange(ENVIRONMENTS))
            (of,) = given.pop("joint_ids", None) or given.pop("body_ids")
            for key, values in given.items():
                assert values.shape[:2] == (ENVIRONMENTS, 1), key
                written[f"{key}.{of}"] = values[:, 0].numpy()

        return write


asset = Asset()
scene = type("Scene", (dict,), {"num_envs": ENVIRONMENTS})(robot=asset)
env = SimpleNamespace(scene=scene, device="cpu")
np.random.seed(5)
modes = {name: event.mode for name, event in exported.DRAWS.items()}
assert modes == {"draw": "startup", "late": "reset"}
exported.DRAWS["draw"].func(env, None, **exported.DRAWS["draw"].params)
motor = asset.actuators["motor"]
lags = []
for envs in (slice(None), [0, 2]):
    motor.reset(envs)
    ids = None if isinstance(envs, slice) else torch.tensor(envs)
    exported.DRAWS["late"].func(env, ids, **exported.DRAWS["late"].params)
    buffers = (motor.positions_delay_buffer, motor.velocities_delay_buffer, motor.efforts_delay_buffer)
    same = [buffer.time_lags.numpy().copy() for buffer in buffers]
    assert all(np.array_equal(same[0], other) for other in same)
    lags.append(same[0])
np.savez(out, lags=lags, rows=exported.ROWS["robot"], damping=motor.damping[:, 0].numpy(), **written)
