"""What scripts/wheel runs in a fresh environment: the demo through the installed package.

try_wheel.py EXPERIMENT LOG MUJOCO_VERSION      MUJOCO_VERSION is empty where there is no mujoco, but the extra mcap
"""

import json
import os
import subprocess
import sys
import tempfile
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


def goes_through_mcap() -> None:
    """The log as MCAP: by the converter a table, and by the program, which starts that, what it is itself."""
    from mcap.writer import Writer

    demo = gs.Log(log)
    names = [name for name in demo.columns if name != "time_s"]
    with tempfile.TemporaryDirectory() as folder:
        run, bound, table = (Path(folder) / name for name in ("run.mcap", "experiment.yaml", "run.npz"))
        with run.open("wb") as stream:
            writer = Writer(stream)
            writer.start()
            channel = writer.register_channel("/run", "json", 0)
            for time_s, *values in zip(demo["time_s"], *(demo[name] for name in names)):
                ns = round(1e9 * time_s)
                writer.add_message(channel, ns, json.dumps(dict(zip(names, values))).encode(), ns)
            writer.finish()
        text = Path(experiment).read_text().replace("model: ", f"model: {Path(experiment).parent}/")
        for name in names:
            text = text.replace(f"column: {name}", f"column: /run/{name}")
        bound.write_text(text)
        env = {**os.environ, "GAPSCOPE_CACHE_DIR": folder}
        subprocess.run([command.with_name("gapscope-convert"), run, "--out", table], check=True, env=env)
        assert all((gs.Log(table)[f"/run/{name}"] == demo[name]).all() for name in names)
        call = [command, "replay", bound, run, "--json"]
        error = json.loads(subprocess.run(call, check=True, capture_output=True, env=env).stdout)["error"]
    print(f"  from MCAP: error {error:.4g}")
    assert abs(error / nominal.error - 1) < 1e-6


if not version:
    goes_through_mcap()
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
