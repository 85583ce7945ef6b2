"""One procedure that makes a balancing controller of whatever MJCF it is given, by stock mujoco alone.

The model is linearised upright by finite differences. State feedback comes from the Riccati equation with the commands
under way as states, the speeds from a Kalman filter. The model's own delay and dry friction are used as they stand
there: none in the nominal model.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from plant import COUNT_RAD, PERIOD_S, Floats
from scipy.linalg import expm, solve_discrete_are

UPRIGHT = np.array([0.0, np.pi])
LIMIT_V = 10.0
UNKNOWN_V = 0.3  # of the filter: standard deviation of the voltage that the model does not know
SMOOTH_RAD_PER_S = 0.5  # of the sign of speed in dry friction


@dataclass(frozen=True)
class Linear:
    """x' = A x + B u upright, u acting ``delay_s`` late, against a dry friction of ``friction_v`` volts.

    x is arm, pendulum, their speeds, and what the drive's lag has as state, where the model has one.
    """

    a: Floats
    b: Floats
    delay_s: float
    friction_v: float


def linearise(mjcf: Path) -> Linear:
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    friction = float(model.dof_frictionloss[0])
    delay = float(model.actuator_delay[0])
    model.dof_frictionloss[:] = 0
    model.actuator_delay[:] = 0
    data = mujoco.MjData(model)

    def rate(x: Floats) -> Floats:
        data.qpos[:], data.qvel[:], data.act[:], data.ctrl[0] = UPRIGHT + x[:2], x[2:4], x[4:-1], x[-1]
        mujoco.mj_forward(model, data)
        return np.concatenate([data.qvel, data.qacc, data.act_dot])

    step = 1e-5
    slopes = np.array([rate(d) - rate(-d) for d in step * np.eye(5 + model.na)]).T / (2 * step)
    a, b = slopes[:, :-1], slopes[:, -1]
    return Linear(a, b, delay, friction / float(model.actuator_gainprm[0, 0]))


def _held(linear: Linear, time_s: float) -> tuple[Floats, Floats]:
    """Exact over a time in which the input is held."""
    n = len(linear.b)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = linear.a, linear.b
    exact = expm(block * time_s)
    return exact[:n, :n], exact[:n, n]


@dataclass(frozen=True)
class Weights:
    """Of the squared arm, pendulum, their speeds; and of the squared voltage."""

    state: tuple[float, float, float, float]
    voltage: float


class Controller:
    """Balances upright with the arm at a wanted angle; one column for each rig that it drives."""

    def __init__(self, linear: Linear, weights: Weights, rigs: int) -> None:
        self._friction_v = linear.friction_v
        self._a, whole = _held(linear, PERIOD_S)
        late = int(linear.delay_s / PERIOD_S)
        n = len(whole)
        _, newer = _held(linear, (late + 1) * PERIOD_S - linear.delay_s)
        older = whole - newer
        size = n + late + 1  # the state, then the commands under way, newest first
        a, b = np.zeros((size, size)), np.zeros((size, 1))
        a[:n, :n] = self._a
        a[:n, n + late] = older
        if late:
            a[:n, n + late - 1] = newer
        else:
            b[:n, 0] = newer
        b[n, 0] = 1
        a[n + 1 :, n:-1] = np.eye(late)
        q = np.diag([*weights.state, *np.zeros(size - 4)])
        cost = solve_discrete_are(a, b, q + 1e-12 * np.eye(size), [[weights.voltage]])
        self._gain = np.linalg.solve(weights.voltage + b.T @ cost @ b, b.T @ cost @ a)[0]
        self._ahead = np.linalg.matrix_power(a, late + 1)[2]  # the arm's speed when a command acts
        self._whole, self._newer, self._older, self._late = whole, newer, older, late
        noise = UNKNOWN_V**2 * np.outer(whole, whole) + 1e-12 * np.eye(n)
        see = np.eye(2, n)
        spread = solve_discrete_are(self._a.T, see.T, noise, COUNT_RAD**2 / 12 * np.eye(2))
        self._filter = spread @ see.T @ np.linalg.inv(see @ spread @ see.T + COUNT_RAD**2 / 12 * np.eye(2))
        self._state = np.zeros((n, rigs))
        self._under_way = np.zeros((late + 1, rigs))
        self._sent = np.zeros((late + 2, rigs))
        self._begun = False

    def command(self, read: Floats, wanted_rad: float) -> Floats:
        seen = read - UPRIGHT[:, None]
        if not self._begun:
            self._state[:2], self._begun = seen, True
        self._state += self._filter @ (seen - self._state[:2])
        error = np.vstack([self._state, self._under_way])
        error[0] -= wanted_rad
        wish = np.clip(-self._gain @ error, -LIMIT_V, LIMIT_V)
        speed = self._ahead @ error
        send: Floats = np.clip(wish + self._friction_v * np.tanh(speed / SMOOTH_RAD_PER_S), -LIMIT_V, LIMIT_V)
        self._under_way = np.vstack([wish, self._under_way[:-1]])
        self._sent = np.vstack([send, self._sent[:-1]])
        drag = self._friction_v * np.tanh(self._state[2] / SMOOTH_RAD_PER_S)
        self._state = self._a @ self._state - np.outer(self._whole, drag)
        self._state += np.outer(self._newer, self._sent[self._late]) + np.outer(self._older, self._sent[self._late + 1])
        return send
