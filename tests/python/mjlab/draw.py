"""Run by mjlab's own interpreter: draw.py FOLDER OUT.json.

The events of the export, as mjlab would call them: `draw` on arrays of four environments, made of the model that mjlab
compiles; numpy stands in for torch.
"""

import inspect
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pretend

ENVIRONMENTS = 4


class Tensor(np.ndarray):
    """The part of torch.Tensor that the event uses."""

    def long(self) -> "Tensor":
        return self.astype(np.int64)


pretend.install()
torch = sys.modules["torch"] = pretend.Absent("torch")
torch.float32 = np.float32
torch.arange = lambda n, device: np.arange(n)
torch.as_tensor = lambda values, dtype=None, device="": np.asarray(values, dtype).view(Tensor)
folder, out = sys.argv[1:3]
sys.path.insert(0, folder)

import gapscope_mjlab as exported  # noqa: E402
import mujoco  # noqa: E402

entity = exported.robot("draws").build()
model = entity.spec.compile()
lags: dict[str, list[int]] = {}


def actuator(drive: Any) -> SimpleNamespace:
    def set_lags(values: Any, env_ids: Any) -> None:
        assert np.all((drive.cfg.delay_min_lag <= values) & (values <= drive.cfg.delay_max_lag))
        lags[drive.target_names[0]] = [int(v) for v in values]

    return SimpleNamespace(set_lags=set_lags)


def ids(names: Any, kind: str) -> list[int]:
    return [getattr(model, kind)(name).id for name in names]


joints = ids(entity.joint_names, "joint")
asset = SimpleNamespace(
    body_names=entity.body_names,
    joint_names=entity.joint_names,
    actuator_names=entity.actuator_names,
    tendon_names=entity.tendon_names,
    actuators=[actuator(drive) for drive in entity.actuators],
    indexing=SimpleNamespace(
        body_ids=ids(entity.body_names, "body"),
        ctrl_ids=ids(entity.actuator_names, "actuator"),
        tendon_ids=ids(entity.tendon_names, "tendon"),
        joint_ids=joints,
        joint_v_adr=model.jnt_dofadr[joints],
        joint_q_adr=model.jnt_qposadr[joints],
    ),
)
event = exported.draws()["gapscope"]
arrays = SimpleNamespace(
    **{name: np.repeat(np.asarray(getattr(model, name))[None], ENVIRONMENTS, 0) for name in event.func.model_fields}
)
env = SimpleNamespace(
    scene={"robot": asset}, num_envs=ENVIRONMENTS, device="cpu", sim=SimpleNamespace(model=arrays)
)
event.func(env, None, **event.params)

terms = {}
for name, term in exported.ranges().items():
    inspect.signature(term.func).bind(env, None, **term.params)
    (pattern, limits), *_ = term.params["ranges"].items()
    _, matched = entity.find_joints(pattern)
    terms[name] = [term.func.__name__, *matched, *limits]
once = [a.cfg for a in exported.robot("ranges").build().actuators]
Path(out).write_text(
    json.dumps(
        {
            "mode": event.mode,
            "fields": {name: np.asarray(array).tolist() for name, array in vars(arrays).items()},
            "names": {"joint": entity.joint_names, "body": entity.body_names},
            "dofs": [int(i) for i in asset.indexing.joint_v_adr],
            "bodies": asset.indexing.body_ids,
            "lags": lags,
            "terms": terms,
            "ranges": [[cfg.delay_min_lag, cfg.delay_max_lag] for cfg in once],
        }
    )
)
