"""Run by the interpreter of scripts/engine_env mjx: draw_mjx.py FOLDER OUT.npz.

The exported function, called as Playground calls it (a key for each environment), on MJX's own model of the exported
MJCF; then one step of all environments. OUT.npz: what it replaced, the names that MJX maps over, the speeds after.
"""

import functools
import sys

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

folder, out = sys.argv[1:]
sys.path.insert(0, folder)

import gapscope_playground  # noqa: E402

model = mjx.put_model(mujoco.MjModel.from_xml_path(f"{folder}/model.xml"))
keys = jax.random.split(jax.random.PRNGKey(1), 6)
batch, axes = functools.partial(gapscope_playground.domain_randomize, rng=keys)(model)
names = ("actuator_biasprm", "actuator_gainprm", "body_inertia", "body_ipos", "dof_damping", "qpos0")
mapped = [name for name in names if getattr(axes, name) == 0]
data = mjx.make_data(model)
data = data.replace(ctrl=jnp.ones_like(data.ctrl))
speeds = jax.jit(jax.vmap(lambda of: mjx.step(of, data).qvel, in_axes=[axes]))(batch)
np.savez(out, mapped=mapped, speeds=speeds, **{name: getattr(batch, name) for name in mapped})
