"""Run by the interpreter of scripts/engine_env mjx: step_mjx.py MODEL.xml IN.npz OUT.npz [64].

MJX steps the model from each row of `qpos` and `qvel`, with the `commands` of (rows, steps, controls); `positions` of
OUT.npz are those before each step. With 64 it computes in double precision, which shows its laws; else as users do.
"""

import sys
from typing import Any

import jax
import mujoco
import numpy as np

model_path, given_path, out, *precision = sys.argv[1:]
if precision == ["64"]:
    jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
from mujoco import mjx  # noqa: E402

given = np.load(given_path)
model = mjx.put_model(mujoco.MjModel.from_xml_path(model_path))


def one(qpos: jax.Array, qvel: jax.Array, commands: jax.Array) -> jax.Array:
    def step(data: Any, command: jax.Array) -> tuple[Any, jax.Array]:
        after = mjx.step(model, data.replace(ctrl=command))
        # Of what it copies unchanged, MJX widens some integers in double precision.
        return jax.tree_util.tree_map(lambda new, old: new.astype(old.dtype), after, data), data.qpos

    return jax.lax.scan(step, mjx.make_data(model).replace(qpos=qpos, qvel=qvel), commands)[1]


positions = jax.jit(jax.vmap(one))(*(jnp.asarray(given[name]) for name in ("qpos", "qvel", "commands")))
np.savez(out, positions=positions, precision=str(positions.dtype))
