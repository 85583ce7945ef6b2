"""The Qube twin of tests/twin as numpy code, so that a controller can drive it: many plants side by side.

Equations of models/qube/README.md, dry friction as four Maxwell elements and a command that acts late, as in
tests/twin/README.md; nothing here comes from MuJoCo or from a diagnosis. `study.py` prints how far it is from
gapscope_twin on the same commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PERIOD_S = 0.002  # of the controller and of the logs
STEPS = 8  # of the integration in a period; delays are whole numbers of them
STEP_S = PERIOD_S / STEPS
COUNT_RAD = 2 * np.pi / 2048
GRAVITY = 9.81
SHARE = np.array([[0.4], [0.3], [0.2], [0.1]])  # of the friction, by element
PRESLIDING_RAD = 5e-4
SLIP_RAD = np.array([[0.3], [0.8], [1.6], [3.0]]) * PRESLIDING_RAD  # deflection at which an element slips
BRISTLE_DAMPING = 0.5  # over sqrt(stiffness inertia), while all stick


@dataclass(frozen=True)
class Truth:
    """A plant: base parameters by the names of models/qube/experiment.yaml, and the two effects."""

    base: dict[str, float]
    friction_n_m: float
    delay_s: float

    @property
    def values(self) -> dict[str, float]:
        effects = {"coulomb_friction@arm.friction_n_m": self.friction_n_m, "command_delay@motor.delay_s": self.delay_s}
        return self.base | effects


class Twin:
    """One column for each plant; the state is arm, pendulum (0 hanging), and their speeds."""

    def __init__(self, truths: Sequence[Truth], start: Floats) -> None:
        def of(name: str) -> Floats:
            return np.array([truth.base[name] for truth in truths])

        mass, length, arm = of("pendulum.mass"), of("pendulum.length"), of("arm.length")
        driven = of("arm.mass") * arm**2 / 3 + of("motor.rotor_inertia") + of("motor.hub_inertia")
        self._arm_inertia = driven + mass * arm**2
        self._rod, self._couple = mass * length**2 / 3, mass * arm * length / 2
        self._weight = mass * GRAVITY * length / 2
        self._gain = of("motor.kt") / of("motor.resistance")
        self._arm_damping = of("arm.damping") + self._gain * of("motor.km")
        self._rod_damping = of("pendulum.damping")
        self._friction = np.array([truth.friction_n_m for truth in truths])
        self._bristle_damping = BRISTLE_DAMPING * np.sqrt(self._friction / PRESLIDING_RAD * driven)
        late = np.array([round(truth.delay_s / STEP_S) for truth in truths])
        self._late, self._columns = late, np.arange(len(truths))
        self._sent = np.zeros((late.max() // STEPS + 2, len(truths)))  # newest first
        self.state = start.copy()
        self._deflection = np.zeros((len(SHARE), len(truths)))

    def read(self) -> Floats:
        """Both encoders, in rad, their zeros where the mechanism hangs at rest."""
        return np.round(self.state[:2] / COUNT_RAD) * COUNT_RAD

    def hold(self, voltage: Floats) -> None:
        """One period in which the controller sends this voltage."""
        self._sent = np.roll(self._sent, 1, axis=0)
        self._sent[0] = voltage
        for step in range(STEPS):
            self._step(self._sent[-((step - self._late) // STEPS), self._columns])

    def _step(self, voltage: Floats) -> None:
        start, torque = self.state[0].copy(), self._gain * voltage
        x = self.state
        k1 = self._rate(x, start, torque)
        k2 = self._rate(x + STEP_S / 2 * k1, start, torque)
        k3 = self._rate(x + STEP_S / 2 * k2, start, torque)
        k4 = self._rate(x + STEP_S * k3, start, torque)
        self.state = x + STEP_S / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self._deflection = np.clip(self._deflection + self.state[0] - start, -SLIP_RAD, SLIP_RAD)

    def _dry(self, moved: Floats, speed: Floats) -> Floats:
        bent = np.clip(self._deflection + moved, -SLIP_RAD, SLIP_RAD) / SLIP_RAD
        stuck = np.clip((1 - np.sign(speed) * bent) / 0.05, 0, 1)
        torque: Floats = self._friction * (SHARE * bent).sum(0)
        torque += self._bristle_damping * (SHARE * stuck).sum(0) * speed
        return torque

    def _rate(self, x: Floats, start: Floats, torque: Floats) -> Floats:
        arm, rod, arm_speed, rod_speed = x
        sine, cosine = np.sin(rod), np.cos(rod)
        swing = self._rod * sine * cosine
        first = torque - self._arm_damping * arm_speed - self._dry(arm - start, arm_speed)
        first += -2 * swing * arm_speed * rod_speed + self._couple * sine * rod_speed**2
        second = -self._rod_damping * rod_speed + swing * arm_speed**2 - self._weight * sine
        a, b = self._arm_inertia + self._rod * sine**2, self._couple * cosine
        det = a * self._rod - b**2
        return np.array([arm_speed, rod_speed, (self._rod * first - b * second) / det, (a * second - b * first) / det])
