"""Experiments whose model is an MjSpec with meshes, textures and height fields, on disk and in memory."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

MESH = b"v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
MJCF = """<mujoco>
  <compiler meshdir="solids" texturedir="colours"/>
  <asset>
    <mesh name="arm" file="arm.obj"/>
    <texture name="wall" type="2d" file="wall.png"/>
    <texture name="sky" type="cube" fileright="sky.png" fileleft="sky.png"/>
    <hfield name="hill" file="hill.png" size="1 1 1 1"/>
    <material name="wall" texture="wall"/>
  </asset>
  <worldbody>
    <geom type="hfield" hfield="hill" pos="0 0 -9" material="wall" contype="0" conaffinity="0"/>
    <body name="arm">
      <joint name="arm" axis="0 1 0" damping="0.1"/>
      <geom type="mesh" mesh="arm"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="arm"/></actuator>
</mujoco>
"""


def picture() -> bytes:
    """A PNG of 8 x 8 pixels, grey."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + bytes(range(8)) for _ in range(8))
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 8, 8, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


FILES = {
    "solids/arm.obj": MESH,
    "solids/hill.png": picture(),
    "colours/wall.png": picture(),
    "colours/sky.png": picture(),
}


def error_of(spec: Any, out: Path | None = None) -> float:
    time_s = np.arange(200) * 0.002
    log = gs.Log({"time_s": time_s, "u": np.sin(9 * time_s), "arm": 0.1 * np.sin(9 * time_s)}, name="run")
    keys = {
        "model": spec,
        "commands": [{"actuator": "motor", "column": "u", "unit": "N m"}],
        "measured": [{"signal": "arm", "column": "arm", "joint": "arm", "unit": "rad"}],
    }
    return gs.replay(gs.Experiment(keys), log, out=out).error


def on_disk(folder: Path, text: str = MJCF) -> str:
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    (folder / "robot.xml").write_text(text)
    return str(folder / "robot.xml")


def test_files_on_disk_and_in_memory_are_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = on_disk(tmp_path / "robot")
    expected = error_of(path)
    assert expected > 0
    assert error_of(mujoco.MjSpec.from_file(path)) == pytest.approx(expected, rel=1e-6)
    out = tmp_path / "out"
    assert error_of(mujoco.MjSpec.from_string(MJCF, assets=dict(FILES)), out) == pytest.approx(expected, rel=1e-6)
    assert (out / "experiment_assets" / "arm.obj").read_bytes() == MESH
    bare = {Path(name).name: content for name, content in FILES.items()}
    assert error_of(mujoco.MjSpec.from_string(MJCF, assets=bare)) == pytest.approx(expected, rel=1e-6)
    monkeypatch.chdir(tmp_path / "robot")
    assert error_of(mujoco.MjSpec.from_file("robot.xml")) == pytest.approx(expected, rel=1e-6)


def test_paths_that_the_compiler_strips(tmp_path: Path) -> None:
    text = MJCF.replace("<compiler ", '<compiler strippath="true" ').replace('"arm.obj"', '"elsewhere/arm.obj"')
    path = on_disk(tmp_path, text)
    assert error_of(mujoco.MjSpec.from_file(path)) == pytest.approx(error_of(path), rel=1e-6)


def test_assets_of_what_was_attached(tmp_path: Path) -> None:
    """Two files of one name, of which MuJoCo renames the second."""
    spec = mujoco.MjSpec.from_file(on_disk(tmp_path))
    geom = '<geom type="mesh" mesh="arm" contype="0" conaffinity="0"/>'
    other = f'<mujoco><asset><mesh name="arm" file="parts/arm.obj"/></asset><worldbody><body>{geom}</body></worldbody>'
    other += "</mujoco>"
    child = mujoco.MjSpec.from_string(other, assets={"parts/arm.obj": MESH})
    spec.attach(child, frame=spec.worldbody.add_frame(pos=[3, 0, 0]), prefix="second-")
    assert error_of(spec) > 0


def test_a_file_that_is_nowhere_is_refused(tmp_path: Path) -> None:
    (tmp_path / "child").mkdir()
    (tmp_path / "child" / "leg.obj").write_bytes(MESH)
    other = '<mujoco><asset><mesh name="leg" file="leg.obj"/></asset><worldbody><body><geom type="mesh" mesh="leg"/>'
    (tmp_path / "child" / "leg.xml").write_text(other + "</body></worldbody></mujoco>")
    spec = mujoco.MjSpec.from_file(on_disk(tmp_path))
    leg = mujoco.MjSpec.from_file(str(tmp_path / "child" / "leg.xml"))
    spec.attach(leg, frame=spec.worldbody.add_frame(), prefix="leg-")
    with pytest.raises(gs.InputError, match="leg.obj") as raised:
        error_of(spec)
    assert "assets=" in raised.value.cure
    with pytest.raises(gs.InputError, match="does not compile"):
        error_of(mujoco.MjSpec.from_string(MJCF))
