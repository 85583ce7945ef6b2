"""An MjSpec as an MJCF that can stand in any folder: the files that it names go along, or are named in full."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from gapscope._errors import InputError

FOLDER = "experiment_assets"  # beside the MJCF
_FOLDERS = {"mesh": "meshdir", "hfield": "meshdir", "skin": "meshdir", "texture": "texturedir"}  # by element


@dataclass
class Written:
    """``xml``, and of the files that it names below `FOLDER` the bytes by name."""

    xml: str
    files: dict[str, bytes] = field(default_factory=dict)

    def write(self, path: Path) -> None:
        """The MJCF as ``path``, its files beside it."""
        path.write_text(self.xml, encoding="utf-8")
        for name, content in self.files.items():
            (path.parent / FOLDER).mkdir(exist_ok=True)
            (path.parent / FOLDER / name).write_bytes(content)

    def add(self, name: str, content: bytes) -> str:
        """What the MJCF calls a file that it gets; equal names of unequal files are told apart."""
        if self.files.get(name, content) != content:
            name = f"{len(self.files)}_{name}"
        self.files[name] = content
        return f"{FOLDER}/{name}"


def written(spec: Any) -> Written:
    """The MjSpec as it is now. Meshes, height fields, skins and textures of its own ``assets`` become files to write.

    Those on disk are named by their absolute paths. Raises InputError: it does not compile, a file is in neither place.
    """
    try:
        spec.compile()
    except ValueError as error:
        raise InputError("an MjSpec that does not compile", "Experiment, model", str(error)) from None
    root = ElementTree.fromstring(spec.to_xml())
    compiler = next(iter(root.iter("compiler")), ElementTree.Element("compiler"))
    folders = {name: compiler.attrib.pop(name, "") for name in ("meshdir", "texturedir")}
    strip = compiler.attrib.pop("strippath", "false") == "true"
    result = Written("")
    for element in root.iter():
        for key in [key for key in element.attrib if element.tag in _FOLDERS and key.startswith("file")]:
            name = element.attrib[key]
            name = PurePosixPath(name).name if strip else name
            element.set(key, _place(spec, Path(folders[_FOLDERS[element.tag]]), name, result))
    result.xml = ElementTree.tostring(root, encoding="unicode")
    return result


def _place(spec: Any, folder: Path, name: str, result: Written) -> str:
    """Where the file ``name`` of an element is found from any folder. Assets go before the disk, as in MuJoCo."""
    assets: Mapping[str, Any] = getattr(spec, "assets", None) or {}
    same = [key for key in assets if PurePosixPath(key).name == PurePosixPath(name).name]
    key = next((key for key in (str(folder / name), name) if key in assets), same[0] if len(same) == 1 else None)
    if key is not None:
        content = assets[key]
        return result.add(PurePosixPath(key).name, content.encode() if isinstance(content, str) else bytes(content))
    path = (Path(getattr(spec, "modelfiledir", "")) / folder / name).absolute()
    if not path.is_file():
        raise InputError(
            "a file of the MjSpec that is not there",
            "Experiment, model",
            str(path),
            ", ".join(sorted(assets)),
            "MjSpec.from_string(xml, assets={NAME: bytes}), absolute paths in what was attached, or model: a path",
        )
    return str(path)
