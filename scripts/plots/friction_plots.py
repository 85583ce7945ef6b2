#!/usr/bin/env python3
"""Draws the characteristics of gapscope.friction and gapscope.spring by stepping the plugins themselves.

  python3 -m venv V && V/bin/pip install mujoco-core==4.0.1 numpy matplotlib
  V/bin/python scripts/plots/friction_plots.py build/lib/libgapscope_plugins.so

Writes src/plugins/friction/characteristic.png and src/plugins/spring/characteristic.png.
"""
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
INERTIA = 0.01


def model(plugin, config, step_s=0.001):
  settings = "".join(f'<config key="{k}" value="{v}"/>' for k, v in config.items())
  return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step_s}" integrator="implicitfast"><flag contact="disable" gravity="disable"/></option>
  <extension><plugin plugin="{plugin}">
    <instance name="p"><config key="joint" value="j"/>{settings}</instance>
  </plugin></extension>
  <worldbody><body>
    <joint name="j" axis="0 0 1" frictionloss="1e-9" solimpfriction=".9999 .9999 .001 .5 2"
           solreffriction="-1 {-0.9999 / step_s}"/>
    <inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>
    <plugin plugin="{plugin}" instance="p"/>
  </body></worldbody>
  <actuator><motor joint="j"/></actuator>
</mujoco>""")


def friction_at_speeds(config, speeds, torque=0.0):
  """Friction torque at imposed speeds, from the acceleration of a free wheel under a motor torque."""
  m = model("gapscope.friction", config, 1e-4)
  d = mujoco.MjData(m)
  result = []
  for speed in speeds:
    mujoco.mj_resetData(m, d)
    d.qvel[0], d.ctrl[0] = speed, torque
    mujoco.mj_step(m, d)
    result.append(INERTIA * d.qacc[0] - torque)
  return np.array(result)


def friction_figure():
  figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), constrained_layout=True)
  speeds = np.concatenate([np.linspace(-6, -0.02, 200), np.linspace(0.02, 6, 200)])
  coulomb = {"friction_n_m": 0.1}
  stribeck = coulomb | {"breakaway_n_m": 0.16, "stribeck_speed_rad_per_s": 0.6}
  for name, config, torque in [
      ("Coulomb", coulomb, 0),
      ("+ Stribeck", stribeck, 0),
      ("+ viscous, drag", stribeck | {"viscous_n_m_s_per_rad": 0.005, "quadratic_n_m_s2_per_rad2": 0.001}, 0),
      ("Coulomb, load 0.2 x 0.4 N m,\nhalf of it back-driven",
       coulomb | {"load_coefficient": 0.2, "backdrive_factor": 0.5}, 0.4),
      ("by direction: +0.06, +0.02", coulomb | {"friction_positive_n_m": 0.06, "friction_negative_n_m": 0.02}, 0)]:
    values = friction_at_speeds(config, speeds, torque)
    # No line through standstill, where any torque up to the level holds.
    values[np.searchsorted(speeds, 0) - 1] = np.nan
    left.plot(speeds, values, label=name, lw=1.4)
  left.set(xlabel="speed, rad/s", ylabel="friction torque, N m", title="sliding")
  left.legend(fontsize=7)

  # A slow torque, up and down within and then beyond the level.
  for name, config in [("dry", {"friction_n_m": 0.1, "row_softness": 0.01}),
                       ("LuGre, sigma0 20 N m/rad", {"model": "lugre", "friction_n_m": 0.1, "sigma0_n_m_per_rad": 20,
                                                    "sigma1_n_m_s_per_rad": 0.3})]:
    m = model("gapscope.friction", config)
    d = mujoco.MjData(m)
    angle, torque = [], []
    for t in np.arange(0, 20, m.opt.timestep):
      d.ctrl[0] = np.interp(t, [0, 5, 10, 15, 20], [0, 0.085, -0.085, 0.085, 0.0985])
      mujoco.mj_step(m, d)
      angle.append(1e3 * d.qpos[0])
      torque.append(d.ctrl[0])
    right.plot(angle[::20], torque[::20], label=name, lw=1.4)
  right.set(xlabel="angle, mrad", ylabel="applied torque, N m", title="presliding")
  right.legend(fontsize=7)
  return figure


def spring_figure():
  figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), constrained_layout=True)
  sweep = np.concatenate([np.linspace(a, b, 120)
                          for a, b in [(0, 1), (1, -1), (-1, 1), (1, 0.2), (0.2, 0.7), (0.7, 0.2)]])
  for name, config in [("stiffness 0.3, rest 0.2", {"stiffness_n_m_per_rad": 0.3, "rest_rad": 0.2}),
                       ("+ hysteresis 0.06 over 0.08 rad",
                        {"stiffness_n_m_per_rad": 0.3, "rest_rad": 0.2, "hysteresis_n_m": 0.06,
                         "hysteresis_rad": 0.08}),
                       ("+ cubic 0.25", {"stiffness_n_m_per_rad": 0.3, "rest_rad": 0.2, "cubic_n_m_per_rad3": 0.25})]:
    m = model("gapscope.spring", config)
    m.dof_armature[0] = 1e9  # carried along at the speed it is given
    d = mujoco.MjData(m)
    torque = []
    for q in sweep:
      d.qvel[0] = (q - d.qpos[0]) / m.opt.timestep
      mujoco.mj_step(m, d)
      mujoco.mj_forward(m, d)
      torque.append(d.qfrc_passive[0])
    left.plot(sweep, torque, label=name, lw=1.4)
  left.set(xlabel="angle, rad", ylabel="torque, N m", title="cable, hardening")
  left.legend(fontsize=7)

  angles = np.linspace(-np.pi, np.pi, 400)
  for name, config in [("gravity 0.2, rest 0.5", {"gravity_n_m": 0.2, "gravity_rest_rad": 0.5}),
                       ("cogging 0.05, 7 per rev, second 0.02",
                        {"cogging_n_m": 0.05, "cogging_periods_per_rev": 7, "cogging_second_n_m": 0.02}),
                       ("bias 0.1", {"bias_n_m": 0.1})]:
    m = model("gapscope.spring", config)
    d = mujoco.MjData(m)
    torque = []
    for q in angles:
      d.qpos[0] = q
      mujoco.mj_forward(m, d)
      torque.append(d.qfrc_passive[0])
    right.plot(angles, torque, label=name, lw=1.4)
  right.set(xlabel="angle, rad", ylabel="torque, N m", title="gravity, cogging, bias")
  right.legend(fontsize=7)
  return figure


def main():
  mujoco.mj_loadPluginLibrary(str(pathlib.Path(sys.argv[1]).resolve()))
  for name, draw in [("friction", friction_figure), ("spring", spring_figure)]:
    figure = draw()
    for axes in figure.axes:
      axes.grid(alpha=0.3)
    path = ROOT / "src" / "plugins" / name / "characteristic.png"
    figure.savefig(path, dpi=80)
    print(path, path.stat().st_size, "bytes")


if __name__ == "__main__":
  main()
