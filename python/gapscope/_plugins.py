"""The MuJoCo plugins for the mujoco that the user has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from _gapscope_mujoco import libraries
from gapscope._errors import InputError, import_needed

_PLUGIN = "gapscope.motor"  # one of the library's


def users_mujoco() -> Any:
    """The module. MissingLibrary: there is none."""
    return import_needed("mujoco", "no MuJoCo in this environment", "mujoco")


def plugin_library() -> Path:
    """The plugin library for the mujoco that is installed.

    Raises InputError: there is none for its version. MissingLibrary: there is no mujoco.
    """
    version, found = str(users_mujoco().mj_versionString()), libraries()
    path = found.get(version)
    if path is None or not path.is_file():
        raise InputError(
            "no plugins for this version of MuJoCo",
            where="gapscope.plugin_library()",
            actual=version,
            allowed=", ".join(sorted(found)) or "none: the plugins are not built",
            cure="install one of these versions of mujoco",
        )
    return path


def load_plugins() -> None:
    """Makes the plugins known to the mujoco that is installed; harmless where they are known.

    MuJoCo from 4.0 on does this by itself when it is imported. Raises as `plugin_library`.
    """
    mujoco, path = users_mujoco(), plugin_library()
    if not _registered(mujoco):
        mujoco.mj_loadPluginLibrary(str(path))


def _registered(mujoco: Any) -> bool:
    """Whether MuJoCo knows the plugins: a model that names one compiles. Python cannot ask otherwise."""
    try:
        mujoco.MjModel.from_xml_string(f'<mujoco><extension><plugin plugin="{_PLUGIN}"/></extension></mujoco>')
    except ValueError:
        return False
    return True
