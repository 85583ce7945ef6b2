"""Of an exported folder: its module, the entity that mjlab builds of it, and that compiled as mjlab does."""

import sys
from typing import Any

import pretend


def build(folder: str) -> tuple[Any, Any, Any]:
    pretend.install()
    sys.path.insert(0, folder)
    import gapscope_mjlab as exported

    entity = exported.robot().build()
    model = entity.spec.compile()
    exported.SIMULATION.mujoco.apply(model)
    return exported, entity, model
