#!/usr/bin/env python3
"""Draws the characteristics in the READMEs of src/plugins/motor and src/plugins/encoder by stepping the real plugins.

    python3 -m venv build/plots && build/plots/bin/pip install mujoco-core==4.0.1 numpy matplotlib
    build/plots/bin/python scripts/plots/plugin_plots.py build/lib/libgapscope_plugins.so
"""
import pathlib
import sys

import matplotlib
import mujoco
import numpy as np
from PIL import Image

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
INERTIA = 0.16  # kg m2


def joint(plugin="", numbers="", actuators="", sensors="", option="timestep='0.001'"):
    """A hinge with the given inertia, without gravity."""
    return mujoco.MjModel.from_xml_string(f"""<mujoco><option gravity='0 0 0' {option}/><extension>{plugin}</extension>
      <worldbody><body><joint name='joint' axis='0 0 1' armature='{INERTIA}'/>
        <inertial pos='0 0 0' mass='1e-12' diaginertia='1e-15 1e-15 1e-15'/></body></worldbody>
      <custom>{numbers}</custom><actuator>{actuators}</actuator><sensor>{sensors}</sensor></mujoco>""")


def motor(attributes, first="", option="timestep='0.001'"):
    config = "".join(f"<config key='{k}' value='{v}'/>" for k, v in attributes.items())
    return joint(f"<plugin plugin='gapscope.motor'><instance name='motor'>{config}</instance></plugin>",
                 actuators=f"<plugin joint='joint' plugin='gapscope.motor' instance='motor' {first}/>", option=option)


def torque(model, data, speed, command):
    mujoco.mj_resetData(model, data)
    data.qvel[0], data.ctrl[0] = speed, command
    mujoco.mj_forward(model, data)
    return data.qfrc_actuator[0]


def response(model, command, steps):
    """Joint angle and torque at each step under command(time)."""
    data = mujoco.MjData(model)
    out = []
    for _ in range(steps):
        data.ctrl[0] = command(data.time)
        time = data.time
        angle = data.qpos[0]
        mujoco.mj_step(model, data)
        out.append((time, angle, data.actuator_force[0]))
    return np.array(out).T


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=70)
    plt.close(figure)
    Image.open(path).convert("RGB").quantize(48).save(path, optimize=True)  # few colours: a small file
    size = path.stat().st_size
    print(f"{path.relative_to(ROOT)}: {size / 1000:.0f} kB")
    assert size < 60_000


