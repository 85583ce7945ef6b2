"""Of what Isaac Lab imports, what needs Isaac Sim or much else; its actuators need none of it."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any


def stand_in(name: str, **members: Any) -> None:
    sys.modules[name] = ModuleType(name)
    vars(sys.modules[name]).update(members)


def pretend_isaac_sim(folder: str) -> None:
    """So that `folder`/gapscope_isaaclab.py can be imported."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "mjlab"))
    import pretend

    sys.path.insert(0, folder)
    pretend.ABSENT = {"warp", "toml", "trimesh", "yaml", "omni", "pxr", "carb", "isaacsim", "prettytable"}
    pretend.install()
    if "Isaac Lab 2.3" in Path(folder, "gapscope_isaaclab.py").read_text():
        stand_in("isaaclab.sim", SimulationCfg=SimpleNamespace)
    stand_in("isaaclab.envs", mdp=SimpleNamespace(randomize_joint_parameters=None))
    entity = lambda name, joint_names=None: SimpleNamespace(name=name)  # noqa: E731
    stand_in("isaaclab.managers", EventTermCfg=SimpleNamespace, SceneEntityCfg=entity)
