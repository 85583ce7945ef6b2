"""Run by the interpreter of scripts/engine_env bam: step_bam.py bam_motor.json IN.npz OUT.npz.

BAM loads the file and its own simulator steps its own pendulum of `mass` and `length` with `kp` and `volts`, from rest
and hanging, a step of `step_s` for each of the `targets`.
"""

import sys

import numpy as np
from bam.model import load_model
from bam.simulate import Simulator

parameters, given_path, out = sys.argv[1:]
given = np.load(given_path)
model = load_model(parameters)
log = {name: float(given[name]) for name in ("mass", "length", "kp")}
model.actuator.load_log({**log, "arm_mass": 0.0, "vin": float(given["volts"]), "dt": float(given["step_s"])})
simulator = Simulator(model)
positions = np.empty(len(given["targets"]))
for k, target in enumerate(given["targets"]):
    positions[k] = simulator.q
    control = model.actuator.compute_control(target, simulator.q, simulator.dq, float(given["step_s"]))
    simulator.step(control, True, float(given["step_s"]))
np.savez(out, positions=positions)
