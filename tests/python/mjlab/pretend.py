"""Stands in for what mjlab imports to compute on a GPU: its configurations and its entities need none of it."""

import importlib.abc
import importlib.machinery
import sys
import types
from typing import Any

ABSENT = {
    *("torch", "warp", "mujoco_warp", "tyro", "prettytable", "mediapy", "imageio_ffmpeg", "trimesh", "viser"),
    *("mjviser", "tensordict", "rsl_rl", "tqdm", "scipy", "moviepy", "wandb", "mjlab.viewer"),
}


class Anything:
    """Takes any call, attribute or index; as a decorator it leaves the function as it is."""

    def __init__(self, *args: Any, **named: Any) -> None:
        pass

    def __call__(self, *args: Any, **named: Any) -> Any:
        return args[0] if len(args) == 1 and callable(args[0]) and not named else Anything()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Anything()

    def __getitem__(self, key: Any) -> Any:
        return Anything()

    def __or__(self, other: Any) -> Any:
        return object

    __ror__ = __or__

    def __iter__(self) -> Any:
        return iter(())

    def __mro_entries__(self, bases: Any) -> tuple[type, ...]:
        return ()


class Absent(types.ModuleType):
    __path__: list[str] = []

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Anything()


class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        found = any(name == absent or name.startswith(absent + ".") for absent in ABSENT)
        return importlib.machinery.ModuleSpec(name, self, is_package=True) if found else None

    def create_module(self, spec: Any) -> Any:
        return Absent(spec.name)

    def exec_module(self, module: Any) -> None:
        pass


def install() -> None:
    sys.meta_path.insert(0, Finder())
