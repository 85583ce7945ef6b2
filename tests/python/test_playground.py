"""The function that is written for Playground, with numpy in the place of JAX.

test_engines.py runs it with JAX and MJX themselves, where scripts/engine_env mjx made them.
"""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import gapscope as gs
import numpy as np
import pytest


class Model(SimpleNamespace):
    """As mjx.Model: a value, replaced by name, "opt.gravity" too."""

    def tree_replace(self, fields: dict[str, Any]) -> "Model":
        new = Model(**vars(self))
        for name, value in fields.items():
            first, _, rest = name.partition(".")
            setattr(new, first, getattr(new, first).tree_replace({rest: value}) if rest else value)
        return new


def nothing(model: Any) -> Any:
    if not isinstance(model, Model):
        return None
    return Model(**{name: nothing(value) for name, value in vars(model).items()})


@pytest.fixture
def jax(monkeypatch: pytest.MonkeyPatch) -> None:
    module, numpy = ModuleType("jax"), ModuleType("jax.numpy")
    numpy.asarray = np.asarray  # type: ignore[attr-defined]
    module.numpy = numpy  # type: ignore[attr-defined]
    module.vmap = lambda of: lambda keys: np.array([of(key) for key in keys])  # type: ignore[attr-defined]
    module.random = SimpleNamespace(randint=lambda key, shape, low, high: key % high)  # type: ignore[attr-defined]
    module.tree_util = SimpleNamespace(tree_map=lambda of, model: nothing(model))  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "jax", module)
    monkeypatch.setitem(sys.modules, "jax.numpy", numpy)


def test_each_key_draws_a_row(tuned: gs.Tune, tmp_path: Path, jax: None) -> None:
    lost = tuned.export("mjx", tmp_path / "to", draws=10, seed=4)
    assert [Path(path).name for path in lost.files] == ["gapscope_playground.py"]
    made = runpy.run_path(lost.files[0])
    drawn = np.load(tmp_path / "to" / "randomization.npz")
    gravity = Model(gravity=np.zeros(3))
    model = Model(opt=gravity, dof_damping=np.zeros(2), body_ipos=np.zeros((4, 3)), qpos0=np.zeros(2))
    batch, axes = made["domain_randomize"](model, [3, 14, 5])
    rows = [3, 4, 5]
    np.testing.assert_array_equal(batch.dof_damping, drawn["dof_damping"][rows])
    np.testing.assert_array_equal(batch.body_ipos, drawn["body_ipos"][rows])
    assert (axes.dof_damping, axes.body_ipos, axes.qpos0, axes.opt.gravity) == (0, 0, None, None)
    assert batch.qpos0 is model.qpos0 and not hasattr(batch, "actuator_gainprm")
