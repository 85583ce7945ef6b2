"""Replays a log with the stock `mujoco` package: PLUGIN_LIBRARY MODEL LOG MAX_STEP_S OUT [START].

LOG is a CSV file: time_s, then one column per actuator, named after it. OUT receives qpos and qvel at every stamp, as
raw doubles. START is a JSON file with the qpos and qvel to begin with; else they are the model's own. Written from the
description of the replay (docs/how-to/replay.md, mujoco.h), not from its code: a command is held from its stamp to the
next, and every interval is cut in the fewest equal steps that are at most MAX_STEP_S long.
"""

import csv
import json
import math
import sys

import mujoco
import numpy as np


def main() -> None:
    library, model_path, log_path, max_step_s, out_path, *start = sys.argv[1:]
    mujoco.mj_loadPluginLibrary(library)
    model = mujoco.MjModel.from_xml_path(model_path)
    bit = mujoco.mjtDisableBit
    model.opt.disableflags |= int(bit.mjDSBL_AUTORESET | bit.mjDSBL_SENSOR | bit.mjDSBL_ISLAND)
    # Dry friction written "as stiff as the step allows" (solreffriction="-1 ...") follows the step that is used.
    stiff = model.dof_solref[:, 0] == -1
    model.dof_solref[stiff, 1] = -0.9999 / float(max_step_s)
    data = mujoco.MjData(model)
    if start:
        with open(start[0]) as file:
            state = json.load(file)
        data.qpos[:], data.qvel[:] = state["qpos"], state["qvel"]
    with open(log_path, newline="") as file:
        rows = list(csv.reader(file))
    names, values = rows[0], np.array(rows[1:], dtype=float)
    time_s = values[:, 0] - values[0, 0]
    actuators = [model.actuator(name).id for name in names[1:]]
    states = []
    for k, now in enumerate(time_s):
        data.time = now
        states.append(np.concatenate([data.qpos, data.qvel]))
        if k + 1 == len(time_s):
            break
        data.ctrl[actuators] = values[k, 1:]
        interval = time_s[k + 1] - now
        steps = max(1, math.ceil(interval / float(max_step_s) - 1e-6))
        model.opt.timestep = interval / steps
        for _ in range(steps):
            mujoco.mj_step(model, data)
    np.array(states).tofile(out_path)


main()
