#include "src/export/target.h"

namespace gapscope {
namespace {

// Sources: mujoco_playground _src/wrapper.py, which calls it with a key for each environment, and
// _src/locomotion/go1/randomize.py; mujoco-mjx 3.17 mjx/_src/dataclasses.py (tree_replace takes "opt.gravity").
constexpr char kPlayground[] = R"("""Domain randomisation for MJX and MuJoCo Playground, written by gapscope.

randomization_fn = functools.partial(gapscope_playground.domain_randomize, rng=keys)
"""

import operator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

HERE = Path(__file__).parent


def _has(model, name):
  try:
    return operator.attrgetter(name)(model) is not None
  except AttributeError:
    return False


def domain_randomize(model, rng):
  """For each key of `rng` a row of randomization.npz: what goes together stays together."""
  drawn = np.load(HERE / "randomization.npz")
  row = jax.vmap(lambda key: jax.random.randint(key, (), 0, len(drawn["parameters"])))(rng)
  fields = {name: jnp.asarray(drawn[name])[row] for name in drawn.files if _has(model, name)}
  in_axes = jax.tree_util.tree_map(lambda _: None, model)
  return model.tree_replace(fields), in_axes.tree_replace({name: 0 for name in fields})
)";

Result<std::vector<TargetFile>> WritePlayground(const TargetInput& input) {
  if (!input.randomization) return std::vector<TargetFile>();
  return std::vector<TargetFile>{{"gapscope_playground.py", kPlayground}};
}

}  // namespace

// Source: mujoco-mjx 3.17 _src/types.py (no DCMOTOR), passive.py and forward.py (delay and polynomials are stored and
// never read).
ExportTarget Target_mjx() {
  return {.name = "mjx",
          .what = "MJX 3.17 and Playground",
          .has = {.passive_motors = PassiveMotors::kNone, .delays = CommandDelays::kNone, .polynomials = false},
          .files = WritePlayground};
}

}  // namespace gapscope
