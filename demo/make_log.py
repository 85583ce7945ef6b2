#!/usr/bin/env python3
"""Makes demo/qube.csv: a rotary pendulum whose arm has what models/qube lacks, a cable that pulls to a rest angle and
dry friction.

The equations are those of models/qube/README.md, integrated here in steps of 20 us with no simulator, so that the demo
does not compare the program with itself. Encoders have 2048 counts per revolution. Usage: demo/make_log.py >
demo/qube.csv
"""
import math

# Nominal values of models/qube, and the two effects.
R, KT, L, M, LENGTH, G = 8.4, 0.042, 0.085, 0.024, 0.129, 9.81
J_ARM = 0.095 * L**2 / 3 + 4.6e-6
B_ARM, B_PENDULUM = 1.5e-4, 3.0e-5
CABLE_N_M_PER_RAD, CABLE_REST_RAD = 1.2e-3, -0.4
COULOMB_N_M, COULOMB_WIDTH_RAD_PER_S = 6.0e-4, 1e-3
STEP_S, SAMPLE_S, END_S = 2e-5, 2e-3, 10.0
COUNT_RAD = 2 * math.pi / 2048


def voltage(t):
    """A sweep from 6 Hz down to 0.8 Hz that fades in."""
    phase = 2 * math.pi * (6.0 * t - 0.5 * (6.0 - 0.8) * t * t / END_S)
    return 1.5 * min(1.0, t / 0.5) * math.sin(phase)


def slope(x, v):
    theta, alpha, w, u = x
    s, c = math.sin(alpha), math.cos(alpha)
    j = M * LENGTH**2 / 3
    torque = KT * (v - KT * w) / R - B_ARM * w
    torque -= CABLE_N_M_PER_RAD * (theta - CABLE_REST_RAD) + COULOMB_N_M * math.tanh(w / COULOMB_WIDTH_RAD_PER_S)
    right_arm = torque - 2 * j * s * c * w * u + 0.5 * M * L * LENGTH * s * u * u
    right_pendulum = -B_PENDULUM * u + j * s * c * w * w - 0.5 * M * G * LENGTH * s
    a, b = J_ARM + M * L**2 + j * s * s, 0.5 * M * L * LENGTH * c
    d = a * j - b * b
    return (w, u, (j * right_arm - b * right_pendulum) / d, (a * right_pendulum - b * right_arm) / d)


def runge_kutta(x, v, h):
    k1 = slope(x, v)
    k2 = slope([p + 0.5 * h * q for p, q in zip(x, k1)], v)
    k3 = slope([p + 0.5 * h * q for p, q in zip(x, k2)], v)
    k4 = slope([p + h * q for p, q in zip(x, k3)], v)
    return [p + h / 6 * (a + 2 * b + 2 * c + d) for p, a, b, c, d in zip(x, k1, k2, k3, k4)]


def main():
    x = [0.0, 0.0, 0.0, 0.0]
    print("time_s,voltage_v,arm_rad,pendulum_rad")
    for k in range(round(END_S / SAMPLE_S) + 1):
        v = round(voltage(k * SAMPLE_S), 4)
        arm, pendulum = (round(q / COUNT_RAD) * COUNT_RAD for q in x[:2])
        print(f"{k * SAMPLE_S:.3f},{v:.4f},{arm:.6f},{pendulum:.6f}")
        for _ in range(round(SAMPLE_S / STEP_S)):
            x = runge_kutta(x, v, STEP_S)


if __name__ == "__main__":
    main()
