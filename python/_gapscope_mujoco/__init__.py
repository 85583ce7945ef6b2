"""What MuJoCo 4.0 and newer call when they are imported (entry point ``mujoco.plugins``).

A package of its own: with ``import mujoco`` nothing else of gapscope is imported.
"""

from __future__ import annotations

import os
from pathlib import Path

_SITE = Path(__file__).resolve().parents[1]
_NAME = "libgapscope_plugins.so"


def libraries() -> dict[str, Path]:
    """The plugin libraries that there are, by the version of MuJoCo that they were built for."""
    package = _SITE / "gapscope"
    if (package / "bin").is_dir():
        return {path.parent.name: path for path in sorted(package.glob(f"plugins/*/{_NAME}"))}
    build = _SITE.parent / "build"  # of a checkout: of the one version that it is built with
    return {path.name.removeprefix("mujoco-"): build / "lib" / _NAME for path in build.glob("mujoco-*")}


def register() -> None:
    """Loads the plugins built for this version of MuJoCo. Silent where there are none: mujoco is not ours.

    GAPSCOPE_NO_PLUGINS=1 turns it off.
    """
    if os.environ.get("GAPSCOPE_NO_PLUGINS"):
        return
    import mujoco

    path = libraries().get(str(mujoco.mj_versionString()))
    if path is not None and path.is_file():
        mujoco.mj_loadPluginLibrary(str(path))
