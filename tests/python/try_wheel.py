"""What scripts/wheel runs in a fresh environment: the demo through the installed package.

try_wheel.py EXPERIMENT LOG MUJOCO_VERSION      MUJOCO_VERSION is empty where there is no mujoco
"""

import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import gapscope as gs

experiment, log, version = sys.argv[1:]
site = Path(gs.__file__).parent
assert "site-packages" in str(site), site
command = Path(sys.executable).with_name("gapscope")
said = subprocess.run([command, "--version"], check=True, capture_output=True, text=True).stdout
assert said.startswith("gapscope "), said

nominal = gs.replay(experiment, log)
TRUTH = {
    "cable_spring@arm.stiffness_n_m_per_rad": 0.0012,
    "cable_spring@arm.rest_rad": -0.4,
    "coulomb_friction@arm.friction_n_m": 0.0006,
}
repaired = gs.replay(experiment, log, with_=["cable_spring@arm", "coulomb_friction@arm"], set=TRUTH)
print(f"  {said.strip()}: error {nominal.error:.4g}, with spring and friction {repaired.error:.4g}")
assert nominal.error > 1 and repaired.error < 0.01
shared = site / "share" / "gapscope"
assert (shared / "models" / "qube" / "experiment.yaml").is_file()
assert (shared / "schemas" / "replay.schema.json").is_file()

# What it holds is named, each with a licence.
holds = {str(file).partition("/")[2]: file for file in metadata.files("gapscope") or []}
packages = {one["name"]: one for one in json.loads(holds["sboms/gapscope.spdx.json"].read_text())["packages"]}
for library in site.parent.joinpath("gapscope.libs").iterdir():
    assert any(library.name.split("-")[0] in name for name in packages), library
assert packages["mujoco"]["licenseDeclared"] == "Apache-2.0", packages["mujoco"]
assert any(name.startswith("licenses/libnlopt") for name in holds), sorted(holds)

if not version:
    try:
        gs.load_plugins()
    except ModuleNotFoundError:
        pass
    else:
        raise AssertionError("there is a mujoco")
    sys.exit()

import mujoco  # noqa: E402

assert mujoco.mj_versionString() == version
if version.startswith("4."):  # known without a word of code
    plugin = gs.replay(experiment, log, with_="dead_zone@motor").model.xml()
    assert "gapscope.motor" in plugin
    mujoco.MjModel.from_xml_string(plugin)
spring = {name: value for name, value in TRUTH.items() if name.startswith("cable_spring")}
model, data = gs.replay(experiment, log, with_=["cable_spring@arm", "dead_zone@motor"], set=spring).model.mujoco()
gs.load_plugins()  # again: harmless
while data.time < 0.5:
    mujoco.mj_step(model, data)
# The spring pulls the arm to where it rests; with the friction it would stick.
angle = float(data.joint("arm").qpos[0])
print(f"  mujoco {version}: {gs.plugin_library()}, arm at {angle:.3f} rad after {data.time:.1f} s")
assert -0.8 < angle < -0.1
maps = Path("/proc/self/maps").read_text()
mapped = {line.split()[-1] for line in maps.splitlines() if "libmujoco.so" in line}
assert len(mapped) == 1, mapped
