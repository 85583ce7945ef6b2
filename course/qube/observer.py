#!/usr/bin/env python3
"""Two observers for the balancing Qube: control/upright_kalman.yaml and control/upright_luenberger.yaml.

python3 observer.py     (in the folder of the handout; needs numpy and scipy)

x' = A x + B u about upright (models/qube/README.md), x: arm, pendulum - pi, and their speeds. An observer is
x^' = A x^ + B u + L (y - C x^). The Kalman filter reads both angles; Luenberger's reads the arm alone.
"""
import json
import subprocess

import numpy as np
from scipy.linalg import solve_continuous_are
from scipy.signal import place_poles

R, KT, KM = 8.4, 0.042, 0.042                       # the data sheet; put your own values here
ROTOR, ARM_KG, ARM_M, ARM_DAMPING = 4.6e-6, 0.095, 0.085, 1.5e-4
PENDULUM_KG, PENDULUM_M, PENDULUM_DAMPING = 0.024, 0.129, 3e-5
WEIGHTS = "5,30,1,1"                                # of design lqr: arm, pendulum, their speeds

a = ROTOR + ARM_KG * ARM_M**2 / 3 + PENDULUM_KG * ARM_M**2
b = -PENDULUM_KG * ARM_M * PENDULUM_M / 2           # minus: upright
c = PENDULUM_KG * PENDULUM_M**2 / 3
det = a * c - b**2
weight = -PENDULUM_KG * 9.81 * PENDULUM_M / 2
drag = KT * KM / R + ARM_DAMPING
A = np.array([[0, 0, 1, 0], [0, 0, 0, 1],
              [0, b * weight / det, -c * drag / det, b * PENDULUM_DAMPING / det],
              [0, -a * weight / det, b * drag / det, -a * PENDULUM_DAMPING / det]])
B = np.array([0, 0, c * KT / (R * det), -b * KT / (R * det)])

designed = subprocess.run(["gapscope", "design", "lqr", "models/qube/experiment.yaml", "--at",
                           "pendulum=3.141592653589793", "--q", WEIGHTS, "--json"], capture_output=True, check=True)
K = np.array(json.loads(designed.stdout)["gain"])

both, arm = np.eye(2, 4), np.eye(1, 4)
noise, readings = np.diag([0.0, 0, 1, 1]), 1e-6 * np.eye(2)
kalman = solve_continuous_are(A.T, both.T, noise, readings) @ both.T / 1e-6
placed = place_poles(A.T, arm.T, [-40, -45, -50, -55]).gain_matrix.T

INPUTS = ["{name: theta, signal: arm_rad}", "{name: alpha, signal: pendulum_rad, add: -3.141592653589793}"]
for name, C, L in (("kalman", both, kalman), ("luenberger", arm, placed)):
    with open(f"control/upright_{name}.yaml", "w") as file:
        file.write(f"""controller:
  actuator: motor
  limit: 10
  inputs: [{", ".join(INPUTS[:len(C)])}]
  references: {{theta: wanted}}
  observer: {{a: {A.tolist()}, b: {B.tolist()}, c: {C.tolist()}, gain: {L.tolist()}, feedback: {K.tolist()}}}
""")
    poles = np.sort_complex(np.linalg.eigvals(A - L @ C))
    print(f"{name:<10} L = {np.array2string(L, precision=5, suppress_small=True).replace(chr(10), '')}")
    print(f"{'':<10} poles {' '.join(f'{p.real:.5g}' if abs(p.imag) < 1e-9 else f'{p:.5g}' for p in poles)}")