def plot_motor():
    figure, axes = plt.subplots(2, 2, figsize=(10, 7.4))

    # Limits in four quadrants.
    curves = {
        "rated / peak / no-load": {"peak_torque_n_m": 3, "rated_speed_rad_per_s": 4, "no_load_speed_rad_per_s": 10},
        "torque limit and power": {"torque_limit_n_m": 2.5, "power_w": 8, "generating_power_w": 14},
        "table, cubic": {"speed_table": "0 2 5 9 12", "torque_table": "2 1.95 1.6 0.6 0",
                         "table_interpolation": "cubic", "generating_torque_table": "2 2 1.8 1.5 1.2"},
    }
    speeds = np.linspace(-13, 13, 521)
    for color, (name, attributes) in enumerate(curves.items()):
        model = motor({"law": "torque", **attributes})
        data = mujoco.MjData(model)
        for sign in (1, -1):
            axes[0, 0].plot(speeds, [torque(model, data, w, sign * 1e6) for w in speeds], f"C{color}",
                            label=name if sign > 0 else None)
    axes[0, 0].set(title="Largest torque, four quadrants", xlabel="speed [rad/s]", ylabel="torque [N m]")

    # Static characteristics.
    requests = np.linspace(-4, 4, 401)
    for name, attributes in {"neutral": {}, "dead zone 0.5": {"dead_zone": 0.5},
                             "droop 0.3 at 4 N m": {"droop_at_peak": 0.3, "droop_reference_n_m": 4},
                             "asymmetry 0.2": {"asymmetry": 0.2}, "limit 2.5": {"torque_limit_n_m": 2.5}}.items():
        model = motor({"law": "torque", **attributes})
        data = mujoco.MjData(model)
        axes[0, 1].plot(requests, [torque(model, data, 0, u) for u in requests], label=name)
    axes[0, 1].set(title="Torque at standstill", xlabel="request [N m]", ylabel="torque [N m]")

    # Time: the torque after a step of the request.
    step = lambda t: 0.0 if t < 0.005 - 1e-9 else 1.0  # noqa: E731
    for name, attributes, first in (("command delay 7.5 ms", {"command_delay_s": 0.0075}, ""),
                                    ("lag 10 ms", {"time_constant_s": 0.01}, "actdim='1'"),
                                    ("lags 8 ms and 2 ms", {"time_constant_s": 0.008, "second_time_constant_s": 0.002},
                                     "actdim='2'"),
                                    ("limit 1, sag 0.4 in 20 ms", {"torque_limit_n_m": 1, "sag_fraction": 0.4,
                                                                 "sag_time_constant_s": 0.02}, "actdim='1'")):
        time, _, out = response(motor({"law": "torque", **attributes}, first), step, 60)
        axes[1, 0].step(1e3 * time, out, where="post", label=name)
    axes[1, 0].set(title="Torque after a step of 1 N m at 5 ms", xlabel="time [ms]", ylabel="torque [N m]")

    # The servo's loop.
    step = lambda t: 0.0 if t < 0.02 - 1e-9 else 0.1  # noqa: E731
    for name, attributes, first in (("neutral", {}, ""), ("command delay 10 ms", {"command_delay_s": 0.01}, ""),
                                    ("torque delay 10 ms", {"torque_delay_s": 0.01}, ""),
                                    ("lag 10 ms", {"time_constant_s": 0.01}, "actdim='1'")):
        time, angle, _ = response(motor({"law": "position", "kp": 157, "kd": 7, **attributes}, first), step, 300)
        axes[1, 1].plot(1e3 * time, angle, label=name)
    axes[1, 1].set(title="Position servo after a step of 0.1 rad", xlabel="time [ms]", ylabel="angle [rad]")

    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    save(figure, ROOT / "src/plugins/motor/characteristic.png")


def plot_encoder():
    config = "".join(f"<config key='{k}' value='{v}'/>" for k, v in
                     {"resolution_rad": 0.02, "delay_s": 0.015, "time_constant_s": 0.01, "velocity": "true"}.items())
    model = joint(f"<plugin plugin='gapscope.encoder'><instance name='encoder'>{config}</instance></plugin>",
                  actuators="<motor joint='joint'/>", option="timestep='0.001' integrator='RK4'",
                  sensors="<plugin objtype='joint' objname='joint' plugin='gapscope.encoder' instance='encoder'/>")
    data = mujoco.MjData(model)
    rows = []
    for _ in range(400):
        data.ctrl[0] = 6 * np.sin(20 * data.time)
        row = [data.time, data.qpos[0], data.qvel[0]]
        mujoco.mj_step(model, data)
        rows.append(row + list(data.sensordata))
    time, angle, speed, read_angle, read_speed = np.array(rows).T
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.6))
    axes[0].plot(time, angle, label="joint")
    axes[0].plot(time, read_angle, label="encoder: 15 ms late, steps of 0.02 rad")
    axes[0].set(title="Angle", xlabel="time [s]", ylabel="angle [rad]")
    axes[1].plot(time, speed, label="joint")
    axes[1].plot(time, read_speed, label="reported, filter 10 ms")
    axes[1].set(title="Speed from those readings", xlabel="time [s]", ylabel="speed [rad/s]")
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    save(figure, ROOT / "src/plugins/encoder/characteristic.png")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    mujoco.mj_loadPluginLibrary(sys.argv[1])
    plot_motor()
    plot_encoder()


if __name__ == "__main__":
    main()
